//! `closecall tool import`: makes a scenario file of a scenario of another tool.

use std::path::PathBuf;

use clap::Args;
use closecall_scenarios::openscenario::{ImportOptions, import};
use closecall_traffic::atomic::write_file;

use super::CliError;
use super::help::{examples, heading};
use super::new::scenario_file;
use super::output::{command_line, print_written, textln};
use super::protect::protect;
use crate::exit_code::ExitCode;

/// Arguments of `closecall tool import`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall tool import case.xosc -o scenario.toml",
    "closecall tool import cut-in.xosc --ego car_white --parameter EgoSpeed=120 -o scenario.toml",
    "closecall tool import values.xosc --value-set 3 -o scenario.toml",
]))]
pub(super) struct ImportArgs {
    /// Scenario of OpenSCENARIO XML 1.0 to 1.3; its road and its catalogues are found relative to
    /// it
    #[arg(value_name = "FILE.xosc")]
    file: PathBuf,
    /// Scenario file to write
    #[arg(short, long = "out", alias = "output", value_name = "FILE.toml", value_parser = scenario_file, help_heading = heading::OUTPUT)]
    output: PathBuf,
    /// Vehicle that the controller under test drives [default: `Ego`, or the only one with a
    /// controller]
    #[arg(long, value_name = "NAME", help_heading = heading::SCENARIO)]
    ego: Option<String>,
    /// Value of a parameter of the file, instead of its default; can be given more than once
    #[arg(long = "parameter", value_name = "NAME=VALUE", value_parser = parameter, help_heading = heading::SCENARIO)]
    parameters: Vec<(String, String)>,
    /// Number of the value set or of the draw to use, from 1, if the file holds values or
    /// distributions of the parameters of a scenario
    #[arg(long, value_name = "N", help_heading = heading::SCENARIO)]
    value_set: Option<u64>,
}

fn parameter(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.is_empty() => Ok((name.to_owned(), value.to_owned())),
        _ => Err("it must be `NAME=VALUE`".to_owned()),
    }
}

pub(super) fn import_file(args: &ImportArgs) -> Result<ExitCode, CliError> {
    protect(std::slice::from_ref(&args.file), &[("--out", Some(&args.output))])?;
    for (index, (name, value)) in args.parameters.iter().enumerate() {
        let is_other = |(earlier, other): &&(String, String)| earlier == name && other != value;
        if let Some((_, other)) = args.parameters[..index].iter().find(is_other) {
            return Err(CliError::usage(format!(
                "--parameter {name}={other} and --parameter {name}={value} contradict each other: give one of them"
            )));
        }
    }
    let options =
        ImportOptions { ego: args.ego.clone(), parameters: args.parameters.clone(), value_set: args.value_set };
    let imported = import(&args.file, &options)?;
    write_file(&args.output, |file| write!(file, "# Made by `{}`\n{}", command_line(), imported.text))?;
    print_written(&args.output);
    if !imported.notes.is_empty() {
        textln!("said in another way than in {}:", args.file.display());
        imported.notes.iter().for_each(|note| textln!("  {note}"));
    }
    if !imported.events.is_empty() {
        textln!("events, if the ego keeps the speed of the file:");
        imported.events.iter().for_each(|(time_s, event)| textln!("  {time_s:7.2} s  {event}"));
    }
    Ok(ExitCode::Pass)
}
