//! Runs a sample and writes what the command line requests: a recording (Rerun file), a trace (table), messages (OSI).

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use closecall_campaign::arguments::{parquet, recording, scans, table};
use closecall_campaign::runner::run_guarded;
use closecall_report::exchange::OsiRecorder;
use closecall_report::run::film::{Film, FilmRecorder, Level};
use closecall_report::run::observers::RunObservers;
use closecall_report::run::rerun::{check_recording_possible, write_recording_unchecked};
use closecall_report::tables::{RunTables, TableFiles, companion_files};
use closecall_scenarios::outcome::Outcome;
use closecall_scenarios::{Scenario, Setting};
use closecall_sensors::SensorMode;
use closecall_simulation::{Arm, RunKey};

use super::CliError;
use super::backend::check_backend_of;
use super::help::heading;
use super::output::{during, print_written};
use super::protect::Output;

/// The level of detail of a recording.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(super) enum RecordLevel {
    /// States, events and plots
    Events,
    /// Additionally the vehicles and the ego's perception of them
    Objects,
    /// Additionally the point clouds and images of the rear sensors, if they are simulated
    #[default]
    Full,
}

impl From<RecordLevel> for Level {
    fn from(level: RecordLevel) -> Self {
        match level {
            RecordLevel::Events => Self::Events,
            RecordLevel::Objects => Self::Objects,
            RecordLevel::Full => Self::Full,
        }
    }
}

/// The files to write of a run.
#[derive(Clone, Debug, Default, Args)]
pub(super) struct WatchArgs {
    /// Save a recording of the run, to be viewed with Rerun
    #[arg(long, value_name = "FILE.rrd", value_parser = recording, help_heading = heading::OUTPUT)]
    pub(super) record: Option<PathBuf>,
    /// Level of detail of the recording
    #[arg(long, value_enum, default_value_t, requires = "record", help_heading = heading::OUTPUT)]
    pub(super) record_level: RecordLevel,
    /// Write a trace: a table with one row per control step and actor. With --paired, of the run of the controller
    /// under test
    #[arg(long, value_name = "FILE.csv|FILE.parquet", value_parser = table, help_heading = heading::OUTPUT)]
    pub(super) trace: Option<PathBuf>,
    /// Write every return of the LiDARs (mode `full`) of the same run: a table with beam, range, position, intensity, time, box and truth, or a new folder with a point cloud for each scan
    #[arg(long, value_name = "FILE.parquet|FOLDER.pcd", value_parser = scans, help_heading = heading::OUTPUT)]
    pub(super) scans: Option<PathBuf>,
    /// Write the tracks of the same run: a table with one row per control step and track, with state, covariance, class, and the vehicle that it is matched with
    #[arg(long, value_name = "FILE.parquet", value_parser = parquet, help_heading = heading::OUTPUT)]
    pub(super) tracks: Option<PathBuf>,
    /// Write the clusters and boxes of the LiDARs (mode `full`) of the same run before any is rejected: a table with the use that the tracker makes of each
    #[arg(long, value_name = "FILE.parquet", value_parser = parquet, help_heading = heading::OUTPUT)]
    pub(super) clusters: Option<PathBuf>,
    /// Write the same run as messages of ASAM OSI 3.8, `GroundTruth` and `SensorData` of each control step: one MCAP file with the map, or a
    /// trace file for each type, whose name begins with date and type and ends with the name of FILE
    #[arg(long, value_name = "FILE.mcap|FILE.osi", value_parser = osi_file, help_heading = heading::OUTPUT)]
    pub(super) osi: Option<PathBuf>,
    /// Write the lanes into every `GroundTruth`, not only into the first
    #[arg(long, requires = "osi", help_heading = heading::OUTPUT)]
    pub(super) osi_lanes: bool,
}

/// Parses the name of a file of OSI messages.
fn osi_file(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let end = path.extension().map(|end| end.to_ascii_lowercase());
    match end.as_ref().and_then(|end| end.to_str()) {
        Some("osi" | "mcap") => Ok(path),
        _ => Err("its name must end with `.osi` or `.mcap`".to_owned()),
    }
}

impl WatchArgs {
    /// Returns the files to write.
    pub(super) fn outputs(&self) -> [Output<'_>; 6] {
        [
            ("--record", self.record.as_deref()),
            ("--trace", self.trace.as_deref()),
            ("--scans", self.scans.as_deref()),
            ("--tracks", self.tracks.as_deref()),
            ("--clusters", self.clusters.as_deref()),
            ("--osi", self.osi.as_deref()),
        ]
    }

