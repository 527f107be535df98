//! Output of studies that vary a scenario: sensitivity studies, frontiers, boundaries, and the
//! study against crash records.
//!
//! ```text
//!  Sensitivity ─▶ text │ sensitivity.json │ tornado-{output}.svg │ sensitivity.html
//!  Frontier    ─▶ text │ frontier.json    │ frontier-{…}.svg     │ frontier.html
//!  Boundary    ─▶ text │ boundary.json    │ boundary-map.svg     │ boundary.html
//!  Anchor      ─▶ text │ anchor.json      │ anchor-ratios.svg    │ anchor.html
//!  Map         ─▶ csv  │ map.json         │ map-{…}-s.svg        │ map.html
//! ```

mod aligned;
mod anchor;
mod boundary;
mod files;
mod frontier;
mod map;
mod sensitivity;
mod tornado;

pub use files::{Study, write_study};
pub use map::write_map;
