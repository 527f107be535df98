//! Counts allocations of memory: in steady state, a step of the loop allocates nothing.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

mod counting;

use std::path::Path;

use closecall_scenarios::sampling::Design;
use closecall_sensors::SensorMode;
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::scenario::ScenarioFile;
use closecall_simulation::{Arm, Observer, RunEvent, RunKey, StepView, simulate};
use closecall_traffic::{Check, Time, VehicleState};

use counting::allocations;

/// Time after which buffers have their final size (s). The drivers' memories reach back by the longest reaction time.
const STEADY_FROM_S: f64 = 3.0;
const SEED: u64 = 9;

/// Notes the number of allocations in each physics step.
#[derive(Default)]
struct StepCounter {
    steps: Vec<Step>,
    before: u64,
    has_event: bool,
}

/// The allocations between two physics steps.
struct Step {
    time_s: f64,
    allocations: u64,
    /// Whether something happened that is reported with a name: the report allocates.
    has_event: bool,
}

impl Observer for StepCounter {
    fn step(&mut self, _: &StepView<'_>) {}

    fn event(&mut self, _: Time, _: &RunEvent) {
        self.has_event = true;
    }

    fn moved(&mut self, time: Time, _: &mut dyn Iterator<Item = VehicleState>) {
        let now = allocations();
        // Growing the list is no allocation of the loop.
        self.steps.push(Step { time_s: time.s(), allocations: now - self.before, has_event: self.has_event });
        self.has_event = false;
        self.before = allocations();
    }
}

/// Runs a scenario of the library and returns its steps.
fn steps(scenario: &str, settings: &[&str], sensors: SensorMode, sample: u64) -> Vec<Step> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../scenarios/library/{scenario}.toml"));
    let settings: Vec<_> = settings.iter().map(|setting| setting.parse().unwrap()).collect();
    let file = ScenarioFile::load(&path, &settings).unwrap();
    let parameters = file.space().sample(Design::Random, SEED, sample, 10);
    let scenario = file.config().check(&parameters).unwrap();
    let arm = Arm { controller: BuiltIn::Mis.factory(), sensors: Some(sensors) };
    let mut counter = StepCounter { steps: Vec::with_capacity(10_000), ..StepCounter::default() };
    simulate(&scenario, RunKey { seed: SEED, sample }, &arm, &mut counter).unwrap();
    counter.steps
}

/// Returns the steps in steady state.
fn steady(steps: Vec<Step>) -> Vec<Step> {
    steps.into_iter().filter(|step| step.time_s >= STEADY_FROM_S).collect()
}

#[test]
fn a_step_with_true_tracks_or_object_level_sensors_allocates_nothing() {
    for sensors in [SensorMode::GroundTruth, SensorMode::Object] {
        for (scenario, sample) in [("low-thw-overtake", 2), ("left-lane-blocked", 0), ("overtake-without-brake", 1)] {
            let steps = steady(steps(scenario, &[], sensors, sample));
            assert!(steps.len() > 300, "{scenario}: {} steps", steps.len());
            let allocating: Vec<_> = steps
                .iter()
                .filter(|step| step.allocations > 0 && !step.has_event)
                .map(|step| (step.time_s, step.allocations))
                .collect();
            assert_eq!(allocating, [], "{scenario}, {sensors:?}: times (s) and numbers of allocations");
        }
    }
}

/// The full chain allocates in the libraries that cluster and classify, and in lists whose length depends on the number of
/// points. The bound is that of the present versions: more is a change to look at.
#[test]
fn a_control_step_of_the_full_chain_allocates_no_more_than_its_libraries_do() {
    let per_second = |settings: &[&str]| {
        let steps = steady(steps("low-thw-overtake", settings, SensorMode::Full, 2));
        let all: u64 = steps.iter().map(|step| step.allocations).sum();
        all as f64 / (steps.len() as f64 / 100.0)
    };
    let (lidar, full) = (per_second(&["sensors.rear-camera.pipeline=off"]), per_second(&[]));
    println!("allocations per simulated second: {lidar:.0} without the camera, {full:.0} with it");
}
