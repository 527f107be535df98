//! A vehicle that drives beside the centre of its lane: `LaneOffsetAction`, and the `offset` of a
//! start.
//!
//! ```text
//!  offset of the start, actions ─▶ offset at each time, as played ─▶ distance since the start and lateral position
//! ```
//!
//! These points become the `path` of the actor. A shift by A follows its shape; the largest lateral
//! acceleration a gives its duration T:
//!
//! | shape | offset at the share x = t/T | largest acceleration | duration |
//! |---|---|---|---|
//! | `sinusoidal` | A/2 · (1 − cos πx) | A/2 · (π/T)² | π · √(A / 2a) |
//! | `cubic` | A · (3x² − 2x³) | 6A/T² | √(6A / a) |
//!
//! The standard says that `maxLateralAcc` determines the duration, and states no formula. A linear
//! shift and a step have no acceleration that determines one. A lane change ends the path of an
//! actor: an offset after it is refused.

use std::f64::consts::PI;

use super::dom::{ImportError, Node};
use super::reader::is_true;
use super::shift::Shift;
use super::storyboard::{STEP_S, Storyboard};

/// Steps of the storyboard from one point of a path to the next: 0.25 s.
const STEPS_PER_POINT: usize = 25;
/// Least distance between two points of a path (m): in the time of a point, the distance at 2 m/s.
/// A vehicle that is slower cannot shift as the action says. An assumption; 0.1 to 1 are plausible.
const LEAST_STEP_M: f64 = 0.5;
/// Distance to the second point of a path whose offset does not change (m): any distance gives the
/// same path.
const SECOND_POINT_M: f64 = 10.0;
impl Storyboard<'_> {
    /// Returns half the width of a lane at a position (m); 0 if the road does not have it.
    fn half_width_m(&self, lane: i32, s_m: f64) -> f64 {
        self.road.index(lane).map_or(0.0, |index| self.road.half_width_m(index, s_m))
    }

    /// Checks that a place beside the centre of a lane (m) is within the lane.
    fn check_offset(&self, node: &Node, (lane, s_m): (i32, f64), offset_m: f64) -> Result<(), ImportError> {
        let most_m = self.half_width_m(lane, s_m);
        match offset_m.abs() <= most_m {
            true => Ok(()),
            false => {
                let message = format!(
                    "`value` leads {offset_m} m beside the centre of the lane; -{most_m} to {most_m} m, half the width of \
                     the lane, are possible"
                );
                Err(self.reader.error(node, message))
            }
        }
    }

    /// Returns the lane in which a place beside the centre of a lane (m) lies, and its offset from
    /// the centre of that lane (m).
    ///
    /// # Errors
    /// [`ImportError`] if it lies beside the driving lanes.
    pub(super) fn lane_beside(
        &self,
        node: &Node,
        (lane, s_m): (i32, f64),
        offset_m: f64,
    ) -> Result<(i32, f64), ImportError> {
        if offset_m.abs() <= self.half_width_m(lane, s_m) {
            return Ok((lane, offset_m));
        }
        let Some(from_m) = self.road.index(lane).map(|index| self.road.file_centre_m(index, s_m)) else {
            return Err(self.reader.error(node, "the road has no lane"));
        };
        let place_m = from_m + offset_m;
        if let Some(index) = self.road.lane_near(s_m, place_m) {
            let beside_m = place_m - self.road.file_centre_m(index, s_m);
            if beside_m.abs() <= self.road.half_width_m(index, s_m) {
                return Ok((self.road.lanes[index], beside_m));
            }
        }
        let reach_m = |(low, high): (f64, f64), index: usize| {
            let (centre_m, half_m) = (self.road.file_centre_m(index, s_m), self.road.half_width_m(index, s_m));
            (low.min(centre_m - half_m), high.max(centre_m + half_m))
        };
        let (low_m, high_m) = (0..self.road.lanes.len()).fold((f64::INFINITY, f64::NEG_INFINITY), reach_m);
        let message = format!(
            "`offset` leads {offset_m} m beside the centre of lane {lane}; the driving lanes reach from {:.2} to {:.2} m \
             beside it",
            low_m - from_m,
            high_m - from_m
        );
        Err(self.reader.error(node, message))
    }

    /// Returns the shift of a vehicle by an action that begins now.
    ///
    /// # Errors
    /// [`ImportError`] if no vehicle of a scenario can shift like this.
    pub(super) fn lane_offset(&self, node: &Node, vehicle: usize) -> Result<Shift, ImportError> {
        let reader = &self.reader;
        if self.lane_changes.iter().any(|change| change.vehicle == vehicle) {
            let message = format!(
                "`{}` changes lanes before it: after a lane change, a vehicle of a scenario keeps the centre of its lane",
                self.vehicles[vehicle].name
            );
            return Err(reader.error(node, message));
        }
        let target = reader.only(reader.child(node, &["LaneOffsetTarget"])?)?;
        let (value_m, is_kept) = (reader.number(target, "value")?, is_true(node, "continuous"));
        let to_m = match target.name.as_str() {
            "AbsoluteTargetLaneOffset" => value_m,
            "RelativeTargetLaneOffset" if is_kept => {
                let message = "`continuous` must be `false`: a vehicle does not follow the offset of another";
                return Err(reader.error(node, message));
            }
            "RelativeTargetLaneOffset" => self.vehicle(target, "entityRef")?.offset_m + value_m,
            _ => return Err(reader.error(target, "this target is not read")),
        };
        self.check_offset(target, (self.vehicles[vehicle].lane, self.vehicles[vehicle].s_m), to_m)?;
        let dynamics = reader.child(node, &["LaneOffsetActionDynamics"])?;
        let is_cubic = reader.text(dynamics, "dynamicsShape")? == "cubic";
        let largest_mps2 = reader.number(dynamics, "maxLateralAcc")?;
        if !(largest_mps2 > 0.0) {
            let message = format!("`maxLateralAcc` is {largest_mps2}; a number above 0 is needed");
            return Err(reader.error(dynamics, message));
        }
        let from_m = self.vehicles[vehicle].offset_m;
        let way_m = (to_m - from_m).abs();
        let duration_s = match is_cubic {
            true => (6.0 * way_m / largest_mps2).sqrt(),
            false => PI * (0.5 * way_m / largest_mps2).sqrt(),
        };
        Ok(Shift { vehicle, line: node.line, from_m, to_m, begins_s: self.time_s, duration_s, is_cubic, is_kept })
    }

    /// Returns the lateral path of a vehicle that starts in the lane with an index, or `None` if it
    /// keeps the centre of its lane.
    ///
    /// # Errors
    /// [`ImportError`] at the action by which a vehicle shifts that hardly moves.
    pub(super) fn path(&self, vehicle: usize, lane: usize) -> Result<Option<Vec<[f64; 2]>>, ImportError> {
        let changes = self.lane_changes.iter().filter(|change| change.vehicle == vehicle);
        let until_s = changes.map(|change| change.at_s).fold(f64::INFINITY, f64::min);
        let times = self.speeds[vehicle].iter().map(|(at_s, _)| *at_s).zip(&self.offsets[vehicle]);
        let before = times.take_while(|(at_s, _)| *at_s < until_s);
        let mut samples: Vec<[f64; 2]> = before.step_by(STEPS_PER_POINT).map(|(_, sample)| *sample).collect();
        if samples.iter().all(|[_, offset_m]| *offset_m == 0.0) {
            return Ok(None);
        }
        let start_m = self.vehicles[vehicle].s_m - self.vehicles[vehicle].travelled_m;
        let centre_m = self.road.centre_m(lane, start_m);
        if self.road.changing.is_some() {
            // The path leads along the lane.
            for [travelled_m, offset_m] in &mut samples {
                *offset_m += self.road.centre_m(lane, start_m + *travelled_m) - centre_m;
            }
        }
        let path = points(&samples, centre_m).map_err(|index| {
            #[expect(clippy::cast_precision_loss, reason = "some thousand points")]
            let at_s = (index * STEPS_PER_POINT) as f64 * STEP_S;
            let begun = self.shifts.iter().rfind(|shift| shift.vehicle == vehicle && shift.begins_s <= at_s);
            ImportError {
                path: self.reader.path.clone(),
                line: begun.map_or(self.vehicles[vehicle].line, |shift| shift.line),
                element: "LaneOffsetAction".to_owned(),
                message: format!(
                    "`{}` hardly moves at {at_s:.2} s, and a vehicle shifts only while it drives",
                    self.vehicles[vehicle].name
                ),
            }
        })?;
        Ok(Some(path))
    }
}

