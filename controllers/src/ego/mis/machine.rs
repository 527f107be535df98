//! The state machine of the margin increase system.

use closecall_traffic::metrics::CRITICAL_THW_S;
use closecall_traffic::{Absent, Time};

use super::room::{can_defer, has_room};
use super::target::Target;
use super::{ArrivalPrediction, BrakingResponse, Encounter, Horizon, MisPlan, MisSettings};
use crate::ego::surroundings::{Front, PassingLane, RearVehicle, is_followed, nearest_rear_vehicle, passing_lane};
use crate::ego::{EgoInput, EgoState, Reason};

/// Multiple of the engaging gap beyond which the rear vehicle has fallen back: an assumption; 1.1
/// to 1.5 are plausible.
const FELL_BACK_GAP_RATIO: f64 = 1.2;

/// Number of standard deviations by which the measured closing speed must exceed the closing speed
/// for engaging: 95 %, one-sided. A track whose speed has not settled yet does not engage; a track
/// without error engages at once.
const CONFIDENCE_SD: f64 = 1.645;
/// Share of the engaging closing speed below which the rear vehicle counts as following: an
/// assumption; 0.2 to 0.8 are plausible.
const FOLLOWING_SPEED_SHARE: f64 = 0.5;

/// Time for which the rear vehicle must follow before the system releases: shorter intervals may be
/// disturbances. An assumption; 0.5 to 2 s are plausible.
const FOLLOWING_DELAY: Time = Time::from_ms(1_000);

/// Time for which a lost track, or a passing lane that is no longer known to be free, is tolerated:
/// an assumption; 0.2 to 1 s are plausible.
const LOSS_TIMEOUT: Time = Time::from_ms(500);

/// Speed below which the time headway of the ego is meaningless (m/s).
const MIN_THW_SPEED_MPS: f64 = 1.0;

/// Jerk with which braking is released (m/s³): an assumption; 2 to 5 are plausible.
pub const BRAKE_RELEASE_JERK_MPS3: f64 = 3.0;

/// Time constant of the actuators, as the ego knows it (s): the value of the simulated car;
/// published responses of car brakes are 0.1 to 0.3 s.
pub const ACTUATOR_LAG_S: f64 = 0.15;

/// Largest shortfall at which the goal still counts as in reach (s). A margin that falls short by
/// 0.1 s is still called reached; the difference covers effects that the prediction does not model,
/// such as the control steps.
pub const GOAL_TOLERANCE_S: f64 = 0.08;

/// Multiple of the gap of the ACC within which the margin counts as returned: an assumption; 1.05
/// to 1.5 are plausible.
const RETURNED_GAP_RATIO: f64 = 1.2;

/// The request of the system to the arbitration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Request {
    /// No request: the ACC drives.
    Follow,
    /// Brake by this much (m/s²), or harder if the ACC does.
    Brake(f64),
    /// Keep the speed, whatever the ACC requests.
    Hold,
    /// Close the gap to the lead vehicle gently.
    Release,
}

/// The decision of one control step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Decision {
    pub(crate) request: Request,
    pub(crate) state: EgoState,
    pub(crate) reason: Reason,
    pub(crate) plan: Option<MisPlan>,
}

#[derive(Clone, Copy, Debug)]
enum State {
    Following,
    Increasing(Target),
    /// With the time at which holding began.
    Holding(Target, Time),
    Releasing,
}

/// The margin increase system.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mis {
    settings: MisSettings,
    state: State,
    reason: Reason,
    last_step: Option<Time>,
}

/// The surroundings of the ego at one control step.
#[derive(Clone, Copy)]
pub(crate) struct Situation<'a> {
    pub(crate) input: &'a EgoInput<'a>,
    pub(crate) lead: Option<&'a Front>,
    pub(crate) automated: bool,
    /// The last comfort command (m/s²).
    pub(crate) commanded_mps2: f64,
    /// The desired gap of the ACC (m).
    pub(crate) acc_gap_m: f64,
    /// Whether emergency braking acted at the last control step.
    pub(crate) emergency_braking: bool,
}

impl Situation<'_> {
    pub(super) fn speed_mps(&self) -> f64 {
        self.input.odometry.speed_mps
    }

    fn thw_front_s(&self) -> Result<f64, Absent> {
        let lead = self.lead.ok_or(Absent::NoLead)?;
        if self.speed_mps() > MIN_THW_SPEED_MPS { Ok(lead.gap_m / self.speed_mps()) } else { Err(Absent::Standstill) }
    }
}

