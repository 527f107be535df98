//! An encounter as a picture that needs no viewer: for a report, and for the page of a campaign's recordings.
//!
//! ```text
//!   Film ─▶ strips of the road (a) … (e) ─┐
//!        ─▶ trajectories, plots ──────────┴─▶ SVG ─(bundled font)─▶ PNG
//! ```
//!
//! The same film gives the same bytes on every machine: the SVG is written by hand, and its text is turned into pixels
//! with the font that is bundled here (DejaVu Sans, cut down; see `font/`), never with what a machine happens to have.

mod chart;
mod colours;
mod encounter;
mod png;
mod still;
mod strip;
mod svg;

pub use encounter::encounter;
pub use png::{PngError, png};
pub use still::still;

#[cfg(test)]
mod tests;
