//! How long a vehicle is in a lane if it stays there.

use closecall_traffic::Time;

/// Shortest time in a lane before and after a crossing.
pub(crate) const MIN_DWELL: Time = Time::from_ms(500);

/// Tolerance of the dwell time, because recorded times are rounded.
const ROUNDING: Time = Time::from_ms(5);

/// Returns true if a vehicle is long enough in a lane to stay there.
pub(crate) fn is_stay(duration: Time) -> bool {
    duration + ROUNDING >= MIN_DWELL
}
