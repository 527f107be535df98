//! A driver that follows a prescribed profile and does not react to other vehicles.
//!
//! ```text
//!   profile               times and speeds, linear in between ───────────────┐
//!   acceleration-profile  times and accelerations, each held ── integrated ──┼─▶ speed and slope ─▶ acceleration
//!   recorded              a track of a trajectory file ── read together ─────┘
//!                                                         with the scenario file
//! ```
//!
//! The driver changes lanes at the times in `lane-changes`, on the same smooth path as all
//! vehicles.

mod config;
mod driver;
mod lane_change;
mod profile;

pub use config::{Prescribed, PrescribedConfig, RecordedConfig};
pub use lane_change::PrescribedLaneChangeConfig;
