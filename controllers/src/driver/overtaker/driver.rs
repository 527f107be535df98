//! The overtaking driver: adapts perception, prediction and car-following to the simulation loop.

use closecall_traffic::{Indicator, Lane, MINIMUM_JERK_PEAK, Side, Stream, Time};

use super::acceptance::{GapAcceptance, MIN_GAIN_MPS, Tolerance};
use super::conflict::Course;
use super::follow::FollowModel;
use super::{Overtaker, path};
use crate::driver::pedals::Pedals;
use crate::driver::perception::{PerceivedScene, PerceivedVehicle, Perception};
use crate::driver::wiedemann99::{
    EmergencyBrakingDetector, brake_before_overtaking, brake_for_brake_light, brake_while_overtaking,
};
use crate::driver::{
    BRAKING_MARGIN, Driver, DriverAction, DriverError, DriverInput, DriverNote, LaneChange, Looks, check_finite, finite,
};

/// Required braking below which an overtaking driver does not brake (m/s²): an assumption; 0 to 0.5
/// are plausible.
const TOLERATED_BRAKING_MPS2: f64 = 0.1;

/// Lateral distance between two boxes from which they count as clear (m): an assumption; 0 to 0.5
/// are plausible.
const LATERAL_CLEARANCE_M: f64 = 0.1;

/// Time before pulling out from which a driver signals (s): an assumption. Drivers signal in 64 %
/// of lane changes, some only after the change has begun (Lee, Olsen and Wierwille, *A
/// Comprehensive Examination of Naturalistic Lane-Changes*, DOT HS 809 702, 2004).
const SIGNALLING_TIME_S: f64 = 2.0;
/// Time over which a driver looks along a lane that it enters (s): no driver changes to a lane that
/// ends within it. Assumption: 5 to 15 are plausible; a lane change takes about 5 s.
const OPEN_AHEAD_S: f64 = 10.0;

/// Duration of the change back to the original lane after an abort (s): an assumption; 2 to 5 are
/// plausible.
const ABORT_DURATION_S: f64 = 3.0;

/// Required braking above which a driver steers more sharply than planned, to be clear earlier
/// (m/s²): an assumption; 2 to 5 are plausible. Drivers who steer begin later than drivers who
/// brake: 1.5 s after the event (Summala 1981).
const EVASIVE_STEERING_FROM_MPS2: f64 = 3.0;

/// Phase of the overtaking manoeuvre.
#[derive(Clone, Copy, Debug)]
pub(super) enum Phase {
    /// Approaches the vehicle ahead, or follows it.
    Approaching,
    /// Changes to the passing lane.
    Changing(Change),
    /// Aborts, and changes back to the original lane.
    Aborting { origin: Lane },
    /// Passes the overtaken vehicle in the passing lane.
    Overtaking { overtaken: Option<usize> },
    /// Has passed the overtaken vehicle.
    Passed(CompletedPassing),
    /// Changes back to the original lane.
    Returning { origin: Lane, passing: CompletedPassing },
}

/// A completed passing.
#[derive(Clone, Copy, Debug)]
pub(super) struct CompletedPassing {
    /// Time at which the overtaken vehicle was passed.
    pub(super) time: Time,
    /// Index of the overtaken vehicle.
    pub(super) overtaken: Option<usize>,
}

/// A lane change in progress.
#[derive(Clone, Copy, Debug)]
pub(super) struct Change {
    origin: Lane,
    target: Lane,
    overtaken: Option<usize>,
    start_s_m: f64,
    /// Length of the path along the road (m).
    length_m: f64,
    /// Lateral position of the start of the path (m).
    start_d_m: f64,
    /// Lateral distance from start to end of the path (m).
    lateral_distance_m: f64,
    /// Share of the length at which the driver is laterally clear of the overtaken vehicle.
    clear_at: f64,
    /// True once the driver has steered more sharply than planned.
    evasive: bool,
}

impl Change {
    /// Returns the distance from `s_m` to the point at which the driver is laterally clear (m).
    fn distance_to_clear_m(&self, s_m: f64) -> f64 {
        self.clear_at * self.length_m - (s_m - self.start_s_m)
    }
}

