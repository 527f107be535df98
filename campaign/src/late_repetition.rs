//! Runs two samples of each scenario again when the last sample of the campaign is done. Of a rare
//! event, the first run is run again.
//!
//! ```text
//!  samples:  0 1 2 … middle … last │ 0 and middle again: the same bits?
//!  checks:   ▲ ▲ few of the others │
//! ```
//!
//! The validity checks repeat a sample at once. A controller or a perception that is not built in
//! may change its answers with the time, or with what it has done before: the checks of the first
//! samples then show nothing, and a small campaign has no others. The first sample is as early as
//! these checks are. A sample that gives another outcome at the end makes the campaign INVALID.
//!
//! A repetition that ends in an error says nothing: a process may have crashed or been late.

use std::ops::ControlFlow;
use std::sync::Arc;

use super::campaign_error::CampaignError;
use super::execution::{Campaign, NextRecord};
use super::record::Record;
use super::runner::Work;
use super::validity::CheckPlan;

/// The samples of a campaign that run again at its end.
#[derive(Clone, Debug, Default)]
pub struct LateRepetition {
    /// The numbers of the samples of each scenario.
    chosen: Vec<Vec<u64>>,
    /// Their results, with the index of the scenario.
    kept: Vec<(usize, Record)>,
    /// Whether a sample has just been run.
    has_new: bool,
}

impl LateRepetition {
    /// Chooses the samples.
    pub fn new(campaign: &Campaign) -> Self {
        let chosen = |work: &Work| {
            if work.checks.is_off() || !is_foreign(work) {
                return Vec::new();
            }
            let is_in_part = |sample: &u64| campaign.partition.is_none_or(|part| part.contains(*sample));
            let next = |from: u64| (from..work.count()).find(is_in_part);
            let mut samples = vec![next(0), next(work.count() / 2)];
            samples.dedup();
            samples.into_iter().flatten().collect()
        };
        Self { chosen: campaign.works.iter().map(|work| chosen(work)).collect(), ..Self::default() }
    }

    /// Keeps the record of a chosen sample.
    pub fn observe(&mut self, next: NextRecord<'_>) {
        self.has_new |= next.is_new;
        if self.chosen.get(next.work).is_some_and(|chosen| chosen.contains(&next.record.sample)) {
            self.kept.push((next.work, next.record.clone()));
        }
    }

    /// Runs the chosen samples again, and returns what differs, in words. A campaign without new
    /// samples repeats none.
    ///
    /// # Errors
    /// [`CampaignError`] if no samples can be run.
    pub fn run(&self, campaign: &Campaign) -> Result<Vec<String>, CampaignError> {
        let mut differences = Vec::new();
        for (index, work) in campaign.works.iter().enumerate() {
            let kept: Vec<&Record> = self
                .kept
                .iter()
                .filter(|(of_work, _)| *of_work == index && self.has_new)
                .map(|(_, kept)| kept)
                .collect();
            if kept.is_empty() {
                continue;
            }
            let unchecked = Arc::new(Work { checks: CheckPlan::off(), ..Work::clone(work) });
            campaign.run_samples(index, &unchecked, kept.iter().map(|kept| kept.sample), |finished| {
                let earlier = kept.iter().find(|kept| kept.sample == finished.record.sample);
                differences.extend(earlier.into_iter().flat_map(|kept| different(kept, &finished.record)));
                Ok(ControlFlow::Continue(()))
            })?;
        }
        Ok(differences)
    }
}

/// Returns the arms of a sample that have another outcome in the second run, in words.
fn different<'a>(first: &'a Record, second: &'a Record) -> impl Iterator<Item = String> + 'a {
    first.arms.iter().zip(&second.arms).filter_map(|(arm, again)| {
        let (Ok(outcome), Ok(late)) = (&arm.result, &again.result) else { return None };
        let sample = format!("sample {}", first.sample);
        (!late.has_same_bits(outcome)).then(|| difference(&sample, &first.scenario, Some(&arm.controller)))
    })
}

/// Returns true if a controller or the perception of a scenario is not built in.
pub(crate) fn is_foreign(work: &Work) -> bool {
    work.arms.iter().any(|arm| !arm.controller.is_built_in()) || work.file.program().is_some()
}

/// Returns what a second run shows that had another outcome, in words.
pub(crate) fn difference(run: &str, scenario: &str, controller: Option<&str>) -> String {
    let with = controller.map_or_else(String::new, |controller| format!(" with {controller}"));
    format!(
        "{run} of {scenario}{with} ran again after the last one, and gave another outcome: a controller gives the same answers to the \
         same inputs, whatever the time and whatever it has done before"
    )
}
