//! Interpretation of the tracks: the lead vehicle, the rear vehicle, and the occupancy of the
//! passing lane.
//!
//! Tracks give the centres of boxes in the vehicle frame of the ego, whereas gaps are bumper to
//! bumper. A track counts as being in a lane if the tracker gives that lane a probability of at
//! least one half.

use closecall_traffic::metrics::{bumper_gap_m, touching_distance_m};
use closecall_traffic::{Side, Source, Time, Track, TrackId, TrackStatus};
use serde::{Deserialize, Serialize};

use super::{EgoInput, Odometry};
use crate::braking::Behind;

/// Probability from which on a track counts as real, as being in a lane, or as a vehicle.
const LIKELY: f64 = 0.5;

/// Time constant of the smoothing of the lead vehicle's acceleration (s): an assumption; 0.1 to 0.5
/// are plausible.
const ACCELERATION_TIME_CONSTANT_S: f64 = 0.2;

/// Largest plausible acceleration of the lead vehicle (m/s²): an assumption, the friction of a dry
/// road.
const MAX_PLAUSIBLE_ACCELERATION_MPS2: f64 = 10.0;

/// Bumper-to-bumper spacing below which two vehicles in the passing lane are in each other's way
/// (m): an assumption; 5 to 30 are plausible.
const MIN_SPACING_M: f64 = 15.0;

/// Gap to the ego at which the rear vehicle is expected to enter the passing lane (m): an
/// assumption; 20 to 60 are plausible.
const PASSING_LANE_ENTRY_GAP_M: f64 = 40.0;

/// Gap ahead of the ego beyond which the rear vehicle no longer needs the passing lane (m): an
/// assumption; 5 to 30 are plausible.
const PASSING_LANE_EXIT_GAP_M: f64 = 10.0;

/// The lead vehicle: the vehicle ahead in the lane of the ego.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Front {
    /// Number of its track.
    pub track: TrackId,
    /// Gap from the ego to the lead vehicle, bumper to bumper (m).
    pub gap_m: f64,
    /// Speed of the lead vehicle (m/s).
    pub speed_mps: f64,
    /// Acceleration of the lead vehicle, smoothed from its speed (m/s²).
    pub acceleration_mps2: f64,
}

impl Front {
    /// Returns the constant braking with which the ego at `speed_mps` just keeps a gap of
    /// `standstill_gap_m` to the lead vehicle (m/s²); 0 if none is needed.
    pub(crate) fn required_braking_mps2(&self, speed_mps: f64, standstill_gap_m: f64) -> f64 {
        Behind {
            speed_mps,
            lead_mps: self.speed_mps,
            lead_mps2: self.acceleration_mps2,
            room_m: self.gap_m - standstill_gap_m,
        }
        .required_mps2()
    }
}

#[cfg(test)]
impl Front {
    /// Creates a lead vehicle that keeps its speed.
    pub(crate) fn new(gap_m: f64, speed_mps: f64) -> Self {
        Self { track: TrackId(0), gap_m, speed_mps, acceleration_mps2: 0.0 }
    }
}

/// Largest longitudinal difference between two tracks of one vehicle (m): the errors of length and
/// position together.
const SAME_VEHICLE_LONGITUDINAL_M: f64 = 5.0;
/// Largest lateral difference between two tracks of one vehicle (m): half of the distance between
/// the centres of two narrow vehicles side by side.
const SAME_VEHICLE_LATERAL_M: f64 = 1.0;
/// Largest difference of speed between two tracks of one vehicle (m/s): an assumption; 2 to 5 are
/// plausible.
const SAME_VEHICLE_SPEED_MPS: f64 = 3.0;

/// A rear vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RearVehicle {
    pub(crate) track: TrackId,
    /// Gap to the ego (m); negative if the vehicle overlaps the ego lengthwise or is past.
    pub(crate) gap_m: f64,
    /// Longitudinal position of its centre relative to the ego's centre (m), positive ahead.
    pub(crate) x_m: f64,
    /// Lateral position of its centre relative to the ego's centre (m), positive to the left.
    pub(crate) y_m: f64,
    pub(crate) length_m: f64,
    pub(crate) speed_mps: f64,
    /// Standard deviation of the speed (m/s).
    pub(crate) speed_sd_mps: f64,
    pub(crate) confirmed: bool,
    pub(crate) classified: bool,
    /// Probability of being in the lane of the ego.
    pub(crate) own_lane: f64,
    /// Probability of being in the passing lane.
    pub(crate) passing_lane: f64,
}

