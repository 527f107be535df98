//! Values of recorded traffic with the digits of a scenario file.

use closecall_traffic::{Num, Trajectory};

/// Number of rounding steps per unit of a value in the file.
const STEPS_PER_UNIT: f64 = 1_000.0;
/// Lower limit of recorded speeds, if a speed is used as a divisor, a desired speed or a speed
/// limit (m/s).
pub(super) const MIN_SPEED_MPS: f64 = 1.0;
/// Smallest difference of two values in the file.
pub(super) const ROUNDING_STEP: f64 = 1.0 / STEPS_PER_UNIT;

/// Returns the highest recorded speed of the vehicles (m/s), at least [`MIN_SPEED_MPS`].
pub(super) fn max_speed_mps<'a>(vehicles: impl IntoIterator<Item = &'a Trajectory>) -> f64 {
    let speeds = vehicles.into_iter().flat_map(|vehicle| vehicle.points.iter().map(|point| point.speed_mps));
    speeds.fold(MIN_SPEED_MPS, f64::max)
}

pub(super) fn rounded(value: f64) -> Num {
    Num::Fixed(to_steps(value))
}

pub(super) fn to_steps(value: f64) -> f64 {
    (value * STEPS_PER_UNIT).round() / STEPS_PER_UNIT
}
