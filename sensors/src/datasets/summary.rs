//! The content of a rendered data set, or the reason why it cannot be written.

use closecall_traffic::ConfigError;
use serde::Serialize;

/// The summary of a written data set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct DatasetSummary {
    /// Number of random scenes.
    pub scenes: u32,
    /// Number of images or crops.
    pub pictures: usize,
    /// Number of labels of each class: car, truck, motorcycle, background.
    pub labels: [usize; 4],
}

/// The reason why a data set cannot be written. Every file in the folder is complete, from this run
/// or from an earlier one, except that a temporary file may remain.
#[derive(Debug, thiserror::Error)]
pub enum DatasetError {
    /// A file could not be written.
    #[error("failed to write {path}: {source}")]
    Write {
        /// The file.
        path: std::path::PathBuf,
        /// The reason that the system gives.
        source: std::io::Error,
    },
    /// An image could not be encoded.
    #[error("failed to encode {path}: {source}")]
    Encode {
        /// The file.
        path: std::path::PathBuf,
        /// The reason that the encoder gives.
        source: png::EncodingError,
    },
    /// The annotations could not be encoded.
    #[error("failed to encode the annotations: {0}")]
    Annotations(#[from] serde_json::Error),
    /// A random scene fails the checks that also apply to scenario files.
    #[error("failed to set up a random scene: {0}")]
    Scene(#[from] ConfigError),
    /// The fixed name of the random streams is invalid.
    #[error("failed to name the random stream: {0}")]
    Stream(#[from] closecall_traffic::InvalidActorId),
}
