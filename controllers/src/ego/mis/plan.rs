//! What the margin increase system last worked out, for logs and plots.

use closecall_traffic::{Measured, TrackId};

/// The plan of one control step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MisPlan {
    /// The track of the vehicle behind.
    pub track: TrackId,
    /// Its gap to E [m]; negative where it overlaps E lengthwise.
    pub rear_gap_m: f64,
    /// Its closing speed [m/s]; negative where it falls back.
    pub closing_mps: f64,
    /// Front time headway now [s].
    pub thw_front_s: Measured,
    /// Time to closest encounter: until R reaches E's rear, both at their present speeds [s].
    pub ttce_s: Measured,
    /// t_c(a): until R reaches the critical distance, with E braking as planned [s].
    pub time_to_critical_s: Measured,
    /// a*: the braking planned [m/s²]; 0 where none is needed.
    pub deceleration_mps2: f64,
    /// The front time headway aimed at, fixed when engaging [s].
    pub goal_thw_s: f64,
    /// Front time headway foreseen when R reaches the critical distance [s].
    pub thw_at_critical_s: Measured,
    /// Whether the goal can be reached within the comfort limit.
    pub goal_in_reach: bool,
}
