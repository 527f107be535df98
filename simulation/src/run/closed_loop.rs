//! The loop of one run.

use std::borrow::Cow;

use super::computing_time::ComputingTime;
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
    let mut computing = (!arm.controller.is_built_in()).then(ComputingTime::default);
    let end = loop {
        match run.go_on(observer)? {
            Next::End(end) => break end,
            Next::Control => {
                let input = run.input();
                let command = match &mut computing {
                    Some(computing) => computing.of(input.time, || controller.step(&input)),
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
    use closecall_sensors::SensorMode;
    use closecall_traffic::{Source, Time};

    use super::*;
    use crate::controller::ControllerChoice;
    use crate::{NoObserver, RunEvent, StepView};
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
}
