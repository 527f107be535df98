//! `closecall list`: the scenario library, which is part of the program.

use clap::Args;
use closecall_report::json::stamped;
use closecall_scenarios::library::entries;
use closecall_scenarios::member;
use serde_json::json;

use super::CliError;
use super::args::Format;
use super::help::{examples, heading};
use super::output::outln;
use crate::exit_code::ExitCode;

/// Arguments of `closecall list`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall list",
    "closecall list --format json",
    "closecall list --format json > library.json",
]))]
pub(super) struct ListArgs {
    /// Output format
    #[arg(long, value_enum, default_value_t, help_heading = heading::OUTPUT)]
    format: Format,
}

pub(super) fn list(args: &ListArgs) -> Result<ExitCode, CliError> {
    let (listed, members) = (entries()?, member::entries()?);
    match args.format {
        Format::Json => outln!("{:#}", stamped(json!({ "scenarios": listed, "members": members }), None, None)),
        Format::Human => {
            listed.iter().for_each(|scenario| outln!("{scenario}"));
            outln!("Members of the driver ensemble (`closecall campaign SCENARIO --ensemble NAME`):");
            members.iter().for_each(|member| outln!("{member}"));
            outln!("\nA command takes such a name in place of a file: `closecall run {}`.", listed[0].name);
            outln!("`closecall new NAME --from LIBRARY_NAME` writes a copy to start from.");
        }
    }
    Ok(ExitCode::Pass)
}
