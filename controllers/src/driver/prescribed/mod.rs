//! A driver that follows a profile, whatever the others do.
//!
//! ```text
//!   profile               times and speeds, linear in between ─────────────┐
//!   acceleration-profile  times and accelerations, each held ─ integrated ─┼─▶ speed wanted, and its slope ─▶ acceleration
//!   recorded              a track of a recording's file ── read with the ──┘
//!                                                          scenario file
//! ```
//!
//! It changes lanes where `lane-changes` says so, on the smooth path that all vehicles take.

mod config;
mod driver;
mod lane_change;
mod profile;

pub use config::{Prescribed, PrescribedConfig, RecordedConfig};
pub use lane_change::PrescribedLaneChangeConfig;
