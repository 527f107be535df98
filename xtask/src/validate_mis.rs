//! Compares the predictions of the margin increase system with its results, in the library's
//! overtaking scenarios.
//!
//! ```text
//! cargo run --release -p closecall-xtask -- validate-mis [SAMPLES] [SEED] [ground-truth|object|full] [CURVES.svg]
//! ```
//!
//! For each scenario and each band of approach speed, the program counts the samples in which the
//! system engages. It counts the engagements in which the system states that a gain of 2 s in the
//! front time headway is within reach (a promise). It also counts the promises after which the gain
//! is 1.9 s or more when the rear vehicle reaches the critical distance. The promise assumes that
//! the lead and the rear vehicle keep their behaviour. If the lead vehicle brakes before the rear
//! vehicle has arrived, or the rear vehicle turns away and the system releases, the promise is
//! void: these samples are counted separately.
//!
//! If a file name is given, the program draws, for each band, the probability that the system has
//! engaged before the rear vehicle has come to a given gap: with true tracks this is a step at 100
//! m, with simulated perception a curve.
//!
//! With true tracks, the validation passes (exit code 0) if no promise was broken. Three scenarios
//! of 1000 samples take a minute on two cores with true tracks; with all sensors, 40 samples take
//! about as long.
#![expect(clippy::print_stdout, reason = "a validation prints its result")]

use std::error::Error;
use std::path::Path;
use std::process::ExitCode;

use closecall_campaign::runner::{Sampling, concrete};
use closecall_controllers::EgoState;
use closecall_scenarios::ScenarioFile;
use closecall_scenarios::outcome::{Moment, Outcome};
use closecall_scenarios::sampling::Design;
use closecall_sensors::SensorMode;
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::{Arm, Observer, RunEvent, RunKey, StepView, simulate};
use closecall_traffic::Time;
use plotters::prelude::*;
use rayon::iter::{IntoParallelIterator, ParallelIterator};

const SCENARIOS: [&str; 3] = ["overtake-without-brake", "low-thw-overtake", "low-thw-overtake-at-cut-out"];

/// Edges of the bands of approach speed (km/h).
const EDGES_KMH: [f64; 5] = [10.0, 20.0, 30.0, 40.0, 51.0];

/// Tolerance of the gain (s).
const SHORT_BY_S: f64 = 0.1;

/// Gain of the front time headway that the system aims at (s).
const GOAL_S: f64 = 2.0;

const KMH_PER_MPS: f64 = 3.6;

/// The result of one sample.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    /// Closing speed of the rear vehicle at the start (km/h).
    approach_kmh: f64,
    /// True gap of the rear vehicle at the engagement (m).
    engaged_at_m: Option<f64>,
    /// Whether the system stated that the gain is within reach.
    promised: bool,
    /// Whether the lead vehicle braked, or the system released, before the rear vehicle arrived.
    called_off: bool,
    /// Gain of the front time headway up to the critical distance (s).
    gained_s: Option<f64>,
}

/// Observes the closing speed of the rear vehicle, and its gap at the engagement.
#[derive(Default)]
struct Watch {
    approach_mps: Option<f64>,
    engaged_at_m: Option<f64>,
}

impl Observer for Watch {
    fn step(&mut self, view: &StepView<'_>) {
        if self.approach_mps.is_none()
            && let Some(rear) = view.margins.follower
        {
            let speed_mps = |actor: usize| view.vehicles[actor].state.speed_mps;
            self.approach_mps = Some(speed_mps(rear) - speed_mps(view.scenario.ego));
        }
        if self.engaged_at_m.is_none() && view.command.state == EgoState::Increasing {
            self.engaged_at_m = view.margins.gap_rear_m.ok();
        }
    }

    fn event(&mut self, _: Time, _: &RunEvent) {}
}

fn seen(outcome: &Outcome, watch: &Watch) -> Seen {
    let critical = outcome.moment(Moment::CriticalDistance);
    let brakes = outcome.moment(Moment::FrontBrakes);
    let mis = outcome.mis.as_ref().ok();
    let released = mis.and_then(|mis| mis.released_at_s.ok()).map(Time::from_s);
    let before_critical = |event: Option<Time>| match (event, critical) {
        (Some(event), Some(critical)) => event <= critical,
        (_, None) => true,
        (None, Some(_)) => false,
    };
    let gained = |mis: &closecall_scenarios::outcome::MisSummary| {
        Some(mis.thw_front_at_critical_s.ok()? - mis.thw_front_at_engagement_s.ok()?)
    };
    Seen {
        approach_kmh: KMH_PER_MPS * watch.approach_mps.unwrap_or(f64::NAN),
        engaged_at_m: watch.engaged_at_m.filter(|_| mis.is_some_and(|mis| mis.engaged_at_s.is_ok())),
        promised: mis.is_some_and(|mis| mis.goal_in_reach == Some(true)),
        called_off: before_critical(brakes) || before_critical(released),
        gained_s: mis.and_then(gained),
    }
}

fn run_all(file: &ScenarioFile, mode: SensorMode, samples: u64, seed: u64) -> Vec<Seen> {
    let sampling = Sampling { seed, design: Design::Random, samples };
    let arm = Arm { controller: BuiltIn::Mis.factory(), sensors: Some(mode) };
    let run = |sample| {
        let scenario = concrete(file, sampling, sample).expect("a valid sample");
        let mut watch = Watch::default();
        let outcome = simulate(&scenario, RunKey { seed, sample }, &arm, &mut watch).expect("an outcome");
        seen(&outcome, &watch)
    };
    (0..samples).into_par_iter().map(run).collect()
}

