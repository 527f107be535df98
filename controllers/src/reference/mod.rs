//! The performance models of UN Regulation 157 (annex 4, appendix 3): they decide which conflicts
//! ahead a careful driver resolves.
//!
//! ```text
//!  conflict ─▶ model ─▶ clear │ harmless │ braking
//! ```
//!
//! The regulation knows two: the competent and careful human driver ([`CarefulDriver`]), and the
//! fuzzy safety model ([`FuzzySafetyModel`]) that a manufacturer may use instead. The equations and
//! figures come from JRC-FSM, the implementation of the European Commission's Joint Research Centre
//! (`utility/models.py`, `utility/vehicle.py`, `utility/fuzzy_functs.py`), because the text of the
//! regulation was not at hand. [`CutIn`] is its test case.

mod careful_driver;
mod cut_in;
mod fuzzy_safety;

pub use careful_driver::{BrakingReaction, CRITICAL_TTC_S, CarefulDriver};
pub use cut_in::CutIn;
pub use fuzzy_safety::FuzzySafetyModel;
pub(crate) use fuzzy_safety::following_gap_m;

use closecall_traffic::GRAVITY_MPS2;

/// Hardest braking of both models (m/s²) (JRC-FSM).
pub(crate) const HARDEST_BRAKING_MPS2: f64 = 0.774 * GRAVITY_MPS2;
/// Jerk with which both models build up braking (m/s³) (JRC-FSM).
pub(crate) const BUILD_UP_MPS3: f64 = 12.65;
/// Time from the perception of a risk to the beginning of braking, in both models (s) (JRC-FSM).
pub(crate) const DELAY_S: f64 = 0.75;

/// Another vehicle ahead, in the own lane or on its way there, as a reference model sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conflict {
    /// Gap from the own front bumper to its rear bumper (m); negative while they overlap
    /// lengthwise.
    pub gap_m: f64,
    /// Gap from side to side (m); negative while they overlap sideways.
    pub lateral_gap_m: f64,
    /// Sum of the half lengths of both vehicles (m).
    pub half_lengths_m: f64,
    /// Speed with which the other vehicle moves sideways towards the own lane (m/s).
    pub lateral_closing_mps: f64,
    /// Own speed (m/s).
    pub speed_mps: f64,
    /// Speed of the other vehicle (m/s).
    pub other_speed_mps: f64,
    /// Own acceleration (m/s²).
    pub acceleration_mps2: f64,
}

impl Conflict {
    /// Returns true if the centre of the other vehicle is behind the own one: it is then no
    /// conflict ahead.
    pub(crate) fn is_behind(&self) -> bool {
        self.gap_m + self.half_lengths_m < 0.0
    }

    /// Returns the closing speed (m/s).
    pub(crate) fn closing_mps(&self) -> f64 {
        self.speed_mps - self.other_speed_mps
    }
}

/// The response of a reference model to a conflict at one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Assessment {
    /// There is no risk.
    Clear,
    /// The model has looked at the conflict once and for all, and finds no risk in it.
    Harmless,
    /// There is a risk: the model decelerates this much (m/s²); 0 while it only delays.
    Risk(f64),
}

/// A performance model of the regulation.
pub trait ReferenceModel {
    /// Looks at a conflict for `step_s` more seconds.
    fn assess(&mut self, conflict: &Conflict, step_s: f64) -> Assessment;
}
