//! The pinhole projection: from points in space to pixels and back.
//!
//! ```text
//!   ground frame G                          image
//!   origin on the ground below the lens     (0,0) ──▶ u, 1280 px = 60° by default
//!   x along the ego's heading, y left, z up   │
//!                                             ▼ v, 800 px
//!      ego ▐██▌·lens ─ ─ ▶ looks along −x,  so the ego's left (+y) is on the *right* of the image
//! ```
//!
//! A yaw turns the axis about the vertical, from −x towards +y if it is positive, as a rear LiDAR's
//! azimuth does: what lies straight behind moves to the left of the image.
//!
//! The camera axes follow the convention of computer vision: x right, y down, z along the optical
//! axis (the *depth*). Pixels are square. Unless the lens is configured otherwise ([`Optics`]), it
//! has no distortion.

use closecall_traffic::{Scene, SceneVehicle, maths};

use super::Camera;
use super::optics::Optics;
use super::picture::Resolution;

/// Depth of the near plane (m). Nothing nearer is rendered or projected, because the ego's own body
/// lies there.
pub(crate) const NEAR_M: f64 = 0.3;

/// A box that stands on the ground, in the ego's vehicle frame, as a detection describes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundBox {
    /// Longitudinal position of the box's centre relative to the ego's centre (m), negative behind
    /// the ego.
    pub x_m: f64,
    /// Lateral position of the box's centre relative to the ego's centre (m), positive to the left.
    pub y_m: f64,
    /// Heading relative to the ego's heading (rad).
    pub heading_rad: f64,
    /// Length along the heading (m).
    pub length_m: f64,
    /// Width across the heading (m).
    pub width_m: f64,
    /// Height above the ground (m).
    pub height_m: f64,
}

impl GroundBox {
    /// Returns the eight corners in the ego's vehicle frame (m).
    pub(crate) fn corners(&self) -> [[f64; 3]; 8] {
        let (sin, cos) = maths::sin_cos(self.heading_rad);
        std::array::from_fn(|corner| {
            let sign = |bit: usize| if corner >> bit & 1 == 0 { -0.5 } else { 0.5 };
            let (along, across) = (sign(0) * self.length_m, sign(1) * self.width_m);
            let up = (sign(2) + 0.5) * self.height_m;
            [self.x_m + along * cos - across * sin, self.y_m + along * sin + across * cos, up]
        })
    }
}

/// The lens at one instant: its position in the ego vehicle, its yaw and its pitch.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lens {
    /// Focal length (px).
    pub(crate) focal_px: f64,
    /// The same, up to rounding, as the camera states it (px).
    stated_focal_px: f64,
    /// Size of the image.
    pub(crate) image: Resolution,
    /// Position of the lens relative to the ego's centre (m), negative because the lens lies behind
    /// the centre.
    pub(crate) ahead_m: f64,
    /// Position of the lens to the left of the ego's centre line (m).
    pub(crate) left_m: f64,
    /// Height of the lens above the ground (m).
    pub(crate) height_m: f64,
    /// Sine of the downward pitch of the optical axis.
    pub(crate) sin_pitch: f64,
    /// Cosine of the downward pitch of the optical axis.
    pub(crate) cos_pitch: f64,
    /// Cosine and sine of the yaw of the optical axis from straight behind, positive to the left.
    yaw: [f64; 2],
    /// How the lens differs from a pinhole.
    pub(crate) optics: Optics,
    /// Time between the readings of the first and of the last row of the image (s).
    pub(crate) readout_s: f64,
}

