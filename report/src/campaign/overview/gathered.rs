//! The overview of all scenarios of a campaign.

use closecall_campaign::record::Record;
use closecall_scenarios::ScenarioFile;

use super::ScenarioOverview;

/// The data of a report beside the counts.
#[derive(Clone, Debug)]
pub struct Overview {
    /// The scenarios, in their order.
    pub scenarios: Vec<ScenarioOverview>,
}

impl Overview {
    /// Returns an overview without samples. `files` are the scenarios; `arms` are the names of the
    /// controllers, the one under test last.
    pub fn new<'a>(files: impl IntoIterator<Item = &'a ScenarioFile>, arms: &[String]) -> Self {
        let scenario = |file: &ScenarioFile| ScenarioOverview::new(&file.config().name, file.space(), arms);
        Self { scenarios: files.into_iter().map(scenario).collect() }
    }

    /// Adds a journal record.
    pub fn push(&mut self, record: &Record) {
        if let Some(scenario) = self.scenarios.iter_mut().find(|scenario| scenario.name == record.scenario) {
            scenario.push(record);
        }
    }
}
