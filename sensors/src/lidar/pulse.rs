//! The echo pulse width: the time for which an echo exceeds the detection threshold.
//!
//! ```text
//!  power     _-‾‾‾-_        pulse of the laser, widened by the depth of the target
//!          _/       \_
//!  1 ─ ─ ─/─ ─ ─ ─ ─ ─\─ ─  detection threshold
//!      _-‾ |◀ width ▶| ‾-_
//! ```
//!
//! A Gaussian pulse with the peak P, in detection thresholds, and the standard deviation s exceeds
//! the threshold for 2·s·√(2·ln P). The echo of a target is the pulse, convolved with the
//! distribution of the light over the ranges in the footprint, so s² = s₀² + (2/c)²·Var(R). The
//! variance of the ranges contains the incidence angle, and the parts of a beam that an edge
//! splits. All of the receiver is in P: the range, the reflectivity, the air and the window.
//!
//! Deviations from a real receiver:
//!
//! - P is the power that the link budget compares with the threshold. The link budget adds up all
//!   light within the length of a pulse, so a deep target does not lower the peak.
//! - The eight sub-rays sample the footprint. On a slanted plane they have 0.97 of its standard
//!   deviation of the range from top to bottom, and 0.87 from side to side.
//! - The amplifier does not saturate. A real receiver has a longer tail after a very strong echo.
//!
//! Dudzik et al. 2025, *Physically-Based Simulation of Automotive LiDAR* (arXiv 2512.05932),
//! measure the conversion from received light to echo pulse width for the SCALA 2 by goniometer.
//! Only the abstract of the paper could be read, so no constant here is theirs.

use closecall_traffic::{Environment, maths};

use super::Lidar;
use super::echo::PULSE_M;
use super::power::LinkBudget;

/// Duration of the pulse at half of its peak (ns): an assumption, the duration behind
/// [`PULSE_M`]. The published model of the SCALA 1 has 4.5 ns (openMSL,
/// *reflection_based_lidar_object_model*). 3 to 6 ns are plausible.
const PULSE_NS: f32 = 5.0;
/// Duration of a Gaussian pulse at half of its peak, in standard deviations: 2·√(2·ln 2).
const HALF_PEAK_SDS: f32 = 2.354_82;
/// Time that light takes to a target and back, per metre of range: 2/c (ns/m).
const NS_PER_M: f32 = 6.671_282;
/// Variance of the range within an echo of droplets (m²). They fill the length of a pulse evenly.
pub(super) const DROPLET_VARIANCE_M2: f32 = PULSE_M * PULSE_M / 12.0;

/// Returns the time for which an echo exceeds the detection threshold (ns): 0 for a power of at
/// most one threshold. `power` is in detection thresholds, `range_variance_m2` the variance of the
/// range within the echo (m²).
pub(super) fn width_ns(power: f32, range_variance_m2: f32) -> f32 {
    if !(power > 1.0) {
        return 0.0;
    }
    let pulse_sd_ns = PULSE_NS / HALF_PEAK_SDS;
    let variance_ns2 = pulse_sd_ns * pulse_sd_ns + NS_PER_M * NS_PER_M * range_variance_m2;
    2.0 * (2.0 * maths::ln(power) * variance_ns2).sqrt()
}

/// Returns the echo pulse width (ns) that a LiDAR reports of a Lambertian surface of this
/// reflectivity at this range (m), without noise: 0 for an echo below the detection threshold. The
/// surface faces the sensor and fills the beam, in air that does not attenuate.
#[expect(clippy::cast_possible_truncation, reason = "powers need no more than single precision")]
pub fn echo_pulse_width_ns(lidar: &Lidar, reflectivity: f64, range_m: f64) -> f64 {
    let gain_m2 = f64::from(LinkBudget::new(lidar, &Environment::CLEAR_DAY).gain_m2);
    f64::from(width_ns((reflectivity * gain_m2 / (range_m * range_m)) as f32, 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_width_at_twice_the_threshold_is_the_duration_at_half_of_the_peak() {
        assert!((width_ns(2.0, 0.0) - PULSE_NS).abs() < 1e-4, "{}", width_ns(2.0, 0.0));
        // At the power P⁴ the logarithm is four times as large, and its root twice.
        assert!((width_ns(16.0, 0.0) - 2.0 * PULSE_NS).abs() < 1e-4);
    }

    #[test]
    fn the_width_is_the_time_between_the_two_crossings_of_the_threshold() {
        let (power, variance_m2) = (50.0_f32, 0.04_f32);
        // A Gaussian that is convolved with a Gaussian has the sum of their variances.
        let sd_ns = f64::from((PULSE_NS / HALF_PEAK_SDS).powi(2) + NS_PER_M.powi(2) * variance_m2).sqrt();
        let received = |after_ns: f64| f64::from(power) * maths::exp(-0.5 * (after_ns / sd_ns).powi(2));
        let half_ns = 0.5 * f64::from(width_ns(power, variance_m2));
        assert!((received(half_ns) - 1.0).abs() < 1e-3 && received(half_ns - 0.1) > 1.0, "{half_ns}");
    }

    #[test]
    fn no_echo_below_the_threshold_has_a_width_and_depth_widens() {
        for power in [1.0, 0.5, 0.0, f32::NAN] {
            assert_eq!(width_ns(power, 0.1), 0.0, "{power}");
        }
        assert!(width_ns(1.001, 0.0) > 0.0);
        assert!(width_ns(10.0, DROPLET_VARIANCE_M2) > 1.1 * width_ns(10.0, 0.0));
    }

    /// `docs/evidence/lidar.md` has these figures.
    #[test]
    fn the_widths_of_half_white_boards_fall_with_the_range_about_as_measured() {
        let predicted_ns = [20.0, 15.0, 10.0].map(|range_m| echo_pulse_width_ns(&Lidar::default(), 0.5, range_m));
        for (predicted_ns, stated_ns) in predicted_ns.into_iter().zip([12.89, 13.67, 14.70]) {
            assert!((predicted_ns - stated_ns).abs() < 0.005, "{predicted_ns}");
        }
        // The Ibeo LUX 2010 in openMSL's profile: c·4.5 ns, a range cell of 0.03 m, and the part
        // that depends on the power (m).
        let measured_m = [0.45, 0.61, 0.65].map(|by_power_m| 0.299_792_458 * 4.5 + 0.03 + by_power_m);
        for (predicted_ns, measured_m) in predicted_ns.into_iter().zip(measured_m) {
            let shares = [predicted_ns / 12.888, measured_m / measured_m_at_20_m()];
            assert!((shares[0] / shares[1] - 1.0).abs() < 0.035, "{shares:?}");
        }
        assert_eq!(echo_pulse_width_ns(&Lidar::default(), 0.5, 201.0), 0.0);
    }

    fn measured_m_at_20_m() -> f64 {
        0.299_792_458 * 4.5 + 0.03 + 0.45
    }

    #[test]
    fn the_duration_agrees_with_the_length_of_the_pulse() {
        assert!((PULSE_M * NS_PER_M - PULSE_NS).abs() < 0.01);
        // The length of light in 1 ns is 0.299792458 m.
        assert!((NS_PER_M * 0.299_792_46 - 2.0).abs() < 1e-5);
    }
}
