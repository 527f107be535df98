//! E's margins: at each instant, and their extremes over a run.

use closecall_controllers::{Neighbour, Neighbours};
use closecall_traffic::metrics::{time_headway_s, time_to_collision_s};
use closecall_traffic::{Absent, Measured, VehicleState};

use super::observer::{Lead, MarginsNow};
use crate::outcome::Margins;

/// A vehicle that has passed and pulls in counts as the one ahead after this time [s].
const SETTLED_LEAD_S: f64 = 1.0;

impl MarginsNow {
    /// The margins of a vehicle in `own` state among its neighbours, with its own width and that of the lanes.
    ///
    /// In the lane is whose centre is: a vehicle that overtakes counts as behind until it crosses the marking, and as
    /// ahead once it has pulled in. Ahead counts, too, what E would hit by driving on.
    pub(crate) fn new(own: &VehicleState, neighbours: &Neighbours, [own_width_m, lane_width_m]: [f64; 2]) -> Self {
        let in_lane = |other: &Neighbour| other.lateral_offset_m.abs() < 0.5 * lane_width_m;
        let overlaps = |other: &Neighbour| other.lateral_offset_m.abs() < 0.5 * (own_width_m + other.width_m);
        let in_path = neighbours.in_path.filter(|path| path.gap_m >= 0.0 && overlaps(path));
        let ahead = match (neighbours.own.lead.filter(in_lane), in_path) {
            (Some(lead), Some(path)) => Some(if path.gap_m < lead.gap_m { path } else { lead }),
            (lead, path) => lead.or(path),
        };
        let behind = neighbours.own.follower.filter(in_lane);
        let gap_front_m = ahead.map(|ahead| ahead.gap_m).ok_or(Absent::NoLead);
        let gap_rear_m = behind.map(|behind| behind.gap_m).ok_or(Absent::NoFollower);
        let behind = behind.ok_or(Absent::NoFollower);
        Self {
            lead: match neighbours.own.lead {
                Some(lead) if in_lane(&lead) => Ok(Lead { actor: lead.actor, speed_mps: lead.speed_mps }),
                Some(_) => Err(Absent::BetweenLanes),
                None => Err(Absent::NoLead),
            },
            follower: behind.ok().map(|behind| behind.actor),
            gap_front_m,
            thw_front_s: gap_front_m.and_then(|gap_m| time_headway_s(gap_m, own.speed_mps)),
            gap_rear_m,
            thw_rear_s: behind.and_then(|behind| time_headway_s(behind.gap_m, behind.speed_mps)),
            ttc_rear_s: behind.and_then(|behind| time_to_collision_s(behind.gap_m, behind.speed_mps, own.speed_mps)),
        }
    }
}

/// Collects the extremes of E's margins.
#[derive(Debug)]
pub(crate) struct MarginMeter {
    extremes: Margins,
    last_acceleration_mps2: Option<f64>,
    start_mps: Option<f64>,
    /// The vehicle ahead, and for how many steps it has been that.
    lead_for: (usize, u32),
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
            max_speed_deficit_mps: 0.0,
        };
        Self { extremes, last_acceleration_mps2: None, start_mps: None, lead_for: (usize::MAX, 0), step_s }
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
        // Where the vehicle comes to a stand its deceleration ends at once: that is no jerk of the controller's.
        if let Some(last_mps2) = self.last_acceleration_mps2.filter(|_| own.speed_mps > 0.0) {
            let jerk_mps3 = (own.acceleration_mps2 - last_mps2).abs() / self.step_s;
            extremes.max_jerk_mps3 = extremes.max_jerk_mps3.max(jerk_mps3);
        }
        self.last_acceleration_mps2 = Some(own.acceleration_mps2);
        self.take_deficit(own.speed_mps, now.lead);
    }

    /// Compares E's speed with what is due: the lead's once it has been ahead for a while, or E's own at the start.
    fn take_deficit(&mut self, own_mps: f64, lead: Result<Lead, Absent>) {
        let start_mps = *self.start_mps.get_or_insert(own_mps);
        let due_mps = match lead {
            Ok(lead) => {
                let (same, steps) = self.lead_for;
                self.lead_for = if same == lead.actor { (same, steps + 1) } else { (lead.actor, 0) };
                if f64::from(self.lead_for.1) * self.step_s < SETTLED_LEAD_S {
                    return;
                }
                lead.speed_mps
            }
            Err(Absent::NoLead) => start_mps,
            Err(_) => return,
        };
        self.extremes.max_speed_deficit_mps = self.extremes.max_speed_deficit_mps.max(due_mps - own_mps);
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
