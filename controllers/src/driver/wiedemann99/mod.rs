//! The car-following model of Wiedemann (1999): a human driver who stays in the lane.
//!
//! The parameters and their meaning follow the publication for PTV Vissim (User Manual, "Defining
//! the Wiedemann 99 model"). The regimes are the psycho-physical regimes of Wiedemann, *Simulation
//! des Straßenverkehrsflusses* (1974). [`Wiedemann99Model`] is the pure model;
//! [`Wiedemann99Driver`] adapts it to the simulation loop.

mod config;
mod driver;
mod model;
mod thresholds;

pub(crate) use config::Parameters99;
pub use config::{Wiedemann99, Wiedemann99Config};
pub use driver::Wiedemann99Driver;
pub(crate) use driver::{
    EmergencyBrakingDetector, brake_before_overtaking, brake_for_brake_light, brake_while_overtaking,
    default_desired_mps, nearest_lead,
};
pub use model::Wiedemann99Model;
pub use thresholds::{Regime, Thresholds};
