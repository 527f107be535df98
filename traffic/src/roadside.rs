//! What stands along a road besides guard rails: signs, gantries and trees at equal distances.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{Check, ConfigError, Num, Parameters, Range};

/// Least and greatest distance between two things of a kind (m).
const SPACING_M: Range = Range::closed(5.0, 10_000.0);

/// What stands along a road, as a scenario file describes it.
///
/// The LiDARs see these things; the camera's images do not show them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct RoadsideConfig {
    /// Distance between two signs beside the right edge, which face the traffic with retro-reflective sheeting (m). Default: no signs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sign_spacing_m: Option<Num>,
    /// Distance between two gantries over the road, with signs (m). Default: no gantries.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gantry_spacing_m: Option<Num>,
    /// Distance between two trees beside the right edge (m). Default: no trees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tree_spacing_m: Option<Num>,
}

impl RoadsideConfig {
    /// Returns true if nothing stands along the road.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// What stands along a road.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Roadside {
    /// Distance between two signs (m).
    pub sign_spacing_m: Option<f64>,
    /// Distance between two gantries (m).
    pub gantry_spacing_m: Option<f64>,
    /// Distance between two trees (m).
    pub tree_spacing_m: Option<f64>,
}

impl Check for RoadsideConfig {
    type Checked = Roadside;

    fn check(&self, parameters: &Parameters) -> Result<Roadside, ConfigError> {
        let spacing =
            |num: &Option<Num>, key| num.as_ref().map(|num| parameters.number(num, key, SPACING_M)).transpose();
        Ok(Roadside {
            sign_spacing_m: spacing(&self.sign_spacing_m, "sign-spacing-m")?,
            gantry_spacing_m: spacing(&self.gantry_spacing_m, "gantry-spacing-m")?,
            tree_spacing_m: spacing(&self.tree_spacing_m, "tree-spacing-m")?,
        })
    }
}
