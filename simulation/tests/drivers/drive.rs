//! Runs a scenario in the closed loop and records the states of all vehicles.

use std::path::Path;

use closecall_controllers::DriverNote;
use closecall_scenarios::outcome::Outcome;
use closecall_scenarios::{Scenario, ScenarioFile};
use closecall_sensors::SensorMode;
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::{Arm, Observer, RunEvent, RunKey, StepView, simulate};
use closecall_traffic::{Lane, PHYSICS_STEP, Parameters, Road, Time, Vehicle, VehicleClass, VehicleState, maths};

/// Time constant with which the acceleration of a car follows the command in the simulation's plant (s).
const CAR_LAG_S: f64 = 0.15;

/// The states of all vehicles at one physics step, in the order of the scenario's actors.
pub(crate) struct Instant {
    pub(crate) time: Time,
    pub(crate) vehicles: Vec<VehicleState>,
}

/// Records the states of all vehicles, and what the drivers report.
#[derive(Default)]
struct Recorder {
    instants: Vec<Instant>,
    notes: Vec<(Time, usize, DriverNote)>,
}

impl Observer for Recorder {
    fn step(&mut self, _: &StepView<'_>) {}

    fn event(&mut self, time: Time, what: &RunEvent) {
        if let RunEvent::DriverNote { actor, note } = what {
            self.notes.push((time, *actor, *note));
        }
    }

    fn moved(&mut self, time: Time, vehicles: &mut dyn Iterator<Item = VehicleState>) {
        self.instants.push(Instant { time, vehicles: vehicles.collect() });
    }
}

/// A recorded run of cars.
pub(crate) struct Drive {
    pub(crate) outcome: Outcome,
    pub(crate) road: Road,
    pub(crate) instants: Vec<Instant>,
    notes: Vec<(Time, usize, DriverNote)>,
}

/// Returns the arm of a controller, with true tracks.
pub(crate) fn arm(controller: BuiltIn) -> Arm {
    Arm { controller: controller.factory(), sensors: Some(SensorMode::GroundTruth) }
}

/// Returns the scenario of a TOML text without sampled parameters.
pub(crate) fn scenario(text: &str) -> Scenario {
    let file = ScenarioFile::parse(Path::new("drivers.toml"), text, &[]).unwrap();
    file.concrete(&Parameters::default()).unwrap()
}

impl Drive {
    /// Runs `actors` on a straight road of three lanes. The ego stays far behind them in the right lane.
    pub(crate) fn new(actors: &str, duration_s: f64) -> Self {
        let text = format!(
            r#"
schema-version = 1
name = "drivers"
duration-s = {duration_s:?}
road = {{ lanes = 3, speed-limit-mps = 36.1 }}
{actors}
[[actor]]
id = "ego"
vehicle = {{ class = "car" }}
start = {{ absolute = {{ lane = 3, s-m = -900.0, speed-mps = 10.0 }} }}
driver = {{ ego-stack = {{ acc = {{ time-gap-s = 1.0, set-speed-mps = 10.0 }} }} }}
"#
        );
        let scenario = scenario(&text);
        let mut recorder = Recorder::default();
        let key = RunKey { seed: 0, sample: 0 };
        let outcome = simulate(&scenario, key, &arm(BuiltIn::Acc), &mut recorder).unwrap();
        Self { outcome, road: scenario.road.clone(), instants: recorder.instants, notes: recorder.notes }
    }

    /// Returns the time at which an actor's driver first reports `wanted` (s).
    pub(crate) fn noted_s(&self, actor: usize, wanted: DriverNote) -> Option<f64> {
        let note = self.notes.iter().find(|(_, noted_by, note)| *noted_by == actor && *note == wanted);
        note.map(|(time, ..)| time.s())
    }

    /// Returns the time from `from_s` on at which the state of an actor first satisfies `condition` (s).
    pub(crate) fn first_s(&self, actor: usize, from_s: f64, condition: impl Fn(&VehicleState) -> bool) -> Option<f64> {
        let mut later = self.instants.iter().filter(|instant| instant.time.s() >= from_s);
        later.find(|instant| condition(&instant.vehicles[actor])).map(|instant| instant.time.s())
    }

    /// Returns the state of an actor at the first physics step at `time_s` or later.
    pub(crate) fn at(&self, actor: usize, time_s: f64) -> &VehicleState {
        let instant = self.instants.iter().find(|instant| instant.time.s() >= time_s).unwrap();
        &instant.vehicles[actor]
    }

    /// Returns the lane of an actor at `time_s`.
    pub(crate) fn lane(&self, actor: usize, time_s: f64) -> Lane {
        self.road.lane_of(self.at(actor, time_s))
    }

    /// Returns the times (s) and the accelerations (m/s²) that an actor's driver commands. They are the ones with which
    /// the lag of the plant gives the recorded accelerations. This holds while the jerk limit of the plant, 40 m/s³,
    /// does not act.
    pub(crate) fn commands(&self, actor: usize) -> impl Iterator<Item = (f64, f64)> {
        let lag_share = 1.0 - maths::exp(-PHYSICS_STEP.s() / CAR_LAG_S);
        self.instants.windows(2).map(move |pair| {
            let [before_mps2, after_mps2] = [0, 1].map(|index: usize| pair[index].vehicles[actor].acceleration_mps2);
            (pair[0].time.s(), before_mps2 + (after_mps2 - before_mps2) / lag_share)
        })
    }
}

/// Returns the gap between two cars, bumper to bumper (m).
pub(crate) fn gap_m(ahead: &VehicleState, behind: &VehicleState) -> f64 {
    ahead.s_m - behind.s_m - Vehicle::typical(VehicleClass::Car).dimensions.length_m
}
