//! From road coordinates to E's vehicle frame, and back to lanes.
//!
//! On a road of curvature κ (left edge) the point (s, d) lies, seen along the road's direction at E's own (s₀, d₀), at
//!
//! ```text
//!   a = (1/κ − d)·sin Δ                        Δ = κ·(s − s₀)
//!   b = d − d₀ + (1/κ − d)·(1 − cos Δ)
//! ```
//!
//! Written with 2·sin²(Δ/2) for 1 − cos Δ, this loses no digits where κ is small, and no position is ever formed far
//! from E, so that a run at s = 100 km is as exact as one at s = 0. E's heading relative to the road turns (a, b) into
//! (x, y).

use closecall_traffic::{Lane, Road, Side, VehicleState};
use statrs::function::erf::erfc;

/// Beyond this many standard deviations from a lane's edge a vehicle is counted as certainly on one side of it (the
/// neglected probability is below 3e-7).
const CERTAIN_DEVIATIONS: f64 = 5.0;

/// E's vehicle frame at one instant.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EgoFrame<'a> {
    road: &'a Road,
    s_m: f64,
    d_m: f64,
    heading_rad: f64,
    sin: f64,
    cos: f64,
    lane: Lane,
}

/// A point of the road as seen from E.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RoadPoint {
    /// Ahead of E [m].
    pub(crate) x_m: f64,
    /// To the left of E [m].
    pub(crate) y_m: f64,
    /// Direction of the road there, relative to E's heading [rad].
    pub(crate) road_yaw_rad: f64,
}

impl<'a> EgoFrame<'a> {
    pub(crate) fn new(road: &'a Road, ego: &VehicleState) -> Self {
        let (sin, cos) = ego.heading_rad.sin_cos();
        Self { road, s_m: ego.s_m, d_m: ego.d_m, heading_rad: ego.heading_rad, sin, cos, lane: road.lane_at(ego.d_m) }
    }

    /// Where the point (s, d) of the road lies in E's frame.
    pub(crate) fn point(&self, s_m: f64, d_m: f64) -> RoadPoint {
        let curvature = self.road.curvature_per_m();
        let (mut along_m, mut across_m) = (s_m - self.s_m, d_m - self.d_m);
        let mut bend_rad = 0.0;
        if curvature != 0.0 {
            bend_rad = curvature * along_m;
            let radius_m = 1.0 / curvature - d_m;
            let half_sin = (0.5 * bend_rad).sin();
            along_m = radius_m * bend_rad.sin();
            across_m += radius_m * 2.0 * half_sin * half_sin;
        }
        RoadPoint {
            x_m: along_m * self.cos + across_m * self.sin,
            y_m: across_m * self.cos - along_m * self.sin,
            road_yaw_rad: bend_rad - self.heading_rad,
        }
    }

    /// The road coordinates (s, d) [m] of a point in E's frame.
    pub(crate) fn road_position_m(&self, x_m: f64, y_m: f64) -> (f64, f64) {
        let along_m = x_m * self.cos - y_m * self.sin;
        let across_m = y_m * self.cos + x_m * self.sin;
        let curvature = self.road.curvature_per_m();
        let way_m = match curvature {
            0.0 => along_m,
            _ => (curvature * along_m).atan2(1.0 - curvature * (self.d_m + across_m)) / curvature,
        };
        (self.s_m + way_m, self.lateral_position_m(x_m, y_m))
    }

    /// What a vehicle at `d_m` covers of its own path for each metre of the reference line [1].
    pub(crate) fn stretch(&self, d_m: f64) -> f64 {
        1.0 - self.road.curvature_per_m() * d_m
    }

    /// The lateral road coordinate d [m] of a point in E's frame: what E knows from its lane camera and its map.
    pub(crate) fn lateral_position_m(&self, x_m: f64, y_m: f64) -> f64 {
        let along_m = x_m * self.cos - y_m * self.sin;
        let across_m = y_m * self.cos + x_m * self.sin;
        let curvature = self.road.curvature_per_m();
        // Curvature of E's own path parallel to the edge; the quotient is exact for a circle and b for a straight line.
        let own = curvature / (1.0 - curvature * self.d_m);
        let offset_m = (2.0 * across_m - own * (along_m * along_m + across_m * across_m))
            / (1.0 + (own * along_m).hypot(1.0 - own * across_m));
        self.d_m + offset_m
    }

