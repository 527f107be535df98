//! What lies between the scene and the picture: the rear window with its dirt and drops, falling rain, and the
//! image sensor with its noise.
//!
//! Everything here is a function of the pixel and of keys, never of neighbouring pixels.

use super::hash::{mix_at, normal3, unit};
use super::light::Illumination;
use super::mesh::{Vec3, each};

/// Side of the square in which there is at most one speck or drop [px].
const CELL_PX: i32 = 44;
/// Width and height of the rectangle in which at most one streak of rain falls [px].
const STREAK_CELL_PX: [i32; 2] = [11, 64];
/// Share of the window that drops cover in heavy rain [1], and the rate at which half of that is reached [mm/h].
const DROPS: [f32; 2] = [0.5, 10.0];
/// Rain rate at which every rectangle holds a streak [mm/h].
const STREAKS_FULL_MM_PER_H: f32 = 60.0;
const DIRT_KEY: u64 = 0x6469_7274;

/// The window and the sensor during one exposure.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Window {
    /// Share of the window that is soiled [1].
    pub(crate) dirt: f32,
    /// Changes as drops run down and the wiper passes.
    pub(crate) drops_key: u64,
    /// Changes with every exposure.
    pub(crate) noise_key: u64,
}

/// How one blot changes the light that passes it.
struct Blot {
    /// 0 outside, 1 in the middle.
    depth: f32,
    /// A random number of the blot's own, 0 … 1.
    own: f32,
}

impl Window {
    /// The light that reaches the sensor, from the light of the scene.
    pub(crate) fn seen_through(&self, pixel: [i32; 2], scene: Vec3, light: &Illumination) -> Vec3 {
        let mut seen = scene;
        if self.dirt > 0.0
            && let Some(blot) = blot(DIRT_KEY, pixel, self.dirt)
        {
            // Dirt blocks some light and scatters in some of the sky's.
            let kept = 1.0 - 0.55 * blot.depth;
            seen = each(|i| seen[i] * kept + 0.12 * blot.depth * light.ambient[i]);
        }
        if light.rain_mm_per_h > 0.0 {
            let covered = DROPS[0] * light.rain_mm_per_h / (light.rain_mm_per_h + DROPS[1]);
            if let Some(blot) = blot(self.drops_key, pixel, covered) {
                // A drop shows a small inverted picture: bright sky below, dark road above; here its mean.
                let bright = 0.35 + 0.5 * blot.own;
                seen = each(|i| seen[i] + (bright * light.horizon[i] - seen[i]) * 0.5 * blot.depth);
            }
            let streak = self.streak(pixel, light.rain_mm_per_h);
            seen = each(|i| seen[i] + (1.1 * light.horizon[i] - seen[i]) * streak);
        }
        seen
    }

    /// Opacity of the rain that falls through a pixel during the exposure.
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

    /// The pixel's value: exposure, the square root as encoding, noise.
    ///
    /// Light arrives in grains, so its noise grows with its square root: after a square-root encoding it is the same
    /// everywhere (Anscombe, 1948). Reading the sensor adds noise that shows in the dark alone.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to 0 … 255 before the cast")]
    pub(crate) fn develop(&self, [u, v]: [i32; 2], light_in: Vec3, light: &Illumination) -> [u8; 3] {
        const DARK: f32 = 0.1;
        let noise = normal3(mix_at(self.noise_key, u, v));
        each(|i| {
            let encoded = (light_in[i] * light.gain).max(0.0).sqrt();
            let deviation = light.noise[0] + light.noise[1] / (encoded + DARK);
            let value = encoded.min(1.0) + deviation * noise[i];
            (value * 255.0 + 0.5).clamp(0.0, 255.0) as u8
        })
    }
}

/// The blot that covers a pixel, where `share` of the cells have one.
fn blot(key: u64, [u, v]: [i32; 2], share: f32) -> Option<Blot> {
    let (i, j) = (u.div_euclid(CELL_PX), v.div_euclid(CELL_PX));
    let bits = mix_at(key, i, j);
    if unit(bits) >= share {
        return None;
    }
    let cell = CELL_PX as f32;
    let radius = cell * (0.08 + 0.4 * unit(bits << 8) * unit(bits << 16));
    let place = |turn: u32| radius + (cell - 2.0 * radius) * unit(bits << turn);
    let (x, y) = (u.rem_euclid(CELL_PX) as f32 + 0.5 - place(24), v.rem_euclid(CELL_PX) as f32 + 0.5 - place(36));
    let depth = 1.0 - (x * x + y * y) / (radius * radius);
    (depth > 0.0).then(|| Blot { depth, own: unit(bits << 40) })
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{Check, Environment, Light, Parameters, VehicleState};

    use super::*;
    use crate::camera::CameraConfig;

    const WINDOW: Window = Window { dirt: 0.0, drops_key: 1, noise_key: 2 };

    fn light(environment: Environment) -> Illumination {
        let camera = CameraConfig::default().check(&Parameters::default()).unwrap();
        Illumination::new(&environment, &camera, &VehicleState::default(), 0.0)
    }

    fn deviation(light: &Illumination, scene: f32) -> f64 {
        let values = (0..4_000).map(|u| f64::from(WINDOW.develop([u, 7], [scene; 3], light)[0]));
        let (sum, squares) = values.fold((0.0, 0.0), |(sum, squares), x| (sum + x, squares + x * x));
        (squares / 4_000.0 - (sum / 4_000.0).powi(2)).sqrt()
    }

    #[test]
    fn the_dark_is_noisier_and_night_more_so() {
        let day = light(Environment::CLEAR_DAY);
        let night = light(Environment { light: Light::Night, ..Environment::CLEAR_DAY });
        assert!(deviation(&day, 0.02) > deviation(&day, 0.5));
        assert!(deviation(&night, 0.005) > 3.0 * deviation(&day, 0.25));
    }

    #[test]
    fn a_clean_window_in_the_dry_changes_nothing() {
        let day = light(Environment::CLEAR_DAY);
        for u in 0..500 {
            assert_eq!(WINDOW.seen_through([u, 3], [0.3, 0.4, 0.5], &day), [0.3, 0.4, 0.5]);
        }
        let soiled = Window { dirt: 1.0, ..WINDOW };
        assert!((0..500).any(|u| soiled.seen_through([u, 20], [0.3, 0.4, 0.5], &day)[0] < 0.29));
    }
}
