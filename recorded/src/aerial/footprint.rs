//! From a box in the picture to a box on the ground, and the perspective bias of tall vehicles.
//!
//! ```text
//!   seen:       ├──────────────────────┤          the visible body covers its footprint and its displaced roof
//!   footprint:  ├───────────┤
//!   roof:            ├─────────────────┤          displaced by δ = r·h/(H − h), larger by H/(H − h)
//! ```
//!
//! Along each axis of a vehicle of size L and height h, the box that is seen on the ground reaches
//! from min(−L/2, δ − kL/2) to max(L/2, δ + kL/2), with k = H/(H − h). Its centre lies about δ/2
//! beside the centre of the footprint: 1 m for a truck of 4 m that is seen at 25° from 100 m.
//! [`corrected`] inverts this for the typical height of the class. F. Kruber et al. (IV 2020)
//! correct the same displacement by the height of their test vehicle.

use closecall_traffic::geometry::OrientedBox;
use closecall_traffic::maths;
use nalgebra::Vector2;

use crate::aerial::camera::AerialCamera;
use crate::aerial::image_box::ImageBox;

/// Steps of the inversion; each reduces the error by a factor of about H/h.
const STEPS: usize = 12;
/// Least size that is left of a box (m).
const SMALLEST_M: f64 = 0.3;

/// Returns the box on the ground that an image box covers, as if the vehicle were flat. `None` if a
/// corner lies above the horizon.
pub fn raw(camera: &AerialCamera, image_box: &ImageBox) -> Option<OrientedBox> {
    let ground = |pixel| camera.ground_at(pixel).map(|[x, y]| Vector2::new(x, y));
    let [a, b, c, d] = image_box.corners_px().map(ground);
    let (a, b, c, d) = (a?, b?, c?, d?);
    let centre = (a + b + c + d) / 4.0;
    let (along, across) = (0.5 * (a + d - b - c), 0.5 * (a + b - c - d));
    // Front and rear look alike: vehicles are assumed to drive along the x axis, in either
    // direction.
    let forward = if along.x < 0.0 { -along } else { along };
    Some(OrientedBox {
        x_m: centre.x,
        y_m: centre.y,
        yaw_rad: maths::atan2(forward.y, forward.x),
        length_m: along.norm(),
        width_m: across.norm(),
    })
}

/// Returns the box on the ground that the visible body of a cuboid of this footprint and height
/// covers.
pub fn seen(camera: &AerialCamera, footprint: &OrientedBox, height_m: f64) -> OrientedBox {
    let altitude_m = camera.view().altitude_m;
    let growth = altitude_m / (altitude_m - height_m);
    let relief = Vector2::from(camera.relief_m([footprint.x_m, footprint.y_m], height_m));
    let (sin, cos) = maths::sin_cos(footprint.yaw_rad);
    let (forward, left) = (Vector2::new(cos, sin), Vector2::new(-sin, cos));
    let along = covered(footprint.length_m, relief.dot(&forward), growth);
    let across = covered(footprint.width_m, relief.dot(&left), growth);
    let centre = footprint.centre_m() + forward * along.0 + left * across.0;
    OrientedBox { x_m: centre.x, y_m: centre.y, length_m: along.1, width_m: across.1, ..*footprint }
}

/// Returns the centre and the size of the interval that a footprint of this size and its roof cover
/// along one axis (m).
fn covered(size_m: f64, displaced_m: f64, growth: f64) -> (f64, f64) {
    let (half, roof) = (0.5 * size_m, 0.5 * size_m * growth);
    let (low, high) = ((-half).min(displaced_m - roof), half.max(displaced_m + roof));
    (0.5 * (low + high), high - low)
}

/// Returns the footprint whose visible body covers the box `seen_m`, for a vehicle of this height.
pub fn corrected(camera: &AerialCamera, seen_m: &OrientedBox, height_m: f64) -> OrientedBox {
    let mut estimate = *seen_m;
    for _ in 0..STEPS {
        let now = seen(camera, &estimate, height_m);
        estimate.x_m += seen_m.x_m - now.x_m;
        estimate.y_m += seen_m.y_m - now.y_m;
        estimate.length_m = (estimate.length_m + seen_m.length_m - now.length_m).max(SMALLEST_M);
        estimate.width_m = (estimate.width_m + seen_m.width_m - now.width_m).max(SMALLEST_M);
    }
    estimate
}

#[cfg(test)]
mod tests {
    use closecall_traffic::VehicleClass;

