//! The data of a report beside the counts. It is gathered from the journal, record by record, in an
//! amount of memory that does not depend on the number of records.
//!
//! ```text
//!  records ─▶ counts of each arm         (totals of JUnit)
//!          ─▶ bins of each margin        (distributions)
//!          ─▶ bins of each parameter and of each pair of parameters (coverage, outcome map)
//!          ─▶ counts of each event by class of each parameter (influence)
//!          ─▶ an even choice of samples  (points of the map)
//!          ─▶ the worst samples, and the first error of each kind
//! ```

mod axis;
mod gathered;
mod influence;
mod margins;
mod pairs;
mod sample;
mod scenario;

#[cfg(test)]
mod tests;

pub use axis::Axis;
pub use gathered::Overview;
pub use influence::{Event, EventInfluence, FEW_EVENTS, InfluenceCounts};
pub use margins::{BINS, MARGINS, MarginBins, MarginKind};
pub use pairs::{CELLS, PairBins};
pub use sample::{Fate, Point, WorstSample};
pub use scenario::{ArmTotals, ErrorGroup, ScenarioOverview};
