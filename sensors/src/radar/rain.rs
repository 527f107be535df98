//! Range of a radar at 77 GHz in rain.
//!
//! Rain attenuates the signal on its way to the vehicle and back. The specific attenuation is a
//! power of the rain rate, γ = k·r^α (Recommendation ITU-R P.838-3, *Specific attenuation model for
//! rain for use in prediction methods*, 2005, for 1 to 1,000 GHz). At 5, 25, 50 and 100 mm/h it is
//! 3.6, 11, 18 and 30 dB/km.
//!
//! By the radar equation, the range R in rain is the distance at which the received power
//! exp(−2βR)/R⁴ equals the power at the range R₀ in dry air, with β = γ·ln 10/10. It follows that
//! ln R + βR/2 = ln R₀. The left side grows with R and is concave, so Newton's method approaches
//! the solution from below if it starts below.
//!
//! The model neglects the backscatter of the drops, and with it false alarms: no source was found
//! for their rate. It also neglects spray, a film of water on the radome (the fault `range-share`),
//! and fog, whose drops are small compared with the wavelength.

use closecall_traffic::maths;

/// Coefficient k (dB/km at 1 mm/h) and exponent α (-) at 77 GHz, for a horizontal path and a
/// polarisation of 45°: equations 2 to 5 and tables 1 to 4 of the recommendation. All other
/// polarisations have k from 1.128 to 1.132, and α from 0.707 to 0.718.
const K_DB_PER_KM: f64 = 1.129_8;
const ALPHA: f64 = 0.712_5;
/// Number of Newton steps. After six, the error is below a millimetre for all rain rates and ranges
/// that a scenario can have.
const STEPS: usize = 10;

/// Returns the specific attenuation of the power by rain, one way (1/m).
fn attenuation_per_m(rain_mm_per_h: f64) -> f64 {
    let db_per_km = K_DB_PER_KM * maths::powf(rain_mm_per_h, ALPHA);
    1e-3 * db_per_km * std::f64::consts::LN_10 / 10.0
}

/// Returns the range in rain (m) of a radar whose range in dry air is `dry_range_m`.
pub(super) fn range_in_rain_m(dry_range_m: f64, rain_mm_per_h: f64) -> f64 {
    if !(rain_mm_per_h > 0.0) {
        return dry_range_m;
    }
    let half_per_m = 0.5 * attenuation_per_m(rain_mm_per_h);
    let goal = maths::ln(dry_range_m);
    let mut range_m = dry_range_m * maths::exp(-half_per_m * dry_range_m);
    for _ in 0..STEPS {
        range_m += (goal - maths::ln(range_m) - half_per_m * range_m) / (1.0 / range_m + half_per_m);
    }
    range_m
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dry_air_leaves_the_range_and_rain_shortens_it_by_the_radar_equation() {
        assert_eq!(range_in_rain_m(90.0, 0.0), 90.0);
        // By bisection of the radar equation in decibels, with the recommendation's coefficients.
        for (rain_mm_per_h, dry_m, range_m) in [
            (5.0, 90.0, 86.8556),
            (25.0, 90.0, 81.0705),
            (50.0, 90.0, 76.5626),
            (100.0, 90.0, 70.5118),
            (50.0, 300.0, 197.6283),
            (100.0, 300.0, 167.8300),
        ] {
            let found_m = range_in_rain_m(dry_m, rain_mm_per_h);
            assert!((found_m - range_m).abs() < 0.01, "{rain_mm_per_h} mm/h: {found_m} m, not {range_m} m");
        }
    }

    #[test]
    fn the_received_power_at_the_range_is_the_same_in_every_rain() {
        for dry_m in [0.5, 20.0, 90.0, 300.0] {
            let mut last_m = dry_m;
            for rain_mm_per_h in [0.1, 1.0, 10.0, 50.0, 200.0] {
                let range_m = range_in_rain_m(dry_m, rain_mm_per_h);
                assert!(range_m > 0.0 && range_m < last_m, "{dry_m} m, {rain_mm_per_h} mm/h: {range_m} m");
                let path = maths::exp(-2.0 * attenuation_per_m(rain_mm_per_h) * range_m);
                let share = path * maths::powf(dry_m / range_m, 4.0);
                assert!((share - 1.0).abs() < 1e-6, "{dry_m} m, {rain_mm_per_h} mm/h: {share}");
                last_m = range_m;
            }
        }
    }
}