/// Prints the counts of a band, and returns the number of broken promises in it.
fn print(name: &str, seen: &[&Seen]) -> usize {
    let engaged = seen.iter().filter(|run| run.engaged_at_m.is_some()).count();
    let promised: Vec<_> = seen.iter().filter(|run| run.promised).collect();
    let kept: Vec<_> = promised.iter().filter(|run| !run.called_off).collect();
    let reached = |run: &&&&&Seen| run.gained_s.is_some_and(|gained_s| gained_s >= GOAL_S - SHORT_BY_S);
    let reached = kept.iter().filter(reached).count();
    let least_s = kept.iter().filter_map(|run| run.gained_s).fold(f64::INFINITY, f64::min);
    let least = if least_s.is_finite() { format!("{least_s:.2}") } else { "-".to_owned() };
    let share = if engaged > 0 { 100.0 * promised.len() as f64 / engaged as f64 } else { 0.0 };
    println!(
        "{name:<14} {:>7} {engaged:>8} {:>9} {share:>6.1} % {:>11} {:>8} {reached:>8} {least:>11}",
        seen.len(),
        promised.len(),
        promised.len() - kept.len(),
        kept.len(),
    );
    kept.len() - reached
}

/// Returns the name and the samples of each band.
fn bands(seen: &[Seen]) -> Vec<(String, Vec<&Seen>)> {
    let band = |edges: &[f64]| {
        let inside = |run: &&Seen| edges[0] <= run.approach_kmh && run.approach_kmh < edges[1];
        (format!("{:.0}-{:.0} km/h", edges[0], edges[1].min(50.0)), seen.iter().filter(inside).collect())
    };
    EDGES_KMH.windows(2).map(band).collect()
}

/// Draws the share of samples that have engaged before the rear vehicle has come to each gap.
fn draw(path: &Path, title: &str, seen: &[Seen]) -> Result<(), Box<dyn Error>> {
    let root = SVGBackend::new(path, (960, 560)).into_drawing_area();
    root.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&root)
        .caption(title, ("sans-serif", 22))
        .margin(12)
        .x_label_area_size(44)
        .y_label_area_size(52)
        .build_cartesian_2d(120.0..0.0, 0.0..1.0)?;
    chart
        .configure_mesh()
        .x_desc("gap of R behind E [m]")
        .y_desc("share of samples that have engaged by then")
        .draw()?;
    for (place, (name, samples)) in bands(seen).into_iter().enumerate().filter(|(_, (_, samples))| !samples.is_empty())
    {
        let colour = Palette99::pick(place).to_rgba();
        let share = |gap_m: f64| {
            let engaged = samples.iter().filter(|run| run.engaged_at_m.is_some_and(|at_m| at_m >= gap_m)).count();
            engaged as f64 / samples.len() as f64
        };
        let points = (0..=240).map(|step| 120.0 - 0.5 * f64::from(step)).map(|gap_m| (gap_m, share(gap_m)));
        chart
            .draw_series(LineSeries::new(points, colour.stroke_width(2)))?
            .label(format!("{name} (n = {})", samples.len()))
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 24, y)], colour.stroke_width(2)));
    }
    chart.configure_series_labels().position(SeriesLabelPosition::LowerRight).background_style(WHITE).draw()?;
    root.present()?;
    Ok(())
}

fn mode(name: &str) -> Option<SensorMode> {
    match name {
        "ground-truth" => Some(SensorMode::GroundTruth),
        "object" => Some(SensorMode::Object),
        "full" => Some(SensorMode::Full),
        _ => None,
    }
}

pub(crate) fn main(words: Vec<String>) -> Result<ExitCode, Box<dyn Error>> {
    let mut arguments = words.into_iter();
    let mut number = |default: u64| arguments.next().map_or(Ok(default), |text| text.parse());
    let (samples, seed) = (number(1000)?, number(1)?);
    let name = arguments.next().unwrap_or_else(|| "ground-truth".to_owned());
    let mode = mode(&name).ok_or("the sensors are ground-truth, object or full")?;
    let mut broken = 0;
    let mut all = Vec::new();
    println!("{samples} samples, seed {seed}, sensors: {name}");
    println!("approach       samples  engaged  promised   share  called off     kept  reached  least gain");
    for scenario in SCENARIOS {
        let path = Path::new(crate::ROOT).join(format!("scenarios/library/{scenario}.toml"));
        let seen = run_all(&ScenarioFile::load(&path, &[])?, mode, samples, seed);
        println!("{scenario}");
        for (band, samples) in bands(&seen) {
            broken += print(&format!("  {band}"), &samples);
        }
        all.extend(seen);
    }
    println!("all");
    print("", &all.iter().collect::<Vec<_>>());
    if let Some(path) = arguments.next() {
        draw(Path::new(&path), &format!("Probability of having engaged, sensors: {name}"), &all)?;
    }
    println!("{broken} promises broken");
    let passes = broken == 0 || mode != SensorMode::GroundTruth;
    Ok(if passes { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
