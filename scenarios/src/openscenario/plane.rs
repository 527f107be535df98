//! The reference line of a road in the plane, so that a position in the plane becomes a position on
//! the road.

use closecall_traffic::maths;

/// A position on a road, relative to its reference line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RoadPoint {
    /// Along the road (m).
    pub(super) s_m: f64,
    /// To the left of the reference line (m).
    pub(super) t_m: f64,
}

/// A reference line that is one line or one arc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ReferenceLine {
    /// Position at which it begins, in the plane (m).
    pub(super) x_m: f64,
    pub(super) y_m: f64,
    /// Heading at which it begins (rad).
    pub(super) heading_rad: f64,
    pub(super) curvature_per_m: f64,
}

impl ReferenceLine {
    /// Returns the position on the road of a point in the plane (m). On an arc it is unique within
    /// half a turn.
    pub(super) fn road_point(&self, x_m: f64, y_m: f64) -> RoadPoint {
        let (sin, cos) = maths::sin_cos(self.heading_rad);
        let (from_x, from_y) = (x_m - self.x_m, y_m - self.y_m);
        let (ahead_m, left_m) = (from_x * cos + from_y * sin, from_y * cos - from_x * sin);
        if self.curvature_per_m == 0.0 {
            return RoadPoint { s_m: ahead_m, t_m: left_m };
        }
        // Distance and bearing from the centre of the circle.
        let radius_m = 1.0 / self.curvature_per_m;
        let (to_x, to_y) = (ahead_m, left_m - radius_m);
        let angle_rad = if radius_m > 0.0 { maths::atan2(to_x, -to_y) } else { -maths::atan2(to_x, to_y) };
        RoadPoint { s_m: angle_rad * radius_m, t_m: radius_m - maths::hypot(to_x, to_y) * radius_m.signum() }
    }

    /// Returns the angle between a heading in the plane and the road at `s_m`, from -π to π (rad).
    pub(super) fn angle_rad(&self, heading_rad: f64, s_m: f64) -> f64 {
        let (sin, cos) = maths::sin_cos(heading_rad - self.heading_rad - self.curvature_per_m * s_m);
        maths::atan2(sin, cos)
    }
}

/// Returns the index of the lane whose centre is nearest.
pub(super) fn nearest(centres_m: &[f64], t_m: f64) -> Option<usize> {
    (0..centres_m.len()).min_by(|a, b| (centres_m[*a] - t_m).abs().total_cmp(&(centres_m[*b] - t_m).abs()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_of_the_plane_lies_where_the_road_passes_it() {
        for curvature_per_m in [0.0, 0.002, -0.002] {
            let line = ReferenceLine { x_m: 100.0, y_m: -20.0, heading_rad: 0.7, curvature_per_m };
            let (s_m, t_m) = (250.0, -5.6);
            let road_rad = line.heading_rad + curvature_per_m * s_m;
            // The integral of the heading along the line.
            let steps = 100_000;
            let (mut x_m, mut y_m) = (line.x_m, line.y_m);
            for step in 0..steps {
                let at_m = (f64::from(step) + 0.5) * s_m / f64::from(steps);
                let (sin, cos) = maths::sin_cos(line.heading_rad + curvature_per_m * at_m);
                x_m += cos * s_m / f64::from(steps);
                y_m += sin * s_m / f64::from(steps);
            }
            let (sin, cos) = maths::sin_cos(road_rad);
            let point = line.road_point(x_m - t_m * sin, y_m + t_m * cos);
            assert!((point.s_m - s_m).abs() < 1e-6 && (point.t_m - t_m).abs() < 1e-6, "{point:?}");
            assert!((line.angle_rad(road_rad + 0.1 + 4.0 * std::f64::consts::PI, s_m) - 0.1).abs() < 1e-9);
        }
    }
}
