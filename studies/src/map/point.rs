//! One point of the map.

use serde::Serialize;

/// Largest difference of margin between theory and loop that needs no reason (s).
const AGREES_WITHIN_S: f64 = 0.2;

/// One point of the map.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MapPoint {
    /// Speed by which the rear vehicle is faster than the ego (km/h).
    pub closing_kmh: f64,
    /// Gap at which the system may engage (m).
    pub detection_m: f64,
    /// Front time headway of the ego at the start (s).
    pub front_thw_s: f64,
    /// Braking that the plan asks for (m/s²); `None` if the system does not engage in theory.
    pub planned_mps2: Option<f64>,
    /// Margin in theory (s); `None` if there is none.
    pub theory_s: Option<f64>,
    /// Margin in theory if the braking took effect at once (s): the equation of the paper.
    pub theory_at_once_s: Option<f64>,
    /// Margin in the loop (s); `None` if there is none.
    pub loop_s: Option<f64>,
    /// Whether the goal is reached in theory.
    pub is_in_time_in_theory: bool,
    /// Whether the goal is reached in the loop.
    pub is_in_time_in_loop: bool,
    /// Why theory and loop differ by more than 0.2 s, or only one of them has a margin; `None` if
    /// they agree.
    pub reason: Option<String>,
}

impl MapPoint {
    /// Returns whether theory and loop agree within 0.2 s, or neither has a margin.
    pub fn agrees(&self) -> bool {
        match (self.theory_s, self.loop_s) {
            (Some(theory_s), Some(loop_s)) => (theory_s - loop_s).abs() <= AGREES_WITHIN_S,
            (None, None) => true,
            _ => false,
        }
    }
}
