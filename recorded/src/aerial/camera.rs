//! The aerial camera: a pinhole camera at an altitude, tilted from the vertical.
//!
//! ```text
//!   C ●                     side view, across the optical axis's direction on the ground
//!     │╲  ν                 ν: angle from the nadir, the point below the camera
//!   H │  ╲                  a point at height h is displaced on the ground, away from the nadir,
//!     │    ╲  roof          by r·h/(H − h), with its horizontal distance r from the camera
//!   ──┴──────╲─┐──────▶
//!    nadir    ╲│  ╲ displaced roof
//! ```
//!
//! The ground frame is the road frame as a plane: x along the road, y to the left, z up.
//!
//! Altitude, resolution and lens follow published aerial acquisition: 100 m and images of Full HD
//! (F. Kruber et al., *Vehicle Position Estimation with Aerial Imagery from Unmanned Aerial
//! Vehicles*, IV 2020), about 0.1 m of ground for each pixel (R. Krajewski et al., *The highD
//! Dataset*, ITSC 2018). The default covers 0.13 m per pixel: a frame then takes a tenth of a
//! second to render and to search.

use closecall_traffic::maths;
use serde::Serialize;

/// Focal length of a wide-angle lens of 24 mm (35 mm equivalent), as usual drones have it, on
/// [`WIDTH_PX`] columns (px).
pub const FOCAL_PX: f64 = 24.0 / 36.0 * WIDTH_PX as f64;
/// Columns of a frame.
pub const WIDTH_PX: usize = 1_280;
/// Rows of a frame: a strip of the image with the road in it.
pub const HEIGHT_PX: usize = 192;
/// Columns and rows of the pictures from which the published method derives trajectories.
pub const PUBLISHED_PX: [usize; 2] = [4_104, 3_006];
/// Factor by which [`PUBLISHED_PX`] are reduced before the detector searches them. From 100 m, a
/// pixel then covers 0.11 m of ground at the nadir: the detector knows vehicles of this size.
pub const PUBLISHED_REDUCTION: usize = 3;
/// Usual altitude (m).
pub const ALTITUDE_M: f64 = 100.0;
/// Usual angle of the optical axis from the nadir (rad): 25°. The drone hovers beside the road, not
/// above it.
pub const OFF_NADIR_RAD: f64 = 25.0 * std::f64::consts::PI / 180.0;

/// A vector in the ground frame (m).
pub type Vec3 = [f64; 3];

fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The pose and the lens of an aerial camera.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct View {
    /// Point of the ground on the optical axis (m).
    pub target_m: [f64; 2],
    /// Altitude of the camera above the ground, above 0 (m).
    pub altitude_m: f64,
    /// Angle of the optical axis from the nadir, 0 to below π/2 (rad).
    pub off_nadir_rad: f64,
    /// Direction of the optical axis on the ground, from the x axis, counter-clockwise (rad).
    pub azimuth_rad: f64,
    /// Focal length (px).
    pub focal_px: f64,
    /// Columns and rows of the image; the optical axis passes through its middle.
    pub size_px: [usize; 2],
}

impl View {
    /// Returns the usual view of a road from its right side, with this angle from the nadir (rad)
    /// and altitude (m). The optical axis points at `target_m`.
    pub const fn beside_road(target_m: [f64; 2], altitude_m: f64, off_nadir_rad: f64) -> Self {
        Self {
            target_m,
            altitude_m,
            off_nadir_rad,
            azimuth_rad: std::f64::consts::FRAC_PI_2,
            focal_px: FOCAL_PX,
            size_px: [WIDTH_PX, HEIGHT_PX],
        }
    }

    /// Returns the same view with a lens of the same angle on another number of columns and rows.
    pub const fn with_size(self, size_px: [usize; 2]) -> Self {
        Self { focal_px: self.focal_px * size_px[0] as f64 / self.size_px[0] as f64, size_px, ..self }
    }
}

/// A camera with its axes computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AerialCamera {
    view: View,
    centre_m: Vec3,
    right: Vec3,
    down: Vec3,
    forward: Vec3,
}

impl AerialCamera {
    /// Creates the camera of a view.
    pub fn new(view: View) -> Self {
        let (sin_nu, cos_nu) = maths::sin_cos(view.off_nadir_rad);
        let (sin_az, cos_az) = maths::sin_cos(view.azimuth_rad);
        let forward = [sin_nu * cos_az, sin_nu * sin_az, -cos_nu];
        let right = [sin_az, -cos_az, 0.0];
        let back_m = view.altitude_m * maths::tan(view.off_nadir_rad);
        let centre_m = [view.target_m[0] - back_m * cos_az, view.target_m[1] - back_m * sin_az, view.altitude_m];
        Self { view, centre_m, right, down: cross(forward, right), forward }
    }

    /// Returns the view.
    pub const fn view(&self) -> &View {
        &self.view
    }

    /// Returns the position of the camera (m).
    pub const fn centre_m(&self) -> Vec3 {
        self.centre_m
    }

    /// Returns the image position of a point (px): column and row, with the middle of the first
    /// pixel at 0.5. `None` if the point is not in front of the camera.
    pub fn project(&self, point_m: Vec3) -> Option<[f64; 2]> {
        self.project_with_depth(point_m).map(|[column, row, _]| [column, row])
    }