/// Returns the points of a path: distance since the start and lateral position (m). Each sample is
/// the distance and the offset from `centre_m` (m). A part with one offset needs no points inside.
///
/// # Errors
/// The index of the sample in which a vehicle has shifted and has hardly moved ahead.
fn points(samples: &[[f64; 2]], centre_m: f64) -> Result<Vec<[f64; 2]>, usize> {
    let mut points: Vec<[f64; 2]> = Vec::new();
    for (index, [travelled_m, offset_m]) in samples.iter().enumerate() {
        // The path takes its slopes from three points.
        let near = &samples[index.saturating_sub(2)..samples.len().min(index + 3)];
        if index > 0 && near.iter().all(|[_, other_m]| other_m == offset_m) {
            continue;
        }
        let point = [*travelled_m, centre_m + offset_m];
        match points.last().copied() {
            Some(last) if point[0] - last[0] >= LEAST_STEP_M => points.push(point),
            Some(last) if point[1] != last[1] => return Err(index),
            Some(_) => {}
            None => points.push(point),
        }
    }
    if let (Some(only), 1) = (points.first().copied(), points.len()) {
        points.push([only[0] + SECOND_POINT_M, only[1]]);
    }
    Ok(points)
}

#[cfg(test)]
mod tests {
    use closecall_traffic::LateralPath;

