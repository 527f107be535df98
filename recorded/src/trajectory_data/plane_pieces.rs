//! Pieces of vehicles in a plane: a number that was given to another vehicle moves as no vehicle does.
//!
//! ```text
//!   number 7 ──────────▶            a vehicle that leaves the section
//!            ──────────▶            another one, which enters it with the same number
//! ```
//!
//! A road is inferred from the paths of vehicles before positions along the road are known. A path that
//! jumps back, or to the vehicle beside it, is not the path of a road. The limits are the ones
//! by which `continuity` splits tracks.

use closecall_traffic::{Time, maths};

use super::builder::PIECE_STRIDE;
use super::continuity::{JUMP_ACROSS_M, JUMP_ACROSS_MPS, JUMP_ALONG_M, JUMP_ALONG_MPS, compared_until};
use super::plausible::MIN_SPEED_MPS;
use super::reference_line::Point;
use super::source::Clock;

/// Least movement across the heading as a share of the movement along it for a jump to the side (-), 27°:
/// in a lane change it stays below 10°. Headings of some files have errors of a few degrees, which move a
/// fast vehicle to the side between two frames that are far apart.
const LEAST_ASKEW: f64 = 0.5;

/// Length of the sum of two headings that are 90° apart (-). A vehicle that drives does not turn by more between two
/// rows: another one drives in the opposite direction.
const TURNED: f64 = std::f64::consts::SQRT_2;

/// A vehicle in a plane at one time.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlaneMoment {
    pub(super) vehicle: u64,
    pub(super) time: Time,
    pub(super) point: Point,
    pub(super) heading_rad: f64,
    pub(super) speed_mps: f64,
    /// In a simulation, a lane change may take a single step.
    pub(super) clock: Clock,
}

/// Gives each piece of a vehicle a number of its own. The rows of a vehicle have to follow one another in
/// the order of their times.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PlanePieces {
    /// The latest row, and the number of jumps of its vehicle so far.
    latest: Option<(PlaneMoment, u64)>,
}

impl PlanePieces {
    /// Returns the number of the piece to which the next row belongs: the number of its vehicle until the
    /// first jump.
    pub(super) fn number(&mut self, row: PlaneMoment) -> u64 {
        let jumps = match &self.latest {
            Some((before, jumps)) if before.vehicle == row.vehicle => jumps + u64::from(is_jump(before, &row)),
            _ => 0,
        };
        self.latest = Some((row, jumps));
        row.vehicle + jumps * PIECE_STRIDE
    }
}

