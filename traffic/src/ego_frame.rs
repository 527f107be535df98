//! Transforms between road coordinates and the ego's vehicle frame, and assigns positions to lanes.
//!
//! A road has the curvature κ at its left edge. The ego is at (s₀, d₀). In axes that are aligned
//! with the road's direction at the ego, the road point (s, d) lies at (a, b) relative to the ego:
//!
//! ```text
//!   a = (1/κ − d)·sin Δ                        Δ = κ·(s − s₀)
//!   b = d − d₀ + (1/κ − d)·(1 − cos Δ)
//! ```
//!
//! The code writes 1 − cos Δ as 2·sin²(Δ/2), which loses no digits if κ is small. Every position is
//! formed relative to the ego, so a run at s = 100 km is as exact as one at s = 0. A rotation by
//! the ego's heading relative to the road turns (a, b) into (x, y).
//!
//! On a road with an alignment, (a, b) is the integral of the road's direction from the ego to the
//! point, and the inverse is a Newton iteration ([`crate::Alignment`]).

use crate::maths::erfc;
use crate::road::Course;
use crate::{Lane, Road, Side, VehicleState, maths};

/// Number of standard deviations from a lane's edge beyond which a vehicle is certainly on one side
/// of it (the neglected probability is below 3e-7).
const CERTAIN_DEVIATIONS: f64 = 5.0;

/// The ego's vehicle frame at one instant.
#[derive(Clone, Copy, Debug)]
pub struct EgoFrame<'a> {
    road: &'a Road,
    s_m: f64,
    d_m: f64,
    heading_rad: f64,
    sin: f64,
    cos: f64,
    lane: Lane,
}

/// A point of the road in the ego's vehicle frame.
#[derive(Clone, Copy, Debug)]
pub struct RoadPoint {
    /// Distance ahead of the ego (m).
    pub x_m: f64,
    /// Distance to the left of the ego (m).
    pub y_m: f64,
    /// Direction of the road at the point, relative to the ego's heading (rad).
    pub road_yaw_rad: f64,
}

impl<'a> EgoFrame<'a> {
    /// Creates the frame of an ego with this state.
    pub fn new(road: &'a Road, ego: &VehicleState) -> Self {
        let (sin, cos) = maths::sin_cos(ego.heading_rad);
        Self {
            road,
            s_m: ego.s_m,
            d_m: ego.d_m,
            heading_rad: ego.heading_rad,
            sin,
            cos,
            lane: road.lane_at(ego.s_m, ego.d_m),
        }
    }

    /// Transforms the road point (s, d) into the ego's frame.
    pub fn point(&self, s_m: f64, d_m: f64) -> RoadPoint {
        let (mut along_m, mut across_m) = (s_m - self.s_m, d_m - self.d_m);
        let mut turn_rad = 0.0;
        match self.road.course() {
            Course::Constant(0.0) => {}
            Course::Constant(curvature) => {
                turn_rad = curvature * along_m;
                let radius_m = 1.0 / curvature - d_m;
                let half_sin = maths::sin(0.5 * turn_rad);
                along_m = radius_m * maths::sin(turn_rad);
                across_m += radius_m * 2.0 * half_sin * half_sin;
            }
            Course::Varying(course) => {
                let way = course.way([self.s_m, self.d_m], [s_m, d_m]);
                (along_m, across_m, turn_rad) = (way.along_m, way.across_m, way.turn_rad);
            }
        }
        RoadPoint {
            x_m: along_m * self.cos + across_m * self.sin,
            y_m: across_m * self.cos - along_m * self.sin,
            road_yaw_rad: turn_rad - self.heading_rad,
        }
    }

    /// Returns the road coordinates (s, d) (m) of a point in the ego's frame.
    pub fn road_position_m(&self, x_m: f64, y_m: f64) -> (f64, f64) {
        let along_m = x_m * self.cos - y_m * self.sin;
        let across_m = y_m * self.cos + x_m * self.sin;
        let arc_length_m = match self.road.course() {
            Course::Constant(0.0) => along_m,
            Course::Constant(curvature) => {
                maths::atan2(curvature * along_m, 1.0 - curvature * (self.d_m + across_m)) / curvature
            }
            Course::Varying(course) => {
                let [s_m, d_m] = course.position_m([self.s_m, self.d_m], [along_m, across_m], self.s_m + along_m);
                return (s_m, d_m);
            }
        };
        (self.s_m + arc_length_m, self.lateral_position_m(x_m, y_m))
    }

    /// Returns the length of path that a vehicle at (`s_m`, `d_m`) covers per metre of the
    /// reference line (m/m).
    pub fn path_scale(&self, s_m: f64, d_m: f64) -> f64 {
        self.road.path_scale(s_m, d_m)
    }

    /// Returns the lateral road coordinate d (m) of a point in the ego's frame.
    ///
    /// The ego knows it from its lane camera and its map.
    pub fn lateral_position_m(&self, x_m: f64, y_m: f64) -> f64 {
        let Course::Constant(curvature) = *self.road.course() else { return self.road_position_m(x_m, y_m).1 };
        let along_m = x_m * self.cos - y_m * self.sin;
        let across_m = y_m * self.cos + x_m * self.sin;
        // The line through the ego parallel to the road's edge has this curvature. The quotient
        // below is the exact lateral offset from a circle, and equals `across_m` for a straight
        // line.
        let line_per_m = curvature / (1.0 - curvature * self.d_m);
        let offset_m = (2.0 * across_m - line_per_m * (along_m * along_m + across_m * across_m))
            / (1.0 + maths::hypot(line_per_m * along_m, 1.0 - line_per_m * across_m));
        self.d_m + offset_m
    }

