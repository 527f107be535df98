//! Whether the results in a campaign's folder can be believed. A campaign whose verdict is INVALID is
//! neither a baseline nor compared with one, and nothing is computed from its shares.
//!
//! ```text
//!  records ───────────────────────▶ validity checks, expectations ─┐
//!  controller-changes.json ────────────────────────────────────────┴▶ nothing, or FolderError::Invalid
//! ```

use std::path::PathBuf;

use crate::controller_watch::kept_changes;
use crate::folder::{Folder, FolderError};
use crate::gate::{GateSet, Judge};
use crate::record::Record;
use crate::saved::works;
use crate::summary::Summary;
use crate::verdict::disbelief;

/// Gathers what speaks against the results in a folder, record by record.
pub struct Belief {
    path: PathBuf,
    changes: Vec<String>,
    summary: Summary,
    judge: Judge,
    max_flip_rate: f64,
}

impl Belief {
    /// Begins with the folder of a whole campaign. `max_flip_rate` is the share of checked verdicts that may flip at half
    /// the time step (-).
    ///
    /// # Errors
    /// [`FolderError`] if the folder cannot be read, or holds a part of a campaign.
    pub fn of(folder: &Folder, max_flip_rate: f64) -> Result<Self, FolderError> {
        let manifest = folder.manifest()?;
        if let Some(part) = manifest.partition {
            return Err(FolderError::Part { path: folder.path().to_owned(), part });
        }
        let works = works(folder.path(), &manifest).map_err(|error| folder.of_manifest(error))?;
        Ok(Self {
            path: folder.path().to_owned(),
            changes: kept_changes(folder)?,
            summary: Summary::of(&works).with_inference(manifest.inference),
            judge: Judge::new(&works, &GateSet::default(), manifest.inference),
            max_flip_rate,
        })
    }

    /// Adds a record.
    pub fn push(&mut self, record: &Record) {
        self.summary.push(record);
        self.judge.push(record);
    }

    /// Ends with all records of the folder.
    ///
    /// # Errors
    /// [`FolderError::Invalid`] if the results cannot be believed.
    pub fn check(self) -> Result<(), FolderError> {
        let found = disbelief(&self.summary, &self.judge, self.max_flip_rate);
        let reasons: Vec<String> = self.changes.into_iter().chain(found).collect();
        if reasons.is_empty() { Ok(()) } else { Err(FolderError::Invalid { path: self.path, reasons }) }
    }
}

/// Checks the results in the folder of a whole campaign.
///
/// # Errors
/// [`FolderError`] if the folder cannot be read, holds a part of a campaign or lacks records, or its
/// results cannot be believed.
pub fn believe(folder: &Folder, max_flip_rate: f64) -> Result<(), FolderError> {
    let mut belief = Belief::of(folder, max_flip_rate)?;
    for record in folder.complete_records()? {
        belief.push(&record?);
    }
    belief.check()
}
