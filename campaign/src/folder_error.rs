//! What keeps a campaign's folder from being used.

use std::io;
use std::path::PathBuf;

use closecall_scenarios::atomic::WriteError;

/// A campaign's folder that cannot be used. Nothing in it has been changed.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// Something cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// Something cannot be read.
    #[error("failed to read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// The folder holds a campaign already.
    #[error(
        "failed to use {}: it holds a campaign already, and nothing of it is overwritten; go on with it with --resume, name another folder, or delete this one",
        path.display()
    )]
    AlreadyThere {
        /// The folder.
        path: PathBuf,
    },
    /// The folder holds the results of another campaign.
    #[error(
        "failed to use {}: it holds the results of another campaign; name another folder, or delete this one:\n  {}",
        path.display(),
        differences.join("\n  ")
    )]
    OtherCampaign {
        /// The folder.
        path: PathBuf,
        /// What is different there.
        differences: Vec<String>,
    },
    /// The folder holds something that is no campaign.
    #[error("failed to use {}: it is not empty and holds no campaign; name a new folder", path.display())]
    NotACampaign {
        /// The folder.
        path: PathBuf,
    },
    /// Another program is at work in the folder.
    #[error("failed to use {}: another campaign is running in it ({holder})", path.display())]
    Busy {
        /// The folder.
        path: PathBuf,
        /// Who it is.
        holder: String,
    },
    /// A file of the folder has content that this program did not write.
    #[error("failed to read {}:{line}: {message}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// The line, counted from 1.
        line: usize,
        /// What is wrong.
        message: String,
    },
}
