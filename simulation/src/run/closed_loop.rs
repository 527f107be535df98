//! The loop of one run.

use super::state::Run;
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
    let mut run = Run::new(scenario, key, arm)?;
    loop {
        run.report_motion(observer);
        run.update_surroundings(observer);
        if run.is_control_step() {
            run.perceive_and_control(observer)?;
        }
        if let Some(end) = run.end() {
            return Ok(run.finish(end));
        }
        run.decide_actions(observer)?;
        run.advance(observer);
    }
}
