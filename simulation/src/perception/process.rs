//! A process as the perception of the closed loop: a command, a process of this program that has
//! loaded a library, or a process with an object of a Python program.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use closecall_scenarios::Scenario;
use closecall_sensors::SensorError;
use closecall_sensors::external::{
    CameraMount, LidarMount, PerceptionAnswer, PerceptionProgram, PerceptionQuestion, ProgramKind, ProgramSettings,
    RadarMount,
};
use closecall_traffic::{CONTROL_STEP, Time};

use super::answer::{self, AnswerError, Kind};
use super::hosted;
use super::question::{self, Setup};
use crate::controller::exec::{
    ANSWERS_ALONE, Child, ExecError, ExecSettings, Identity, START_TIMEOUT, check_hello, is_other_text,
};
use crate::controller::native::{self, LOAD_TIMEOUT, NativeError, Probe};
use crate::run::ComputingTime;

/// What ends the process in which a library or an object runs.
const WHO: &str = "the perception";

/// Why a process did not give a valid answer.
#[derive(Debug, thiserror::Error)]
enum ProgramError {
    /// The process does not keep to the protocol or to its limits.
    #[error(transparent)]
    Process(#[from] ExecError),
    /// An answer is not valid.
    #[error(transparent)]
    Answer(#[from] AnswerError),
    /// The process computes for longer than from a scan to the next.
    #[error("the process {0}")]
    Slow(String),
    /// A library or an object says why it has no answer, or cannot be run.
    #[error("{0}")]
    Stated(String),
}

impl ProgramError {
    fn is_late(&self) -> bool {
        matches!(self, Self::Process(error) if error.is_late())
    }

    /// Returns the message. A library or an object is not the process in which it runs.
    fn message(&self, kind: ProgramKind) -> String {
        match (kind, self) {
            (ProgramKind::Exec, Self::Process(error)) => {
                error.advice().map_or_else(|| error.to_string(), |advice| format!("{error}; {advice}"))
            }
            (ProgramKind::Exec, Self::Answer(error @ AnswerError::NotJson { line, .. })) if is_other_text(line) => {
                format!("{error}; {ANSWERS_ALONE}")
            }
            (ProgramKind::Exec, _) | (_, Self::Slow(_) | Self::Stated(_)) => self.to_string(),
            (_, Self::Process(error)) => error.end_of_isolated(WHO).unwrap_or_else(|| error.to_string()),
            (ProgramKind::Lib, Self::Answer(error)) => error.without_line("the library"),
            (ProgramKind::Hosted, Self::Answer(error)) => error.without_line(WHO),
        }
    }
}

/// A process that perceives in one run. It is started at the first question and ended when this
/// value is dropped.
pub(crate) struct PerceptionProcess {
    program: ProgramSettings,
    started: Option<(Child, Kind)>,
    /// The computing time, once the period of the scans is known.
    computing: Option<ComputingTime>,
}

impl PerceptionProcess {
    /// Creates the process of a run.
    pub(crate) fn new(program: ProgramSettings) -> Self {
        Self { program, started: None, computing: None }
    }

    /// Sends a question and returns its answer. Starts the process if there is none yet.
    fn request(&mut self, question: &PerceptionQuestion<'_>) -> Result<PerceptionAnswer, ProgramError> {
        let (child, kind) = match &mut self.started {
            Some(started) => started,
            None => {
                let (child, _, kind) = greet(&self.program, &Setup::of(question))?;
                self.started.insert((child, kind))
            }
        };
        let limit = Duration::from_millis(self.program.timeout_ms);
        // A program may load or compile what it needs with its first scan.
        let limit = if child.answered() == 1 { START_TIMEOUT.max(limit) } else { limit };
        let line = question::scans(question);
        let begun = Instant::now();
        let answered = child.request(line, limit)?;
        let spent = begun.elapsed();
        if self.program.kind != ProgramKind::Exec
            && let Some(reason) = answer::stated_error(&answered)
        {
            child.condemn();
            return Err(ProgramError::Stated(reason));
        }
        let parsed = answer::parse(&answered, (*kind, question.time), child.answered());
        let parsed =
            parsed.map_err(ProgramError::from).and_then(|parsed| Ok(parsed?)).inspect_err(|_| child.condemn())?;
        let period_s = question.lidars.iter().map(|lidar| lidar.period_s).fold(f64::INFINITY, f64::min);
        // Without a LiDAR there is no period that it must keep.
        let period = Duration::try_from_secs_f64(period_s).unwrap_or(Duration::MAX);
        let process = child.id();
        let computing = self.computing.get_or_insert_with(|| ComputingTime::of_perception(period, process));
        match computing.exceeded(spent) {
            Some(message) => Err(ProgramError::Slow(message)),
            None => Ok(parsed),
        }
    }

    /// Returns the failure at the time of a question. A program that was not greeted was asked
    /// none.
    fn failure(&self, error: &ProgramError, time: Time) -> SensorError {
        let time = self.started.is_some().then_some(time);
        let reason = error.message(self.program.kind);
        SensorError::Program { program: self.program.name(), reason, is_late: error.is_late(), time }
    }
}

impl PerceptionProgram for PerceptionProcess {
    fn perceive(&mut self, question: &PerceptionQuestion<'_>) -> Result<PerceptionAnswer, SensorError> {
        self.request(question).map_err(|error| self.failure(&error, question.time))
    }

    fn finish(&mut self, time: Time) -> Result<(), SensorError> {
        let Some((child, _)) = &mut self.started else { return Ok(()) };
        // The process of a library first frees the perception.
        let is_library = self.program.kind == ProgramKind::Lib;
        let limit = Duration::from_millis(self.program.timeout_ms);
        let finished = if is_library { child.finish_run(&self.program.name(), limit) } else { child.finish() };
        finished.map_err(|error| self.failure(&error.into(), time))
    }
}

/// Starts a program, greets it as in a run of the scenario, and returns what it states about itself
/// in its first answer, and the files that it has open: none of a library, whose process is this
/// program. `None` if it cannot be greeted.
pub fn identify_program(program: &ProgramSettings, scenario: &Scenario) -> Option<(Identity, Vec<PathBuf>)> {
    let model = scenario.sensors.full_model();
    let ego = &scenario.actors[scenario.ego];
    let size = ego.vehicle.dimensions;
    let lidars: Vec<LidarMount> = model.rear_lidars().map(|lidar| LidarMount::of(&lidar, size.length_m)).collect();
    let radars: Vec<RadarMount> = model.rear_radar.iter().flat_map(|radar| radar.mounts(size.length_m)).collect();
    let latency_s = model.tracker.latency_steps() as f64 * CONTROL_STEP.s();
    let images = program.images.into_iter();
    let cameras = images.flat_map(|images| scenario.sensors.rear_cameras().map(move |camera| (images, camera)));
    let mut cameras = cameras.map(|(images, camera)| CameraMount::of(camera, images, size.length_m));
    let (camera, additional) = (cameras.next(), cameras.collect::<Vec<_>>());
    let setup = Setup {
        size,
        road: &scenario.road,
        lane: scenario.road.lane_of(&ego.start),
        lidars: &lidars,
        radars: &radars,
        camera,
        additional_cameras: &additional,
        latency_s,
    };
    let (child, identity, _) = greet(program, &setup).ok()?;
    let open_files = if program.kind == ProgramKind::Lib { Vec::new() } else { child.open_files() };
    Some((identity, open_files))
}

/// Tries whether a program can be started, and is killed at once, or whether a library can be
/// loaded by a separate process.
///
/// # Errors
/// [`NativeError::StartProgram`] if a command cannot be started, or if a library ends or blocks the
/// process that loads it, and [`NativeError::RefusedProgram`] if a file is no library of a
/// perception.
pub fn try_program(program: &ProgramSettings) -> Result<(), NativeError> {
    let fail = |reason: String| NativeError::StartProgram { program: program.name(), reason };
    let folder = program.folder.map(Path::new);
    if program.kind != ProgramKind::Lib {
        let settings = process_settings(program).map_err(|error| fail(error.to_string()))?;
        return Child::try_start(&settings, folder).map_err(|error| fail(error.to_string()));
    }
    let crash = |error: ExecError| fail(error.end_of_isolated(WHO).unwrap_or_else(|| error.to_string()));
    let mut child = Child::start(&own_process(program, "probe-perception"), folder).map_err(crash)?;
    let limit = LOAD_TIMEOUT.max(Duration::from_millis(program.timeout_ms));
    let Some(line) = child.request_within(Vec::new(), limit).map_err(crash)? else {
        let waited_s = limit.as_secs_f64();
        return Err(fail(format!("it is not loaded within {waited_s} s: its constructor may wait or loop")));
    };
    child.finish_unloading(&program.name()).map_err(crash)?;
    match serde_json::from_slice(&line) {
        Ok(Probe::Identity(_)) => Ok(()),
        Ok(Probe::Refused { reason, is_io }) => {
            Err(NativeError::RefusedProgram { program: program.name(), reason, is_io })
        }
        Err(error) => Err(fail(error.to_string())),
    }
}

/// Returns the settings of the process of a program.
fn process_settings(program: &ProgramSettings) -> Result<ExecSettings, ProgramError> {
    let ProgramSettings { kind, command, timeout_ms, memory_mib, .. } = *program;
    match kind {
        ProgramKind::Exec => Ok(ExecSettings { command: command.to_owned(), timeout_ms, memory_mib }),
        ProgramKind::Lib => Ok(own_process(program, "perceive")),
        ProgramKind::Hosted => match hosted::words(&program.name()) {
            Some(words) => Ok(process_of(program, &words)),
            None => Err(ProgramError::Stated(hosted::missing())),
        },
    }
}

/// Returns the settings of a process of this program that does something with a library.
fn own_process(program: &ProgramSettings, action: &str) -> ExecSettings {
    process_of(program, &native::command(&[action, program.command]))
}

/// Returns the settings of the process that these words start, under the limits of the program.
fn process_of(program: &ProgramSettings, words: &[String]) -> ExecSettings {
    // A word with a NUL character, which cannot be quoted, names no file.
    let command = shlex::try_join(words.iter().map(String::as_str)).unwrap_or_default();
    ExecSettings { command, timeout_ms: program.timeout_ms, memory_mib: program.memory_mib }
}

/// Starts a program, and greets it.
fn greet(program: &ProgramSettings, setup: &Setup<'_>) -> Result<(Child, Identity, Kind), ProgramError> {
    let settings = process_settings(program)?;
    let mut child = Child::start(&settings, program.folder.map(Path::new))?;
    let limit = START_TIMEOUT.max(Duration::from_millis(settings.timeout_ms));
    let hello = child.request(setup.hello(), limit)?;
    let identity = check_hello(&hello)?;
    let kind = answer::kind(&hello)?;
    Ok((child, identity, kind))
}
