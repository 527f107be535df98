//! The illumination, the attenuation by the air, and the exposure settings that follow from the
//! environment.
//!
//! Radiance has a relative unit: a white matt surface in full daylight has about 1. The model knows
//! three light levels (day, dusk, night) instead of the time of day. The ratios between them are
//! about the ratios of a camera with its aperture fully open. Air attenuates light by
//! exp(−σ·distance): σ = 3.912/V for the visibility V (Koschmieder, contrast threshold 2 %). Rain
//! adds 1.076·R^0.67 dB/km for the rain rate R in mm/h (Carbonneau and Wisely, 1998).

use closecall_traffic::{Environment, Light, VehicleState, maths};

use super::Camera;
use super::mesh::{Emission, Vec3, dot, each};
use closecall_traffic::{KOSCHMIEDER, rain_db_per_km};

/// Extinction coefficient that corresponds to 1 dB/km (1/m).
const PER_METRE_OF_DB_PER_KM: f64 = 1.0 / 4_343.0;
/// Rain rate from which the sky is fully overcast (mm/h).
const OVERCAST_RAIN_MM_PER_H: f64 = 0.5;
/// The largest visibility without direct light of the sun, and the smallest with its full light
/// (m).
const SUN_FADES_M: [f64; 2] = [1_500.0, 5_000.0];
/// Height of the water film from which the road has its full gloss (mm).
const WET_FILM_MM: f64 = 0.3;

/// The properties of light, air and exposure that are the same for all pixels of an image.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Illumination {
    /// Radiance of a white surface that only the sky illuminates.
    pub(crate) ambient: Vec3,
    /// Radiance that the sun adds to a white surface facing it.
    pub(crate) sun: Vec3,
    /// Unit vector towards the sun in the ground frame.
    pub(crate) to_sun: Vec3,
    /// Radiance of the sky overhead.
    pub(crate) zenith: Vec3,
    /// Radiance of the sky at the horizon, which is also the radiance of the scattering air in
    /// front of distant objects.
    pub(crate) horizon: Vec3,
    /// Extinction coefficient of the air (1/m).
    pub(crate) extinction_per_m: f32,
    /// Factor from radiance to linear sensor value: 1 saturates the sensor.
    pub(crate) gain: f32,
    /// Exposure time (s).
    pub(crate) exposure_s: f32,
    /// Noise of the encoded value: the standard deviation of the shot noise, and the coefficient of
    /// the read noise, which matters in dark pixels.
    pub(crate) noise: [f32; 2],
    /// Radiance of headlamps seen from the front.
    pub(crate) headlamp: f32,
    /// Radiance of marker lamps.
    pub(crate) marker: f32,
    /// Radiance of a white road surface that a headlamp illuminates from a few metres.
    pub(crate) beam: f32,
    /// Radiance of a white surface 1 m behind the ego's tail lamps that only they illuminate.
    pub(crate) tail: f32,
    /// Gloss of the road, from 0 (dry) to 1 (wet).
    pub(crate) wetness: f32,
    /// Rain rate (mm/h).
    pub(crate) rain_mm_per_h: f32,
}

/// The parameters of one light level. For their meaning see [`Illumination`].
struct LightLevel {
    ambient: Vec3,
    sun: f32,
    horizon: Vec3,
    zenith: Vec3,
    gain: f32,
    exposure_s: f32,
    noise: [f32; 2],
    headlamp: f32,
    marker: f32,
    beam: f32,
    tail: f32,
}

const DAY: LightLevel = LightLevel {
    ambient: [0.36, 0.40, 0.46],
    sun: 0.62,
    horizon: [0.78, 0.84, 0.92],
    zenith: [0.25, 0.42, 0.75],
    gain: 0.85,
    exposure_s: 0.002,
    noise: [0.006, 0.0006],
    headlamp: 1.3,
    marker: 0.0,
    beam: 0.0,
    tail: 0.0,
};

