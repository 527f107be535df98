//! The place of the ego in a frame that does not move.

use closecall_traffic::ego_frame::EgoFrame;
use closecall_traffic::{Road, VehicleState, maths};
use nalgebra::{Matrix2, Matrix4, Vector2, Vector4};
use serde::{Deserialize, Serialize};

/// The place of the ego in the frame of its first pose, as its odometry and its map give it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Position along the first heading (m).
    pub x_m: f64,
    /// Position to the left of it (m).
    pub y_m: f64,
    /// Heading, counter-clockwise from the first one (rad).
    pub yaw_rad: f64,
}

impl Pose {
    /// Returns the pose of an ego with this state, whose first state was `first`.
    pub(crate) fn of(road: &Road, first: &VehicleState, ego: &VehicleState) -> Self {
        let point = EgoFrame::new(road, first).point(ego.s_m, ego.d_m);
        Self { x_m: point.x_m, y_m: point.y_m, yaw_rad: point.road_yaw_rad + ego.heading_rad }
    }

    fn rotation(&self) -> Matrix2<f64> {
        let (sin, cos) = maths::sin_cos(self.yaw_rad);
        Matrix2::new(cos, -sin, sin, cos)
    }

    /// Returns a state `[x, y, vx, vy]` with its covariance, given in the frame of this pose, in
    /// the frame of the pose `now`, after `elapsed_s` at constant velocity over ground.
    pub(crate) fn moved(
        &self,
        now: &Self,
        (state, covariance): (&Vector4<f64>, &Matrix4<f64>),
        elapsed_s: f64,
    ) -> (Vector4<f64>, Matrix4<f64>) {
        let into_now = now.rotation().transpose();
        let turn = into_now * self.rotation();
        let shift = into_now * Vector2::new(self.x_m - now.x_m, self.y_m - now.y_m);
        let mut transition = Matrix4::zeros();
        transition.fixed_view_mut::<2, 2>(0, 0).copy_from(&turn);
        transition.fixed_view_mut::<2, 2>(0, 2).copy_from(&(turn * elapsed_s));
        transition.fixed_view_mut::<2, 2>(2, 2).copy_from(&turn);
        let moved = transition * state + Vector4::new(shift.x, shift.y, 0.0, 0.0);
        (moved, transition * covariance * transition.transpose())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_vehicle_at_constant_velocity_is_where_the_geometry_puts_it() {
        // The ego drives 1.2 m ahead and turns by a quarter; a vehicle beside it keeps pace along
        // the first heading.
        let (then, now) = (Pose::default(), Pose { x_m: 1.2, y_m: 0.0, yaw_rad: std::f64::consts::FRAC_PI_2 });
        let state = Vector4::new(-20.0, 3.5, 30.0, 0.0);
        let covariance = Matrix4::from_diagonal(&Vector4::new(0.04, 0.01, 0.25, 0.09));
        let (moved, spread) = then.moved(&now, (&state, &covariance), 0.04);
        // In the first frame it is at (−18.8, 3.5): 20 m behind the ego, which looks to the left
        // now.
        assert!((moved - Vector4::new(3.5, 20.0, 0.0, -30.0)).norm() < 1e-9, "{moved}");
        assert!((spread[(1, 1)] - (0.04 + 0.04 * 0.04 * 0.25)).abs() < 1e-12);
        assert!((spread[(0, 0)] - (0.01 + 0.04 * 0.04 * 0.09)).abs() < 1e-12);
        assert!((spread[(1, 3)] - 0.04 * 0.25).abs() < 1e-12);
    }

    #[test]
    fn the_pose_on_a_bend_follows_the_road() {
        let road = Road::straight(3).with_curvature(0.001);
        let first = VehicleState { s_m: 100.0, d_m: -5.0, ..VehicleState::default() };
        let later = VehicleState { s_m: 400.0, heading_rad: 0.01, ..first };
        let pose = Pose::of(&road, &first, &later);
        // An arc of 1,005 m radius over 0.3 rad.
        let (sin, cos) = maths::sin_cos(0.3);
        assert!((pose.x_m - 1_005.0 * sin).abs() < 1e-6 && (pose.y_m - 1_005.0 * (1.0 - cos)).abs() < 1e-6, "{pose:?}");
        assert!((pose.yaw_rad - 0.31).abs() < 1e-12);
        assert_eq!(Pose::of(&road, &first, &first), Pose::default());
    }
}
