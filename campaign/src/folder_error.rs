//! Why a campaign's folder cannot be used.

use std::io;
use std::path::PathBuf;

use closecall_traffic::atomic::WriteError;

use crate::partition::Partition;

/// Largest number of differences that a message lists.
const MOST_DIFFERENCES: usize = 12;

/// Lists differences, one per line. A last line counts those that are left out.
pub fn listed(differences: &[String]) -> String {
    let mut lines = differences.iter().take(MOST_DIFFERENCES).cloned().collect::<Vec<_>>();
    if let Some(more) = differences.len().checked_sub(MOST_DIFFERENCES).filter(|more| *more > 0) {
        lines.push(format!("and {more} more"));
    }
    lines.join("\n  ")
}

/// Returns what is wrong with a text that is not the JSON of a file.
pub(crate) fn json_fault(text: &str, error: &serde_json::Error) -> String {
    if text.trim().is_empty() { "it is empty".to_owned() } else { error.to_string() }
}

/// The reason for which a campaign's folder cannot be used. The folder is unchanged.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// A file cannot be read.
    #[error("failed to read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
    /// The folder already holds this campaign, and nobody asked to resume it.
    #[error(
        "failed to use {}: it already holds this campaign, and nothing is overwritten; resume it, name another folder, or delete this one",
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
        listed(differences)
    )]
    OtherCampaign {
        /// The folder.
        path: PathBuf,
        /// What differs, one message for each difference.
        differences: Vec<String>,
    },
    /// The folder is not empty, and does not hold a campaign of this kind.
    #[error("failed to use {}: it is not empty and does not hold a campaign of this kind; name a new folder", path.display())]
    NotACampaign {
        /// The folder.
        path: PathBuf,
    },
    /// The folder holds the weighted runs of a rare event. No command treats them as independent
    /// samples.
    #[error(
        "failed to use {}: it holds a campaign that samples a rare event; its runs are weighted and not independent samples: its result is \
         in {}",
        path.display(),
        path.join(crate::rare::RESULT).display()
    )]
    RareEvent {
        /// The folder.
        path: PathBuf,
    },
    /// Something that is not the result of a campaign lies where results belong.
    #[error("failed to use {}: {reason}; nothing is overwritten, moved or removed", path.display())]
    Foreign {
        /// The path.
        path: PathBuf,
        /// The content of the path.
        reason: String,
    },
    /// Another program has locked the folder.
    #[error("failed to use {}: another campaign is running in it ({holder})", path.display())]
    Busy {
        /// The folder.
        path: PathBuf,
        /// The content of the lock file: the process that holds the lock.
        holder: String,
    },
    /// The folder holds one part of a campaign.
    #[error("failed to use {}: it holds only part {part} of its campaign; merge the parts first", path.display())]
    Part {
        /// The folder.
        path: PathBuf,
        /// The part.
        part: Partition,
    },
    /// Samples of the plan are missing in the journal.
    #[error(
        "failed to use {}: it has {has} of the {planned} samples of its campaign; resume it first",
        path.display()
    )]
    Incomplete {
        /// The journal.
        path: PathBuf,
        /// Number of samples in the journal.
        has: u64,
        /// Number of samples of the plan.
        planned: u64,
    },
    /// The results cannot be believed.
    #[error("failed to use {}: the results of its campaign are INVALID:\n  {}", path.display(), listed(reasons))]
    Invalid {
        /// The folder.
        path: PathBuf,
        /// Why, one message for each reason.
        reasons: Vec<String>,
    },
    /// A file of the folder is damaged, or does not belong to the campaign.
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
