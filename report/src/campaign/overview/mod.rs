//! What a report shows of a campaign, gathered record by record in memory that does not grow with their number.
//!
//! ```text
//!  records ─▶ counts by arm             (JUnit's totals)
//!          ─▶ bins of every margin      (distributions)
//!          ─▶ bins of every parameter and pair of parameters (coverage, outcome map)
//!          ─▶ a few samples drawn evenly (points of the map)
//!          ─▶ the worst samples, the first errors
//! ```

mod axis;
mod gathered;
mod margins;
mod pairs;
mod sample;
mod scenario;

#[cfg(test)]
mod tests;

pub use axis::Axis;
pub use gathered::Overview;
pub use margins::{BINS, MARGINS, MarginBins, MarginKind};
pub use pairs::{CELLS, PairBins};
pub use sample::{Fate, Point, WorstSample};
pub use scenario::{ArmTotals, ErrorKind, ScenarioOverview};