    /// Returns the image position of a point (px), and its distance along the optical axis (m).
    pub(crate) fn project_with_depth(&self, point_m: Vec3) -> Option<[f64; 3]> {
        /// Least distance from the camera (m).
        const NEAR_M: f64 = 0.1;
        let offset = [0, 1, 2].map(|axis| point_m[axis] - self.centre_m[axis]);
        let depth = dot(self.forward, offset);
        let at = |axis: Vec3, side: usize| 0.5 * side as f64 + self.view.focal_px * dot(axis, offset) / depth;
        let [width, height] = self.view.size_px;
        (depth > NEAR_M).then(|| [at(self.right, width), at(self.down, height), depth])
    }

    /// Returns the point of the ground at an image position (m). `None` if the position is at or
    /// above the horizon.
    pub fn ground_at(&self, [column, row]: [f64; 2]) -> Option<[f64; 2]> {
        let [width, height] = self.view.size_px;
        let (u, v) =
            ((column - 0.5 * width as f64) / self.view.focal_px, (row - 0.5 * height as f64) / self.view.focal_px);
        let ray = [0, 1, 2].map(|axis| self.forward[axis] + u * self.right[axis] + v * self.down[axis]);
        let reach = -self.centre_m[2] / ray[2];
        (ray[2] < 0.0).then(|| [self.centre_m[0] + reach * ray[0], self.centre_m[1] + reach * ray[1]])
    }

    /// Returns the vector by which a point at `height_m` above `ground_m` appears displaced on the
    /// ground (m): (p − c)·h/(H − h), with the nadir c.
    pub fn relief_m(&self, ground_m: [f64; 2], height_m: f64) -> [f64; 2] {
        let share = height_m / (self.view.altitude_m - height_m);
        [0, 1].map(|axis| (ground_m[axis] - self.centre_m[axis]) * share)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cameras() -> Vec<AerialCamera> {
        let mut all = Vec::new();
        for off_nadir_rad in [0.0, 0.2, OFF_NADIR_RAD, 0.6] {
            for azimuth_rad in [0.0, 1.0, 2.5, -1.2] {
                let view = View::beside_road([250.0, -5.0], ALTITUDE_M, off_nadir_rad);
                all.push(AerialCamera::new(View { azimuth_rad, ..view }));
            }
        }
        all
    }

    #[test]
    fn a_ground_point_that_is_projected_and_back_stays_where_it_is() {
        for camera in cameras() {
            for point in [[250.0, -5.0], [210.0, 3.0], [290.0, -20.0]] {
                let pixel = camera.project([point[0], point[1], 0.0]).unwrap();
                let back = camera.ground_at(pixel).unwrap();
                assert!(maths::hypot(back[0] - point[0], back[1] - point[1]) < 1e-9, "{back:?} {point:?}");
            }
        }
    }

    #[test]
    fn the_target_is_in_the_middle_and_the_direction_of_travel_points_right() {
        let camera = AerialCamera::new(View::beside_road([250.0, -5.0], ALTITUDE_M, OFF_NADIR_RAD));
        let middle = camera.project([250.0, -5.0, 0.0]).unwrap();
        assert!((middle[0] - 640.0).abs() < 1e-9 && (middle[1] - 96.0).abs() < 1e-9, "{middle:?}");
        let ahead = camera.project([260.0, -5.0, 0.0]).unwrap();
        let left = camera.project([250.0, -2.0, 0.0]).unwrap();
        assert!(ahead[0] > middle[0] && (ahead[1] - middle[1]).abs() < 1e-9, "{ahead:?}");
        assert!(left[1] < middle[1], "the left side of the road is up: {left:?}");
    }

    #[test]
    fn a_roof_is_displaced_by_the_closed_form() {
        for camera in cameras() {
            let (ground, height_m) = ([262.0, -8.5], 4.0);
            let seen = camera.ground_at(camera.project([ground[0], ground[1], height_m]).unwrap()).unwrap();
            let relief = camera.relief_m(ground, height_m);
            for axis in [0, 1] {
                assert!((seen[axis] - ground[axis] - relief[axis]).abs() < 1e-9, "{seen:?} {relief:?}");
            }
        }
    }

    #[test]
    fn a_larger_picture_of_the_same_view_shows_the_same_points_at_its_own_pixels() {
        let view = View::beside_road([250.0, -5.0], ALTITUDE_M, OFF_NADIR_RAD);
        let [small, large] = [[1_368, 1_000], [4_104, 3_000]].map(|size_px| AerialCamera::new(view.with_size(size_px)));
        for point in [[250.0, -5.0, 0.0], [221.0, 3.0, 4.0]] {
            let ([a, b], [c, d]) = (small.project(point).unwrap(), large.project(point).unwrap());
            assert!((3.0 * a - c).abs() < 1e-9 && (3.0 * b - d).abs() < 1e-9, "{a} {b} {c} {d}");
        }
        assert_eq!(view.with_size(view.size_px), view);
    }

    #[test]
    fn nothing_is_seen_behind_the_camera_or_above_the_horizon() {
        let view = View { off_nadir_rad: 1.5, ..View::beside_road([0.0, 0.0], 50.0, 0.0) };
        let camera = AerialCamera::new(view);
        assert_eq!(camera.ground_at([640.0, 0.0]), None);
        let [x, y, z] = camera.centre_m();
        assert_eq!(camera.project([x, y, z + 10.0]), None);
    }
}
