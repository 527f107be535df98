//! What the tracks mean: the vehicle ahead, the vehicle behind, and the passing lane.
//!
//! Tracks give the centres of boxes in E's frame; gaps are bumper to bumper. A track counts as in a lane where the
//! tracker gives that lane a probability of at least one half.

use closecall_traffic::{Side, Source, Time, Track, TrackId, TrackStatus};
use serde::Serialize;

use super::{EgoInput, Odometry};

/// Probability from which on something counts as there, in that lane, and of that kind [1].
const LIKELY: f64 = 0.5;

/// Time constant with which the acceleration of the vehicle ahead follows its speed's change [s].
const ACCELERATION_TIME_S: f64 = 0.2;

/// Strongest acceleration that is believed of the vehicle ahead [m/s²].
const BELIEVED_MPS2: f64 = 10.0;

/// Distance that two vehicles in the passing lane have to keep from each other to count as free of each other [m].
const FREE_DISTANCE_M: f64 = 15.0;

/// Gap to E at which the vehicle behind is expected to start using the passing lane [m].
const USES_PASSING_LANE_FROM_M: f64 = 40.0;

/// Distance ahead of E at which the vehicle behind has passed [m].
const PASSED_AHEAD_M: f64 = 10.0;

/// The vehicle ahead in E's lane.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Front {
    /// Its track.
    pub track: TrackId,
    /// Gap from E to it, bumper to bumper [m].
    pub gap_m: f64,
    /// Its speed [m/s].
    pub speed_mps: f64,
    /// Its acceleration, smoothed from its speed [m/s²].
    pub acceleration_mps2: f64,
}

#[cfg(test)]
impl Front {
    /// A vehicle ahead that keeps its speed.
    pub(crate) fn new(gap_m: f64, speed_mps: f64) -> Self {
        Self { track: TrackId(0), gap_m, speed_mps, acceleration_mps2: 0.0 }
    }
}

/// Two tracks of one vehicle differ by less than this along the lane [m]: errors of length and position together.
const SAME_AHEAD_M: f64 = 5.0;
/// And by less than this across it [m]: half of what is between the centres of two narrow vehicles side by side.
const SAME_ASIDE_M: f64 = 1.0;
/// And by less than this in speed [m/s].
const SAME_SPEED_MPS: f64 = 3.0;

/// A vehicle behind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rear {
    pub(crate) track: TrackId,
    /// Gap to E [m]; negative where it overlaps E lengthwise or is past.
    pub(crate) gap_m: f64,
    /// Position of its centre ahead of E's [m].
    pub(crate) x_m: f64,
    /// Position of its centre to the left of E's [m].
    pub(crate) y_m: f64,
    pub(crate) length_m: f64,
    pub(crate) speed_mps: f64,
    /// Standard deviation of the speed [m/s].
    pub(crate) speed_sd_mps: f64,
    pub(crate) confirmed: bool,
    pub(crate) classified: bool,
    /// Probability of being in E's lane [1].
    pub(crate) own_lane: f64,
    /// Probability of being in the passing lane [1].
    pub(crate) passing_lane: f64,
}

impl Rear {
    pub(crate) fn in_own_lane(&self) -> bool {
        self.own_lane >= LIKELY
    }

    /// True once the whole vehicle is ahead of E: it has concluded its overtaking, whatever E does now.
    pub(crate) fn is_past(&self, odometry: &Odometry) -> bool {
        self.x_m > 0.5 * (self.length_m + odometry.length_m)
    }

    /// True where `track` is this vehicle, perhaps as another sensor sees it while it changes lanes. One that drives
    /// beside it is further away sideways.
    fn is_seen_as(&self, track: &Track) -> bool {
        let is_near = (track.x_m() - self.x_m).abs() < SAME_AHEAD_M && (track.y_m() - self.y_m).abs() < SAME_ASIDE_M;
        track.id == self.track || (is_near && (track.vx_mps() - self.speed_mps).abs() < SAME_SPEED_MPS)
    }
}

/// Whether the passing lane is free for the vehicle behind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PassingLane {
    /// The road has none on the overtaking side of E.
    None,
    /// Free as far as it matters.
    Free,
    /// In use.
    Occupied,
    /// Not known: a sensor is missing, or something is there that is not confirmed yet.
    Unknown,
}

