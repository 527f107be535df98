//! `closecall traffic inspect`: reports the flaws of a trajectory file.

use std::path::PathBuf;

use clap::Args;
use closecall_recorded::trajectory_data::{BadRows, QualityInspector, ReadOptions, TrajectoryFileError, open};
use closecall_report::json::{self, stamped};
use closecall_report::traffic::quality::QualityText;
use closecall_traffic::words::counted;

use super::CliError;
use super::args::{Format, ReadArgs, advise};
use super::help::{examples, heading};
use super::output::{outln, print_error, print_text, reading};
use crate::exit_code::ExitCode;

/// Arguments of `closecall traffic inspect`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall traffic inspect traffic.csv",
    "closecall traffic inspect traffic.csv --drop-bad-rows",
    "closecall traffic inspect drive.csv.gz --layout in-car --format json",
]))]
pub(super) struct InspectArgs {
    /// Trajectory file
    #[arg(value_name = "TRAJECTORY_FILE")]
    file: PathBuf,
    #[command(flatten)]
    read: ReadArgs,
    /// Output format
    #[arg(long, value_enum, default_value_t, help_heading = heading::OUTPUT)]
    format: Format,
}

/// Prints the flaws of a trajectory file. If some rows cannot be used, the exit code is the code of
/// a file that other commands refuse. If the recorded lanes are in doubt, it is the code of other
/// commands on them.
pub(super) fn inspect(args: &InspectArgs) -> Result<ExitCode, CliError> {
    let mut inspector = QualityInspector::default();
    let tracks = reading(&args.file, || {
        let mut tracks = open(&args.file, ReadOptions { bad_rows: BadRows::Skip, ..args.read.options() })?;
        while let Some(track) = tracks.next_track()? {
            inspector.add(&track);
        }
        Ok::<_, TrajectoryFileError>(tracks)
    })?;
    match args.format {
        Format::Json => outln!("{:#}", stamped(json::quality(&tracks, &inspector), None, None)),
        Format::Human => print_text(QualityText { tracks: &tracks, inspector: &inspector }),
    }
    advise(tracks.doubts_lanes(), tracks.doubts_sides());
    let dropped = tracks.dropped();
    if dropped.count() == 0 || args.read.drop_bad_rows {
        return Ok(if tracks.doubts_lanes() { ExitCode::Inconclusive } else { ExitCode::Pass });
    }
    let path = tracks.path().display();
    let first = dropped.reasons().filter_map(|(_, rows)| Some((rows.first_line?, &rows.first))).min();
    let first = first.map(|(line, message)| format!(", line {line}: {message}")).unwrap_or_default();
    let unusable = counted(dropped.count(), "row");
    print_error(format_args!(
        "{path}{first}\n{unusable} cannot be used: other commands refuse the file unless --drop-bad-rows is given\n"
    ));
    Ok(ExitCode::InvalidInput)
}
