//! How a driver perceives the vehicles ahead, as a scenario file describes it: how far ahead the driver looks, and
//! whether it accumulates evidence.

use closecall_traffic::{Check, ConfigError, Num, Parameters, Problem, Range};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::evidence::{Evidence, EvidenceConfig};
use crate::driver::reaction::ReactionChange;

/// How a driver perceives the vehicles ahead, as a scenario file describes it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct PerceptionConfig {
    /// Anticipation: the share of the deceleration of the vehicle two ahead that the driver expects of the vehicle
    /// directly ahead, as soon as it sees the brake light of the former: 0 (the driver watches only the vehicle directly
    /// ahead) to 1 (the driver sees through it, and brakes for the brake light of the next one as well). Default: 0.
    pub anticipation: Option<Num>,
    /// Accumulation of looming evidence, in place of the fixed looming threshold and of the brake light. Default: none.
    pub evidence: Option<EvidenceConfig>,
}

/// Checked settings of a driver's perception.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PerceptionSettings {
    /// Share of the deceleration of the vehicle two ahead that the driver expects of the vehicle ahead (-).
    pub(crate) anticipation: f64,
    /// Accumulation of looming evidence, if the driver accumulates it.
    pub(crate) evidence: Option<Evidence>,
}

impl PerceptionSettings {
    /// Returns the settings of a driver whose reaction changes: one who reacts at once accumulates no evidence.
    #[must_use]
    pub(crate) fn changed(self, change: ReactionChange) -> Self {
        let evidence = self.evidence.filter(|_| change != ReactionChange::AtOnce);
        Self { evidence, ..self }
    }

    /// Returns whether the driver looks at the vehicle beyond the one ahead.
    pub(crate) fn looks_beyond(&self) -> bool {
        self.anticipation > 0.0
    }
}

impl Check for PerceptionConfig {
    type Checked = PerceptionSettings;

    fn check(&self, parameters: &Parameters) -> Result<PerceptionSettings, ConfigError> {
        let anticipation = parameters.number_or(self.anticipation.as_ref(), "anticipation", Range::UNIT, 0.0)?;
        let evidence = self.evidence.as_ref().map(|config| config.check(parameters)).transpose();
        Ok(PerceptionSettings { anticipation, evidence: evidence.map_err(|error| error.within("evidence"))? })
    }
}

/// Checks how a driver perceives. The settings need a driver with a reaction time (`perceives`): a driver without one
/// uses the true state of traffic at each step.
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
