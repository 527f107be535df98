//! The overtaking driver in the loop.

use closecall_traffic::{Indicator, Lane, Side, Stream, Time};

use super::acceptance::{Intent, Tolerance};
use super::conflict::Course;
use super::returning::{indicator, opposite};
use super::{Overtaker, path};
use crate::driver::perception::{Perceived, Perception, View};
use crate::driver::wiedemann99::{Emergency, brake_for_light, lift_off_for_light};
use crate::driver::{
    Driver, DriverAction, DriverError, DriverInput, DriverNote, HARDEST_BRAKING_MPS2, LaneChange, Wiedemann99Model,
    check_finite, finite,
};

/// Braking below which a driver who is about to be clear does not bother [m/s²].
const TOLERATED_BRAKING_MPS2: f64 = 0.1;

/// By how much a driver brakes harder than it thinks necessary [1].
const BRAKING_MARGIN: f64 = 1.2;

/// Room sideways between two boxes that counts as clear [m].
const CLEAR_SIDEWAYS_M: f64 = 0.1;

/// How long before pulling out a driver signals [s]: a choice, of the order of the three flashes of an indicator.
const SIGNALS_BEFORE_S: f64 = 2.0;

/// Duration of a change back into the own lane [s].
const CHANGE_BACK_S: f64 = 3.0;

/// Braking from which on a driver steers more sharply than it had meant to, to get clear sooner [m/s²].
const SHARPER_STEERING_FROM_MPS2: f64 = 3.0;

/// Largest second derivative of the quintic: 10/√3, so that a path of width w and duration T peaks at 5.77·w/T².
const QUINTIC_PEAK: f64 = 5.773_502_691_896_258;

/// What the driver is about.
#[derive(Clone, Copy, Debug)]
pub(super) enum Phase {
    /// Comes up behind, or follows.
    Approaching,
    /// Changes to the passing lane.
    Changing(Change),
    /// Changes back.
    Aborting { home: Lane },
    /// Drives past in the passing lane.
    Overtaking { overtaken: Option<usize> },
    /// Has passed.
    Passed(Past),
    /// Changes back to the lane that it came from.
    Returning { home: Lane, past: Past },
}

/// What is behind.
#[derive(Clone, Copy, Debug)]
pub(super) struct Past {
    /// Since when.
    pub(super) since: Time,
    /// Which vehicle.
    pub(super) overtaken: Option<usize>,
}

/// A lane change under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Change {
    home: Lane,
    target: Lane,
    overtaken: Option<usize>,
    start_s_m: f64,
    way_m: f64,
    /// Where the path begins [m], and how far it leads sideways [m].
    start_d_m: f64,
    sideways_m: f64,
    /// Share of the way at which the driver is clear of the vehicle it overtakes.
    clear_at: f64,
    sharpened: bool,
}

impl Change {
    fn way_to_clear_m(&self, s_m: f64) -> f64 {
        self.clear_at * self.way_m - (s_m - self.start_s_m)
    }
}

/// A human who overtakes.
#[derive(Clone, Debug)]
pub(crate) struct OvertakerDriver {
    pub(super) settings: Overtaker,
    model: Wiedemann99Model,
    desired_mps: Option<f64>,
    perception: Option<Perception>,
    pub(super) phase: Phase,
    emergency: Emergency,
}

impl OvertakerDriver {
    pub(super) fn new(settings: Overtaker) -> Self {
        Self {
            settings,
            model: Wiedemann99Model::new(&settings.follow),
            desired_mps: settings.follow.desired_speed_mps,
            perception: None,
            phase: Phase::Approaching,
            emergency: Emergency::default(),
        }
    }
}

