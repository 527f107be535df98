//! A process as an ego controller of the closed loop.

use std::path::{Path, PathBuf};
use std::time::Duration;

use closecall_controllers::{
    ControllerError, EgoCommand, EgoController, EgoInput, EgoSettings, LeadVehicleSelector, Reason,
};
use closecall_traffic::{Lane, Road, Time};

use super::child::Child;
use super::error::ExecError;
use super::settings::ExecSettings;
use super::{Identity, NAME, protocol};
use crate::run::ControllerFactory;

/// Time limit of the answer to the first message. The process may first have to load an interpreter
/// and its libraries, perhaps on a busy machine.
pub(crate) const START_TIMEOUT: Duration = Duration::from_secs(10);

/// Creates controllers that run as separate processes.
#[derive(Clone, Debug)]
pub struct ExecFactory {
    settings: ExecSettings,
    folder: Option<PathBuf>,
    name: String,
    repeats_time: bool,
}

impl ExecFactory {
    /// Creates a factory of processes with these settings. They run in the given folder, or in the
    /// folder of this program.
    pub fn new(settings: ExecSettings, folder: Option<&Path>) -> Self {
        Self { settings, folder: folder.map(Path::to_owned), name: NAME.to_owned(), repeats_time: false }
    }

    /// Returns a factory of processes each of whose answers must repeat the time of its control
    /// step.
    #[must_use]
    pub(in crate::controller) fn repeating_time(self) -> Self {
        Self { repeats_time: true, ..self }
    }

    /// Returns the factory under another name in reports.
    #[must_use]
    pub fn named(self, name: String) -> Self {
        Self { name, ..self }
    }
}

/// Starts a process in the given folder, or in the folder of this program, and greets it with the
/// road and the lane of the ego. Returns the statements in its first answer, and the files that it
/// has open.
///
/// # Errors
/// [`ExecError`] if the process cannot be started, or does not give a valid first answer.
pub fn identify(
    settings: &ExecSettings,
    folder: Option<&Path>,
    ego_settings: &EgoSettings,
    (road, lane): (&Road, Lane),
) -> Result<(Identity, Vec<PathBuf>), ExecError> {
    greet(settings, folder, ego_settings, (road, lane)).map(|(child, identity)| (identity, child.open_files()))
}

/// Starts a process, and greets it.
fn greet(
    settings: &ExecSettings,
    folder: Option<&Path>,
    ego_settings: &EgoSettings,
    (road, lane): (&Road, Lane),
) -> Result<(Child, Identity), ExecError> {
    let mut child = Child::start(settings, folder)?;
    let timeout = START_TIMEOUT.max(settings.timeout());
    let hello = child.request(protocol::hello(ego_settings, road, lane), timeout)?;
    let identity = protocol::check_hello(&hello)?;
    Ok((child, identity))
}

impl ControllerFactory for ExecFactory {
    fn name(&self) -> &str {
        &self.name
    }

    /// The outcome summarises the states that the process reports if the scenario has a margin
    /// increase system.
    fn has_mis(&self, settings: &EgoSettings) -> bool {
        settings.mis().is_some()
    }

    fn build(&self, settings: &EgoSettings) -> Box<dyn EgoController> {
        Box::new(ExecController {
            settings: self.settings.clone(),
            folder: self.folder.clone(),
            name: self.name.clone(),
            ego_settings: *settings,
            repeats_time: self.repeats_time,
            was_repeated: false,
            lead_selector: LeadVehicleSelector::default(),
            child: None,
        })
    }
}

/// A process that controls the ego in one run. It is started at the first step and ended when this
/// value is dropped.
struct ExecController {
    settings: ExecSettings,
    folder: Option<PathBuf>,
    name: String,
    ego_settings: EgoSettings,
    repeats_time: bool,
    /// Whether an answer has repeated the time of its control step.
    was_repeated: bool,
    lead_selector: LeadVehicleSelector,
    child: Option<Child>,
}

impl ExecController {
    /// Sends the message of a control step and returns the answer. Starts the process if there is
    /// none yet.
    fn request(&mut self, input: &EgoInput<'_>) -> Result<protocol::Answer, ExecError> {
        let front = self.lead_selector.update(input);
        let child = match &mut self.child {
            Some(child) => child,
            None => {
                let place = (input.road, input.odometry.lane);
                let (child, _) = greet(&self.settings, self.folder.as_deref(), &self.ego_settings, place)?;
                self.child.insert(child)
            }
        };
        // A library or an FMU creates its controller in its first step.
        let is_start = self.repeats_time && child.answered() == 1;
        let timeout = self.settings.timeout();
        let limit = if is_start { START_TIMEOUT.max(timeout) } else { timeout };
        let line = child.request(protocol::step(input, front), limit)?;
        let asked = protocol::Asked {
            time_ns: input.time.ns(),
            must_be_repeated: self.repeats_time,
            was_repeated: self.was_repeated,
            answered: child.answered(),
        };
        let answer = protocol::parse_answer(&line, asked);
        match &answer {
            Ok(answer) => self.was_repeated |= answer.repeats_time,
            Err(_) => child.condemn(),
        }
        answer
    }
}

impl ExecController {
    fn failure(&self, error: &ExecError, time: Time) -> ControllerError {
        // The process of a library or an FMU repeats the time.
        let reason = match (self.repeats_time, error.advice()) {
            (true, _) => error.end_of_isolated("the controller").unwrap_or_else(|| error.to_string()),
            (false, Some(advice)) => format!("{error}; {advice}"),
            (false, None) => error.to_string(),
        };
        if error.is_late() { ControllerError::Late { reason, time } } else { ControllerError::Own { reason, time } }
    }
}

impl EgoController for ExecController {
    fn step(&mut self, input: &EgoInput<'_>) -> Result<EgoCommand, ControllerError> {
        input.check_finite()?;
        let answer = self.request(input).map_err(|error| self.failure(&error, input.time))?;
        Ok(EgoCommand {
            acceleration_mps2: answer.acceleration_mps2,
            state: answer.state,
            reason: Reason::External,
            plan: None,
        })
    }

    fn process(&self) -> Option<u32> {
        self.child.as_ref().map(Child::id)
    }

    fn finish(&mut self, time: Time) -> Result<(), ControllerError> {
        let Some(child) = &mut self.child else { return Ok(()) };
        // The process of a library or an FMU first frees the controller.
        let finished =
            if self.repeats_time { child.finish_run(&self.name, self.settings.timeout()) } else { child.finish() };
        finished.map_err(|error| self.failure(&error, time))
    }
}
