//! The loop of one run.

use std::borrow::Cow;
use std::time::Duration;

use closecall_controllers::EgoController;

use super::computing_time::{ComputingTime, control_period};
use super::equipment::controller;
use super::state::{Next, Run, settings_of};
use super::{Arm, Observer, RunKey, SampleError};
use closecall_scenarios::Scenario;
use closecall_scenarios::outcome::Outcome;

/// Runs one concrete scenario to its end and returns its outcome.
///
/// # Errors
/// [`SampleError`] if the controller, a driver or a sensor fails. The sample then has no outcome.
pub fn simulate(
    scenario: &Scenario,
    key: RunKey,
    arm: &Arm,
    observer: &mut dyn Observer,
) -> Result<Outcome, SampleError> {
    let mut run = Run::new(Cow::Borrowed(scenario), key, Cow::Borrowed(arm), observer)?;
    let mut controller = controller(scenario, settings_of(scenario), arm);
    let budget = scenario.computing.map_or_else(control_period, |computing| Duration::from_secs_f64(computing.s()));
    let mut computing = (!arm.controller.is_built_in()).then(|| ComputingTime::new(budget));
    let end = loop {
        match run.go_on(observer)? {
            Next::End(end) => break end,
            Next::Control => {
                let input = run.input();
                let command = match &mut computing {
                    Some(computing) => {
                        let step = |controller: &mut Box<dyn EgoController>| controller.step(&input);
                        computing.of(input.time, &mut controller, step, |controller| controller.process())
                    }
                    None => controller.step(&input),
                }?;
                if let Some(end) = run.command(command, observer)? {
                    break end;
                }
            }
        }
    };
    controller.finish(run.time())?;
    if let Some(computing) = &computing {
        computing.finish(run.time())?;
    }
    run.finish_sensors()?;
    Ok(run.finish(end))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use closecall_controllers::{ControllerError, EgoCommand, EgoInput, EgoSettings, EgoState, Reason};
    use closecall_sensors::SensorMode;
    use closecall_traffic::{Source, Time, VehicleState};

    use super::*;
    use crate::controller::ControllerChoice;
    use crate::{ControllerFactory, NoObserver, RunEvent, StepView};
    use closecall_scenarios::source;

    /// Counts the tracks of the sensors that look back.
    #[derive(Default)]
    struct RearTracks(usize);

    impl Observer for RearTracks {
        fn step(&mut self, view: &StepView<'_>) {
            self.0 += view.tracks.iter().filter(|track| track.source == Source::Rear).count();
        }

        fn event(&mut self, _: Time, _: &RunEvent) {}
    }

    #[test]
    fn rear_sensors_that_only_an_observer_needs_leave_the_outcome_as_it_is() {
        let file = source::load("low-thw-overtake".as_ref(), &["duration-s=15".parse().unwrap()]).unwrap();
        let scenario = file.concrete(&file.space().nominal()).unwrap();
        let key = RunKey { seed: 3, sample: 1 };
        for controller in [ControllerChoice::ACC, "gap-1.6".parse().unwrap()] {
            let arm = Arm { controller: controller.factory(), sensors: Some(SensorMode::Full) };
            let mut observer = RearTracks::default();
            let observed = simulate(&scenario, key, &arm, &mut observer).unwrap();
            assert!(observer.0 > 100, "the observer sees {} tracks of the rear sensors", observer.0);
            assert!(simulate(&scenario, key, &arm, &mut NoObserver).unwrap().has_same_bits(&observed));
        }
    }

    #[test]
    fn a_controller_that_looks_back_has_its_sensors_without_an_observer() {
        let file = source::load("low-thw-overtake".as_ref(), &[]).unwrap();
        let scenario = file.concrete(&file.space().nominal()).unwrap();
        let arm =
            Arm { controller: "mis".parse::<ControllerChoice>().unwrap().factory(), sensors: Some(SensorMode::Full) };
        let outcome = simulate(&scenario, RunKey { seed: 3, sample: 1 }, &arm, &mut NoObserver).unwrap();
        assert!(outcome.mis.unwrap().engaged_at_s.is_ok());
    }

    /// Brakes from the first step after one second on.
    struct LateBraking;

    impl ControllerFactory for LateBraking {
        fn name(&self) -> &str {
            "late-braking"
        }

        fn has_mis(&self, _: &EgoSettings) -> bool {
            false
        }

        fn build(&self, _: &EgoSettings) -> Box<dyn EgoController> {
            Box::new(Self)
        }
    }

    impl EgoController for LateBraking {
        fn step(&mut self, input: &EgoInput<'_>) -> Result<EgoCommand, ControllerError> {
            let acceleration_mps2 = if input.time > Time::from_ms(1_000) { -3.0 } else { 0.0 };
            let (state, reason) = (EgoState::Following, Reason::External);
            Ok(EgoCommand { acceleration_mps2, state, reason, plan: None })
        }
    }

    /// Notes when the ego begins to brake.
    struct Braking {
        ego: usize,
        from: Option<Time>,
    }

    impl Observer for Braking {
        fn moved(&mut self, time: Time, states: &mut dyn Iterator<Item = VehicleState>) {
            if states.nth(self.ego).is_some_and(|ego| ego.acceleration_mps2 < -1e-3) {
                self.from.get_or_insert(time);
            }
        }

        fn step(&mut self, _: &StepView<'_>) {}

        fn event(&mut self, _: Time, _: &RunEvent) {}
    }

    #[test]
    fn a_command_takes_effect_after_the_stated_computing_time() {
        let begins = |settings: &[&str]| {
            let settings: Vec<_> = ["duration-s=3"].iter().chain(settings).map(|set| set.parse().unwrap()).collect();
            let file = source::load("low-thw-overtake".as_ref(), &settings).unwrap();
            let scenario = file.concrete(&file.space().nominal()).unwrap();
            let arm = Arm { controller: Arc::new(LateBraking), sensors: Some(SensorMode::GroundTruth) };
            let mut braking = Braking { ego: scenario.ego, from: None };
            simulate(&scenario, RunKey { seed: 3, sample: 1 }, &arm, &mut braking).unwrap();
            braking.from.unwrap()
        };
        let at_once = begins(&[]);
        for (computing_s, later_ms) in [(0.01, 10), (0.012, 20), (0.03, 30), (0.04, 40)] {
            let later = begins(&[&format!("controller.computing-s={computing_s}")]);
            assert_eq!(later - at_once, Time::from_ms(later_ms), "{computing_s}");
        }
    }
}
