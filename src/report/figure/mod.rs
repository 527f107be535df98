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
mod encounter;
mod png;
mod still;
mod strip;
mod svg;

pub use encounter::encounter;
pub use png::{PngError, png};
pub use still::still;
pub(super) use svg::escaped;

/// Colours: one for each actor, as in the recordings, darker for white paper.
const EGO: &str = "#1f6fd1";
const FRONT: &str = "#d98200";
const REAR: &str = "#d4307c";
const OTHERS: [&str; 6] = [FRONT, REAR, "#4f9a1f", "#7b4fd0", "#149a94", "#8f7f3f"];

/// The colour of an actor by its place in the cast.
fn colour(place: usize, ego: usize) -> &'static str {
    if place == ego {
        return EGO;
    }
    let others_before = if place > ego { place - 1 } else { place };
    OTHERS[others_before % OTHERS.len()]
}

#[cfg(test)]
mod tests;
