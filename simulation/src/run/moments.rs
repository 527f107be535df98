//! Finds the moments of the encounter for which the margin increase system is made.
//!
//! ```text
//!  with the system     (b) R comes near ─▶ (c) R pulls out ─▶ (d) F brakes ─▶ (e) R is at d_c ─▶ R has passed E
//!                          E slows gently     E slows gently      E has its margin, and need not brake yet
//!  without the system  (b) R comes near ─▶ (d) F brakes ─▶ (a) E brakes hard in front of R
//! ```
//!
//! E is the ego, F the lead vehicle, R the rear vehicle, and d_c the critical distance. The moments
//! follow from the ground truth, not from the controller, so that runs with and without the system
//! can be compared. Each is noted once. They may occur in another order: the lead vehicle may brake
//! early.

use closecall_traffic::Time;

use closecall_scenarios::outcome::{Moment, ReachedMoment};

/// Collects the moments of a run.
#[derive(Debug)]
pub(super) struct Moments {
    noted: Vec<ReachedMoment>,
}

impl Default for Moments {
    fn default() -> Self {
        Self { noted: Vec::with_capacity(Moment::ALL.len()) }
    }
}

impl Moments {
    /// Notes that `moment` is reached at `time`, unless it was reached before.
    pub(super) fn note(&mut self, moment: Moment, time: Time) {
        if !self.noted.iter().any(|noted| noted.moment == moment) {
            self.noted.push(ReachedMoment { moment, time });
        }
    }

    /// Returns the moments that were reached, in order of time.
    pub(super) fn finish(mut self) -> Vec<ReachedMoment> {
        self.noted.sort_by_key(|noted| (noted.time, noted.moment));
        self.noted
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_moment_is_noted_once_and_they_come_in_order_of_time() {
        let mut moments = Moments::default();
        moments.note(Moment::FrontBrakes, Time::from_ms(40));
        moments.note(Moment::RearNear, Time::from_ms(40));
        moments.note(Moment::RearNear, Time::from_ms(80));
        let noted: Vec<_> =
            moments.finish().iter().map(|noted| (noted.moment.letter().unwrap(), noted.time.ns())).collect();
        assert_eq!(noted, [('b', 40_000_000), ('d', 40_000_000)]);
    }
}
