//! `closecall robustness`: studies how much noise and offset each criterion for lane changes tolerates.

use std::path::{Path, PathBuf};

use clap::Args;
use closecall_report::json::{self, stamped};
use closecall_report::traffic::robustness::{ROBUSTNESS_CHARTS, RobustnessText, robustness_charts};
use closecall_scenarios::robustness::{CriterionCounts, Measured, Robustness, Setup, Study};
use closecall_scenarios::trajectory_data::open;
use rayon::prelude::*;

use super::CliError;
use super::args::{Format, ReadArgs};
use super::output::{out, outln, print_error, write_charts};
use super::protect::{of_trajectories, protect};
use crate::exit_code::ExitCode;

/// Arguments of `closecall robustness`.
#[derive(Debug, Args)]
pub(super) struct RobustnessArgs {
    /// Trajectory files, studied together: either in-car logs or recorded traffic
    #[arg(required = true, value_name = "TRAJECTORY_FILE")]
    files: Vec<PathBuf>,
    #[command(flatten)]
    read: ReadArgs,
    /// Seed of the noise
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Number of draws of the noise at each level
    #[arg(long, default_value_t = Setup::default().repetitions, value_parser = clap::value_parser!(u64).range(1..=10_000))]
    repetitions: u64,
    /// Folder for the charts `noise.svg` and `offset.svg`
    #[arg(long, value_name = "DIR")]
    plot: Option<PathBuf>,
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

pub(super) fn robustness(args: &RobustnessArgs) -> Result<ExitCode, CliError> {
    let charts = args.plot.as_ref().map(|folder| ROBUSTNESS_CHARTS.map(|name| folder.join(name)));
    for chart in charts.iter().flatten() {
        protect(&of_trajectories(&args.files), &[("--plot", Some(chart))])?;
    }
    let setup = Setup { seed: args.seed, repetitions: args.repetitions, ..Setup::default() };
    let mut studies = Vec::new();
    for path in &args.files {
        studies.push(study_of(path, &args.read)?);
    }
    let mut found: Option<Robustness> = None;
    for study in &studies {
        let cases = Study::cases(&setup);
        // The results are in the order of the cases for any number of threads.
        let results: Vec<Vec<CriterionCounts>> = cases.par_iter().map(|case| study.run(case)).collect();
        let one = study.robustness(&setup, &results);
        if let Some(all) = &mut found {
            if !all.add(&one) {
                let message = "in-car logs and recorded traffic have different references: study them separately";
                return Err(CliError::Usage { message: message.to_owned() });
            }
        } else {
            found = Some(one);
        }
    }
    let Some(found) = found else { return Ok(ExitCode::Pass) };
    if let (Some(folder), Some(paths)) = (&args.plot, &charts) {
        write_charts(folder, paths, &robustness_charts(&found)?)?;
    }
    match args.format {
        Format::Json => outln!("{:#}", stamped(json::robustness(&found), None, None)),
        Format::Human => out!("{}", RobustnessText(&found)),
    }
    if found.reference == 0 {
        print_error(format_args!("there is no lane change in the trajectory files: nothing was studied\n"));
        return Ok(ExitCode::Inconclusive);
    }
    Ok(ExitCode::Pass)
}

fn study_of(path: &Path, read: &ReadArgs) -> Result<Study, CliError> {
    let mut tracks = open(path, read.options())?;
    let mut measured: Vec<Measured> = Vec::new();
    while let Some(track) = tracks.next_track()? {
        measured.push((track.trajectory, track.markings));
    }
    measured.sort_by_key(|(track, _)| track.track_id);
    Ok(Study::new(measured, tracks.markings()))
}
