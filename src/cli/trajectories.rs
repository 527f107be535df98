//! `closecall traffic lane-changes`, `criticality` and `fit`: from trajectory files to
//! distributions.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use closecall_campaign::arguments::{Positive, recording as trajectory_path};
use closecall_recorded::criticality::{Counted, CriticalLaneChange, Judgement, by_severity, criticality as evaluate};
use closecall_recorded::filters::{SmoothedFile, smooth_file};
use closecall_recorded::fit::{Heading, correlated_in_files, to_toml, write_toml};
use closecall_recorded::lane_change::{Criterion, FoundLaneChanges, find, listed_for, read_references, score};
use closecall_recorded::openlabel::{Labels, label_file};
use closecall_recorded::trajectory_data::{Layout, open};
use closecall_report::json::{self, stamped};
use closecall_report::run::film::film_lane_change;
use closecall_report::run::rerun::write_recording;
use closecall_report::traffic::fit::FitText;
use closecall_report::traffic::lane_changes::{CriticalityText, LaneChangesText, ScoreText};
use closecall_report::traffic::paper_charts::{METRICS, criticality_charts};
use closecall_traffic::atomic::WriteError;
use serde::Deserialize;
use serde_json::Value;

use super::CliError;
use super::args::{FilesArgs, Format, LanesChoice, ReadArgs, advise, smooth_noting, warn_without_lane_changes};
use super::argument::Argument;
use super::help::{examples, heading};
use super::output::{command_line, during, out, outln, print_text, print_written, reading, warn, write_charts};
use super::protect::{files_of_trajectories, must_be_folder, must_be_writable, protect};
use super::reenact::lacks_lane_change;
use crate::exit_code::ExitCode;

/// The criterion by which lane changes are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Deserialize)]
#[serde(rename_all = "kebab-case")]
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

/// Arguments of `closecall traffic lane-changes`.
#[derive(Debug, Args, Deserialize)]
#[command(after_help = examples([
    "closecall traffic lane-changes traffic.csv",
    "closecall traffic lane-changes traffic.csv --lanes none --format json",
    "closecall traffic lane-changes traffic.csv --openlabel labels.json",
]))]
pub(super) struct LaneChangesArgs {
    /// Trajectory file: NGSIM, highD, exiD, CommonRoad XML, floating car data of SUMO, a vehicle record
    /// of Vissim, JSON of I-24 MOTION, OpenLABEL, OSI, an in-car log, or plain CSV as `closecall traffic
    /// record` writes it. The file can be compressed by gzip
    #[arg(value_name = "TRAJECTORY_FILE")]
    file: PathBuf,
    #[command(flatten)]
    #[serde(rename = "..read")]
    read: ReadArgs,
    /// Criterion by which lane changes are found
    #[arg(long, value_enum, default_value_t, help_heading = heading::METHOD)]
    #[serde(default)]
    criterion: CriterionChoice,
    /// Known lane changes of the trajectory file, to compute recall and precision: a CSV file with
    /// the columns recording_id, track_id, time_s, direction, clear
    #[arg(long, value_name = "FILE.csv", help_heading = heading::METHOD)]
    reference: Option<PathBuf>,
    /// File for the vehicles and their lane changes as ASAM OpenLABEL 1.0.0, which every `traffic`
    /// command reads
    #[arg(long, value_name = "FILE.json", help_heading = heading::OUTPUT)]
    openlabel: Option<PathBuf>,
    /// Output format
    #[arg(long, value_enum, default_value_t, help_heading = heading::OUTPUT)]
    #[serde(skip)]
    format: Format,
}

