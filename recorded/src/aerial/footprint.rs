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
//! [`corrected`] inverts this for a known height. F. Kruber et al. (IV 2020) correct the same
//! displacement by the height of their test vehicle.
//!
//! The height of other vehicles is not known. [`silhouette`] estimates the height of each vehicle
//! from its box: the box is wider by about δ than the vehicle, and the widths of a class differ
//! less than its heights. With the expected width w₀ ± σ_w and height h₀ ± σ_h, the estimate has
//! the smallest
//!
//! ```text
//!   ((w(h) − w₀) / σ_w)² + ((h − h₀) / σ_h)²        w(h): width of the footprint that a height of h leaves
//! ```
//!
//! That is the most probable height if both are normal. σ_w holds the error of the box, too: where
//! the box says little about the width, or the view is steep, the expected height remains.

use std::ops::RangeInclusive;

use closecall_traffic::VehicleClass;
use closecall_traffic::geometry::OrientedBox;
use closecall_traffic::maths;
use nalgebra::Vector2;

use crate::aerial::camera::AerialCamera;
use crate::aerial::image_box::ImageBox;

/// Steps of the inversion; each reduces the error by a factor of about H/h.
const STEPS: usize = 12;
/// Least size that is left of a box (m).
const SMALLEST_M: f64 = 0.3;
/// Steps of the search for the height: w(h) is almost linear.
const HEIGHT_STEPS: usize = 4;
/// Difference of two heights from which the slope of w(h) is computed (m).
const SLOPE_M: f64 = 0.05;

/// What is known of the size of a vehicle before it is seen.
#[derive(Clone, Debug, PartialEq)]
pub struct ExpectedSize {
    /// Mean width (m).
    pub width_m: f64,
    /// Standard deviation of the widths (m).
    pub width_sigma_m: f64,
    /// Mean height (m).
    pub height_m: f64,
    /// Standard deviation of the heights (m).
    pub height_sigma_m: f64,
    /// Possible heights (m).
    pub heights_m: RangeInclusive<f64>,
}

impl ExpectedSize {
    /// Returns the expected size of a class.
    ///
    /// - Cars: new cars of 2023 in the EU are 1.80 m wide on average, 1.78 m in 2018 (Transport &
    ///   Environment, 2024). The spread, and heights from low coupés to panel vans, are assumptions
    ///   with plausible ranges of 0.08 to 0.12 m and 0.2 to 0.35 m.
    /// - Trucks and coaches: at most 2.55 m wide and 4.00 m high (Directive 96/53/EC, annex I).
    ///   Rigid trucks are lower. Mean and spread are assumptions with plausible ranges of 2.45 to
    ///   2.55 ± 0.05 to 0.1 m, and 3.4 to 3.8 ± 0.3 to 0.5 m.
    pub fn of(class: VehicleClass) -> Self {
        let (width_m, width_sigma_m, height_m, height_sigma_m, heights_m) = match class {
            VehicleClass::Car => (1.80, 0.10, 1.5, 0.25, 1.2..=2.8),
            VehicleClass::Truck => (2.50, 0.08, 3.6, 0.4, 2.0..=4.0),
            VehicleClass::Motorcycle => (0.80, 0.10, 1.6, 0.15, 1.2..=2.0),
        };
        Self { width_m, width_sigma_m, height_m, height_sigma_m, heights_m }
    }

    /// Returns the same size for boxes whose width has an error of this standard deviation (m).
    #[must_use]
    pub fn seen_with(self, box_sigma_m: f64) -> Self {
        Self { width_sigma_m: maths::hypot(self.width_sigma_m, box_sigma_m), ..self }
    }
}

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

/// Returns the footprint whose visible body covers the box `seen_m`, and the height of the vehicle
/// (m), which is estimated from the width of the box.
pub fn silhouette(camera: &AerialCamera, seen_m: &OrientedBox, expected: &ExpectedSize) -> (OrientedBox, f64) {
    let width_m = |height_m: f64| corrected(camera, seen_m, height_m).width_m;
    let [width_weight, height_weight] =
        [expected.width_sigma_m, expected.height_sigma_m].map(|sigma_m| 1.0 / (sigma_m * sigma_m));
    let mut height_m = expected.height_m;
    for _ in 0..HEIGHT_STEPS {
        let left_m = width_m(height_m);
        let slope = (width_m(height_m + SLOPE_M) - left_m) / SLOPE_M;
        // The minimum of the sum of squares, with w(h') = left + slope·(h' − h).
        let wanted = width_weight * slope * (expected.width_m - left_m + slope * height_m);
        height_m = (wanted + height_weight * expected.height_m) / (width_weight * slope * slope + height_weight);
        height_m = height_m.clamp(*expected.heights_m.start(), *expected.heights_m.end());
    }
    (corrected(camera, seen_m, height_m), height_m)
}

