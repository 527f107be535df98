//! The order in which the scans of a sensor arrive whose latency varies.

use super::config::MAX_LATENCY_STEPS;

/// The steps in which the latest scans arrive. No scan overtakes an earlier one.
#[derive(Clone, Debug, Default)]
pub(super) struct Arrivals {
    /// Step in which each of the latest scans arrives; the index is the number of the scan modulo
    /// the length.
    due_steps: [usize; MAX_LATENCY_STEPS + 1],
    /// The same of the scan before.
    previous_due_step: usize,
}

impl Arrivals {
    /// Notes that the scan of `step` needs `latency_steps`, and returns the age in steps of the
    /// newest scan that has arrived by now. Before the first arrival, it is the oldest scan that is
    /// kept.
    pub(super) fn observe(&mut self, step: usize, latency_steps: usize) -> usize {
        let length = self.due_steps.len();
        let due_step = (step + latency_steps.min(MAX_LATENCY_STEPS)).max(self.previous_due_step);
        (self.due_steps[step % length], self.previous_due_step) = (due_step, due_step);
        let has_arrived = |age: &usize| *age <= step && self.due_steps[(step - age) % length] <= step;
        (0..length).find(has_arrived).unwrap_or(MAX_LATENCY_STEPS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ages(latencies: impl IntoIterator<Item = usize>) -> Vec<usize> {
        let mut arrivals = Arrivals::default();
        latencies.into_iter().enumerate().map(|(step, latency)| arrivals.observe(step, latency)).collect()
    }

    #[test]
    fn a_constant_latency_is_the_age_once_a_scan_has_arrived() {
        assert_eq!(ages([2; 6]), [10, 10, 2, 2, 2, 2]);
        assert_eq!(ages([0; 3]), [0, 0, 0]);
        assert_eq!(ages([99; 30])[10..], [10; 20], "no scan is later");
    }

    #[test]
    fn a_late_scan_delays_later_scans() {
        // The scan of step 2 is 3 steps late: in step 5, the scans of steps 2, 3, 4 and 5 arrive
        // together.
        assert_eq!(ages([0, 0, 3, 0, 0, 0, 0]), [0, 0, 1, 2, 3, 0, 0]);
    }
}
