//! The course of a road in the plane: one curvature, or an alignment whose curvature varies.

use super::alignment::{Alignment, Displacement};
use super::{PlanePose, maths};

/// The course of a road.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Course {
    /// A line or an arc: d = 0 has this curvature everywhere (1/m).
    Constant(f64),
    /// A line of piecewise linear curvature.
    Varying(OffsetLine),
}

/// An alignment at a lateral position of the road, along which s is measured.
///
/// The parallel of a clothoid is no clothoid. A reversed road therefore keeps the line of the
/// original road, which is its right edge.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct OffsetLine {
    pub(crate) line: Alignment,
    /// Lateral position of the line on the road (m).
    pub(crate) d_m: f64,
}

impl OffsetLine {
    /// Returns the length of a path at `d_m` per metre of the line (m/m).
    pub(crate) fn path_scale(&self, s_m: f64, d_m: f64) -> f64 {
        1.0 - self.line.curvature_at_per_m(s_m) * (d_m - self.d_m)
    }

    /// Returns the way from a point of the road to another one, in the direction of the road at the
    /// first one.
    pub(crate) fn way(&self, [from_s_m, from_d_m]: [f64; 2], [s_m, d_m]: [f64; 2]) -> Displacement {
        let way = self.line.displacement(from_s_m, s_m);
        let sin = maths::sin(way.turn_rad);
        let half_sin = maths::sin(0.5 * way.turn_rad);
        let offset_m = d_m - self.d_m;
        Displacement {
            along_m: way.along_m - offset_m * sin,
            // d·cos Δ − d₀, with 1 − cos Δ as 2·sin²(Δ/2).
            across_m: way.across_m + (d_m - from_d_m) - offset_m * 2.0 * half_sin * half_sin,
            turn_rad: way.turn_rad,
        }
    }

    /// Returns the road coordinates of a point ahead and to the left (m) of the point
    /// (`from_s_m`, `from_d_m`). The search begins at `near_m`.
    pub(crate) fn position_m(&self, [from_s_m, from_d_m]: [f64; 2], way_m: [f64; 2], near_m: f64) -> [f64; 2] {
        let [ahead_m, left_m] = way_m;
        let [s_m, offset_m] = self.line.project(from_s_m, [ahead_m, left_m + from_d_m - self.d_m], near_m);
        [s_m, offset_m + self.d_m]
    }

    /// Returns the pose of a point in the plane.
    pub(crate) fn pose(&self, s_m: f64, d_m: f64) -> PlanePose {
        let at = self.line.pose(s_m);
        let (sin, cos) = maths::sin_cos(at.yaw_rad);
        let offset_m = d_m - self.d_m;
        // The origin of the plane is at d = 0.
        PlanePose { x_m: at.x_m - offset_m * sin, y_m: at.y_m + self.d_m + offset_m * cos, yaw_rad: at.yaw_rad }
    }
}