impl RearVehicle {
    pub(crate) fn in_own_lane(&self) -> bool {
        self.own_lane >= LIKELY
    }

    /// Returns true if the whole vehicle is ahead of the ego. Its overtaking is then complete,
    /// whatever the ego does.
    pub(crate) fn is_past(&self, odometry: &Odometry) -> bool {
        self.x_m > touching_distance_m(self.length_m, odometry.length_m)
    }

    /// Returns true if `track` belongs to this vehicle, perhaps as seen by another sensor during a
    /// lane change. A vehicle that drives beside it is further away laterally.
    fn matches(&self, track: &Track) -> bool {
        let is_near = (track.x_m() - self.x_m).abs() < SAME_VEHICLE_LONGITUDINAL_M
            && (track.y_m() - self.y_m).abs() < SAME_VEHICLE_LATERAL_M;
        track.id == self.track || (is_near && (track.vx_mps() - self.speed_mps).abs() < SAME_VEHICLE_SPEED_MPS)
    }
}

/// The occupancy of the passing lane for the rear vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PassingLane {
    /// The road has no lane on the overtaking side of the ego.
    None,
    /// No other vehicle is in the way of the rear vehicle.
    Free,
    /// Another vehicle is in the way.
    Occupied,
    /// Not known: a sensor is missing, an unconfirmed track is in the way, or the rear vehicle does
    /// not approach.
    Unknown,
}

/// Assumed braking of the vehicles ahead (m/s²): it decides which of them leaves the least room to
/// stop. An assumption, the mean of emergency braking on a dry road; 6 to 9 are plausible.
const WORST_LEAD_BRAKING_MPS2: f64 = 8.0;

/// Time for which a vehicle that vanished from the lane of the ego is assumed to be there still: an
/// assumption; 0.2 to 1 s are plausible.
const TRACK_MEMORY: Time = Time::from_ms(500);

/// A vehicle ahead, followed over the control steps.
#[derive(Clone, Copy, Debug)]
struct LeadCandidate {
    id: TrackId,
    /// Time of the last observation.
    last_seen: Time,
    /// Longitudinal position of its centre relative to the ego's centre at that time (m).
    x_m: f64,
    length_m: f64,
    speed_mps: f64,
    /// Acceleration, smoothed from the speed because tracks do not carry it (m/s²).
    acceleration_mps2: f64,
    in_lane: bool,
}

impl LeadCandidate {
    fn new(track: &Track) -> Self {
        Self {
            id: track.id,
            last_seen: track.time,
            x_m: track.x_m(),
            length_m: track.length_m,
            speed_mps: track.vx_mps(),
            acceleration_mps2: 0.0,
            in_lane: in_own_lane(track),
        }
    }

    fn observe(&mut self, track: &Track) {
        let step_s = (track.time - self.last_seen).s();
        if step_s > 0.0 {
            let measured = ((track.vx_mps() - self.speed_mps) / step_s)
                .clamp(-MAX_PLAUSIBLE_ACCELERATION_MPS2, MAX_PLAUSIBLE_ACCELERATION_MPS2);
            let share = step_s / (ACCELERATION_TIME_CONSTANT_S + step_s);
            let acceleration_mps2 = self.acceleration_mps2 + share * (measured - self.acceleration_mps2);
            *self = Self { acceleration_mps2, ..Self::new(track) };
        }
    }

    /// Returns the vehicle at `now`, observed or predicted: the prediction keeps the acceleration,
    /// down to a standstill.
    fn predict(&self, now: Time, odometry: &Odometry) -> Front {
        let since_s = (now - self.last_seen).s();
        let speed_mps = (self.speed_mps + self.acceleration_mps2 * since_s).max(0.0);
        let moved_m = (0.5 * (self.speed_mps + speed_mps) - odometry.speed_mps) * since_s;
        Front {
            track: self.id,
            gap_m: bumper_gap_m(self.x_m + moved_m, self.length_m, odometry.length_m),
            speed_mps,
            acceleration_mps2: self.acceleration_mps2,
        }
    }
}

