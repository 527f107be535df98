//! What E knows of its lane from its camera and its map: where the road runs behind it.

use crate::Scene;

/// The road behind E, in E's vehicle frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaneGeometry {
    /// Heading of E relative to the road (rad).
    pub heading_rad: f64,
    /// Curvature of the road, positive to the left (1/m).
    pub curvature_per_m: f64,
    /// Lateral positions of the road's left and right edge, to the left of E (m).
    pub edges_m: [f64; 2],
}

impl LaneGeometry {
    /// The geometry as a map and a camera would give it, without error.
    pub fn of(scene: &Scene<'_>) -> Self {
        let state = &scene.ego.state;
        let curvature = scene.road.curvature_per_m();
        Self {
            heading_rad: state.heading_rad,
            // The reference line is d = 0; E's own path lies beside it.
            curvature_per_m: curvature / (1.0 - curvature * state.d_m),
            edges_m: [-state.d_m, scene.road.right_edge_m() - state.d_m],
        }
    }

    /// Lateral position of a line through E's origin along the road, `x_m` ahead (negative: behind) (m).
    pub fn path_y_m(&self, x_m: f64) -> f64 {
        -self.heading_rad * x_m + 0.5 * self.curvature_per_m * x_m * x_m
    }

    /// Direction of the road there, relative to E's heading (rad).
    pub fn direction_rad(&self, x_m: f64) -> f64 {
        -self.heading_rad + self.curvature_per_m * x_m
    }
}
