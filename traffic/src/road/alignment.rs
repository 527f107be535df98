//! The horizontal alignment of a road: a line whose curvature is a piecewise linear function of the
//! position along it. Lines, arcs and clothoids are its pieces.
//!
//! ```text
//!   κ ▲           ________            κ = 0       line
//!     │          /        \           κ constant  arc
//!     │_________/          \____      κ linear    clothoid (spiral of OpenDRIVE)
//!     └──────────────────────────▶ s
//! ```
//!
//! Before the first point and behind the last one, the curvature does not change. Two points at the
//! same position are a jump, as between a line and an arc without a clothoid.
//!
//! The angle between two positions is a sum of trapezoids, which is exact. The displacement is the
//! integral of the direction: a closed form on lines and arcs, a Gauss-Legendre quadrature on
//! clothoids. Its error is below 1e-13 m per metre, because no step turns by more than
//! [`STEP_RAD`]. Every displacement is formed between two positions, so a line at s = 100 km is as
//! exact as one at s = 0.

use std::sync::{Arc, OnceLock};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::PlanePose;
use crate::{Check, ConfigError, Num, Parameters, Problem, Range, maths};

/// Largest angle by which one step of the quadrature turns (rad).
const STEP_RAD: f64 = 0.5;
/// Step of the inverse below which it has converged (m), and its greatest number of steps.
const CONVERGED_M: f64 = 1e-10;
const MAX_STEPS: u8 = 60;
/// Longest step of the inverse (m).
const LONGEST_STEP_M: f64 = 200.0;
/// Least scale of the path at a point: nearer to the centre of the curve, a point has no position.
const LEAST_SCALE: f64 = 0.1;

/// Abscissae and weights of the Gauss-Legendre quadrature with eight nodes on −1 to 1; both halves
/// are alike (Abramowitz and Stegun 1964, table 25.4).
#[expect(clippy::excessive_precision, reason = "the digits of the table")]
const GAUSS: [[f64; 2]; 4] = [
    [0.183_434_642_495_649_8, 0.362_683_783_378_361_98],
    [0.525_532_409_916_328_99, 0.313_706_645_877_887_29],
    [0.796_666_477_413_626_74, 0.222_381_034_453_374_47],
    [0.960_289_856_497_536_23, 0.101_228_536_290_376_26],
];

/// A point of an alignment as a scenario file describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct AlignmentPointConfig {
    /// Position along the road (m).
    pub s_m: Num,
    /// Curvature of the line there (1/m), positive if the road bends to the left.
    pub curvature_per_m: Num,
}

/// A point of an alignment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AlignmentPoint {
    /// Position along the road (m).
    pub s_m: f64,
    /// Curvature there (1/m), positive to the left.
    pub curvature_per_m: f64,
}

/// A line of piecewise linear curvature. Its clones share their points.
#[derive(Clone, Debug)]
pub struct Alignment(Arc<Line>);

#[derive(Debug)]
struct Line {
    points: Vec<AlignmentPoint>,
    /// The poses of the points, in the frame of the pose at s = 0.
    poses: Vec<PlanePose>,
    /// The line in the opposite direction. A sensor that looks to the rear needs it in each scan.
    reversed: OnceLock<Alignment>,
}

impl PartialEq for Alignment {
    fn eq(&self, other: &Self) -> bool {
        self.points() == other.points()
    }
}

/// The way from one position of a line to another.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Displacement {
    /// Distance ahead, in the direction of the line at the first position (m).
    pub(crate) along_m: f64,
    /// Distance to the left of that direction (m).
    pub(crate) across_m: f64,
    /// Angle by which the line turns to the left (rad).
    pub(crate) turn_rad: f64,
}

impl Displacement {
    /// Returns this way followed by another one.
    fn then(&self, next: &Self) -> Self {
        let (sin, cos) = maths::sin_cos(self.turn_rad);
        Self {
            along_m: self.along_m + next.along_m * cos - next.across_m * sin,
            across_m: self.across_m + next.along_m * sin + next.across_m * cos,
            turn_rad: self.turn_rad + next.turn_rad,
        }
    }

    /// Returns the way back.
    fn inverse(&self) -> Self {
        let (sin, cos) = maths::sin_cos(self.turn_rad);
        Self {
            along_m: -(self.along_m * cos + self.across_m * sin),
            across_m: self.along_m * sin - self.across_m * cos,
            turn_rad: -self.turn_rad,
        }
    }

