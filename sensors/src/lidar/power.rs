//! How much light comes back, and what the receiver makes of it.
//!
//! Received power of a surface element that takes up the share f of the footprint, at range R and incidence angle γ:
//!
//! ```text
//!   P ∝ f · ρ · cos γ · exp(−2·α·R) / R²
//! ```
//!
//! Powers are counted in units of the detection threshold. The receiver adds normal noise of 1/T of the threshold and
//! reports a return where the sum exceeds the threshold: at P = 1 with probability 0.5, at P = 1.26 with 0.9. That one
//! step gives the detection probability, its dependence on everything in the formula, and intensities that scatter.
//!
//! Calibration: P = 1 for a surface of reflectivity 0.5 that faces the sensor and fills the footprint at the nominal
//! range (200 m), in air that does not attenuate. A surface of 0.8 is then detected with probability 0.9 up to 226 m,
//! and one of 0.1 up to 80 m.

use closecall_traffic::Environment;

use super::Lidar;

/// Threshold over the standard deviation of the receiver's noise, T. At 5 a scan of 10⁴ beams with 10² independent
/// range cells each has a false alarm every third scan; they are not modelled.
pub(crate) const THRESHOLD_OVER_NOISE: f32 = 5.0;
/// Power below which the noise, which stays within 3.47 standard deviations, cannot lift a return above the threshold.
pub(crate) const MIN_POWER: f32 = 1.0 - 3.47 / THRESHOLD_OVER_NOISE;
/// Reflectivity of the target of the nominal range (dimensionless).
const NOMINAL_REFLECTIVITY: f64 = 0.5;
/// Standard deviation of range at high power (m), and what is added at the threshold.
const RANGE_SD_M: f32 = 0.03;
const RANGE_SD_AT_THRESHOLD_M: f32 = 0.09;
/// Meteorological visibility is the distance at which contrast falls to 2 %: α = ln 50 / V (Koschmieder 1924).
const KOSCHMIEDER: f64 = 3.912;
/// Extinction of rain at optical wavelengths: 1.076·r^0.67 dB/km at r mm/h (Carbonneau and Wisely 1998).
const RAIN_DB_PER_KM: f64 = 1.076;
const RAIN_EXPONENT: f64 = 0.67;
/// Decibels per neper of power, times metres per kilometre.
const DB_PER_KM_OVER_PER_M: f64 = 4_342.944_819;

/// Extinction below which the air sends nothing back that could be told from noise (1/m): a visibility of 1 km.
const FOG_FROM_PER_M: f32 = 0.004;

/// The link between surface and receiver in one weather.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LinkBudget {
    /// Power of ρ·cos γ·f = 1 at 1 m without attenuation (thresholds · m²).
    pub(crate) gain_m2: f32,
    /// Extinction coefficient of the air α (1/m).
    pub(crate) extinction_per_m: f32,
}

impl LinkBudget {
    #[expect(clippy::cast_possible_truncation, reason = "powers need no more than single precision")]
    pub(crate) fn new(lidar: &Lidar, environment: &Environment) -> Self {
        Self {
            // Out through the window, and back.
            gain_m2: ((lidar.nominal_range_m * lidar.window_transmission).powi(2) / NOMINAL_REFLECTIVITY) as f32,
            extinction_per_m: extinction_per_m(environment) as f32,
        }
    }

    /// True where the air holds enough droplets to send something back.
    pub(crate) fn has_fog(&self) -> bool {
        self.extinction_per_m >= FOG_FROM_PER_M
    }

    /// Share of the light that is left after the way out and back over `range_m`.
    pub(crate) fn transmission(&self, range_m: f32) -> f32 {
        (-2.0 * self.extinction_per_m * range_m).exp()
    }
}

/// Extinction of the air (1/m): what the visibility gives, or what the rain alone gives, whichever is more.
///
/// A visibility that was observed in rain has the rain's extinction in it, hence not the sum.
pub(crate) fn extinction_per_m(environment: &Environment) -> f64 {
    let rain_db_per_km = RAIN_DB_PER_KM * environment.rain_mm_per_h.powf(RAIN_EXPONENT);
    (KOSCHMIEDER / environment.visibility_m).max(rain_db_per_km / DB_PER_KM_OVER_PER_M)
}

/// Standard deviation of the measured range (m): 0.03 m for a strong return, 0.1 m at the threshold.
pub(crate) fn range_sd_m(power: f32) -> f32 {
    let weak = RANGE_SD_AT_THRESHOLD_M / power.max(1.0);
    (RANGE_SD_M * RANGE_SD_M + weak * weak).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nominal_target_is_at_the_threshold() {
        let link = LinkBudget::new(&Lidar::default(), &Environment::CLEAR_DAY);
        assert!((link.gain_m2 * 0.5 / (200.0 * 200.0) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn extinction_follows_visibility_and_rain() {
        let fog = Environment { visibility_m: 100.0, ..Environment::CLEAR_DAY };
        assert!((extinction_per_m(&fog) - 0.03912).abs() < 1e-9);
        // 10 mm/h: 1.076·10^0.67 = 5.033 dB/km.
        let rain = Environment { rain_mm_per_h: 10.0, ..Environment::CLEAR_DAY };
        assert!((extinction_per_m(&rain) - 5.0328e-3 / 4.342_944_8).abs() < 1e-6);
    }

    #[test]
    fn weak_returns_are_less_certain() {
        assert!((range_sd_m(1.0) - 0.0949).abs() < 1e-3);
        assert!((range_sd_m(100.0) - 0.03).abs() < 1e-3);
    }
}
