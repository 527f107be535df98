//! The log that one simulated vehicle would record of itself, and the ground truth of its lane
//! changes.
//!
//! The log holds the vehicle's motion at 100 Hz and, on every fourth step, the signals of its bus.
//! It contains no noise except the rounding of the written numbers. Robustness studies add noise
//! from a seed.

use closecall_recorded::trajectory_data::{BusFrame, InCarFrame, InCarLog, MarkingDistances, TrueLaneChange};
use closecall_traffic::{Dimensions, Lane, Road, Side, Time, VehicleClass, VehicleState, maths};

use crate::{CONTROL_STEP, Observer, RunEvent, StepView};
use closecall_controllers::DriverConfig;
use closecall_scenarios::{ActorConfig, Scenario, ScenarioConfig};

/// Time between two runs, which leaves a gap in the log.
const PAUSE: Time = Time::from_ms(10_000);

/// Lateral speed above which a vehicle counts as changing lanes, or attempting to (m/s).
const MIN_LATERAL_SPEED_MPS: f64 = 0.01;

/// Returns the id of the actor whose log is recorded: `requested`, or else the first one with an
/// overtaking driver.
///
/// # Errors
/// The ids to choose from, if there is no such actor.
pub fn recorded_actor(scenario: &ScenarioConfig, requested: Option<&str>) -> Result<String, String> {
    let actors = &scenario.actors;
    let all = || actors.iter().map(|actor| actor.id.to_string()).collect::<Vec<_>>().join(", ");
    let overtakes = |actor: &&ActorConfig| matches!(actor.driver, DriverConfig::Overtaker(_));
    let actor = match requested {
        None => actors.iter().find(overtakes),
        Some(name) => actors.iter().find(|actor| actor.id.to_string() == name),
    };
    actor.map(|actor| actor.id.to_string()).ok_or_else(|| match requested {
        None => format!("no actor has an overtaking driver: name one of {}", all()),
        Some(name) => format!("there is no actor `{name}`: name one of {}", all()),
    })
}

/// Records the log of one vehicle over several runs, one after the other.
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
    /// Index of the recorded vehicle among the actors.
    actor: usize,
    road: Road,
    /// Start of the run on the clock of the log.
    start: Time,
    /// True while nothing is recorded: the scenario lacks the actor, or the vehicle has collided
    /// and has stopped driving.
    has_ended: bool,
    manoeuvre: Option<Manoeuvre>,
    /// Lane and time of the previous step.
    previous: Option<(Lane, Time)>,
}

/// A lateral movement to one side that has begun.
#[derive(Clone, Copy, Debug)]
struct Manoeuvre {
    side: Side,
    start: Time,
    /// True if the log contains the start of the movement.
    start_recorded: bool,
    /// The lane markings crossed so far.
    crossings: [Option<Crossing>; MAX_CROSSINGS],
}

/// The largest number of lane markings that one manoeuvre is assumed to cross.
const MAX_CROSSINGS: usize = 4;

/// The crossing of one lane marking.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    from: Lane,
    to: Lane,
    time: Time,
    speed_mps: f64,
}

impl InCarRecorder {
    /// Creates a recorder for the vehicle of the actor named `actor`.
    pub fn new(actor: &str) -> Self {
        let class = VehicleClass::Car;
        let run = Run {
            actor: 0,
            road: Road::straight(1),
            start: Time::ZERO,
            has_ended: true,
            manoeuvre: None,
            previous: None,
        };
        let (frames, changes, dimensions) = (Vec::new(), Vec::new(), class.typical_dimensions());
        Self { actor: actor.to_owned(), frames, changes, run, class, dimensions }
    }

    /// Begins the next run. Nothing of it is recorded if the scenario has no such actor.
    pub fn begin(&mut self, scenario: &Scenario) {
        self.end_manoeuvre(false);
        self.run.has_ended = true;
        let Some(actor) = scenario.actors.iter().position(|actor| actor.id.as_str() == self.actor) else { return };
        let start = self.frames.last().map_or(Time::ZERO, |frame| frame.time + PAUSE);
        // Every run starts at a multiple of the bus period, so that the bus signals of the whole
        // log share one clock.
        let start = start + Time::from_ns((CONTROL_STEP.ns() - start.ns() % CONTROL_STEP.ns()) % CONTROL_STEP.ns());
        let vehicle = &scenario.actors[actor].vehicle;
        (self.class, self.dimensions) = (vehicle.class, vehicle.dimensions);
        self.run = Run { actor, road: scenario.road.clone(), start, has_ended: false, manoeuvre: None, previous: None };
    }