/// Selects the lead vehicle; to be updated at each control step.
#[derive(Clone, Debug, Default)]
pub struct LeadVehicleSelector {
    candidates: Vec<LeadCandidate>,
}

impl LeadVehicleSelector {
    /// Observes the tracks of this step. Returns the vehicle ahead in the lane of the ego that
    /// leaves the ego the least room to stop.
    ///
    /// This is not always the nearest vehicle: a vehicle that has just overtaken would hide the
    /// vehicle behind which the ego brakes.
    pub fn update(&mut self, input: &EgoInput<'_>) -> Option<Front> {
        let now = input.time;
        for track in input.tracks.iter().filter(|track| track.x_m() > 0.0 && is_established(track) && exists(track)) {
            match self.candidates.iter_mut().find(|candidate| candidate.id == track.id) {
                // A coasting track carries no new information on the acceleration; for a while the
                // last estimate is better.
                Some(candidate)
                    if track.status == TrackStatus::Coasting && now - candidate.last_seen <= TRACK_MEMORY => {}
                Some(candidate) => candidate.observe(track),
                None => self.add(track),
            }
        }
        let is_gone = |id| !input.tracks.iter().any(|track| track.id == id && track.x_m() > 0.0);
        self.candidates.retain(|candidate| {
            let is_remembered = candidate.in_lane && now - candidate.last_seen <= TRACK_MEMORY;
            is_remembered || !is_gone(candidate.id)
        });
        let room_m = |lead: &Front| lead.gap_m + lead.speed_mps * lead.speed_mps / (2.0 * WORST_LEAD_BRAKING_MPS2);
        self.candidates
            .iter()
            .filter(|candidate| candidate.in_lane)
            .map(|candidate| candidate.predict(now, &input.odometry))
            .min_by(|a, b| room_m(a).total_cmp(&room_m(b)))
    }

    /// Adds a new track. If a track vanished at the same place, the new one takes over its
    /// acceleration.
    fn add(&mut self, track: &Track) {
        let now = track.time;
        let is_predecessor = |candidate: &&mut LeadCandidate| {
            let since_s = (now - candidate.last_seen).s();
            since_s > 0.0
                && (candidate.x_m - track.x_m()).abs() < SAME_VEHICLE_LONGITUDINAL_M
                && (candidate.speed_mps - track.vx_mps()).abs() < SAME_VEHICLE_SPEED_MPS
        };
        let new = LeadCandidate::new(track);
        match self.candidates.iter_mut().find(is_predecessor) {
            Some(candidate) => *candidate = LeadCandidate { acceleration_mps2: candidate.acceleration_mps2, ..new },
            None => self.candidates.push(new),
        }
    }
}

fn in_own_lane(track: &Track) -> bool {
    track.lane[OWN_LANE_INDEX] >= LIKELY
}

/// Index of the lane of the ego in the lane probabilities of a track.
const OWN_LANE_INDEX: usize = 1;

/// Returns the index of the passing lane in the lane probabilities of a track.
const fn passing_lane_index(side: Side) -> usize {
    match side {
        Side::Left => 0,
        Side::Right => 2,
    }
}

fn is_established(track: &Track) -> bool {
    matches!(track.status, TrackStatus::Confirmed | TrackStatus::Coasting)
}

fn exists(track: &Track) -> bool {
    track.existence >= LIKELY
}

pub(crate) fn rear_vehicle_from(track: &Track, input: &EgoInput<'_>) -> RearVehicle {
    RearVehicle {
        track: track.id,
        gap_m: bumper_gap_m(-track.x_m(), track.length_m, input.odometry.length_m),
        x_m: track.x_m(),
        y_m: track.y_m(),
        length_m: track.length_m,
        speed_mps: track.vx_mps(),
        speed_sd_mps: track.covariance[(2, 2)].max(0.0).sqrt(),
        confirmed: is_established(track),
        classified: track.class.is_vehicle(),
        own_lane: track.lane[OWN_LANE_INDEX],
        passing_lane: track.lane[passing_lane_index(input.road.overtaking_side())],
    }
}