impl Lens {
    /// Creates the lens of the rear camera in `ego`, whose body may be pitched.
    pub(crate) fn new(camera: &Camera, ego: &SceneVehicle) -> Self {
        let ahead_m = camera.mount_from_rear_m - ego.vehicle.dimensions.length_m / 2.0;
        // If the nose of the ego dips, its tail rises: the lens moves up and its axis points
        // higher. A turned camera pitches by a part of the angle; its roll by the other part, at
        // most a degree, is neglected.
        let (sin_yaw, cos_yaw) = maths::sin_cos(camera.yaw_rad);
        let pitch = camera.pitch_rad - cos_yaw * ego.pitch_rad;
        Self {
            focal_px: f64::from(camera.resolution.width_px) / 2.0 / maths::tan(camera.field_of_view_rad / 2.0),
            stated_focal_px: camera.focal_px,
            image: camera.resolution,
            ahead_m,
            left_m: camera.left_m,
            height_m: camera.mount_height_m - ahead_m * ego.pitch_rad,
            sin_pitch: maths::sin(pitch),
            cos_pitch: maths::cos(pitch),
            yaw: [cos_yaw, sin_yaw],
            optics: camera.optics,
            readout_s: camera.readout_s,
        }
    }

    /// Returns whether the optical axis does not point straight behind.
    pub(crate) fn is_turned(&self) -> bool {
        self.yaw[1] != 0.0
    }

    /// Rotates a horizontal vector from the ground frame to the level axes of the lens, which are
    /// the axes of the ground frame turned by the yaw.
    fn in_level_axes(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        if !self.is_turned() {
            return [x, y];
        }
        let [cos, sin] = self.yaw;
        [cos * x - sin * y, sin * x + cos * y]
    }

    /// Converts a point from the ground frame to camera axes (m).
    pub(crate) fn in_camera(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        self.direction_in_camera([x, y, z - self.height_m])
    }

    /// Rotates the ray (x, y, 1), given in camera axes, into the level axes of the lens.
    #[inline]
    pub(crate) fn ray_in_level_axes(&self, [x, y]: [f32; 2]) -> [f32; 3] {
        let (s, c) = (self.sin_pitch as f32, self.cos_pitch as f32);
        [s * y - c, x, -c * y - s]
    }

    /// Rotates the ray (x, y, 1), given in camera axes, into the ground frame.
    #[inline]
    pub(crate) fn ray_in_ground(&self, ray: [f32; 2]) -> [f32; 3] {
        let [ahead, left, up] = self.ray_in_level_axes(ray);
        if !self.is_turned() {
            return [ahead, left, up];
        }
        let [cos, sin] = self.yaw.map(|part| part as f32);
        [cos * ahead + sin * left, cos * left - sin * ahead, up]
    }

    /// Projects a point in camera axes to the image (px). The point must lie in front of the lens.
    pub(crate) fn pixel(&self, [x, y, z]: [f64; 3]) -> [f64; 2] {
        if self.optics.is_straight() {
            return self.pinhole_pixel([x, y, z]);
        }
        let [x, y] = self.optics.distorted([x / z, y / z]);
        self.pinhole_pixel([x, y, 1.0])
    }

    /// Projects a point in camera axes to the image of a pinhole camera (px).
    fn pinhole_pixel(&self, [x, y, z]: [f64; 3]) -> [f64; 2] {
        let [u, v] = self.image.middle_px();
        [u + self.focal_px * x / z, v + self.focal_px * y / z]
    }

    /// Returns the position in camera axes of a moving point when the row of the image is read in
    /// which it appears. The velocity is relative to the lens, in the ground frame (m/s).
    pub(crate) fn when_read(&self, [x, y, z]: [f64; 3], [along, left]: [f64; 2]) -> [f64; 3] {
        let [_, row] = self.pixel([x, y, z.max(NEAR_M)]);
        let after_s = self.read_after_s(row);
        let [dx, dy, dz] = self.direction_in_camera([along, left, 0.0]);
        [x + after_s * dx, y + after_s * dy, z + after_s * dz]
    }

    /// Returns when a row of the image is read, relative to the middle row (s).
    pub(crate) fn read_after_s(&self, row: f64) -> f64 {
        self.readout_s * (row / f64::from(self.image.height_px) - 0.5).clamp(-0.5, 0.5)
    }

