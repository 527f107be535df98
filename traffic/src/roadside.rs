//! Objects along a road besides guard rails: signs, gantries and trees at equal distances.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{Check, ConfigError, Num, Parameters, Range, Road};

/// Least and greatest distance between two things of a kind (m).
const SPACING_M: Range = Range::closed(5.0, 10_000.0);

/// What stands along a road, as a scenario file describes it.
///
/// The LiDARs see these things, and the camera's images show them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct RoadsideConfig {
    /// Distance between two signs beside the right edge, which face the traffic with
    /// retro-reflective sheeting (m). Default: no signs.
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

/// Distance of the near edge of a sign, and of the legs of a gantry, from the edge of the road (m):
/// a hard shoulder of 2.5 m, and the clearance of 1.5 m (assumption within the usual cross-sections
/// of German motorways, RAA 2008).
pub const BESIDE_M: f64 = 4.0;
/// Width and height of a sign (m), and height of its lower edge (m) (assumption).
pub const SIGN_M: [f64; 3] = [1.0, 1.0, 1.5];
/// Thickness of the face and of the back of a sign (m).
pub const SHEET_M: f64 = 0.02;
/// Half of the width of the post of a sign, and of a leg of a gantry (m).
pub const LEG_HALF_M: [f64; 2] = [0.04, 0.2];
/// Heights of the lower and of the upper edge of a gantry's signs (m): above the clearance of 4.7 m
/// (assumption).
pub const GANTRY_M: [f64; 2] = [5.0, 6.5];
/// Distance of the stem of a tree from the edge of the road, half of its width, and its height (m)
/// (assumption).
pub const TREE_M: [f64; 3] = [7.5, 0.2, 6.0];

/// Returns the lateral position of the traffic's outer edge of a road (m), and the direction from
/// there away from the road: -1 to the right, or 1 on a reversed road, whose outer edge is d = 0.
pub fn outer_edge(road: &Road) -> (f64, f64) {
    if road.is_reversed() { (0.0, 1.0) } else { (road.right_edge_m(), -1.0) }
}

/// Returns the positions along the road (m) of the things of a kind from `reach_m` behind `s_m` on.
/// They are multiples of their spacing, wherever the ego is.
pub fn positions_m(spacing_m: Option<f64>, s_m: f64, reach_m: f64) -> impl Iterator<Item = f64> {
    let spacing_m = spacing_m.unwrap_or(f64::INFINITY);
    let first = ((s_m - reach_m) / spacing_m).ceil();
    let from_first = (0..).map(move |index| (first + f64::from(index)) * spacing_m);
    from_first.take_while(move |at_m| *at_m < s_m)
}