/// How hard whatever is ahead might brake, in order to tell which leaves the least room to stop [m/s²].
const MAY_BRAKE_MPS2: f64 = 8.0;

/// A vehicle ahead whose track vanished while it was in E's lane is taken to be there still for this long.
const REMEMBERED: Time = Time::from_ms(500);

/// One vehicle ahead from step to step.
#[derive(Clone, Copy, Debug)]
struct Followed {
    id: TrackId,
    /// When it was last seen.
    seen: Time,
    /// Position of its centre ahead of E's then [m].
    x_m: f64,
    length_m: f64,
    speed_mps: f64,
    /// Its acceleration, smoothed; tracks do not carry it [m/s²].
    acceleration_mps2: f64,
    in_lane: bool,
}

impl Followed {
    fn new(track: &Track) -> Self {
        Self {
            id: track.id,
            seen: track.time,
            x_m: track.x_m(),
            length_m: track.length_m,
            speed_mps: track.vx_mps(),
            acceleration_mps2: 0.0,
            in_lane: in_own_lane(track),
        }
    }

    fn see(&mut self, track: &Track) {
        let step_s = (track.time - self.seen).s();
        if step_s > 0.0 {
            let measured = ((track.vx_mps() - self.speed_mps) / step_s).clamp(-BELIEVED_MPS2, BELIEVED_MPS2);
            let share = step_s / (ACCELERATION_TIME_S + step_s);
            let acceleration_mps2 = self.acceleration_mps2 + share * (measured - self.acceleration_mps2);
            *self = Self { acceleration_mps2, ..Self::new(track) };
        }
    }

    /// This vehicle at `now`, seen then or predicted: braking on as it did, down to a stand.
    fn front(&self, now: Time, odometry: &Odometry) -> Front {
        let since_s = (now - self.seen).s();
        let speed_mps = (self.speed_mps + self.acceleration_mps2 * since_s).max(0.0);
        let moved_m = (0.5 * (self.speed_mps + speed_mps) - odometry.speed_mps) * since_s;
        Front {
            track: self.id,
            gap_m: self.x_m + moved_m - 0.5 * (self.length_m + odometry.length_m),
            speed_mps,
            acceleration_mps2: self.acceleration_mps2,
        }
    }
}

/// Follows the vehicles ahead from step to step: to be updated at each control step.
#[derive(Clone, Debug, Default)]
pub struct FrontFollower {
    followed: Vec<Followed>,
}

impl FrontFollower {
    /// Of the vehicles ahead in E's lane the one that leaves E the least room to stop.
    ///
    /// Not simply the nearest: one that overtakes and is only just past would hide the one behind which E brakes.
    pub fn update(&mut self, input: &EgoInput<'_>) -> Option<Front> {
        let now = input.time;
        for track in input.tracks.iter().filter(|track| track.x_m() > 0.0 && established(track) && exists(track)) {
            match self.followed.iter_mut().find(|followed| followed.id == track.id) {
                // A track that coasts says nothing of its acceleration; for a while the last one is the better guess.
                Some(followed) if track.status == TrackStatus::Coasting && now - followed.seen <= REMEMBERED => {}
                Some(followed) => followed.see(track),
                None => self.begin(track),
            }
        }
        let is_gone = |id| !input.tracks.iter().any(|track| track.id == id && track.x_m() > 0.0);
        self.followed.retain(|followed| {
            let remembered = followed.in_lane && now - followed.seen <= REMEMBERED;
            remembered || !is_gone(followed.id)
        });
        let room_m = |front: &Front| front.gap_m + front.speed_mps * front.speed_mps / (2.0 * MAY_BRAKE_MPS2);
        self.followed
            .iter()
            .filter(|followed| followed.in_lane)
            .map(|followed| followed.front(now, &input.odometry))
            .min_by(|a, b| room_m(a).total_cmp(&room_m(b)))
    }

