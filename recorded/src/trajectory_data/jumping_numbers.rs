//! Numbers that jump from vehicle to vehicle in most rows.
//!
//! ```text
//!   frame 1   ■ 1    ■ 2     ■ 3
//!   frame 2    ■ 3    ■ 1     ■ 2     numbers that count the vehicles of each frame anew
//! ```
//!
//! Such steps look like wrong units, axes or headings. A wrong unit changes all steps alike: the steps
//! of a vehicle then still follow one another steadily.

use std::collections::BTreeMap;

use closecall_traffic::{Time, maths};

use super::continuity::{JUMP_ALONG_M, JUMP_ALONG_MPS};
use super::error::TrajectoryFileProblem;
use super::plausible::MIN_STEPS;
use super::reference_line::Point;

/// Least change of the velocity, as a share of the larger one, that is unsteady in any unit (-).
const UNSTEADY_SHARE: f64 = 0.5;

/// How steadily the numbers of vehicles move.
#[derive(Debug, Default)]
pub(super) struct NumberSteps {
    latest: BTreeMap<(u64, Time), Latest>,
    steps: usize,
    unsteady: usize,
}

/// A number in its latest row.
#[derive(Clone, Copy, Debug)]
struct Latest {
    time: Time,
    point: Point,
    /// Velocity by the latest step (m/s).
    velocity_mps: Option<Point>,
}

impl NumberSteps {
    /// Adds a row of a vehicle, whose number counts from `origin` on. The rows of each vehicle have to be in the
    /// order of their times.
    pub(super) fn add(&mut self, number: u64, origin: Time, time: Time, point: Point) {
        let latest = self.latest.entry((number, origin)).or_insert(Latest { time, point, velocity_mps: None });
        let step_s = (time - latest.time).s();
        if !(step_s > 0.0) {
            return;
        }
        let velocity = ((point.0 - latest.point.0) / step_s, (point.1 - latest.point.1) / step_s);
        if let Some(before) = latest.velocity_mps {
            let change_mps = maths::hypot(velocity.0 - before.0, velocity.1 - before.1);
            let larger_mps = maths::hypot(velocity.0, velocity.1).max(maths::hypot(before.0, before.1));
            let least_mps = JUMP_ALONG_MPS.max(JUMP_ALONG_M / step_s).max(UNSTEADY_SHARE * larger_mps);
            self.steps += 1;
            self.unsteady += usize::from(change_mps > least_mps);
        }
        *latest = Latest { time, point, velocity_mps: Some(velocity) };
    }

    /// Checks the rows so far.
    ///
    /// # Errors
    /// Numbers jump in most steps.
    pub(super) fn check(&self) -> Result<(), TrajectoryFileProblem> {
        if self.steps >= MIN_STEPS && 2 * self.unsteady > self.steps {
            let percent = 100.0 * self.unsteady as f64 / self.steps as f64;
            return Err(TrajectoryFileProblem::JumpingNumbers { percent });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks ten vehicles at 30 m/s and 10 Hz, 50 m apart and in three lanes, whose numbers and positions in metres
    /// `written` changes.
    fn check(written: impl Fn(u32, u32, Point) -> (u64, Point)) -> Result<(), TrajectoryFileProblem> {
        let mut steps = NumberSteps::default();
        for frame in 0..100_u32 {
            for vehicle in 0..10_u32 {
                let place = (50.0 * f64::from(vehicle) + 3.0 * f64::from(frame), 3.5 * f64::from(vehicle % 3));
                let (number, point) = written(frame, vehicle, place);
                steps.add(number, Time::ZERO, Time::from_ms(100) * i64::from(frame), point);
            }
        }
        steps.check()
    }

    #[test]
    fn numbers_that_are_given_anew_in_each_frame_are_refused_and_units_are_not() {
        check(|_, vehicle, place| (u64::from(vehicle), place)).unwrap();
        for scale in [-1.0, 0.3, 3.28, 1000.0] {
            check(|_, vehicle, (s_m, d_m)| (u64::from(vehicle), (scale * s_m, scale * d_m))).unwrap();
        }
        // Every second frame gives the numbers in another order.
        let jumping = check(|frame, vehicle, place| (u64::from((vehicle + 3 * (frame / 2)) % 10), place));
        assert!(matches!(jumping, Err(TrajectoryFileProblem::JumpingNumbers { .. })), "{jumping:?}");
        // A few swaps split tracks and are no reason to refuse the file.
        check(|frame, vehicle, place| (u64::from(vehicle ^ u32::from(frame > 50)), place)).unwrap();
    }
}
