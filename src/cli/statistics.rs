//! `closecall statistics`: computes durations, speeds, counts and correlations of recorded lane changes.

use std::path::{Path, PathBuf};

use clap::Args;
use closecall_report::traffic::recording_charts::{BoxChart, BoxOf};
use closecall_scenarios::atomic::{WriteError, write_file};
use closecall_scenarios::criticality::{
    BoxNumbers, ClassStatistics, Correlation, CriticalLaneChange, Statistics, criticality, statistics as compute,
};
use closecall_scenarios::filters::smooth;
use closecall_scenarios::recordings::{Recording, read_with};

use super::CliError;
use super::args::{Format, ReadArgs, positive};
use super::json::stamped;
use super::output::{outln, print_written};
use super::protect::{of_trajectories, protect};
use super::trajectories::refuse_duplicates;
use crate::exit_code::ExitCode;

/// Arguments of `closecall statistics`.
#[derive(Debug, Args)]
pub(super) struct StatisticsArgs {
    /// Trajectory files, whose lane changes are counted together
    #[arg(required = true, value_name = "TRAJECTORY_FILE")]
    files: Vec<PathBuf>,
    #[command(flatten)]
    read: ReadArgs,
    /// Speed limit in m/s [default: 120 km/h]
    #[arg(long, value_name = "M/S", value_parser = positive)]
    speed_limit_mps: Option<f64>,
    /// Folder for the box plots `duration.svg` and `speed.svg`
    #[arg(long, value_name = "DIR")]
    plot: Option<PathBuf>,
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

pub(super) fn statistics(args: &StatisticsArgs) -> Result<ExitCode, CliError> {
    let charts = args.plot.as_ref().map(|folder| ["duration.svg", "speed.svg"].map(|name| folder.join(name)));
    for chart in charts.iter().flatten() {
        protect(&of_trajectories(&args.files), &[("--plot", Some(chart))])?;
    }
    let read = |path: &PathBuf| read_with(path, args.read.options());
    let recordings = args.files.iter().map(read).collect::<Result<Vec<Recording>, _>>()?;
    refuse_duplicates(&args.files, &recordings)?;
    let changes = recordings.iter().flat_map(|recording| criticality(&smooth(recording), args.speed_limit_mps));
    let found = compute(&changes.collect::<Vec<CriticalLaneChange>>());
    if let Some(folder) = &args.plot {
        plot(&found, folder)?;
    }
    match args.format {
        Format::Json => outln!("{:#}", stamped(serde_json::json!(found), None, None)),
        Format::Human => print(&found),
    }
    Ok(ExitCode::Pass)
}

fn print(found: &Statistics) {
    outln!("class       lane changes    left   right  complete  parts of doubles");
    for class in &found.classes {
        let ClassStatistics { vehicle_class, lane_changes, to_the_left, complete, double, .. } = class;
        let right = lane_changes - to_the_left;
        outln!(
            "{:<10} {lane_changes:>13} {to_the_left:>7} {right:>7} {complete:>9} {double:>17}",
            vehicle_class.name()
        );
    }
    outln!("\ncomplete ones           n    mean     low      25 %   50 %   75 %    high");
    for class in &found.classes {
        print_box(class, "duration [s]", class.duration_s.as_ref());
        print_box(class, "speed [m/s]", class.speed_mps.as_ref());
    }
    outln!("\ncorrelation over complete ones                  n   Pearson  Spearman");
    for Correlation { of, with, n, pearson, spearman } in &found.correlations {
        let number = |value: &Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.2}"));
        outln!("{of:<20} {with:<20} {n:>7} {:>9} {:>9}", number(pearson), number(spearman));
    }
}

fn print_box(class: &ClassStatistics, what: &str, numbers: Option<&BoxNumbers>) {
    let name = class.vehicle_class.name();
    let Some(BoxNumbers { n, mean, five: [low, quarter, median, three_quarters, high], .. }) = numbers else { return };
    outln!(
        "{name:<6} {what:<13} {n:>5} {mean:>7.2} {low:>7.2} {quarter:>9.2} {median:>6.2} {three_quarters:>6.2} {high:>7.2}"
    );
}

fn plot(found: &Statistics, folder: &Path) -> Result<(), CliError> {
    std::fs::create_dir_all(folder).map_err(|source| WriteError::new(folder, source))?;
    let duration: fn(&ClassStatistics) -> Option<&BoxNumbers> = |class| class.duration_s.as_ref();
    let speed: fn(&ClassStatistics) -> Option<&BoxNumbers> = |class| class.speed_mps.as_ref();
    for (name, title, y_name, value) in [
        ("duration.svg", "Duration of complete lane changes", "duration [s]", duration),
        ("speed.svg", "Speed at the crossing of complete lane changes", "speed [m/s]", speed),
    ] {
        let boxes = found.classes.iter().filter_map(|class| Some(box_of(class, value(class)?))).collect();
        let svg = BoxChart { title: title.to_owned(), y_name: y_name.to_owned(), boxes }.svg()?;
        let path = folder.join(name);
        write_file(&path, |file| file.write_all(svg.as_bytes()))?;
        print_written(&path);
    }
    Ok(())
}

fn box_of(class: &ClassStatistics, numbers: &BoxNumbers) -> BoxOf {
    let name = format!("{} (n = {})", class.vehicle_class.name(), numbers.n);
    BoxOf { name, five: numbers.five, outliers: numbers.outliers.clone() }
}
