//! The process as a controller of the loop.

use std::time::Duration;

use closecall_controllers::{ControllerError, EgoCommand, EgoController, EgoInput, EgoSettings, FrontFollower, Reason};

use super::child::Child;
use super::error::ExecError;
use super::settings::ExecSettings;
use super::{NAME, protocol};
use crate::run::ControllerFactory;

/// Time for the answer to the first line: an interpreter and its libraries have to be loaded first, perhaps on a busy
/// machine.
const START_WITHIN: Duration = Duration::from_secs(10);

/// Makes controllers that are processes.
#[derive(Clone, Debug)]
pub struct ExecFactory {
    settings: ExecSettings,
}

impl ExecFactory {
    /// A factory of processes of this command.
    pub fn new(settings: ExecSettings) -> Self {
        Self { settings }
    }
}

impl ControllerFactory for ExecFactory {
    fn name(&self) -> &str {
        NAME
    }

    /// The states that the process reports are summed up where the scenario has a margin increase system.
    fn has_mis(&self, settings: &EgoSettings) -> bool {
        settings.mis().is_some()
    }

    fn build(&self, settings: &EgoSettings) -> Box<dyn EgoController> {
        Box::new(ExecController {
            exec: self.settings.clone(),
            ego: *settings,
            front: FrontFollower::default(),
            child: None,
        })
    }
}

/// A process that controls E in one run. It is started with the first step, and killed with this.
struct ExecController {
    exec: ExecSettings,
    ego: EgoSettings,
    front: FrontFollower,
    child: Option<Child>,
}

impl ExecController {
    fn ask(&mut self, input: &EgoInput<'_>) -> Result<protocol::Answer, ExecError> {
        let front = self.front.update(input);
        let child = match &mut self.child {
            Some(child) => child,
            None => {
                let mut child = Child::start(&self.exec)?;
                let hello = child.ask(protocol::hello(&self.ego, input.road), START_WITHIN.max(self.exec.timeout()))?;
                protocol::check_hello(&hello)?;
                self.child.insert(child)
            }
        };
        protocol::answer(&child.ask(protocol::step(input, front), self.exec.timeout())?)
    }
}

impl EgoController for ExecController {
    fn step(&mut self, input: &EgoInput<'_>) -> Result<EgoCommand, ControllerError> {
        input.check_finite()?;
        let answer =
            self.ask(input).map_err(|error| ControllerError::Own { reason: error.to_string(), time: input.time })?;
        Ok(EgoCommand {
            acceleration_mps2: answer.acceleration_mps2,
            state: answer.state,
            reason: Reason::External,
            plan: None,
        })
    }
}
