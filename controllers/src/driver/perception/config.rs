//! How a driver perceives the vehicles ahead, as a scenario file describes it: how far ahead the
//! driver looks, and whether it accumulates evidence.

use closecall_traffic::{Check, ConfigError, Num, Parameters, Problem, Range};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::evidence::{Evidence, EvidenceConfig};
use crate::driver::reaction::ReactionChange;

/// Sensitivity to the second leader if the scenario gives none, as a share of the sensitivity to
/// the vehicle ahead (-): the mean of drivers on a motorway, seen from a helicopter (Hoogendoorn
/// and Ossen, *Empirical analysis of two-leader car-following behavior*, European Journal of
/// Transport and Infrastructure Research 6 (2006), abstract). Range for an ensemble: 0 to 1; the
/// drivers differed much, and some were more sensitive to the second leader than to the first.
const DEFAULT_ANTICIPATION: f64 = 0.5;

/// How a driver perceives the vehicles ahead, as a scenario file describes it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct PerceptionConfig {
    /// Anticipation: the sensitivity to the second leader, the next vehicle beyond the one ahead,
    /// as a share of the sensitivity to the vehicle directly ahead: 0 (the driver watches only that
    /// one) to 1. Where the driver sees the second leader, it brakes with this share of the
    /// deceleration with which it would follow it directly, and at its brake light it expects the
    /// vehicle ahead to brake with this share of its deceleration. Default: 0.5.
    pub anticipation: Option<Num>,
    /// Accumulation of looming evidence, in place of the fixed looming threshold and of the brake
    /// light. Default: none.
    pub evidence: Option<EvidenceConfig>,
}

/// Checked settings of a driver's perception.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PerceptionSettings {
    /// Sensitivity to the second leader, as a share of the sensitivity to the vehicle ahead (-).
    pub(crate) anticipation: f64,
    /// Accumulation of looming evidence, if the driver accumulates it.
    pub(crate) evidence: Option<Evidence>,
}

impl Default for PerceptionSettings {
    fn default() -> Self {
        Self { anticipation: DEFAULT_ANTICIPATION, evidence: None }
    }
}

impl PerceptionSettings {
    /// Returns the settings of a driver whose reaction changes: one who reacts at once accumulates
    /// no evidence.
    #[must_use]
    pub(crate) fn changed(self, change: ReactionChange) -> Self {
        let evidence = self.evidence.filter(|_| change != ReactionChange::AtOnce);
        Self { evidence, ..self }
    }

    /// Returns `nearest_mps2`, the response to the vehicle ahead, or the braking with which the
    /// driver responds to the second leader if that is the stronger one (m/s²). `beyond_mps2` is
    /// the acceleration with which the driver would follow the second leader directly.
    pub(crate) fn respond_mps2(&self, nearest_mps2: f64, beyond_mps2: Option<f64>) -> f64 {
        match beyond_mps2 {
            Some(beyond_mps2) if beyond_mps2 < 0.0 => nearest_mps2.min(self.anticipation * beyond_mps2),
            _ => nearest_mps2,
        }
    }

    /// Returns whether the driver looks at the second leader.
    pub(crate) fn looks_beyond(&self) -> bool {
        self.anticipation > 0.0
    }
}

impl Check for PerceptionConfig {
    type Checked = PerceptionSettings;

    fn check(&self, parameters: &Parameters) -> Result<PerceptionSettings, ConfigError> {
        let anticipation =
            parameters.number_or(self.anticipation.as_ref(), "anticipation", Range::UNIT, DEFAULT_ANTICIPATION)?;
        let evidence = self.evidence.as_ref().map(|config| config.check(parameters)).transpose();
        Ok(PerceptionSettings { anticipation, evidence: evidence.map_err(|error| error.within("evidence"))? })
    }
}

/// Checks how a driver perceives. The settings need a driver with a reaction time (`perceives`): a
/// driver without one uses the true state of traffic at each step.
pub(crate) fn check_perception(
    perception: Option<&PerceptionConfig>,
    perceives: bool,
    parameters: &Parameters,
) -> Result<PerceptionSettings, ConfigError> {
    match perception {
        Some(_) if !perceives => {
            let rule = "without a reaction time the driver knows the truth at once".to_owned();
            Err(ConfigError::new("perception", Problem::Contradiction { other: "reaction-s", rule }))
        }
        Some(config) => config.check(parameters).map_err(|error| error.within("perception")),
        None => Ok(PerceptionSettings::default()),
    }
}
