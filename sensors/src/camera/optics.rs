//! The differences of a real lens from a pinhole: radial distortion, vignetting, and reflections
//! between its surfaces.
//!
//! ```text
//!   ray x, y (tangents) ─ r·(1 + k1·r² + k2·r⁴) ─▶ pixel          pixel ─ Newton's method ─▶ ray
//! ```

use closecall_traffic::{Check, ConfigError, Num, Parameters, Problem, Range};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Tangent of the angle to the axis up to which the polynomial of the distortion holds: just beyond
/// the corners of the image, which lie at 0.68. Farther out the distortion continues linearly.
const POLYNOMIAL_TO: f64 = 0.75;
/// Least slope of the polynomial up to there, so that the distorted image does not fold (-).
const LEAST_SLOPE: f64 = 0.2;
/// Number of steps of Newton's method. The error is below 1e-9 after six, for every distortion that
/// is allowed.
const NEWTON_STEPS: usize = 8;

/// The lens as a scenario file describes it. The default is an ideal lens.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct LensConfig {
    /// Coefficient k1 of the radial distortion r·(1 + k1·r² + k2·r⁴), r being the tangent of the
    /// angle to the axis (-): negative for the barrel distortion of wide-angle lenses. The
    /// detections are projected with the same lens, because a camera is calibrated.
    pub distortion_k1: Num,
    /// Coefficient k2 of the radial distortion (-).
    pub distortion_k2: Num,
    /// Share of the natural vignetting, by which brightness falls with the fourth power of the
    /// cosine of the angle to the axis (0 to 1). 1 is an uncorrected lens: 47 % of the light remain
    /// in the corners.
    pub vignetting: Num,
    /// Reflectance of each surface of the lens (0 to 0.05), which draws ghosts of the sun and of
    /// headlamps: about 0.005 with a coating, 0.04 without one.
    pub surface_reflectance: Num,
}

impl Default for LensConfig {
    fn default() -> Self {
        let none = || Num::Fixed(0.0);
        Self { distortion_k1: none(), distortion_k2: none(), vignetting: none(), surface_reflectance: none() }
    }
}

/// The checked lens.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Optics {
    /// Coefficients k1 and k2 of the radial distortion (-).
    pub distortion: [f64; 2],
    /// Share of the natural vignetting (0 to 1).
    pub vignetting: f64,
    /// Reflectance of each surface of the lens (-).
    pub surface_reflectance: f64,
}

impl Check for LensConfig {
    type Checked = Optics;

    fn check(&self, parameters: &Parameters) -> Result<Optics, ConfigError> {
        let number = |num, key, low, high| parameters.number(num, key, Range::closed(low, high));
        let optics = Optics {
            distortion: [
                number(&self.distortion_k1, "distortion-k1", -0.5, 0.5)?,
                number(&self.distortion_k2, "distortion-k2", -0.5, 0.5)?,
            ],
            vignetting: parameters.number(&self.vignetting, "vignetting", Range::UNIT)?,
            surface_reflectance: number(&self.surface_reflectance, "surface-reflectance", 0.0, 0.05)?,
        };
        let steps = (0_u8..=100).map(|step| f64::from(step) / 100.0 * POLYNOMIAL_TO);
        let least = steps.map(|r| optics.slope(r)).fold(f64::INFINITY, f64::min);
        if least < LEAST_SLOPE {
            let rule = format!(
                "together they fold the image, because 1 + 3·k1·r² + 5·k2·r⁴ falls to {least:.2} for r up to {POLYNOMIAL_TO}; at \
                 least {LEAST_SLOPE} is needed"
            );
            let other = "distortion-k2";
            return Err(ConfigError::new("distortion-k1", Problem::Contradiction { other, rule }));
        }
        Ok(optics)
    }
}

impl Optics {
    /// Returns true if straight lines remain straight in the image.
    pub(crate) fn is_straight(&self) -> bool {
        self.distortion == [0.0; 2]
    }

    /// Returns the distance to the axis in the image of a ray at the tangent `r` to the axis.
    fn radius(&self, r: f64) -> f64 {
        let inner = r.min(POLYNOMIAL_TO);
        let [k1, k2] = self.distortion;
        let square = inner * inner;
        inner * (1.0 + square * (k1 + square * k2)) + self.slope(inner) * (r - inner)
    }

    /// Returns the derivative of the polynomial.
    fn slope(&self, r: f64) -> f64 {
        let [k1, k2] = self.distortion;
        let square = r * r;
        1.0 + square * (3.0 * k1 + square * 5.0 * k2)
    }

    /// Distorts a ray (x, y, 1), given by its tangents: returns its position in the image, in units
    /// of the focal length.
    pub(crate) fn distorted(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let r = (x * x + y * y).sqrt();
        if r == 0.0 {
            return [x, y];
        }
        let factor = self.radius(r) / r;
        [x * factor, y * factor]
    }

