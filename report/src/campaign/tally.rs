//! The single pass over a campaign's journal that feeds both the verdict and the reports.

use std::sync::Arc;

use closecall_campaign::execution::Campaign;
use closecall_campaign::gate::{GateSet, Judge};
use closecall_campaign::record::Record;
use closecall_campaign::runner::Work;
use closecall_campaign::saved::{SavedCampaign, SavedError};
use closecall_campaign::summary::Summary;
use closecall_campaign::verdict::{Allowed, Judgement, judge};

use super::overview::Overview;

/// The counts of a campaign, and the further data of its reports.
#[derive(Clone, Debug)]
pub struct Tally {
    /// The counts that the gates judge.
    pub summary: Summary,
    /// The evidence for gates, requirements and expectations.
    pub judge: Judge,
    /// Distributions, maps and the worst samples.
    pub overview: Overview,
    allowed: Allowed,
}

impl Tally {
    /// Returns a tally without samples, to be judged by `gates`.
    pub fn new(campaign: &Campaign, gates: &GateSet) -> Self {
        Self::with(campaign.summary(), &campaign.works, gates)
    }

    /// Returns the tally of every record in a campaign's journal, to be judged by `gates`.
    ///
    /// # Errors
    /// [`SavedError`] if the journal cannot be read.
    pub fn of(saved: &SavedCampaign, works: &[Arc<Work>], gates: &GateSet) -> Result<Self, SavedError> {
        let mut tally = Self::with(Summary::of(works).with_inference(saved.manifest().inference), works, gates);
        for record in saved.folder().records()? {
            tally.push(&record?);
        }
        Ok(tally)
    }

    fn with(summary: Summary, works: &[Arc<Work>], gates: &GateSet) -> Self {
        let judge = Judge::new(works, gates, summary.inference);
        let overview = Overview::new(works.iter().map(|work| &work.file), &summary.controllers);
        Self { summary, judge, overview, allowed: gates.into() }
    }

    /// Adds a journal record.
    pub fn push(&mut self, record: &Record) {
        self.summary.push(record);
        self.judge.push(record);
        self.overview.push(record);
    }

    /// Returns the judgement of the records so far.
    pub fn judgement(&self) -> Judgement {
        judge(&self.summary, &self.judge, self.allowed)
    }
}