const DUSK: LightLevel = LightLevel {
    ambient: [0.030, 0.036, 0.050],
    sun: 0.0,
    horizon: [0.13, 0.10, 0.085],
    zenith: [0.025, 0.035, 0.07],
    gain: 7.0,
    exposure_s: 0.008,
    noise: [0.014, 0.002],
    headlamp: 4.0,
    marker: 1.0,
    beam: 0.02,
    tail: 0.06,
};

const NIGHT: LightLevel = LightLevel {
    ambient: [0.0016, 0.0016, 0.0019],
    sun: 0.0,
    horizon: [0.0016, 0.0014, 0.0013],
    zenith: [0.0004, 0.0004, 0.0006],
    gain: 45.0,
    exposure_s: 0.016,
    noise: [0.028, 0.004],
    headlamp: 3.0,
    marker: 0.3,
    beam: 0.02,
    tail: 0.06,
};

/// Brightness of brake lights divided by the brightness of tail lamps.
const BRAKE_LIGHT: f32 = 3.0;

impl Illumination {
    /// Slope at which the colour of the sky is half way from the horizon to the zenith (-).
    pub(crate) const HALF_WAY_SLOPE: f32 = 0.35;

    /// Derives the illumination from the environment, for a camera in the vehicle `ego`, whose yaw
    /// in the plane is `yaw_rad`.
    pub(crate) fn new(environment: &Environment, camera: &Camera, ego: &VehicleState, yaw_rad: f64) -> Self {
        let level = match environment.light {
            Light::Day => DAY,
            Light::Dusk => DUSK,
            Light::Night => NIGHT,
        };
        let [hazy_m, clear_m] = SUN_FADES_M;
        let dry = 1.0 - (environment.rain_mm_per_h / OVERCAST_RAIN_MM_PER_H).min(1.0);
        let clear = dry * ((environment.visibility_m - hazy_m) / (clear_m - hazy_m)).clamp(0.0, 1.0);
        let (sin, cos) = maths::sin_cos(camera.sun.elevation_rad);
        let (sin_azimuth, cos_azimuth) = maths::sin_cos(camera.sun.azimuth_rad - yaw_rad);
        let clear = clear as f32;
        // An overcast sky is grey, about as bright at the zenith as at the horizon, and illuminates
        // from all sides.
        let grey = level.horizon.iter().sum::<f32>() / 3.0;
        let overcast = |clear_value: f32, grey_value: f32| grey_value + (clear_value - grey_value) * clear;
        let extinction_per_m =
            KOSCHMIEDER / environment.visibility_m + rain_db_per_km(environment) * PER_METRE_OF_DB_PER_KM;
        let night_sky = if environment.light == Light::Night { camera.night_sky as f32 } else { 1.0 };
        let brake = if ego.brake_light { BRAKE_LIGHT } else { 1.0 };
        Self {
            ambient: level.ambient.map(|value| night_sky * overcast(value, 0.78 * grey)),
            sun: [1.0, 0.95, 0.86].map(|tint| tint * level.sun * clear),
            to_sun: [cos * cos_azimuth, cos * sin_azimuth, sin].map(|part| part as f32),
            zenith: level.zenith.map(|value| night_sky * overcast(value, 0.9 * grey)),
            horizon: level.horizon.map(|value| night_sky * overcast(value, grey)),
            extinction_per_m: extinction_per_m as f32,
            gain: level.gain * maths::exp2(camera.exposure_ev as f32),
            exposure_s: level.exposure_s,
            noise: level.noise,
            headlamp: level.headlamp,
            marker: level.marker,
            beam: level.beam,
            tail: level.tail * brake,
            wetness: (environment.water_film_mm / WET_FILM_MM).min(1.0) as f32,
            rain_mm_per_h: environment.rain_mm_per_h as f32,
        }
    }

    /// Returns `true` if it is so dark that headlamps visibly illuminate the road and show halos.
    pub(crate) fn is_dark(&self) -> bool {
        self.beam > 0.0
    }

    /// Returns the share of light that passes through `distance_m` of air (0 to 1).
    pub(crate) fn transmission(&self, distance_m: f32) -> f32 {
        exp_negative(self.extinction_per_m * distance_m)
    }

