//! Figures of an encounter, which need no viewer: for a report, for the index page of a campaign's
//! recordings, and on incident cards.
//!
//! ```text
//!   Film ─▶ road strips at (a) … (e) ─┐
//!        ─▶ trajectories, plots ──────┴─▶ SVG ─(bundled font)─▶ PNG, PDF
//! ```
//!
//! The same film gives the same bytes on every machine: this module writes the SVG itself, and
//! renders its text with the bundled font (a subset of DejaVu Sans; see `font/`), never with the
//! fonts of the machine.

mod card;
mod chart;
mod colours;
mod encounter;
mod pdf;
mod picture;
mod road;
mod scrubber;
mod still;
mod strip;
mod svg;
mod timeline;

pub(crate) use card::{card, incident};
pub use encounter::encounter;
pub use picture::{PictureError, PictureFile, parse_width_mm};
pub(crate) use scrubber::scrubber;
pub use still::still;
pub(crate) use timeline::timeline;

#[cfg(test)]
mod tests;
