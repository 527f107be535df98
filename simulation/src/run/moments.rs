//! Finds the five moments of the encounter for which the margin increase system is made.
//!
//! ```text
//!  (a) R comes near ─▶ (b) R pulls out ─▶ (c) R is at d_c ─▶ (d) F brakes ─▶ (e) R has passed E
//!      E follows F         E slows gently     E has its margin       E need not      E is free to brake
//! ```
//!
//! E is the ego, F the lead vehicle, R the rear vehicle, and d_c the critical distance. The moments follow from the
//! ground truth, not from the controller, so that runs with and without the system can be compared. Each is noted once.
//! The last four may occur in another order: the lead vehicle may brake early.

use closecall_traffic::Time;

use crate::outcome::{Moment, MomentAt};

/// Collects the moments of a run.
#[derive(Debug, Default)]
pub(super) struct Moments {
    noted: Vec<MomentAt>,
}

impl Moments {
    /// Notes that `moment` is reached at `time`, unless it was reached before.
    pub(super) fn note(&mut self, moment: Moment, time: Time) {
        if !self.noted.iter().any(|known| known.moment == moment) {
            self.noted.push(MomentAt { moment, time });
        }
    }

    /// Returns the moments that were reached, in order of time.
    pub(super) fn finish(mut self) -> Vec<MomentAt> {
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
        let noted: Vec<_> = moments.finish().iter().map(|noted| (noted.moment.letter(), noted.time.ns())).collect();
        assert_eq!(noted, [('a', 40_000_000), ('d', 40_000_000)]);
    }
}
