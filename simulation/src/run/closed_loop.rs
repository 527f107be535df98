//! The loop itself.

use super::state::Run;
use super::{Arm, Observer, RunKey, SampleError};
use crate::outcome::Outcome;
use crate::scenario::Scenario;

/// Runs one concrete scenario to its end.
///
/// # Errors
/// [`SampleError`] if a controller, a driver or a sensor fails: the sample then has no outcome, and no verdict is given
/// on it.
pub fn simulate(
    scenario: &Scenario,
    key: RunKey,
    arm: &Arm,
    observer: &mut dyn Observer,
) -> Result<Outcome, SampleError> {
    let mut run = Run::new(scenario, key, arm)?;
    loop {
        run.show_motion(observer);
        run.look_around(observer);
        if run.is_control_step() {
            run.perceive_and_control(observer)?;
        }
        if let Some(end) = run.end() {
            return Ok(run.finish(end));
        }
        run.drive(observer)?;
        run.advance(observer);
    }
}
