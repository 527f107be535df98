//! Coverage: which parts of a scenario's parameters, measured quantities and operational design
//! domain (ODD) its samples reach.
//!
//! ```text
//!  [coverage.item.NAME]   a parameter, a measure or an ODD attribute ─▶ bins
//!  [coverage.cross.NAME]  several items ─▶ one bin for each combination of theirs
//! ```
//!
//! A bin is covered if enough samples hit it. What is covered says what was tried, and nothing of
//! how often it happens on roads.

mod config;
mod name;
mod odd;
mod plan;

pub use config::{CoverageConfig, CrossConfig, ItemConfig};
pub use name::CoverageName;
pub use odd::{OddAttribute, Surroundings};
pub use plan::{Bin, CoveragePlan, Item, Target};