    /// Rotates a direction from the ground frame into camera axes.
    pub(crate) fn direction_in_camera(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let (s, c) = (self.sin_pitch, self.cos_pitch);
        let [x, y] = self.in_level_axes([x, y]);
        [y, s * x - c * z, -c * x - s * z]
    }

    /// Returns the pose of vehicle `other` in the ground frame: the position (x, y) of its centre
    /// (m) and its heading (rad).
    pub(crate) fn pose_in_ground(&self, scene: &Scene<'_>, other: &SceneVehicle) -> ([f64; 2], f64) {
        let pose = |vehicle: &SceneVehicle| {
            scene.road.plane_pose(vehicle.state.s_m, vehicle.state.d_m, vehicle.state.heading_rad)
        };
        let (ego, other) = (pose(&scene.ego), pose(other));
        let (sin, cos) = maths::sin_cos(ego.yaw_rad);
        let (dx, dy) = (other.x_m - ego.x_m, other.y_m - ego.y_m);
        ([cos * dx + sin * dy - self.ahead_m, cos * dy - sin * dx - self.left_m], other.yaw_rad - ego.yaw_rad)
    }

    /// Returns the smallest rectangle `[left, top, right, bottom]` (px) around the visible part of
    /// a convex body, given its corners in camera axes. Returns `None` if no part of the body lies
    /// beyond the near plane.
    pub(crate) fn bounds(&self, corners: &[[f64; 3]]) -> Option<[f64; 4]> {
        let mut bounds = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
        let mut include = |point: [f64; 3]| {
            let [u, v] = self.pinhole_pixel(point);
            bounds = [bounds[0].min(u), bounds[1].min(v), bounds[2].max(u), bounds[3].max(v)];
        };
        for (index, &a) in corners.iter().enumerate() {
            if a[2] >= NEAR_M {
                include(a);
            }
            // If the body crosses the near plane, some of the lines between two of its corners
            // cross it, too.
            for &b in &corners[index + 1..] {
                if (a[2] < NEAR_M) != (b[2] < NEAR_M) {
                    let part = (NEAR_M - a[2]) / (b[2] - a[2]);
                    include([a[0] + part * (b[0] - a[0]), a[1] + part * (b[1] - a[1]), NEAR_M]);
                }
            }
        }
        let is_visible = bounds[0] <= bounds[2];
        let middle_px = self.image.middle_px();
        is_visible.then(|| match self.optics.is_straight() {
            true => bounds,
            false => self.optics.bounds(bounds, middle_px, self.stated_focal_px),
        })
    }
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{Vehicle, VehicleClass, VehicleState};

    use super::*;
    use crate::camera::CameraConfig;
    use crate::camera::FOCAL_PX;
    use crate::camera::picture::{FIELD_OF_VIEW_RAD, PixelRect, ResolutionConfig, WIDTH_PX};
    use closecall_traffic::{Check, Parameters};

    fn lens(pitch_rad: f64) -> Lens {
        lens_of(&CameraConfig::default(), pitch_rad)
    }

    fn lens_of(config: &CameraConfig, pitch_rad: f64) -> Lens {
        let camera = config.check(&Parameters::default()).unwrap();
        let ego = SceneVehicle {
            actor: 0,
            vehicle: Vehicle::typical(VehicleClass::Car),
            state: VehicleState::default(),
            pitch_rad,
        };
        Lens::new(&camera, &ego)
    }

    #[test]
    fn the_focal_length_follows_from_the_lens() {
        assert!((FOCAL_PX - lens(0.0).focal_px).abs() < 1e-9);
    }

    #[test]
    fn the_left_lane_appears_on_the_right_and_near_points_appear_lower() {
        let lens = lens(0.0);
        let [u, near] = lens.pixel(lens.in_camera([-20.0, 3.75, 0.0]));
        assert!(u > f64::from(WIDTH_PX) / 2.0);
        let [_, far] = lens.pixel(lens.in_camera([-80.0, 3.75, 0.0]));
        assert!(near > far);
    }

