//! The optical path from the scene to the pixel values: the rear window with dirt and water drops,
//! falling rain, and the image sensor with its noise.
//!
//! Every effect depends only on the pixel and on random keys, never on neighbouring pixels.

use wide::f32x4;

use super::hash::{mix_at, normal3, unit};
use super::light::Illumination;
use super::mesh::{Vec3, each};
use super::picture::Resolution;

/// Side of the square cells of the window (px of the usual image). A cell holds at most one speck
/// of dirt and one drop.
const CELL_PX: i32 = 44;
/// Width and height of the cells in which at most one streak of rain falls (px of the usual image).
const STREAK_CELL_PX: [i32; 2] = [11, 64];
/// Share of the window that drops cover in heavy rain (0 to 1), and the rain rate at which they
/// cover half of that share (mm/h).
const DROP_COVERAGE: [f32; 2] = [0.5, 10.0];
/// Rain rate at which every cell holds a streak (mm/h).
const STREAKS_FULL_MM_PER_H: f32 = 60.0;
const DIRT_KEY: u64 = 0x6469_7274;

/// The rear window and the image sensor during one exposure.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RearWindow {
    /// Share of the window that is soiled (0 to 1).
    pub(crate) dirt: f32,
    /// Key of the pattern of drops. It changes as drops run down and the wiper passes.
    pub(crate) drops_key: u64,
    /// Key of the sensor noise and of the rain streaks. It changes with every exposure.
    pub(crate) noise_key: u64,
    /// Size of the image. Dirt, drops and streaks cover the same share of each image.
    pub(crate) image: Resolution,
}

/// The effect of one blot, a speck of dirt or a drop, on the light that passes through a pixel.
struct Blot {
    /// Strength of the effect: 0 at the rim, 1 in the middle.
    depth: f32,
    /// A random number from 0 to 1 that belongs to the blot.
    random: f32,
}

impl RearWindow {
    /// Returns the radiance that reaches the sensor, given the radiance of the scene.
    pub(crate) fn transmitted(&self, pixel: [i32; 2], scene: Vec3, light: &Illumination) -> Vec3 {
        let pixel = pixel.map(|at| self.image.in_usual(at));
        let mut radiance = scene;
        if self.dirt > 0.0
            && let Some(blot) = blot_at(DIRT_KEY, pixel, self.dirt)
        {
            // Dirt blocks part of the light and scatters skylight into the lens.
            let kept = 1.0 - 0.55 * blot.depth;
            radiance = each(|i| radiance[i] * kept + 0.12 * blot.depth * light.ambient[i]);
        }
        if light.rain_mm_per_h > 0.0 {
            let covered = DROP_COVERAGE[0] * light.rain_mm_per_h / (light.rain_mm_per_h + DROP_COVERAGE[1]);
            if let Some(blot) = blot_at(self.drops_key, pixel, covered) {
                // A real drop shows a small inverted image, with the bright sky below and the dark
                // road above. The model uses the mean of that image.
                let bright = 0.35 + 0.5 * blot.random;
                radiance = each(|i| radiance[i] + (bright * light.horizon[i] - radiance[i]) * 0.5 * blot.depth);
            }
            let streak = self.streak(pixel, light.rain_mm_per_h);
            radiance = each(|i| radiance[i] + (1.1 * light.horizon[i] - radiance[i]) * streak);
        }
        radiance
    }

    /// Returns the opacity of the rain that falls through a pixel during the exposure.
    fn streak(&self, [u, v]: [i32; 2], rain_mm_per_h: f32) -> f32 {
        const OPACITY: f32 = 0.22;
        let [width, height] = STREAK_CELL_PX;
        let bits = mix_at(self.noise_key ^ self.drops_key, u.div_euclid(width), v.div_euclid(height));
        if unit(bits) * STREAKS_FULL_MM_PER_H > rain_mm_per_h {
            return 0.0;
        }
        let column = (unit(bits << 12) * width as f32).floor();
        let from = unit(bits << 24) * 0.6 * height as f32;
        let length = 6.0 + 18.0 * unit(bits << 36);
        let (x, y) = (u.rem_euclid(width) as f32, v.rem_euclid(height) as f32);
        if x == column && y >= from && y < from + length { OPACITY } else { 0.0 }
    }