impl Driver for OvertakerDriver {
    fn step(&mut self, input: &DriverInput<'_>, rng: &mut Stream) -> Result<DriverAction, DriverError> {
        check_finite(input)?;
        let speed_mps = input.own.speed_mps;
        let desired_mps = input.desired_now_mps(*self.desired_mps.get_or_insert(speed_mps));
        let (reaction, side) = (self.settings.reaction, input.road.overtaking_side());
        let new = || Perception::new(reaction.draw(rng), Some(side)).with_lapses(self.settings.lapse);
        let view = self.perception.get_or_insert_with(new).look(input, rng);
        let moment = Moment { input, view: &view, side, speed_mps, desired_mps };
        let mut action = match self.phase {
            Phase::Approaching => self.approach(&moment),
            Phase::Changing(change) => self.change(&moment, change),
            Phase::Aborting { home } => self.abort(&moment, home),
            Phase::Overtaking { overtaken } => self.overtake(&moment, overtaken),
            Phase::Passed(past) => self.cruise_past(&moment, past),
            Phase::Returning { home, past } => self.change_back(&moment, home, past),
        };
        action.acceleration_mps2 =
            finite(action.acceleration_mps2, "acceleration of an overtaking driver", input.time)?;
        let emergency = self.emergency.note(action.acceleration_mps2);
        action.note = action.note.or(emergency);
        Ok(action)
    }
}

/// One step's input, and what the driver makes of it.
pub(super) struct Moment<'a> {
    pub(super) input: &'a DriverInput<'a>,
    pub(super) view: &'a View,
    /// The side on which one overtakes.
    pub(super) side: Side,
    pub(super) speed_mps: f64,
    desired_mps: f64,
}

impl Moment<'_> {
    fn indicator(&self) -> Indicator {
        indicator(self.side)
    }

    /// The vehicle ahead, unless it is the overtaken one: what was seen ahead a reaction time ago may be passed by now.
    pub(super) fn ahead_but(&self, overtaken: Option<usize>) -> Option<&Perceived> {
        self.view.ahead.as_ref().filter(|seen| Some(seen.actor) != overtaken)
    }

    /// Where the path that the driver means to take is now [m].
    fn path_d_m(&self) -> f64 {
        self.input.own.d_m - self.input.lateral_deviation_m
    }

    /// Way across the road from there to the middle of `target` [m].
    fn sideways_m(&self, target: Lane) -> f64 {
        (self.input.road.lane_centre_m(target) - self.path_d_m()).abs()
    }

    /// A lane change from here to `target`, to be clear of `ahead`.
    fn change(&self, home: Lane, target: Lane, ahead: Option<&Perceived>, duration_s: f64) -> Change {
        let start_d_m = self.path_d_m();
        let mut change = Change {
            home,
            target,
            overtaken: ahead.map(|ahead| ahead.actor),
            start_s_m: self.input.own.s_m,
            way_m: self.speed_mps * duration_s,
            start_d_m,
            sideways_m: self.sideways_m(target),
            clear_at: 0.0,
            sharpened: false,
        };
        change.clear_at = ahead.map_or(0.0, |ahead| self.clear_at(&change, ahead));
        change
    }

    /// Share of the way at which the driver is clear of `ahead`.
    fn clear_at(&self, change: &Change, ahead: &Perceived) -> f64 {
        let apart_m = 0.5 * (self.input.vehicle.dimensions.width_m + ahead.width_m) + CLEAR_SIDEWAYS_M;
        path::along((apart_m + self.beyond_start_m(change, ahead.d_m)) / change.sideways_m)
    }

    /// Share of the way at which the driver's centre is over the marking between the two lanes.
    fn crossing_at(&self, change: &Change) -> f64 {
        let road = self.input.road;
        let marking_m = 0.5 * (road.lane_centre_m(change.home) + road.lane_centre_m(change.target));
        path::along(self.beyond_start_m(change, marking_m) / change.sideways_m)
    }

    /// How far `d_m` is from the start of a change, towards its target, for a driver who stays as far beside its path as it
    /// is now [m].
    fn beyond_start_m(&self, change: &Change, d_m: f64) -> f64 {
        let to_the_left_m = d_m - change.start_d_m - self.input.lateral_deviation_m;
        match self.side {
            Side::Left => to_the_left_m,
            Side::Right => -to_the_left_m,
        }
    }
}

