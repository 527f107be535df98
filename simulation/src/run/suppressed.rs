//! A margin increase system that does not drive in some of its states.

use closecall_controllers::{ControllerError, EgoCommand, EgoController, EgoInput, EgoSettings, EgoStack};

use closecall_scenarios::MisState;
use closecall_traffic::Time;

/// An ego stack whose margin increase system does not drive in some of its states: in these, cruise
/// control and emergency braking drive alone. The system itself goes through its states unchanged.
pub(super) struct Suppressed {
    stack: Box<dyn EgoController>,
    without_mis: EgoStack,
    off: Vec<MisState>,
}

impl Suppressed {
    /// Creates the controller of one run. `settings` are the settings of `stack`.
    pub(super) fn new(stack: Box<dyn EgoController>, settings: EgoSettings, off: Vec<MisState>) -> Self {
        Self { stack, without_mis: EgoStack::without_mis(settings), off }
    }
}

impl EgoController for Suppressed {
    fn step(&mut self, input: &EgoInput<'_>) -> Result<EgoCommand, ControllerError> {
        let command = self.stack.step(input)?;
        let plain = self.without_mis.step(input)?;
        if !self.off.iter().any(|state| state.is(command.state)) {
            return Ok(command);
        }
        Ok(EgoCommand { acceleration_mps2: plain.acceleration_mps2, ..command })
    }

    fn finish(&mut self, time: Time) -> Result<(), ControllerError> {
        self.stack.finish(time)
    }
}
