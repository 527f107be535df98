//! The states of the margin increase system, and the conditions between them.

use closecall_traffic::{Absent, Time, TrackId};

use super::{Encounter, Foresight, MisPlan, MisSettings, Response};
use crate::ego::surroundings::{Front, PassingLane, Rear, nearest_behind, passing_lane, rear_of};
use crate::ego::{EgoInput, EgoState, Reason};

/// R has fallen back at this multiple of the engaging distance.
const FELL_BACK_AT: f64 = 1.2;

/// Standard deviations by which R's measured approach must exceed what engaging needs: 95 %, one-sided. A track whose
/// speed is not settled yet does not engage; a true one does at once.
const CONFIDENCE_SD: f64 = 1.645;
/// Share of the engaging closing speed below which R counts as following.
const FOLLOWS_BELOW: f64 = 0.5;

/// How long a condition for releasing has to last, where it may be a passing disturbance.
const PATIENCE: Time = Time::from_ms(1_000);

/// How long a lost track, or a passing lane that is no longer known to be free, is waited for.
const LOST_AFTER: Time = Time::from_ms(500);

/// How far a new track may lie from where the lost one was expected, to be taken for it [m].
const SAME_WITHIN_M: f64 = 5.0;

/// How much its speed may differ [m/s].
const SAME_WITHIN_MPS: f64 = 3.0;

/// Time headway below which a vehicle behind is critically near [s]: the criterion of the criticality metrics. One that
/// changes lanes further away needs no margin.
const LOW_HEADWAY_S: f64 = 0.9;

/// Speed below which E's time headway means nothing [m/s].
const SLOW_MPS: f64 = 1.0;

/// Time that passes until braking takes effect: one control step and the actuators [s].
const BRAKES_AFTER_S: f64 = 0.3;

/// Braking that E is sure of [m/s²]: what a wet road allows (friction 0.6).
const SURE_BRAKING_MPS2: f64 = 6.0;

/// Gap to be left to a standing F [m].
const LEFT_AT_STANDSTILL_M: f64 = 2.0;

/// Jerk with which braking is let go [m/s³].
pub(crate) const LETTING_GO_MPS3: f64 = 3.0;

/// Time constant of E's actuators, as E knows it [s].
const ACTUATOR_LAG_S: f64 = 0.15;

/// A goal that the bound misses by no more than this counts as in reach [s]. A margin that falls short by 0.1 s is still
/// called reached; the rest is left to what the foresight does not know, such as the steps of the control.
const REACHED_WITHIN_S: f64 = 0.08;

/// The margin counts as given back within this multiple of the ACC's gap.
const RETURNED_WITHIN: f64 = 1.2;

/// What the system wants of E.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Wish {
    /// Nothing: the ACC drives.
    Follow,
    /// Brake by this much [m/s²], or harder where the ACC does.
    Brake(f64),
    /// Keep the speed, whatever the ACC wants.
    Hold,
    /// Close up gently.
    Release,
}

/// What the system has decided in one step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Decision {
    pub(crate) wish: Wish,
    pub(crate) state: EgoState,
    pub(crate) reason: Reason,
    pub(crate) plan: Option<MisPlan>,
}

/// The vehicle behind that the system has engaged for.
#[derive(Clone, Copy, Debug)]
struct Target {
    rear: Rear,
    goal_thw_s: f64,
    seen: Time,
    approached: Time,
    lane_free: Time,
}

#[derive(Clone, Copy, Debug)]
enum State {
    Following,
    Increasing(Target),
    Holding(Target, Time),
    Releasing,
}

/// The margin increase system.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mis {
    settings: MisSettings,
    state: State,
    reason: Reason,
    last: Option<Time>,
}

/// One step's surroundings.
#[derive(Clone, Copy)]
pub(crate) struct Situation<'a> {
    pub(crate) input: &'a EgoInput<'a>,
    pub(crate) front: Option<&'a Front>,
    pub(crate) automated: bool,
    /// The acceleration that was last asked of the actuators [m/s²].
    pub(crate) asked_mps2: f64,
    /// The gap that the ACC would keep [m].
    pub(crate) acc_gap_m: f64,
}

impl Situation<'_> {
    fn speed_mps(&self) -> f64 {
        self.input.odometry.speed_mps
    }

    fn thw_front_s(&self) -> Result<f64, Absent> {
        let front = self.front.ok_or(Absent::NoLead)?;
        if self.speed_mps() > SLOW_MPS { Ok(front.gap_m / self.speed_mps()) } else { Err(Absent::Standstill) }
    }
}

impl Mis {
    pub(crate) fn new(settings: MisSettings) -> Self {
        Self { settings, state: State::Following, reason: Reason::NoRear, last: None }
    }

    pub(crate) fn settings(&self) -> &MisSettings {
        &self.settings
    }