/// A human driver who overtakes.
#[derive(Clone, Debug)]
pub(crate) struct OvertakerDriver {
    pub(super) settings: Overtaker,
    model: FollowModel,
    /// The model behind the second leader.
    beyond_model: FollowModel,
    desired_mps: Option<f64>,
    perception: Option<Perception>,
    pub(super) phase: Phase,
    emergency: EmergencyBrakingDetector,
    pedals: Pedals,
}

impl OvertakerDriver {
    pub(super) fn new(settings: Overtaker) -> Self {
        Self {
            settings,
            model: settings.follow.model(),
            beyond_model: settings.follow.model(),
            desired_mps: settings.follow.desired_mps(),
            perception: None,
            phase: Phase::Approaching,
            emergency: EmergencyBrakingDetector::new(settings.follow.hardest_braking_mps2()),
            pedals: Pedals::new(settings.brake_build_up_mps3),
        }
    }
}

impl Driver for OvertakerDriver {
    fn step(&mut self, input: &DriverInput<'_>, rng: &mut Stream) -> Result<DriverAction, DriverError> {
        check_finite(input)?;
        let speed_mps = input.own.speed_mps;
        let desired_mps = input.desired_now_mps(*self.desired_mps.get_or_insert(speed_mps));
        let (reaction, side) = (self.settings.reaction, input.road.overtaking_side());
        let (lapse, perception) = (self.settings.lapse, self.settings.perception);
        let new = || Perception::new(reaction.draw_s(rng), Some(side)).with_lapses(lapse).with_settings(perception);
        let scene = self.perception.get_or_insert_with(new).observe(input, rng);
        let step = Step { input, scene: &scene, side, speed_mps, desired_mps };
        let mut action = match self.phase {
            Phase::Approaching => self.approach(&step),
            Phase::Changing(change) => self.continue_change(&step, change),
            Phase::Aborting { origin } => self.abort(&step, origin),
            Phase::Overtaking { overtaken } => self.overtake(&step, overtaken),
            Phase::Passed(passing) => self.drive_on(&step, passing),
            Phase::Returning { origin, passing } => self.return_to_origin(&step, origin, passing),
        };
        let applied_mps2 = self.pedals.apply_mps2(action.acceleration_mps2, input.time);
        action.acceleration_mps2 = finite(applied_mps2, "acceleration of an overtaking driver", input.time)?;
        let emergency = self.emergency.detect(action.acceleration_mps2);
        action.note = action.note.or(emergency);
        Ok(action)
    }

    fn looks(&self) -> Looks {
        Looks { beyond: self.settings.perception.looks_beyond(), ..Looks::AROUND }
    }
}

/// The input of one step and how the driver perceives it.
pub(super) struct Step<'a> {
    pub(super) input: &'a DriverInput<'a>,
    pub(super) scene: &'a PerceivedScene,
    /// Side of the passing lane.
    pub(super) side: Side,
    pub(super) speed_mps: f64,
    desired_mps: f64,
}