    /// Follows a new track, as the heir of one that vanished at its place.
    fn begin(&mut self, track: &Track) {
        let now = track.time;
        let heir_of = |followed: &&mut Followed| {
            let since_s = (now - followed.seen).s();
            since_s > 0.0
                && (followed.x_m - track.x_m()).abs() < SAME_AHEAD_M
                && (followed.speed_mps - track.vx_mps()).abs() < SAME_SPEED_MPS
        };
        let fresh = Followed::new(track);
        match self.followed.iter_mut().find(heir_of) {
            Some(followed) => *followed = Followed { acceleration_mps2: followed.acceleration_mps2, ..fresh },
            None => self.followed.push(fresh),
        }
    }
}

fn in_own_lane(track: &Track) -> bool {
    track.lane[OWN] >= LIKELY
}

/// Place of E's own lane among a track's lane probabilities.
const OWN: usize = 1;

/// Place of the passing lane among a track's lane probabilities.
const fn passing(side: Side) -> usize {
    match side {
        Side::Left => 0,
        Side::Right => 2,
    }
}

fn established(track: &Track) -> bool {
    matches!(track.status, TrackStatus::Confirmed | TrackStatus::Coasting)
}

fn exists(track: &Track) -> bool {
    track.existence >= LIKELY
}

/// True where the most probable class is a vehicle's, and a vehicle is more likely than not. Scores that are all equal
/// say nothing, and so do not classify.
fn classified(track: &Track) -> bool {
    let scores = track.class.0;
    let best = scores[track.class.best_vehicle_class() as usize];
    track.class.vehicle() >= LIKELY && best > scores[3]
}

pub(crate) fn rear_of(track: &Track, input: &EgoInput<'_>) -> Rear {
    Rear {
        track: track.id,
        gap_m: -track.x_m() - 0.5 * (track.length_m + input.odometry.length_m),
        x_m: track.x_m(),
        y_m: track.y_m(),
        length_m: track.length_m,
        speed_mps: track.vx_mps(),
        speed_sd_mps: track.covariance[(2, 2)].max(0.0).sqrt(),
        confirmed: established(track),
        classified: classified(track),
        own_lane: track.lane[OWN],
        passing_lane: track.lane[passing(input.road.overtaking_side())],
    }
}

/// The nearest thing behind in E's lane, established or not. Where there is an established one, nearer tentative ones
/// do not hide it.
pub(crate) fn nearest_behind(input: &EgoInput<'_>) -> Option<Rear> {
    let behind = |track: &&Track| {
        track.x_m() < 0.0 && track.source != Source::Front && exists(track) && track.lane[OWN] >= LIKELY
    };
    let nearer = |a: &&Track, b: &&Track| b.x_m().total_cmp(&a.x_m());
    let vehicles = || input.tracks.iter().filter(behind);
    let best = vehicles()
        .filter(|track| established(track) && classified(track))
        .min_by(nearer)
        .or_else(|| vehicles().min_by(nearer))?;
    Some(rear_of(best, input))
}

/// Whether the passing lane is free for `rear` to overtake E.
pub(crate) fn passing_lane(input: &EgoInput<'_>, rear: &Rear) -> PassingLane {
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
    let from_s = ((rear.gap_m - USES_PASSING_LANE_FROM_M) / closing_mps).max(0.0);
    let until_s = (rear.gap_m.max(0.0) + input.odometry.length_m + rear.length_m + PASSED_AHEAD_M) / closing_mps;
    let mut state = PassingLane::Free;
    for track in input.tracks {
        if rear.is_seen_as(track) || !exists(track) || !(track.lane[passing(side)] >= LIKELY) {
            continue;
        }
        let apart_m = 0.5 * (track.length_m + rear.length_m) + FREE_DISTANCE_M;
        let ahead_m = track.x_m() - rear.x_m;
        let opening_mps = track.vx_mps() - rear.speed_mps;
        if keeps_apart(ahead_m + opening_mps * from_s, ahead_m + opening_mps * until_s, apart_m) {
            continue;
        }
        if established(track) {
            return PassingLane::Occupied;
        }
        state = PassingLane::Unknown;
    }
    state
}

/// True where a distance that goes linearly from `first_m` to `last_m` stays beyond `apart_m` on one side.
fn keeps_apart(first_m: f64, last_m: f64, apart_m: f64) -> bool {
    (first_m > apart_m && last_m > apart_m) || (first_m < -apart_m && last_m < -apart_m)
}
