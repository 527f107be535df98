//! The course of the road behind the ego, as the ego knows it from a camera and a map.

use closecall_traffic::{Road, Scene, VehicleState};

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
        let curvature = road.curvature_per_m();
        let [left_offset_m, right_offset_m] = road.guard_rail_offsets_m();
        let edges_m = [-state.d_m, road.right_edge_m() - state.d_m];
        Self {
            heading_rad: state.heading_rad,
            // The road's curvature refers to its reference line, d = 0. The ego's path is offset
            // from that line.
            curvature_per_m: curvature / (1.0 - curvature * state.d_m),
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
        -self.heading_rad * x_m + 0.5 * self.curvature_per_m * x_m * x_m
    }

    /// Returns the direction of the road relative to the ego's heading (rad), at the longitudinal
    /// position `x_m`.
    pub fn direction_rad(&self, x_m: f64) -> f64 {
        -self.heading_rad + self.curvature_per_m * x_m
    }
}
