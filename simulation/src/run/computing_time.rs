//! The computing time of a controller from outside.
//!
//! A command is valid from the instant of its input on: the loop waits for it. A controller that
//! computes for longer than the control period could not do so in a vehicle. Such a run is an
//! error. Two figures of the run decide, because a machine with other work delays single steps: the
//! mean, and the share of steps that exceed the period. The mean alone would accept a controller
//! that computes for 150 ms in every fifth step. While this thread itself waits for a processor,
//! the machine is late and not the controller: Linux counts that time, and it is taken off.

use std::time::{Duration, Instant};

use closecall_controllers::ControllerError;
use closecall_traffic::{CONTROL_STEP, Time};

/// Number of steps from which on the mean counts during a run (-): five seconds. An assumption; 25
/// to 250 are plausible.
const LEAST_STEPS: u32 = 125;

/// Number of steps from which on the mean counts at the end of a run (-): one second. An
/// assumption; 10 to 125 are plausible.
const LEAST_STEPS_OF_A_RUN: u32 = 25;

/// Largest share of steps that may exceed the period (-). An assumption: a vehicle's controller has
/// less than 1 %, and a loaded machine delays some steps beyond what Linux counts; 0.02 to 0.15 are
/// plausible.
const MOST_LATE: f64 = 0.1;

/// Adds up the computing time of a run.
#[derive(Debug, Default)]
pub(crate) struct ComputingTime {
    spent: Duration,
    steps: u32,
    /// Number of steps that exceeded the period.
    late: u32,
    /// Time for which the thread had waited for a processor when it was last asked.
    waited: Duration,
    has_begun: bool,
}

impl ComputingTime {
    /// Calls `step`, and adds the time that it takes.
    ///
    /// # Errors
    /// The error of `step`, or [`ControllerError::Late`] if the mean computing time, or the time of
    /// too many steps, exceeds the control period.
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

    /// Adds the time of a step. The time of the first does not count: a program starts in it. Returns a
    /// message if the mean, or the time of too many steps, exceeds `allowed_ms`.
    pub(crate) fn exceeded(&mut self, spent: Duration, allowed_ms: f64) -> Option<String> {
        if !std::mem::replace(&mut self.has_begun, true) {
            self.waited = waited();
            return None;
        }
        self.spent += spent;
        self.steps += 1;
        if 1e3 * spent.as_secs_f64() > allowed_ms {
            let before = std::mem::replace(&mut self.waited, waited());
            let of_machine = self.waited.saturating_sub(before);
            self.late += u32::from(1e3 * spent.saturating_sub(of_machine).as_secs_f64() > allowed_ms);
        }
        self.judged(LEAST_STEPS, allowed_ms)
    }

    /// Judges a run that is over, and may have been short.
    ///
    /// # Errors
    /// [`ControllerError::Late`] as in [`ComputingTime::of`].
    pub(super) fn finish(&self, time: Time) -> Result<(), ControllerError> {
        match self.judged(LEAST_STEPS_OF_A_RUN, 1e3 * CONTROL_STEP.s()) {
            Some(message) => Err(ControllerError::Late { reason: format!("the controller {message}"), time }),
            None => Ok(()),
        }
    }

    /// Returns a message if the mean, or the time of too many steps, exceeds `allowed_ms`, and
    /// there are enough steps.
    fn judged(&self, least_steps: u32, allowed_ms: f64) -> Option<String> {
        if self.steps < least_steps {
            return None;
        }
        let steps = f64::from(self.steps);
        let (mean_ms, late) = (1e3 * self.spent.as_secs_f64() / steps, f64::from(self.late) / steps);
        if mean_ms > allowed_ms {
            return Some(format!(
                "computes for {mean_ms:.0} ms in the mean of {steps} steps, and has {allowed_ms:.0} ms"
            ));
        }
        (late > MOST_LATE).then(|| {
            let [late, most] = [late, MOST_LATE].map(|share| 100.0 * share);
            format!(
                "computes for more than its {allowed_ms:.0} ms in {late:.0} % of {steps} steps, and may in {most:.0} %"
            )
        })
    }
}

/// Returns the time for which this thread has waited for a processor while it could have run: the
/// second number of `schedstat` in Linux (proc(5)). Zero where the system does not count it.
fn waited() -> Duration {
    let counted = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let waited_ns = counted.and_then(|text| text.split_whitespace().nth(1)?.parse().ok());
    waited_ns.map_or(Duration::ZERO, Duration::from_nanos)
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

    #[test]
    fn a_short_run_is_judged_at_its_end() {
        let ended_after = |steps: u32, took_ms: u64| {
            let mut computing = ComputingTime::default();
            (0..=steps).for_each(|_| computing.add(Time::ZERO, Duration::from_millis(took_ms)).unwrap());
            computing.finish(Time::ZERO)
        };
        assert!(ended_after(LEAST_STEPS_OF_A_RUN, 60).is_err());
        assert!(ended_after(LEAST_STEPS_OF_A_RUN - 1, 60).is_ok());
        assert!(ended_after(LEAST_STEPS - 1, 2).is_ok());
    }

    #[test]
    fn bursts_that_keep_the_mean_are_refused() {
        assert_eq!(refused(|step| if step % 5 == 0 { 150 } else { 0 }), Some(LEAST_STEPS));
        assert_eq!(refused(|step| if step % 8 == 0 { 300 } else { 0 }), Some(LEAST_STEPS));
        // Fast for six seconds, and late from then on.
        let first_late = refused(|step| if step > 150 { 60 } else { 1 }).unwrap();
        assert!((160..200).contains(&first_late), "{first_late}");
        assert_eq!(refused(|step| if step % 12 == 0 { 150 } else { 0 }), None);
    }
}
