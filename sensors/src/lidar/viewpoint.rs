//! The position and the axis of the sensor at each instant of a sweep.
//!
//! Three frames are used:
//! - the *plane*, in which the road lies;
//! - the ego's *vehicle frame*: level, with its origin on the ground below the ego's centre;
//! - the *sensor's frame*: x backward along the sensor's axis, y to the ego's right, z up. It tilts
//!   with the ego's body.
//!
//! ```text
//!        ego's vehicle frame         x_s = (−cos a, 0, sin a)
//!          z                         y_s = (0, −1, 0)               a = pitch (nose down) + tilt
//!          │   x ──▶ travel          z_s = (sin a, 0, cos a)
//! ```
//!
//! A nose-down pitch p turns the ego's body about its origin: the rear rises, and the beams turn up
//! by p.

use closecall_traffic::{PlanePose, maths};
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::Lidar;
use crate::Scene;

/// The pose of the ego and its sensor at the end of a sweep, and the ego's motion during the sweep.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Viewpoint {
    ego: PlanePose,
    speed_mps: f64,
    yaw_rate_radps: f64,
    /// Position of the sensor in the ego's vehicle frame (m).
    pub(crate) sensor_position_m: Vector3<f64>,
    /// Angle of the sensor's axis above the horizontal (rad).
    pub(crate) axis_rad: f64,
    /// Rotation of the sensor about the vertical axis, to the left seen from above (rad).
    yaw_rad: f64,
    /// Rotation from the ego's level frame to the sensor's frame, if the sensor is turned.
    turned: Option<Rotation3<f64>>,
}

/// The ego's motion from an instant of the sweep to its end, as a rotation and a translation that
/// transform a point from the earlier vehicle frame to the vehicle frame at the end.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Deskew {
    /// Cosine of the angle of rotation.
    pub(crate) cos: f64,
    /// Sine of the angle of rotation.
    pub(crate) sin: f64,
    /// Longitudinal translation (m).
    pub(crate) x_m: f64,
    /// Lateral translation (m).
    pub(crate) y_m: f64,
}

impl Viewpoint {
    /// Returns the viewpoint for a sweep that ends at the scene's time.
    pub(crate) fn new(scene: &Scene<'_>, lidar: &Lidar) -> Self {
        let ego = &scene.ego;
        let state = &ego.state;
        Self {
            ego: scene.road.plane_pose(state.s_m, state.d_m, state.heading_rad),
            speed_mps: state.speed_mps,
            yaw_rate_radps: state.yaw_rate_radps,
            sensor_position_m: sensor_position_m(
                [0.5 * ego.vehicle.dimensions.length_m - lidar.inset_m, lidar.left_m, lidar.mount_height_m],
                ego.pitch_rad,
            ),
            axis_rad: ego.pitch_rad + lidar.tilt_rad,
            yaw_rad: lidar.yaw_rad,
            turned: lidar.is_turned().then(|| turned_axes(lidar, ego.pitch_rad)),
        }
    }

    /// Returns the ego's pose `before_end_s` before the end of the sweep, extrapolated from its
    /// speed and yaw rate.
    fn ego_at(&self, before_end_s: f64) -> PlanePose {
        let turned = self.yaw_rate_radps * before_end_s;
        let (sin, cos) = maths::sin_cos(self.ego.yaw_rad - 0.5 * turned);
        let distance_m = self.speed_mps * before_end_s;
        PlanePose {
            x_m: self.ego.x_m - distance_m * cos,
            y_m: self.ego.y_m - distance_m * sin,
            yaw_rad: self.ego.yaw_rad - turned,
        }
    }

