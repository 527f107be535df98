//! The rear vehicle that the margin increase system has engaged for, followed from step to step.

use closecall_traffic::{Time, TrackId};

use super::machine::Situation;
use crate::ego::surroundings::{Front, RearVehicle, rear_vehicle_from};

/// Largest distance between a new track and the expected position of a lost track at which both are
/// the same vehicle (m): an assumption; 3 to 8 are plausible.
const REASSOCIATION_DISTANCE_M: f64 = 5.0;

/// Largest difference of their speeds (m/s): an assumption; 2 to 5 are plausible.
const REASSOCIATION_SPEED_MPS: f64 = 3.0;

/// The rear vehicle that the system has engaged for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Target {
    pub(super) rear: RearVehicle,
    /// Target front time headway (s).
    pub(super) goal_thw_s: f64,
    pub(super) last_seen: Time,
    /// The last time at which it approached fast enough not to count as following.
    pub(super) last_approached: Time,
    pub(super) last_lane_free: Time,
    /// Whether emergency braking has acted since the system engaged.
    pub(super) has_braked_hard: bool,
}

impl Target {
    /// Returns true if the ego may slow down for the margin.
    ///
    /// Emergency braking is the hazard that the margin was meant for: the rear vehicle has lost the
    /// distance that the ego needed, its driver brakes or evades, and the plan's assumption that it
    /// drives on as before no longer holds. From then on the ego slows down in front of it only
    /// while the gap ahead closes. While it does not, the margin does not shrink, and every further
    /// m/s is taken from the driver behind for nothing.
    pub(super) fn may_cost_speed(&self, lead: &Front, ego_mps: f64) -> bool {
        !self.has_braked_hard || lead.speed_mps < ego_mps
    }

    /// Updates the vehicle from its track, or extrapolates it if it has none.
    pub(super) fn update(&mut self, situation: &Situation<'_>, step_s: f64) {
        self.has_braked_hard |= situation.emergency_braking;
        let own_mps = situation.speed_mps();
        let expected_m = self.rear.x_m + (self.rear.speed_mps - own_mps) * step_s;
        let by_id = |id: TrackId| situation.input.tracks.iter().find(|track| track.id == id);
        let target = by_id(self.rear.track).or_else(|| {
            situation.input.tracks.iter().find(|track| {
                (track.x_m() - expected_m).abs() < REASSOCIATION_DISTANCE_M
                    && (track.vx_mps() - self.rear.speed_mps).abs() < REASSOCIATION_SPEED_MPS
                    && rear_vehicle_from(track, situation.input).passing_lane
                        + rear_vehicle_from(track, situation.input).own_lane
                        >= 0.5
            })
        });
        match target {
            Some(track) => {
                self.rear = rear_vehicle_from(track, situation.input);
                self.last_seen = situation.input.time;
            }
            None => {
                self.rear.gap_m -= expected_m - self.rear.x_m;
                self.rear.x_m = expected_m;
            }
        }
    }
}