    #[test]
    fn a_point_thirty_degrees_off_the_axis_appears_at_the_edge_of_the_image() {
        let lens = lens(0.0);
        let [u, _] = lens.pixel([10.0 * maths::tan(FIELD_OF_VIEW_RAD / 2.0), 0.0, 10.0]);
        assert!((u - f64::from(WIDTH_PX)).abs() < 1e-9);
    }

    #[test]
    fn a_wider_field_of_view_shows_more_and_shows_it_smaller() {
        use closecall_traffic::Num;
        for field_deg in [30.0, 90.0_f64, 120.0] {
            let config = CameraConfig { field_of_view_deg: Num::Fixed(field_deg), ..CameraConfig::default() };
            let lens = lens_of(&config, 0.0);
            let [u, _] = lens.pixel([10.0 * maths::tan(0.5 * field_deg.to_radians()), 0.0, 10.0]);
            assert!((u - f64::from(WIDTH_PX)).abs() < 1e-9, "{u} at {field_deg}°");
            assert!((lens.focal_px - lens.stated_focal_px).abs() < 1e-9);
        }
        let config = CameraConfig { field_of_view_deg: Num::Fixed(130.0), ..CameraConfig::default() };
        let error = config.check(&Parameters::default()).unwrap_err().to_string();
        assert_eq!(error, "`field-of-view-deg` is 130, but a number from 20 to 120 is needed");
    }

    #[test]
    fn an_image_of_twice_as_many_pixels_shows_each_point_at_twice_the_pixel() {
        let resolution = ResolutionConfig { width_px: 2_560, height_px: 1_600 };
        let fine = lens_of(&CameraConfig { resolution, ..CameraConfig::default() }, 0.0);
        let usual = lens(0.0);
        assert!((fine.focal_px - fine.stated_focal_px).abs() < 1e-9);
        for point in [[-5.0, 2.0, 0.0], [-20.0, 3.75, 1.5], [-80.0, -7.5, 0.3]] {
            let [coarse, twice] = [usual, fine].map(|lens| lens.pixel(lens.in_camera(point)));
            for (one, two) in coarse.iter().zip(twice) {
                assert!((two - 2.0 * one).abs() < 1e-9, "{two} is not twice {one}");
            }
        }
    }

    #[test]
    fn more_rows_show_more_above_and_below_and_leave_the_columns() {
        let resolution = ResolutionConfig { height_px: 1_000, ..ResolutionConfig::default() };
        let tall = lens_of(&CameraConfig { resolution, ..CameraConfig::default() }, 0.0);
        let [u, v] = tall.pixel([1.0, -0.5, 10.0]);
        let [usual_u, usual_v] = lens(0.0).pixel([1.0, -0.5, 10.0]);
        assert!((u - usual_u).abs() < 1e-9 && (v - usual_v - 100.0).abs() < 1e-9);
        // Half of a window that reaches below the usual image lies in it, and all in the taller
        // one.
        let window = PixelRect { left: 0, top: 750, width: 100, height: 100 };
        assert_eq!([Resolution::USUAL, tall.image].map(|image| window.share_in_image(image)), [0.5, 1.0]);
    }

    #[test]
    fn when_the_ego_brakes_its_camera_looks_higher_and_objects_appear_lower() {
        let at = |lens: Lens| lens.pixel(lens.in_camera([-50.0, 0.0, 1.0]))[1];
        assert!(at(lens(0.02)) > at(lens(0.0)));
    }

    fn turned(yaw_deg: f64, pitch_rad: f64) -> Lens {
        use closecall_traffic::Num;
        let [yaw_deg, pitch_rad] = [yaw_deg, pitch_rad].map(Num::Fixed);
        lens_of(&CameraConfig { yaw_deg, pitch_rad, ..CameraConfig::default() }, 0.0)
    }