    /// Returns the transform from the plane to the sensor's frame, `before_end_s` before the end of
    /// the sweep.
    pub(crate) fn sensor_from_plane(&self, before_end_s: f64) -> Isometry3<f64> {
        let level_from_plane = plane_from_body(self.ego_at(before_end_s), 0.0).inverse();
        let level = UnitQuaternion::from_rotation_matrix(&sensor_axes(self.axis_rad));
        let turn = match (&self.turned, self.yaw_rad) {
            (Some(turned), _) => UnitQuaternion::from_rotation_matrix(turned),
            (None, 0.0) => level,
            (None, yaw_rad) => level * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -yaw_rad),
        };
        Isometry3::from_parts(Translation3::from(-(turn * self.sensor_position_m)), turn) * level_from_plane
    }

    /// Returns a bound on the distance by which deskewing moves a point, apart from a rotation
    /// about the sensor (m).
    pub(crate) fn max_shift_m(&self, sweep_s: f64) -> f64 {
        (self.speed_mps.abs() + self.yaw_rate_radps.abs() * self.sensor_position_m.norm()) * sweep_s
    }

    /// Returns the transform from the ego's frame `before_end_s` before the end of the sweep to its
    /// frame at the end.
    pub(crate) fn deskew(&self, before_end_s: f64) -> Deskew {
        deskew([self.speed_mps, self.yaw_rate_radps], before_end_s)
    }
}

/// Returns the transform of [`Viewpoint::deskew`] for an ego with this speed (m/s) and yaw rate
/// (rad/s).
pub(crate) fn deskew([speed_mps, yaw_rate_radps]: [f64; 2], before_end_s: f64) -> Deskew {
    let turned = yaw_rate_radps * before_end_s;
    let distance_m = speed_mps * before_end_s;
    let (sin, cos) = small_sin_cos(turned);
    let (half_sin, half_cos) = small_sin_cos(0.5 * turned);
    Deskew { cos, sin: -sin, x_m: -distance_m * half_cos, y_m: distance_m * half_sin }
}

/// Returns the sine and cosine of the angle by which the ego turns during a sweep.
///
/// The angle is at most some hundredths of a radian. For such angles the error of these series is
/// below 1e-10.
fn small_sin_cos(angle_rad: f64) -> (f64, f64) {
    let square = angle_rad * angle_rad;
    (angle_rad * (1.0 - square / 6.0), 1.0 - 0.5 * square * (1.0 - square / 12.0))
}

/// Returns the position in the ego's vehicle frame of a sensor that is mounted behind, to the left
/// of and above the ego's origin (m).
pub(crate) fn sensor_position_m([back_m, left_m, height_m]: [f64; 3], pitch_rad: f64) -> Vector3<f64> {
    let (sin, cos) = maths::sin_cos(pitch_rad);
    Vector3::new(-back_m * cos + height_m * sin, left_m, back_m * sin + height_m * cos)
}

/// Returns the rotation from the ego's vehicle frame to the frame of a turned sensor: the body
/// turns by its pitch; the sensor turns about the body's vertical axis, by its tilt, and about its
/// own axis.
pub(crate) fn turned_axes(lidar: &Lidar, pitch_rad: f64) -> Rotation3<f64> {
    let about = |axis, angle_rad| Rotation3::from_axis_angle(&axis, angle_rad);
    about(Vector3::x_axis(), -lidar.roll_rad)
        * sensor_axes(lidar.tilt_rad)
        * about(Vector3::z_axis(), lidar.azimuth_rad - lidar.yaw_rad)
        * about(Vector3::y_axis(), -pitch_rad)
}

/// Returns the rotation from the ego's vehicle frame to the frame of a sensor whose axis points
/// `axis_rad` above the horizontal.
fn sensor_axes(axis_rad: f64) -> Rotation3<f64> {
    let (sin, cos) = maths::sin_cos(axis_rad);
    Rotation3::from_matrix_unchecked(Matrix3::new(-cos, 0.0, sin, 0.0, -1.0, 0.0, sin, 0.0, cos))
}