    use super::*;

    const SPEED_MPS: f64 = 20.0;
    const CENTRE_M: f64 = -5.25;

    fn shift(is_cubic: bool) -> Shift {
        let duration_s = if is_cubic { (6.0_f64 * 1.5 / 0.3).sqrt() } else { PI * (0.5_f64 * 1.5 / 0.3).sqrt() };
        Shift { vehicle: 0, line: 1, from_m: 0.0, to_m: 1.5, begins_s: 4.0, duration_s, is_cubic, is_kept: false }
    }

    fn samples(shift: &Shift, speed_mps: f64) -> Vec<[f64; 2]> {
        let at_s = |index: u32| f64::from(index) * 0.25;
        let offset_m = |at_s: f64| if at_s < shift.begins_s { 0.0 } else { shift.offset_m(at_s) };
        (0..80).map(|index| [at_s(index) * speed_mps, offset_m(at_s(index))]).collect()
    }

    #[test]
    fn a_shift_has_its_largest_acceleration_and_ends_at_its_target() {
        for is_cubic in [true, false] {
            let shift = shift(is_cubic);
            let end_s = shift.begins_s + shift.duration_s;
            assert!(shift.offset_m(4.0).abs() < 1e-12 && (shift.offset_m(end_s) - 1.5).abs() < 1e-12);
            assert!(shift.runs(end_s - 0.01) && !shift.runs(end_s));
            let second = |at_s: f64| {
                let [a, b, c] = [-1e-3, 0.0, 1e-3].map(|apart_s| shift.offset_m(at_s + apart_s));
                (a - 2.0 * b + c) / 1e-6
            };
            let inside = (1..1_000).map(|part| 4.0 + shift.duration_s * f64::from(part) / 1_000.0);
            let largest_mps2 = inside.map(|at_s| second(at_s).abs()).fold(0.0, f64::max);
            assert!((largest_mps2 - 0.3).abs() < 0.002, "{largest_mps2}");
        }
    }

    #[test]
    fn the_path_of_a_shift_is_the_shift() {
        let shift = shift(false);
        let path = points(&samples(&shift, SPEED_MPS), CENTRE_M).unwrap();
        assert!((20..40).contains(&path.len()), "{path:?}");
        let path = LateralPath::new(&path).unwrap();
        for step in 0..2_000 {
            let at_s = f64::from(step) * 0.01;
            let expected_m = CENTRE_M + if at_s < 4.0 { 0.0 } else { shift.offset_m(at_s) };
            let difference_m = path.at(at_s * SPEED_MPS)[0] - expected_m;
            assert!(difference_m.abs() < 0.003, "{at_s}: {difference_m}");
        }
        let largest_mps2 = SPEED_MPS * SPEED_MPS * path.largest_second_derivative_per_m();
        assert!((0.25..0.45).contains(&largest_mps2), "{largest_mps2}");
    }

    #[test]
    fn an_offset_that_stays_needs_two_points_and_a_vehicle_that_stands_cannot_shift() {
        let constant: Vec<[f64; 2]> = (0..9).map(|index| [f64::from(index) * 5.0, 0.5]).collect();
        assert_eq!(points(&constant, CENTRE_M), Ok(vec![[0.0, -4.75], [10.0, -4.75]]));
        let shift = shift(true);
        assert_eq!(points(&samples(&shift, 0.0), CENTRE_M), Err(17));
        assert!(points(&samples(&shift, 1.0), CENTRE_M).is_err());
        assert!(points(&samples(&shift, 2.5), CENTRE_M).is_ok());
    }
}