impl Step<'_> {
    fn indicator(&self) -> Indicator {
        Indicator::towards(self.side)
    }

    /// Returns the perceived vehicle ahead, unless it is the overtaken vehicle beside the driver's
    /// path: the driver may have passed a vehicle that was ahead in the original lane one reaction
    /// time ago. The next vehicle in the path then takes its place. An overtaken vehicle that comes
    /// into the driver's path is an ordinary lead vehicle.
    pub(super) fn ahead_except(&self, overtaken: Option<usize>) -> Option<&PerceivedVehicle> {
        let is_meant = |ahead: &&PerceivedVehicle| Some(ahead.actor) != overtaken || ahead.is_in_path(self.input);
        let beyond = self.scene.beyond.as_ref().filter(|beyond| beyond.is_in_path(self.input));
        self.scene.ahead.as_ref().filter(is_meant).or(beyond)
    }

    /// Returns whether a lane stays wide enough for the next [`OPEN_AHEAD_S`].
    pub(super) fn is_open(&self, lane: Lane) -> bool {
        let own_m = self.input.own.s_m;
        self.input.road.is_open(lane, [own_m, own_m + OPEN_AHEAD_S * self.speed_mps])
    }

    /// Returns the perceived lead vehicle in the passing lane, in which the driver is by now. One
    /// reaction time ago that lane may have been the adjacent lane.
    fn lead_in_passing_lane(&self, overtaken: Option<usize>) -> Option<&PerceivedVehicle> {
        let lane = self.input.road.lane_of(self.input.own);
        if self.input.road.beside(self.scene.lane, self.side) == Some(lane) {
            self.scene.adjacent(self.side).and_then(|lane| lane.lead.as_ref())
        } else {
            self.ahead_except(overtaken)
        }
    }

    /// Returns the overtaken vehicle: the nearest vehicle ahead in the original lane `origin`. If
    /// the first vehicle leaves that lane as well, it is the next vehicle.
    fn overtaken_in(&self, origin: Lane) -> Option<&PerceivedVehicle> {
        let mut leaders = [self.scene.ahead.as_ref(), self.scene.beyond.as_ref()].into_iter().flatten();
        leaders.find(|leader| self.input.road.lane_at(self.ahead_s_m(leader), leader.d_m) == origin)
    }

    /// Returns about where a vehicle ahead is along the road (m): its rear end.
    fn ahead_s_m(&self, ahead: &PerceivedVehicle) -> f64 {
        self.input.own.s_m + 0.5 * self.input.vehicle.dimensions.length_m + ahead.lead.gap_m
    }

    /// Returns the present lateral position of the intended path (m).
    fn path_d_m(&self) -> f64 {
        self.input.own.d_m - self.input.lateral_deviation_m
    }

    /// Returns the lateral distance from the intended path to the centre of `target` (m).
    fn lateral_distance_m(&self, target: Lane) -> f64 {
        (self.input.road.lane_centre_m(target, self.input.own.s_m) - self.path_d_m()).abs()
    }

    /// Plans a lane change from the present position to `target`, past the vehicle `ahead`.
    fn plan_change(&self, origin: Lane, target: Lane, ahead: Option<&PerceivedVehicle>, duration_s: f64) -> Change {
        let start_d_m = self.path_d_m();
        let mut change = Change {
            origin,
            target,
            overtaken: ahead.map(|ahead| ahead.actor),
            start_s_m: self.input.own.s_m,
            length_m: self.speed_mps * duration_s,
            start_d_m,
            lateral_distance_m: self.lateral_distance_m(target),
            clear_at: 0.0,
            evasive: false,
        };
        change.clear_at = ahead.map_or(0.0, |ahead| self.clear_at(&change, ahead));
        change
    }

    /// Returns the share of the length at which the driver is laterally clear of `ahead`.
    fn clear_at(&self, change: &Change, ahead: &PerceivedVehicle) -> f64 {
        let apart_m = 0.5 * (self.input.vehicle.dimensions.width_m + ahead.width_m) + LATERAL_CLEARANCE_M;
        path::longitudinal_share((apart_m + self.lateral_from_start_m(change, ahead.d_m)) / change.lateral_distance_m)
    }

    /// Returns the share of the length at which the centre of the driver's vehicle crosses the lane
    /// marking.
    fn crossing_at(&self, change: &Change) -> f64 {
        let road = self.input.road;
        let [own_m, target_m] = [change.origin, change.target].map(|lane| road.lane_centre_m(lane, change.start_s_m));
        let middle_m = 0.5 * (own_m + target_m);
        // The marking lies beyond the middle between the centres if the lane of origin is wider.
        let [own_m, target_m] = [change.origin, change.target].map(|lane| road.lane_width_m(lane, change.start_s_m));
        let beyond_m = 0.25 * (own_m - target_m);
        path::longitudinal_share((self.lateral_from_start_m(change, middle_m) + beyond_m) / change.lateral_distance_m)
    }

    /// Returns the lateral distance from the start of a change to `d_m`, positive towards its
    /// target (m), for a driver who keeps the present deviation from the intended path.
    fn lateral_from_start_m(&self, change: &Change, d_m: f64) -> f64 {
        let to_the_left_m = d_m - change.start_d_m - self.input.lateral_deviation_m;
        match self.side {
            Side::Left => to_the_left_m,
            Side::Right => -to_the_left_m,
        }
    }
}

