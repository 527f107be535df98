//! `closecall traffic statistics`: computes durations, speeds, counts and correlations of recorded
//! lane changes.

use std::path::PathBuf;

use clap::Args;
use closecall_campaign::arguments::positive;
use closecall_recorded::criticality::{CriticalLaneChange, Judgement, criticality, statistics as compute};
use closecall_recorded::filters::SmoothedFile;
use closecall_report::json::stamped;
use closecall_report::traffic::statistics::{RecordedChanges, STATISTICS_CHARTS, StatisticsText, statistics_charts};

use super::CliError;
use super::args::{FilesArgs, Format, smooth_noting, warn_without_lane_changes};
use super::help::{examples, heading};
use super::output::{outln, print_text, write_charts};
use super::protect::{files_of_trajectories, must_be_folder, protect};
use crate::exit_code::ExitCode;

/// Arguments of `closecall traffic statistics`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall traffic statistics traffic.csv",
    "closecall traffic statistics one.csv two.csv --plot box-plots",
    "closecall traffic statistics traffic.csv --speed-limit-mps 27.8 --format json",
]))]
pub(super) struct StatisticsArgs {
    #[command(flatten)]
    data: FilesArgs,
    /// Speed limit in m/s [default: 120 km/h]
    #[arg(long, value_name = "M/S", value_parser = positive, help_heading = heading::METHOD)]
    speed_limit_mps: Option<f64>,
    /// Folder for the box plots `duration.svg`, `width.svg` and `speed.svg`
    #[arg(long, value_name = "DIR", help_heading = heading::OUTPUT)]
    plot: Option<PathBuf>,
    /// Output format
    #[arg(long, value_enum, default_value_t, help_heading = heading::OUTPUT)]
    format: Format,
}

pub(super) fn statistics(args: &StatisticsArgs) -> Result<ExitCode, CliError> {
    let charts = args.plot.as_ref().map(|folder| STATISTICS_CHARTS.map(|name| folder.join(name)));
    for chart in charts.iter().flatten() {
        protect(&files_of_trajectories(&args.data.files), &[("--plot", Some(chart))])?;
    }
    must_be_folder(args.plot.as_deref())?;
    let files = smooth_noting(&args.data)?;
    let is_in_doubt = files.iter().any(|file| file.is_in_doubt);
    let judgement = Judgement { speed_limit_mps: args.speed_limit_mps, ..Judgement::default() };
    let changes =
        |file: SmoothedFile| RecordedChanges { changes: criticality(&file.data, &judgement), name: file.data.name };
    let recordings: Vec<RecordedChanges> = files.into_iter().map(changes).collect();
    let statistics = compute(
        &recordings.iter().flat_map(|recording| recording.changes.clone()).collect::<Vec<CriticalLaneChange>>(),
    );
    let lane_changes = recordings.iter().map(|recording| recording.changes.len()).sum();
    let is_in_doubt = is_in_doubt || warn_without_lane_changes(&args.data.files, lane_changes);
    if let (Some(folder), Some(paths)) = (&args.plot, &charts) {
        write_charts(folder, paths, &statistics_charts(&recordings)?)?;
    }
    match args.format {
        Format::Json => outln!("{:#}", stamped(serde_json::json!(statistics), None, None)),
        Format::Human => print_text(StatisticsText(&statistics)),
    }
    Ok(if is_in_doubt { ExitCode::Inconclusive } else { ExitCode::Pass })
}
