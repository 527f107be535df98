//! A campaign's folder: made before any work is done, complete when it is over, and good to go on with in between.
//!
//! ```text
//!  manifest.json      how it was made: all that a replay needs
//!  journal.jsonl      one line per sample, appended as results come (see `journal`)
//!  wall-times.jsonl   what each sample cost, beside it, since that differs from run to run
//!  lock               held while a campaign runs
//!  outcomes.parquet   written from the journal, byte-identical however it was computed
//!  timings.parquet    wall times
//!  junit.xml          one case per sample and controller
//!  report.html        for people; summary.md: the same for a pull request
//!  recordings/        Rerun files of chosen samples, and a page that shows them
//! ```

use std::fs;
use std::path::{Path, PathBuf};

use closecall_scenarios::atomic::is_temporary;

pub use crate::folder_error::FolderError;

use super::journal::{self, Entry, Journal};
use super::lock::Lock;
use super::manifest::{MANIFEST_VERSION, Manifest};
use super::record::Record;
use super::wall_times::WallTimes;
use closecall_scenarios::atomic::{WriteError, write_file};

const MANIFEST: &str = "manifest.json";
const JOURNAL: &str = "journal.jsonl";
const WALL_TIMES: &str = "wall-times.jsonl";

/// A campaign's folder.
#[derive(Clone, Debug)]
pub struct Folder {
    path: PathBuf,
}

/// A folder that is held to run a campaign in.
#[derive(Debug)]
pub struct Held {
    /// The folder.
    pub folder: Folder,
    _lock: Lock,
}

/// What [`Held::take_up`] found, ready to be appended to.
#[derive(Debug)]
pub struct TakenUp {
    /// The journal.
    pub journal: Journal,
    /// The wall times.
    pub wall_times: WallTimes,
    /// The line of the journal that was cut off with all after it, and why, where one was.
    pub torn: Option<(usize, String)>,
}

impl Folder {
    /// The folder of a campaign that is there.
    pub fn open(path: &Path) -> Self {
        Self { path: path.to_owned() }
    }

    /// Makes the folder and writes its manifest; with `resume`, takes one that holds the very same campaign, too.
    ///
    /// # Errors
    /// [`FolderError`] where it cannot be written, holds something else, or another program is at work in it.
    pub fn hold(path: &Path, manifest: &Manifest, resume: bool) -> Result<Held, FolderError> {
        let folder = Self::open(path);
        fs::create_dir_all(path).map_err(|source| WriteError::new(path, source))?;
        let is_new = folder.holds_nothing()?;
        if !is_new && !folder.file(MANIFEST).exists() {
            return Err(FolderError::NotACampaign { path: path.to_owned() });
        }
        let lock = Lock::take(path)?;
        folder.sweep()?;
        if folder.file(MANIFEST).exists() {
            let differences = folder.manifest()?.differences(manifest);
            if !differences.is_empty() {
                return Err(FolderError::OtherCampaign { path: path.to_owned(), differences });
            }
            if !resume {
                return Err(FolderError::AlreadyThere { path: path.to_owned() });
            }
        } else {
            folder.write_manifest(manifest)?;
        }
        Ok(Held { folder, _lock: lock })
    }

