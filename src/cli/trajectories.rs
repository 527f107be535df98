//! `closecall lane-changes`, `criticality` and `fit`: from trajectory files to distributions.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use closecall_scenarios::atomic::WriteError;
use closecall_scenarios::criticality::{CriticalLaneChange, criticality as evaluate, shares};
use closecall_scenarios::filters::smooth;
use closecall_scenarios::fit::{Heading, fit as fit_distributions, to_toml, write_toml};
use closecall_scenarios::lane_change::{Criterion, Detector, LaneChange, Lanes, Score, Spans, read_references, score};
use closecall_scenarios::recordings::{Layout, Recording, open, quality, read_with};

use super::CliError;
use super::args::{Format, ReadArgs, positive};
use super::json::stamped;
use super::output::{out, outln};
use super::protect::{of_trajectories, protect, recording as recording_path};
use super::watch::record_lane_change;
use crate::exit_code::ExitCode;

/// The criterion by which lane changes are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(super) enum CriterionChoice {
    /// Peaks of the lateral speed
    #[default]
    Peak,
    /// Distance from the centre of the lane
    Distance,
    /// Jumps of the measured distances to the lane markings; in-car logs only
    Gradient,
}

impl CriterionChoice {
    const fn criterion(self) -> Criterion {
        match self {
            Self::Peak => Criterion::Peak,
            Self::Distance => Criterion::Distance,
            Self::Gradient => Criterion::Gradient,
        }
    }
}

