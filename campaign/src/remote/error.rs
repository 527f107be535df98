//! Why samples cannot run on other machines.

use std::path::PathBuf;

use closecall_simulation::controller::native::NativeError;

use crate::folder::FolderError;
use crate::plan_error::PlanError;
use crate::saved_error::SavedError;

/// The reason for which samples cannot run elsewhere.
#[derive(Debug, thiserror::Error)]
pub enum RemoteError {
    /// The program has no engine.
    #[error(
        "failed to run on Ray: this program was built without Python. Install the Python package, whose command `closecall` \
         can: pip install \"closecall[ray]\""
    )]
    NoEngine,
    /// The engine has failed.
    #[error("failed to run on Ray: {0}")]
    Engine(#[from] EngineError),
    /// A file that is to be shipped cannot be read, or one that was shipped cannot be written.
    #[error("failed to ship {}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// The manifest cannot be read.
    #[error("failed to read the manifest: {0}")]
    Manifest(#[from] serde_json::Error),
    /// The machine has another version of the program.
    #[error(
        "the campaign was started by Closecall {there}, and this machine has {here}: install the same wheel on both"
    )]
    Version {
        /// The version that has started the campaign.
        there: String,
        /// The version of this machine.
        here: String,
    },
    /// The machine would run another campaign.
    #[error("this machine would not run the same campaign:\n  {}", differences.join("\n  "))]
    Different {
        /// What differs, one message for each difference.
        differences: Vec<String>,
    },
    /// The scenarios of the manifest cannot form a campaign.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// A scenario of the manifest cannot be used.
    #[error(transparent)]
    Saved(#[from] SavedError),
    /// A controller cannot be used there.
    #[error(transparent)]
    Controller(#[from] NativeError),
    /// A model cannot be read.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// There is no such block.
    #[error("the campaign has no scenario {work} with these samples")]
    NoBlock {
        /// The index of the scenario.
        work: usize,
    },
    /// A machine answered something that does not belong to the block.
    #[error(
        "failed to use the results of block {block} of `{scenario}` ({samples} samples from {first} on): {message}"
    )]
    Answer {
        /// The block.
        block: u64,
        /// The scenario.
        scenario: String,
        /// Number of its samples.
        samples: usize,
        /// The first sample of the block.
        first: u64,
        /// What is wrong.
        message: String,
    },
    /// A block was answered that was not submitted, or twice.
    #[error("the cluster has answered block {block}, which is not awaited")]
    NotAwaited {
        /// The block.
        block: u64,
    },
}

impl RemoteError {
    /// Returns true if the given files or controllers cannot be used as they are. Otherwise
    /// something has failed.
    pub const fn is_input(&self) -> bool {
        match self {
            Self::Engine(error) => error.is_input,
            Self::File { .. } | Self::Answer { .. } | Self::NotAwaited { .. } => false,
            Self::NoEngine
            | Self::Manifest(_)
            | Self::Version { .. }
            | Self::Different { .. }
            | Self::Plan(_)
            | Self::Controller(_)
            | Self::Saved(_)
            | Self::Folder(_)
            | Self::NoBlock { .. } => true,
        }
    }
}

/// An error of an engine.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct EngineError {
    /// The failure.
    pub message: String,
    /// True if the cluster cannot be used as it is: another version of the program, a missing file.
    /// False if it has failed.
    pub is_input: bool,
}
