//! `closecall record`: our own simulated traffic as a recording.

use std::path::PathBuf;

use clap::Args;
use closecall_scenarios::recordings::write_recording;
use closecall_scenarios::sampling::Design;

use super::CliError;
use super::args::{ArmArgs, SetArgs};
use super::output::outln;
use crate::campaign::runner::{Sampling, concrete, run_guarded};
use crate::exit_code::ExitCode;
use crate::report::traffic::TrafficRecorder;
use crate::simulation::RunKey;

/// Arguments of `closecall record`.
#[derive(Debug, Args)]
pub(super) struct RecordArgs {
    /// Scenario file
    scenario: PathBuf,
    /// Number of samples, recorded one after the other
    #[arg(short = 'n', long = "samples", default_value_t = 20, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    samples: u64,
    /// Seed of the random numbers
    #[arg(long, default_value_t = 0)]
    seed: u64,
    #[command(flatten)]
    arm: ArmArgs,
    #[command(flatten)]
    set: SetArgs,
    /// File to write, in the plain CSV layout
    #[arg(short, long, value_name = "FILE.csv")]
    output: PathBuf,
}

pub(super) fn record(args: &RecordArgs) -> Result<ExitCode, CliError> {
    let file = args.set.load(&args.scenario)?;
    let sampling = Sampling { seed: args.seed, design: Design::Random, samples: args.samples };
    let mut recorder = TrafficRecorder::default();
    for sample in 0..args.samples {
        let fail = |source| CliError::Sample { sample, source };
        let scenario = concrete(&file, sampling, sample).map_err(fail)?;
        recorder.begin(&scenario);
        run_guarded(&scenario, RunKey { seed: args.seed, sample }, &args.arm.arm(), &mut recorder).map_err(fail)?;
    }
    let recording = recorder.finish(&file.config().name);
    let (tracks, instants) =
        (recording.trajectories.len(), recording.trajectories.iter().map(|track| track.points.len()).sum::<usize>());
    write_recording(&recording, &args.output)?;
    outln!("{tracks} vehicles, {instants} instants written to {}", args.output.display());
    Ok(ExitCode::Pass)
}
