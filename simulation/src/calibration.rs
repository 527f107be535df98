//! Calibration of the car-following models on recorded pairs.
//!
//! ```text
//!  recorded leader ─▶ model with parameters ─▶ simulated gap ─┐
//!  recorded gap ──────────────────────────────────────────────┴▶ error ─▶ optimiser ─▶ parameters
//! ```
//!
//! The follower starts as recorded and then drives by the model along the recorded leader. The
//! error is the root mean square of the difference between simulated and recorded gap: calibration
//! on travelled space is more robust than on speed or acceleration (Punzo and Montanino, *Speed or
//! spacing? Cumulative variables, and convolution of model errors and time in traffic flow models
//! validation and calibration*, Transportation Research Part B 91 (2016), abstract).
//!
//! A fixed share of the pairs, chosen by the hash of their names, is held out: it enters no
//! calibration. The other pairs are calibrated twice: with one set of parameters for each pair, and
//! with one set for all of them together (pooled). The pooled set is judged on the held-out pairs.
//! The sets of the single pairs form a population of drivers, whose predictions are compared with
//! the held-out recordings.

mod calibrate;
mod follower;
mod optimise;
mod predictive;
mod replaced;

pub use calibrate::{Calibration, Errors, PairResult, calibrate, calibrate_watched};
pub use follower::{FollowingModel, ParameterSpec};
pub use predictive::Predictive;
pub use replaced::{Calibrated, ahead_of, calibrate_replaced, value_of};