/// Arguments of `closecall traffic criticality`.
#[derive(Debug, Args, Deserialize)]
#[command(after_help = examples([
    "closecall traffic criticality traffic.csv",
    "closecall traffic criticality traffic.csv --record lane-change.rrd --track 3",
    "closecall traffic criticality traffic.csv --openlabel labels.json",
]))]
pub(super) struct CriticalityArgs {
    /// Trajectory file
    #[arg(value_name = "TRAJECTORY_FILE")]
    file: PathBuf,
    #[command(flatten)]
    #[serde(rename = "..read")]
    read: ReadArgs,
    /// Speed limit in m/s [default: 120 km/h]
    #[arg(long, value_name = "M/S", help_heading = heading::METHOD)]
    speed_limit_mps: Option<Positive>,
    /// Count all lane changes in the shares, also those cut off, smaller than 2.5 m, or overlapping
    #[arg(long, help_heading = heading::METHOD)]
    #[serde(default)]
    all: bool,
    /// Count a TTCE below 2.6 s as critical by itself, and not only as the condition under which
    /// DCE is evaluated
    #[arg(long, help_heading = heading::METHOD)]
    #[serde(default)]
    ttce_alone: bool,
    /// Also compute DCE and TTCE along the lanes: a vehicle keeps its speed along the road, completes
    /// its lane change, and keeps its lateral position then. By default both vehicles keep their
    /// velocities, which carry a vehicle that changes lanes beyond its new lane. Verdicts and the
    /// count `any` stay those at constant velocity
    #[arg(long, help_heading = heading::METHOD)]
    #[serde(default)]
    curvilinear: bool,
    /// Save a recording (Rerun file) of one lane change: the most critical one, or the lane change
    /// of the track that --track names
    #[arg(long, value_name = "FILE.rrd", value_parser = trajectory_path, help_heading = heading::OUTPUT)]
    record: Option<PathBuf>,
    /// Track whose lane change --record saves
    #[arg(long, value_name = "ID", requires = "record", help_heading = heading::OUTPUT)]
    track: Option<u64>,
    /// File for the vehicles, their lane changes and the metrics as ASAM OpenLABEL 1.0.0, which every
    /// `traffic` command reads
    #[arg(long, value_name = "FILE.json", help_heading = heading::OUTPUT)]
    openlabel: Option<PathBuf>,
    /// Folder for a histogram of each metric with its threshold: `thw_s.svg`, `dce_m.svg` and so on
    #[arg(long, value_name = "DIR", help_heading = heading::OUTPUT)]
    plot: Option<PathBuf>,
    /// Output format
    #[arg(long, value_enum, default_value_t, help_heading = heading::OUTPUT)]
    #[serde(skip)]
    format: Format,
}

/// Arguments of `closecall traffic fit`.
#[derive(Debug, Args, Deserialize)]
#[command(after_help = examples([
    "closecall traffic fit traffic.csv",
    "closecall traffic fit one.csv two.csv --correlations -o fitted.toml",
    "closecall traffic fit traffic.csv --provenance 'Measured in May' --format json",
]))]
pub(super) struct FitArgs {
    #[command(flatten)]
    #[serde(rename = "..data")]
    data: FilesArgs,
    /// File to write [default: standard output]
    #[arg(short, long = "out", alias = "output", value_name = "FILE.toml", help_heading = heading::OUTPUT)]
    output: Option<PathBuf>,
    /// Origin of the trajectory files, for the heading of the output
    #[arg(long, default_value = "", help_heading = heading::OUTPUT)]
    #[serde(default)]
    provenance: String,
    /// Also write how the quantities of one lane change, or of one pair of vehicles, depend on each
    /// other: rank correlations, by which scenarios sample them together
    #[arg(long, help_heading = heading::METHOD)]
    #[serde(default)]
    correlations: bool,
    /// Seed of the bootstrap, which computes the confidence intervals
    #[arg(long, default_value_t = 0, value_parser = closecall_campaign::arguments::seed, help_heading = heading::METHOD)]
    #[serde(default)]
    seed: u64,
    /// Output format; without --out, `human` prints the text of the file
    #[arg(long, value_enum, default_value_t, help_heading = heading::OUTPUT)]
    #[serde(skip)]
    format: Format,
}

/// The answer of a command: for programs, and for readers.
pub(super) struct Answer {
    pub(super) value: Value,
    text: String,
    /// Whether a warning says why the result may be wrong.
    is_in_doubt: bool,
}

impl Answer {
    /// Returns the exit code.
    pub(super) fn code(&self) -> ExitCode {
        if self.is_in_doubt { ExitCode::Inconclusive } else { ExitCode::Pass }
    }
}

/// Prints the answer.
fn print(format: Format, answer: &Answer) -> ExitCode {
    match format {
        Format::Json => outln!("{:#}", answer.value),
        Format::Human => print_text(&answer.text),
    }
    answer.code()
}

