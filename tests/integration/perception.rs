//! Whether the tracks are as sure as they may be, over the scenario library.

use std::path::{Path, PathBuf};

use closecall_campaign::runner::{Sampling, concrete};
use closecall_scenarios::sampling::Design;
use closecall_sensors::{Consistency, Credibility, NEES_95, SensorMode};
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::scenario::ScenarioFile;
use closecall_simulation::{Arm, RunKey, TrackAuditor, simulate};
use rayon::prelude::*;

const SEED: u64 = 7;

/// The normalised errors squared of a run.
fn nees(file: &ScenarioFile, sample: u64, mode: SensorMode) -> Vec<f64> {
    let sampling = Sampling { seed: SEED, design: Design::Random, samples: sample + 1 };
    let arm = Arm { controller: BuiltIn::Mis.factory(), sensors: Some(mode) };
    let mut auditor = TrackAuditor::default();
    let scenario = concrete(file, sampling, sample).unwrap();
    simulate(&scenario, RunKey { seed: SEED, sample }, &arm, &mut auditor).unwrap();
    auditor.into_audit().unwrap().nees
}

/// Runs `samples` of every scenario of the library, and judges the tracks of all.
fn must_be_consistent(mode: SensorMode, samples: u64) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/library");
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut paths: Vec<PathBuf> = entries.filter(|path| path.extension().is_some_and(|end| end == "toml")).collect();
    paths.sort();
    let files: Vec<_> = paths.iter().map(|path| ScenarioFile::load(path, &[]).unwrap()).collect();
    // The runs of a sample in all scenarios meet the same noise: together they are one independent value.
    let of_sample = |sample| files.iter().flat_map(|file| nees(file, sample, mode)).collect();
    let runs: Vec<Vec<f64>> = (0..samples).into_par_iter().map(of_sample).collect();
    let found = Consistency::of(&runs).unwrap();
    assert_eq!(found.credibility(), Credibility::Consistent, "{found:?}");
    // Nor do a few large errors among many small ones make up the mean.
    let all: Vec<f64> = runs.concat();
    let below = all.iter().filter(|&&nees| nees < NEES_95).count() as f64 / all.len() as f64;
    assert!((0.92..0.97).contains(&below), "{below} are below the 95 % quantile");
}

#[test]
fn tracks_of_the_object_level_sensor_are_consistent() {
    must_be_consistent(SensorMode::Object, 20);
}

#[test]
fn tracks_of_lidar_and_camera_are_consistent() {
    must_be_consistent(SensorMode::Full, 6);
}