impl OvertakerDriver {
    fn approach(&mut self, moment: &Moment<'_>) -> DriverAction {
        let home = moment.input.road.lane_at(moment.input.own.d_m);
        let target = moment.input.road.beside(home, moment.side);
        let (Some(ahead), Some(target), Some(lane)) =
            (moment.view.ahead.as_ref(), target, moment.view.beside(moment.side))
        else {
            return self.cruise(moment, moment.view.ahead.as_ref());
        };
        let intent = self.intent(moment, ahead.lead.speed_mps, Tolerance::TO_START);
        let wants_to = moment.desired_mps > ahead.lead.speed_mps;
        if !wants_to || !intent.accepts(lane) {
            return self.cruise(moment, Some(ahead));
        }
        let change = moment.change(home, target, Some(ahead), self.settings.duration_s);
        let course = self.course(moment, ahead, change.clear_at * change.way_m);
        let keep_mps2 = self.model.acceleration_mps2(moment.speed_mps, moment.desired_mps, None);
        let keep_mps2 = lift_off_for_light(keep_mps2, moment.speed_mps, Some(ahead));
        let crossing_m = moment.crossing_at(&change) * change.way_m;
        let slowing_mps2 = (-keep_mps2).max(0.0);
        let pull_out = course.thw_after_s(crossing_m, slowing_mps2) <= self.settings.cut_out_thw_s
            || course.gap_after_m(course.way_to_clear_m) <= course.least_gap_m;
        if !pull_out {
            let soon_m = crossing_m + SIGNALS_BEFORE_S * moment.speed_mps;
            let signals = course.thw_after_s(soon_m, slowing_mps2) <= self.settings.cut_out_thw_s;
            let indicator = if signals { moment.indicator() } else { Indicator::Off };
            return DriverAction { acceleration_mps2: keep_mps2, indicator, ..DriverAction::default() };
        }
        self.phase = Phase::Changing(change);
        DriverAction {
            acceleration_mps2: braked(keep_mps2, &course),
            lane_change: Some(LaneChange { target, duration_s: self.settings.duration_s }),
            indicator: moment.indicator(),
            note: Some(DriverNote::CutOutStarted),
        }
    }

    fn change(&mut self, moment: &Moment<'_>, mut change: Change) -> DriverAction {
        let own = moment.input.own;
        let over_the_marking = moment.input.road.lane_at(own.d_m) == change.target;
        let overtaken = self.overtaken(moment, change.overtaken);
        if let Some(ahead) = overtaken {
            change.clear_at = moment.clear_at(&change, ahead);
        }
        let way_to_clear_m = change.way_to_clear_m(own.s_m);
        if over_the_marking && way_to_clear_m <= 0.0 {
            self.phase = Phase::Overtaking { overtaken: change.overtaken };
            return self.overtake(moment, change.overtaken);
        }
        if !over_the_marking && self.must_abort(moment, overtaken) {
            self.phase = Phase::Aborting { home: change.home };
            let back = LaneChange { target: change.home, duration_s: CHANGE_BACK_S };
            let following = self.cruise(moment, moment.view.ahead.as_ref());
            return DriverAction { lane_change: Some(back), note: Some(DriverNote::CutOutAborted), ..following };
        }
        let beside = self.follow_in_target(moment, change.target, overtaken);
        let wanted = lift_off_for_light(beside, moment.speed_mps, overtaken.filter(|_| way_to_clear_m > 0.0));
        let mut action =
            DriverAction { acceleration_mps2: wanted, indicator: moment.indicator(), ..DriverAction::default() };
        if let Some(ahead) = overtaken {
            let course = self.course(moment, ahead, way_to_clear_m);
            if !change.sharpened && course.needed_braking_mps2() > SHARPER_STEERING_FROM_MPS2 {
                action.lane_change = sharpen(moment, &mut change, ahead, &self.settings);
            }
            action.acceleration_mps2 = braked(wanted, &self.course(moment, ahead, change.way_to_clear_m(own.s_m)));
        }
        self.phase = Phase::Changing(change);
        action
    }

    fn abort(&mut self, moment: &Moment<'_>, home: Lane) -> DriverAction {
        if moment.input.changing_to != Some(home) {
            self.phase = Phase::Approaching;
        }
        self.cruise(moment, moment.view.ahead.as_ref())
    }

    fn overtake(&mut self, moment: &Moment<'_>, overtaken: Option<usize>) -> DriverAction {
        let mut action = self.cruise(moment, moment.ahead_but(overtaken));
        if moment.input.changing_to.is_some() {
            action.indicator = moment.indicator();
        }
        if has_passed(moment, overtaken) {
            self.phase = Phase::Passed(Past { since: moment.input.time, overtaken });
            self.look_to(opposite(moment.side));
            action.note = Some(DriverNote::Passed);
        }
        action
    }

    /// Looks to a side from now on.
    pub(super) fn look_to(&mut self, side: Side) {
        if let Some(senses) = &mut self.perception {
            senses.look_to(side);
        }
    }

