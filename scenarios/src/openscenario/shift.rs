//! The shift of a vehicle within its lane over time.

use std::f64::consts::PI;

use closecall_traffic::maths;

/// Difference of two times that are the same but for rounding (s): numerical.
const SAME_S: f64 = 1e-9;

/// A shift within the lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shift {
    pub(super) vehicle: usize,
    /// Line of the action.
    pub(super) line: usize,
    pub(super) from_m: f64,
    pub(super) to_m: f64,
    pub(super) begins_s: f64,
    pub(super) duration_s: f64,
    pub(super) is_cubic: bool,
    /// Whether the action goes on for ever when the vehicle has the offset.
    pub(super) is_kept: bool,
}

impl Shift {
    /// Returns the offset at a time, positive to the left (m).
    pub(super) fn offset_m(&self, time_s: f64) -> f64 {
        let is_over = time_s >= self.begins_s + self.duration_s - SAME_S;
        let part = if is_over { 1.0 } else { (time_s - self.begins_s) / self.duration_s };
        let share = if self.is_cubic { part * part * (3.0 - 2.0 * part) } else { 0.5 * (1.0 - maths::cos(PI * part)) };
        self.from_m + share * (self.to_m - self.from_m)
    }

    /// Returns whether the action still runs.
    pub(super) fn runs(&self, time_s: f64) -> bool {
        self.is_kept || time_s < self.begins_s + self.duration_s - SAME_S
    }
}