    /// Returns the radiance of a lamp's face.
    pub(crate) fn emitted_radiance(&self, emission: Emission, indicator_is_on: impl Fn(bool) -> bool) -> Vec3 {
        match emission {
            Emission::None => [0.0; 3],
            Emission::Headlamp => [1.0, 0.98, 0.92].map(|tint| tint * self.headlamp),
            Emission::Marker => [1.0, 0.6, 0.15].map(|tint| tint * self.marker),
            Emission::Indicator(is_left) => {
                let on = if indicator_is_on(is_left) { 0.5 * self.headlamp } else { 0.0 };
                [1.0, 0.5, 0.05].map(|tint| tint * on)
            }
        }
    }

    /// Returns the illumination of the lens by a headlamp at a distance (m), in units of π times
    /// the radiance of a white surface. `facing` is the cosine of the angle between the lamp's axis
    /// and the direction to the lens.
    pub(crate) fn headlamp_irradiance(&self, distance_m: f32, facing: f32) -> f32 {
        /// Distance at which a headlamp lights a white surface as [`Illumination::beam`] states
        /// (m).
        const BEAM_FROM_M: f32 = 10.0;
        let near = BEAM_FROM_M / distance_m.max(1.0);
        let facing = facing.max(0.0);
        std::f32::consts::PI * self.beam * near * near * facing * facing * facing
    }

    /// Returns the radiance that a matt white face with this normal vector reflects.
    pub(crate) fn diffuse_radiance(&self, normal: Vec3) -> Vec3 {
        /// Light that the road reflects upwards, relative to the light of the sky.
        const BOUNCE: f32 = 0.25;
        let upwards = 0.5 + 0.5 * normal[2];
        let sky = BOUNCE + (1.0 - BOUNCE) * upwards;
        let sun = dot(normal, self.to_sun).max(0.0);
        each(|channel| self.ambient[channel] * sky + self.sun[channel] * sun)
    }

    /// Returns the radiance of the sky, without clouds, at a slope (rise over run) above the
    /// horizon.
    pub(crate) fn sky(&self, slope: f32) -> Vec3 {
        let high = slope / (slope + Self::HALF_WAY_SLOPE);
        each(|channel| self.horizon[channel] + (self.zenith[channel] - self.horizon[channel]) * high)
    }
}

/// Returns e^−x for x ≥ 0, with an error below 2e-4. It uses only basic arithmetic, so that the
/// result is the same on every machine: the series of e^(x/16) to fourth order, raised to the 16th
/// power and inverted.
fn exp_negative(x: f32) -> f32 {
    let x = (x / 16.0).min(4.0);
    let inverse = 1.0 + x * (1.0 + x * (0.5 + x * (1.0 / 6.0 + x / 24.0)));
    let second = inverse * inverse;
    let fourth = second * second;
    let eighth = fourth * fourth;
    1.0 / (eighth * eighth)
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{Check, Parameters};

    use super::*;
    use crate::camera::CameraConfig;

    fn light(environment: &Environment) -> Illumination {
        let camera = CameraConfig::default().check(&Parameters::default()).unwrap();
        Illumination::new(environment, &camera, &VehicleState::default(), 0.0)
    }

    #[test]
    fn at_the_visibility_distance_one_fiftieth_of_the_contrast_remains() {
        let foggy = Environment { visibility_m: 200.0, ..Environment::CLEAR_DAY };
        assert!((light(&foggy).transmission(200.0) - 0.02).abs() < 1e-3);
    }

    #[test]
    fn the_series_approximates_the_exponential() {
        for step in 0_u8..100 {
            let x = f32::from(step) * 0.1;
            assert!((exp_negative(x) - maths::exp(-x)).abs() < 2e-4, "{x}");
        }
    }

    #[test]
    fn rain_hides_the_sun_and_attenuates_distant_light() {
        let rain = light(&Environment { rain_mm_per_h: 5.0, ..Environment::CLEAR_DAY });
        assert_eq!(rain.sun, [0.0; 3]);
        assert!(rain.transmission(100.0) < light(&Environment::CLEAR_DAY).transmission(100.0));
    }
}