    fn pose(self) -> PlanePose {
        PlanePose { x_m: self.along_m, y_m: self.across_m, yaw_rad: self.turn_rad }
    }
}

/// A piece of a line whose curvature is a linear function of the position: a line, an arc or a
/// clothoid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AlignmentPiece {
    /// Position at which it begins (m).
    pub start_m: f64,
    /// Length of the piece (m).
    pub length_m: f64,
    /// Curvature at its start and at its end (1/m).
    pub curvatures_per_m: [f64; 2],
}

impl AlignmentPiece {
    fn turn_rad(&self) -> f64 {
        0.5 * (self.curvatures_per_m[0] + self.curvatures_per_m[1]) * self.length_m
    }

    fn displacement(&self) -> Displacement {
        let Self { length_m, curvatures_per_m: [from, to], .. } = *self;
        if from == to {
            return arc(length_m, from);
        }
        let turn_at = |share: f64| length_m * share * (from + 0.5 * (to - from) * share);
        let steps = (from.abs().max(to.abs()) * length_m / STEP_RAD).ceil().max(1.0);
        let half = 0.5 / steps;
        let (mut along, mut across, mut step) = (0.0, 0.0, 0.0);
        while step < steps {
            let middle = (step + 0.5) / steps;
            for [node, weight] in GAUSS {
                for at in [middle - half * node, middle + half * node] {
                    let (sin, cos) = maths::sin_cos(turn_at(at));
                    along += weight * cos;
                    across += weight * sin;
                }
            }
            step += 1.0;
        }
        let scale_m = half * length_m;
        Displacement { along_m: along * scale_m, across_m: across * scale_m, turn_rad: self.turn_rad() }
    }
}

/// Returns the way along an arc or a line.
fn arc(length_m: f64, curvature_per_m: f64) -> Displacement {
    let turn_rad = curvature_per_m * length_m;
    if turn_rad == 0.0 {
        return Displacement { along_m: length_m, ..Displacement::default() };
    }
    let half_sin = maths::sin(0.5 * turn_rad);
    Displacement {
        along_m: maths::sin(turn_rad) / curvature_per_m,
        across_m: 2.0 * half_sin * half_sin / curvature_per_m,
        turn_rad,
    }
}

/// Checks the points of an alignment.
pub(super) fn check(points: &[AlignmentPointConfig], parameters: &Parameters) -> Result<Alignment, ConfigError> {
    let mut checked = Vec::with_capacity(points.len());
    for (index, point) in points.iter().enumerate() {
        checked.push(point.check(parameters).map_err(|error| error.within_index(index).within("alignment"))?);
    }
    Alignment::new(&checked)
}

impl Check for AlignmentPointConfig {
    type Checked = AlignmentPoint;

    fn check(&self, parameters: &Parameters) -> Result<AlignmentPoint, ConfigError> {
        Ok(AlignmentPoint {
            s_m: parameters.number(&self.s_m, "s-m", Alignment::POSITION_M)?,
            curvature_per_m: parameters.number(&self.curvature_per_m, "curvature-per-m", Alignment::CURVATURE_PER_M)?,
        })
    }
}

impl Alignment {
    /// Largest number of points: 100 km with a curve every 25 m. It bounds the memory of a file that
    /// is wrong.
    pub const MAX_POINTS: usize = 4_096;
    /// Positions of points (m).
    pub const POSITION_M: Range = Range::closed(-10_000.0, 100_000.0);
    /// Curvatures (1/m): a radius of 250 m, the smallest one of the roads of ASAM's ALKS scenarios.
    /// German motorways have 280 m or more (FGSV 2008, RAA, design class EKA 3). The poses are exact
    /// at each radius; the sensors' pieces of a road are not.
    pub const CURVATURE_PER_M: Range = Range::closed(-0.004, 0.004);
    /// Least distance of two points of different positions (m). It bounds the rate of change of the
    /// curvature. Assumption: 1 to 20 are plausible. A clothoid of German motorways is A²/R long,
    /// which is 20 m or more at a radius of 400 m (FGSV 2008, RAA: A is 90 m or more).
    pub const LEAST_SPACING_M: f64 = 1.0;

