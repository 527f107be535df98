//! E's margins: at each instant, and their extremes over a run.

use closecall_controllers::Neighbours;
use closecall_traffic::metrics::{time_headway_s, time_to_collision_s};
use closecall_traffic::{Absent, Measured, VehicleState};

use super::observer::MarginsNow;
use crate::outcome::Margins;

impl MarginsNow {
    /// The margins of a vehicle in `own` state among its neighbours.
    pub(crate) fn new(own: &VehicleState, neighbours: &Neighbours) -> Self {
        // What counts ahead is what is in the lane, or in the way: whichever is nearer.
        let ahead = match (neighbours.own.lead, neighbours.in_path) {
            (Some(lead), Some(path)) => Some(if path.gap_m < lead.gap_m { path } else { lead }),
            (lead, path) => lead.or(path),
        };
        let behind = neighbours.own.follower;
        let gap_front_m = ahead.map(|ahead| ahead.gap_m).ok_or(Absent::NoLead);
        let gap_rear_m = behind.map(|behind| behind.gap_m).ok_or(Absent::NoFollower);
        Self {
            gap_front_m,
            thw_front_s: gap_front_m.and_then(|gap_m| time_headway_s(gap_m, own.speed_mps)),
            gap_rear_m,
            thw_rear_s: behind
                .ok_or(Absent::NoFollower)
                .and_then(|behind| time_headway_s(behind.gap_m, behind.speed_mps)),
            ttc_rear_s: behind
                .ok_or(Absent::NoFollower)
                .and_then(|behind| time_to_collision_s(behind.gap_m, behind.speed_mps, own.speed_mps)),
        }
    }
}

/// Collects the extremes of E's margins.
#[derive(Debug)]
pub(crate) struct MarginMeter {
    extremes: Margins,
    last_acceleration_mps2: Option<f64>,
    step_s: f64,
}

impl MarginMeter {
    pub(crate) fn new(step_s: f64) -> Self {
        let extremes = Margins {
            min_thw_front_s: Err(Absent::NoLead),
            min_thw_rear_s: Err(Absent::NoFollower),
            min_gap_front_m: Err(Absent::NoLead),
            min_gap_rear_m: Err(Absent::NoFollower),
            min_ttc_rear_s: Err(Absent::NoFollower),
            max_deceleration_mps2: 0.0,
            max_jerk_mps3: 0.0,
        };
        Self { extremes, last_acceleration_mps2: None, step_s }
    }

    /// Takes in one physics step of E while it has touched nobody.
    pub(crate) fn take(&mut self, own: &VehicleState, now: &MarginsNow) {
        let extremes = &mut self.extremes;
        keep_least(&mut extremes.min_thw_front_s, now.thw_front_s);
        keep_least(&mut extremes.min_thw_rear_s, now.thw_rear_s);
        keep_least(&mut extremes.min_gap_front_m, now.gap_front_m);
        keep_least(&mut extremes.min_gap_rear_m, now.gap_rear_m);
        keep_least(&mut extremes.min_ttc_rear_s, now.ttc_rear_s);
        extremes.max_deceleration_mps2 = extremes.max_deceleration_mps2.max(-own.acceleration_mps2);
        if let Some(last_mps2) = self.last_acceleration_mps2 {
            let jerk_mps3 = (own.acceleration_mps2 - last_mps2).abs() / self.step_s;
            extremes.max_jerk_mps3 = extremes.max_jerk_mps3.max(jerk_mps3);
        }
        self.last_acceleration_mps2 = Some(own.acceleration_mps2);
    }

    /// A collision leaves no margin to the vehicle that was struck ahead or behind.
    pub(crate) fn touched(&mut self, ahead: bool) {
        let gap = if ahead { &mut self.extremes.min_gap_front_m } else { &mut self.extremes.min_gap_rear_m };
        *gap = Ok(0.0);
    }

    pub(crate) fn finish(self) -> Margins {
        self.extremes
    }
}

/// Keeps the lesser of two values; a value beats an absence, and a later absence does not overwrite an earlier one.
fn keep_least(least: &mut Measured, now: Measured) {
    *least = match (*least, now) {
        (Ok(least), Ok(now)) => Ok(least.min(now)),
        (Err(_), Ok(now)) => Ok(now),
        (least, Err(_)) => least,
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn absence_never_beats_a_value() {
        let mut least = Err(Absent::NoLead);
        keep_least(&mut least, Ok(2.0));
        keep_least(&mut least, Err(Absent::Standstill));
        keep_least(&mut least, Ok(3.0));
        assert_eq!(least, Ok(2.0));
    }
}
