//! Why a report cannot be made.

use closecall_campaign::failure::FailureKind;
use closecall_campaign::folder::FolderError;
use closecall_campaign::saved::SavedError;
use closecall_simulation::SampleError;
use closecall_traffic::atomic::WriteError;

use crate::run::rerun::RecordingError;

/// A report that cannot be made. The journal stays as it is.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The folder cannot be read.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// The saved campaign cannot be read back.
    #[error(transparent)]
    Saved(#[from] SavedError),
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// A recording cannot be written.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A sample that had an outcome has none when it is run again for its recording.
    #[error("failed to run sample {sample}: {source}")]
    Sample {
        /// The sample's number.
        sample: u64,
        /// Why it has no outcome.
        source: SampleError,
    },
}

impl ReportError {
    /// Returns the kind of the error.
    pub fn kind(&self) -> FailureKind {
        match self {
            Self::Folder(error) => FailureKind::from(error),
            Self::Saved(error) => FailureKind::from(error),
            Self::Write(_) | Self::Recording(_) => FailureKind::Io,
            Self::Sample { .. } => FailureKind::Sample,
        }
    }
}
