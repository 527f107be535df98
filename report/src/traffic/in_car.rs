//! What one simulated vehicle would record of itself: its motion at 100 Hz, and on every fourth step what its bus
//! carries, with the true lane changes beside it.
//!
//! The log has no noise but the rounding of what is written: studies of robustness add their own, with a seed.

use closecall_scenarios::recordings::{BusFrame, InCarFrame, InCarLog, MarkingDistances, TrueLaneChange};
use closecall_traffic::{Dimensions, Lane, Road, Side, Time, VehicleClass, VehicleState};

use closecall_simulation::scenario::Scenario;
use closecall_simulation::{CONTROL_STEP, Happening, Observer, StepView};

/// Pause between two runs, a gap in the log.
const PAUSE: Time = Time::from_ms(10_000);

/// A vehicle that moves sideways faster than this changes lanes, or tries to [m/s].
const SIDEWAYS_MPS: f64 = 0.01;

/// Writes the log of one vehicle over several runs, one after the other.
#[derive(Debug)]
pub struct InCarRecorder {
    actor: String,
    frames: Vec<InCarFrame>,
    changes: Vec<TrueLaneChange>,
    run: Run,
    class: VehicleClass,
    dimensions: Dimensions,
}

/// The current run.
#[derive(Debug)]
struct Run {
    actor: usize,
    road: Road,
    start: Time,
    /// Nothing is recorded any more once the vehicle was hit: what follows is no driving.
    is_over: bool,
    manoeuvre: Option<Manoeuvre>,
    before: Option<(Lane, Time)>,
}

/// A movement to one side that has begun.
#[derive(Clone, Copy, Debug)]
struct Manoeuvre {
    side: Side,
    start: Time,
    from_the_beginning: bool,
    crossings: [Option<Crossing>; MOST_CROSSINGS],
}

/// Nobody crosses more markings than this in one go.
const MOST_CROSSINGS: usize = 4;

#[derive(Clone, Copy, Debug)]
struct Crossing {
    from: Lane,
    to: Lane,
    time: Time,
    speed_mps: f64,
}

impl InCarRecorder {
    /// A recorder in the vehicle of `actor`, for runs of scenarios that have it.
    pub fn new(actor: &str) -> Self {
        let class = VehicleClass::Car;
        let run =
            Run { actor: 0, road: Road::straight(1), start: Time::ZERO, is_over: true, manoeuvre: None, before: None };
        let (frames, changes, dimensions) = (Vec::new(), Vec::new(), class.typical_dimensions());
        Self { actor: actor.to_owned(), frames, changes, run, class, dimensions }
    }

    /// Begins the next run. Nothing of it is recorded where the scenario has no such actor.
    pub fn begin(&mut self, scenario: &Scenario) {
        self.end_manoeuvre(false);
        self.run.is_over = true;
        let Some(actor) = scenario.actors.iter().position(|actor| actor.id.as_str() == self.actor) else { return };
        let start = self.frames.last().map_or(Time::ZERO, |frame| frame.time + PAUSE);
        // Every run starts on the bus's clock, so that the log has one clock.
        let start = start + Time::from_ns((CONTROL_STEP.ns() - start.ns() % CONTROL_STEP.ns()) % CONTROL_STEP.ns());
        let vehicle = &scenario.actors[actor].vehicle;
        (self.class, self.dimensions) = (vehicle.class, vehicle.dimensions);
        self.run = Run { actor, road: scenario.road, start, is_over: false, manoeuvre: None, before: None };
    }

    /// The log, and what is true about it.
    pub fn finish(mut self) -> (InCarLog, Vec<TrueLaneChange>) {
        self.end_manoeuvre(false);
        (InCarLog { class: self.class, dimensions: self.dimensions, frames: self.frames }, self.changes)
    }

    fn record(&mut self, time: Time, state: &VehicleState) {
        let Run { road, start, .. } = self.run;
        let lane = road.lane_at(state.d_m);
        let on_bus = time.is_multiple_of(CONTROL_STEP);
        let left_edge_m = road.lane_centre_m(lane) + 0.5 * road.lane_width_m();
        let markings = MarkingDistances {
            left_m: Some(left_edge_m - state.d_m),
            right_m: Some(state.d_m - left_edge_m + road.lane_width_m()),
        };
        self.frames.push(InCarFrame {
            time: start + time,
            s_m: state.s_m,
            d_m: state.d_m,
            heading_rad: state.heading_rad,
            acceleration_mps2: state.acceleration_mps2,
            yaw_rate_radps: state.yaw_rate_radps,
            bus: on_bus.then_some(BusFrame { speed_mps: state.speed_mps, markings }),
        });
        self.follow(start + time, lane, state);
    }

    /// Keeps track of the true lane changes.
    fn follow(&mut self, time: Time, lane: Lane, state: &VehicleState) {
        let sideways_mps = state.speed_mps * state.heading_rad.sin();
        let side = if sideways_mps > 0.0 { Side::Left } else { Side::Right };
        let is_sideways = sideways_mps.abs() > SIDEWAYS_MPS;
        if self.run.manoeuvre.is_some_and(|manoeuvre| !is_sideways || manoeuvre.side != side) {
            self.end_manoeuvre(true);
        }
        let before = self.run.before.replace((lane, time));
        if is_sideways && self.run.manoeuvre.is_none() {
            let from_the_beginning = before.is_some();
            let crossings = [None; MOST_CROSSINGS];
            self.run.manoeuvre = Some(Manoeuvre { side, start: time, from_the_beginning, crossings });
        }
        let Some((from, _)) = before.filter(|(from, _)| *from != lane) else { return };
        if let Some(manoeuvre) = &mut self.run.manoeuvre
            && let Some(free) = manoeuvre.crossings.iter_mut().find(|crossing| crossing.is_none())
        {
            *free = Some(Crossing { from, to: lane, time, speed_mps: state.speed_mps });
        }
    }

    fn end_manoeuvre(&mut self, to_the_end: bool) {
        let Some(Manoeuvre { side, start, from_the_beginning, crossings }) = self.run.manoeuvre.take() else { return };
        let end = self.run.before.map_or(start, |(_, time)| time);
        for Crossing { from, to, time, speed_mps } in crossings.into_iter().flatten() {
            self.changes.push(TrueLaneChange {
                direction: side,
                from_lane: from.0,
                to_lane: to.0,
                start_s: start.s(),
                crossing_s: time.s(),
                end_s: end.s(),
                speed_mps,
                complete: from_the_beginning && to_the_end,
            });
        }
    }
}

impl Observer for InCarRecorder {
    fn step(&mut self, _: &StepView<'_>) {}

    fn happening(&mut self, _: Time, what: &Happening) {
        if let Happening::Collision(collision) = what {
            self.run.is_over |= collision.between.iter().any(|actor| actor.as_str() == self.actor);
        }
    }

    fn moved(&mut self, time: Time, vehicles: &mut dyn Iterator<Item = VehicleState>) {
        if !self.run.is_over
            && let Some(state) = vehicles.nth(self.run.actor)
        {
            self.record(time, &state);
        }
    }
}