    /// Returns the ray (x, y, 1) that reaches a position in the image: the inverse of
    /// [`Optics::distorted`].
    pub(crate) fn undistorted(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let wanted = (x * x + y * y).sqrt();
        if wanted == 0.0 {
            return [x, y];
        }
        let mut r = wanted.min(POLYNOMIAL_TO);
        for _ in 0..NEWTON_STEPS {
            let slope = self.slope(r.min(POLYNOMIAL_TO));
            r = (r - (self.radius(r) - wanted) / slope).max(0.0);
        }
        let factor = r / wanted;
        [x * factor, y * factor]
    }

    /// Returns the bounds in the distorted image of a rectangle `[left, top, right, bottom]` of the
    /// ideal image (px), whose middle is `centre` (px).
    pub(crate) fn bounds(&self, [left, top, right, bottom]: [f64; 4], centre: [f64; 2], focal_px: f64) -> [f64; 4] {
        let tangents = |low: f64, high: f64, axis: usize| {
            let [low, high] = [low, high].map(|at| (at - centre[axis]) / focal_px);
            // A line of the rectangle deviates most at its ends, or where it is nearest to the
            // axis.
            [low, 0.0_f64.clamp(low, high.max(low)), high]
        };
        let (columns, rows) = (tangents(left, right, 0), tangents(top, bottom, 1));
        let mut bounds = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
        for x in columns {
            for y in rows {
                let [x, y] = self.distorted([x, y]);
                let [u, v] = [centre[0] + focal_px * x, centre[1] + focal_px * y];
                bounds = [bounds[0].min(u), bounds[1].min(v), bounds[2].max(u), bounds[3].max(v)];
            }
        }
        bounds
    }

    /// Returns the share of the light that reaches a pixel whose ray (x, y, 1) has this length (-).
    pub(crate) fn transmitted(&self, ray_length: f32) -> f32 {
        let cosine_squared = 1.0 / (ray_length * ray_length);
        1.0 - self.vignetting as f32 * (1.0 - cosine_squared * cosine_squared)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::camera::FOCAL_PX;

    fn lens(k1: f64, k2: f64) -> Result<Optics, ConfigError> {
        let config =
            LensConfig { distortion_k1: Num::Fixed(k1), distortion_k2: Num::Fixed(k2), ..LensConfig::default() };
        config.check(&Parameters::default())
    }

    proptest! {
        #[test]
        fn the_ray_of_a_pixel_reaches_that_pixel(
            k1 in -0.5..0.5_f64, k2 in -0.5..0.5_f64, x in -3.0..3.0_f64, y in -3.0..3.0_f64,
        ) {
            if let Ok(lens) = lens(k1, k2) {
                let [u, v] = lens.distorted([x, y]);
                let [there_x, there_y] = lens.undistorted([u, v]);
                prop_assert!((there_x - x).abs() < 1e-9 && (there_y - y).abs() < 1e-9, "{there_x} {there_y}");
            }
        }

        #[test]
        fn no_point_of_a_rectangle_lies_outside_of_its_bounds(
            k1 in -0.4..0.4_f64, corner in prop::array::uniform2(-1.0..1.0_f64), size in prop::array::uniform2(0.0..1.0_f64),
            at in prop::array::uniform2(0.0..1.0_f64),
        ) {
            if let Ok(lens) = lens(k1, 0.0) {
                let pixel = |[x, y]: [f64; 2]| [640.0 + FOCAL_PX * x, 400.0 + FOCAL_PX * y];
                let [left, top] = pixel(corner);
                let [right, bottom] = pixel([corner[0] + size[0], corner[1] + size[1]]);
                let bounds = lens.bounds([left, top, right, bottom], [640.0, 400.0], FOCAL_PX);
                let [u, v] = pixel(lens.distorted([corner[0] + at[0] * size[0], corner[1] + at[1] * size[1]]));
                prop_assert!(bounds[0] - 1e-6 <= u && u <= bounds[2] + 1e-6, "{u} in {bounds:?}");
                prop_assert!(bounds[1] - 1e-6 <= v && v <= bounds[3] + 1e-6, "{v} in {bounds:?}");
            }
        }
    }

    #[test]
    fn barrel_distortion_moves_the_corners_inwards_and_keeps_the_centre() {
        let barrel = lens(-0.3, 0.0).unwrap();
        assert_eq!(barrel.distorted([0.0, 0.0]), [0.0, 0.0]);
        let [x, _] = barrel.distorted([0.5, 0.0]);
        assert!((x - 0.5 * (1.0 - 0.3 * 0.25)).abs() < 1e-12);
    }

    #[test]
    fn a_distortion_that_folds_the_image_is_refused() {
        let error = lens(-0.5, 0.0).unwrap_err().to_string();
        assert!(error.contains("distortion-k1") && error.contains("fold"), "{error}");
        assert!(lens(0.0, -0.5).is_ok() == (1.0 - 2.5 * POLYNOMIAL_TO.powi(4) >= LEAST_SLOPE));
    }

    #[test]
    fn an_uncorrected_lens_leaves_the_fourth_power_of_the_cosine() {
        let lens = Optics { vignetting: 1.0, ..Optics::default() };
        let length = (1.0_f32 + 0.577 * 0.577).sqrt();
        assert!((lens.transmitted(length) - 0.5625).abs() < 1e-3);
        assert_eq!(Optics::default().transmitted(length), 1.0);
    }
}
