//! The covariances of the tracks agree with their errors, over the scenario library.

use closecall_campaign::runner::{Sampling, concrete};
use closecall_scenarios::ScenarioFile;
use closecall_scenarios::sampling::Design;
use closecall_sensors::{NEES_QUANTILE_95, SensorMode};
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::{Arm, RunKey, TrackAuditor, simulate};
use closecall_traffic::statistics::consistency::{Consistency, Credibility};
use rayon::prelude::*;

use crate::support::all_of_library;

const SEED: u64 = 7;
/// Ends of the names of the twins.
const TWINS: [&str; 2] = ["-without-brake", "-without-cut-in"];
/// Scenario in which the full chain has tracks with large errors.
const HIDDEN_VEHICLES: &str = "rear-vehicles-one-after-another";

/// Returns the normalised estimation errors squared (NEES) of a run.
fn nees(file: &ScenarioFile, sample: u64, mode: SensorMode) -> Vec<f64> {
    let sampling = Sampling { seed: SEED, design: Design::Random, samples: sample + 1 };
    let arm = Arm { controller: BuiltIn::Mis.factory(), sensors: Some(mode) };
    let mut auditor = TrackAuditor::default();
    let scenario = concrete(file, sampling, sample).unwrap();
    simulate(&scenario, RunKey { seed: SEED, sample }, &arm, &mut auditor).unwrap();
    auditor.into_audit().unwrap().nees
}

/// Returns whether drivers weave in a scenario, as the tracker expects of a vehicle that keeps its
/// lane.
fn weaves(file: &ScenarioFile) -> bool {
    file.text().contains("lane-keeping")
}

/// Returns the consistency of the tracks in `samples` samples of scenarios, and the NEES of all of
/// their steps.
fn consistency(files: &[ScenarioFile], mode: SensorMode, samples: u64) -> (Consistency, Vec<f64>) {
    // A sample has the same noise in all scenarios: its runs together count as one independent
    // value.
    let of_sample = |sample| files.iter().flat_map(|file| nees(file, sample, mode)).collect();
    let runs: Vec<Vec<f64>> = (0..samples).into_par_iter().map(of_sample).collect();
    (Consistency::of(&runs).unwrap(), runs.concat())
}

/// Runs `samples` samples of every scenario of the library. Fails if the errors of the tracks
/// exceed their covariance, or are smaller by more than a quarter where drivers weave. Drivers who
/// anticipate and start in equilibrium accelerate less than the tracker expects. Where no driver
/// weaves, the tracker expects more than there is.
fn assert_consistent(mode: SensorMode, samples: u64) {
    let mut files: Vec<_> = all_of_library().iter().map(|path| ScenarioFile::load(path, &[]).unwrap()).collect();
    // A twin, in which nothing happens ahead, has the vehicles and the noise of its scenario: its
    // tracks would count twice.
    let names: Vec<String> = files.iter().map(|file| file.config().name.clone()).collect();
    let of_twin = |name: &str| TWINS.iter().find_map(|suffix| name.strip_suffix(suffix).map(str::to_owned));
    files.retain(|file| of_twin(&file.config().name).is_none_or(|name| !names.contains(&name)));
    if mode == SensorMode::Object {
        let straight: Vec<_> = files.extract_if(.., |file| !weaves(file)).collect();
        assert!(straight.len() <= 2 && files.len() >= 12, "{} of {}", straight.len(), files.len());
        let (consistency_of_errors, _) = consistency(&straight, mode, samples);
        assert!(consistency_of_errors.mean < 4.0 && consistency_of_errors.mean > 2.0, "{consistency_of_errors:?}");
    }
    // In one of nine samples, a car stands still for 14 s, partly hidden by a motorcycle 4 m behind
    // the ego. The visible part of its front is up to 0.3 m to one side, and the box claims a few
    // centimetres: the NEES across the road is 240 there, and below 2 in each of the others.
    if mode == SensorMode::Full {
        files.retain(|file| file.config().name != HIDDEN_VEHICLES);
        assert!(files.len() >= 13);
    }
    let (consistency_of_errors, all) = consistency(&files, mode, samples);
    match (mode, consistency_of_errors.credibility()) {
        (_, Credibility::Consistent) => {}
        // In mode `full`, the slow error of the boxes has one smoothed deviation for both sides of
        // the mirror, and its share of the error was measured without that.
        (SensorMode::Full | SensorMode::Object, Credibility::Conservative) => {
            assert!(consistency_of_errors.mean > 3.0, "{consistency_of_errors:?}")
        }
        _ => panic!("{consistency_of_errors:?}"),
    }
    // The mean does not consist of a few large errors among many small ones.
    let below = all.iter().filter(|&&nees| nees < NEES_QUANTILE_95).count() as f64 / all.len() as f64;
    assert!((0.92..0.97).contains(&below), "a share of {below} is below the 95 % quantile");
}

#[test]
fn tracks_of_the_object_level_sensor_are_consistent() {
    assert_consistent(SensorMode::Object, 20);
}

#[test]
fn tracks_of_lidar_and_camera_are_consistent() {
    // The share below the quantile scatters by a percent between sets of six samples.
    assert_consistent(SensorMode::Full, 9);
}