    use super::*;
    use crate::aerial::camera::{ALTITUDE_M, OFF_NADIR_RAD, View};

    const HEIGHT_M: f64 = 4.0;

    fn camera() -> AerialCamera {
        AerialCamera::new(View::beside_road([250.0, -5.0], ALTITUDE_M, OFF_NADIR_RAD))
    }

    fn truck(x_m: f64, y_m: f64) -> OrientedBox {
        OrientedBox { x_m, y_m, yaw_rad: 0.0, length_m: 16.5, width_m: 2.55 }
    }

    #[test]
    fn the_bias_of_a_truck_is_the_closed_form_and_about_a_metre() {
        let camera = camera();
        let footprint = truck(250.0, -5.0);
        let apparent = seen(&camera, &footprint, HEIGHT_M);
        let relief_m = ALTITUDE_M * maths::tan(OFF_NADIR_RAD) * HEIGHT_M / (ALTITUDE_M - HEIGHT_M);
        let growth = ALTITUDE_M / (ALTITUDE_M - HEIGHT_M);
        let expected_m = 0.5 * (relief_m + 0.5 * (growth - 1.0) * footprint.width_m);
        assert!((apparent.y_m - footprint.y_m - expected_m).abs() < 1e-9, "{apparent:?}");
        assert!((0.9..1.1).contains(&expected_m), "{expected_m}");
        let car = OrientedBox { length_m: 4.6, width_m: 1.85, ..footprint };
        let car_bias_m = seen(&camera, &car, VehicleClass::Car.typical_dimensions().height_m).y_m - car.y_m;
        assert!((0.3..0.45).contains(&car_bias_m), "{car_bias_m}");
    }

    #[test]
    fn the_seen_footprint_equals_the_camera_projection() {
        let camera = camera();
        for (x_m, y_m) in [(250.0, -5.0), (210.0, -2.0), (295.0, -9.0)] {
            let footprint = truck(x_m, y_m);
            let corners = footprint.corners_m();
            let solid = [0.0, HEIGHT_M].into_iter().flat_map(|z| corners.map(|corner| [corner.x, corner.y, z]));
            // Extents along the axes of the vehicle of the projections to the ground of all eight
            // corners.
            let shadows: Vec<[f64; 2]> = solid.map(|p| camera.ground_at(camera.project(p).unwrap()).unwrap()).collect();
            let exact = ImageBox::around(&shadows, 0.0).unwrap();
            let apparent = seen(&camera, &footprint, HEIGHT_M);
            // The displacement of the roof is the displacement of its middle.
            let differences = [
                apparent.x_m - exact.centre_px[0],
                apparent.y_m - exact.centre_px[1],
                apparent.length_m - exact.length_px,
                apparent.width_m - exact.width_px,
            ];
            assert!(differences.iter().all(|difference| difference.abs() < 1e-6), "{differences:?}");
        }
    }

    #[test]
    fn the_correction_inverts_the_bias_and_the_raw_box_has_it() {
        let camera = camera();
        for (x_m, y_m, yaw_rad) in [(250.0, -5.0, 0.0), (215.0, -8.0, 0.05), (300.0, -1.0, -0.08)] {
            let footprint = OrientedBox { yaw_rad, ..truck(x_m, y_m) };
            let visible = seen(&camera, &footprint, HEIGHT_M);
            let back = corrected(&camera, &visible, HEIGHT_M);
            assert!(maths::hypot(back.x_m - x_m, back.y_m - y_m) < 1e-6, "{back:?}");
            assert!((back.length_m - 16.5).abs() < 1e-6 && (back.width_m - 2.55).abs() < 1e-6, "{back:?}");
        }
    }

    #[test]
    fn a_flat_box_in_the_picture_gives_its_place_on_the_ground() {
        let camera = camera();
        let footprint = OrientedBox { length_m: 4.6, width_m: 1.9, ..truck(240.0, -4.0) };
        let pixels = footprint.corners_m().map(|corner| camera.project([corner.x, corner.y, 0.0]).unwrap());
        let on_ground = raw(&camera, &ImageBox::around(&pixels, 0.0).unwrap()).unwrap();
        assert!((on_ground.x_m - 240.0).abs() < 0.1 && (on_ground.y_m + 4.0).abs() < 0.05, "{on_ground:?}");
        assert!((on_ground.length_m - 4.6).abs() < 0.25 && (on_ground.width_m - 1.9).abs() < 0.15, "{on_ground:?}");
        assert!(on_ground.yaw_rad.abs() < 0.05);
    }
}
