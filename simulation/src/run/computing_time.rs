//! The computing time of a controller from outside.
//!
//! A command is valid from the instant of its input on: the loop waits for it. A controller that
//! computes for longer than the control period could not do so in a vehicle. Such a run is an
//! error. The mean over the run decides, because a machine with other work delays single steps.

use std::time::{Duration, Instant};

use closecall_controllers::ControllerError;
use closecall_traffic::{CONTROL_STEP, Time};

/// Number of steps from which on the mean counts (-): five seconds of a run. An assumption; 25 to
/// 250 are plausible.
const LEAST_STEPS: u32 = 125;

/// Adds up the computing time of a run.
#[derive(Debug, Default)]
pub(crate) struct ComputingTime {
    spent: Duration,
    steps: u32,
    has_begun: bool,
}

impl ComputingTime {
    /// Calls `step`, and adds the time that it takes.
    ///
    /// # Errors
    /// The error of `step`, or [`ControllerError::Late`] if the mean computing time exceeds the
    /// control period.
    pub(super) fn of<T>(
        &mut self,
        time: Time,
        step: impl FnOnce() -> Result<T, ControllerError>,
    ) -> Result<T, ControllerError> {
        let begun = Instant::now();
        let command = step()?;
        self.add(time, begun.elapsed())?;
        Ok(command)
    }

    /// Adds the time of a step of a controller.
    fn add(&mut self, time: Time, spent: Duration) -> Result<(), ControllerError> {
        match self.exceeded(spent, 1e3 * CONTROL_STEP.s()) {
            Some(message) => Err(ControllerError::Late { reason: format!("the controller {message}"), time }),
            None => Ok(()),
        }
    }

    /// Adds the time of a step. That of the first does not count: a program starts in it. Returns a message if the mean exceeds
    /// `allowed_ms`.
    pub(crate) fn exceeded(&mut self, spent: Duration, allowed_ms: f64) -> Option<String> {
        if !std::mem::replace(&mut self.has_begun, true) {
            return None;
        }
        self.spent += spent;
        self.steps += 1;
        let mean_ms = 1e3 * self.spent.as_secs_f64() / f64::from(self.steps);
        (self.steps >= LEAST_STEPS && mean_ms > allowed_ms).then(|| {
            format!("computes for {mean_ms:.0} ms in the mean of {} steps, and has {allowed_ms:.0} ms", self.steps)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the step that is refused, of 300 that take as long as stated.
    fn refused(took_ms: impl Fn(u32) -> u64) -> Option<u32> {
        let mut computing = ComputingTime::default();
        (0..300).find(|&step| computing.add(Time::ZERO, Duration::from_millis(took_ms(step))).is_err())
    }

    #[test]
    fn a_controller_that_needs_longer_than_the_control_period_is_refused() {
        assert_eq!(refused(|_| 60), Some(LEAST_STEPS));
        assert_eq!(refused(|_| 39), None);
    }

    #[test]
    fn a_slow_start_and_single_delays_are_not() {
        assert_eq!(refused(|step| if step == 0 { 9_000 } else { 2 }), None);
        assert_eq!(refused(|step| if step % 50 == 7 { 900 } else { 2 }), None);
    }
}
