//! Stray light in the lens and the window, and reflections: halos around lamps, streaks of lamps on
//! a wet road, and the glare of the sun.
//!
//! A halo has a finite radius and contributes exactly zero beyond it. A crop that the halo does not
//! reach can therefore be rendered without it.

use super::light::Illumination;
use super::mesh::{Vec3, dot};
use super::picture::{FOCAL_PX, Resolution};

/// Cosine of the angle to the sun within which glare is visible: about 53°.
const GLARE_FROM_COSINE: f32 = 0.6;
/// Cosine of a slightly larger angle: rounding cannot confuse the two.
pub(crate) const NO_GLARE_TO_COSINE: f32 = GLARE_FROM_COSINE - 0.001;

/// Places of the ghosts, as a multiple of the source's distance to the middle of the image, and
/// their radii (px of the usual image): an assumption, because each lens has its own. Ghosts are
/// the sharper the nearer the second reflection is to a focus.
const GHOSTS: [[f32; 2]; 3] = [[-0.5, 60.0], [-1.1, 36.0], [0.35, 90.0]];

/// A halo, a streak or a ghost in the image.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Glow {
    /// Centre (px).
    pub(crate) centre_px: [f32; 2],
    /// Horizontal and vertical radius, beyond which there is no light (px).
    pub(crate) reach_px: [f32; 2],
    /// Sharpness of the peak in the middle, dimensionless: 0 for streaks and ghosts, which have
    /// none.
    pub(crate) peak: f32,
    /// Radiance in the centre.
    pub(crate) radiance: Vec3,
}

impl Glow {
    /// Returns the halo of a lamp at the depth `depth_m`. `facing` is the cosine of the angle
    /// between the lamp's axis and the direction to the lens. Halos are used only in the dark. The
    /// size is the size in the usual image.
    pub(crate) fn halo(centre_px: [f32; 2], depth_m: f32, facing: f32, radiance: Vec3) -> Self {
        /// Depth at which the halo's size and strength have their nominal values (m).
        const REFERENCE_M: f32 = 30.0;
        let near = (REFERENCE_M / depth_m.max(2.0)).min(6.0);
        let reach = 14.0 + 50.0 * near.min(2.5);
        let strength = 0.030 * near.min(2.0) * facing.max(0.0).powi(3);
        Self {
            centre_px,
            reach_px: [reach, reach],
            peak: 900.0 / (1.0 + near),
            radiance: radiance.map(|x| x * strength),
        }
    }

    /// Returns the streak that the lamp of `halo` draws on a wet road. The mirror image of the lamp
    /// is at `at` (px).
    pub(crate) fn streak(centre_px: [f32; 2], halo: &Self, wetness: f32) -> Self {
        let [side, _] = halo.reach_px;
        let reach_px = [0.16 * side, 0.9 * side];
        Self { centre_px, reach_px, peak: 0.0, radiance: halo.radiance.map(|x| x * 0.5 * wetness) }
    }

    /// Returns the same glow in an image with so many times the pixels in each direction.
    pub(crate) fn enlarged(self, scale: f32) -> Self {
        Self { reach_px: self.reach_px.map(|reach_px| reach_px * scale), ..self }
    }

    /// Returns the ghosts of a source at a position in the image (px): light that two surfaces of
    /// the lens have reflected appears again on the line through the middle of the image.
    /// `irradiance` is what all of it would bring to the lens.
    pub(crate) fn ghosts(source_px: [f32; 2], irradiance: Vec3, image: Resolution) -> [Self; GHOSTS.len()] {
        let middle = image.middle_px().map(|part| part as f32);
        GHOSTS.map(|[place, radius_px]| {
            let centre_px = [0, 1].map(|axis| middle[axis] + place * (source_px[axis] - middle[axis]));
            let radius = radius_px / FOCAL_PX as f32;
            // The falloff of `add_to` without a peak has a third of the flux of a uniform disc.
            let solid_angle = std::f32::consts::PI * radius * radius / 3.0;
            let radiance = irradiance.map(|part| part / solid_angle);
            Self { centre_px, reach_px: [radius_px; 2], peak: 0.0, radiance }.enlarged(image.scale() as f32)
        })
    }

    /// Returns the bounds `[left, top, right, bottom]` of the glow in the image (px).
    pub(crate) fn bounds(&self) -> [f32; 4] {
        let [u, v] = self.centre_px;
        let [side, up] = self.reach_px;
        [u - side, v - up, u + side, v + up]
    }

    /// Adds the glow's radiance at a pixel to `light`.
    pub(crate) fn add_to(&self, pixel: [f32; 2], light: &mut Vec3) {
        let x = (pixel[0] - self.centre_px[0]) / self.reach_px[0];
        let y = (pixel[1] - self.centre_px[1]) / self.reach_px[1];
        let square = x * x + y * y;
        if square < 1.0 {
            let falloff = (1.0 - square) * (1.0 - square) / (1.0 + self.peak * square);
            for (sum, radiance) in light.iter_mut().zip(self.radiance) {
                *sum += radiance * falloff;
            }
        }
    }
}

/// Returns the radiance of the sun's disc and of its glare in the direction of the unit vector
/// `towards`.
pub(crate) fn sun(towards: Vec3, light: &Illumination) -> Vec3 {
    let cosine = dot(towards, light.to_sun);
    if light.sun[0] <= 0.0 || cosine <= GLARE_FROM_COSINE {
        return [0.0; 3];
    }
    let angle = 1.0 - cosine;
    let from = 1.0 - GLARE_FROM_COSINE;
    let glare = 0.010 * (1.0 / (angle + 0.004) - 1.0 / (from + 0.004));
    light.sun.map(|sun| sun * glare)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_halo_is_zero_at_its_bounds_and_peaks_in_its_centre() {
        let halo = Glow::halo([100.0, 100.0], 40.0, 1.0, [3.0; 3]);
        let [left, _, right, _] = halo.bounds();
        let radiance_at = |u: f32| {
            let mut light = [0.0; 3];
            halo.add_to([u, 100.0], &mut light);
            light[0]
        };
        assert_eq!(radiance_at(left), 0.0);
        assert_eq!(radiance_at(right), 0.0);
        assert!(radiance_at(100.0) > radiance_at(110.0) && radiance_at(110.0) > 0.0);
    }

    #[test]
    fn a_ghost_in_an_image_of_twice_as_many_pixels_has_twice_the_radius_and_the_same_radiance() {
        let twice = Resolution { width_px: 2_560, height_px: 1_600 };
        let usual = Glow::ghosts([800.0, 300.0], [1.0; 3], Resolution::USUAL);
        for (one, two) in usual.iter().zip(Glow::ghosts([1_600.0, 600.0], [1.0; 3], twice)) {
            assert_eq!(two.reach_px, one.reach_px.map(|reach_px| 2.0 * reach_px));
            assert_eq!(two.radiance, one.radiance);
            for (place, wanted) in two.centre_px.iter().zip(one.centre_px) {
                assert!((place - 2.0 * wanted).abs() < 1e-3);
            }
        }
    }
}
