//! `closecall study sensors`: a study of perception without a controller.

use std::path::PathBuf;

use clap::Args;
use closecall_campaign::arguments::count;
use closecall_report::perception::Studies;
use closecall_studies::perception::{Extent, Study};

use super::CliError;
use super::args::{Format, SensorsChoice, SetArgs};
use super::backend::{check_backend, check_camera};
use super::help::{examples, heading};
use super::output::{outln, print_text, print_written};
use super::progress::watched;
use super::protect::must_be_folder;
use crate::exit_code::ExitCode;

/// Arguments of `closecall study sensors`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall study sensors --quick",
    "closecall study sensors late-braking.toml --out sensors",
    "closecall study sensors low-thw-overtake --compare own-sensors.toml -n 40",
]))]
pub(super) struct SensorsArgs {
    /// Scenario file, or name of a scenario of the library, whose sensors are studied, at the
    /// nominal values of its parameters
    #[arg(default_value = "low-thw-overtake")]
    scenario: PathBuf,
    /// Study the sensors of another scenario, too, and show both side by side
    #[arg(long, value_name = "SCENARIO", help_heading = heading::SCENARIO)]
    compare: Option<PathBuf>,
    /// Depth of the sensor simulation [default: full]
    #[arg(long, value_enum, help_heading = heading::CONTROLLER)]
    sensors: Option<SensorsChoice>,
    /// Few approaches: a first look within a minute
    #[arg(long, conflicts_with = "approaches", help_heading = heading::SAMPLES)]
    quick: bool,
    /// Number of approaches of each case [default: 120; with --quick: 8]
    #[arg(short = 'n', long, value_name = "N", value_parser = count, help_heading = heading::SAMPLES)]
    approaches: Option<u64>,
    /// Seed of the random numbers
    #[arg(long, default_value_t = 0, value_parser = closecall_campaign::arguments::seed, help_heading = heading::SAMPLES)]
    seed: u64,
    /// Folder for the page (sensors.html), the figures (JSON, Parquet) and the curves (Parquet)
    #[arg(short, long, value_name = "DIR", help_heading = heading::OUTPUT)]
    out: Option<PathBuf>,
    #[command(flatten)]
    set: SetArgs,
    /// Output format
    #[arg(long, value_enum, default_value_t, help_heading = heading::OUTPUT)]
    format: Format,
}

pub(super) fn sensors(args: &SensorsArgs) -> Result<ExitCode, CliError> {
    must_be_folder(args.out.as_deref())?;
    let choice = args.sensors.unwrap_or(SensorsChoice::Full);
    check_backend(choice == SensorsChoice::Full)?;
    let extent = args.approaches.map_or(if args.quick { Extent::Quick } else { Extent::Full }, Extent::Runs);
    let study = |path: &PathBuf| -> Result<Study, CliError> {
        let file = args.set.load(path)?;
        // A nominal sample that cannot be built is an error of the study.
        if choice == SensorsChoice::Full
            && let Ok(nominal) = file.concrete(&file.space().nominal())
        {
            nominal.sensors.rear_cameras().try_for_each(check_camera)?;
        }
        let of_file = |on_progress: &(dyn Fn([u64; 2]) + Sync)| {
            Study::watched(&file, Some(choice.mode()), args.seed, extent, on_progress)
        };
        Ok(watched("approaches", of_file)?)
    };
    let studies: Result<Vec<Study>, CliError> =
        [Some(&args.scenario), args.compare.as_ref()].into_iter().flatten().map(study).collect();
    let studies = Studies(studies?);
    match args.format {
        Format::Json => outln!("{:#}", studies.json()),
        Format::Human => print_text(&studies),
    }
    if let Some(out) = &args.out {
        studies.write(out)?.iter().for_each(|path| print_written(path));
    }
    Ok(ExitCode::Pass)
}
