//! How well the rear sensors perceive in the library's scenarios, in the closed loop.
//!
//! ```text
//! cargo run --release --example validate_perception [SAMPLES] [SEED]
//! ```
//!
//! For each scenario and sensor mode: the mean normalised error squared of the confirmed rear tracks (4 if the
//! covariance is honest) with the 95 % interval of its mean over runs, the root mean square error of the speed, the
//! changes of a track's number, and the confirmed tracks of nothing that were taken for vehicles, per hour.
//!
//! The errors of one run are correlated in time, so that a run counts as one observation: the interval is that of the
//! mean of the runs' means.
#![expect(clippy::print_stdout, reason = "its output is what it is for")]

use std::path::{Path, PathBuf};

use closecall::campaign::runner::{Sampling, concrete};
use closecall::controller::BuiltIn;
use closecall::scenario::ScenarioFile;
use closecall::simulation::{Arm, Happening, Observer, RunKey, StepView, simulate};
use closecall_scenarios::sampling::Design;
use closecall_sensors::{Scene, SceneVehicle, SensorMode, TrackAudit};
use closecall_traffic::Time;

/// Normal quantile of a two-sided 95 % interval.
const TWO_SIDED_95: f64 = 1.96;

/// Holds the tracks of a run against the truth.
#[derive(Default)]
struct Auditor {
    audit: TrackAudit,
    others: Vec<SceneVehicle>,
    broken: bool,
}

impl Observer for Auditor {
    fn step(&mut self, view: &StepView<'_>) {
        let ego = view.scenario.ego;
        self.others.clear();
        self.others
            .extend(view.vehicles.iter().enumerate().filter(|(actor, _)| *actor != ego).map(|(_, other)| *other));
        let scene = Scene {
            time: view.time,
            road: &view.scenario.road,
            environment: &view.scenario.environment,
            ego: view.vehicles[ego],
            others: &self.others,
        };
        self.broken |= self.audit.observe(view.tracks, &scene).is_err();
    }

    fn happening(&mut self, _: Time, _: &Happening) {}
}

#[derive(Default)]
struct Totals {
    nees: Vec<f64>,
    speed_error_sum_m2ps2: f64,
    matched_steps: u64,
    id_switches: u64,
    false_tracks: usize,
    simulated_s: f64,
}

fn run_all(file: &ScenarioFile, mode: SensorMode, samples: u64, seed: u64) -> Totals {
    let sampling = Sampling { seed, design: Design::Random, samples };
    let arm = Arm { controller: BuiltIn::Mis.factory(), sensors: Some(mode) };
    let mut totals = Totals::default();
    for sample in 0..samples {
        let scenario = concrete(file, sampling, sample).expect("a valid sample");
        let mut auditor = Auditor::default();
        let outcome = simulate(&scenario, RunKey { seed, sample }, &arm, &mut auditor).expect("an outcome");
        assert!(!auditor.broken, "the truth is finite");
        totals.nees.extend(auditor.audit.mean_nees());
        totals.speed_error_sum_m2ps2 += auditor.audit.speed_error_sum_m2ps2;
        totals.matched_steps += auditor.audit.matched_steps;
        totals.id_switches += auditor.audit.id_switches;
        totals.false_tracks += auditor.audit.false_tracks();
        totals.simulated_s += outcome.duration.s();
    }
    totals
}

fn print(name: &str, mode: &str, totals: &Totals) {
    let hours = totals.simulated_s / 3_600.0;
    let false_per_h = totals.false_tracks as f64 / hours;
    if totals.nees.len() < 2 {
        println!(
            "{name:<28} {mode:<7} nothing was tracked               {:>5}  {false_per_h:>8.1}",
            totals.id_switches
        );
        return;
    }
    let runs = totals.nees.len() as f64;
    let mean = totals.nees.iter().sum::<f64>() / runs;
    let variance = totals.nees.iter().map(|nees| (nees - mean) * (nees - mean)).sum::<f64>() / (runs - 1.0);
    let half = TWO_SIDED_95 * (variance / runs).sqrt();
    let rmse = (totals.speed_error_sum_m2ps2 / totals.matched_steps as f64).sqrt();
    println!(
        "{name:<28} {mode:<7} {mean:>6.2} [{:.2}, {:.2}]  {rmse:>6.2}  {:>5}  {false_per_h:>8.1}",
        mean - half,
        mean + half,
        totals.id_switches,
    );
}

fn main() {
    let mut args = std::env::args().skip(1);
    let mut number = |default| args.next().map_or(default, |text| text.parse().expect("a number"));
    let (samples, seed) = (number(40), number(1));
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/library");
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
        .expect("the library")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .collect();
    files.sort();
    println!("scenario                     sensors   NEES [95 %]        speed   id   false/h");
    for path in files {
        let file = ScenarioFile::load(&path, &[]).expect("a valid scenario");
        for (mode, name) in [(SensorMode::Object, "object"), (SensorMode::Full, "full")] {
            print(&file.config().name, name, &run_all(&file, mode, samples, seed));
        }
    }
}