impl OvertakerDriver {
    /// Keeps the speed and pulls out in time, if the passing lane is free; follows the vehicle
    /// ahead otherwise.
    fn approach(&mut self, step: &Step<'_>) -> DriverAction {
        let origin = step.input.road.lane_of(step.input.own);
        let target = step.input.road.beside(origin, step.side).filter(|target| step.is_open(*target));
        let (Some(ahead), Some(target), Some(lane)) =
            (step.scene.ahead.as_ref(), target, step.scene.adjacent(step.side))
        else {
            return self.cruise(step, step.scene.ahead.as_ref());
        };
        let acceptance = self.gap_acceptance(step, ahead.lead.speed_mps, Tolerance::TO_START);
        let wants_to_overtake = step.desired_mps >= ahead.lead.speed_mps + MIN_GAIN_MPS;
        if !wants_to_overtake || !acceptance.accepts(lane) {
            return self.cruise(step, Some(ahead));
        }
        let change = step.plan_change(origin, target, Some(ahead), self.settings.duration_s);
        let course = self.course(step, ahead, change.clear_at * change.length_m);
        let keep_mps2 = self.model.acceleration_mps2(step.speed_mps, step.desired_mps, None);
        let keep_mps2 = brake_before_overtaking(keep_mps2, step.speed_mps, Some(ahead));
        let crossing_m = step.crossing_at(&change) * change.length_m;
        let slowing_mps2 = (-keep_mps2).max(0.0);
        let pull_out = course.thw_after_s(crossing_m, slowing_mps2) <= self.settings.cut_out_thw_s
            || course.gap_after_m(course.distance_to_clear_m) <= course.min_gap_m;
        if !pull_out {
            let signalling_m = crossing_m + SIGNALLING_TIME_S * step.speed_mps;
            let signals = course.thw_after_s(signalling_m, slowing_mps2) <= self.settings.cut_out_thw_s;
            let indicator = if signals { step.indicator() } else { Indicator::Off };
            return DriverAction { acceleration_mps2: keep_mps2, indicator, ..DriverAction::default() };
        }
        self.phase = Phase::Changing(change);
        DriverAction {
            acceleration_mps2: self.limited_by_course_mps2(keep_mps2, &course),
            lane_change: Some(LaneChange { target, duration_s: self.settings.duration_s }),
            indicator: step.indicator(),
            note: Some(DriverNote::CutOutStarted),
        }
    }

    /// Continues the lane change to the passing lane, or aborts it.
    fn continue_change(&mut self, step: &Step<'_>, mut change: Change) -> DriverAction {
        let ego = step.input.own;
        let in_target_lane = step.input.road.lane_of(ego) == change.target;
        let overtaken = step.overtaken_in(change.origin);
        if let Some(ahead) = overtaken {
            change.overtaken = Some(ahead.actor);
            change.clear_at = step.clear_at(&change, ahead);
        }
        let distance_to_clear_m = change.distance_to_clear_m(ego.s_m);
        if in_target_lane && distance_to_clear_m <= 0.0 {
            self.phase = Phase::Overtaking { overtaken: change.overtaken };
            return self.overtake(step, change.overtaken);
        }
        if !in_target_lane && self.must_abort(step, overtaken) {
            self.phase = Phase::Aborting { origin: change.origin };
            self.observe_side(step.side.opposite());
            let back = LaneChange { target: change.origin, duration_s: ABORT_DURATION_S };
            let following = self.cruise(step, step.scene.ahead.as_ref());
            return DriverAction { lane_change: Some(back), note: Some(DriverNote::CutOutAborted), ..following };
        }
        let following_mps2 = self.follow_in_target(step, &change);
        let requested_mps2 =
            brake_while_overtaking(following_mps2, step.speed_mps, overtaken.filter(|_| distance_to_clear_m > 0.0));
        let mut action =
            DriverAction { acceleration_mps2: requested_mps2, indicator: step.indicator(), ..DriverAction::default() };
        if let Some(ahead) = overtaken {
            let course = self.course(step, ahead, distance_to_clear_m);
            if !change.evasive && course.required_braking_mps2() > EVASIVE_STEERING_FROM_MPS2 {
                action.lane_change = evade(step, &mut change, ahead, &self.settings);
            }
            let course = self.course(step, ahead, change.distance_to_clear_m(ego.s_m));
            let kept_mps2 = if course.allows(requested_mps2) { requested_mps2 } else { requested_mps2.min(0.0) };
            action.acceleration_mps2 = self.limited_by_course_mps2(kept_mps2, &course);
        }
        self.phase = Phase::Changing(change);
        action
    }

