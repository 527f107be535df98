//! The return to the original lane after passing, if the scenario asks for it.

use closecall_traffic::{Check, ConfigError, Indicator, Lane, Num, Parameters, Range, Time};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::acceptance::Tolerance;
use super::driver::{CompletedPassing, OvertakerDriver, Phase, Step};
use crate::driver::perception::PerceivedVehicle;
use crate::driver::{DriverAction, LaneChange};

/// Default time headway left to the vehicle behind (s): an assumption; 0.5 to 2 are plausible.
const DEFAULT_THW_S: f64 = 1.0;

/// The return to the original lane after passing, as a scenario file describes it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct ReturnConfig {
    /// Time from passing until the driver begins to look for a gap (s). Default: 0.
    pub after_s: Option<Num>,
    /// Time headway left to the vehicle behind (s). Default: 1.
    pub thw_s: Option<Num>,
}

/// A checked return to the original lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Return {
    after: Time,
    thw_s: f64,
}

impl Check for ReturnConfig {
    type Checked = Return;

    fn check(&self, parameters: &Parameters) -> Result<Return, ConfigError> {
        let number_or = |num: &Option<Num>, key, range, default| {
            parameters.number_or(num.as_ref(), key, range, default).map_err(|error| error.within("returns"))
        };
        let after_s = number_or(&self.after_s, "after-s", Range::closed(0.0, 600.0), 0.0)?;
        Ok(Return {
            after: Time::from_s(after_s),
            thw_s: number_or(&self.thw_s, "thw-s", Range::closed(0.0, 10.0), DEFAULT_THW_S)?,
        })
    }
}

impl OvertakerDriver {
    /// Drives on in the passing lane, and begins to change back once the scenario and the traffic
    /// allow it.
    pub(super) fn drive_on(&mut self, step: &Step<'_>, passing: CompletedPassing) -> DriverAction {
        let mut action = self.cruise(step, step.ahead_except(passing.overtaken));
        let origin_side = step.side.opposite();
        let own_lane = step.input.road.lane_of(step.input.own);
        let origin = step.input.road.beside(own_lane, origin_side).filter(|origin| step.is_open(*origin));
        let (Some(returns), Some(origin)) = (self.settings.returns, origin) else { return action };
        if step.input.lane_change_target.is_some() || step.input.time < passing.time + returns.after {
            return action;
        }
        action.indicator = Indicator::towards(origin_side);
        let tolerance = Tolerance { follower_headway_s: returns.thw_s, ..Tolerance::TO_START };
        let acceptance = self.gap_acceptance(step, step.speed_mps, tolerance);
        if step.scene.adjacent(origin_side).is_some_and(|lane| acceptance.is_free(lane)) {
            self.phase = Phase::Returning { origin, passing };
            action.lane_change = Some(LaneChange { target: origin, duration_s: self.settings.duration_s });
        }
        action
    }

    /// Changes back to `origin`, and follows the nearer of the vehicles ahead in either lane.
    pub(super) fn return_to_origin(
        &mut self,
        step: &Step<'_>,
        origin: Lane,
        passing: CompletedPassing,
    ) -> DriverAction {
        if step.input.lane_change_target != Some(origin) {
            self.phase = Phase::Approaching;
            self.observe_side(step.side);
        }
        let in_origin = step.scene.adjacent(step.side.opposite()).and_then(|lane| lane.lead.as_ref());
        let ahead = [step.ahead_except(passing.overtaken), in_origin].into_iter().flatten();
        let nearest: Option<&PerceivedVehicle> = ahead.min_by(|a, b| a.lead.gap_m.total_cmp(&b.lead.gap_m));
        DriverAction { indicator: Indicator::towards(step.side.opposite()), ..self.cruise(step, nearest) }
    }
}
