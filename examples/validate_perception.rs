//! How well the rear sensors perceive in the library's scenarios, in the closed loop.
//!
//! ```text
//! cargo run --release --example validate_perception [SAMPLES] [SEED]
//! ```
//!
//! The statistic is the ANEES: the normalised error squared (NEES) of the confirmed rear tracks' [x, y, vx, vy], averaged
//! over all steps of independent runs. If the covariance is honest, its expectation is 4, and N independent values lie
//! with 95 % probability between the quantiles of χ²(4N)/N (Bar-Shalom, Li, Kirubarajan 2001, section 5.4.2), here
//! 4 ± 1.96·√(8/N). Steps of one run are alike, so N is the effective number: all steps over the integrated
//! autocorrelation time of the NEES (initial positive sequence: Geyer 1992). A NEES has longer tails than χ² where
//! motion switches, so that the bounds are rather too narrow than too wide. Verdicts:
//!
//! - PASS: within the bounds;
//! - CAUTIOUS: below them: errors are smaller than the covariance says (nobody weaves in his lane here, while a tracker
//!   has to allow for a lane change at any time);
//! - FAIL: above: the tracker is surer than it may be.
//!
//! Beside it: the share of single NEES below χ²₄'s 95 % quantile (honest: 0.95), the root mean square error of the speed,
//! changes of a track's number, and confirmed tracks of nothing that were taken for vehicles, per hour. Steps after a
//! collision are left out, since a wreck moves like no model. The tuning used seeds from 101 on; judge with others.
#![expect(clippy::print_stdout, reason = "its output is what it is for")]

use std::path::{Path, PathBuf};

use closecall::campaign::runner::{Sampling, concrete};
use closecall::controller::BuiltIn;
use closecall::scenario::ScenarioFile;
use closecall::simulation::{Arm, Happening, Observer, RunKey, StepView, simulate};
use closecall_scenarios::sampling::Design;
use closecall_sensors::{NEES_95, Scene, SceneVehicle, SensorMode, TrackAudit};
use closecall_traffic::Time;

/// Normal quantile of a two-sided 95 % interval.
const TWO_SIDED_95: f64 = 1.96;
/// Expectation of an honest NEES: the dimensions of [x, y, vx, vy].
const DIMENSIONS: f64 = 4.0;
const SECONDS_PER_HOUR: f64 = 3_600.0;

/// Holds the tracks of a run against the truth.
#[derive(Default)]
struct Auditor {
    audit: TrackAudit,
    others: Vec<SceneVehicle>,
    broken: bool,
    has_collided: bool,
}

impl Observer for Auditor {
    fn step(&mut self, view: &StepView<'_>) {
        if self.has_collided {
            return;
        }
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

    fn happening(&mut self, _: Time, what: &Happening) {
        self.has_collided |= matches!(what, Happening::Collision(_));
    }
}

/// What was found in the runs of one scenario, or of all.
#[derive(Clone, Default)]
struct Totals {
    /// NEES of each step, run by run.
    nees: Vec<Vec<f64>>,
    speed_error_sum_m2ps2: f64,
    id_switches: u64,
    false_tracks: usize,
    simulated_s: f64,
}

/// The NEES of all runs put together.
struct Consistency {
    mean: f64,
    half_width: f64,
    share_below: f64,
    effective: f64,
}

impl Consistency {
    fn of(runs: &[Vec<f64>]) -> Option<Self> {
        let steps: usize = runs.iter().map(Vec::len).sum();
        if steps == 0 {
            return None;
        }
        let all = || runs.iter().flatten();
        let mean = all().sum::<f64>() / steps as f64;
        let effective = steps as f64 / autocorrelation_steps(runs, mean);
        Some(Self {
            mean,
            half_width: TWO_SIDED_95 * (2.0 * DIMENSIONS / effective).sqrt(),
            share_below: all().filter(|&&nees| nees < NEES_95).count() as f64 / steps as f64,
            effective,
        })
    }

    fn verdict(&self) -> &'static str {
        if self.mean > DIMENSIONS + self.half_width {
            "FAIL"
        } else if self.mean < DIMENSIONS - self.half_width {
            "CAUTIOUS"
        } else {
            "PASS"
        }
    }
}

/// Steps that one independent value is worth: 1 + 2·Σ of the autocorrelations, up to where pairs of them are no longer
/// positive; at least 1.
fn autocorrelation_steps(runs: &[Vec<f64>], mean: f64) -> f64 {
    let covariance = |lag: usize| -> f64 {
        let products = |run: &Vec<f64>| -> f64 {
            run.iter().zip(run.iter().skip(lag)).map(|(a, b)| (a - mean) * (b - mean)).sum()
        };
        runs.iter().map(products).sum()
    };
    let variance = covariance(0);
    let longest = runs.iter().map(Vec::len).max().unwrap_or(0);
    let mut sum = -1.0;
    for lag in (0..longest).step_by(2) {
        let pair = (covariance(lag) + covariance(lag + 1)) / variance;
        if !(pair > 0.0) {
            break;
        }
        sum += 2.0 * pair;
    }
    sum.max(1.0)
}

impl Totals {
    fn add(&mut self, other: &Self) {
        self.nees.extend_from_slice(&other.nees);
        self.speed_error_sum_m2ps2 += other.speed_error_sum_m2ps2;
        self.id_switches += other.id_switches;
        self.false_tracks += other.false_tracks;
        self.simulated_s += other.simulated_s;
    }
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
        totals.speed_error_sum_m2ps2 += auditor.audit.speed_error_sum_m2ps2;
        totals.nees.push(std::mem::take(&mut auditor.audit.nees));
        totals.id_switches += auditor.audit.id_switches;
        totals.false_tracks += auditor.audit.false_tracks();
        totals.simulated_s += outcome.duration.s();
    }
    totals
}

fn print(name: &str, mode: &str, totals: &Totals) {
    let false_per_h = totals.false_tracks as f64 / (totals.simulated_s / SECONDS_PER_HOUR);
    let switches = totals.id_switches;
    let Some(found) = Consistency::of(&totals.nees) else {
        println!("{name:<28} {mode:<7} {:>68} {switches:>4} {false_per_h:>8.1}", "nothing was tracked");
        return;
    };
    let steps: usize = totals.nees.iter().map(Vec::len).sum();
    let rmse_mps = (totals.speed_error_sum_m2ps2 / steps as f64).sqrt();
    println!(
        "{name:<28} {mode:<7} {:>6.2}  [{:.2}, {:.2}] {:>6.0}  {:<8}  {:>5.3}  {rmse_mps:>5.2} m/s {switches:>4} {false_per_h:>8.1}",
        found.mean,
        DIMENSIONS - found.half_width,
        DIMENSIONS + found.half_width,
        found.effective,
        found.verdict(),
        found.share_below,
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
    println!("{samples} samples each, seed {seed}");
    println!(
        "scenario                     sensors  ANEES  95 % bounds       N  verdict    <95 %   speed     id  false/h"
    );
    let modes = [(SensorMode::Object, "object"), (SensorMode::Full, "full")];
    let mut all = modes.map(|_| Totals::default());
    for path in files {
        let file = ScenarioFile::load(&path, &[]).expect("a valid scenario");
        for ((mode, name), all) in modes.into_iter().zip(&mut all) {
            let totals = run_all(&file, mode, samples, seed);
            print(&file.config().name, name, &totals);
            all.add(&totals);
        }
    }
    for ((_, name), all) in modes.into_iter().zip(&all) {
        print("all of them", name, all);
    }
}