impl Mis {
    pub(crate) fn new(settings: MisSettings) -> Self {
        Self { settings, state: State::Following, reason: Reason::NoRear, last_step: None }
    }

    pub(crate) fn settings(&self) -> &MisSettings {
        &self.settings
    }

    /// Returns true if the ego is not to brake for the lead vehicle yet: the rear vehicle in its
    /// lane would reach it within the holding time at present speeds, no vehicle is in its way in
    /// the passing lane, and there is still room to brake later. Only the extended system defers
    /// braking.
    ///
    /// A rear vehicle this near can no longer stop behind a braking ego. It pulls out, and needs
    /// the distance that the ego does not lose meanwhile.
    pub(crate) fn defers_braking(&self, input: &EgoInput<'_>, lead: &Front) -> bool {
        let settings = &self.settings;
        let speed_mps = input.odometry.speed_mps;
        let passes_soon = |rear: RearVehicle| {
            let lane = passing_lane(input, &rear, settings.follower_headway_s);
            rear.gap_m < settings.hold_s * (rear.speed_mps - speed_mps)
                && !matches!(lane, PassingLane::None | PassingLane::Occupied)
        };
        settings.is_cautious
            && nearest_rear_vehicle(input).filter(|rear| rear.confirmed && rear.classified).is_some_and(passes_soon)
            && can_defer(speed_mps, lead)
    }

    /// Performs one control step.
    pub(crate) fn step(&mut self, situation: &Situation<'_>) -> Decision {
        let now = situation.input.time;
        let step_s = self.last_step.map_or(0.0, |last| (now - last).s());
        self.last_step = Some(now);
        let mut plan = None;
        match self.state {
            State::Following => self.try_to_engage(situation),
            State::Increasing(mut target) => {
                target.update(situation, step_s);
                let next = self.transition_from_increasing(situation, &mut target);
                self.transition(State::Increasing(target), next);
            }
            State::Holding(mut target, since) => {
                target.update(situation, step_s);
                let next = self.transition_from_holding(situation, &target, since);
                self.transition(State::Holding(target, since), next);
            }
            State::Releasing => {
                if situation.lead.is_none_or(|lead| lead.gap_m <= RETURNED_GAP_RATIO * situation.acc_gap_m) {
                    self.transition(State::Following, Some((State::Following, Reason::MarginReturned)));
                } else if let Ok(target) = self.check_conditions(situation) {
                    self.engage(target, situation);
                }
            }
        }
        let (request, state) = match self.state {
            State::Following => (Request::Follow, EgoState::Following),
            State::Increasing(target) => {
                let (new_plan, braking_mps2) = self.plan(situation, &target);
                plan = Some(new_plan);
                (Request::Brake(braking_mps2), EgoState::Increasing)
            }
            State::Holding(target, _) => {
                plan = Some(self.plan(situation, &target).0);
                (Request::Hold, EgoState::Holding)
            }
            State::Releasing => (Request::Release, EgoState::Releasing),
        };
        Decision { request, state, reason: self.reason, plan }
    }

    fn transition(&mut self, unchanged: State, next: Option<(State, Reason)>) {
        match next {
            Some((state, reason)) => (self.state, self.reason) = (state, reason),
            None => self.state = unchanged,
        }
    }

    fn try_to_engage(&mut self, situation: &Situation<'_>) {
        match self.check_conditions(situation) {
            Ok(target) => self.engage(target, situation),
            Err(missing) => self.reason = missing,
        }
    }

    fn engage(&mut self, target: Target, situation: &Situation<'_>) {
        self.state = State::Increasing(target);
        let in_reach = self.plan(situation, &target).0.goal_in_reach;
        self.reason = if in_reach { Reason::Engaged } else { Reason::EngagedGoalOutOfReach };
    }

