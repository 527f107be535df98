//! Why a recording cannot be written.

use rerun::RecordingStreamError;

use closecall_traffic::atomic::WriteError;

/// The reason why a recording cannot be written. A file of that name is then unchanged.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The environment switches recording off. The library would then write no file and report no
    /// error.
    #[error("failed to record: the environment variable RERUN switches recording off; unset it")]
    Disabled,
    /// The library reports an error.
    #[error("failed to record: {0}")]
    Stream(#[from] RecordingStreamError),
    /// The messages cannot be encoded.
    #[error("failed to encode the recording: {reason}")]
    Encode {
        /// The reason that the library gives.
        reason: String,
    },
    /// A viewer does not take the recording.
    #[error("failed to send the recording to the viewer: {reason}")]
    Send {
        /// The reason that the library gives.
        reason: String,
    },
    /// The file cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

impl RecordingError {
    /// Returns the error for a reason that the library gives while encoding.
    pub(super) fn encode(reason: impl std::fmt::Display) -> Self {
        Self::Encode { reason: reason.to_string() }
    }

    /// Returns the error for a reason that the library gives while sending.
    pub(super) fn send(reason: impl std::fmt::Display) -> Self {
        Self::Send { reason: reason.to_string() }
    }
}
