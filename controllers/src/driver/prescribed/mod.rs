//! A driver that follows a profile, whatever the others do.
//!
//! ```text
//!   profile               times and speeds, linear in between ─────────────┐
//!   acceleration-profile  times and accelerations, each held ─ integrated ─┼─▶ speed wanted, and its slope ─▶ acceleration
//!   recorded              a track of a recording's file ── read with the ──┘
//!                                                          scenario file
//! ```

mod config;
mod driver;
mod profile;

pub use config::{Prescribed, PrescribedConfig, RecordedConfig};
