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

use crate::run::film::Frame;

pub(crate) use card::{card, incident};
pub use encounter::encounter;
pub use picture::{PictureError, PictureFile, parse_width_mm};
pub(crate) use scrubber::scrubber;
pub use still::still;
pub(crate) use timeline::timeline;

/// Returns whether a curve goes over to another vehicle. A vehicle in the path of the ego, and not
/// yet in its lane, is no other one.
pub(in crate::run) fn is_another(last: Option<usize>, now: Option<usize>) -> bool {
    matches!((last, now), (Some(last), Some(now)) if last != now)
}

/// Returns the points of a curve over time (s). It is interrupted where `value` has none, and where
/// another `vehicle` begins.
fn points_over_time(
    frames: &[Frame],
    vehicle: impl Fn(&Frame) -> Option<usize>,
    value: impl Fn(&Frame) -> Option<f64>,
) -> Vec<(f64, Option<f64>)> {
    let mut points = Vec::with_capacity(frames.len());
    let mut last = None;
    for frame in frames {
        let now = vehicle(frame);
        if is_another(last, now) {
            points.push((frame.time.s(), None));
        }
        points.push((frame.time.s(), value(frame)));
        last = now;
    }
    points
}

#[cfg(test)]
mod tests;
