//! What is written of a run while it is run again: a Rerun file, a table.

use std::cmp::Ordering::Equal;
use std::path::{Path, PathBuf};

use clap::Args;
use closecall_scenarios::criticality::CriticalLaneChange;
use closecall_scenarios::filters::SmoothedRecording;
use closecall_traffic::Time;

use super::CliError;
use crate::campaign::runner::run_guarded;
use crate::outcome::Outcome;
use crate::report::film::{Film, FilmRecorder, Level, film_lane_change};
use crate::report::rerun::{check_recordable, write_films};
use crate::report::trace::TraceWriter;
use crate::scenario::Scenario;
use crate::simulation::{Arm, Happening, Observer, RunKey, StepView};

/// What to write of a run.
#[derive(Clone, Debug, Default, Args)]
pub(super) struct WatchArgs {
    /// Write a Rerun file to look at
    #[arg(long, value_name = "FILE.rrd")]
    pub(super) record: Option<PathBuf>,
    /// How much of the run a Rerun file holds
    #[arg(long, value_enum, default_value_t, requires = "record")]
    pub(super) record_level: Level,
    /// Write one row per control step and actor; of a pair, of the controller under test
    #[arg(long, value_name = "FILE.csv|FILE.parquet", value_parser = table)]
    pub(super) trace: Option<PathBuf>,
}

/// A path whose ending says how a table is written.
fn table(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("csv" | "parquet") => Ok(path),
        _ => Err(format!("`{text}` ends neither with .csv nor with .parquet")),
    }
}

/// Runs a sample in each of the arms and writes what is asked for; all arms share one Rerun file.
pub(super) fn run_watched(
    scenario: &Scenario,
    key: RunKey,
    arms: &[Arm],
    watch: &WatchArgs,
) -> Result<Vec<Outcome>, CliError> {
    if watch.record.is_some() && watch.record == watch.trace {
        return Err(CliError::Usage { message: "--record and --trace name the same file".to_owned() });
    }
    watch.record.as_deref().map(check_recordable).transpose()?;
    let mut trace = watch.trace.as_deref().map(TraceWriter::new).transpose()?;
    let mut films = Vec::new();
    let mut outcomes = Vec::new();
    for (place, arm) in arms.iter().enumerate() {
        let is_tested = place + 1 == arms.len();
        let recorder = watch.record.as_ref().map(|_| FilmRecorder::new(scenario, key, arm, watch.record_level));
        let mut watchers = Watchers { recorder, trace: trace.as_mut().filter(|_| is_tested) };
        let outcome = run_guarded(scenario, key, arm, &mut watchers)
            .map_err(|source| CliError::Sample { sample: key.sample, source })?;
        films.extend(watchers.recorder.map(|recorder| recorder.finish(&outcome)));
        outcomes.push(outcome);
    }
    if let Some(path) = &watch.record {
        write_films(path, &films)?;
    }
    if let Some(trace) = trace {
        trace.finish()?;
    }
    Ok(outcomes)
}

/// Runs a sample in each of the arms, and keeps a film of each.
pub(super) fn films(scenario: &Scenario, key: RunKey, arms: &[Arm], level: Level) -> Result<Vec<Film>, CliError> {
    let film = |arm: &Arm| {
        let mut recorder = FilmRecorder::new(scenario, key, arm, level);
        let outcome = run_guarded(scenario, key, arm, &mut recorder)
            .map_err(|source| CliError::Sample { sample: key.sample, source })?;
        Ok(recorder.finish(&outcome))
    };
    arms.iter().map(film).collect()
}

/// Everyone who watches a run from the command line.
struct Watchers<'a> {
    recorder: Option<FilmRecorder>,
    trace: Option<&'a mut TraceWriter>,
}

impl Observer for Watchers<'_> {
    fn step(&mut self, view: &StepView<'_>) {
        if let Some(recorder) = &mut self.recorder {
            recorder.step(view);
        }
        if let Some(trace) = &mut self.trace {
            trace.step(view);
        }
    }

    fn happening(&mut self, time: Time, what: &Happening) {
        if let Some(recorder) = &mut self.recorder {
            recorder.happening(time, what);
        }
        if let Some(trace) = &mut self.trace {
            trace.happening(time, what);
        }
    }
}

/// Writes films into a Rerun file at `path`.
pub(super) fn record_films(path: &Path, films: &[Film]) -> Result<(), CliError> {
    check_recordable(path)?;
    Ok(write_films(path, films)?)
}

/// Writes a film of one lane change of a recording: of `track`, or of the most critical one.
pub(super) fn record_lane_change(
    path: &Path,
    recording: &SmoothedRecording,
    changes: &[CriticalLaneChange],
    track: Option<u64>,
) -> Result<(), CliError> {
    let is_wanted = |change: &&CriticalLaneChange| track.is_none_or(|track| change.lane_change.track_id == track);
    let chosen = changes.iter().filter(is_wanted).max_by(|a, b| severity(a).partial_cmp(&severity(b)).unwrap_or(Equal));
    let Some(chosen) = chosen else {
        let whose = track.map_or(String::new(), |track| format!(" of track {track}"));
        return Err(CliError::Usage { message: format!("the recording has no lane change{whose}: nothing to record") });
    };
    record_films(path, &[film_lane_change(recording, chosen)?])
}

/// How many metrics are critical, and how near the nearest vehicle came.
fn severity(change: &CriticalLaneChange) -> (usize, f64) {
    let critical = change.metrics.named().iter().filter(|(_, metric)| metric.is_critical()).count();
    (critical, -change.metrics.distance_m.value().unwrap_or(f64::INFINITY))
}
