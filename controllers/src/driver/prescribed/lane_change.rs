//! Lane changes at prescribed times.

use closecall_traffic::{ConfigError, Num, Parameters, Range, Side, Time};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::config::MAX_TIME_S;

/// Valid durations of a lane change (s).
const DURATION_S: Range = Range::closed(1.5, 20.0);

/// A prescribed lane change as a scenario file describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct PrescribedLaneChangeConfig {
    /// Time at which the lane change begins (s).
    pub at_s: Num,
    /// Side of the target lane.
    pub to: Side,
    /// Duration of the whole lane change at the speed at which it begins (s): 1.5 to 20.
    pub duration_s: Num,
}

/// A checked prescribed lane change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PrescribedLaneChange {
    pub(super) at: Time,
    pub(super) to: Side,
    pub(super) duration_s: f64,
}

impl PrescribedLaneChange {
    /// Returns the lane change to the opposite side.
    pub(super) fn mirrored(&self) -> Self {
        Self { to: self.to.opposite(), ..*self }
    }
}

/// Checks the lane changes in their order. Each must begin after the end of the previous change.
pub(super) fn check_lane_changes(
    configs: &[PrescribedLaneChangeConfig],
    parameters: &Parameters,
) -> Result<Vec<PrescribedLaneChange>, ConfigError> {
    let mut previous_end_s = 0.0;
    let mut checked = Vec::with_capacity(configs.len());
    for (index, config) in configs.iter().enumerate() {
        let number = |num, key, range| {
            parameters
                .number(num, key, range)
                .map_err(|error: ConfigError| error.within_index(index).within("lane-changes"))
        };
        let at_s = number(&config.at_s, "at-s", Range::closed(previous_end_s, MAX_TIME_S))?;
        let duration_s = number(&config.duration_s, "duration-s", DURATION_S)?;
        previous_end_s = at_s + duration_s;
        checked.push(PrescribedLaneChange { at: Time::from_s(at_s), to: config.to, duration_s });
    }
    Ok(checked)
}
