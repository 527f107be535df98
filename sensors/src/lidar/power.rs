//! The link budget: received power, detection threshold and range noise.
//!
//! A surface element of reflectivity ρ covers the share f of the footprint, at range R and
//! incidence angle γ. With the extinction coefficient α of the air, its received power is
//!
//! ```text
//!   P ∝ f · ρ · cos γ · exp(−2·α·R) / R²
//! ```
//!
//! Powers are in multiples of the detection threshold. The receiver adds normal noise with a
//! standard deviation of 1/T of the threshold. It reports a return if the sum exceeds the
//! threshold: with probability 0.5 at P = 1, and with 0.9 at P = 1.26. This single step yields the
//! detection probability, its dependence on all terms of the formula, and the scatter of the
//! intensities.
//!
//! Calibration: P = 1 for a surface of reflectivity 0.5 that faces the sensor and fills the
//! footprint at the nominal range, in air that does not attenuate. The nominal range of the SCALA,
//! 200 m, is an assumption, and so are the reflectivity and the probability that it refers to: the
//! maker publishes none of them. 150 to 250 m are plausible. A surface of reflectivity 0.8 is then
//! detected with probability 0.9 up to 226 m, and a surface of reflectivity 0.1 up to 80 m.

use closecall_traffic::{Environment, KOSCHMIEDER, maths, rain_db_per_km};

use super::Lidar;
use super::kind::{NOMINAL_REFLECTIVITY, THRESHOLD_OVER_NOISE};

/// Intensity at which the receiver saturates, as a reflectivity.
pub const MAX_INTENSITY: f32 = 4.0;

/// Power below which a return cannot be detected: the noise stays within 3.47 standard deviations,
/// and cannot raise the return above the threshold.
pub(crate) const MIN_POWER: f32 = 1.0 - 3.47 / THRESHOLD_OVER_NOISE;
/// Extinction in dB/km that corresponds to an extinction of 1/m: decibels per neper of power, times
/// metres per kilometre.
const DB_PER_KM_OVER_PER_M: f64 = 4_342.944_819;

/// Extinction below which backscatter from the air cannot be distinguished from noise (1/m): a
/// visibility of 1 km.
const FOG_FROM_PER_M: f32 = 0.004;

/// The link budget between a surface and the receiver in given weather.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LinkBudget {
    /// Received power for ρ·cos γ·f = 1 at 1 m without attenuation (thresholds · m²).
    pub(crate) gain_m2: f32,
    /// The same behind a clean window (thresholds · m²).
    pub(crate) clean_gain_m2: f32,
    /// Extinction coefficient α of the air (1/m).
    pub(crate) extinction_per_m: f32,
    /// Standard deviation of the measured range at high power, and the additional one at the
    /// detection threshold (m).
    range_sd_m: [f32; 2],
    /// Range beyond which nothing is reported (m).
    pub(crate) max_range_m: f32,
}

impl LinkBudget {
    /// Returns the link budget of a LiDAR in this weather.
    #[expect(clippy::cast_possible_truncation, reason = "powers need no more than single precision")]
    pub(crate) fn new(lidar: &Lidar, environment: &Environment) -> Self {
        Self {
            // The window attenuates the light on the way out and on the way back.
            gain_m2: ((lidar.nominal_range_m * lidar.window_transmission).powi(2) / NOMINAL_REFLECTIVITY) as f32,
            clean_gain_m2: (lidar.nominal_range_m.powi(2) / NOMINAL_REFLECTIVITY) as f32,
            extinction_per_m: extinction_per_m(environment) as f32,
            range_sd_m: lidar.kind.range_sd_m,
            max_range_m: if lidar.is_exact { f32::INFINITY } else { lidar.kind.max_range_m },
        }
    }

    /// Returns the standard deviation of the measured range (m): 0.03 m for a strong return of the
    /// SCALA, 0.1 m at the threshold.
    pub(crate) fn range_sd_m(&self, power: f32) -> f32 {
        let [strong, at_threshold] = self.range_sd_m;
        let weak = at_threshold / power.max(1.0);
        (strong * strong + weak * weak).sqrt()
    }

    /// Returns the intensity that the sensor reports for a return of this power (thresholds) at
    /// this range (m). The sensor is calibrated behind a clean window and does not know of dirt.
    pub(crate) fn reported_intensity(&self, power: f32, range_m: f32) -> f32 {
        (power * (range_m * range_m) / self.clean_gain_m2).min(MAX_INTENSITY)
    }

    /// Returns true if the air contains enough droplets for detectable backscatter.
    pub(crate) fn has_fog(&self) -> bool {
        self.extinction_per_m >= FOG_FROM_PER_M
    }

    /// Returns the share of the light that remains after the way out and back over `range_m`.
    pub(crate) fn transmission(&self, range_m: f32) -> f32 {
        maths::exp(-2.0 * self.extinction_per_m * range_m)
    }
}

/// Returns the extinction coefficient of the air (1/m): the greater of the values for the
/// visibility and for the rain.
///
/// The two are not added, because a visibility observed in rain already includes the extinction of
/// the rain.
pub(crate) fn extinction_per_m(environment: &Environment) -> f64 {
    (KOSCHMIEDER / environment.visibility_m).max(rain_db_per_km(environment) / DB_PER_KM_OVER_PER_M)
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
    fn a_reported_intensity_falls_with_the_square_of_the_window_transmission() {
        let at = |window_transmission| {
            let lidar = Lidar { window_transmission, ..Lidar::default() };
            let link = LinkBudget::new(&lidar, &Environment::CLEAR_DAY);
            // A surface of reflectivity 0.5 that fills the beam at 50 m.
            link.reported_intensity(0.5 * link.gain_m2 / 2_500.0, 50.0)
        };
        assert!((at(1.0) - 0.5).abs() < 1e-6 && (at(0.6) - 0.18).abs() < 1e-6, "{} {}", at(1.0), at(0.6));
        assert_eq!(at(0.0), 0.0);
        // The receiver saturates at what it receives, not at what would come through a clean
        // window.
        let link = LinkBudget::new(&Lidar::default(), &Environment::CLEAR_DAY);
        assert_eq!(link.reported_intensity(1e6, 50.0), MAX_INTENSITY);
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
    fn weak_returns_have_a_larger_range_error() {
        let link = LinkBudget::new(&Lidar::default(), &Environment::CLEAR_DAY);
        assert!((link.range_sd_m(1.0) - 0.0949).abs() < 1e-3);
        assert!((link.range_sd_m(100.0) - 0.03).abs() < 1e-3);
    }
}