    #[test]
    fn a_ray_rotated_into_the_ground_frame_and_back_is_unchanged() {
        for lens in [lens(0.01), turned(37.0, 0.1), turned(-55.0, -0.2)] {
            let ray = lens.ray_in_ground([0.3, -0.2]).map(f64::from);
            let from_lens = [ray[0], ray[1], ray[2] + lens.height_m];
            for (got, wanted) in lens.in_camera(from_lens).iter().zip([0.3, -0.2, 1.0]) {
                assert!((got - wanted).abs() < 1e-6);
            }
        }
    }

    /// A level camera maps an azimuth to a column and, for each azimuth, a height to a row.
    #[test]
    fn a_turned_camera_shows_a_point_where_the_closed_form_says() {
        for yaw_deg in [-50.0, -20.0, -0.5, 0.0, 10.0, 35.0, 55.0_f64] {
            let lens = turned(yaw_deg, 0.0);
            for off_axis_deg in [-29.0, -12.0, 0.0, 3.0, 30.0_f64] {
                for (distance_m, height_m) in [(4.0, 0.0), (25.0, 1.2), (90.0, 3.0)] {
                    let (sin, cos) = maths::sin_cos((yaw_deg + off_axis_deg).to_radians());
                    // The azimuth counts from straight behind to the ego's left.
                    let [u, v] = lens.pixel(lens.in_camera([-distance_m * cos, distance_m * sin, height_m]));
                    let off_axis = off_axis_deg.to_radians();
                    let wanted_u = 640.0 + FOCAL_PX * maths::tan(off_axis);
                    let wanted_v = 400.0 + FOCAL_PX * (1.2 - height_m) / (distance_m * maths::cos(off_axis));
                    assert!((u - wanted_u).abs() < 1e-6, "column {u}, not {wanted_u}, at {yaw_deg}°");
                    assert!((v - wanted_v).abs() < 1e-6, "row {v}, not {wanted_v}, at {yaw_deg}°");
                }
            }
        }
    }

    #[test]
    fn a_camera_turned_to_the_left_shows_what_is_straight_behind_on_the_left_of_the_image() {
        let [left, right] = [20.0, -20.0].map(|yaw_deg| turned(yaw_deg, 0.03));
        let column = |lens: Lens| lens.pixel(lens.in_camera([-30.0, 0.0, 1.0]))[0];
        assert!(column(left) < 300.0 && column(right) > 980.0, "{} and {}", column(left), column(right));
        // The axis of a camera that looks down meets the road at height / tan(pitch).
        for yaw_deg in [-50.0, 0.0, 33.0_f64] {
            let lens = turned(yaw_deg, 0.1);
            let (sin, cos) = maths::sin_cos(yaw_deg.to_radians());
            let distance_m = lens.height_m / maths::tan(0.1);
            let [u, v] = lens.pixel(lens.in_camera([-distance_m * cos, distance_m * sin, 0.0]));
            assert!((u - 640.0).abs() < 1e-6 && (v - 400.0).abs() < 1e-6, "{u}, {v}");
        }
    }

    #[test]
    fn the_mirrored_camera_shows_the_mirrored_point_in_the_mirrored_column() {
        for yaw_deg in [0.0, 12.0, 47.0] {
            for point in [[-8.0, 2.0, 0.0], [-30.0, -3.75, 1.4], [-3.0, 3.0, 0.5]] {
                let [x, y, z] = point;
                let [u, v] = turned(yaw_deg, 0.05).pixel(turned(yaw_deg, 0.05).in_camera(point));
                let image = turned(-yaw_deg, 0.05);
                let [mirrored_u, mirrored_v] = image.pixel(image.in_camera([x, -y, z]));
                assert!((u + mirrored_u - 1_280.0).abs() < 1e-9 && (v - mirrored_v).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn a_body_across_the_near_plane_has_bounds_and_a_body_behind_it_has_none() {
        let lens = lens(0.0);
        let body = |z: f64| [[-1.0, -1.0, z], [1.0, 1.0, z], [-1.0, 1.0, z + 4.0], [1.0, -1.0, z + 4.0]];
        assert!(lens.bounds(&body(-2.0)).is_some());
        assert_eq!(lens.bounds(&body(-9.0)), None);
    }
}
