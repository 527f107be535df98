//! A run whose commands come from outside, one control step after the other.

use std::borrow::Cow;
use std::sync::Arc;

use closecall_controllers::{ControllerError, EgoCommand, EgoController, EgoInput, EgoSettings};
use closecall_sensors::SensorMode;

use super::state::{Next, Run};
use super::{Arm, ControllerFactory, CurrentMargins, Observer, RunKey, SampleError};
use closecall_scenarios::Scenario;
use closecall_scenarios::outcome::Outcome;

/// The name of the controller in the outcome of a run that is stepped from outside.
const NAME: &str = "external";

/// A run that is stepped from outside: its caller decides the command of each control step, as a
/// learning algorithm does.
///
/// It is the run that [`simulate`](super::simulate) makes of a controller that gives the same
/// commands, down to the last bit.
pub struct Stepper {
    run: Option<Run<'static>>,
    outcome: Option<Outcome>,
}

impl Stepper {
    /// Starts a run, and goes on to its first control step. `sensors` is the depth of the sensor
    /// simulation, or `None` for the scenario's own.
    ///
    /// # Errors
    /// [`SampleError`] if the run cannot start.
    pub fn new(
        scenario: Scenario,
        key: RunKey,
        sensors: Option<SensorMode>,
        observer: &mut dyn Observer,
    ) -> Result<Self, SampleError> {
        let arm = Arm { controller: Arc::new(External), sensors };
        let run = Run::new(Cow::Owned(scenario), key, Cow::Owned(arm), observer)?;
        let mut stepper = Self { run: Some(run), outcome: None };
        stepper.go_on(observer)?;
        Ok(stepper)
    }

    /// Returns the input for the next command; `None` if the run has ended.
    pub fn input(&self) -> Option<EgoInput<'_>> {
        self.run.as_ref().map(Run::input)
    }

    /// Returns the scenario; `None` if the run has ended.
    pub fn scenario(&self) -> Option<&Scenario> {
        self.run.as_ref().map(Run::scenario)
    }

    /// Returns the true margins of the ego; `None` if the run has ended. They are for judging: no
    /// controller knows them.
    pub fn margins(&self) -> Option<&CurrentMargins> {
        self.run.as_ref().map(Run::margins)
    }

    /// Returns the outcome; `None` as long as the run goes on.
    pub const fn outcome(&self) -> Option<&Outcome> {
        self.outcome.as_ref()
    }

    /// Commands the ego, and goes on to the next control step or to the end of the run. Does
    /// nothing if the run has ended.
    ///
    /// # Errors
    /// [`SampleError`] if no vehicle could follow the command, or if a driver or a sensor fails. The
    /// run has then ended without an outcome.
    pub fn step(&mut self, command: EgoCommand, observer: &mut dyn Observer) -> Result<(), SampleError> {
        let Some(mut run) = self.run.take() else { return Ok(()) };
        match run.command(command, observer)? {
            Some(end) => {
                run.finish_sensors()?;
                self.outcome = Some(run.finish(end));
            }
            None => {
                self.run = Some(run);
                self.go_on(observer)?;
            }
        }
        Ok(())
    }

    fn go_on(&mut self, observer: &mut dyn Observer) -> Result<(), SampleError> {
        let Some(mut run) = self.run.take() else { return Ok(()) };
        match run.go_on(observer)? {
            Next::Control => self.run = Some(run),
            Next::End(end) => {
                run.finish_sensors()?;
                self.outcome = Some(run.finish(end));
            }
        }
        Ok(())
    }
}

/// Represents the controller outside. The ego starts at the place of the scenario.
struct External;

impl ControllerFactory for External {
    fn name(&self) -> &str {
        NAME
    }

    fn has_mis(&self, _: &EgoSettings) -> bool {
        false
    }

    fn build(&self, _: &EgoSettings) -> Box<dyn EgoController> {
        Box::new(Self)
    }
}

/// The run is never asked for a command of its own.
impl EgoController for External {
    fn step(&mut self, input: &EgoInput<'_>) -> Result<EgoCommand, ControllerError> {
        Err(ControllerError::Own { reason: "the commands of this run come from outside".to_owned(), time: input.time })
    }
}

#[cfg(test)]
mod tests {
    use closecall_controllers::{EgoState, Reason};
    use closecall_traffic::Time;

    use super::*;
    use crate::controller::ControllerChoice;
    use crate::{NoObserver, RunEvent, StepView, simulate};
    use closecall_scenarios::source;

    /// Collects the commands of a run.
    #[derive(Default)]
    struct Commands(Vec<EgoCommand>);

    impl Observer for Commands {
        fn step(&mut self, view: &StepView<'_>) {
            self.0.push(*view.command);
        }

        fn event(&mut self, _: Time, _: &RunEvent) {}
    }

    fn scenario() -> Scenario {
        let file = source::load("low-thw-overtake".as_ref(), &[]).unwrap();
        file.concrete(&file.space().nominal()).unwrap()
    }

    #[test]
    fn the_same_commands_lead_to_the_same_bits() {
        for sample in 0..4 {
            let key = RunKey { seed: 7, sample };
            let arm = Arm { controller: ControllerChoice::ACC.factory(), sensors: Some(SensorMode::Object) };
            let mut commands = Commands::default();
            let expected = simulate(&scenario(), key, &arm, &mut commands).unwrap();
            let (mut commands, mut asked) = (commands.0.into_iter(), 0);
            let mut observer = Commands::default();
            let mut stepper = Stepper::new(scenario(), key, arm.sensors, &mut observer).unwrap();
            while stepper.outcome().is_none() {
                assert!(stepper.input().is_some() && stepper.margins().is_some());
                stepper.step(commands.next().unwrap(), &mut observer).unwrap();
                asked += 1;
            }
            let outcome = stepper.outcome().unwrap();
            assert!(asked > 100 && stepper.input().is_none());
            let named = Outcome { controller: expected.controller.clone(), ..outcome.clone() };
            assert!(named.has_same_bits(&expected), "sample {sample}");
        }
    }

    #[test]
    fn a_command_that_no_vehicle_could_follow_ends_the_run_without_an_outcome() {
        let key = RunKey { seed: 0, sample: 0 };
        let mut stepper = Stepper::new(scenario(), key, Some(SensorMode::Object), &mut NoObserver).unwrap();
        let command = |acceleration_mps2| EgoCommand {
            acceleration_mps2,
            state: EgoState::Following,
            reason: Reason::External,
            plan: None,
        };
        stepper.step(command(-100.0), &mut NoObserver).unwrap();
        let error = stepper.step(command(-100.5), &mut NoObserver).unwrap_err();
        let expected = "the ego controller asked for an acceleration of -100.5 m/s² at 0.04 s: it must be a number from -100 to 100";
        assert_eq!(error.to_string(), expected);
        assert!(stepper.input().is_none() && stepper.outcome().is_none());
        let mut stepper = Stepper::new(scenario(), key, Some(SensorMode::Object), &mut NoObserver).unwrap();
        assert!(matches!(stepper.step(command(f64::NAN), &mut NoObserver), Err(SampleError::Command { .. })));
    }
}