pub(super) fn lane_changes(args: &LaneChangesArgs) -> Result<ExitCode, CliError> {
    Ok(print(args.format, &find_lane_changes(args)?))
}

pub(super) fn find_lane_changes(args: &LaneChangesArgs) -> Result<Answer, CliError> {
    protect(&files_of_trajectories(std::slice::from_ref(&args.file)), &[("--openlabel", args.openlabel.as_deref())])?;
    must_be_writable(args.openlabel.as_deref())?;
    let references = args.reference.as_deref().map(read_references).transpose()?;
    let mut tracks = reading(&args.file, || open(&args.file, args.read.options()))?;
    if args.criterion == CriterionChoice::Gradient && tracks.layout() != Layout::InCar {
        let message = format!(
            "{}: the gradient criterion needs the measured distances to the lane markings, which only in-car logs have: use \
             `peak` or `distance` as {}",
            args.file.display(),
            Argument("criterion")
        );
        return Err(CliError::Usage { message });
    }
    if args.criterion != CriterionChoice::Peak && args.read.lanes == LanesChoice::None {
        return Err(CliError::usage(format!(
            "{} `none` is for the criterion `peak`: other criteria need lanes or markings",
            Argument("lanes")
        )));
    }
    let name = tracks.name().to_owned();
    let references = references.map(|all| listed_for(all, &name)).transpose();
    let references = references.map_err(|message| CliError::Usage { message })?;
    let FoundLaneChanges { lane_changes: changes, spans, tracks: count, basis } =
        reading(&args.file, || find(&mut tracks, args.criterion.criterion()))?;
    let scored = references.map(|listed| score(&changes, &listed.iter().collect::<Vec<_>>(), &spans));
    for warning in tracks.warnings().into_iter().chain(basis.warnings()) {
        warn(format_args!("{}: {warning}", args.file.display()));
    }
    advise(basis.lacks_recorded_crossings() || tracks.doubts_lanes(), tracks.doubts_sides());
    let has_none = match basis.unexplained_crossings(changes.len()) {
        Some(reason) => {
            warn(format_args!("{}: {reason}", args.file.display()));
            true
        }
        None => warn_without_lane_changes(std::slice::from_ref(&args.file), changes.len()),
    };
    let (rows, period, dropped) = (tracks.rows(), tracks.period(), tracks.dropped().count());
    if let Some(path) = &args.openlabel {
        reading(&args.file, || label_file(&args.file, args.read.options(), &Labels::LaneChanges(&changes), path))?;
        print_written(path);
    }
    let score = scored.as_ref().map_or_else(String::new, ScoreText::text);
    Ok(Answer {
        value: stamped(json::lane_changes(&changes, scored.as_ref()), None, None),
        text: format!(
            "{name}: {count} tracks, {rows} rows every {period}, {dropped} rows skipped\n{basis}\n{}{score}",
            LaneChangesText(&changes)
        ),
        is_in_doubt: tracks.is_in_doubt() || has_none,
    })
}

/// The lane changes of a file, judged.
struct JudgedFile {
    file: SmoothedFile,
    changes: Vec<CriticalLaneChange>,
    counted: Counted,
    /// Whether a warning says why the result may be wrong.
    is_in_doubt: bool,
}

pub(super) fn criticality(args: &CriticalityArgs) -> Result<ExitCode, CliError> {
    let JudgedFile { file, changes, counted, is_in_doubt } = judge_file(args)?;
    match args.format {
        // One value at a time: all of them together are larger than the tracks.
        Format::Json => print_list(changes.iter().map(|change| stamped(serde_json::json!(change), None, None))),
        Format::Human => print_text(CriticalityText { file: &file, changes: &changes, counted }),
    }
    Ok(if is_in_doubt { ExitCode::Inconclusive } else { ExitCode::Pass })
}

/// Returns the judged lane changes as a value for programs, without a text.
pub(super) fn find_criticality(args: &CriticalityArgs) -> Result<Answer, CliError> {
    let JudgedFile { changes, is_in_doubt, .. } = judge_file(args)?;
    let value = stamped(serde_json::json!(changes), None, None);
    Ok(Answer { value, text: String::new(), is_in_doubt })
}

