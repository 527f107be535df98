//! The course of the road behind the ego, as the ego knows it from a camera and a map.

use closecall_traffic::ego_frame::EgoFrame;
use closecall_traffic::{Road, Scene, VehicleState, maths};

/// Half the width of the region of interest about the ego's path (m): two lanes to each side.
const HALF_WIDTH_M: f64 = 9.5;
/// Distance from a guard rail within which a point counts as one of the rail (m). It covers the
/// errors of a point and of a map to the rail's face; on the left, the region then still reaches
/// 0.25 m beyond the edge of the road.
const RAIL_MARGIN_M: f64 = 0.5;

/// The geometry of the road behind the ego, in the ego's vehicle frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaneGeometry {
    /// Heading of the ego relative to the road (rad).
    pub heading_rad: f64,
    /// Curvature of the ego's path along the road, positive to the left (1/m).
    pub curvature_per_m: f64,
    /// The ego's path along a road with an alignment, or `None` on a road of one curvature.
    pub course: Option<PathCourse>,
    /// Lateral positions of the road's left and right edge relative to the ego, positive to the
    /// left (m).
    pub edges_m: [f64; 2],
    /// Lateral limits of the region of interest about the ego's path, left and right, positive to
    /// the left (m): two lanes to each side, short of the guard rails.
    pub region_m: [f64; 2],
}

impl LaneGeometry {
    /// Returns the geometry that an error-free map and camera would provide.
    pub fn from_scene(scene: &Scene<'_>) -> Self {
        Self::new(scene.road, &scene.ego.state)
    }

    /// Returns the geometry of a road about an ego with this state.
    pub fn new(road: &Road, state: &VehicleState) -> Self {
        let [left_offset_m, right_offset_m] = road.guard_rail_offsets_m();
        let edges_m = [-state.d_m, road.right_edge_m() - state.d_m];
        Self {
            heading_rad: state.heading_rad,
            // The road's curvature refers to its reference line, d = 0. The ego's path is offset
            // from that line.
            curvature_per_m: road.parallel_curvature_per_m(state.s_m, state.d_m),
            course: road.alignment().map(|_| PathCourse::new(road, state)),
            edges_m,
            region_m: match road.has_guard_rails() {
                true => [
                    (edges_m[0] + left_offset_m - RAIL_MARGIN_M).min(HALF_WIDTH_M),
                    (edges_m[1] - right_offset_m + RAIL_MARGIN_M).max(-HALF_WIDTH_M),
                ],
                false => [HALF_WIDTH_M, -HALF_WIDTH_M],
            },
        }
    }

    /// Returns the lateral position (m) of the line that runs through the ego's origin along the
    /// road, at the longitudinal position `x_m` (negative behind the ego).
    pub fn path_y_m(&self, x_m: f64) -> f64 {
        match &self.course {
            None => -self.heading_rad * x_m + 0.5 * self.curvature_per_m * x_m * x_m,
            Some(course) => course.y_m(x_m),
        }
    }

    /// Returns the direction of the road relative to the ego's heading (rad), at the longitudinal
    /// position `x_m`.
    pub fn direction_rad(&self, x_m: f64) -> f64 {
        match &self.course {
            None => -self.heading_rad + self.curvature_per_m * x_m,
            Some(course) => maths::atan(course.slope(x_m)),
        }
    }

    /// Returns true if the road is straight.
    pub(crate) fn is_straight(&self) -> bool {
        self.curvature_per_m == 0.0 && self.course.is_none()
    }
}

/// Distance between two knots of a path (m).
const KNOT_SPACING_M: f64 = 8.0;
/// Number of knots, and position of the first one (m): 216 m behind the ego, beyond the reach of a
/// LiDAR, to 24 m ahead of it.
const KNOTS: usize = 31;
const FIRST_KNOT_M: f64 = -216.0;
/// Steps of the search for the road position of a knot, which converges quadratically.
const KNOT_STEPS: u8 = 6;

/// The ego's path along a road with an alignment, in the ego's vehicle frame: a cubic between
/// knots, at which position and slope are exact. Between them it deviates by less than 5 mm, on
/// clothoids as at a jump from a line to an arc of the smallest radius, 250 m. Beyond the knots, it
/// is the tangent.
///
/// The bound holds for a change of the curvature of up to 1.25e-4 1/m², which is 1/A² for the
/// parameter A of a clothoid. The least A of German motorways is 300 m, 160 m and 90 m in the
/// design classes EKA 1 A, EKA 2 and EKA 3: 1.1e-5 to 1.2e-4 1/m² (FGSV 2008, RAA, as
/// <https://www.bauformeln.de/strassenbau/grenz-und-richtwerte/autobahnen/> reproduces its table).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathCourse {
    /// Lateral position (m) and slope at each knot.
    knots: [[f64; 2]; KNOTS],
}

impl PathCourse {
    fn new(road: &Road, state: &VehicleState) -> Self {
        let frame = EgoFrame::new(road, state);
        let mut s_m = state.s_m + FIRST_KNOT_M;
        let mut x_m = FIRST_KNOT_M - KNOT_SPACING_M;
        let knots = std::array::from_fn(|_| {
            x_m += KNOT_SPACING_M;
            for _ in 0..KNOT_STEPS {
                let point = frame.point(s_m, state.d_m);
                let scale = road.path_scale(s_m, state.d_m) * maths::cos(point.road_yaw_rad);
                s_m += (x_m - point.x_m) / scale;
            }
            let point = frame.point(s_m, state.d_m);
            s_m += KNOT_SPACING_M;
            [point.y_m, maths::tan(point.road_yaw_rad)]
        });
        Self { knots }
    }

    /// Returns the two knots about a position, and the share of the way from the first one.
    fn between(&self, x_m: f64) -> ([[f64; 2]; 2], f64) {
        let at = (x_m - FIRST_KNOT_M) / KNOT_SPACING_M;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped; NaN becomes 0")]
        let first = at.clamp(0.0, (KNOTS - 2) as f64) as usize;
        ([self.knots[first], self.knots[first + 1]], at - first as f64)
    }

    /// Returns the lateral position at a longitudinal position (m).
    pub fn y_m(&self, x_m: f64) -> f64 {
        let ([[from_m, from_slope], [to_m, to_slope]], share) = self.between(x_m);
        if share < 0.0 {
            return from_m + from_slope * share * KNOT_SPACING_M;
        }
        if share > 1.0 {
            return to_m + to_slope * (share - 1.0) * KNOT_SPACING_M;
        }
        let rest = 1.0 - share;
        let [rises, falls] = [from_slope, to_slope].map(|slope| slope * KNOT_SPACING_M);
        let at_knots_m = rest * rest * (1.0 + 2.0 * share) * from_m + share * share * (3.0 - 2.0 * share) * to_m;
        at_knots_m + rest * share * (rest * rises - share * falls)
    }

    /// Returns the slope at a longitudinal position (m).
    fn slope(&self, x_m: f64) -> f64 {
        let ([[from_m, from], [to_m, to]], share) = self.between(x_m);
        let share = share.clamp(0.0, 1.0);
        let at_knots = 6.0 * share * (1.0 - share) * (to_m - from_m) / KNOT_SPACING_M;
        at_knots + (1.0 - share) * (1.0 - 3.0 * share) * from + share * (3.0 * share - 2.0) * to
    }
}

#[cfg(test)]
mod tests;
