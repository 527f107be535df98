//! The human drivers.
//!
//! Each has the same three layers: *perception* (the truth, late and coarse), a *model* of following, which is pure and
//! can be tested alone, and a *driver* that adapts the two to the loop.

mod idm;
mod interface;
mod overtaker;
mod perception;
mod prescribed;
mod reaction;
mod wiedemann99;

pub use idm::{Idm, IdmConfig};
pub use interface::{
    Driver, DriverAction, DriverError, DriverInput, DriverNote, LaneChange, LaneNeighbours, Neighbour, Neighbours,
};
pub use overtaker::{FollowConfig, Overtaker, OvertakerConfig};
pub use prescribed::{Prescribed, PrescribedConfig};
pub use reaction::{LogNormalConfig, Reaction, ReactionConfig};
pub use wiedemann99::{Regime, Wiedemann99, Wiedemann99Config, Wiedemann99Driver, Wiedemann99Model};

use closecall_traffic::Time;

/// Hardest braking a human asks for [m/s²]: the mean of emergency braking on dry roads (Burg and Moser, Handbuch
/// Verkehrsunfallrekonstruktion, 2017: 7.5 to 8.5 m/s²).
pub(crate) const HARDEST_BRAKING_MPS2: f64 = 8.0;

/// Deceleration with the foot off the accelerator at highway speed [m/s²] (engine drag and air: 0.5 to 1 m/s²).
pub(crate) const LIFT_OFF_MPS2: f64 = 0.7;

/// `value`, where it is finite.
pub(crate) fn finite(value: f64, what: &'static str, time: Time) -> Result<f64, DriverError> {
    if value.is_finite() { Ok(value) } else { Err(DriverError::NotFinite { what, time }) }
}

/// The vehicle ahead as the following models see it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lead {
    /// Gap bumper to bumper [m].
    pub gap_m: f64,
    /// Its speed [m/s].
    pub speed_mps: f64,
    /// Its acceleration [m/s²].
    pub acceleration_mps2: f64,
}
