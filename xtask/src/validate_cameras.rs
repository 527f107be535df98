//! Compares the two pipelines of the rear camera, the crop classifier and the Mask R-CNN, on the
//! same samples.
//!
//!     cargo run --release -p closecall-xtask -- validate-cameras --onnxruntime PATH -n 200
//!
//! Prints for each scenario and pipeline the collisions, the engagements, the distance at which the
//! rear vehicle is classified, and the processor time, and lists every sample whose verdict differs
//! with its reason. In `empty-wet-road` there is no rear vehicle: each engagement is wrong. 200
//! samples of `low-thw-overtake` take a quarter of an hour of processor time.
#![expect(clippy::print_stdout, reason = "a validation prints its result")]

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use closecall::scenarios::source;
use closecall_campaign::runner::{Sampling, concrete};
use closecall_scenarios::sampling::Design;
use closecall_scenarios::{ScenarioFile, Setting};
use closecall_sensors::camera::Backend;
use closecall_sensors::{SensorMode, set_inference_backend};
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::{Arm, Observer, RunEvent, RunKey, StepView, simulate};
use closecall_studies::perception::agreement::{Verdict, reason};
use closecall_traffic::{Source, Time, Track, TrackStatus};
use rayon::prelude::*;

/// The pipelines: the word in a scenario file, and the name in a sentence.
const PIPELINES: [(&str, &str); 2] = [("crop-classifier", "the crop classifier"), ("mask-rcnn", "the Mask R-CNN")];
/// Probability of existence from which a function counts on a track.
const LIKELY: f64 = 0.5;

/// Compares the pipelines of the rear camera.
/// What the command line says.
#[derive(clap::Parser)]
pub(crate) struct Args {
    /// The scenarios: names of the library, or files
    #[arg(default_values = ["low-thw-overtake", "empty-wet-road"])]
    scenarios: Vec<String>,
    /// Number of samples of each
    #[arg(short = 'n', long, default_value_t = 200)]
    samples: u64,
    /// The seed
    #[arg(long, default_value_t = 1001)]
    seed: u64,
    /// Shared library of ONNX Runtime
    #[arg(long, env = "CLOSECALL_ONNXRUNTIME")]
    onnxruntime: PathBuf,
}

/// What one run showed.
struct Run {
    verdict: Verdict,
    /// Distance from the ego's middle back to the front of the rear vehicle when a track of it is
    /// first confirmed and classified (m).
    classified_m: Option<f64>,
    simulated_s: f64,
    /// Processor time of the thread (s).
    processor_s: f64,
}

/// Notes when the first track of a vehicle behind is confirmed and classified.
#[derive(Default)]
struct First {
    classified_m: Option<f64>,
}

impl Observer for First {
    fn step(&mut self, view: &StepView<'_>) {
        if self.classified_m.is_some() {
            return;
        }
        let is_vehicle = |track: &&Track| {
            track.source == Source::Rear
                && track.status != TrackStatus::Tentative
                && track.existence >= LIKELY
                && track.class.is_vehicle()
        };
        let nearest = view.tracks.iter().filter(is_vehicle).map(|track| -track.x_m() - 0.5 * track.length_m);
        self.classified_m = nearest.min_by(f64::total_cmp);
    }

    fn event(&mut self, _: Time, _: &RunEvent) {}
}

/// Returns the processor time of this thread (s), or NaN where the system does not tell it.
fn thread_s() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let nanoseconds = text.split_whitespace().next().and_then(|word| word.parse::<f64>().ok());
    nanoseconds.map_or(f64::NAN, |ns| ns * 1e-9)
}

fn run(file: &ScenarioFile, sampling: Sampling, sample: u64) -> Result<Run, String> {
    let failed = |error: &dyn std::fmt::Display| format!("sample {sample}: {error}");
    let scenario = concrete(file, sampling, sample).map_err(|error| failed(&error))?;
    let arm = Arm { controller: BuiltIn::Mis.factory(), sensors: Some(SensorMode::Full) };
    let (mut first, before_s) = (First::default(), thread_s());
    let key = RunKey { seed: sampling.seed, sample };
    let outcome = simulate(&scenario, key, &arm, &mut first).map_err(|error| failed(&error))?;
    let processor_s = thread_s() - before_s;
    let simulated_s = outcome.duration.s();
    Ok(Run { verdict: Verdict::of(&outcome), classified_m: first.classified_m, simulated_s, processor_s })
}

/// Returns the mean of some values, or NaN if there are none.
fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (count, sum) = values.fold((0.0, 0.0), |(count, sum), value| (count + 1.0, sum + value));
    sum / count
}

fn print_row(name: &str, runs: &[Run]) {
    let count = |holds: fn(&Run) -> bool| runs.iter().filter(|run| holds(run)).count();
    let total = |value: fn(&Run) -> f64| runs.iter().map(value).sum::<f64>();
    let classified_m: Vec<f64> = runs.iter().filter_map(|run| run.classified_m).collect();
    let mean_m =
        if classified_m.is_empty() { "-".to_owned() } else { format!("{:.1}", mean(classified_m.iter().copied())) };
    println!(
        "  {name}: {} collisions, engaged in {}, classified in {} at {mean_m} m on average, {:.2} s of processor time per sample, \
         {:.0} simulated seconds per second",
        count(|run| run.verdict.has_collided),
        count(|run| run.verdict.engaged_at_s.is_some()),
        classified_m.len(),
        total(|run| run.processor_s) / runs.len() as f64,
        total(|run| run.simulated_s) / total(|run| run.processor_s),
    );
}

pub(crate) fn main(args: Args) -> Result<ExitCode, Box<dyn Error>> {
    set_inference_backend(Backend::OnnxRuntime(args.onnxruntime.clone()));
    for name in &args.scenarios {
        println!("{name}, {} samples, seed {}, mode full, with the system", args.samples, args.seed);
        let sampling = Sampling { seed: args.seed, design: Design::Random, samples: args.samples };
        let mut both = Vec::new();
        for (word, called) in PIPELINES {
            let setting: Setting = format!("sensors.rear-camera.pipeline={word}").parse()?;
            let file = source::load(Path::new(name), &[setting])?;
            let runs: Result<Vec<Run>, String> =
                (0..args.samples).into_par_iter().map(|sample| run(&file, sampling, sample)).collect();
            both.push(runs?);
            print_row(called, &both[both.len() - 1]);
        }
        let names = PIPELINES.map(|(_, called)| called);
        let mut differing = 0;
        for (sample, (crop, whole)) in both[0].iter().zip(&both[1]).enumerate() {
            let (crop, whole) = (&crop.verdict, &whole.verdict);
            let engagement_differs = crop.engaged_at_s.is_some() != whole.engaged_at_s.is_some();
            if crop.has_collided != whole.has_collided || engagement_differs {
                differing += 1;
                let only = match (crop.has_collided, whole.has_collided) {
                    (true, false) => format!("collides only with {}", names[0]),
                    (false, true) => format!("collides only with {}", names[1]),
                    _ => "the same collision".to_owned(),
                };
                println!("  sample {sample}: {only}; {}", reason([crop, whole], names));
            }
        }
        println!("  {differing} samples differ in the collision or in whether the system engages");
    }
    Ok(ExitCode::SUCCESS)
}
