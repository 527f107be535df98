//! Why a saved campaign cannot fulfil a request.

use std::path::PathBuf;

use closecall_scenarios::ScenarioError;
use closecall_simulation::SampleError;

use crate::folder_error::FolderError;

/// The reason for which a saved campaign cannot provide what was requested.
#[derive(Debug, thiserror::Error)]
pub enum SavedError {
    /// The folder cannot be used.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// A scenario of the manifest cannot be used.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// The campaign has several scenarios, and none was named.
    #[error("the campaign has several scenarios; name one of {}", names.join(", "))]
    ScenarioNotNamed {
        /// The names to choose from.
        names: Vec<String>,
    },
    /// The campaign has no scenario of that name.
    #[error("the campaign has no scenario `{name}`, only {}", names.join(", "))]
    UnknownScenario {
        /// The requested name.
        name: String,
        /// The names to choose from.
        names: Vec<String>,
    },
    /// The campaign has no sample with that number.
    #[error("there is no sample {sample}: the campaign has samples 0 to {last}")]
    UnknownSample {
        /// The requested number.
        sample: u64,
        /// The largest number.
        last: u64,
    },
    /// The campaign was not run with that controller.
    #[error("the campaign was not run with `{name}`, only with {}", names.join(", "))]
    UnknownArm {
        /// The requested name.
        name: String,
        /// The names to choose from.
        names: Vec<String>,
    },
    /// The folder was written on another machine or by another user, and names code that would run.
    #[error(
        "{} was written by another user or on another machine, and its controllers would run with your rights:\n  {}\nthey run only \
         if you trust the folder",
        path.display(),
        commands.join("\n  ")
    )]
    NotTrusted {
        /// The folder.
        path: PathBuf,
        /// The commands, libraries and FMUs, and the folder in which they run.
        commands: Vec<String>,
    },
    /// The sampled values of a sample contradict each other.
    #[error("failed to run sample {sample}: {source}")]
    Sample {
        /// The sample.
        sample: u64,
        /// The reason for which the sample has no concrete scenario.
        source: SampleError,
    },
}
