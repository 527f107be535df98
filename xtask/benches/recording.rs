//! Measures the two costs of a recording of a paired sample: of the film that is kept during the
//! run, and of the file that is written from it.
//!
//! Command: `cargo bench -p closecall-xtask --bench recording`.

use std::path::Path;
use std::time::Duration;

use closecall_campaign::runner::{Sampling, concrete};
use closecall_report::run::film::{Level, film_arms};
use closecall_report::run::rerun::write_recording;
use closecall_scenarios::sampling::Design;
use closecall_scenarios::{Scenario, ScenarioFile};
use closecall_sensors::SensorMode;
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::{Arm, NoObserver, RunKey, simulate};
use criterion::{Criterion, criterion_group, criterion_main};

/// The run that is measured.
const KEY: RunKey = RunKey { seed: 0, sample: 0 };

fn headline() -> Scenario {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/library/low-thw-overtake.toml");
    let file = ScenarioFile::load(&path, &[]).expect("a valid scenario");
    concrete(&file, Sampling { seed: KEY.seed, design: Design::Random, samples: 1 }, KEY.sample)
        .expect("a valid sample")
}

fn recording(criterion: &mut Criterion) {
    let scenario = headline();
    let folder = tempfile::tempdir().expect("a folder");
    for (name, mode) in [("object", SensorMode::Object), ("full", SensorMode::Full)] {
        let arms = [BuiltIn::Acc, BuiltIn::Mis].map(|arm| Arm { controller: arm.factory(), sensors: Some(mode) });
        let film = || film_arms(&scenario, KEY, &arms, Level::Full).expect("an outcome");
        let mut group = criterion.benchmark_group(format!("recording/{name}"));
        group.sample_size(10).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(2));
        group.bench_function("run without film", |bencher| {
            bencher.iter(|| {
                let run = |arm| simulate(&scenario, KEY, arm, &mut NoObserver).expect("an outcome");
                arms.each_ref().map(run)
            });
        });
        group.bench_function("run with film", |bencher| bencher.iter(film));
        let films = film();
        let file = folder.path().join("sample.rrd");
        group.bench_function("file", |bencher| bencher.iter(|| write_recording(&file, &films).expect("written")));
        group.finish();
    }
}

criterion_group!(benches, recording);
criterion_main!(benches);