    /// Follows the nearer of the vehicles ahead, in the driver's lane and in the original one,
    /// until the driver is back there: its centre may swing into the passing lane before it turns
    /// back.
    fn abort(&mut self, step: &Step<'_>, origin: Lane) -> DriverAction {
        if step.input.lane_change_target != Some(origin) {
            self.phase = Phase::Approaching;
            self.observe_side(step.side);
        }
        let beside = step.scene.adjacent(step.side.opposite()).filter(|_| step.scene.lane != origin);
        let in_origin = beside.and_then(|lane| lane.lead.as_ref());
        let ahead = [step.scene.ahead.as_ref(), in_origin].into_iter().flatten();
        self.cruise(step, ahead.min_by(|a, b| a.lead.gap_m.total_cmp(&b.lead.gap_m)))
    }

    /// Drives past the overtaken vehicle in the passing lane.
    fn overtake(&mut self, step: &Step<'_>, overtaken: Option<usize>) -> DriverAction {
        let mut action = self.cruise(step, step.lead_in_passing_lane(overtaken));
        if step.input.lane_change_target.is_some() {
            action.indicator = step.indicator();
        }
        if has_passed(step, overtaken) {
            self.phase = Phase::Passed(CompletedPassing { time: step.input.time, overtaken });
            self.observe_side(step.side.opposite());
            action.note = Some(DriverNote::Passed);
        }
        action
    }

    /// Selects the side whose adjacent lane the driver observes from now on.
    pub(super) fn observe_side(&mut self, side: Side) {
        if let Some(perception) = &mut self.perception {
            perception.observe_side(side);
        }
    }

    /// Drives freely, or follows `ahead` by the car-following model.
    pub(super) fn cruise(&mut self, step: &Step<'_>, ahead: Option<&PerceivedVehicle>) -> DriverAction {
        let lead = ahead.map(|vehicle| &vehicle.lead);
        let requested_mps2 = self.model.acceleration_mps2(step.speed_mps, step.desired_mps, lead);
        let requested_mps2 = brake_for_brake_light(requested_mps2, step.speed_mps, ahead);
        let nearest = step.scene.ahead.as_ref().zip(ahead).is_some_and(|(nearest, ahead)| nearest.actor == ahead.actor);
        let beyond = step.scene.beyond.as_ref().filter(|_| nearest);
        let beyond_mps2 = beyond
            .map(|beyond| self.beyond_model.acceleration_mps2(step.speed_mps, step.desired_mps, Some(&beyond.lead)));
        let acceleration_mps2 = self.settings.perception.respond_mps2(requested_mps2, beyond_mps2);
        DriverAction { acceleration_mps2, ..DriverAction::default() }
    }

    /// Returns the acceleration behind the lead vehicle in the target lane (m/s²).
    fn follow_in_target(&mut self, step: &Step<'_>, change: &Change) -> f64 {
        let vehicle = if step.scene.lane == change.target {
            step.ahead_except(change.overtaken)
        } else {
            step.scene.adjacent(step.side).and_then(|lane| lane.lead.as_ref())
        };
        self.model.acceleration_mps2(step.speed_mps, step.desired_mps, vehicle.map(|vehicle| &vehicle.lead))
    }

