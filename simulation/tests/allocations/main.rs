//! Counts allocations of memory: in steady state, the steps of the loop allocate nothing.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

mod counting;

use std::path::Path;

use closecall_scenarios::ScenarioFile;
use closecall_scenarios::sampling::Design;
use closecall_sensors::SensorMode;
use closecall_sensors::camera::{Backend, Classifier, Crop};
use closecall_simulation::controller::BuiltIn;
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

/// Scenes of the full chain: scenario, sample, settings.
const FULL_SCENES: [(&str, u64, &[&str]); 9] = [
    ("low-thw-overtake", 2, &[]),
    ("low-thw-overtake", 2, &["environment.water-film-mm=1"]),
    ("low-thw-overtake", 2, &["environment.visibility-m=100"]),
    ("low-thw-overtake", 2, &["road.guard-rails=true"]),
    ("low-thw-overtake", 2, &["environment.light=\"night\""]),
    ("low-thw-overtake", 2, &[RIGHT_LIDAR]),
    ("low-thw-overtake", 2, &["sensors.front-lidar={}"]),
    // Guard rails and twelve vehicles; thirty vehicles.
    ("traffic/busy-overtake", 0, &[]),
    ("traffic/dense-traffic", 0, &["duration-s=20"]),
];

/// Largest number of steps that allocate in such a run in steady state. A vehicle that comes nearer is hit by more beams, and covers
/// more of the image: a list doubles, and keeps its size. That happens in ten steps at most, with two LiDARs. What allocates for each
/// crop would do so in at least fourteen steps, and what allocates in each scan in about 270.
const FULL_GROWING_STEPS: usize = 12;

/// `linfa-clustering` asks for the neighbours of each point as a new list. Closecall's own DBSCAN finds the same clusters.
const OWN_CLUSTERING: &str = "sensors.clustering=grid";

/// A second rear LiDAR, at the right corner of the bumper.
const RIGHT_LIDAR: &str = "sensors.additional-rear-lidars=[{ name = \"right\", left-m = -0.8, azimuth-deg = -40 }]";

/// Returns the steps in steady state that allocate: their times (s), and the allocations of each beyond whole calls of a
/// function that makes `of_a_call` of them.
fn allocating(steps: &[Step], of_a_call: u64) -> Vec<(f64, u64)> {
    let beyond = |step: &Step| step.allocations % of_a_call;
    let silent = steps.iter().filter(|step| !step.has_event && beyond(step) > 0);
    silent.map(|step| (step.time_s, beyond(step))).collect()
}

#[test]
fn the_full_chain_without_the_camera_allocates_nothing() {
    for (scenario, sample, settings) in FULL_SCENES {
        let settings = [settings, &[OWN_CLUSTERING, "sensors.rear-camera.pipeline=off"]].concat();
        let steps = steady(steps(scenario, &settings, SensorMode::Full, sample));
        assert!(steps.len() > 300, "{scenario}, {settings:?}: {} steps", steps.len());
        let allocating = allocating(&steps, u64::MAX);
        assert!(
            allocating.len() <= FULL_GROWING_STEPS,
            "{scenario}, {settings:?}: (time in s, allocations) {allocating:?}"
        );
    }
}

/// Returns the number of allocations of `tract` and `ort` in one call of the network, which is the same in each call.
fn allocations_of_the_network() -> u64 {
    let mut classifier = Classifier::shipped(&Backend::Tract).unwrap();
    let crop = Crop::default();
    let calls: Vec<u64> = (0..4)
        .map(|_| {
            let before = allocations();
            classifier.classify(&crop).unwrap();
            allocations() - before
        })
        .collect();
    assert!(calls[1..].iter().all(|count| *count == calls[1]), "{calls:?}");
    calls[1]
}

#[test]
fn the_camera_allocates_nothing_but_what_the_network_does() {
    let of_the_network = allocations_of_the_network();
    // With fewer, a few allocations of ours could pass for a call of the network.
    assert!(of_the_network > 20, "{of_the_network}");
    for (scenario, sample, settings) in FULL_SCENES {
        let settings = [settings, &[OWN_CLUSTERING]].concat();
        let steps = steady(steps(scenario, &settings, SensorMode::Full, sample));
        let calls: u64 = steps.iter().map(|step| step.allocations / of_the_network).sum();
        assert!(calls > 5, "{scenario}, {settings:?}: {calls} calls of the network");
        let allocating = allocating(&steps, of_the_network);
        assert!(
            allocating.len() <= FULL_GROWING_STEPS,
            "{scenario}, {settings:?}: (time in s, allocations of ours) {allocating:?}"
        );
    }
}
