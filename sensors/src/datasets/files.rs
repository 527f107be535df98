//! Atomic file output: a file is written under a temporary name in the same folder, and then
//! renamed.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

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
        let path = self.folder.join(name);
        let partial = self.folder.join(format!("{name}.partial"));
        let written = fs::File::create(&partial)
            .and_then(|mut file| file.write_all(bytes).and_then(|()| file.sync_all()))
            .and_then(|()| fs::rename(&partial, &path));
        written.map_err(|source| DatasetError::Write { path, source })
    }

    /// Writes an image as a PNG file.
    pub(super) fn png(&self, name: &str, image: &Image) -> Result<(), DatasetError> {
        let bytes = image.png().map_err(|source| DatasetError::Encode { path: self.folder.join(name), source })?;
        self.write(name, &bytes)
    }
}