/// Arguments of `closecall lane-changes`.
#[derive(Debug, Args)]
pub(super) struct LaneChangesArgs {
    /// Trajectory file: NGSIM, highD, exiD, CommonRoad XML, an in-car log, or plain CSV as `closecall record` writes
    /// it. The file can be compressed by gzip
    #[arg(value_name = "TRAJECTORY_FILE")]
    file: PathBuf,
    #[command(flatten)]
    read: ReadArgs,
    /// Criterion by which lane changes are found
    #[arg(long, value_enum, default_value_t)]
    criterion: CriterionChoice,
    /// Known lane changes of the trajectory file, to compute recall and precision: a CSV file with the columns
    /// recording_id, track_id, time_s, direction, clear
    #[arg(long, value_name = "FILE.csv")]
    reference: Option<PathBuf>,
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

/// Arguments of `closecall criticality`.
#[derive(Debug, Args)]
pub(super) struct CriticalityArgs {
    /// Trajectory file
    #[arg(value_name = "TRAJECTORY_FILE")]
    file: PathBuf,
    #[command(flatten)]
    read: ReadArgs,
    /// Speed limit in m/s [default: 120 km/h]
    #[arg(long, value_name = "M/S", value_parser = positive)]
    speed_limit_mps: Option<f64>,
    /// Save a recording (Rerun file) of one lane change: the most critical one, or that of the track named by --track
    #[arg(long, value_name = "FILE.rrd", value_parser = recording_path)]
    record: Option<PathBuf>,
    /// Track whose lane change --record saves
    #[arg(long, value_name = "ID", requires = "record")]
    track: Option<u64>,
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

/// Arguments of `closecall fit`.
#[derive(Debug, Args)]
pub(super) struct FitArgs {
    /// Trajectory files
    #[arg(required = true, value_name = "TRAJECTORY_FILE")]
    files: Vec<PathBuf>,
    #[command(flatten)]
    read: ReadArgs,
    /// File to write [default: standard output]
    #[arg(short, long, value_name = "FILE.toml")]
    output: Option<PathBuf>,
    /// Origin of the trajectory files, for the heading of the output
    #[arg(long, default_value = "")]
    provenance: String,
    /// Seed of the bootstrap, which computes the confidence intervals
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Output format; without --output, `human` prints the text of the file
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

pub(super) fn lane_changes(args: &LaneChangesArgs) -> Result<ExitCode, CliError> {
    let references = args.reference.as_deref().map(read_references).transpose()?;
    let mut tracks = open(&args.file, args.read.options())?;
    if args.criterion == CriterionChoice::Gradient && tracks.layout() != Layout::InCar {
        let message = format!(
            "{}: the gradient criterion needs the measured distances to the lane markings, which only in-car logs have: use \
             `--criterion peak` or `distance`",
            args.file.display(),
        );
        return Err(CliError::Usage { message });
    }
    let detector = Detector::new(Lanes::Recorded, tracks.markings());
    let (mut changes, mut spans, mut count) = (Vec::new(), Spans::new(), 0_u64);
    // The tracks are read one by one, so that the memory does not grow with the file.
    while let Some(track) = tracks.next_track()? {
        count += 1;
        changes.extend(detector.detect(args.criterion.criterion(), &track.trajectory, &track.markings));
        if references.is_some() {
            spans.extend(track.trajectory.span().map(|span| (track.trajectory.track_id, span)));
        }
    }
    changes.sort_by(|a: &LaneChange, b| a.track_id.cmp(&b.track_id).then(a.crossing_s.total_cmp(&b.crossing_s)));
    let name = tracks.name();
    let scored = references.map(|references| {
        let listed: Vec<_> = references.iter().filter(|listed| listed.recording_id == name).collect();
        score(&changes, &listed, &spans)
    });
    match (args.format, scored) {
        (Format::Json, None) => outln!("{:#}", stamped(serde_json::json!(changes), None, None)),
        (Format::Json, Some(scored)) => {
            outln!("{:#}", stamped(serde_json::json!({ "lane_changes": changes, "score": scored }), None, None));
        }
        (Format::Human, scored) => {
            let (rows, period, dropped) = (tracks.rows(), tracks.period(), tracks.dropped().count());
            outln!("{name}: {count} tracks, {rows} rows every {period}, {dropped} rows skipped");
            list(&changes);
            if let Some(scored) = scored {
                print_score(&scored);
            }
        }
    }
    Ok(ExitCode::Pass)
}

fn list(changes: &[LaneChange]) {
    outln!("track  class       direction  lanes      start    middle  crossing       end  duration     speed");
    for change in changes {
        outln!("{}", line(change));
    }
    let complete = changes.iter().filter(|change| change.complete).count();
    let double = changes.iter().filter(|change| change.double).count();
    outln!("{} lane changes, {complete} of them complete, {double} of them parts of double ones", changes.len());
}

fn print_score(score: &Score) {
    outln!("recall     {}", score.recall);
    outln!("precision  {}", score.precision);
    outln!("crossing times differ by at most {:.2} s", score.max_time_error_s);
}

fn describe(recording: &Recording) {
    let quality = quality(recording);
    outln!(
        "{}: {} tracks of {} vehicles, {} instants every {}; {} gaps, {} jumps, {} overlaps",
        recording.name,
        quality.tracks,
        quality.vehicles,
        quality.instants,
        recording.period,
        quality.gaps,
        quality.jumps,
        quality.overlaps,
    );
}

fn line(change: &LaneChange) -> String {
    let direction = match change.direction {
        closecall_traffic::Side::Left => "left",
        closecall_traffic::Side::Right => "right",
    };
    let mark = match (change.complete, change.double) {
        (true, _) => "complete",
        (false, true) => "double",
        (false, false) => "",
    };
    format!(
        "{:>5}  {:<10}  {direction:<9}  {} to {}  {:>7.2} s {:>7.2} s {:>7.2} s {:>7.2} s {:>7.2} s  {:>4.1} m/s  {mark}",
        change.track_id,
        change.vehicle_class.name(),
        change.from_lane,
        change.to_lane,
        change.start_s,
        change.midpoint_s,
        change.crossing_s,
        change.end_s,
        change.duration_s,
        change.speed_mps,
    )
}

pub(super) fn criticality(args: &CriticalityArgs) -> Result<ExitCode, CliError> {
    protect(&of_trajectories(std::slice::from_ref(&args.file)), &[("--record", args.record.as_deref())])?;
    let recording = read_with(&args.file, args.read.options())?;
    let smoothed = smooth(&recording);
    let changes = evaluate(&smoothed, args.speed_limit_mps);
    if let Some(path) = &args.record {
        record_lane_change(path, &smoothed, &changes, args.track)?;
    }
    match args.format {
        Format::Json => outln!("{:#}", stamped(serde_json::json!(changes), None, None)),
        Format::Human => {
            describe(&recording);
            print_metrics(&changes);
        }
    }
    Ok(ExitCode::Pass)
}

fn print_metrics(changes: &[CriticalLaneChange]) {
    for change in changes {
        outln!("{}", line(&change.lane_change));
        for (name, metric) in change.metrics.named() {
            let mark = if metric.is_critical() { "  CRITICAL" } else { "" };
            match metric.value() {
                Some(value) => outln!("         {name:<12} {value:>9.2}{mark}"),
                None => outln!("         {name:<12}         -"),
            }
        }
    }
    let shares = shares(changes);
    outln!("of {} lane changes, critical:", shares.lane_changes);
    for share in &shares.metrics {
        let percent = share.share.map_or("-".to_owned(), |share| format!("{:.0} %", 100.0 * share));
        outln!("  {:<12} {:>4}  {percent:>6}  ({} absent)", share.metric, share.critical, share.absent);
    }
    outln!("  {:<12} {:>4}", "any", shares.any);
}

pub(super) fn fit(args: &FitArgs) -> Result<ExitCode, CliError> {
    protect(&of_trajectories(&args.files), &[("--output", args.output.as_deref())])?;
    let recordings =
        args.files.iter().map(|path| read_with(path, args.read.options())).collect::<Result<Vec<_>, _>>()?;
    refuse_duplicates(&args.files, &recordings)?;
    let fitted = fit_distributions(&recordings, args.seed);
    let command = std::iter::once("closecall".to_owned()).chain(std::env::args().skip(1)).collect::<Vec<_>>().join(" ");
    let heading = Heading { command, provenance: args.provenance.clone() };
    if let Some(path) = &args.output {
        write_toml(&fitted, &heading, path).map_err(|source| WriteError::new(path, source))?;
    }
    match (args.format, &args.output) {
        (Format::Json, _) => outln!("{:#}", stamped(json(&fitted), None, None)),
        (Format::Human, None) => out!("{}", to_toml(&fitted, &heading)),
        (Format::Human, Some(path)) => {
            for quantity in &fitted.fitted {
                outln!("{:<24} n = {:>4}, median {:.3}", quantity.quantity.name(), quantity.n, quantity.median);
            }
            for (quantity, n) in &fitted.too_few {
                outln!("{:<24} n = {n:>4}, too few to fit", quantity.name());
            }
            outln!("written to {}", path.display());
        }
    }
    Ok(ExitCode::Pass)
}

/// Returns an error if two files have the same content: its lane changes would count twice, and every interval would be
/// too narrow.
pub(super) fn refuse_duplicates(paths: &[PathBuf], recordings: &[Recording]) -> Result<(), CliError> {
    for (later, recording) in recordings.iter().enumerate() {
        if let Some(earlier) = recordings[..later].iter().position(|earlier| earlier.hash == recording.hash) {
            let (one, other) = (paths[earlier].display(), paths[later].display());
            return Err(CliError::Usage { message: format!("{one} and {other} have the same content") });
        }
    }
    Ok(())
}

fn json(fitted: &closecall_scenarios::fit::FittedDistributions) -> serde_json::Value {
    let quantity = |quantity: &closecall_scenarios::fit::FittedQuantity| {
        serde_json::json!({
            "name": quantity.quantity.name(),
            "n": quantity.n,
            "median": quantity.median,
            "interval_95": quantity.interval_95,
            "quantiles": quantity.quantiles,
        })
    };
    let too_few = |(quantity, n): &(closecall_scenarios::fit::Quantity, usize)| serde_json::json!({ "name": quantity.name(), "n": n });
    serde_json::json!({
        "recordings": fitted.recordings.iter().map(|(name, _)| name).collect::<Vec<_>>(),
        "seed": fitted.seed,
        "fitted": fitted.fitted.iter().map(quantity).collect::<Vec<_>>(),
        "too_few": fitted.too_few.iter().map(too_few).collect::<Vec<_>>(),
    })
}
