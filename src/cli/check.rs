//! `closecall check` and `closecall schema`: check and describe scenario files without running them.

use std::path::PathBuf;

use clap::Args;
use closecall_simulation::scenario::ScenarioConfig;

use super::CliError;
use super::args::SetArgs;
use super::output::{outln, print_error};
use crate::exit_code::ExitCode;

/// Arguments of `closecall check`.
#[derive(Debug, Args)]
pub(super) struct CheckArgs {
    /// Scenario files
    #[arg(required = true)]
    scenarios: Vec<PathBuf>,
    #[command(flatten)]
    set: SetArgs,
}

pub(super) fn check(args: &CheckArgs) -> Result<ExitCode, CliError> {
    let mut codes = Vec::new();
    for path in &args.scenarios {
        match args.set.load(path) {
            Ok(file) => {
                let count = file.space().iter().len();
                outln!("{}: valid, {} with {count} parameters", path.display(), file.config().name);
            }
            Err(error) => {
                codes.push(ExitCode::from(&error));
                print_error(format_args!("{:?}\n", miette::Report::new(CliError::from(error))));
            }
        }
    }
    Ok(ExitCode::first_of(codes))
}

pub(super) fn schema() -> Result<ExitCode, CliError> {
    let schema = schemars::schema_for!(ScenarioConfig);
    outln!("{:#}", schema.as_value());
    Ok(ExitCode::Pass)
}