    /// Returns true if the driver turns back: if the change asks for more braking than it
    /// tolerates, and the gap to the vehicle that it overtakes still allows it. A gap in the
    /// passing lane that is shorter than the preferred headway is no reason, nor is a gain of speed
    /// that turns out small.
    fn must_abort(&self, step: &Step<'_>, overtaken: Option<&PerceivedVehicle>) -> bool {
        let Some((ahead, lane)) = overtaken.zip(step.scene.adjacent(step.side)) else { return false };
        let acceptance = self.gap_acceptance(step, ahead.lead.speed_mps, Tolerance::TO_CONTINUE);
        let standstill_gap_m = self.settings.follow.safe_gap_m(0.0);
        let back = Course { min_gap_m: standstill_gap_m, ..self.course(step, ahead, 0.0) };
        let can_return = BRAKING_MARGIN * back.stay_behind_mps2() <= self.settings.follow.hardest_braking_mps2();
        can_return && !GapAcceptance { safe_gap_m: standstill_gap_m, ..acceptance }.is_free(lane)
    }

    /// Returns the criterion by which the driver accepts an adjacent lane.
    pub(super) fn gap_acceptance(&self, step: &Step<'_>, overtaken_mps: f64, tolerance: Tolerance) -> GapAcceptance {
        GapAcceptance {
            speed_mps: step.speed_mps,
            overtaken_mps,
            safe_gap_m: self.settings.follow.safe_gap_m(step.speed_mps),
            tolerance,
        }
    }

    /// Returns the present course relative to the vehicle `ahead`.
    fn course(&self, step: &Step<'_>, ahead: &PerceivedVehicle, distance_to_clear_m: f64) -> Course {
        let min_gap_m = self.settings.follow.safe_gap_m(ahead.lead.speed_mps);
        Course { speed_mps: step.speed_mps, lead: ahead.lead, distance_to_clear_m, min_gap_m }
    }

    /// Returns `requested_mps2`, lowered to the braking that the course requires (with a margin) if
    /// it exceeds that.
    fn limited_by_course_mps2(&self, requested_mps2: f64, course: &Course) -> f64 {
        let required_mps2 = course.required_braking_mps2();
        if required_mps2 > TOLERATED_BRAKING_MPS2 {
            let hardest_mps2 = self.settings.follow.hardest_braking_mps2();
            requested_mps2.min(-(BRAKING_MARGIN * required_mps2).min(hardest_mps2))
        } else {
            requested_mps2
        }
    }
}

/// Replaces `change` by one with evasive steering and returns its command, or `None` if it is not
/// sharper than planned.
fn evade(step: &Step<'_>, change: &mut Change, ahead: &PerceivedVehicle, settings: &Overtaker) -> Option<LaneChange> {
    let duration_s =
        (MINIMUM_JERK_PEAK * step.lateral_distance_m(change.target) / settings.evasive_lateral_mps2).sqrt();
    // Written so that a lateral acceleration of zero, for which the duration is infinite, means no
    // sharper steering.
    if !(duration_s < settings.duration_s) {
        return None;
    }
    let sharper = Change { evasive: true, ..step.plan_change(change.origin, change.target, Some(ahead), duration_s) };
    let s_m = step.input.own.s_m;
    if sharper.distance_to_clear_m(s_m) >= change.distance_to_clear_m(s_m) {
        return None;
    }
    *change = sharper;
    Some(LaneChange { target: change.target, duration_s })
}

