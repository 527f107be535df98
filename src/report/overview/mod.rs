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
mod margins;
mod pairs;
mod sample;
mod scenario;

#[cfg(test)]
mod tests;

use closecall_traffic::ActorId;

use crate::campaign::record::Record;
use crate::scenario::ScenarioFile;

pub use axis::Axis;
pub use margins::{BINS, MARGINS, MarginBins, MarginKind};
pub use pairs::{CELLS, PairBins};
pub use sample::{Fate, Point, WorstSample};
pub use scenario::{ArmTotals, ErrorKind, ScenarioOverview};

/// What a report shows of a campaign.
#[derive(Clone, Debug)]
pub struct Overview {
    /// The scenarios, in their order.
    pub scenarios: Vec<ScenarioOverview>,
}

impl Overview {
    /// Nothing yet. `files` are the scenarios, `arms` the names of the controllers, the one under test last.
    pub fn new<'a>(files: impl IntoIterator<Item = &'a ScenarioFile>, arms: &[String]) -> Self {
        let scenario = |file: &ScenarioFile| {
            let ego: Option<ActorId> = file.ego_id().cloned();
            ego.map(|ego| ScenarioOverview::new(&file.config().name, ego, file.space(), arms))
        };
        Self { scenarios: files.into_iter().filter_map(scenario).collect() }
    }

    /// Takes in one record.
    pub fn take(&mut self, record: &Record) {
        if let Some(scenario) = self.scenarios.iter_mut().find(|scenario| scenario.name == record.scenario) {
            scenario.take(record);
        }
    }
}
