//! A process as an ego controller of the closed loop.

use std::time::Duration;

use closecall_controllers::{ControllerError, EgoCommand, EgoController, EgoInput, EgoSettings, FrontFollower, Reason};

use super::child::Child;
use super::error::ExecError;
use super::settings::ExecSettings;
use super::{NAME, protocol};
use crate::run::ControllerFactory;

/// Time limit of the answer to the first message. The process may first have to load an interpreter and its libraries,
/// perhaps on a busy machine.
const START_TIMEOUT: Duration = Duration::from_secs(10);

/// Creates controllers that run as separate processes.
#[derive(Clone, Debug)]
pub struct ExecFactory {
    settings: ExecSettings,
}

impl ExecFactory {
    /// Creates a factory of processes with these settings.
    pub fn new(settings: ExecSettings) -> Self {
        Self { settings }
    }
}

impl ControllerFactory for ExecFactory {
    fn name(&self) -> &str {
        NAME
    }

    /// The outcome summarises the states that the process reports if the scenario has a margin increase system.
    fn has_mis(&self, settings: &EgoSettings) -> bool {
        settings.mis().is_some()
    }

    fn build(&self, settings: &EgoSettings) -> Box<dyn EgoController> {
        Box::new(ExecController {
            settings: self.settings.clone(),
            ego_settings: *settings,
            lead_selector: FrontFollower::default(),
            child: None,
        })
    }
}

/// A process that controls the ego in one run. It is started at the first step and ended when this value is dropped.
struct ExecController {
    settings: ExecSettings,
    ego_settings: EgoSettings,
    lead_selector: FrontFollower,
    child: Option<Child>,
}

impl ExecController {
    /// Sends the message of a control step and returns the answer. Starts the process if there is none yet.
    fn request(&mut self, input: &EgoInput<'_>) -> Result<protocol::Answer, ExecError> {
        let front = self.lead_selector.update(input);
        let child = match &mut self.child {
            Some(child) => child,
            None => {
                let mut child = Child::start(&self.settings)?;
                let timeout = START_TIMEOUT.max(self.settings.timeout());
                let hello = child.request(protocol::hello(&self.ego_settings, input.road), timeout)?;
                protocol::check_hello(&hello)?;
                self.child.insert(child)
            }
        };
        protocol::parse_answer(&child.request(protocol::step(input, front), self.settings.timeout())?)
    }
}

impl EgoController for ExecController {
    fn step(&mut self, input: &EgoInput<'_>) -> Result<EgoCommand, ControllerError> {
        input.check_finite()?;
        let answer = self
            .request(input)
            .map_err(|error| ControllerError::Own { reason: error.to_string(), time: input.time })?;
        Ok(EgoCommand {
            acceleration_mps2: answer.acceleration_mps2,
            state: answer.state,
            reason: Reason::External,
            plan: None,
        })
    }
}