/// Prints a list of values, as the list of all would be printed.
fn print_list(values: impl Iterator<Item = Value>) {
    let mut before = "[";
    for value in values {
        out!("{before}\n  {}", format!("{value:#}").replace('\n', "\n  "));
        before = ",";
    }
    outln!("{}", if before == "[" { "[]" } else { "\n]" });
}

fn judge_file(args: &CriticalityArgs) -> Result<JudgedFile, CliError> {
    let inputs = files_of_trajectories(std::slice::from_ref(&args.file));
    protect(&inputs, &[("--record", args.record.as_deref()), ("--openlabel", args.openlabel.as_deref())])?;
    let charts = args.plot.as_ref().map(|folder| METRICS.map(|metric| folder.join(format!("{metric}.svg"))));
    for chart in charts.iter().flatten() {
        protect(&inputs, &[("--plot", Some(chart))])?;
    }
    [&args.record, &args.openlabel].into_iter().try_for_each(|file| must_be_writable(file.as_deref()))?;
    must_be_folder(args.plot.as_deref())?;
    let file = reading(&args.file, || smooth_file(&args.file, args.read.options()))?;
    for warning in &file.warnings {
        warn(format_args!("{}: {warning}", args.file.display()));
    }
    advise(file.doubts_lanes, file.doubts_sides);
    let smoothed = &file.data;
    let speed_limit_mps = args.speed_limit_mps.map(|limit| limit.0);
    let judgement = Judgement { speed_limit_mps, ttce_alone: args.ttce_alone, curvilinear: args.curvilinear };
    let changes = evaluate(smoothed, &judgement);
    let has_none = warn_without_lane_changes(std::slice::from_ref(&args.file), changes.len());
    let counted = if args.all { Counted::All } else { Counted::Complete };
    if let Some(path) = &args.record {
        let chosen = by_severity(&changes, args.track);
        let Some(chosen) = chosen.first() else {
            let track = args.track.map(|track| (track, smoothed.track_index(track).is_some()));
            let mut others: Vec<u64> = changes.iter().map(|change| change.lane_change.track_id).collect();
            others.dedup();
            return Err(lacks_lane_change(&args.file.display().to_string(), track, &others));
        };
        write_recording(path, &[film_lane_change(smoothed, chosen)?])?;
        print_written(path);
    }
    if let Some(path) = &args.openlabel {
        let labels = Labels::Criticality(&changes, &smoothed.markings);
        reading(&args.file, || label_file(&args.file, args.read.options(), &labels, path))?;
        print_written(path);
    }
    if let (Some(folder), Some(paths)) = (&args.plot, &charts) {
        write_charts(folder, paths, &criticality_charts(&changes, speed_limit_mps)?)?;
    }
    let is_in_doubt = file.is_in_doubt || has_none;
    Ok(JudgedFile { file, changes, counted, is_in_doubt })
}

pub(super) fn fit(args: &FitArgs) -> Result<ExitCode, CliError> {
    let code = print(args.format, &find_fit(args)?);
    args.output.iter().for_each(|path| print_written(path));
    Ok(code)
}

pub(super) fn find_fit(args: &FitArgs) -> Result<Answer, CliError> {
    protect(&files_of_trajectories(&args.data.files), &[("--out", args.output.as_deref())])?;
    must_be_writable(args.output.as_deref())?;
    let files = smooth_noting(&args.data)?;
    let mut fitted = during("fitting distributions".to_owned(), || correlated_in_files(&files, args.seed));
    if !args.correlations {
        fitted.correlations.clear();
    }
    if fitted.fitted.is_empty() {
        if let Format::Json = args.format {
            outln!("{:#}", stamped(json::fitted(&fitted), None, None));
        }
        let message = format!(
            "no quantity of the trajectory files has enough values to be fitted: nothing was written\n{}",
            FitText(&fitted)
        );
        return Err(CliError::NothingFound { message });
    }
    let heading = Heading { command: command_line(), provenance: args.provenance.clone() };
    if let Some(path) = &args.output {
        write_toml(&fitted, &heading, path).map_err(|source| WriteError::new(path, source))?;
    }
    Ok(Answer {
        value: stamped(json::fitted(&fitted), None, None),
        text: match &args.output {
            None => to_toml(&fitted, &heading),
            Some(_) => FitText(&fitted).to_string(),
        },
        is_in_doubt: files.iter().any(|file| file.is_in_doubt),
    })
}
