//! A library or an FMU as an ego controller of the closed loop.

use crate::{ControllerError, EgoCommand, EgoController, EgoInput, EgoSettings, LeadVehicleSelector, Reason};
use closecall_traffic::Time;

use crate::external::exchange::{Answer, Input, Setup};
use crate::external::fmu::VariableTable;
use crate::external::identity::Run;
use crate::external::loaded::Loaded;
use crate::external::watch::Call;

/// A controller of a library or an FMU in this process. It is created at the first step.
pub struct NativeController {
    loaded: Loaded,
    settings: EgoSettings,
    lead: LeadVehicleSelector,
    input: Input,
    session: Session,
    table: VariableTable,
}

impl NativeController {
    /// Returns a controller for one run with the settings of the scenario's ego stack, and its
    /// names of the variables of an FMU.
    pub fn new(loaded: Loaded, settings: &EgoSettings, table: &VariableTable) -> Self {
        Self {
            loaded,
            settings: *settings,
            lead: LeadVehicleSelector::default(),
            input: Input::default(),
            session: Session::default(),
            table: table.clone(),
        }
    }
}

impl EgoController for NativeController {
    fn step(&mut self, input: &EgoInput<'_>) -> Result<EgoCommand, ControllerError> {
        input.check_finite()?;
        let front = self.lead.update(input);
        self.input.set(input, front);
        let setup = || Setup::new(&self.settings, input.road, input.odometry.lane);
        let answer = self.session.step((&self.loaded, &self.table), setup, &self.input);
        let Answer { acceleration_mps2, state } =
            answer.map_err(|reason| ControllerError::Own { reason, time: input.time })?;
        Ok(EgoCommand { acceleration_mps2, state, reason: Reason::External, plan: None })
    }

    fn finish(&mut self, time: Time) -> Result<(), ControllerError> {
        self.session.finish(time).map_err(|reason| ControllerError::Own { reason, time })
    }
}

/// The controller of a run, from its first step on.
#[derive(Default)]
pub(crate) struct Session(Option<Box<dyn Run>>);

impl Session {
    /// Returns the answer to a control step. Creates the controller at the first step.
    pub(crate) fn step(
        &mut self,
        (loaded, table): (&Loaded, &VariableTable),
        setup: impl FnOnce() -> Setup,
        input: &Input,
    ) -> Result<Answer, String> {
        // It may first have to read its files, or to start an interpreter.
        let begin = if self.0.is_none() { Call::begin_start } else { Call::begin };
        let call = begin(Time::from_ns(input.values().time_ns));
        let run = match &mut self.0 {
            Some(run) => run,
            None => self.0.insert(loaded.start(&setup(), table)?),
        };
        let answer = run.step(input);
        drop(call);
        answer
    }

    /// Ends the run at `time`.
    pub(crate) fn finish(&mut self, time: Time) -> Result<(), String> {
        let _call = Call::begin(time);
        self.0.as_mut().map_or(Ok(()), |run| run.finish())
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        if let Some(run) = self.0.take() {
            let _call = Call::begin(Time::ZERO);
            drop(run);
        }
    }
}
