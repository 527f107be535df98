//! Light that strays in the lens and the window: halos around lamps, their streaks on a wet road, the sun's glare.
//!
//! A halo ends at a finite radius, so that it can be left out where it does not reach without changing a pixel.

use super::light::Illumination;
use super::mesh::{Vec3, dot};

/// The sun's glare begins at this cosine of the angle to it: about 53°.
const GLARE_FROM_COSINE: f32 = 0.6;

/// A halo or a streak in the image.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Glow {
    /// Its middle [px].
    pub(crate) at: [f32; 2],
    /// Where it ends, to the side and upwards [px].
    pub(crate) reach_px: [f32; 2],
    /// How much brighter its middle is than its flanks [1]: 0 for a streak.
    pub(crate) peak: f32,
    /// Radiance in the middle.
    pub(crate) radiance: Vec3,
}

impl Glow {
    /// The halo of a lamp `depth_m` away, `facing` the lens by this cosine, which shows in the dark alone.
    pub(crate) fn halo(at: [f32; 2], depth_m: f32, facing: f32, radiance: Vec3) -> Self {
        /// Depth at which a halo is as described here [m].
        const REFERENCE_M: f32 = 30.0;
        let near = (REFERENCE_M / depth_m.max(2.0)).min(6.0);
        let reach = 14.0 + 50.0 * near.min(2.5);
        let strength = 0.030 * near.min(2.0) * facing.max(0.0).powi(3);
        Self { at, reach_px: [reach, reach], peak: 900.0 / (1.0 + near), radiance: radiance.map(|x| x * strength) }
    }

    /// The streak that the same lamp draws on a wet road, whose mirror image is at `at`.
    pub(crate) fn streak(at: [f32; 2], halo: &Self, wetness: f32) -> Self {
        let [side, _] = halo.reach_px;
        let reach_px = [0.16 * side, 0.9 * side];
        Self { at, reach_px, peak: 0.0, radiance: halo.radiance.map(|x| x * 0.5 * wetness) }
    }

    /// Smallest and largest column, smallest and largest row that it reaches [px].
    pub(crate) fn bounds(&self) -> [f32; 4] {
        let [u, v] = self.at;
        let [side, up] = self.reach_px;
        [u - side, v - up, u + side, v + up]
    }

    /// Its radiance at a pixel.
    pub(crate) fn add_to(&self, pixel: [f32; 2], light: &mut Vec3) {
        let x = (pixel[0] - self.at[0]) / self.reach_px[0];
        let y = (pixel[1] - self.at[1]) / self.reach_px[1];
        let square = x * x + y * y;
        if square < 1.0 {
            let falls = (1.0 - square) * (1.0 - square) / (1.0 + self.peak * square);
            for (sum, own) in light.iter_mut().zip(self.radiance) {
                *sum += own * falls;
            }
        }
    }
}

/// Radiance of the sun's disc and of its glare in the direction of the unit vector `towards`.
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
    fn a_halo_ends_where_its_bounds_say() {
        let halo = Glow::halo([100.0, 100.0], 40.0, 1.0, [3.0; 3]);
        let [left, _, right, _] = halo.bounds();
        let at = |u: f32| {
            let mut light = [0.0; 3];
            halo.add_to([u, 100.0], &mut light);
            light[0]
        };
        assert_eq!(at(left), 0.0);
        assert_eq!(at(right), 0.0);
        assert!(at(100.0) > at(110.0) && at(110.0) > 0.0);
    }
}