    /// Returns the probabilities that a vehicle is in the lane left of the ego's, in the ego's
    /// lane, and in the lane right of the ego's.
    ///
    /// A vehicle counts as being in a lane if its centre is. The centre lies at (`s_m`, `d_m`), across
    /// the road with the standard deviation `sd_m`.
    pub fn lane_probabilities(&self, s_m: f64, d_m: f64, sd_m: f64) -> [f64; 3] {
        let lanes =
            [self.road.beside(self.lane, Side::Left), Some(self.lane), self.road.beside(self.lane, Side::Right)];
        let [left_m, own_m, right_m] = lanes.map(|lane| lane.map_or(0.0, |lane| self.road.lane_width_m(lane, s_m)));
        let edge_m = self.road.lane_centre_m(self.lane, s_m) + 0.5 * own_m;
        // Probabilities that the centre lies to the right of each of the four edges of these lanes,
        // from left to right.
        let edges_m = [edge_m + left_m, edge_m, edge_m - own_m, edge_m - (own_m + right_m)];
        let right_of = edges_m.map(|edge_m| normal_cdf(edge_m - d_m, sd_m));
        std::array::from_fn(|index| match lanes[index] {
            Some(_) => right_of[index] - right_of[index + 1],
            None => 0.0,
        })
    }
}

/// Returns the probability that a normal deviate with mean 0 and standard deviation `sd` (0 or
/// more) is at most `margin`.
fn normal_cdf(margin: f64, sd: f64) -> f64 {
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
        fn point_agrees_with_the_poses_in_the_plane(
            ds in -150.0..150.0, d in -11.0..0.0, own_d in -11.0..0.0,
            heading in -0.2..0.2, curvature in -0.0025..0.0025,
        ) {
            let road = Road::straight(3).with_curvature(curvature);
            let state = VehicleState { s_m: 100.0, ..ego(own_d, heading) };
            let point = EgoFrame::new(&road, &state).point(100.0 + ds, d);
            let ego = road.plane_pose(100.0, own_d, heading);
            let other = road.plane_pose(100.0 + ds, d, 0.0);
            let (sin, cos) = maths::sin_cos(ego.yaw_rad);
            let (dx, dy) = (other.x_m - ego.x_m, other.y_m - ego.y_m);
            prop_assert!((point.x_m - (dx * cos + dy * sin)).abs() < 1e-7);
            prop_assert!((point.y_m - (dy * cos - dx * sin)).abs() < 1e-7);
            prop_assert!((point.road_yaw_rad - (other.yaw_rad - ego.yaw_rad)).abs() < 1e-12);
        }

        #[test]
        fn road_position_inverts_point(
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
    fn lane_probabilities_are_relative_to_the_ego_lane() {
        let road = Road::straight(3);
        let state = ego(-5.6, 0.0);
        let frame = EgoFrame::new(&road, &state);
        assert_eq!(frame.lane_probabilities(3_000.0, -1.9, 0.0), [1.0, 0.0, 0.0]);
        assert_eq!(frame.lane_probabilities(3_000.0, -5.0, 0.1), [0.0, 1.0, 0.0]);
        assert_eq!(frame.lane_probabilities(3_000.0, -9.0, 0.0), [0.0, 0.0, 1.0]);
        let [left, own, right] = frame.lane_probabilities(3_000.0, -3.75, 0.5);
        assert!((left - 0.5).abs() < 1e-9 && (own - 0.5).abs() < 1e-9 && right == 0.0);
    }

    #[test]
    fn lane_probabilities_follow_the_edges_of_lanes_of_their_own_widths() {
        let road = Road::straight(3).with_lane_widths(&[4.0, 3.0, 3.5]);
        let state = ego(-5.5, 0.0);
        let frame = EgoFrame::new(&road, &state);
        for (d_m, expected) in [
            (0.1, [0.0, 0.0, 0.0]),
            (-0.1, [1.0, 0.0, 0.0]),
            (-3.9, [1.0, 0.0, 0.0]),
            (-4.1, [0.0, 1.0, 0.0]),
            (-6.9, [0.0, 1.0, 0.0]),
            (-7.1, [0.0, 0.0, 1.0]),
            (-10.4, [0.0, 0.0, 1.0]),
            (-10.6, [0.0, 0.0, 0.0]),
        ] {
            assert_eq!(frame.lane_probabilities(3_000.0, d_m, 0.0), expected, "{d_m}");
        }
    }

    #[test]
    fn a_lane_that_does_not_exist_has_probability_zero() {
        let road = Road::straight(2);
        let state = ego(-1.9, 0.0);
        let frame = EgoFrame::new(&road, &state);
        assert_eq!(frame.lane_probabilities(3_000.0, 0.5, 0.0), [0.0, 0.0, 0.0]);
        assert_eq!(frame.lane_probabilities(3_000.0, -5.6, 0.0), [0.0, 0.0, 1.0]);
    }
}