    /// Creates an alignment from points in the order of their positions.
    ///
    /// # Errors
    /// [`ConfigError`] at `alignment` if there are fewer than 2 or more than
    /// [`Alignment::MAX_POINTS`] points, if a number is out of its range, or if the positions are not
    /// in order: they increase by 1 m or more, or a position occurs twice.
    pub fn new(points: &[AlignmentPoint]) -> Result<Self, ConfigError> {
        if !(2..=Self::MAX_POINTS).contains(&points.len()) {
            let problem = Problem::WrongLength { value: points.len() as u64, allowed: "2 to 4096" };
            return Err(ConfigError::new("alignment", problem));
        }
        for (index, point) in points.iter().enumerate() {
            let at = |error: ConfigError| error.within_index(index).within("alignment");
            Self::POSITION_M.check(point.s_m, "s-m").map_err(at)?;
            Self::CURVATURE_PER_M.check(point.curvature_per_m, "curvature-per-m").map_err(at)?;
            let back_m = |steps: usize| index.checked_sub(steps).map(|before| point.s_m - points[before].s_m);
            let is_jump = back_m(1) == Some(0.0) && back_m(2) != Some(0.0);
            if !(is_jump || back_m(1).is_none_or(|step_m| step_m >= Self::LEAST_SPACING_M)) {
                let rule = "positions increase by 1 m or more from point to point; two points at one position are \
                            a jump of the curvature"
                    .to_owned();
                return Err(at(ConfigError::new("s-m", Problem::Contradiction { other: "road.alignment", rule })));
            }
        }
        Ok(Self::of(points.to_vec()))
    }

    /// Creates an alignment from points in order: at least one.
    fn of(points: Vec<AlignmentPoint>) -> Self {
        let new = |points, poses| Self(Arc::new(Line { points, poses, reversed: OnceLock::new() }));
        let line = new(points, Vec::new());
        let mut at = line.displacement(0.0, line.points()[0].s_m);
        let mut poses = vec![at.pose()];
        for (index, ends) in line.points().windows(2).enumerate() {
            at = at.then(&line.piece(Some(index), ends[0].s_m, ends[1].s_m).displacement());
            poses.push(at.pose());
        }
        new(line.points().to_vec(), poses)
    }

    /// Returns the points, in the order of their positions.
    pub fn points(&self) -> &[AlignmentPoint] {
        &self.0.points
    }

