//! Counts allocations of memory: in steady state, the steps of the loop allocate nothing.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

mod counting;

use std::path::Path;

use closecall_scenarios::sampling::Design;
use closecall_sensors::SensorMode;
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::scenario::ScenarioFile;
use closecall_simulation::{Arm, Observer, RunEvent, RunKey, StepView, simulate};
use closecall_traffic::{Check, PHYSICS_STEP, Time, VehicleState};

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

/// Largest number of steps that allocate in a run in steady state: a list grows when more tracks than ever are in view.
const GROWING_STEPS: usize = 1;

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
fn steps_with_true_tracks_or_object_level_sensors_allocate_nothing() {
    for sensors in [SensorMode::GroundTruth, SensorMode::Object] {
        for (scenario, sample) in [("low-thw-overtake", 2), ("left-lane-blocked", 0), ("overtake-without-brake", 1)] {
            let steps = steady(steps(scenario, &[], sensors, sample));
            assert!(steps.len() > 300, "{scenario}: {} steps", steps.len());
            let allocating: Vec<_> = steps
                .iter()
                .filter(|step| step.allocations > 0 && !step.has_event)
                .map(|step| (step.time_s, step.allocations))
                .collect();
            assert!(
                allocating.len() <= GROWING_STEPS,
                "{scenario}, {sensors:?}: (time in s, allocations) {allocating:?}"
            );
        }
    }
}

/// Largest numbers of allocations per simulated second of the full chain, without the camera and with it: a tenth more than
/// counted. `docs/performance.md` names the places.
const FULL_CHAIN: [f64; 2] = [365.0, 1_150.0];

#[test]
fn the_full_chain_allocates_no_more_than_is_stated() {
    for (settings, allowed) in [&["sensors.rear-camera.pipeline=off"][..], &[]].into_iter().zip(FULL_CHAIN) {
        let steps = steady(steps("low-thw-overtake", settings, SensorMode::Full, 2));
        let all: u64 = steps.iter().map(|step| step.allocations).sum();
        let per_second = all as f64 / (steps.len() as f64 * PHYSICS_STEP.s());
        assert!(per_second <= allowed, "{settings:?}: {per_second:.0} allocations per simulated second");
    }
}
