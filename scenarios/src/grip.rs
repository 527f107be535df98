//! The share of the road's friction that a driver uses laterally.

use closecall_traffic::GRAVITY_MPS2;

/// Fraction of the friction that a driver can use laterally in an evasion without losing control:
/// an assumption; 0.3 to 0.8 are plausible.
const LATERAL_SHARE: f64 = 0.5;

/// Returns the largest lateral acceleration that drivers use on a road with this friction (m/s²).
pub fn lateral_grip_mps2(friction: f64) -> f64 {
    LATERAL_SHARE * friction * GRAVITY_MPS2
}
