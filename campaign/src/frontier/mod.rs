//! The frontier of a system's settings: the collisions that each setting prevents and induces, and
//! its cost in speed.
//!
//! ```text
//!  KEY = a, b, c ┐
//!  KEY = d, e    ├▶ every combination ▶ the same samples in every arm
//!  …             ┘                      └▶ prevented, induced, speed lost ▶ Pareto-optimal ones
//! ```
//!
//! All combinations run the same samples with the same random numbers. If all keys belong to the
//! margin increase system, the baseline does not depend on them and runs once.

mod plan;
mod result;

pub use plan::{FrontierPlan, Grid, GridError};
pub use result::{Frontier, Point};
