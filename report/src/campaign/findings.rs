//! All that the reports for people are made of.

use std::collections::BTreeMap;

use super::overview::Overview;
use super::requirements::Requirement;
use super::timings::Timing;
use closecall_campaign::manifest::Manifest;
use closecall_campaign::summary::Summary;
use closecall_campaign::verdict::Judgement;
use closecall_simulation::scenario::ScenarioFile;

/// Recorded samples: (scenario, sample, controller) to the path of the Rerun file, relative to the campaign's folder.
pub type Recordings = BTreeMap<(String, u64, String), String>;

/// What came of a campaign.
#[derive(Clone, Copy, Debug)]
pub struct Findings<'a> {
    /// How it was made.
    pub manifest: &'a Manifest,
    /// Its scenarios.
    pub files: &'a [&'a ScenarioFile],
    /// The counts.
    pub summary: &'a Summary,
    /// The verdict.
    pub judged: &'a Judgement,
    /// The requirements that the scenarios name.
    pub requirements: &'a [Requirement],
    /// Distributions, maps, the worst samples.
    pub overview: &'a Overview,
    /// What was recorded.
    pub recordings: &'a Recordings,
    /// The page that shows the recordings, where there is one, relative to the campaign's folder.
    pub gallery: Option<&'a str>,
    /// The samples that cost most, the costliest first.
    pub slowest: &'a [Timing],
}

impl Findings<'_> {
    /// The recording of a sample, in whichever arm it was made.
    pub(super) fn recording(&self, scenario: &str, sample: u64) -> Option<&str> {
        let from = (scenario.to_owned(), sample, String::new());
        let of_sample = |key: &(String, u64, String)| key.0 == scenario && key.1 == sample;
        self.recordings.range(from..).take_while(|(key, _)| of_sample(key)).last().map(|(_, path)| path.as_str())
    }

    /// The command that runs a sample again, from within the campaign's folder.
    pub(super) fn replay(&self, scenario: &str, sample: u64) -> String {
        let named = if self.files.len() > 1 { format!(" --scenario {scenario}") } else { String::new() };
        format!("closecall replay . {sample}{named} --record sample-{sample}.rrd")
    }
}