    /// Checks all conditions for engaging, in the documented order. Returns the target, or the
    /// first missing condition.
    fn check_conditions(&self, situation: &Situation<'_>) -> Result<Target, Reason> {
        let settings = &self.settings;
        if !situation.automated {
            return Err(Reason::NotAutomated);
        }
        if let Some(failed) = situation.input.sensors.reason() {
            return Err(failed);
        }
        let thw_s = situation.thw_front_s().map_err(|_| Reason::NoFront)?;
        if !(thw_s < settings.short_thw_s) {
            return Err(Reason::FrontMarginLong);
        }
        let rear = nearest_rear_vehicle(situation.input).ok_or(Reason::NoRear)?;
        if !rear.confirmed {
            return Err(Reason::RearUnconfirmed);
        }
        if !rear.classified {
            return Err(Reason::RearUnclassified);
        }
        if !(rear.gap_m <= settings.engage_gap_m) {
            return Err(Reason::RearFar);
        }
        let least_speed_mps = rear.speed_mps - CONFIDENCE_SD * rear.speed_sd_mps;
        if !(least_speed_mps - situation.speed_mps() >= settings.engage_closing_mps) {
            return Err(Reason::RearNotApproaching);
        }
        if settings.is_cautious && is_followed(situation.input, &rear) {
            return Err(Reason::RearFollowed);
        }
        match passing_lane(situation.input, &rear, settings.follower_headway_s) {
            PassingLane::Free => {}
            PassingLane::None => return Err(Reason::NoPassingLane),
            PassingLane::Occupied => return Err(Reason::PassingLaneOccupied),
            PassingLane::Unknown => return Err(Reason::PassingLaneUnknown),
        }
        let now = situation.input.time;
        let goal_thw_s = thw_s + settings.thw_gain_s;
        let has_braked_hard = situation.emergency_braking;
        Ok(Target { rear, goal_thw_s, last_seen: now, last_approached: now, last_lane_free: now, has_braked_hard })
    }

    fn transition_from_increasing(&self, situation: &Situation<'_>, target: &mut Target) -> Option<(State, Reason)> {
        let settings = &self.settings;
        let now = situation.input.time;
        let rear = &target.rear;
        let closing_mps = rear.speed_mps - situation.speed_mps();
        if closing_mps >= FOLLOWING_SPEED_SHARE * settings.engage_closing_mps {
            target.last_approached = now;
        }
        let lane = if rear.in_own_lane() && closing_mps > 0.0 {
            passing_lane(situation.input, rear, settings.follower_headway_s)
        } else {
            PassingLane::Free
        };
        if lane == PassingLane::Free {
            target.last_lane_free = now;
        }
        let release = |reason| Some((State::Releasing, reason));
        if situation.lead.is_none() {
            release(Reason::FrontLost)
        } else if now - target.last_seen > LOSS_TIMEOUT {
            release(Reason::RearLost)
        } else if rear.is_past(&situation.input.odometry) {
            release(Reason::RearPassed)
        } else if !rear.in_own_lane() && rear.gap_m > CRITICAL_THW_S * rear.speed_mps {
            release(Reason::RearChangedLane)
        } else if let Some(reason) = self.reason_to_hold(situation, rear) {
            Some((State::Holding(*target, now), reason))
        } else if rear.gap_m <= settings.critical_gap_m {
            release(if settings.hold_s > 0.0 { Reason::NoRoomToHold } else { Reason::HoldExpired })
        } else if rear.gap_m > FELL_BACK_GAP_RATIO * settings.engage_gap_m {
            release(Reason::RearFellBack)
        } else if now - target.last_approached > FOLLOWING_DELAY {
            release(Reason::RearFollows)
        } else if settings.is_cautious && is_followed(situation.input, rear) {
            release(Reason::RearFollowed)
        } else if lane == PassingLane::Occupied {
            release(Reason::PassingLaneOccupied)
        } else if now - target.last_lane_free > LOSS_TIMEOUT {
            release(situation.input.sensors.reason().unwrap_or(Reason::PassingLaneUnknown))
        } else {
            None
        }
    }

    fn transition_from_holding(
        &self,
        situation: &Situation<'_>,
        target: &Target,
        since: Time,
    ) -> Option<(State, Reason)> {
        let now = situation.input.time;
        let reason = match situation.lead {
            None => Reason::FrontLost,
            Some(_) if target.rear.is_past(&situation.input.odometry) => Reason::RearPassed,
            Some(_) if now - target.last_seen > LOSS_TIMEOUT => Reason::RearLost,
            Some(_) if (now - since).s() >= self.settings.hold_s => Reason::HoldExpired,
            Some(lead) if !has_room(situation.speed_mps(), lead, self.settings.worst_front_braking_mps2) => {
                Reason::NoRoomToHold
            }
            Some(_) => return None,
        };
        Some((State::Releasing, reason))
    }

