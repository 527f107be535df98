//! The reference line of a road in the plane, so that a position in the plane becomes a position on
//! the road.

use closecall_traffic::{Road, maths};

/// Distance between two places of a line among which the nearest one is searched (m): a road turns
/// by less than 0.2 rad over it.
const PLACES_M: f64 = 50.0;

/// Distance before the start of a road at which a point still belongs to the start (m): the numbers of
/// a file are rounded. An assumption; 0.01 to 5 are plausible.
const ROUNDED_M: f64 = 1.0;

/// A position on a road, relative to its reference line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RoadPoint {
    /// Along the road (m).
    pub(super) s_m: f64,
    /// To the left of the reference line (m).
    pub(super) t_m: f64,
}

/// A reference line.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ReferenceLine {
    /// Position at which it begins, in the plane (m).
    pub(super) x_m: f64,
    pub(super) y_m: f64,
    /// Heading at which it begins (rad).
    pub(super) heading_rad: f64,
    /// Its length (m).
    pub(super) length_m: f64,
    /// A road whose left edge is the line.
    pub(super) course: Road,
}

impl ReferenceLine {
    /// Returns the position on the road of a point in the plane (m). A line that is one arc passes the
    /// point once in each turn: it is the turn near `before_m`, the position of a point before it, or
    /// the first turn. On another course it is the one near the nearest of some places of the line.
    pub(super) fn road_point(&self, x_m: f64, y_m: f64, before_m: Option<f64>) -> RoadPoint {
        let (sin, cos) = maths::sin_cos(self.heading_rad);
        let (from_x, from_y) = (x_m - self.x_m, y_m - self.y_m);
        let (ahead_m, left_m) = (from_x * cos + from_y * sin, from_y * cos - from_x * sin);
        let near_m = if self.course.alignment().is_some() { self.near_m(ahead_m, left_m) } else { 0.0 };
        let (s_m, t_m) = self.course.road_position_m(ahead_m, left_m, near_m);
        let turn_m = std::f64::consts::TAU / self.course.curvature_at_per_m(0.0).abs();
        let turns = match before_m {
            _ if self.course.alignment().is_some() || !turn_m.is_finite() => return RoadPoint { s_m, t_m },
            Some(before_m) => ((before_m - s_m) / turn_m).round(),
            None if s_m < -ROUNDED_M && s_m + turn_m <= self.length_m => 1.0,
            None => 0.0,
        };
        RoadPoint { s_m: s_m + turns * turn_m, t_m }
    }

    /// Returns the position of the place of the line that is nearest to a point ahead and to the
    /// left of its start (m). The places are [`PLACES_M`] apart.
    fn near_m(&self, ahead_m: f64, left_m: f64) -> f64 {
        let (mut nearest, mut at_m) = ((f64::INFINITY, 0.0), 0.0);
        while at_m <= self.length_m {
            let pose = self.course.plane_pose(at_m, 0.0, 0.0);
            let away_m = maths::hypot(pose.x_m - ahead_m, pose.y_m - left_m);
            if away_m < nearest.0 {
                nearest = (away_m, at_m);
            }
            at_m += PLACES_M;
        }
        nearest.1
    }

    /// Returns the angle between a heading in the plane and the road at `s_m`, from -π to π (rad).
    pub(super) fn angle_rad(&self, heading_rad: f64, s_m: f64) -> f64 {
        let road_rad = self.heading_rad + self.course.plane_pose(s_m, 0.0, 0.0).yaw_rad;
        let (sin, cos) = maths::sin_cos(heading_rad - road_rad);
        maths::atan2(sin, cos)
    }
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{Alignment, AlignmentPoint};

    use super::*;

    #[test]
    fn a_road_of_more_than_half_a_turn_is_followed_from_point_to_point() {
        for curvature_per_m in [0.0025, -0.0025] {
            let course = Road::straight(1).with_curvature(curvature_per_m);
            let line =
                ReferenceLine { x_m: 3.0, y_m: 4.0, heading_rad: 0.5, length_m: 2_900.0, course: course.clone() };
            let at = |s_m: f64, before_m| {
                let pose = course.plane_pose(s_m, -5.0, 0.0);
                let (sin, cos) = maths::sin_cos(line.heading_rad);
                let x_m = line.x_m + pose.x_m * cos - pose.y_m * sin;
                line.road_point(x_m, line.y_m + pose.x_m * sin + pose.y_m * cos, before_m)
            };
            let mut before_m = None;
            for s_m in (0..29).map(|place| 100.0 * f64::from(place)) {
                let point = at(s_m, before_m);
                assert!((point.s_m - s_m).abs() < 1e-6 && (point.t_m + 5.0).abs() < 1e-6, "{s_m}: {point:?}");
                before_m = Some(point.s_m);
            }
            // A start beyond half a turn, and one just before the road.
            assert!((at(2_000.0, None).s_m - 2_000.0).abs() < 1e-6);
            assert!((at(-2.0, Some(0.0)).s_m + 2.0).abs() < 1e-6);
        }
    }

    #[test]
    fn a_point_of_the_plane_lies_where_the_road_passes_it() {
        let points = [[50.0, 0.0], [120.0, 0.002], [240.0, -0.001]];
        let points = points.map(|[s_m, curvature_per_m]| AlignmentPoint { s_m, curvature_per_m });
        let straight = Road::straight(1);
        let bent = [0.0, 0.002, -0.002].map(|curvature_per_m| straight.with_curvature(curvature_per_m));
        for course in bent.into_iter().chain([straight.with_alignment(Alignment::new(&points).unwrap())]) {
            let line =
                ReferenceLine { x_m: 100.0, y_m: -20.0, heading_rad: 0.7, length_m: 400.0, course: course.clone() };
            let (s_m, t_m) = (250.0, -5.6);
            // The integral of the heading along the line.
            let steps = 100_000;
            let step_m = s_m / f64::from(steps);
            let (mut x_m, mut y_m, mut road_rad) = (line.x_m, line.y_m, line.heading_rad);
            for step in 0..steps {
                let turn_rad = course.curvature_at_per_m((f64::from(step) + 0.5) * step_m) * step_m;
                let (sin, cos) = maths::sin_cos(road_rad + 0.5 * turn_rad);
                x_m += cos * step_m;
                y_m += sin * step_m;
                road_rad += turn_rad;
            }
            let (sin, cos) = maths::sin_cos(road_rad);
            let point = line.road_point(x_m - t_m * sin, y_m + t_m * cos, None);
            assert!((point.s_m - s_m).abs() < 1e-6 && (point.t_m - t_m).abs() < 1e-6, "{point:?}");
            assert!((line.angle_rad(road_rad + 0.1 + 4.0 * std::f64::consts::PI, s_m) - 0.1).abs() < 1e-7);
        }
    }
}
