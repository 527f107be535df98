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
//! can be compared. Each is noted once, with its vehicle: if several vehicles come from behind,
//! their moments may belong to different ones. They may occur in another order: the lead vehicle
//! may brake early.

use closecall_traffic::{ActorId, Time};

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
    /// Notes that `vehicle` reaches `moment` at `time`, unless it was reached before.
    pub(super) fn note(&mut self, moment: Moment, time: Time, vehicle: Option<&ActorId>) {
        if !self.noted.iter().any(|noted| noted.moment == moment) {
            self.noted.push(ReachedMoment { moment, time, vehicle: vehicle.cloned() });
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
        let [first, second] = ["first", "second"].map(|name| ActorId::new(name).unwrap());
        moments.note(Moment::FrontBrakes, Time::from_ms(40), None);
        moments.note(Moment::RearNear, Time::from_ms(40), Some(&first));
        moments.note(Moment::RearNear, Time::from_ms(80), Some(&second));
        let noted = moments.finish();
        let letters_and_times: Vec<_> =
            noted.iter().map(|noted| (noted.moment.letter().unwrap(), noted.time.ns())).collect();
        assert_eq!(letters_and_times, [('b', 40_000_000), ('d', 40_000_000)]);
        assert_eq!(noted[0].vehicle, Some(first), "the vehicle that came near first");
    }
}
