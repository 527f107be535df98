//! The data of the reports for people.

use std::collections::BTreeMap;

use super::overview::Overview;
use super::recordings::Still;
use super::timings::Timing;
use closecall_campaign::action::{Action, CommandFor, Replay, SavedSample};
use closecall_campaign::folder::Folder;
use closecall_campaign::manifest::Manifest;
use closecall_campaign::summary::Summary;
use closecall_campaign::verdict::Judgement;
use closecall_scenarios::ScenarioFile;

/// The recordings of samples: (scenario, sample, controller) to the path of the Rerun file,
/// relative to the campaign's folder.
pub type Recordings = BTreeMap<(String, u64, String), String>;

/// The results of a campaign.
#[derive(Clone, Copy, Debug)]
pub struct Findings<'a> {
    /// How the campaign was made.
    pub manifest: &'a Manifest,
    /// The scenario files.
    pub files: &'a [&'a ScenarioFile],
    /// The counts.
    pub summary: &'a Summary,
    /// The verdict.
    pub judged: &'a Judgement,
    /// Distributions, maps and the worst samples.
    pub overview: &'a Overview,
    /// The recorded samples.
    pub recordings: &'a Recordings,
    /// Pictures of the recorded samples: the worst of each kind first.
    pub stills: &'a [Still],
    /// The page of the recordings, relative to the campaign's folder, if there is one.
    pub gallery: Option<&'a str>,
    /// The campaign's folder, if there is one.
    pub folder: Option<&'a Folder>,
    /// The samples with the longest wall times, in falling order.
    pub slowest: &'a [Timing],
    /// The commands for readers to copy.
    pub command_for: CommandFor,
}

/// Largest number of pictures in a report.
const STILLS: usize = 3;
/// Largest number of scenarios that a title names.
const TITLED: usize = 3;
/// Largest number of scenarios up to which the first screen has each of them.
const FEW: usize = 6;

impl<'a> Findings<'a> {
    /// Returns the names of the scenarios, as a list.
    pub(super) fn scenario_names(&self) -> String {
        self.files.iter().map(|file| file.config().name.as_str()).collect::<Vec<_>>().join(", ")
    }

    /// Returns the scenarios as a title: their names, or their number if they are more than a few.
    pub(super) fn scenarios_title(&self) -> String {
        if self.names_each() { self.scenario_names() } else { format!("{} scenarios", self.files.len()) }
    }

    /// Returns true if a title names each scenario.
    pub(super) fn names_each(&self) -> bool {
        self.files.len() <= TITLED
    }

    /// Returns true if there are more scenarios than the first screen has room for.
    pub(super) fn has_many(&self) -> bool {
        self.overview.scenarios.len() > FEW
    }

    /// Returns the recording of a sample, in any arm. If arms have recordings of their own, the
    /// last one is returned.
    pub(super) fn recording(&self, scenario: &str, sample: u64) -> Option<&'a str> {
        let from = (scenario.to_owned(), sample, String::new());
        let of_sample = |key: &(String, u64, String)| key.0 == scenario && key.1 == sample;
        self.recordings.range(from..).take_while(|(key, _)| of_sample(key)).last().map(|(_, path)| path.as_str())
    }

    /// Returns the pictures of the worst samples, failures first, each with the path of its
    /// recording.
    pub(super) fn worst_stills(&self) -> Vec<(&'a Still, &'a str)> {
        let mut stills: Vec<&Still> = self.stills.iter().collect();
        stills.sort_by_key(|still| !still.is_failure());
        let with_path = |still: &'a Still| Some((still, self.recording(&still.scenario, still.sample)?));
        stills.into_iter().filter_map(with_path).take(STILLS).collect()
    }

    /// Returns the command that runs a sample again, from within the campaign's folder.
    pub(super) fn replay(&self, scenario: &str, sample: u64) -> String {
        let saved_sample = SavedSample { folder: ".", sample, scenario: (self.files.len() > 1).then_some(scenario) };
        let recording = format!("../sample-{sample}.rrd");
        (self.command_for)(&Action::Replay(Replay { recording: Some(&recording), ..Replay::new(saved_sample) }))
    }
}