    /// Prints which files were written: the recording and the tables. The names of OSI trace files
    /// follow the standard: they are printed when they are written.
    pub(super) fn print_files(&self) {
        let named = self.outputs().into_iter().filter(|(option, _)| *option != "--osi");
        named.filter_map(|(_, path)| path).for_each(print_written);
        self.scans.iter().flat_map(|path| companion_files(path)).for_each(|path| print_written(&path));
    }

    /// Returns the tables to write.
    fn tables(&self) -> TableFiles<'_> {
        TableFiles {
            trace: self.trace.as_deref(),
            scans: self.scans.as_deref(),
            tracks: self.tracks.as_deref(),
            clusters: self.clusters.as_deref(),
        }
    }
}

/// Runs a sample in each arm, and writes the requested files. All arms share one recording, which names `settings`.
pub(super) fn run_watched(
    scenario: &Scenario,
    key: RunKey,
    arms: &[Arm],
    watch: &WatchArgs,
    settings: &[Setting],
) -> Result<Vec<Outcome>, CliError> {
    let (outcomes, films) = run(scenario, key, arms, watch, watch.record.is_some())?;
    if let Some(path) = &watch.record {
        let named = |film: Film| film.with_settings(settings.iter().map(ToString::to_string));
        write_recording_unchecked(path, &films.into_iter().map(named).collect::<Vec<_>>())?;
    }
    watch.print_files();
    Ok(outcomes)
}

/// Runs a sample in one arm, writes the requested tables, and returns a film of the run. The caller saves the
/// recording, and prints the files.
pub(super) fn run_filmed(
    scenario: &Scenario,
    key: RunKey,
    arm: &Arm,
    watch: &WatchArgs,
) -> Result<(Outcome, Film), CliError> {
    let (mut outcomes, mut films) = run(scenario, key, std::slice::from_ref(arm), watch, true)?;
    Ok((outcomes.swap_remove(0), films.swap_remove(0)))
}

/// Runs a sample in each arm, and writes the requested tables. Returns the films if there are to be any.
fn run(
    scenario: &Scenario,
    key: RunKey,
    arms: &[Arm],
    watch: &WatchArgs,
    is_filmed: bool,
) -> Result<(Vec<Outcome>, Vec<Film>), CliError> {
    watch.record.as_deref().map(check_recording_possible).transpose()?;
    let mode = arms.last().and_then(|arm| arm.sensors).unwrap_or_else(|| scenario.sensors.mode());
    let of_lidars = [("--scans", &watch.scans), ("--clusters", &watch.clusters)];
    if let Some((option, _)) = of_lidars.into_iter().find(|(_, path)| path.is_some() && mode != SensorMode::Full) {
        let name = mode.name();
        let message =
            format!("{option} needs LiDARs: only sensors of mode `full` have them, and the run has mode `{name}`");
        return Err(CliError::usage(message));
    }
    check_backend_of(scenario, arms)?;
    let mut tables = RunTables::new((scenario, arms.last()), watch.tables())?;
    let mut osi = watch.osi.as_ref().map(|_| OsiRecorder::new(scenario, watch.osi_lanes));
    let (mut films, mut outcomes) = (Vec::new(), Vec::new());
    for (index, arm) in arms.iter().enumerate() {
        let is_tested = index + 1 == arms.len();
        let mut recorder = is_filmed.then(|| FilmRecorder::new(scenario, key, arm, watch.record_level.into()));
        let mut observers = RunObservers {
            recorder: recorder.as_mut(),
            tables: is_tested.then_some(&mut tables),
            osi: osi.as_mut().filter(|_| is_tested),
        };
        let work = format!("running sample {} of {} with {}", key.sample, scenario.name, arm.controller.name());
        let outcome = during(work, || run_guarded(scenario, key, arm, &mut observers))
            .map_err(|source| CliError::Sample { sample: key.sample, source })?;
        films.extend(recorder.map(|recorder| recorder.finish(&outcome)));
        outcomes.push(outcome);
    }
    tables.finish()?;
    if let (Some(osi), Some(path)) = (osi, &watch.osi) {
        osi.write(path)?.iter().for_each(|path| print_written(path));
    }
    Ok((outcomes, films))
}