    /// Drives on, or follows `ahead` by Wiedemann 99.
    pub(super) fn cruise(&mut self, moment: &Moment<'_>, ahead: Option<&Perceived>) -> DriverAction {
        let lead = ahead.map(|seen| &seen.lead);
        let wanted = self.model.acceleration_mps2(moment.speed_mps, moment.desired_mps, lead);
        DriverAction { acceleration_mps2: brake_for_light(wanted, moment.speed_mps, ahead), ..DriverAction::default() }
    }

    /// The acceleration that suits the vehicle ahead in the lane that the driver is changing to.
    fn follow_in_target(&mut self, moment: &Moment<'_>, target: Lane, overtaken: Option<&Perceived>) -> f64 {
        let overtaken = overtaken.map(|seen| seen.actor);
        let seen = if moment.view.lane == target {
            moment.view.ahead.as_ref().filter(|seen| Some(seen.actor) != overtaken)
        } else {
            moment.view.beside(moment.side).and_then(|lane| lane.lead.as_ref())
        };
        self.model.acceleration_mps2(moment.speed_mps, moment.desired_mps, seen.map(|seen| &seen.lead))
    }

    fn must_abort(&self, moment: &Moment<'_>, overtaken: Option<&Perceived>) -> bool {
        let Some((ahead, lane)) = overtaken.zip(moment.view.beside(moment.side)) else { return false };
        !self.intent(moment, ahead.lead.speed_mps, Tolerance::TO_GO_ON).accepts(lane)
    }

    /// The vehicle that is being overtaken, while it is the nearest ahead.
    fn overtaken<'a>(&self, moment: &Moment<'a>, actor: Option<usize>) -> Option<&'a Perceived> {
        moment.view.ahead.as_ref().filter(|seen| Some(seen.actor) == actor)
    }

    pub(super) fn intent(&self, moment: &Moment<'_>, slow_mps: f64, tolerance: Tolerance) -> Intent {
        Intent {
            speed_mps: moment.speed_mps,
            slow_mps,
            safe_gap_m: self.settings.follow.safe_gap_m(moment.speed_mps),
            tolerance,
        }
    }

    fn course(&self, moment: &Moment<'_>, ahead: &Perceived, way_to_clear_m: f64) -> Course {
        let least_gap_m = self.settings.follow.safe_gap_m(ahead.lead.speed_mps);
        Course { speed_mps: moment.speed_mps, lead: ahead.lead, way_to_clear_m, least_gap_m }
    }
}

/// Steers as sharply as a human does in need, where that is sharper than planned.
fn sharpen(moment: &Moment<'_>, change: &mut Change, ahead: &Perceived, settings: &Overtaker) -> Option<LaneChange> {
    let duration_s = (QUINTIC_PEAK * moment.sideways_m(change.target) / settings.evasive_lateral_mps2).sqrt();
    // Written so that no lateral acceleration at all, for which the duration is infinite, means no sharper steering.
    if !(duration_s < settings.duration_s) {
        return None;
    }
    let sharper = Change { sharpened: true, ..moment.change(change.home, change.target, Some(ahead), duration_s) };
    let s_m = moment.input.own.s_m;
    if sharper.way_to_clear_m(s_m) >= change.way_to_clear_m(s_m) {
        return None;
    }
    *change = sharper;
    Some(LaneChange { target: change.target, duration_s })
}

/// `wanted`, or the braking that the course needs.
fn braked(wanted_mps2: f64, course: &Course) -> f64 {
    let needed = course.needed_braking_mps2();
    if needed > TOLERATED_BRAKING_MPS2 {
        wanted_mps2.min(-(BRAKING_MARGIN * needed).min(HARDEST_BRAKING_MPS2))
    } else {
        wanted_mps2
    }
}

/// True once the overtaken vehicle is wholly behind, in the lane beside.
fn has_passed(moment: &Moment<'_>, overtaken: Option<usize>) -> bool {
    let near = moment.input.neighbours;
    let beside = match moment.side {
        Side::Left => near.right.as_ref(),
        Side::Right => near.left.as_ref(),
    };
    let follower = beside.and_then(|lane| lane.follower.as_ref());
    overtaken.is_some() && follower.map(|follower| follower.actor) == overtaken
}
