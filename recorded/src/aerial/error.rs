//! Reasons why the aerial acquisition fails.

use std::path::PathBuf;

use closecall_sensors::camera::ClassifierError;
use closecall_traffic::atomic::WriteError;

/// The reason why the aerial acquisition fails.
#[derive(Debug, thiserror::Error)]
pub enum AerialError {
    /// A folder could not be created.
    #[error("failed to create the folder {path}: {source}")]
    Folder {
        /// The folder.
        path: PathBuf,
        /// The reason that the system gives.
        source: std::io::Error,
    },
    /// A file could not be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// An image could not be encoded.
    #[error("failed to encode {path}: {source}")]
    Encode {
        /// The file.
        path: PathBuf,
        /// The reason that the encoder gives.
        source: png::EncodingError,
    },
    /// The pose of a camera could not be encoded.
    #[error("failed to encode the pose of the camera: {0}")]
    Pose(#[from] serde_json::Error),
    /// The fixed name of the random streams is invalid.
    #[error("failed to name the random stream: {0}")]
    Stream(#[from] closecall_traffic::InvalidActorId),
    /// The detector cannot be set up or run.
    #[error("failed to run the aerial detector: {0}")]
    Network(#[from] ClassifierError),
    /// The output of the detector has another shape than expected.
    #[error("failed to read the output of the aerial detector: shape {actual:?} instead of {expected:?}")]
    Output {
        /// The shape of the output.
        actual: Vec<usize>,
        /// The expected shape.
        expected: [usize; 4],
    },
    /// An option is out of its range.
    #[error("failed to set up the aerial camera: `{option}` is {value}, which is not {allowed}")]
    Option {
        /// Name of the option.
        option: &'static str,
        /// The value.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// The traffic has nothing to watch.
    #[error("failed to watch {name}: {reason}")]
    Traffic {
        /// Name of the trajectory data.
        name: String,
        /// The reason.
        reason: String,
    },
}
