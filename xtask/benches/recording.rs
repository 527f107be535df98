//! Measures the two costs of a recording of a paired sample: of the film that is kept during the
//! run, and of the file that is written from it.
//!
//! Command: `cargo bench -p closecall-xtask --bench recording`.

use std::path::Path;

use closecall_campaign::runner::{Sampling, concrete};
use closecall_report::run::film::{Level, film_arms};
use closecall_report::run::rerun::write_recording;
use closecall_scenarios::sampling::Design;
use closecall_scenarios::{Scenario, ScenarioFile};
use closecall_sensors::SensorMode;
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::{Arm, NoObserver, RunKey, simulate};
use divan::Bencher;

/// The run that is measured.
const KEY: RunKey = RunKey { seed: 0, sample: 0 };

fn headline() -> Scenario {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/library/low-thw-overtake.toml");
    let file = ScenarioFile::load(&path, &[]).expect("a valid scenario");
    concrete(&file, Sampling { seed: KEY.seed, design: Design::Random, samples: 1 }, KEY.sample)
        .expect("a valid sample")
}

fn main() {
    divan::main();
}

const MODES: [SensorMode; 2] = [SensorMode::Object, SensorMode::Full];

fn arms(mode: SensorMode) -> [Arm; 2] {
    [BuiltIn::Acc, BuiltIn::Mis].map(|arm| Arm { controller: arm.factory(), sensors: Some(mode) })
}

#[divan::bench(args = MODES, sample_count = 10)]
fn run_without_film(bencher: Bencher<'_, '_>, mode: SensorMode) {
    let (scenario, arms) = (headline(), arms(mode));
    bencher
        .bench_local(|| arms.each_ref().map(|arm| simulate(&scenario, KEY, arm, &mut NoObserver).expect("an outcome")));
}

#[divan::bench(args = MODES, sample_count = 10)]
fn run_with_film(bencher: Bencher<'_, '_>, mode: SensorMode) {
    let (scenario, arms) = (headline(), arms(mode));
    bencher.bench_local(|| film_arms(&scenario, KEY, &arms, Level::Full).expect("an outcome"));
}

#[divan::bench(args = MODES, sample_count = 10)]
fn file(bencher: Bencher<'_, '_>, mode: SensorMode) {
    let folder = tempfile::tempdir().expect("a folder");
    let film = film_arms(&headline(), KEY, &arms(mode), Level::Full).expect("an outcome");
    let path = folder.path().join("sample.rrd");
    bencher.bench_local(|| write_recording(&path, &film).expect("written"));
}
