//! Why the sampling of a rare event has no result.

use closecall_traffic::atomic::WriteError;

use crate::campaign_error::{CampaignError, WorkersError};
use crate::folder::FolderError;

/// The reason for which a rare event has no result.
#[derive(Debug, thiserror::Error)]
pub enum RareError {
    /// The folder or the workers cannot be used.
    #[error(transparent)]
    Campaign(#[from] CampaignError),
    /// No parameter varies, so that no event is rarer than another.
    #[error("no parameter of `{scenario}` varies: there is no probability to estimate")]
    NothingVaries {
        /// The scenario.
        scenario: String,
    },
    /// A part of a campaign has run its share of the last runs.
    #[error("a part of a campaign has no estimate of its own: `closecall tool merge` makes it of all parts")]
    PartEnds {
        /// Number of runs of the scenario that the part holds.
        runs: u64,
    },
    /// A closed journal lacks a run.
    #[error("run {run} of `{scenario}` is missing: a part has not run to its end; resume it first")]
    MissingRun {
        /// The scenario.
        scenario: String,
        /// The number of the run.
        run: u64,
    },
    /// A request from outside has ended the runs.
    #[error("the runs were stopped")]
    Stopped,
}

impl From<FolderError> for RareError {
    fn from(error: FolderError) -> Self {
        CampaignError::from(error).into()
    }
}

impl From<WriteError> for RareError {
    fn from(error: WriteError) -> Self {
        CampaignError::from(error).into()
    }
}

impl From<WorkersError> for RareError {
    fn from(error: WorkersError) -> Self {
        CampaignError::from(error).into()
    }
}
