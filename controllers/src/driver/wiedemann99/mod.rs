//! The following model of Wiedemann (1999): a human who stays in its lane.
//!
//! The model's parameters and their meaning are those published for PTV Vissim (User Manual, "Defining the Wiedemann 99
//! model"); its regimes are the psycho-physical ones of Wiedemann, *Simulation des Straßenverkehrsflusses* (1974).
//! [`Wiedemann99Model`] is the model, [`Wiedemann99Driver`] adapts it to the loop.

mod config;
mod driver;
mod model;
mod thresholds;

pub(crate) use config::Parameters99;
pub use config::{Wiedemann99, Wiedemann99Config};
pub use driver::Wiedemann99Driver;
pub(crate) use driver::{Emergency, brake_for_light, lift_off_for_light, nearest, usually_desired_mps};
pub use model::Wiedemann99Model;
pub use thresholds::{Regime, Thresholds};
