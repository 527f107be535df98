//! The single pass over a campaign's journal that feeds both the verdict and the reports.

use std::sync::Arc;

use closecall_campaign::execution::Campaign;
use closecall_campaign::record::Record;
use closecall_campaign::runner::Work;
use closecall_campaign::saved::{SavedCampaign, SavedError};
use closecall_campaign::summary::Summary;

use super::overview::Overview;

/// The counts of a campaign, and what its reports show beside them.
#[derive(Clone, Debug)]
pub struct Tally {
    /// The counts that the gates judge.
    pub summary: Summary,
    /// Distributions, maps and the worst samples.
    pub overview: Overview,
}

impl Tally {
    /// Returns a tally without samples.
    pub fn new(campaign: &Campaign) -> Self {
        Self::with(campaign.summary(), &campaign.works)
    }

    /// Returns the tally of every record in a campaign's journal.
    ///
    /// # Errors
    /// [`SavedError`] if the journal cannot be read.
    pub fn of(saved: &SavedCampaign, works: &[Arc<Work>]) -> Result<Self, SavedError> {
        let mut tally = Self::with(Summary::of(works).with_inference(saved.manifest().inference), works);
        for record in saved.folder().records()? {
            tally.push(&record?);
        }
        Ok(tally)
    }

    fn with(summary: Summary, works: &[Arc<Work>]) -> Self {
        let overview = Overview::new(works.iter().map(|work| &work.file), &summary.controllers);
        Self { summary, overview }
    }

    /// Adds a journal record.
    pub fn push(&mut self, record: &Record) {
        self.summary.push(record);
        self.overview.push(record);
    }
}