/// Returns true if no vehicle moves as from `before` to the later `row`.
fn is_jump(before: &PlaneMoment, row: &PlaneMoment) -> bool {
    let step_s = (row.time - before.time).s();
    let (dx, dy) = (row.point.0 - before.point.0, row.point.1 - before.point.1);
    let heading = [before.heading_rad, row.heading_rad];
    let cos = heading.iter().map(|rad| maths::cos(*rad)).sum::<f64>();
    let sin = heading.iter().map(|rad| maths::sin(*rad)).sum::<f64>();
    let norm = maths::hypot(cos, sin);
    // The mean of two headings that point to opposite sides is across both.
    let is_driving = before.speed_mps > MIN_SPEED_MPS && row.speed_mps > MIN_SPEED_MPS;
    if !(norm > if is_driving { TURNED } else { 0.0 }) {
        return true;
    }
    let along_m = (dx * cos + dy * sin) / norm;
    let across_m = (dy * cos - dx * sin) / norm;
    let excess_m = along_m - 0.5 * (before.speed_mps + row.speed_mps) * step_s;
    let exceeds = |off_m: f64, mps: f64, least_m: f64| !(off_m.abs() <= (mps * step_s).max(least_m));
    let is_aside = row.clock != Clock::Simulated && across_m.abs() > LEAST_ASKEW * along_m.abs();
    row.time > compared_until(before.time)
        || along_m < -JUMP_ALONG_M
        || exceeds(excess_m, JUMP_ALONG_MPS, JUMP_ALONG_M)
        || (is_aside && exceeds(across_m, JUMP_ACROSS_MPS, JUMP_ACROSS_M))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the pieces of a vehicle that drives at 20 m/s, at 10 Hz, and is elsewhere by these distances
    /// along and to the left of its road (m) from frame 50 on, after a pause (s).
    fn pieces(moved: (f64, f64), heading_rad: f64, pause_s: f64) -> usize {
        pieces_by(Clock::Continuous, moved, heading_rad, pause_s)
    }

    fn pieces_by(clock: Clock, moved: (f64, f64), heading_rad: f64, pause_s: f64) -> usize {
        let mut numbers = PlanePieces::default();
        let (cos, sin) = (maths::cos(heading_rad), maths::sin(heading_rad));
        let number = |frame: u32| {
            let is_moved = frame >= 50;
            let time_s = 0.1 * f64::from(frame) + if is_moved { pause_s } else { 0.0 };
            let (shift_m, left_m) = if is_moved { moved } else { (0.0, 0.0) };
            let along_m = 20.0 * time_s + shift_m;
            let point = (along_m * cos - left_m * sin, along_m * sin + left_m * cos);
            let (time, speed_mps) = (Time::from_s(time_s), 20.0);
            numbers.number(PlaneMoment { vehicle: 7, time, point, heading_rad, speed_mps, clock })
        };
        let mut all: Vec<u64> = (0..100).map(number).collect();
        all.dedup();
        assert_eq!(all[0], 7);
        all.len()
    }

    #[test]
    fn a_number_of_another_vehicle_begins_a_piece_and_a_gap_does_not() {
        for heading_rad in [0.0, 2.5, -3.1] {
            assert_eq!(pieces((0.0, 0.0), heading_rad, 0.0), 1);
            assert_eq!(pieces((0.0, 0.0), heading_rad, 3.0), 1, "a gap");
            assert_eq!(pieces((1.0, 0.3), heading_rad, 0.0), 1, "an error of a position");
            assert_eq!(pieces((0.0, 3.5), heading_rad, 0.0), 2, "the vehicle beside it");
            assert_eq!(pieces((40.0, 0.0), heading_rad, 0.0), 2, "the vehicle ahead");
            assert_eq!(pieces_by(Clock::Simulated, (0.0, 3.5), heading_rad, 0.0), 1, "a lane change of a single step");
            assert_eq!(pieces_by(Clock::Simulated, (40.0, 0.0), heading_rad, 0.0), 2, "the vehicle ahead, simulated");
            assert_eq!(pieces((-200.0, 0.0), heading_rad, 2.0), 2, "a vehicle that enters");
            assert_eq!(pieces((0.0, 0.0), heading_rad, 60.0), 2, "long after");
        }
    }

    #[test]
    fn a_number_that_goes_to_the_oncoming_traffic_begins_a_piece() {
        // 12 m beside the path of the vehicle before, after a pause in which that could be driven.
        let pieces = |speed_mps: f64, heading_rad: f64| {
            let mut numbers = PlanePieces::default();
            let moment = |time_s: f64, left_m: f64, heading_rad: f64| {
                let (time, point, clock) = (Time::from_s(time_s), (speed_mps * time_s, left_m), Clock::Continuous);
                PlaneMoment { vehicle: 7, time, point, heading_rad, speed_mps, clock }
            };
            let first = numbers.number(moment(0.0, 0.0, 0.02));
            1 + usize::from(numbers.number(moment(5.0, 12.0, heading_rad)) != first)
        };
        assert_eq!(pieces(20.0, 3.1), 2);
        assert_eq!(pieces(20.0, 0.1), 1, "a bend");
        assert_eq!(pieces(0.0, 3.1), 1, "the heading of a vehicle that stands may point anywhere");
    }

    #[test]
    fn a_vehicle_that_turns_is_one_piece_at_any_frame_rate() {
        // A circle with a radius of 100 m, at 20 m/s.
        for period_s in [0.04, 0.2, 1.0] {
            let mut numbers = PlanePieces::default();
            for frame in 0..60 {
                let time_s = period_s * f64::from(frame);
                let angle = 0.2 * time_s;
                let point = (100.0 * maths::sin(angle), 100.0 * (1.0 - maths::cos(angle)));
                let (time, heading_rad, clock) = (Time::from_s(time_s), angle, Clock::Continuous);
                let moment = PlaneMoment { vehicle: 3, time, point, heading_rad, speed_mps: 20.0, clock };
                assert_eq!(numbers.number(moment), 3);
            }
        }
    }
}
