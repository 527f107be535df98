//! A campaign's folder: made before any work is done, complete when it is over.
//!
//! ```text
//!  manifest.json      how it was made: all that a replay needs
//!  journal.jsonl      one line per sample, appended and synced block by block as results come
//!  outcomes.parquet   written from the journal, byte-identical however it was computed
//!  timings.parquet    wall times, apart, since they differ from run to run
//!  junit.xml          one case per sample and controller
//!  recordings/        Rerun files of failing samples
//! ```

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufRead, BufReader, Write};
use std::path::{Path, PathBuf};

use super::manifest::Manifest;
use super::record::Record;
use crate::report::{WriteError, write_atomically};

const MANIFEST: &str = "manifest.json";
const JOURNAL: &str = "journal.jsonl";

/// A campaign's folder that cannot be used. Nothing in it has been changed.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// Something cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// Something cannot be read.
    #[error("failed to read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// The folder holds the results of another campaign.
    #[error("failed to use {}: it holds the results of another campaign; name another folder, or delete this one", path.display())]
    OtherCampaign {
        /// The folder.
        path: PathBuf,
    },
    /// The folder holds something that is no campaign.
    #[error("failed to use {}: it is not empty and holds no campaign; name a new folder", path.display())]
    NotACampaign {
        /// The folder.
        path: PathBuf,
    },
    /// A file of the folder has content that this program did not write.
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

/// A campaign's folder.
#[derive(Clone, Debug)]
pub struct Folder {
    path: PathBuf,
}

impl Folder {
    /// The folder of a campaign that is there.
    pub fn open(path: &Path) -> Self {
        Self { path: path.to_owned() }
    }

    /// Makes the folder, or takes one that holds the very same campaign, and writes its manifest.
    ///
    /// # Errors
    /// [`FolderError`] where it cannot be written, or holds something else.
    pub fn create(path: &Path, manifest: &Manifest) -> Result<Self, FolderError> {
        let folder = Self::open(path);
        let fail = |source| WriteError::new(path, source);
        fs::create_dir_all(path).map_err(fail)?;
        let is_empty = fs::read_dir(path).map_err(fail)?.next().is_none();
        if !is_empty {
            match folder.manifest() {
                Ok(earlier) if earlier.has_same_outcomes(manifest) => {}
                Ok(_) => return Err(FolderError::OtherCampaign { path: path.to_owned() }),
                Err(FolderError::Content { .. }) => return Err(FolderError::OtherCampaign { path: path.to_owned() }),
                Err(_) => return Err(FolderError::NotACampaign { path: path.to_owned() }),
            }
        }
        write_atomically(&folder.file(MANIFEST), |file| {
            serde_json::to_writer_pretty(&mut *file, manifest)?;
            file.write_all(b"\n")
        })?;
        Ok(folder)
    }

    /// The path of one of its files.
    pub fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// How the campaign was made.
    ///
    /// # Errors
    /// [`FolderError`] where there is no manifest, or it is not one.
    pub fn manifest(&self) -> Result<Manifest, FolderError> {
        let path = self.file(MANIFEST);
        let text = fs::read_to_string(&path).map_err(|source| FolderError::Read { path: path.clone(), source })?;
        serde_json::from_str(&text).map_err(|error| FolderError::Content {
            path,
            line: error.line(),
            message: error.to_string(),
        })
    }

    /// An empty journal to append to.
    ///
    /// # Errors
    /// [`FolderError::Write`] where it cannot be made.
    pub fn new_journal(&self) -> Result<Journal, FolderError> {
        let path = self.file(JOURNAL);
        let file = OpenOptions::new().create(true).write(true).truncate(true).open(&path);
        Ok(Journal { file: file.map_err(|source| WriteError::new(&path, source))?, path, unsynced: 0 })
    }

    /// The records of the journal, in their order.
    ///
    /// # Errors
    /// [`FolderError`] where it cannot be read; each record is an error of its own where its line is not one.
    pub fn records(&self) -> Result<impl Iterator<Item = Result<Record, FolderError>> + use<>, FolderError> {
        let path = self.file(JOURNAL);
        let file = File::open(&path).map_err(|source| FolderError::Read { path: path.clone(), source })?;
        Ok(BufReader::new(file).lines().enumerate().map(move |(place, line)| {
            let line = line.map_err(|source| FolderError::Read { path: path.clone(), source })?;
            serde_json::from_str(&line).map_err(|error| FolderError::Content {
                path: path.clone(),
                line: place + 1,
                message: error.to_string(),
            })
        }))
    }
}

/// Samples between two syncs to the disk.
const SYNC_EVERY: usize = 64;

/// The results of a campaign as they come, on disk.
pub struct Journal {
    file: File,
    path: PathBuf,
    unsynced: usize,
}

impl Journal {
    /// Appends one record.
    ///
    /// # Errors
    /// [`WriteError`] where the disk does not take it.
    pub fn append(&mut self, record: &Record) -> Result<(), WriteError> {
        let fail = |source| WriteError::new(&self.path, source);
        let mut line = serde_json::to_vec(record).map_err(|error| fail(error.into()))?;
        line.push(b'\n');
        self.file.write_all(&line).map_err(fail)?;
        self.unsynced += 1;
        if self.unsynced >= SYNC_EVERY { self.sync() } else { Ok(()) }
    }

    /// Has the disk keep what was appended.
    ///
    /// # Errors
    /// [`WriteError`] where it does not.
    pub fn sync(&mut self) -> Result<(), WriteError> {
        self.unsynced = 0;
        self.file.sync_data().map_err(|source| WriteError::new(&self.path, source))
    }
}
