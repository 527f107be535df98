//! Measures how often the margin increase system engages without a rear vehicle, on a wet road with
//! spray and guard rails.
//!
//! ```text
//! cargo run --release -p closecall-xtask -- validate-false-engagements [HOURS] [SEED] [with|without]
//! ```
//!
//! Runs the scenario `empty-wet-road` with all sensors, once with the rear camera's classifier and
//! once without it, for at least HOURS simulated hours each (default: 10). Without the classifier,
//! only the shapes in the LiDAR's data identify a vehicle. The program counts engagements and false
//! confirmed tracks that were classified as vehicles, with exact Poisson intervals of their rates
//! (Garwood 1936). Ten hours of both variants take about 40 minutes on two cores; each variant can
//! be run alone.
//!
//! The validation passes (exit code 0) if the 95 % upper bound of the rate of engagements with the
//! classifier is below 1 per hour.
#![expect(clippy::print_stdout, reason = "a validation prints its result")]

use std::path::Path;
use std::process::ExitCode;

use closecall_campaign::runner::{Sampling, concrete};
use closecall_controllers::EgoState;
use closecall_scenarios::sampling::Design;
use closecall_scenarios::{ScenarioFile, Setting};
use closecall_sensors::SensorMode;
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::{Arm, Observer, RunEvent, RunKey, StepView, simulate};
use closecall_traffic::{Source, Time, TrackId, TrackStatus};
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Limit that the 95 % upper bound must stay below (engagements per hour).
const MOST_PER_HOUR: f64 = 1.0;
/// Confidence of the one-sided bound, and of the two-sided interval.
const CONFIDENCE: f64 = 0.95;
const SECONDS_PER_HOUR: f64 = 3_600.0;

/// Counts over one or more runs.
#[derive(Clone, Debug, Default)]
struct Counts {
    samples: u64,
    simulated_s: f64,
    engagements: u64,
    false_vehicles: u64,
    false_tracks: u64,
}

impl Counts {
    fn plus(self, other: Self) -> Self {
        Self {
            samples: self.samples + other.samples,
            simulated_s: self.simulated_s + other.simulated_s,
            engagements: self.engagements + other.engagements,
            false_vehicles: self.false_vehicles + other.false_vehicles,
            false_tracks: self.false_tracks + other.false_tracks,
        }
    }

    fn hours(&self) -> f64 {
        self.simulated_s / SECONDS_PER_HOUR
    }
}

/// Counts in one run. There is no rear vehicle, so that every confirmed rear track is false.
#[derive(Default)]
struct Counter {
    engagements: u64,
    confirmed: Vec<TrackId>,
    vehicles: Vec<TrackId>,
}

impl Observer for Counter {
    fn step(&mut self, view: &StepView<'_>) {
        let is_confirmed = |status| status != TrackStatus::Tentative;
        for track in view.tracks.iter().filter(|track| track.source == Source::Rear && is_confirmed(track.status)) {
            if !self.confirmed.contains(&track.id) {
                self.confirmed.push(track.id);
            }
            if track.class.vehicle() > 0.5 && !self.vehicles.contains(&track.id) {
                self.vehicles.push(track.id);
            }
        }
    }

    fn event(&mut self, _: Time, event: &RunEvent) {
        let engages = matches!(event, RunEvent::EgoStateChanged { to: EgoState::Increasing, .. });
        self.engagements += u64::from(engages);
    }
}

fn run(file: &ScenarioFile, seed: u64, sample: u64) -> Counts {
    let sampling = Sampling { seed, design: Design::Random, samples: sample + 1 };
    let scenario = concrete(file, sampling, sample).expect("a valid sample");
    let arm = Arm { controller: BuiltIn::Mis.factory(), sensors: Some(SensorMode::Full) };
    let mut counter = Counter::default();
    let outcome = simulate(&scenario, RunKey { seed, sample }, &arm, &mut counter).expect("an outcome");
    Counts {
        samples: 1,
        simulated_s: outcome.duration.s(),
        engagements: counter.engagements,
        false_vehicles: counter.vehicles.len() as u64,
        false_tracks: counter.confirmed.len() as u64,
    }
}

/// Returns exact bounds of a rate per hour (Garwood 1936): the lower and upper end of the two-sided
/// interval, and the one-sided upper bound.
fn rate_bounds(events: u64, hours: f64) -> [f64; 3] {
    let quantile = |freedom: u64, probability: f64| {
        let chi_squared = ChiSquared::new(freedom as f64).expect("positive degrees of freedom");
        chi_squared.inverse_cdf(probability) / (2.0 * hours)
    };
    let tail = (1.0 - CONFIDENCE) / 2.0;
    let low = if events == 0 { 0.0 } else { quantile(2 * events, tail) };
    [low, quantile(2 * (events + 1), 1.0 - tail), quantile(2 * (events + 1), CONFIDENCE)]
}

fn print(label: &str, events: u64, hours: f64) -> f64 {
    let [low, high, bound] = rate_bounds(events, hours);
    println!(
        "  {label:<40} {events:>6}  {:>8.3} per hour  (95 %: {low:.3} to {high:.3}; one-sided bound {bound:.3})",
        events as f64 / hours
    );
    bound
}

/// Runs as many samples as the hours need, prints the counts, and returns the upper bound of the
/// rate of engagements.
fn study(name: &str, settings: &[Setting], hours: f64, seed: u64) -> f64 {
    let path = Path::new(crate::ROOT).join("scenarios/library/empty-wet-road.toml");
    let file = ScenarioFile::load(&path, settings).expect("a valid scenario");
    let first = concrete(&file, Sampling { seed, design: Design::Random, samples: 1 }, 0).expect("a valid sample");
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small positive number")]
    let samples = (hours * SECONDS_PER_HOUR / first.duration.s()).ceil() as u64;
    let total =
        (0..samples).into_par_iter().map(|sample| run(&file, seed, sample)).reduce(Counts::default, Counts::plus);
    println!("{name}: {} samples, {:.2} simulated hours, seed {seed}", total.samples, total.hours());
    let bound = print("engagements", total.engagements, total.hours());
    print("false confirmed tracks taken for vehicles", total.false_vehicles, total.hours());
    print("false confirmed tracks of any class", total.false_tracks, total.hours());
    bound
}

pub(crate) fn main(words: Vec<String>) -> ExitCode {
    let mut args = words.into_iter();
    let hours = args.next().map_or(10.0, |text| text.parse().expect("hours, a number"));
    let seed = args.next().map_or(1, |text| text.parse().expect("a seed, a whole number"));
    let only = args.next();
    let is_asked = |name: &str| only.as_deref().is_none_or(|only| only == name);
    if is_asked("without") {
        let off: Setting = "sensors.rear-camera.pipeline=off".parse().expect("a setting");
        study("LiDAR alone", &[off], hours, seed);
    }
    if !is_asked("with") {
        return ExitCode::SUCCESS;
    }
    let bound = study("LiDAR and camera", &[], hours, seed);
    let passes = bound < MOST_PER_HOUR;
    println!("{}: bound {bound:.3} per hour, allowed below {MOST_PER_HOUR}", if passes { "PASS" } else { "FAIL" });
    if passes { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
