//! `closecall traffic robustness`: studies how much noise and offset each criterion for lane
//! changes tolerates.

use std::path::PathBuf;

use clap::Args;
use closecall_campaign::arguments::whole;
use closecall_campaign::robustness::{RobustnessError, StudiedFiles, robustness as study};
use closecall_recorded::robustness::{FEWEST_LANE_CHANGES, Setup};
use closecall_report::json::{self, stamped};
use closecall_report::traffic::robustness::{ROBUSTNESS_CHARTS, RobustnessText, robustness_charts};
use closecall_traffic::words::counted;

use super::CliError;
use super::args::{FilesArgs, Format};
use super::help::{examples, heading};
use super::output::{during, outln, print_error, print_text, write_charts};
use super::protect::{files_of_trajectories, must_be_folder, protect};
use crate::exit_code::ExitCode;

/// Arguments of `closecall traffic robustness`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall traffic robustness traffic.csv",
    "closecall traffic robustness one.csv two.csv --plot charts",
    "closecall traffic robustness traffic.csv --repetitions 5 --seed 1",
]))]
pub(super) struct RobustnessArgs {
    #[command(flatten)]
    data: FilesArgs,
    /// Seed of the noise
    #[arg(long, default_value_t = 0, value_parser = closecall_campaign::arguments::seed, help_heading = heading::METHOD)]
    seed: u64,
    /// Number of draws of the noise at each level
    #[arg(long, default_value_t = Setup::default().repetitions, value_parser = whole::<u64, 1, 10_000>, help_heading = heading::METHOD)]
    repetitions: u64,
    /// Folder for the charts `noise.svg` and `offset.svg`
    #[arg(long, value_name = "DIR", help_heading = heading::OUTPUT)]
    plot: Option<PathBuf>,
    /// Output format
    #[arg(long, value_enum, default_value_t, help_heading = heading::OUTPUT)]
    format: Format,
}

pub(super) fn robustness(args: &RobustnessArgs) -> Result<ExitCode, CliError> {
    let charts = args.plot.as_ref().map(|folder| ROBUSTNESS_CHARTS.map(|name| folder.join(name)));
    for chart in charts.iter().flatten() {
        protect(&files_of_trajectories(&args.data.files), &[("--plot", Some(chart))])?;
    }
    must_be_folder(args.plot.as_deref())?;
    let setup = Setup { seed: args.seed, repetitions: args.repetitions, ..Setup::default() };
    let studied = during("studying the robustness".to_owned(), || {
        study(&args.data.files, args.data.read.options(), &setup, |path, warning| {
            print_error(format_args!("warning: {}: {warning}\n", path.display()));
        })
    });
    let studied = studied.map_err(refused)?;
    let Some(StudiedFiles { all: study, is_in_doubt, .. }) = studied else { return Ok(ExitCode::Pass) };
    if let (Some(folder), Some(paths)) = (&args.plot, &charts) {
        write_charts(folder, paths, &robustness_charts(&study)?)?;
    }
    match args.format {
        Format::Json => outln!("{:#}", stamped(json::robustness(&study), None, None)),
        Format::Human => print_text(RobustnessText(&study)),
    }
    if study.reference == 0 {
        print_error(format_args!("there is no lane change in the trajectory files: nothing was studied\n"));
        return Ok(ExitCode::Inconclusive);
    }
    if study.reference < FEWEST_LANE_CHANGES {
        print_error(format_args!(
            "the trajectory files have {}, and the study needs {FEWEST_LANE_CHANGES}: with fewer, the loss of a single one is \
             more than the share at which a criterion fails, so that no level can be told\n",
            counted(study.reference, "lane change")
        ));
        return Ok(ExitCode::Inconclusive);
    }
    Ok(if is_in_doubt { ExitCode::Inconclusive } else { ExitCode::Pass })
}

/// Returns the error of a study that is not possible.
pub(super) fn refused(error: RobustnessError) -> CliError {
    match error {
        RobustnessError::TrajectoryData(source) => CliError::TrajectoryData(source),
        RobustnessError::Mixed | RobustnessError::SameContent { .. } => CliError::Usage { message: error.to_string() },
    }
}