#[cfg(test)]
mod tests {
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

    /// The expected size of trucks with these standard deviations of width and height.
    fn trucks(width_sigma_m: f64, height_sigma_m: f64) -> ExpectedSize {
        ExpectedSize { width_m: 2.55, width_sigma_m, height_sigma_m, ..ExpectedSize::of(VehicleClass::Truck) }
    }

    #[test]
    fn a_known_width_gives_the_height_and_the_place_of_a_low_truck() {
        let camera = camera();
        for (x_m, y_m, height_m) in [(250.0, -5.0, 3.2), (215.0, -8.0, 2.4), (300.0, -1.0, 3.9)] {
            let footprint = truck(x_m, y_m);
            let visible = seen(&camera, &footprint, height_m);
            let (place, estimated_m) = silhouette(&camera, &visible, &trucks(1e-4, 1.0));
            assert!((estimated_m - height_m).abs() < 1e-3, "{estimated_m} instead of {height_m}");
            assert!(maths::hypot(place.x_m - x_m, place.y_m - y_m) < 1e-3, "{place:?}");
            assert!((place.width_m - 2.55).abs() < 1e-3 && (place.length_m - 16.5).abs() < 1e-3, "{place:?}");
            // The height of the class takes away too much: half of the difference of both
            // displacements, and of the growth of half the width.
            let at_class = corrected(&camera, &visible, HEIGHT_M);
            let half_m = |height_m: f64| {
                let growth = ALTITUDE_M / (ALTITUDE_M - height_m);
                0.5 * (camera.relief_m([x_m, y_m], height_m)[1] + 0.5 * (growth - 1.0) * 2.55)
            };
            let wrong_m = half_m(height_m) - half_m(HEIGHT_M);
            assert!((at_class.y_m - y_m - wrong_m).abs() < 0.02 && wrong_m < 0.0, "{at_class:?} {wrong_m}");
        }
    }

    #[test]
    fn a_box_that_says_nothing_of_the_width_leaves_the_expected_height() {
        let camera = camera();
        let visible = seen(&camera, &truck(250.0, -5.0), 3.0);
        let (place, height_m) = silhouette(&camera, &visible, &trucks(1e3, 0.4));
        assert!((height_m - 3.6).abs() < 1e-4, "{height_m}");
        let expected = corrected(&camera, &visible, 3.6);
        assert!(
            (place.y_m - expected.y_m).abs() < 1e-4 && (place.width_m - expected.width_m).abs() < 1e-4,
            "{place:?}"
        );
        let coarse = ExpectedSize::of(VehicleClass::Truck).seen_with(0.06);
        assert!((coarse.width_sigma_m - 0.1).abs() < 1e-12);
    }

    #[test]
    fn two_equal_weights_give_the_mean_of_both_heights() {
        // Where w(h) has the slope s, a width that is known to σ_w tells the height to σ_w / |s|.
        let camera = camera();
        let visible = seen(&camera, &truck(250.0, -5.0), 3.2);
        let width_m = |height_m: f64| corrected(&camera, &visible, height_m).width_m;
        let slope = (width_m(3.6) - width_m(3.2)) / 0.4;
        assert!((-0.6..-0.4).contains(&slope), "about the tangent of the angle of the view: {slope}");
        let (_, height_m) = silhouette(&camera, &visible, &trucks(0.4 * slope.abs(), 0.4));
        assert!((height_m - 3.4).abs() < 0.01, "{height_m}");
    }

    #[test]
    fn from_straight_above_the_width_says_little_of_the_height() {
        let above = AerialCamera::new(View::beside_road([250.0, -5.0], ALTITUDE_M, 0.0));
        let visible = seen(&above, &truck(250.0, -5.0), 3.0);
        let (place, height_m) = silhouette(&above, &visible, &trucks(0.3, 0.4));
        assert!((height_m - 3.6).abs() < 0.03, "{height_m}");
        assert!((place.y_m + 5.0).abs() < 1e-6, "no displacement at the nadir: {place:?}");
    }

    #[test]
    fn no_box_makes_a_vehicle_higher_than_vehicles_are() {
        let camera = camera();
        let wide = OrientedBox { width_m: 9.0, ..truck(250.0, -5.0) };
        let narrow = OrientedBox { width_m: 1.0, ..wide };
        // A box that is narrower than any vehicle says nothing.
        for (visible, heights_m) in [(wide, 4.0..=4.0), (narrow, 2.0..=3.7)] {
            let (place, height_m) = silhouette(&camera, &visible, &trucks(1e-3, 5.0));
            assert!(heights_m.contains(&height_m), "{height_m}");
            assert!(place.width_m.is_finite() && place.width_m > 0.0, "{place:?}");
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
