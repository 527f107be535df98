//! Lane changes at given times.

use closecall_traffic::{ConfigError, Num, Parameters, Range, Side, Time};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::config::LATEST_S;

/// How long a lane change may take [s].
const DURATION_S: Range = Range::closed(1.5, 20.0);

/// A lane change as a scenario file describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct PrescribedLaneChangeConfig {
    /// When it begins [s].
    pub at_s: Num,
    /// To which side.
    pub to: Side,
    /// Time that the whole lane change takes at the speed at which it begins [s]: 1.5 to 20.
    pub duration_s: Num,
}

/// A checked lane change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PrescribedLaneChange {
    pub(super) at: Time,
    pub(super) to: Side,
    pub(super) duration_s: f64,
}

impl PrescribedLaneChange {
    pub(super) fn mirrored(&self) -> Self {
        let to = match self.to {
            Side::Left => Side::Right,
            Side::Right => Side::Left,
        };
        Self { to, ..*self }
    }
}

/// Checks lane changes one after the other, each from the end of the one before on.
pub(super) fn check_lane_changes(
    configs: &[PrescribedLaneChangeConfig],
    parameters: &Parameters,
) -> Result<Vec<PrescribedLaneChange>, ConfigError> {
    let mut ends_s = 0.0;
    let mut checked = Vec::with_capacity(configs.len());
    for (place, config) in configs.iter().enumerate() {
        let number = |num, key, range| {
            parameters
                .number(num, key, range)
                .map_err(|error: ConfigError| error.within_index(place).within("lane-changes"))
        };
        let at_s = number(&config.at_s, "at-s", Range::closed(ends_s, LATEST_S))?;
        let duration_s = number(&config.duration_s, "duration-s", DURATION_S)?;
        ends_s = at_s + duration_s;
        checked.push(PrescribedLaneChange { at: Time::from_s(at_s), to: config.to, duration_s });
    }
    Ok(checked)
}
