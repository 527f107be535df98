//! Absorption and scattering of light in the air.

use crate::{Environment, maths};

/// Product of extinction and meteorological visibility V, the distance at which contrast falls to 2
/// %: α = ln 50 / V (Koschmieder 1924).
pub const KOSCHMIEDER: f64 = 3.912;
/// Factor in the extinction of rain at optical wavelengths: 1.076·r^0.67 dB/km at r mm/h
/// (Carbonneau and Wisely 1998).
const RAIN_DB_PER_KM: f64 = 1.076;
/// Exponent of the rain rate in that formula.
const RAIN_EXPONENT: f64 = 0.67;

/// Returns the extinction of the rain (dB/km).
pub fn rain_db_per_km(environment: &Environment) -> f64 {
    RAIN_DB_PER_KM * maths::powf(environment.rain_mm_per_h, RAIN_EXPONENT)
}