    /// Returns the smallest and the largest curvature (1/m).
    pub fn curvature_range_per_m(&self) -> [f64; 2] {
        self.points().iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], point| {
            [low.min(point.curvature_per_m), high.max(point.curvature_per_m)]
        })
    }

    /// Returns the curvature at a position (1/m); at a jump, the one behind it.
    pub fn curvature_at_per_m(&self, s_m: f64) -> f64 {
        self.curvature_after(self.last_before(s_m), s_m)
    }

    /// Returns the index of the last point at or before a position, or `None` before the first one.
    fn last_before(&self, s_m: f64) -> Option<usize> {
        self.points().partition_point(|point| point.s_m <= s_m).checked_sub(1)
    }

    /// Returns the curvature (1/m) at a position between the point `index` and the next one.
    fn curvature_after(&self, index: Option<usize>, s_m: f64) -> f64 {
        let Some(index) = index else { return self.points()[0].curvature_per_m };
        let from = self.points()[index];
        match self.points().get(index + 1) {
            Some(to) if to.curvature_per_m != from.curvature_per_m => {
                let share = (s_m - from.s_m) / (to.s_m - from.s_m);
                from.curvature_per_m * (1.0 - share) + to.curvature_per_m * share
            }
            _ => from.curvature_per_m,
        }
    }

    /// Returns the piece from one position to another one, both between the point `index` and the
    /// next one.
    fn piece(&self, index: Option<usize>, from_m: f64, to_m: f64) -> AlignmentPiece {
        if from_m == to_m {
            return AlignmentPiece { start_m: from_m, length_m: 0.0, curvatures_per_m: [0.0; 2] };
        }
        let curvatures_per_m = [from_m, to_m].map(|s_m| self.curvature_after(index, s_m));
        AlignmentPiece { start_m: from_m, length_m: to_m - from_m, curvatures_per_m }
    }

    /// Returns the pieces between two positions. `from_m` is the smaller one.
    fn pieces_with_jumps(&self, from_m: f64, to_m: f64) -> impl Iterator<Item = AlignmentPiece> {
        let mut index = self.last_before(from_m);
        let mut at_m = Some(from_m);
        std::iter::from_fn(move || {
            let start_m = at_m?;
            let next = index.map_or(0, |index| index + 1);
            let (end_m, rest_m) = match self.points().get(next) {
                Some(point) if point.s_m < to_m => (point.s_m, Some(point.s_m)),
                _ => (to_m, None),
            };
            let piece = self.piece(index, start_m, end_m);
            (index, at_m) = (Some(next), rest_m);
            Some(piece)
        })
    }

    /// Returns the pieces between two positions. `from_m` is the smaller one.
    pub fn pieces(&self, from_m: f64, to_m: f64) -> impl Iterator<Item = AlignmentPiece> {
        self.pieces_with_jumps(from_m, to_m).filter(|piece| piece.length_m > 0.0)
    }

    /// Returns the angle by which the line turns to the left between two positions (rad).
    pub fn turn_rad(&self, from_m: f64, to_m: f64) -> f64 {
        match from_m <= to_m {
            true => self.pieces_with_jumps(from_m, to_m).map(|piece| piece.turn_rad()).sum(),
            false => -self.turn_rad(to_m, from_m),
        }
    }

    /// Returns the way between two positions.
    pub(crate) fn displacement(&self, from_m: f64, to_m: f64) -> Displacement {
        // NaN has no piece, and stays NaN.
        if !(from_m <= to_m) {
            return match to_m < from_m {
                true => self.displacement(to_m, from_m).inverse(),
                false => Displacement { along_m: f64::NAN, across_m: f64::NAN, turn_rad: f64::NAN },
            };
        }
        let mut way: Option<Displacement> = None;
        for piece in self.pieces_with_jumps(from_m, to_m) {
            let next = piece.displacement();
            way = Some(way.map_or(next, |way| way.then(&next)));
        }
        way.unwrap_or_default()
    }

    /// Returns the pose of the line at a position, in the frame of the pose at s = 0.
    pub fn pose(&self, s_m: f64) -> PlanePose {
        let nearest = self.last_before(s_m).unwrap_or(0);
        let at = self.0.poses[nearest];
        let start = Displacement { along_m: at.x_m, across_m: at.y_m, turn_rad: at.yaw_rad };
        start.then(&self.displacement(self.points()[nearest].s_m, s_m)).pose()
    }

    /// Returns the position along the line, and the distance to the left of it (m), of a point that
    /// is given relative to the line at `from_m`: ahead and to the left (m). The search begins at
    /// `near_m`, and the line turns by less than a right angle from there to the result.
    pub(crate) fn project(&self, from_m: f64, [ahead_m, left_m]: [f64; 2], near_m: f64) -> [f64; 2] {
        let mut s_m = near_m;
        let mut offset_m = f64::NAN;
        for _ in 0..MAX_STEPS {
            let at = self.displacement(from_m, s_m);
            let (sin, cos) = maths::sin_cos(at.turn_rad);
            let (to_x, to_y) = (ahead_m - at.along_m, left_m - at.across_m);
            let rest_m = to_x * cos + to_y * sin;
            offset_m = to_y * cos - to_x * sin;
            let scale = 1.0 - self.curvature_at_per_m(s_m) * offset_m;
            let step_m = (rest_m / scale.max(LEAST_SCALE)).clamp(-LONGEST_STEP_M, LONGEST_STEP_M);
            s_m += step_m;
            if !(step_m.abs() > CONVERGED_M) {
                break;
            }
        }
        [s_m, offset_m]
    }

    /// Returns the line in the opposite direction: its positions are the negative ones.
    pub(crate) fn reversed(&self) -> Self {
        let turned =
            |point: &AlignmentPoint| AlignmentPoint { s_m: -point.s_m, curvature_per_m: -point.curvature_per_m };
        self.0.reversed.get_or_init(|| Self::of(self.points().iter().rev().map(turned).collect())).clone()
    }

    /// Returns the same line with another curvature at each point.
    pub(crate) fn bent(&self, to_per_m: impl Fn(f64) -> f64) -> Self {
        let bent =
            |point: &AlignmentPoint| AlignmentPoint { curvature_per_m: to_per_m(point.curvature_per_m), ..*point };
        Self::of(self.points().iter().map(bent).collect())
    }
}

#[cfg(test)]
mod tests;