    /// Returns the log and the true lane changes.
    pub fn finish(mut self) -> (InCarLog, Vec<TrueLaneChange>) {
        self.end_manoeuvre(false);
        (InCarLog { class: self.class, dimensions: self.dimensions, frames: self.frames }, self.changes)
    }

    /// Appends one row to the log.
    fn push_frame(&mut self, time: Time, state: &VehicleState) {
        let Run { road, start, .. } = &self.run;
        let lane = road.lane_of(state);
        let (lane_m, start) = (road.lane_width_m(lane, state.s_m), *start);
        let on_bus = time.is_multiple_of(CONTROL_STEP);
        let left_edge_m = road.lane_centre_m(lane, state.s_m) + 0.5 * lane_m;
        let markings =
            MarkingDistances { left_m: Some(left_edge_m - state.d_m), right_m: Some(state.d_m - left_edge_m + lane_m) };
        self.frames.push(InCarFrame {
            time: start + time,
            s_m: state.s_m,
            d_m: state.d_m,
            heading_rad: state.heading_rad,
            acceleration_mps2: state.acceleration_mps2,
            yaw_rate_radps: state.yaw_rate_radps,
            bus: on_bus.then_some(BusFrame { speed_mps: state.speed_mps, markings }),
        });
        self.update_manoeuvre(start + time, lane, state);
    }

    /// Updates the current manoeuvre and, when it ends, the true lane changes.
    fn update_manoeuvre(&mut self, time: Time, lane: Lane, state: &VehicleState) {
        let lateral_speed_mps = state.speed_mps * maths::sin(state.heading_rad);
        let side = if lateral_speed_mps > 0.0 { Side::Left } else { Side::Right };
        let moves_laterally = lateral_speed_mps.abs() > MIN_LATERAL_SPEED_MPS;
        if self.run.manoeuvre.is_some_and(|manoeuvre| !moves_laterally || manoeuvre.side != side) {
            self.end_manoeuvre(true);
        }
        let previous = self.run.previous.replace((lane, time));
        if moves_laterally && self.run.manoeuvre.is_none() {
            let start_recorded = previous.is_some();
            let crossings = [None; MAX_CROSSINGS];
            self.run.manoeuvre = Some(Manoeuvre { side, start: time, start_recorded, crossings });
        }
        let Some((from, _)) = previous.filter(|(from, _)| *from != lane) else { return };
        if let Some(manoeuvre) = &mut self.run.manoeuvre
            && let Some(free) = manoeuvre.crossings.iter_mut().find(|crossing| crossing.is_none())
        {
            *free = Some(Crossing { from, to: lane, time, speed_mps: state.speed_mps });
        }
    }

    /// Ends the current manoeuvre, if any, and appends its lane changes. `end_recorded` is true if
    /// the vehicle stopped moving to that side, false if the run ended first.
    fn end_manoeuvre(&mut self, end_recorded: bool) {
        let Some(Manoeuvre { side, start, start_recorded, crossings }) = self.run.manoeuvre.take() else { return };
        let end = self.run.previous.map_or(start, |(_, time)| time);
        for Crossing { from, to, time, speed_mps } in crossings.into_iter().flatten() {
            self.changes.push(TrueLaneChange {
                direction: side,
                from_lane: from.0,
                to_lane: to.0,
                start_s: start.s(),
                crossing_s: time.s(),
                end_s: end.s(),
                speed_mps,
                complete: start_recorded && end_recorded,
            });
        }
    }
}

impl Observer for InCarRecorder {
    fn step(&mut self, _: &StepView<'_>) {}

    fn event(&mut self, _: Time, event: &RunEvent) {
        if let RunEvent::Collision(collision) = event {
            self.run.has_ended |= collision.between.iter().any(|actor| actor.as_str() == self.actor);
        }
    }

    fn moved(&mut self, time: Time, vehicles: &mut dyn Iterator<Item = VehicleState>) {
        if !self.run.has_ended
            && let Some(state) = vehicles.nth(self.run.actor)
        {
            self.push_frame(time, &state);
        }
    }
}
