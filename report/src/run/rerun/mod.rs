//! A run, or a pair of them, as a file of the Rerun viewer, with a layout of its own.
//!
//! ```text
//!  Film ─▶ road, vehicles, tracks, points │ from above │ camera │ plots │ log │ story │ blueprint ─▶ F.rrd
//! ```
//!
//! A film is written when its outcome is known, in one go and in columns: small, fast, never half there, and opening at
//! the moment that turned out to be the critical one. Two films share one time line: each has a world of its own, in
//! which the other's vehicles stand as outlines, and both are drawn into the same plots.
//!
//! This folder is the only one that names the library.

mod bird;
mod blueprint;
mod bodies;
mod camera;
mod ghosts;
mod log;
mod palette;
mod perceived;
mod plots;
mod points;
mod road;
mod stream;
mod summary;
mod truth;
mod vehicles;
mod write;

#[cfg(test)]
mod tests;

pub use write::{RecordError, check_recordable, record_films, write_films};
