//! The background above the ground at the four moments of a pixel at once: the steps of
//! [`super::radiance`], with the same bits.

use wide::f32x4;

use super::{CLOUDS_KEY, WOODS, WOODS_KEY, WOODS_M, WOODS_SLOPE};
use crate::camera::lanes::{LineNoise, PlaneNoise, Radiance, none};
use crate::camera::light::Illumination;

/// The noise of treetops, leaves and clouds, with its latest cells.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SkyNoise {
    tops: [LineNoise; 2],
    leaves: PlaneNoise,
    clouds: PlaneNoise,
}

#[inline]
fn splat(value: f32) -> f32x4 {
    f32x4::splat(value)
}

/// Returns the radiance of the background, by moment. Returns `None` if some of the moments see
/// woods and others the sky.
#[inline]
pub(crate) fn radiances(slope: f32x4, bearing: f32x4, light: &Illumination, noise: &mut SkyNoise) -> Option<Radiance> {
    let is_low = slope.simd_lt(splat(WOODS_SLOPE));
    if is_low.any() {
        let [low, high] = [9.0, 43.0].map(|rate| splat(rate) * bearing);
        let top = splat(0.45) * noise.tops[0].at(WOODS_KEY, low) + splat(0.35) * noise.tops[1].at(WOODS_KEY, high);
        let is_wood = is_low & slope.simd_lt(splat(WOODS_SLOPE) * (splat(0.1) + top));
        if is_wood.all() {
            let texture = noise.leaves.at(WOODS_KEY, splat(160.0) * bearing, splat(160.0) * slope);
            let leaves = splat(0.6) + splat(0.8) * texture;
            let left = splat(light.transmission(WOODS_M));
            return Some(std::array::from_fn(|i| {
                let lit = splat(WOODS[i]) * leaves * splat(light.ambient[i] + 0.5 * light.sun[i]);
                splat(light.horizon[i]) + (lit - splat(light.horizon[i])) * left
            }));
        }
        if !none(is_wood) {
            return None;
        }
    }
    let high = {
        let slope = slope.max(splat(0.0));
        slope / (slope + splat(Illumination::HALF_WAY_SLOPE))
    };
    let lower = slope + splat(0.15);
    let cloud = noise.clouds.at(CLOUDS_KEY, splat(4.0) * bearing / lower, splat(6.0) / lower);
    let bright = (cloud - splat(0.45)).max(splat(0.0)) * splat(0.6);
    Some(std::array::from_fn(|i| {
        let sky = splat(light.horizon[i]) + splat(light.zenith[i] - light.horizon[i]) * high;
        sky + (splat(light.horizon[i] * 1.05) - sky) * bright
    }))
}