/// Returns the nearest vehicle behind in the lane of the ego. A confirmed and classified track has
/// priority over a nearer track that is unconfirmed or unclassified.
pub(crate) fn nearest_rear_vehicle(input: &EgoInput<'_>) -> Option<RearVehicle> {
    let behind = |track: &&Track| {
        track.x_m() < 0.0 && track.source != Source::Front && exists(track) && track.lane[OWN_LANE_INDEX] >= LIKELY
    };
    let nearer = |a: &&Track, b: &&Track| b.x_m().total_cmp(&a.x_m());
    let vehicles = || input.tracks.iter().filter(behind);
    let best = vehicles()
        .filter(|track| is_established(track) && track.class.is_vehicle())
        .min_by(nearer)
        .or_else(|| vehicles().min_by(nearer))?;
    Some(rear_vehicle_from(best, input))
}

/// Time headway below which a vehicle follows the rear vehicle closely (s): the mean reaction to a
/// surprising event (Green, Transportation Human Factors 2 (2000)). The driver of such a vehicle
/// has no time to react to a slow ego when the rear vehicle pulls out.
const FOLLOWED_HEADWAY_S: f64 = 1.5;

/// Returns true if an established track follows `rear` closely in the lane of the ego. Its driver
/// sees the ego only when `rear` has pulled out.
pub(crate) fn is_followed(input: &EgoInput<'_>, rear: &RearVehicle) -> bool {
    input.tracks.iter().any(|track| {
        let gap_m = rear.x_m - track.x_m() - touching_distance_m(track.length_m, rear.length_m);
        track.x_m() < rear.x_m
            && !rear.matches(track)
            && is_established(track)
            && exists(track)
            && in_own_lane(track)
            && gap_m < FOLLOWED_HEADWAY_S * track.vx_mps()
    })
}

/// Determines whether the passing lane is free for `rear` to overtake the ego, with all vehicles at
/// constant speed. A vehicle behind `rear` must keep at least `follower_headway_s` (s) to it.
pub(crate) fn passing_lane(input: &EgoInput<'_>, rear: &RearVehicle, follower_headway_s: f64) -> PassingLane {
    let side = input.road.overtaking_side();
    if input.road.beside(input.odometry.lane, side).is_none() {
        return PassingLane::None;
    }
    if !(input.sensors.surround && input.sensors.rear && input.sensors.front) {
        return PassingLane::Unknown;
    }
    let closing_mps = rear.speed_mps - input.odometry.speed_mps;
    if !(closing_mps > 0.0) {
        return PassingLane::Unknown;
    }
    let from_s = ((rear.gap_m - PASSING_LANE_ENTRY_GAP_M) / closing_mps).max(0.0);
    let until_s =
        (rear.gap_m.max(0.0) + input.odometry.length_m + rear.length_m + PASSING_LANE_EXIT_GAP_M) / closing_mps;
    let mut state = PassingLane::Free;
    for track in input.tracks {
        if rear.matches(track) || !exists(track) || !(track.lane[passing_lane_index(side)] >= LIKELY) {
            continue;
        }
        let touching_m = touching_distance_m(track.length_m, rear.length_m);
        let spacing = Spacing {
            ahead_m: touching_m + MIN_SPACING_M,
            behind_m: touching_m + MIN_SPACING_M.max(follower_headway_s * track.vx_mps()),
        };
        let ahead_m = track.x_m() - rear.x_m;
        let opening_mps = track.vx_mps() - rear.speed_mps;
        if spacing.is_kept(ahead_m + opening_mps * from_s, ahead_m + opening_mps * until_s) {
            continue;
        }
        if is_established(track) {
            return PassingLane::Occupied;
        }
        state = PassingLane::Unknown;
    }
    state
}

/// Distances between the centres of two vehicles at which they are not in each other's way.
struct Spacing {
    /// To a vehicle ahead (m).
    ahead_m: f64,
    /// To a vehicle behind (m).
    behind_m: f64,
}

impl Spacing {
    /// Returns true if a distance that changes linearly from `first_m` to `last_m`, positive ahead,
    /// stays large enough on one side.
    fn is_kept(&self, first_m: f64, last_m: f64) -> bool {
        first_m.min(last_m) > self.ahead_m || first_m.max(last_m) < -self.behind_m
    }
}
