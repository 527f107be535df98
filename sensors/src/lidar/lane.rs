//! The course of the road behind the ego, as the ego knows it from a camera and a map.

use crate::Scene;

/// The geometry of the road behind the ego, in the ego's vehicle frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaneGeometry {
    /// Heading of the ego relative to the road (rad).
    pub heading_rad: f64,
    /// Curvature of the ego's path along the road, positive to the left (1/m).
    pub curvature_per_m: f64,
    /// Lateral positions of the road's left and right edge relative to the ego, positive to the left (m).
    pub edges_m: [f64; 2],
}

impl LaneGeometry {
    /// Returns the geometry that an error-free map and camera would provide.
    pub fn from_scene(scene: &Scene<'_>) -> Self {
        let state = &scene.ego.state;
        let curvature = scene.road.curvature_per_m();
        Self {
            heading_rad: state.heading_rad,
            // The road's curvature refers to its reference line, d = 0. The ego's path is offset from that line.
            curvature_per_m: curvature / (1.0 - curvature * state.d_m),
            edges_m: [-state.d_m, scene.road.right_edge_m() - state.d_m],
        }
    }

    /// Returns the lateral position (m) of the line that runs through the ego's origin along the road, at the
    /// longitudinal position `x_m` (negative behind the ego).
    pub fn path_y_m(&self, x_m: f64) -> f64 {
        -self.heading_rad * x_m + 0.5 * self.curvature_per_m * x_m * x_m
    }

    /// Returns the direction of the road relative to the ego's heading (rad), at the longitudinal position `x_m`.
    pub fn direction_rad(&self, x_m: f64) -> f64 {
        -self.heading_rad + self.curvature_per_m * x_m
    }
}
