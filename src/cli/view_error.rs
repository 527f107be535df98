//! The reasons for which nothing can be shown.

use std::io;
use std::path::PathBuf;

use super::viewer::ViewerError;

/// The reason why nothing can be shown.
#[derive(Debug, thiserror::Error)]
pub enum ViewError {
    /// The path has no recording.
    #[error("failed to find a recording in {path}: name a file .rrd, or a folder that has such files")]
    Nothing {
        /// The path.
        path: PathBuf,
    },
    /// The file has the name of a recording, but is none.
    #[error("failed to open {path}: the file is no recording: {reason}")]
    Foreign {
        /// The path.
        path: PathBuf,
        /// The message of the library.
        reason: String,
    },
    /// The path cannot be read.
    #[error("failed to read {path}: {source}")]
    Read {
        /// The path.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
    /// The viewer shows nothing.
    #[error(transparent)]
    Viewer(#[from] ViewerError),
    /// The report cannot be opened in the browser.
    #[error("failed to open {path} in the browser: {source}")]
    Browser {
        /// The path of the report.
        path: PathBuf,
        /// The reason.
        source: opener::OpenError,
    },
    /// The explorer cannot be served.
    #[error("failed to serve the explorer on this machine: {source}")]
    Serve {
        /// The reason.
        source: io::Error,
    },
}