    /// One control step.
    pub(crate) fn step(&mut self, at: &Situation<'_>) -> Decision {
        let now = at.input.time;
        let step_s = self.last.map_or(0.0, |last| (now - last).s());
        self.last = Some(now);
        let mut plan = None;
        match self.state {
            State::Following => self.try_to_engage(at),
            State::Increasing(mut target) => {
                target.follow(at, step_s);
                let next = self.after_increasing(at, &mut target);
                self.go(State::Increasing(target), next);
            }
            State::Holding(mut target, since) => {
                target.follow(at, step_s);
                let next = self.after_holding(at, &target, since);
                self.go(State::Holding(target, since), next);
            }
            State::Releasing => {
                if at.front.is_none_or(|front| front.gap_m <= RETURNED_WITHIN * at.acc_gap_m) {
                    self.go(State::Following, Some((State::Following, Reason::MarginReturned)));
                } else if let Ok(target) = self.conditions(at) {
                    self.engage(target, at);
                }
            }
        }
        let (wish, state) = match self.state {
            State::Following => (Wish::Follow, EgoState::Following),
            State::Increasing(target) => {
                let (worked_out, braking_mps2) = self.plan(at, &target);
                plan = Some(worked_out);
                (Wish::Brake(braking_mps2), EgoState::Increasing)
            }
            State::Holding(target, _) => {
                plan = Some(self.plan(at, &target).0);
                (Wish::Hold, EgoState::Holding)
            }
            State::Releasing => (Wish::Release, EgoState::Releasing),
        };
        Decision { wish, state, reason: self.reason, plan }
    }

    fn go(&mut self, same: State, next: Option<(State, Reason)>) {
        match next {
            Some((state, reason)) => (self.state, self.reason) = (state, reason),
            None => self.state = same,
        }
    }

    fn try_to_engage(&mut self, at: &Situation<'_>) {
        match self.conditions(at) {
            Ok(target) => self.engage(target, at),
            Err(missing) => self.reason = missing,
        }
    }

    fn engage(&mut self, target: Target, at: &Situation<'_>) {
        self.state = State::Increasing(target);
        let in_reach = self.plan(at, &target).0.goal_in_reach;
        self.reason = if in_reach { Reason::Engaged } else { Reason::EngagedGoalOutOfReach };
    }

    /// Every condition for engaging, in the order in which the first that is missing is named.
    fn conditions(&self, at: &Situation<'_>) -> Result<Target, Reason> {
        let settings = &self.settings;
        if !at.automated {
            return Err(Reason::NotAutomated);
        }
        let thw_s = at.thw_front_s().map_err(|_| Reason::NoFront)?;
        if !(thw_s < settings.short_thw_s) {
            return Err(Reason::FrontMarginLong);
        }
        let rear = nearest_behind(at.input).ok_or(Reason::NoRear)?;
        if !rear.confirmed {
            return Err(Reason::RearUnconfirmed);
        }
        if !rear.classified {
            return Err(Reason::RearUnclassified);
        }
        if !(rear.gap_m <= settings.engage_gap_m) {
            return Err(Reason::RearFar);
        }
        let surely_mps = rear.speed_mps - CONFIDENCE_SD * rear.speed_sd_mps;
        if !(surely_mps - at.speed_mps() >= settings.engage_closing_mps) {
            return Err(Reason::RearNotApproaching);
        }
        match passing_lane(at.input, &rear) {
            PassingLane::Free => {}
            PassingLane::None => return Err(Reason::NoPassingLane),
            PassingLane::Occupied => return Err(Reason::PassingLaneOccupied),
            PassingLane::Unknown => return Err(Reason::PassingLaneUnknown),
        }
        let now = at.input.time;
        let goal_thw_s = thw_s + settings.thw_gain_s;
        Ok(Target { rear, goal_thw_s, seen: now, approached: now, lane_free: now })
    }

    fn after_increasing(&self, at: &Situation<'_>, target: &mut Target) -> Option<(State, Reason)> {
        let settings = &self.settings;
        let now = at.input.time;
        let rear = &target.rear;
        let closing_mps = rear.speed_mps - at.speed_mps();
        if closing_mps >= FOLLOWS_BELOW * settings.engage_closing_mps {
            target.approached = now;
        }
        let lane =
            if rear.in_own_lane() && closing_mps > 0.0 { passing_lane(at.input, rear) } else { PassingLane::Free };
        if lane == PassingLane::Free {
            target.lane_free = now;
        }
        let release = |reason| Some((State::Releasing, reason));
        if at.front.is_none() {
            release(Reason::FrontLost)
        } else if now - target.seen > LOST_AFTER {
            release(Reason::RearLost)
        } else if rear.is_past(&at.input.odometry) {
            release(Reason::RearPassed)
        } else if !rear.in_own_lane() && rear.gap_m > LOW_HEADWAY_S * rear.speed_mps {
            release(Reason::RearChangedLane)
        } else if rear.gap_m <= settings.critical_gap_m {
            match at.front {
                Some(front) if self.has_room(at.speed_mps(), front) => {
                    Some((State::Holding(*target, now), Reason::CriticalDistance))
                }
                _ => release(Reason::NoRoomToHold),
            }
        } else if rear.gap_m > FELL_BACK_AT * settings.engage_gap_m {
            release(Reason::RearFellBack)
        } else if now - target.approached > PATIENCE {
            release(Reason::RearFollows)
        } else if lane == PassingLane::Occupied {
            release(Reason::PassingLaneOccupied)
        } else if now - target.lane_free > LOST_AFTER {
            release(Reason::PassingLaneUnknown)
        } else {
            None
        }
    }