    /// True where the folder has no entry but what a lock leaves.
    fn holds_nothing(&self) -> Result<bool, FolderError> {
        let fail = |source| FolderError::Read { path: self.path.clone(), source };
        for entry in fs::read_dir(&self.path).map_err(fail)? {
            let name = entry.map_err(fail)?.file_name();
            // A manifest that was being written when the program was killed.
            let is_unfinished = is_temporary(&name);
            if !Lock::is_file_name(&name) && !is_unfinished {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Removes what a program left behind that was killed while it wrote.
    fn sweep(&self) -> Result<(), FolderError> {
        let fail = |source| FolderError::Read { path: self.path.clone(), source };
        for entry in fs::read_dir(&self.path).map_err(fail)? {
            let entry = entry.map_err(fail)?;
            if is_temporary(&entry.file_name()) {
                fs::remove_file(entry.path()).map_err(|source| WriteError::new(&entry.path(), source))?;
            }
        }
        Ok(())
    }

    fn write_manifest(&self, manifest: &Manifest) -> Result<(), WriteError> {
        write_file(&self.file(MANIFEST), |file| {
            serde_json::to_writer_pretty(&mut *file, manifest)?;
            file.write_all(b"\n")
        })
    }

    /// The folder's own path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The path of one of its files.
    pub fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// How the campaign was made.
    ///
    /// # Errors
    /// [`FolderError`] where there is no manifest, or it is not one of this version's layout.
    pub fn manifest(&self) -> Result<Manifest, FolderError> {
        let path = self.file(MANIFEST);
        let text = fs::read_to_string(&path).map_err(|source| FolderError::Read { path: path.clone(), source })?;
        let content = |line, message| FolderError::Content { path: path.clone(), line, message };
        let not_json = |error: serde_json::Error| content(error.line(), error.to_string());
        let value: serde_json::Value = serde_json::from_str(&text).map_err(not_json)?;
        match value.get("manifest_version").and_then(serde_json::Value::as_u64) {
            Some(version) if version == u64::from(MANIFEST_VERSION) => serde_json::from_str(&text).map_err(not_json),
            Some(version) => {
                let message = format!("its layout has version {version}, this program has {MANIFEST_VERSION}");
                Err(content(1, message))
            }
            None => Err(content(1, "there is no `manifest_version`".to_owned())),
        }
    }

    /// The records of the journal, in their order. A last line that was not written to its end is not one of them.
    ///
    /// # Errors
    /// [`FolderError`] where it cannot be read; each record is an error of its own where its line is not one.
    pub fn records(&self) -> Result<impl Iterator<Item = Result<Record, FolderError>> + use<>, FolderError> {
        let path = self.file(JOURNAL);
        let entries = journal::read(&path).map_err(|source| FolderError::Read { path: path.clone(), source })?;
        Ok(entries.filter_map(move |entry| match entry {
            Ok(Entry::Record { record, .. }) => Some(Ok(*record)),
            Ok(Entry::Torn { is_tail: true, .. }) => None,
            Ok(Entry::Torn { line, reason: message, .. }) => {
                Some(Err(FolderError::Content { path: path.clone(), line, message }))
            }
            Err(source) => Some(Err(FolderError::Read { path: path.clone(), source })),
        }))
    }

    /// What each sample cost, in the order of the plan.
    ///
    /// # Errors
    /// [`FolderError::Read`] where it cannot be read.
    pub fn wall_times(&self) -> Result<impl Iterator<Item = super::wall_times::WallTime> + use<>, FolderError> {
        let path = self.file(WALL_TIMES);
        super::wall_times::read(&path).map_err(|source| FolderError::Read { path, source })
    }
}

impl Held {
    /// Goes through the records that are there, as long as they are the ones that `plan` begins with, and opens the
    /// journal behind them. Whatever follows is cut off: it was not written to its end, and will be run again.
    ///
    /// # Errors
    /// [`FolderError::Content`] where the journal holds a sample that the plan does not have there; the journal is
    /// then as it was. Other [`FolderError`]s where something cannot be read or written.
    pub fn take_up(&self, mut plan: impl FnMut(&Record) -> bool) -> Result<TakenUp, FolderError> {
        let path = self.folder.file(JOURNAL);
        let (mut keep, mut kept, mut torn) = (0, 0_u64, None);
        if path.exists() {
            let fail = |source| FolderError::Read { path: path.clone(), source };
            for (place, entry) in journal::read(&path).map_err(fail)?.enumerate() {
                match entry.map_err(fail)? {
                    Entry::Record { record, end } if plan(&record) => (keep, kept) = (end, kept + 1),
                    Entry::Record { record, .. } => {
                        let message = format!("sample {} of `{}` does not belong here", record.sample, record.scenario);
                        return Err(FolderError::Content { path: path.clone(), line: place + 1, message });
                    }
                    Entry::Torn { line, reason, .. } => torn = Some((line, reason)),
                }
            }
        }
        let wall_times = WallTimes::open(&self.folder.file(WALL_TIMES), kept)?;
        Ok(TakenUp { journal: Journal::open(&path, keep)?, wall_times, torn })
    }
}
