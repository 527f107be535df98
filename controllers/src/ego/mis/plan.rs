//! The plan of the margin increase system, for logs and plots.

use closecall_traffic::{Measured, TrackId};

/// The plan of one control step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MisPlan {
    /// The track of the rear vehicle.
    pub track: TrackId,
    /// Gap from the rear vehicle to the ego (m); negative if it overlaps the ego lengthwise.
    pub rear_gap_m: f64,
    /// Closing speed of the rear vehicle (m/s); negative if it falls back.
    pub closing_mps: f64,
    /// Present front time headway (s).
    pub thw_front_s: Measured,
    /// Time to closest encounter: time until the rear vehicle reaches the rear of the ego, both at
    /// their present speeds (s).
    pub ttce_s: Measured,
    /// t_c(a): time until the rear vehicle reaches the critical gap while the ego brakes as planned
    /// (s).
    pub time_to_critical_s: Measured,
    /// a*: planned braking (m/s²); 0 if none is needed.
    pub deceleration_mps2: f64,
    /// Target front time headway, fixed when engaging (s).
    pub goal_thw_s: f64,
    /// Predicted front time headway when the rear vehicle reaches the critical gap (s).
    pub thw_at_critical_s: Measured,
    /// Whether the target can be reached within the comfort limit.
    pub goal_in_reach: bool,
}