    fn after_holding(&self, at: &Situation<'_>, target: &Target, since: Time) -> Option<(State, Reason)> {
        let now = at.input.time;
        let reason = match at.front {
            None => Reason::FrontLost,
            Some(_) if target.rear.is_past(&at.input.odometry) => Reason::RearPassed,
            Some(_) if now - target.seen > LOST_AFTER => Reason::RearLost,
            Some(_) if (now - since).s() >= self.settings.hold_s => Reason::HoldExpired,
            Some(front) if !self.has_room(at.speed_mps(), front) => Reason::NoRoomToHold,
            Some(_) => return None,
        };
        Some((State::Releasing, reason))
    }

    /// True where E could still stop behind F if F braked at its worst from now on.
    fn has_room(&self, speed_mps: f64, front: &Front) -> bool {
        let front_way_m = front.speed_mps * front.speed_mps / (2.0 * self.settings.worst_front_braking_mps2);
        let own_way_m = speed_mps * BRAKES_AFTER_S + speed_mps * speed_mps / (2.0 * SURE_BRAKING_MPS2);
        front.gap_m + front_way_m - own_way_m > LEFT_AT_STANDSTILL_M
    }

    /// How E's braking would build up from here.
    fn response(&self, at: &Situation<'_>) -> Response {
        Response {
            asked_mps2: (-at.asked_mps2).max(0.0),
            braking_mps2: -at.input.odometry.acceleration_mps2,
            build_up_mps3: self.settings.max_jerk_mps3,
            let_go_mps3: LETTING_GO_MPS3,
            lag_s: ACTUATOR_LAG_S,
        }
    }

    /// What to report, and the braking to apply [m/s²].
    fn plan(&self, at: &Situation<'_>, target: &Target) -> (MisPlan, f64) {
        let rear = &target.rear;
        let ego_mps = at.speed_mps();
        let (front_gap_m, front_mps) = at.front.map_or((f64::NAN, f64::NAN), |front| (front.gap_m, front.speed_mps));
        let encounter = Encounter {
            ego_mps,
            front_gap_m,
            front_mps,
            rear_gap_m: rear.gap_m,
            closing_mps: rear.speed_mps - ego_mps,
            critical_gap_m: self.settings.critical_gap_m,
        };
        let foresight = Foresight { encounter, response: self.response(at) };
        let bound = self.settings.max_deceleration_mps2;
        let solution = at.front.and_then(|_| foresight.solve(target.goal_thw_s, bound));
        let braking = solution.map_or(0.0, |solution| solution.deceleration_mps2);
        let touching = Encounter { critical_gap_m: 0.0, ..encounter };
        let ttce_s = if rear.gap_m <= 0.0 {
            Err(Absent::Touching)
        } else {
            touching.arrival_s(0.0).ok_or(Absent::NotApproaching)
        };
        let foreseen = foresight.headway_at_arrival_s(braking).filter(|thw_s| thw_s.is_finite());
        let plan = MisPlan {
            track: rear.track,
            rear_gap_m: rear.gap_m,
            closing_mps: encounter.closing_mps,
            thw_front_s: at.thw_front_s(),
            ttce_s,
            time_to_critical_s: foresight.arrival_s(braking).ok_or(Absent::NotApproaching),
            deceleration_mps2: braking,
            goal_thw_s: target.goal_thw_s,
            thw_at_critical_s: foreseen.ok_or(if at.front.is_some() { Absent::NotApproaching } else { Absent::NoLead }),
            goal_in_reach: solution.is_some()
                && foreseen.is_some_and(|thw_s| thw_s >= target.goal_thw_s - REACHED_WITHIN_S),
        };
        (plan, braking)
    }
}

impl Target {
    /// Takes over what the tracks say of the vehicle, or carries it on where they say nothing.
    fn follow(&mut self, at: &Situation<'_>, step_s: f64) {
        let own_mps = at.speed_mps();
        let expected_m = self.rear.x_m + (self.rear.speed_mps - own_mps) * step_s;
        let same = |id: TrackId| at.input.tracks.iter().find(|track| track.id == id);
        let found = same(self.rear.track).or_else(|| {
            at.input.tracks.iter().find(|track| {
                (track.x_m() - expected_m).abs() < SAME_WITHIN_M
                    && (track.vx_mps() - self.rear.speed_mps).abs() < SAME_WITHIN_MPS
                    && rear_of(track, at.input).passing_lane + rear_of(track, at.input).own_lane >= 0.5
            })
        });
        match found {
            Some(track) => {
                self.rear = rear_of(track, at.input);
                self.seen = at.input.time;
            }
            None => {
                self.rear.gap_m -= expected_m - self.rear.x_m;
                self.rear.x_m = expected_m;
            }
        }
    }
}
