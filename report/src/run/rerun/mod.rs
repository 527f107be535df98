//! Recordings: one film, or a pair of films, as an .rrd file for the Rerun viewer, with a layout of
//! its own.
//!
//! ```text
//!  Film ─▶ road, vehicles, tracks, points │ from above │ camera │ plots │ log │ story │ blueprint ─▶ FILE.rrd
//! ```
//!
//! A recording is written as a whole when the outcome of the run is known. It is therefore small
//! and never incomplete, and it opens at the critical moment. Two films share one timeline and the
//! same plots. Each has its own 3D scene, in which the vehicles of the other film appear as
//! outlines.
//!
//! Only this folder uses the rerun library: its public interface, and, in `parts.rs` alone, parts
//! of it.

mod bird;
mod blueprint;
mod bodies;
mod camera;
mod collisions;
mod error;
mod fog;
mod ghosts;
mod log;
mod looped;
mod palette;
mod parts;
mod perceived;
mod plots;
mod points;
mod properties;
mod radars;
mod recording;
mod road;
mod stream;
mod summary;
mod truth;
mod vehicles;
mod version;
mod write;

pub use error::RecordingError;
pub use looped::LoopedRecording;
pub use version::{RerunVersion, VersionError};
pub(crate) use write::write_recording_of;
pub use write::{check_recording_possible, is_recording_enabled, write_recording, write_recording_unchecked};
