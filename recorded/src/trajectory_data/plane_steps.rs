//! What the steps of vehicles in a plane say of their headings, their speeds and the time, before a road is
//! derived from them.
//!
//! ```text
//!   ■─▶ ■─▶ ■─▶ ■─▶     heading and movement agree: 1 step in 1
//!   ■─▶      ■─▶        and the distance is speed · time
//! ```
//!
//! A road is derived or chosen by the headings, and the paths of vehicles are split by their speeds. If one of
//! them is wrong, every step is one that no vehicle makes, the traffic seems not to move, or it is on the road of
//! the other direction.

use std::collections::BTreeMap;

use closecall_traffic::statistics::quantiles::median;
use closecall_traffic::{Time, maths};

use super::error::TrajectoryFileProblem;
use super::file_layout::Layout;
use super::jumping_numbers::NumberSteps;
use super::plane_pieces::PlaneMoment;
use super::plausible::{MIN_SPEED_MPS, MIN_STEPS, check_ratio};

/// Number of steps that are judged.
const ENOUGH: usize = 200_000;
/// Least movement that shows a direction (m). The positions of a standing vehicle vary by less than a metre.
const LEAST_MOVEMENT_M: f64 = 2.0;
/// Least number of such movements.
const LEAST_STEPS: usize = 50;
/// Cosine of the largest angle between a heading and the movement, 30° (-).
const MOST_TURNED: f64 = 0.866;
/// Share of the movements that contradict the headings above which a file is refused (-). Headings that are the
/// same for both carriageways contradict half of them; numbers that jump from vehicle to vehicle contradict
/// single ones. An assumption with a plausible range of 0.05 to 0.4.
const CONTRADICTED: f64 = 0.2;

/// The steps of vehicles between two rows.
#[derive(Debug, Default)]
pub(super) struct PlaneSteps {
    latest: BTreeMap<u64, PlaneMoment>,
    /// Where each vehicle began its present movement.
    anchors: BTreeMap<u64, PlaneMoment>,
    movements: usize,
    against: usize,
    /// Distance of each step as a share of the distance that the speed predicts (-).
    ratios: Vec<f64>,
    numbers: NumberSteps,
}

impl PlaneSteps {
    /// Adds a row. The rows of each vehicle have to be in the order of their times.
    pub(super) fn add(&mut self, row: PlaneMoment) {
        if self.movements >= ENOUGH {
            return;
        }
        self.numbers.add(row.vehicle, Time::ZERO, row.time, row.point);
        // A second row of a frame, and rows in backward order, are refused by that reason later.
        if self.latest.get(&row.vehicle).is_some_and(|before| before.time >= row.time) {
            return;
        }
        let Some(before) = self.latest.insert(row.vehicle, row) else { return };
        let (dx, dy) = (row.point.0 - before.point.0, row.point.1 - before.point.1);
        let (moved_m, step_s) = (maths::hypot(dx, dy), (row.time - before.time).s());
        let speed_mps = 0.5 * (before.speed_mps + row.speed_mps);
        if speed_mps > MIN_SPEED_MPS && step_s > 0.0 && self.ratios.len() < ENOUGH {
            self.ratios.push(moved_m / (speed_mps * step_s));
        }
        let anchor = self.anchors.entry(row.vehicle).or_insert(before);
        let (dx, dy) = (row.point.0 - anchor.point.0, row.point.1 - anchor.point.1);
        if maths::hypot(dx, dy) >= LEAST_MOVEMENT_M {
            *anchor = row;
            self.movements += 1;
            self.against += usize::from(maths::cos(maths::atan2(dy, dx) - row.heading_rad) < MOST_TURNED);
        }
    }

    /// Checks the steps so far.
    ///
    /// # Errors
    /// Numbers jump, or the positions contradict the speeds and times, or the headings.
    pub(super) fn check(&self, layout: Layout) -> Result<(), TrajectoryFileProblem> {
        self.numbers.check()?;
        if self.ratios.len() >= MIN_STEPS {
            check_ratio(median(self.ratios.clone()), layout)?;
        }
        match self.contradicted_percent() {
            Some(percent) => Err(TrajectoryFileProblem::HeadingsAgainstMotion { percent }),
            None => Ok(()),
        }
    }

    /// Returns the share of the movements that contradict the headings (%), if it is too large.
    pub(super) fn contradicted_percent(&self) -> Option<f64> {
        let share = self.against as f64 / self.movements.max(1) as f64;
        (self.movements >= LEAST_STEPS && share > CONTRADICTED).then_some(100.0 * share)
    }
}

#[cfg(test)]
mod tests {
    use super::super::source::Clock;
    use super::*;

    /// The rows of a vehicle, in steps of 0.1 s, with these distances along x (m).
    fn along_x(heading_rad: f64, speed_mps: f64, x_m: impl Fn(i32) -> f64) -> PlaneSteps {
        let mut steps = PlaneSteps::default();
        for step in 0..1000 {
            let time = Time::from_s(0.1 * f64::from(step));
            let point = (x_m(step), 0.0);
            steps.add(PlaneMoment { vehicle: 1, time, point, heading_rad, speed_mps, clock: Clock::Continuous });
        }
        steps
    }

    #[test]
    fn a_standing_vehicle_moves_in_no_direction() {
        let standing = along_x(0.0, 0.0, |step| if step % 2 == 0 { 0.6 } else { 0.0 });
        assert_eq!(standing.movements, 0);
        // Slow, and back by 0.4 m in every other step.
        let jam = along_x(0.0, 1.0, |step| 0.1 * f64::from(step) + if step % 2 == 0 { 0.5 } else { 0.0 });
        assert!(jam.movements >= LEAST_STEPS - 10 && jam.against == 0, "{jam:?}");
    }

    #[test]
    fn rows_in_backward_order_say_nothing_of_the_headings() {
        let mut steps = PlaneSteps::default();
        for step in (0..1000).rev() {
            let (time, point) = (Time::from_s(0.1 * f64::from(step)), (2.0 * f64::from(step), 0.0));
            let clock = Clock::Continuous;
            steps.add(PlaneMoment { vehicle: 1, time, point, heading_rad: 0.0, speed_mps: 20.0, clock });
        }
        steps.check(Layout::Osi).unwrap();
    }

    #[test]
    fn headings_across_or_against_the_movement_are_refused() {
        let drive = |heading_rad| along_x(heading_rad, 20.0, |step| 2.0 * f64::from(step)).check(Layout::Osi);
        drive(0.4).unwrap();
        for heading_rad in [0.6, -0.6, 3.0] {
            let problem = drive(heading_rad).unwrap_err();
            assert!(matches!(problem, TrajectoryFileProblem::HeadingsAgainstMotion { .. }), "{problem}");
        }
    }
}