    /// Returns why holding begins now: the rear vehicle crosses the marking or is at the critical
    /// gap, and there is room. Returns `None` if it does not begin.
    fn reason_to_hold(&self, situation: &Situation<'_>, rear: &RearVehicle) -> Option<Reason> {
        let reason = if rear.gap_m <= self.settings.critical_gap_m {
            Reason::CriticalDistance
        } else if !rear.in_own_lane() {
            Reason::RearCrosses
        } else {
            return None;
        };
        let has_room = situation
            .lead
            .is_some_and(|lead| has_room(situation.speed_mps(), lead, self.settings.worst_front_braking_mps2));
        (has_room && self.settings.hold_s > 0.0).then_some(reason)
    }

    /// Returns the build-up of the ego's braking from now on.
    fn response(&self, situation: &Situation<'_>) -> BrakingResponse {
        BrakingResponse {
            commanded_mps2: (-situation.commanded_mps2).max(0.0),
            braking_mps2: -situation.input.odometry.acceleration_mps2,
            build_up_mps3: self.settings.max_jerk_mps3,
            release_mps3: BRAKE_RELEASE_JERK_MPS3,
            lag_s: ACTUATOR_LAG_S,
        }
    }

    /// Returns the plan to report, and the braking to apply (m/s²).
    fn plan(&self, situation: &Situation<'_>, target: &Target) -> (MisPlan, f64) {
        let rear = &target.rear;
        let ego_mps = situation.speed_mps();
        let (front_gap_m, lead_mps) = situation.lead.map_or((f64::NAN, f64::NAN), |lead| (lead.gap_m, lead.speed_mps));
        let encounter = Encounter {
            ego_mps,
            front_gap_m,
            lead_mps,
            rear_gap_m: rear.gap_m,
            closing_mps: rear.speed_mps - ego_mps,
            critical_gap_m: self.settings.critical_gap_m,
        };
        let prediction = ArrivalPrediction { encounter, response: self.response(situation) };
        let bound = self.settings.max_deceleration_mps2;
        let solution = situation
            .lead
            .filter(|lead| target.may_cost_speed(lead, ego_mps))
            .filter(|lead| lead.speed_mps - ego_mps < self.settings.max_deficit_mps)
            .and_then(|_| match self.settings.horizon {
                Horizon::CriticalGap => prediction.solve(target.goal_thw_s, bound),
                Horizon::Ttce => encounter.solve_by_ttce(target.goal_thw_s, bound),
            });
        let braking = solution.map_or(0.0, |solution| solution.deceleration_mps2);
        let touching = Encounter { critical_gap_m: 0.0, ..encounter };
        let ttce_s = if rear.gap_m <= 0.0 {
            Err(Absent::Touching)
        } else {
            touching.arrival_s(0.0).ok_or(Absent::NotApproaching)
        };
        let predicted_thw = prediction.headway_at_arrival_s(braking).filter(|thw_s| thw_s.is_finite());
        let plan = MisPlan {
            track: rear.track,
            rear_gap_m: rear.gap_m,
            closing_mps: encounter.closing_mps,
            thw_front_s: situation.thw_front_s(),
            ttce_s,
            time_to_critical_s: prediction.arrival_s(braking).ok_or(Absent::NotApproaching),
            deceleration_mps2: braking,
            goal_thw_s: target.goal_thw_s,
            thw_at_critical_s: predicted_thw.ok_or(if situation.lead.is_some() {
                Absent::NotApproaching
            } else {
                Absent::NoLead
            }),
            goal_in_reach: solution.is_some()
                && predicted_thw.is_some_and(|thw_s| thw_s >= target.goal_thw_s - GOAL_TOLERANCE_S),
        };
        let is_early = self.settings.is_early && braking > 0.0 && falls_short(&prediction, target);
        (plan, if is_early { bound } else { braking })
    }
}

/// Returns true if the headway misses the goal by more than the tolerance when the rear vehicle
/// arrives, with an ego that brakes no more.
fn falls_short(prediction: &ArrivalPrediction, target: &Target) -> bool {
    prediction.headway_at_arrival_s(0.0).is_some_and(|thw_s| thw_s < target.goal_thw_s - GOAL_TOLERANCE_S)
}
