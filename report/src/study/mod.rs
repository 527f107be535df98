//! Output of studies that vary a scenario: sensitivity studies and frontiers.
//!
//! ```text
//!  Sensitivity ─▶ text │ sensitivity.json │ tornado-{output}.svg │ sensitivity.html
//!  Frontier    ─▶ text │ frontier.json    │ frontier-{…}.svg     │ frontier.html
//! ```

mod aligned;
mod files;
mod frontier;
mod sensitivity;
mod tornado;

pub use files::{Study, write_study};
