//! The ego's margins: at one instant, and their extremes over a run.

use closecall_controllers::{Neighbour, Neighbours};
use closecall_traffic::metrics::{time_headway_s, time_to_collision_s};
use closecall_traffic::{Absent, Measured, VehicleState};

use super::observer::{CurrentMargins, Lead};
use closecall_scenarios::outcome::Margins;

/// Time after which a vehicle that has pulled in ahead counts for the speed deficit (s).
const SETTLED_LEAD_S: f64 = 1.0;

/// The widths that decide which neighbours are in a vehicle's lane and path.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Widths {
    /// Width of the vehicle (m).
    pub(crate) vehicle_m: f64,
    /// Width of its lane (m).
    pub(crate) lane_m: f64,
}

impl CurrentMargins {
    /// Computes the margins of the ego among its neighbours.
    ///
    /// A neighbour counts as being in the lane if the lateral distance of the two centres is below
    /// half the width of the vehicle's lane. An overtaking vehicle thus counts as behind until it crosses the marking,
    /// and as ahead once it has pulled in. A neighbour that the vehicle would hit by driving
    /// straight on also counts as ahead.
    pub(crate) fn new(ego: &VehicleState, neighbours: &Neighbours, widths: Widths) -> Self {
        let in_lane = |other: &&Neighbour| other.lateral_offset_m.abs() < 0.5 * widths.lane_m;
        let overlaps = |other: &&Neighbour| other.lateral_offset_m.abs() < 0.5 * (widths.vehicle_m + other.width_m);
        let in_path = neighbours.in_path.as_ref().filter(|path| path.gap_m >= 0.0 && overlaps(path));
        let ahead = match (neighbours.own.lead.as_ref().filter(in_lane), in_path) {
            (Some(lead), Some(path)) => Some(if path.gap_m < lead.gap_m { path } else { lead }),
            (lead, path) => lead.or(path),
        };
        let behind = neighbours.own.follower.as_ref().filter(in_lane);
        let gap_front_m = ahead.map(|ahead| ahead.gap_m).ok_or(Absent::NoLead);
        let gap_rear_m = behind.map(|behind| behind.gap_m).ok_or(Absent::NoFollower);
        let behind = behind.ok_or(Absent::NoFollower);
        Self {
            lead: match neighbours.own.lead.as_ref() {
                Some(lead) if in_lane(&lead) => Ok(Lead { actor: lead.actor, speed_mps: lead.speed_mps }),
                Some(_) => Err(Absent::BetweenLanes),
                None => Err(Absent::NoLead),
            },
            follower: behind.ok().map(|behind| behind.actor),
            gap_front_m,
            thw_front_s: gap_front_m.and_then(|gap_m| time_headway_s(gap_m, ego.speed_mps)),
            gap_rear_m,
            thw_rear_s: behind.and_then(|behind| time_headway_s(behind.gap_m, behind.speed_mps)),
            ttc_front_s: ahead.ok_or(Absent::NoLead).and_then(|ahead| {
                let gap_m = ahead.gap_m.max(0.0);
                time_to_collision_s(gap_m, ego.speed_mps, ahead.speed_mps)
            }),
            ttc_rear_s: behind.and_then(|behind| time_to_collision_s(behind.gap_m, behind.speed_mps, ego.speed_mps)),
        }
    }
}

/// A lead vehicle, and how long it has been the lead vehicle.
#[derive(Clone, Copy, Debug)]
struct LeadDuration {
    /// Index of the vehicle in the list of actors.
    actor: usize,
    /// Number of physics steps since the first one in which it was the lead vehicle.
    steps: u32,
}

