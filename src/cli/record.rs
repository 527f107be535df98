//! `closecall traffic record`: writes simulated traffic as a trajectory file.

use std::path::{Path, PathBuf};

use clap::Args;
use closecall_campaign::arguments::sample_count;
use closecall_campaign::runner::{Sampling, concrete, run_guarded};
use closecall_recorded::trajectory_data::{ground_truth_path, write_ground_truth, write_in_car, write_trajectories};
use closecall_scenarios::sampling::Design;
use closecall_scenarios::{Scenario, ScenarioFile};
use closecall_simulation::trajectories::{EndedAtCollisions, InCarRecorder, TrafficRecorder, recorded_actor};
use closecall_simulation::{Observer, RunKey};
use closecall_traffic::words::counted;

use super::CliError;
use super::args::SimulationArgs;
use super::backend::check_backend_of;
use super::help::{examples, heading};
use super::output::{outln, print_written};
use super::progress::watched;
use super::protect::{files_of_scenario, must_be_writable, protect};
use crate::exit_code::ExitCode;

/// Arguments of `closecall traffic record`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall traffic record low-thw-overtake -o traffic.csv",
    "closecall traffic record overtake-without-brake -n 40 --controller acc --seed 1 -o traffic.csv",
    "closecall traffic record overtake-without-brake --in-car=rear -o drive.csv",
]))]
pub(super) struct RecordArgs {
    /// Scenario file, name of a scenario of the library, or `-` for standard input
    scenario: PathBuf,
    /// Number of samples; their traffic follows one after the other in the file
    #[arg(short = 'n', long = "samples", default_value_t = 20, allow_negative_numbers = true, value_parser = sample_count, help_heading = heading::SAMPLES)]
    samples: u64,
    #[command(flatten)]
    sim: SimulationArgs,
    /// Write the in-car log of one vehicle, and its true lane changes in `FILE.truth.csv`. ACTOR is
    /// the id of the vehicle [default: the first actor with an overtaking driver]
    #[arg(long, value_name = "ACTOR", num_args = 0..=1, require_equals = true, help_heading = heading::OUTPUT)]
    in_car: Option<Option<String>>,
    /// Trajectory file to write, in the plain CSV layout; with --in-car in the in-car layout
    #[arg(short, long = "out", alias = "output", value_name = "FILE.csv", help_heading = heading::OUTPUT)]
    output: PathBuf,
}

/// Ending of the file that the command writes.
const ENDING: &str = "csv";

/// Refuses an output whose ending promises another format.
fn check_ending(path: &Path) -> Result<(), CliError> {
    let is_allowed = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case(ENDING));
    let message = || format!("--out {} must end with .{ENDING}: the file is CSV", path.display());
    is_allowed.then_some(()).ok_or_else(|| CliError::usage(message()))
}

pub(super) fn record(args: &RecordArgs) -> Result<ExitCode, CliError> {
    match &args.in_car {
        None => record_traffic(args),
        Some(actor) => record_in_car(args, actor.as_deref()),
    }
}

fn record_traffic(args: &RecordArgs) -> Result<ExitCode, CliError> {
    let file = args.sim.set.load(&args.scenario)?;
    protect(&[files_of_scenario(&file), args.sim.arm.files()].concat(), &[("--out", Some(&args.output))])?;
    check_ending(&args.output)?;
    must_be_writable(Some(&args.output))?;
    let mut recorder = TrafficRecorder::default();
    each_sample(args, &file, &mut recorder, TrafficRecorder::begin)?;
    let EndedAtCollisions { data: recording, collided } = recorder.finish_at_collisions(&file.config().name);
    let (tracks, instants) =
        (recording.trajectories.len(), recording.trajectories.iter().map(|track| track.points.len()).sum::<usize>());
    write_trajectories(&recording, &args.output)?;
    outln!("{}, {}", counted(tracks, "vehicle"), counted(instants, "instant"));
    if collided > 0 {
        outln!("{} in a collision: the track ends before it", counted(collided, "vehicle"));
    }
    print_written(&args.output);
    Ok(ExitCode::Pass)
}

fn record_in_car(args: &RecordArgs, actor: Option<&str>) -> Result<ExitCode, CliError> {
    let file = args.sim.set.load(&args.scenario)?;
    let truth = ground_truth_path(&args.output);
    let outputs = [("--out", Some(args.output.as_path())), ("--in-car", Some(truth.as_path()))];
    protect(&[files_of_scenario(&file), args.sim.arm.files()].concat(), &outputs)?;
    check_ending(&args.output)?;
    must_be_writable(Some(&args.output))?;
    let chosen = recorded_actor(file.config(), actor)
        .map_err(|message| CliError::Usage { message: format!("{message}, with --in-car=ACTOR") })?;
    let mut recorder = InCarRecorder::new(&chosen);
    each_sample(args, &file, &mut recorder, InCarRecorder::begin)?;
    let (log, changes) = recorder.finish();
    write_in_car(&log, &args.output)?;
    write_ground_truth(&changes, &truth)?;
    let (rows, true_changes) = (counted(log.frames.len(), "row"), counted(changes.len(), "true lane change"));
    outln!("{rows} of the in-car log of {chosen}, {true_changes}");
    print_written(&args.output);
    print_written(&truth);
    Ok(ExitCode::Pass)
}

/// Runs the samples one after the other, observed by `recorder`.
fn each_sample<R: Observer>(
    args: &RecordArgs,
    file: &ScenarioFile,
    recorder: &mut R,
    begin: fn(&mut R, &Scenario),
) -> Result<(), CliError> {
    let sampling = Sampling { seed: args.sim.seed, design: Design::Random, samples: args.samples };
    let arm = args.sim.arm.arm(file.config().function)?;
    watched("samples", |on_progress| {
        for sample in 0..args.samples {
            on_progress([sample, args.samples]);
            let fail = |source| CliError::Sample { sample, source };
            let scenario = concrete(file, sampling, sample).map_err(fail)?;
            check_backend_of(&scenario, std::slice::from_ref(&arm))?;
            begin(recorder, &scenario);
            run_guarded(&scenario, RunKey { seed: args.sim.seed, sample }, &arm, recorder).map_err(fail)?;
        }
        Ok(())
    })
}
