//! Measures the stages of the closed loop: neighbours and margins, drivers with motion and contacts
//! of all vehicles, single drivers, object-level sensors, and the ego stack with and without its
//! margin increase system.
//!
//! Command: `cargo bench -p closecall-xtask --bench stages`. The time of a stage is the time of one
//! of its steps: 100 Hz for neighbours, drivers and motion, 25 Hz for sensors, ego stack and
//! report.

use std::hint::black_box;
use std::path::Path;
use std::time::Duration;

use closecall_campaign::runner::{Sampling, concrete};
use closecall_controllers::{CheckedDriver, DriverInput, Neighbours};
use closecall_scenarios::sampling::Design;
use closecall_scenarios::{Scenario, ScenarioFile};
use closecall_sensors::SensorMode;
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::{Arm, RunKey};
use closecall_traffic::{PHYSICS_STEP, Time, stream};
use criterion::{Criterion, criterion_group, criterion_main};
use stages::{Stages, stages};
use traffic::traffic;

#[path = "../src/throughput/stages.rs"]
mod stages;
#[path = "../src/throughput/traffic.rs"]
mod traffic;

/// The run that is measured.
const KEY: RunKey = RunKey { seed: 0, sample: 0 };
/// Numbers of vehicles in dense traffic.
const VEHICLES: [usize; 3] = [3, 30, 100];

/// Returns the nominal scenario of a file.
fn nominal(file: &ScenarioFile) -> Scenario {
    concrete(file, Sampling { seed: 0, design: Design::Random, samples: 1 }, 0).expect("a valid sample")
}

fn headline() -> Scenario {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/library/low-thw-overtake.toml");
    nominal(&ScenarioFile::load(&path, &[]).expect("a valid scenario"))
}

/// A function that returns the time of a stage (s), and the number of its steps in a run.
type Stage = fn(&Stages) -> (f64, f64);

/// Runs a scenario until a stage has made `steps` steps, and returns the time of these steps.
fn timed(scenario: &Scenario, (controller, sensors): (BuiltIn, SensorMode), steps: u64, stage: Stage) -> Duration {
    let arm = Arm { controller: controller.factory(), sensors: Some(sensors) };
    let (mut time_s, mut done) = (0.0, 0.0);
    while done < steps as f64 {
        let stages = stages(std::iter::once((scenario, KEY)), &arm).expect("an outcome");
        assert!(stages.simulated_s > 0.0, "nothing was simulated");
        let (stage_s, count) = stage(&stages);
        time_s += stage_s;
        done += count;
    }
    Duration::from_secs_f64(time_s / done * steps as f64)
}

fn steps(criterion: &mut Criterion) {
    use SensorMode::{GroundTruth, Object};
    let mut group = criterion.benchmark_group("step");
    group.sample_size(10).warm_up_time(Duration::from_millis(300)).measurement_time(Duration::from_secs(1));
    let mut bench = |name: String, scenario: &Scenario, arm: (BuiltIn, SensorMode), stage: Stage| {
        group.bench_function(name, |bencher| bencher.iter_custom(|steps| timed(scenario, arm, steps, stage)));
    };
    for vehicles in VEHICLES {
        let file = ScenarioFile::parse(Path::new("traffic.toml"), &traffic(vehicles), &[]).expect("a valid scenario");
        let (scenario, arm) = (nominal(&file), (BuiltIn::Mis, GroundTruth));
        let neighbours: Stage = |stages| (stages.neighbours_s, stages.physics_steps);
        bench(format!("neighbours and margins, {vehicles} vehicles"), &scenario, arm, neighbours);
        let motion: Stage = |stages| (stages.motion_s, stages.physics_steps);
        bench(format!("drivers, motion and contacts, {vehicles} vehicles"), &scenario, arm, motion);
        let report: Stage = |stages| (stages.report_s, stages.control_steps);
        bench(format!("report, {vehicles} vehicles"), &scenario, arm, report);
        let sensors: Stage = |stages| (stages.sensors_s, stages.control_steps);
        bench(format!("object-level sensors, {vehicles} vehicles"), &scenario, (BuiltIn::Mis, Object), sensors);
    }
    let headline = headline();
    for (name, controller) in [("ACC and AEB", BuiltIn::Acc), ("ACC, AEB and MIS", BuiltIn::Mis)] {
        let stack: Stage = |stages| (stages.stack_s, stages.control_steps);
        bench(format!("ego stack: {name}"), &headline, (controller, GroundTruth), stack);
    }
    let start: Stage = |stages| (stages.start_s, 1.0);
    bench("preparation of a run".to_owned(), &headline, (BuiltIn::Mis, Object), start);
}

/// Measures one step of each human driver of the headline, alone on its road.
fn drivers(criterion: &mut Criterion) {
    let scenario = headline();
    for (index, actor) in scenario.actors.iter().enumerate() {
        let CheckedDriver::Human(human) = &actor.driver else { continue };
        let (mut driver, mut rng) = (human.build(), stream(KEY.seed, KEY.sample, &actor.id, "driver"));
        let (vehicle, neighbours, mut time) = (scenario.vehicle(index, KEY), Neighbours::default(), Time::ZERO);
        criterion.bench_function(&format!("driver of {}", actor.id), |bencher| {
            bencher.iter(|| {
                time += PHYSICS_STEP;
                let input = DriverInput {
                    time,
                    vehicle: &vehicle,
                    own: &actor.start,
                    neighbours: &neighbours,
                    road: &scenario.road,
                    lane_change_target: None,
                    lateral_deviation_m: 0.0,
                    desired_speed_offset_mps: 0.0,
                };
                driver.step(black_box(&input), &mut rng).expect("a finite action")
            });
        });
    }
}

criterion_group!(benches, steps, drivers);
criterion_main!(benches);
