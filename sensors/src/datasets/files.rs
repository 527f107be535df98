//! Atomic file output into a folder.

use std::fs;
use std::path::{Path, PathBuf};

use closecall_traffic::atomic::write_file;

use super::DatasetError;
use crate::camera::Image;

/// The folder that receives the files.
pub(super) struct Output {
    folder: PathBuf,
}

impl Output {
    pub(super) fn new(folder: &Path) -> Result<Self, DatasetError> {
        fs::create_dir_all(folder).map_err(|source| DatasetError::Write { path: folder.to_owned(), source })?;
        Ok(Self { folder: folder.to_owned() })
    }

    /// Writes one file atomically.
    pub(super) fn write(&self, name: &str, bytes: &[u8]) -> Result<(), DatasetError> {
        let written = write_file(&self.folder.join(name), |file| file.write_all(bytes));
        written.map_err(|error| DatasetError::Write { path: error.path, source: error.source })
    }

    /// Writes an image as a PNG file.
    pub(super) fn png(&self, name: &str, image: &Image) -> Result<(), DatasetError> {
        let bytes = image.png().map_err(|source| DatasetError::Encode { path: self.folder.join(name), source })?;
        self.write(name, &bytes)
    }
}
