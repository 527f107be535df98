//! `closecall inspect`: reports the flaws of a trajectory file.

use std::path::PathBuf;

use clap::Args;
use closecall_scenarios::recordings::{BadRows, Inspector, ReadOptions, Tracks, open};
use serde_json::{Value, json};

use super::CliError;
use super::args::{Format, ReadArgs};
use super::json::stamped;
use super::output::{outln, print_error};
use crate::exit_code::ExitCode;

/// Arguments of `closecall inspect`.
#[derive(Debug, Args)]
pub(super) struct InspectArgs {
    /// Trajectory file
    #[arg(value_name = "TRAJECTORY_FILE")]
    file: PathBuf,
    #[command(flatten)]
    read: ReadArgs,
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

/// Prints the flaws of a trajectory file. If some rows cannot be used, the exit code is that with which other commands
/// refuse the file.
pub(super) fn inspect(args: &InspectArgs) -> Result<ExitCode, CliError> {
    let mut tracks = open(&args.file, ReadOptions { bad_rows: BadRows::Drop, ..args.read.options() })?;
    let mut inspector = Inspector::default();
    while let Some(track) = tracks.next_track()? {
        inspector.add(&track);
    }
    match args.format {
        Format::Json => outln!("{:#}", stamped(report(&tracks, &inspector), None, None)),
        Format::Human => print(&tracks, &inspector),
    }
    let dropped = tracks.dropped();
    if dropped.count() == 0 || args.read.drops_bad_rows() {
        return Ok(ExitCode::Pass);
    }
    let path = tracks.path().display();
    let first = dropped.reasons().filter_map(|(_, rows)| Some((rows.first_line?, &rows.first))).min();
    let first = first.map(|(line, what)| format!(", line {line}: {what}")).unwrap_or_default();
    let count = dropped.count();
    print_error(format_args!(
        "{path}{first}\n{count} rows cannot be used: other commands refuse the file unless --drop-bad-rows is given\n"
    ));
    Ok(ExitCode::InvalidInput)
}

fn report(tracks: &Tracks<'_>, inspector: &Inspector) -> Value {
    let quality = inspector.quality();
    let span = inspector.span();
    json!({
        "name": tracks.name(),
        "layout": tracks.layout(),
        "period_s": tracks.period().s(),
        "rows": tracks.rows(),
        "tracks": quality.tracks,
        "vehicles": quality.vehicles,
        "instants": quality.instants,
        "first_s": span.map(|(first, _)| first.s()),
        "last_s": span.map(|(_, last)| last.s()),
        "flaws": inspector.flaws(),
        "overlaps_unchecked_instants": inspector.unchecked_instants(),
        "dropped": tracks.dropped(),
        "usable": tracks.dropped().count() == 0,
    })
}

fn print(tracks: &Tracks<'_>, inspector: &Inspector) {
    let quality = inspector.quality();
    outln!("{} ({})", tracks.name(), tracks.layout().name());
    outln!(
        "  {} rows; {} tracks of {} vehicles, {} instants every {:.3} s",
        tracks.rows(),
        quality.tracks,
        quality.vehicles,
        quality.instants,
        tracks.period().s()
    );
    for (name, flaw) in inspector.flaws().named() {
        match &flaw.first {
            None => outln!("  {:>8}  {name}", flaw.count),
            Some(first) => {
                let line = first.line.map(|line| format!("line {line}, ")).unwrap_or_default();
                let (track, time_s, what) = (first.track_id, first.time_s, &first.what);
                outln!("  {:>8}  {name}; first: {line}track {track} at {time_s:.2} s: {what}", flaw.count);
            }
        }
    }
    if inspector.unchecked_instants() > 0 {
        outln!(
            "  overlaps were not checked at {} instants: the other vehicles of those times were no longer in memory",
            inspector.unchecked_instants()
        );
    }
    for (reason, rows) in tracks.dropped().reasons() {
        let line = rows.first_line.map(|line| format!("line {line}: ")).unwrap_or_default();
        outln!("  {:>8}  skipped: {reason}; first: {line}{}", rows.count, rows.first);
    }
}