    /// Probability that a centre at `d_m`, known to `sd_m`, is in the lane left of E's, in E's own, right of E's.
    pub(crate) fn lane_probabilities(&self, d_m: f64, sd_m: f64) -> [f64; 3] {
        let width_m = self.road.lane_width_m();
        let left_edge_m = self.road.lane_centre_m(self.lane) + 0.5 * width_m;
        // Probability of lying right of each of the four edges, from the left.
        let right_of = [1.0, 0.0, -1.0, -2.0].map(|lanes| below(left_edge_m + lanes * width_m - d_m, sd_m));
        let within = |place: usize, exists: bool| if exists { right_of[place] - right_of[place + 1] } else { 0.0 };
        [
            within(0, self.road.beside(self.lane, Side::Left).is_some()),
            within(1, true),
            within(2, self.road.beside(self.lane, Side::Right).is_some()),
        ]
    }
}

/// Probability that a normal deviate of standard deviation `sd` (0 or more) is at most `margin`.
fn below(margin: f64, sd: f64) -> f64 {
    if margin >= CERTAIN_DEVIATIONS * sd {
        1.0
    } else if margin <= -CERTAIN_DEVIATIONS * sd {
        0.0
    } else {
        0.5 * erfc(-margin / (sd * std::f64::consts::SQRT_2))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn ego(d_m: f64, heading_rad: f64) -> VehicleState {
        VehicleState { s_m: 3_000.0, d_m, heading_rad, ..VehicleState::default() }
    }

    proptest! {
        #[test]
        fn agrees_with_the_plane(
            ds in -150.0..150.0, d in -11.0..0.0, own_d in -11.0..0.0,
            heading in -0.2..0.2, curvature in -0.0025..0.0025,
        ) {
            let road = Road::straight(3).with_curvature(curvature);
            let state = VehicleState { s_m: 100.0, ..ego(own_d, heading) };
            let point = EgoFrame::new(&road, &state).point(100.0 + ds, d);
            let own = road.plane_pose(100.0, own_d, heading);
            let other = road.plane_pose(100.0 + ds, d, 0.0);
            let (sin, cos) = own.yaw_rad.sin_cos();
            let (dx, dy) = (other.x_m - own.x_m, other.y_m - own.y_m);
            prop_assert!((point.x_m - (dx * cos + dy * sin)).abs() < 1e-7);
            prop_assert!((point.y_m - (dy * cos - dx * sin)).abs() < 1e-7);
            prop_assert!((point.road_yaw_rad - (other.yaw_rad - own.yaw_rad)).abs() < 1e-12);
        }

        #[test]
        fn the_road_coordinates_come_back(
            ds in -150.0..150.0, d in -11.0..0.0, heading in -0.2..0.2, curvature in -0.0025..0.0025,
        ) {
            let road = Road::straight(3).with_curvature(curvature);
            let state = ego(-5.6, heading);
            let frame = EgoFrame::new(&road, &state);
            let point = frame.point(3_000.0 + ds, d);
            let (s_m, d_m) = frame.road_position_m(point.x_m, point.y_m);
            let expected_m: [f64; 2] = [3_000.0 + ds, d];
            prop_assert!((s_m - expected_m[0]).abs() < 1e-9, "{s_m} for {}", expected_m[0]);
            prop_assert!((d_m - expected_m[1]).abs() < 1e-9, "{d_m} for {d}");
        }
    }

    #[test]
    fn lanes_are_relative_to_the_ego() {
        let road = Road::straight(3);
        let state = ego(-5.6, 0.0);
        let frame = EgoFrame::new(&road, &state);
        assert_eq!(frame.lane_probabilities(-1.9, 0.0), [1.0, 0.0, 0.0]);
        assert_eq!(frame.lane_probabilities(-5.0, 0.1), [0.0, 1.0, 0.0]);
        assert_eq!(frame.lane_probabilities(-9.0, 0.0), [0.0, 0.0, 1.0]);
        let [left, own, right] = frame.lane_probabilities(-3.75, 0.5);
        assert!((left - 0.5).abs() < 1e-9 && (own - 0.5).abs() < 1e-9 && right == 0.0);
    }

    #[test]
    fn a_lane_that_is_not_there_holds_nothing() {
        let road = Road::straight(2);
        let state = ego(-1.9, 0.0);
        let frame = EgoFrame::new(&road, &state);
        assert_eq!(frame.lane_probabilities(0.5, 0.0), [0.0, 0.0, 0.0]);
        assert_eq!(frame.lane_probabilities(-5.6, 0.0), [0.0, 0.0, 1.0]);
    }
}
