//! `closecall check`: checks scenario files without running them.

use std::path::{Path, PathBuf};

use clap::Args;
use closecall_simulation::scenario::{ScenarioError, ScenarioFile};
use serde_json::{Value, json};

use super::CliError;
use super::args::{Format, SetArgs};
use super::json::stamped;
use super::output::{outln, print_error};
use super::source::expand;
use crate::exit_code::ExitCode;

/// Arguments of `closecall check`.
#[derive(Debug, Args)]
pub(super) struct CheckArgs {
    /// Scenario files, folders of them, names of scenarios of the library, or `-` for standard input
    #[arg(required = true)]
    scenarios: Vec<PathBuf>,
    #[command(flatten)]
    set: SetArgs,
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

pub(super) fn check(args: &CheckArgs) -> Result<ExitCode, CliError> {
    let checked: Vec<_> = expand(&args.scenarios)?.into_iter().map(|path| (args.set.load(&path), path)).collect();
    let codes: Vec<ExitCode> =
        checked.iter().filter_map(|(file, _)| Some(ExitCode::from(file.as_ref().err()?))).collect();
    match args.format {
        Format::Json => {
            let scenarios: Vec<Value> = checked.iter().map(|(file, path)| to_json(file, path)).collect();
            let object = json!({ "valid": codes.is_empty(), "scenarios": scenarios });
            outln!("{:#}", stamped(object, None, Some(&args.set.settings)));
        }
        Format::Human => checked.into_iter().for_each(|(file, path)| print(file, &path)),
    }
    Ok(ExitCode::first_of(codes))
}

fn print(file: Result<ScenarioFile, ScenarioError>, path: &Path) {
    match file {
        Ok(file) => {
            let count = file.space().iter().len();
            outln!("{}: valid, {} with {count} parameters", path.display(), file.config().name);
        }
        Err(error) => print_error(format_args!("{:?}\n", miette::Report::new(CliError::from(error)))),
    }
}

fn to_json(file: &Result<ScenarioFile, ScenarioError>, path: &Path) -> Value {
    match file {
        Ok(file) => json!({
            "path": path,
            "valid": true,
            "name": file.config().name,
            "requirements": file.config().requirements,
            "parameters": file.config().parameters.0.keys().map(ToString::to_string).collect::<Vec<_>>(),
            "unused_parameters": file.unused_parameters().iter().map(ToString::to_string).collect::<Vec<_>>(),
        }),
        Err(error) => json!({
            "path": path,
            "valid": false,
            "line": error.line(),
            "message": error.to_string(),
        }),
    }
}
