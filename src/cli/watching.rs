//! `closecall check --watch`: checks a scenario file at every change, and runs a few samples of it.

use std::path::Path;
use std::time::{Duration, SystemTime};

use clap::Args;
use closecall_campaign::arguments::count;
use closecall_campaign::runner::{Sampling, concrete, run_guarded};
use closecall_report::run::text::outcome_line;
use closecall_scenarios::sampling::Design;
use closecall_scenarios::source::existing;
use closecall_simulation::{NoObserver, RunKey};
use closecall_traffic::words::counted;

use super::CliError;
use super::args::{FittedArgs, SetArgs};
use super::arms::{ArmArgs, ComparisonArgs};
use super::help::heading;
use super::output::{outln, print_error, print_failure, textln};
use crate::exit_code::ExitCode;

/// Time between two looks at the file.
const POLL_INTERVAL: Duration = Duration::from_millis(250);

/// How a file is watched. A check without `--watch` refuses the other options.
#[derive(Debug, Args)]
pub(super) struct WatchingArgs {
    /// Check the file at every change, and run a few samples of it
    #[arg(long, conflicts_with = "format", help_heading = heading::WATCH)]
    pub(super) watch: bool,
    /// Number of samples to run at every change
    #[arg(
        short = 'n',
        long = "samples",
        default_value = "5",
        allow_negative_numbers = true,
        value_parser = count,
        help_heading = heading::WATCH
    )]
    samples: u64,
    /// End after this many rounds [default: go on until Ctrl-C]
    #[arg(long, value_name = "N", value_parser = count, help_heading = heading::WATCH)]
    rounds: Option<u64>,
    /// Seed of the random numbers
    #[arg(long, default_value_t = 0, value_parser = closecall_campaign::arguments::seed, help_heading = heading::WATCH)]
    seed: u64,
    #[command(flatten)]
    arm: ArmArgs,
    #[command(flatten)]
    comparison: ComparisonArgs,
}

/// Checks a scenario file, with these changes, now and at every change, and runs its first samples.
pub(super) fn watch(
    scenario: &Path,
    changes: (&SetArgs, &FittedArgs),
    args: &WatchingArgs,
) -> Result<ExitCode, CliError> {
    let Some(path) = existing(scenario).filter(|path| path.is_file()) else {
        let message = match scenario.is_dir() {
            true => format!("{} is a folder: --watch is for one scenario file", scenario.display()),
            false => format!("there is no file {}: `closecall new NAME` writes one", scenario.display()),
        };
        return Err(CliError::Usage { message });
    };
    let mut last_state = None;
    let mut rounds = 0;
    let mut code = ExitCode::Pass;
    while args.rounds.is_none_or(|last| rounds < last) {
        let state = state(&path);
        if last_state == Some(state) {
            std::thread::sleep(POLL_INTERVAL);
            continue;
        }
        last_state = Some(state);
        rounds += 1;
        code = ExitCode::Pass;
        // An editor may replace the file by another one: for a moment there is none.
        if state.is_none() {
            print_error(format_args!("{} is missing\n", path.display()));
            continue;
        }
        if let Err(error) = round(&path, changes, args) {
            code = ExitCode::from(&error);
            print_failure(error);
        }
        if args.rounds.is_none_or(|last| rounds < last) {
            outln!("watching {} (Ctrl-C ends)\n", path.display());
        }
    }
    Ok(code)
}

/// Returns the time of the last change and the length of the file; `None` if it does not exist.
fn state(path: &Path) -> Option<(SystemTime, u64)> {
    let metadata = std::fs::metadata(path).ok()?;
    Some((metadata.modified().ok()?, metadata.len()))
}

/// Checks the file, and runs its first samples.
fn round(path: &Path, (set, fitted): (&SetArgs, &FittedArgs), args: &WatchingArgs) -> Result<(), CliError> {
    let (set, of_arms) = set.by_arm();
    let file = fitted.load(path, &set)?;
    let (name, parameters) = (&file.config().name, file.space().iter().len());
    textln!("{}: valid, {name} with {}", path.display(), counted(parameters, "parameter"));
    let sampling = Sampling { seed: args.seed, design: Design::Random, samples: args.samples };
    let arms = args.comparison.arms(&args.arm, &file, &of_arms)?;
    for sample in 0..args.samples {
        let fail = |source| CliError::Sample { sample, source };
        let scenario = concrete(&file, sampling, sample).map_err(fail)?;
        for arm in &arms {
            let key = RunKey { seed: args.seed, sample };
            let outcome = run_guarded(&scenario, key, arm, &mut NoObserver).map_err(fail)?;
            textln!("  {}", outcome_line(&outcome));
        }
    }
    Ok(())
}
