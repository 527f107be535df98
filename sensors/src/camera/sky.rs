//! The background above the ground: woods at the horizon, clouds and sky.

use super::hash::{LineNoise, PlaneNoise};
use super::light::Illumination;
use super::mesh::{Vec3, each};

mod lanes;
pub(crate) use lanes::{SkyNoise as SkyNoiseLanes, radiances};

/// Distance of the woods, which determines how much the air attenuates their light (m).
const WOODS_M: f32 = 350.0;
/// Maximum slope (rise over run) of the treetops, seen from the lens.
const WOODS_SLOPE: f32 = 0.075;
const WOODS: Vec3 = [0.035, 0.055, 0.025];
const WOODS_KEY: u64 = 0x0077_6f6f_6473;
const CLOUDS_KEY: u64 = 0x636c_6f75_6473;

/// The noise of treetops, leaves and clouds, with its latest cells.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SkyNoise {
    tops: [LineNoise; 2],
    leaves: PlaneNoise,
    clouds: PlaneNoise,
}

/// Returns the radiance of the background in a direction `slope` (rise over run) above the horizon.
/// `bearing` is the tangent of the angle from the camera's axis plus the ego's yaw.
pub(crate) fn radiance(slope: f32, bearing: f32, light: &Illumination, noise: &mut SkyNoise) -> Vec3 {
    let sky = light.sky(slope.max(0.0));
    if slope < WOODS_SLOPE {
        let top =
            0.45 * noise.tops[0].at(WOODS_KEY, 9.0 * bearing) + 0.35 * noise.tops[1].at(WOODS_KEY, 43.0 * bearing);
        if slope < WOODS_SLOPE * (0.1 + top) {
            let leaves = 0.6 + 0.8 * noise.leaves.at(WOODS_KEY, 160.0 * bearing, 160.0 * slope);
            let left = light.transmission(WOODS_M);
            return each(|i| {
                let lit = WOODS[i] * leaves * (light.ambient[i] + 0.5 * light.sun[i]);
                light.horizon[i] + (lit - light.horizon[i]) * left
            });
        }
    }
    let cloud = noise.clouds.at(CLOUDS_KEY, 4.0 * bearing / (slope + 0.15), 6.0 / (slope + 0.15));
    let bright = (cloud - 0.45).max(0.0) * 0.6;
    each(|i| sky[i] + (light.horizon[i] * 1.05 - sky[i]) * bright)
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{Check, Environment, Parameters, VehicleState};

    use super::*;
    use crate::camera::CameraConfig;

    #[test]
    fn woods_are_darker_than_the_sky_and_vanish_in_fog() {
        let camera = CameraConfig::default().check(&Parameters::default()).unwrap();
        let light = |environment: &Environment| Illumination::new(environment, &camera, &VehicleState::default(), 0.0);
        let radiance = |slope, bearing, light: &_| radiance(slope, bearing, light, &mut SkyNoise::default());
        let clear = light(&Environment::CLEAR_DAY);
        assert!(radiance(0.001, 0.1, &clear)[1] < 0.6 * radiance(0.2, 0.1, &clear)[1]);
        let fog = light(&Environment { visibility_m: 100.0, ..Environment::CLEAR_DAY });
        assert!((radiance(0.001, 0.1, &fog)[1] - fog.horizon[1]).abs() < 0.01 * fog.horizon[1]);
    }
}