/// Returns true once the overtaken vehicle is entirely behind in the adjacent lane.
fn has_passed(step: &Step<'_>, overtaken: Option<usize>) -> bool {
    let near = step.input.neighbours;
    let adjacent = if step.side == Side::Left { near.right.as_ref() } else { near.left.as_ref() };
    let follower = adjacent.and_then(|lane| lane.follower.as_ref());
    overtaken.is_some() && follower.map(|follower| follower.actor) == overtaken
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{ActorId, Check, PHYSICS_STEP, Parameters, stream};

    use super::*;
    use crate::driver::testing::{car_ahead, overtaker_config, with_input};
    use crate::driver::{LaneNeighbours, Lead, Neighbour, Neighbours};

    /// Returns the actions of a driver at 30 m/s in its first seconds, 14 m behind a vehicle at
    /// `lead_mps` and with a free passing lane. The vehicle shows its brake light, though it keeps
    /// its speed, once the driver has pulled out.
    fn actions(lead_mps: f64) -> Vec<DriverAction> {
        let mut driver = overtaker_config(0.5, 0.05).check(&Parameters::default()).unwrap().driver();
        let mut rng = stream(0, 0, &ActorId::new("rear").unwrap(), "driver");
        let mut pulled_out = false;
        let mut time = Time::ZERO;
        let mut actions = Vec::new();
        while time < Time::from_s(2.5) {
            let gap_m = 14.0 - (30.0 - lead_mps) * time.s();
            let lead = Lead { gap_m, speed_mps: lead_mps, acceleration_mps2: 0.0 };
            let own = LaneNeighbours { lead: Some(car_ahead(lead, pulled_out)), ..LaneNeighbours::default() };
            let left = Some(LaneNeighbours::default());
            let neighbours = Neighbours { own, left, ..Neighbours::default() };
            let action = with_input(time, &neighbours, |input| driver.step(input, &mut rng).unwrap());
            pulled_out |= action.lane_change.is_some();
            actions.push(action);
            time += PHYSICS_STEP;
        }
        actions
    }

    #[test]
    fn a_driver_does_not_turn_back_because_the_gap_in_the_passing_lane_falls_below_its_headway() {
        // The safe gap is 1.5 m + 0.8 s · 30 m/s = 25.5 m. The driver pulls out with 26 m, which
        // shrink to 23 m.
        let mut driver = overtaker_config(0.5, 0.8).check(&Parameters::default()).unwrap().driver();
        let mut rng = stream(0, 0, &ActorId::new("rear").unwrap(), "driver");
        let mut notes = Vec::new();
        for step in 0..300 {
            let time = Time::from_ms(10 * step);
            let slow = Lead { gap_m: 30.0 - 5.0 * time.s(), speed_mps: 25.0, acceleration_mps2: 0.0 };
            let passing = Lead { gap_m: 26.0 - time.s(), speed_mps: 29.0, acceleration_mps2: 0.0 };
            let ahead_at = |lead| LaneNeighbours { lead: Some(lead), ..LaneNeighbours::default() };
            let left = Neighbour { actor: 2, lateral_offset_m: 3.75, ..car_ahead(passing, false) };
            let neighbours = Neighbours {
                own: ahead_at(car_ahead(slow, false)),
                left: Some(ahead_at(left)),
                ..Neighbours::default()
            };
            notes.extend(with_input(time, &neighbours, |input| driver.step(input, &mut rng).unwrap()).note);
        }
        assert!(notes.contains(&DriverNote::CutOutStarted) && !notes.contains(&DriverNote::CutOutAborted), "{notes:?}");
    }

    #[test]
    fn a_driver_does_not_pull_out_for_a_gain_of_millimetres_per_second() {
        let pulls_out = |lead_mps| actions(lead_mps).iter().any(|action| action.lane_change.is_some());
        assert!(!pulls_out(29.995) && !pulls_out(29.1));
        assert!(pulls_out(28.9));
    }

    #[test]
    fn a_driver_who_is_overtaking_does_not_coast_for_a_brake_light() {
        let actions = actions(28.9);
        assert!(actions.iter().any(|action| action.lane_change.is_some()));
        // The gap closes at 1.1 m/s, and the lane change is done before it is used up.
        let strongest_mps2 = actions.iter().map(|action| action.acceleration_mps2).fold(0.0, f64::min);
        assert!(strongest_mps2 > -0.7, "{strongest_mps2}");
    }
}
