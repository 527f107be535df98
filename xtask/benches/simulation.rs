//! Measures simulated seconds per wall-clock second on one core, for each depth of the sensor
//! simulation.
//!
//! Run with `cargo bench -p closecall-xtask --bench simulation`. Criterion reports the throughput
//! in "elements", which are simulated milliseconds. The line printed before each benchmark gives
//! simulated seconds per wall-clock second.

#![expect(clippy::print_stdout, reason = "a benchmark prints its figure")]

use std::path::Path;
use std::time::Instant;

use closecall_campaign::runner::{Sampling, concrete};
use closecall_scenarios::sampling::Design;
use closecall_scenarios::{Scenario, ScenarioFile};
use closecall_sensors::SensorMode;
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::{Arm, NoObserver, RunKey, simulate};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

/// Number of samples of the scenario `low-thw-overtake` in one iteration.
const SAMPLES: u64 = 8;

fn scenarios() -> Vec<Scenario> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/library/low-thw-overtake.toml");
    let file = ScenarioFile::load(&path, &[]).expect("a valid scenario");
    let sampling = Sampling { seed: 0, design: Design::Random, samples: SAMPLES };
    (0..SAMPLES).map(|sample| concrete(&file, sampling, sample).expect("a valid sample")).collect()
}

/// Runs every sample and returns the simulated time (s).
fn run_all(scenarios: &[Scenario], arm: &Arm) -> f64 {
    let run = |(sample, scenario): (usize, &Scenario)| {
        let key = RunKey { seed: 0, sample: sample as u64 };
        simulate(scenario, key, arm, &mut NoObserver).expect("an outcome").duration.s()
    };
    scenarios.iter().enumerate().map(run).sum()
}

fn simulation(criterion: &mut Criterion) {
    let scenarios = scenarios();
    for (name, mode) in
        [("ground-truth", SensorMode::GroundTruth), ("object", SensorMode::Object), ("full", SensorMode::Full)]
    {
        let arm = Arm { controller: BuiltIn::Mis.factory(), sensors: Some(mode) };
        let started = Instant::now();
        let simulated_s = run_all(&scenarios, &arm);
        println!("{name}: {:.0} simulated seconds per wall second", simulated_s / started.elapsed().as_secs_f64());
        let mut group = criterion.benchmark_group("simulation");
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few hundred thousand ms")]
        group.throughput(Throughput::Elements((1_000.0 * simulated_s) as u64)).sample_size(10);
        group.bench_function(name, |bencher| bencher.iter(|| run_all(&scenarios, &arm)));
        group.finish();
    }
}

criterion_group!(benches, simulation);
criterion_main!(benches);
