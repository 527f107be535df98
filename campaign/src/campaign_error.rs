//! Why a campaign ends before its last sample.

use closecall_traffic::atomic::WriteError;

use super::folder::FolderError;
use super::remote::RemoteError;

/// The worker threads could not be started.
#[derive(Debug, thiserror::Error)]
#[error("failed to start {jobs} worker threads: {source}")]
pub struct WorkersError {
    /// Number of threads that were requested.
    pub jobs: usize,
    /// The error of the operating system.
    pub source: std::io::Error,
}

/// An error that ends a campaign. The journal stays usable, and the campaign can be resumed from
/// it.
#[derive(Debug, thiserror::Error)]
pub enum CampaignError {
    /// The folder cannot be used.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// Results cannot be written.
    #[error("{0}\nthe results written so far are kept: when there is room again, the campaign can be resumed")]
    Write(#[from] WriteError),
    /// The worker threads could not be started.
    #[error(transparent)]
    Workers(#[from] WorkersError),
    /// A worker process has found another controller, cannot read the controller, or is another
    /// version of this program.
    #[error("failed to go on: {reason}")]
    Refused {
        /// The reason.
        reason: String,
        /// True if something differs from the start of the campaign, false if the controller cannot
        /// be read.
        has_changed: bool,
    },
    /// The samples cannot run on other machines.
    #[error(transparent)]
    Remote(#[from] RemoteError),
}
