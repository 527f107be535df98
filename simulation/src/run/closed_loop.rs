//! The loop of one run.

use std::borrow::Cow;

use super::equipment::controller;
use super::state::{Next, Run, settings_of};
use super::{Arm, Observer, RunKey, SampleError};
use crate::outcome::Outcome;
use crate::scenario::Scenario;

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
    let mut run = Run::new(Cow::Borrowed(scenario), key, Cow::Borrowed(arm))?;
    let mut controller = controller(scenario, settings_of(scenario), arm);
    loop {
        match run.go_on(observer)? {
            Next::End(end) => return Ok(run.finish(end)),
            Next::Control => {
                let command = controller.step(&run.input())?;
                if let Some(end) = run.command(command, observer)? {
                    return Ok(run.finish(end));
                }
            }
        }
    }
}