/// Returns the transform to the plane from the frame of a body at `pose`, pitched nose down by
/// `pitch_rad`.
pub(crate) fn plane_from_body(pose: PlanePose, pitch_rad: f64) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), pose.yaw_rad)
        * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), pitch_rad);
    Isometry3::from_parts(Translation3::new(pose.x_m, pose.y_m, 0.0), turn)
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{Environment, Road, Time, Vehicle, VehicleClass, VehicleState};
    use nalgebra::Point3;

    use super::*;
    use crate::SceneVehicle;

    fn viewpoint(speed_mps: f64, yaw_rate_radps: f64, pitch_rad: f64) -> Viewpoint {
        let state = VehicleState { speed_mps, yaw_rate_radps, d_m: -5.6, ..VehicleState::default() };
        let vehicle = Vehicle::typical(VehicleClass::Car);
        let ego = SceneVehicle { actor: 0, vehicle, state, pitch_rad };
        let (road, environment) = (Road::straight(3), Environment::CLEAR_DAY);
        let scene = Scene { time: Time::ZERO, road: &road, environment: &environment, ego, others: &[] };
        Viewpoint::new(&scene, &Lidar::default())
    }

    #[test]
    fn a_point_straight_behind_the_sensor_lies_on_its_axis() {
        let seen = viewpoint(0.0, 0.0, 0.0).sensor_from_plane(0.0) * Point3::new(-12.3, -5.6, 0.6);
        assert!((seen - Point3::new(10.0, 0.0, 0.0)).norm() < 1e-12, "{seen}");
    }

    #[test]
    fn braking_raises_the_sensor_and_tilts_it_upward() {
        let pitch = 0.02;
        let view = viewpoint(0.0, 0.0, pitch);
        assert!((view.sensor_position_m.z - (0.6 * maths::cos(pitch) + 2.3 * maths::sin(pitch))).abs() < 1e-12);
        // A point at the sensor's own height, 10 m back, now lies below the axis by p.
        let seen =
            view.sensor_from_plane(0.0) * Point3::new(view.sensor_position_m.x - 10.0, -5.6, view.sensor_position_m.z);
        assert!((maths::atan2(seen.z, seen.x) + pitch).abs() < 1e-12);
    }

    #[test]
    fn deskewing_compensates_the_motion_of_the_ego() {
        let view = viewpoint(30.0, 0.1, 0.0);
        let (before, point) = (0.0123, Point3::new(-40.0, -2.0, 0.0));
        let earlier = plane_from_body(view.ego_at(before), 0.0).inverse() * point;
        let latest = plane_from_body(view.ego_at(0.0), 0.0).inverse() * point;
        let to = view.deskew(before);
        let x = to.cos * earlier.x - to.sin * earlier.y + to.x_m;
        let y = to.sin * earlier.x + to.cos * earlier.y + to.y_m;
        assert!((x - latest.x).abs() < 1e-9 && (y - latest.y).abs() < 1e-9, "{x} {y} {latest}");
    }

    #[test]
    fn a_turned_sensor_without_an_angle_is_one_that_is_not_turned() {
        for (tilt_rad, pitch_rad) in [(0.0, 0.0), (0.02, 0.01), (-0.03, -0.02)] {
            let turned = turned_axes(&Lidar { tilt_rad, ..Lidar::default() }, pitch_rad);
            assert!((turned.matrix() - sensor_axes(tilt_rad + pitch_rad).matrix()).norm() < 1e-12);
        }
    }

    #[test]
    fn the_azimuth_turns_the_axis_to_the_left_and_the_roll_raises_its_left() {
        let axis = |azimuth_deg: f64, roll_deg: f64| {
            let (azimuth_rad, roll_rad) = (azimuth_deg.to_radians(), roll_deg.to_radians());
            turned_axes(&Lidar { azimuth_rad, roll_rad, ..Lidar::default() }, 0.0).inverse()
        };
        let along = axis(90.0, 0.0) * Vector3::x();
        assert!((along - Vector3::y()).norm() < 1e-12, "{along}");
        // The sensor that looks back has its left on the ego's right.
        let left = axis(0.0, 10.0) * Vector3::y();
        assert!(left.y < -0.98 && left.z > 0.17, "{left}");
    }
}
