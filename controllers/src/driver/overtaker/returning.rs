//! Back into the lane that the driver came from, once it has passed, where the scenario says so.

use closecall_traffic::{Check, ConfigError, Indicator, Lane, Num, Parameters, Range, Side, Time};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::acceptance::Tolerance;
use super::driver::{Moment, OvertakerDriver, Past, Phase};
use crate::driver::perception::Perceived;
use crate::driver::{DriverAction, LaneChange};

/// Time headway that is left to the vehicle behind where the scenario gives none [s]: what drivers are taught to leave
/// before they change back, so that they see the overtaken vehicle whole in the mirror.
const DEFAULT_THW_S: f64 = 1.0;

/// That a driver changes back after passing, as a scenario file says it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct ReturnConfig {
    /// How long after passing it begins to look for the gap [s]; at once where absent.
    pub after_s: Option<Num>,
    /// Time headway that it leaves to the vehicle behind [s]; 1.
    pub thw_s: Option<Num>,
}

/// A checked return.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Return {
    after: Time,
    thw_s: f64,
}

impl Check for ReturnConfig {
    type Checked = Return;

    fn check(&self, parameters: &Parameters) -> Result<Return, ConfigError> {
        let or = |num: &Option<Num>, key, range, default| match num {
            Some(num) => parameters.number(num, key, range).map_err(|error| error.within("returns")),
            None => Ok(default),
        };
        let after_s = or(&self.after_s, "after-s", Range::closed(0.0, 600.0), 0.0)?;
        Ok(Return {
            after: Time::from_s(after_s),
            thw_s: or(&self.thw_s, "thw-s", Range::closed(0.0, 10.0), DEFAULT_THW_S)?,
        })
    }
}

impl OvertakerDriver {
    /// Drives on in the passing lane, and changes back when it may.
    pub(super) fn cruise_past(&mut self, moment: &Moment<'_>, past: Past) -> DriverAction {
        let mut action = self.cruise(moment, moment.ahead_but(past.overtaken));
        let home_side = opposite(moment.side);
        let own_lane = moment.input.road.lane_at(moment.input.own.d_m);
        let home = moment.input.road.beside(own_lane, home_side);
        let (Some(returns), Some(home)) = (self.settings.returns, home) else { return action };
        if moment.input.changing_to.is_some() || moment.input.time < past.since + returns.after {
            return action;
        }
        action.indicator = indicator(home_side);
        let tolerance = Tolerance { follower_headway_s: returns.thw_s, ..Tolerance::TO_START };
        let intent = self.intent(moment, moment.speed_mps, tolerance);
        if moment.view.beside(home_side).is_some_and(|lane| intent.allows(lane)) {
            self.phase = Phase::Returning { home, past };
            action.lane_change = Some(LaneChange { target: home, duration_s: self.settings.duration_s });
        }
        action
    }

    /// Changes back to `home`, behind the nearer of the vehicles ahead in either lane.
    pub(super) fn change_back(&mut self, moment: &Moment<'_>, home: Lane, past: Past) -> DriverAction {
        if moment.input.changing_to != Some(home) {
            self.phase = Phase::Approaching;
            self.look_to(moment.side);
        }
        let in_home = moment.view.beside(opposite(moment.side)).and_then(|lane| lane.lead.as_ref());
        let ahead = [moment.ahead_but(past.overtaken), in_home].into_iter().flatten();
        let nearest: Option<&Perceived> = ahead.min_by(|a, b| a.lead.gap_m.total_cmp(&b.lead.gap_m));
        DriverAction { indicator: indicator(opposite(moment.side)), ..self.cruise(moment, nearest) }
    }
}

/// The indicator that announces a change to `side`.
pub(super) fn indicator(side: Side) -> Indicator {
    match side {
        Side::Left => Indicator::Left,
        Side::Right => Indicator::Right,
    }
}

/// The other side.
pub(super) fn opposite(side: Side) -> Side {
    match side {
        Side::Left => Side::Right,
        Side::Right => Side::Left,
    }
}