    /// Returns the pixel's value: it applies the exposure gain, encodes the result by a square
    /// root, and adds noise.
    ///
    /// The standard deviation of shot noise grows with the square root of the light, so that it is
    /// uniform after a square-root encoding (Anscombe, 1948). Read noise is added, which is visible
    /// only in dark pixels.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to 0 … 255 before the cast")]
    pub(crate) fn encode(&self, [u, v]: [i32; 2], light_in: Vec3, light: &Illumination) -> [u8; 3] {
        const DARK: f32 = 0.1;
        let splat = f32x4::splat;
        // The three colours share a vector.
        let colours = |[red, green, blue]: Vec3| f32x4::new([red, green, blue, 0.0]);
        let noise = colours(normal3(mix_at(self.noise_key, u, v)));
        let encoded = (colours(light_in) * splat(light.gain)).max(splat(0.0)).sqrt();
        let deviation = splat(light.noise[0]) + splat(light.noise[1]) / (encoded + splat(DARK));
        let value = encoded.min(splat(1.0)) + deviation * noise;
        let [red, green, blue, _] = (value * splat(255.0) + splat(0.5)).max(splat(0.0)).min(splat(255.0)).to_array();
        [red, green, blue].map(|value| value as u8)
    }
}

/// Returns the blot that covers a pixel, if there is one. `share` is the share of cells that hold a
/// blot.
fn blot_at(key: u64, [u, v]: [i32; 2], share: f32) -> Option<Blot> {
    let (i, j) = (u.div_euclid(CELL_PX), v.div_euclid(CELL_PX));
    let bits = mix_at(key, i, j);
    if unit(bits) >= share {
        return None;
    }
    let cell = CELL_PX as f32;
    let radius = cell * (0.08 + 0.4 * unit(bits << 8) * unit(bits << 16));
    let centre_at = |turn: u32| radius + (cell - 2.0 * radius) * unit(bits << turn);
    let (x, y) =
        (u.rem_euclid(CELL_PX) as f32 + 0.5 - centre_at(24), v.rem_euclid(CELL_PX) as f32 + 0.5 - centre_at(36));
    let depth = 1.0 - (x * x + y * y) / (radius * radius);
    (depth > 0.0).then(|| Blot { depth, random: unit(bits << 40) })
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{Check, Environment, Light, Parameters, VehicleState};

    use super::*;
    use crate::camera::CameraConfig;

    const WINDOW: RearWindow = RearWindow { dirt: 0.0, drops_key: 1, noise_key: 2, image: Resolution::USUAL };

    fn light(environment: Environment) -> Illumination {
        let camera = CameraConfig::default().check(&Parameters::default()).unwrap();
        Illumination::new(&environment, &camera, &VehicleState::default(), 0.0)
    }

    fn deviation(light: &Illumination, scene: f32) -> f64 {
        let values = (0..4_000).map(|u| f64::from(WINDOW.encode([u, 7], [scene; 3], light)[0]));
        let (sum, squares) = values.fold((0.0, 0.0), |(sum, squares), x| (sum + x, squares + x * x));
        (squares / 4_000.0 - (sum / 4_000.0).powi(2)).sqrt()
    }

    #[test]
    fn dark_pixels_are_noisier_and_night_is_noisier_than_day() {
        let day = light(Environment::CLEAR_DAY);
        let night = light(Environment { light: Light::Night, ..Environment::CLEAR_DAY });
        assert!(deviation(&day, 0.02) > deviation(&day, 0.5));
        assert!(deviation(&night, 0.005) > 3.0 * deviation(&day, 0.25));
    }

    #[test]
    fn a_clean_dry_window_leaves_the_light_unchanged() {
        let day = light(Environment::CLEAR_DAY);
        for u in 0..500 {
            assert_eq!(WINDOW.transmitted([u, 3], [0.3, 0.4, 0.5], &day), [0.3, 0.4, 0.5]);
        }
        let soiled = RearWindow { dirt: 1.0, ..WINDOW };
        assert!((0..500).any(|u| soiled.transmitted([u, 20], [0.3, 0.4, 0.5], &day)[0] < 0.29));
    }

    #[test]
    fn dirt_and_rain_cover_the_same_part_of_an_image_with_more_pixels() {
        let rain = light(Environment { rain_mm_per_h: 20.0, ..Environment::CLEAR_DAY });
        let usual = RearWindow { dirt: 0.5, ..WINDOW };
        let fine = RearWindow { image: Resolution { width_px: 2_560, height_px: 1_600 }, ..usual };
        let seen = |window: &RearWindow, pixel: [i32; 2]| window.transmitted(pixel, [0.3, 0.4, 0.5], &rain);
        let mut differ = 0;
        for (u, v) in (0..300).flat_map(|u| (0..60).map(move |v| (u, v))) {
            assert_eq!(seen(&usual, [u, v]), seen(&fine, [2 * u + 1, 2 * v]));
            differ += usize::from(seen(&usual, [u, v]) != seen(&fine, [u, v]));
        }
        assert!(differ > 100, "the pattern does not depend on the pixel");
    }
}