/// Collects the extremes of the ego's margins.
#[derive(Debug)]
pub(crate) struct MarginMeter {
    extremes: Margins,
    min_ttc_front_s: Measured,
    last_acceleration_mps2: Option<f64>,
    /// Speed of the ego at the start (m/s).
    start_speed_mps: Option<f64>,
    /// The last lead vehicle, if there was one.
    last_lead: Option<LeadDuration>,
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
        Self {
            extremes,
            min_ttc_front_s: Err(Absent::NoLead),
            last_acceleration_mps2: None,
            start_speed_mps: None,
            last_lead: None,
            step_s,
        }
    }

    /// Updates the extremes by one physics step. Returns the speed with which the ego's speed is
    /// compared (m/s), if there is one at this step. It must not be called after the ego's first
    /// collision.
    pub(crate) fn observe(&mut self, ego: &VehicleState, now: &CurrentMargins) -> Option<f64> {
        let extremes = &mut self.extremes;
        keep_least(&mut extremes.min_thw_front_s, now.thw_front_s);
        keep_least(&mut extremes.min_thw_rear_s, now.thw_rear_s);
        keep_least(&mut extremes.min_gap_front_m, now.gap_front_m);
        keep_least(&mut extremes.min_gap_rear_m, now.gap_rear_m);
        keep_least(&mut extremes.min_ttc_rear_s, now.ttc_rear_s);
        keep_least(&mut self.min_ttc_front_s, now.ttc_front_s);
        extremes.max_deceleration_mps2 = extremes.max_deceleration_mps2.max(-ego.acceleration_mps2);
        // When the vehicle comes to a standstill, its deceleration ends at once. The controller did
        // not cause that jerk.
        if let Some(last_mps2) = self.last_acceleration_mps2.filter(|_| ego.speed_mps > 0.0) {
            let jerk_mps3 = (ego.acceleration_mps2 - last_mps2).abs() / self.step_s;
            extremes.max_jerk_mps3 = extremes.max_jerk_mps3.max(jerk_mps3);
        }
        self.last_acceleration_mps2 = Some(ego.acceleration_mps2);
        self.observe_speed_deficit(ego.speed_mps, now.lead)
    }

    /// Compares the ego's speed with a reference: the lead vehicle's speed once it has been ahead
    /// for [`SETTLED_LEAD_S`], or the ego's own speed at the start if there is no lead vehicle.
    fn observe_speed_deficit(&mut self, own_mps: f64, lead: Result<Lead, Absent>) -> Option<f64> {
        let start_speed_mps = *self.start_speed_mps.get_or_insert(own_mps);
        let reference_mps = match lead {
            Ok(lead) => {
                let same = self.last_lead.filter(|last| last.actor == lead.actor);
                let steps = same.map_or(0, |last| last.steps + 1);
                self.last_lead = Some(LeadDuration { actor: lead.actor, steps });
                if f64::from(steps) * self.step_s < SETTLED_LEAD_S {
                    return None;
                }
                lead.speed_mps
            }
            Err(Absent::NoLead) => start_speed_mps,
            Err(_) => return None,
        };
        self.extremes.max_speed_deficit_mps = self.extremes.max_speed_deficit_mps.max(reference_mps - own_mps);
        Some(reference_mps)
    }

    /// Sets the smallest gap to zero after a collision of the ego: the front gap if the other
    /// vehicle `is_ahead`, otherwise the rear gap.
    pub(crate) fn note_collision(&mut self, is_ahead: bool) {
        let gap = if is_ahead { &mut self.extremes.min_gap_front_m } else { &mut self.extremes.min_gap_rear_m };
        *gap = Ok(0.0);
    }

    /// Returns the smallest time to collision with the vehicle ahead (s).
    pub(crate) const fn min_ttc_front_s(&self) -> Measured {
        self.min_ttc_front_s
    }

    /// Returns the extremes.
    pub(crate) fn finish(self) -> Margins {
        self.extremes
    }
}

/// Replaces `least` by `now` if that is smaller. A value replaces an absence; an absence never
/// replaces anything.
fn keep_least(least: &mut Measured, now: Measured) {
    let Ok(value) = now else { return };
    if !least.is_ok_and(|least| least <= value) {
        *least = now;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_absence_never_replaces_a_value() {
        let mut least = Err(Absent::NoLead);
        keep_least(&mut least, Ok(2.0));
        keep_least(&mut least, Err(Absent::Standstill));
        keep_least(&mut least, Ok(3.0));
        assert_eq!(least, Ok(2.0));
    }
}
