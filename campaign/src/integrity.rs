//! Checks that the folder of a campaign is whole: `closecall check DIR`.
//!
//! | what is looked at | problem | repair |
//! |---|---|---|
//! | `manifest.json` | unreadable, another version, a changed scenario text | a copy of the folder |
//! | `journal.jsonl`, `wall-times.jsonl`, `lock` | no file, such as a named pipe or a link | its removal, then `--resume` |
//! | `journal.jsonl` | a damaged line, a line that is there twice, missing samples | `--resume` |
//! | `journal.jsonl` | a record of another sample, another order | a new campaign |
//! | `controller-changes.json` | unreadable | a copy of the folder |
//! | files made from the journal | missing | `--resume` |
//!
//! Fast samples, in [`FAST_SAMPLES`](crate::folder::FAST_SAMPLES), have no files that are made from
//! their journal. The campaign to which they belong resumes them.
//!
//! The command that resumes a campaign stands in its manifest. It is shown only if the folder is
//! the user's own (see the module `trust`): another author may have written any command there. If
//! the command ran in another folder than the user is in, it has to run there again, because its
//! paths may be relative.
//!
//! The commands that read a folder make the same checks of its records: see
//! [`Folder::records`](crate::folder::Folder::records).

use std::path::Path;

use serde::Serialize;

use crate::action::{Action, CommandFor, Resume};
use crate::controller_watch::kept_changes;
use crate::folder::{AHEAD, CONTROLLER_CHANGES, DERIVED_FILES, Folder, FolderError, JOURNAL, MANIFEST, WALL_TIMES};
use crate::journal::{self, Entry};
use crate::lock::LOCK;
use crate::manifest::Manifest;

/// Something that is wrong with a folder.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Problem {
    /// The file.
    pub file: String,
    /// The line, counted from 1, if it is one line.
    pub line: Option<usize>,
    /// What is wrong.
    pub message: String,
    /// The repair of the problem.
    pub repair: String,
}

/// The state of a folder.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Integrity {
    /// Number of records that belong to their samples.
    pub records: u64,
    /// Number of records of the plan that are missing.
    pub missing: u64,
    /// The problems.
    pub problems: Vec<Problem>,
    /// The repair of files that a campaign writes again if it is resumed.
    #[serde(skip)]
    resumption: String,
}

impl Integrity {
    /// Looks at the folder of a campaign. The repairs name commands of the calling program.
    pub fn of(folder: &Folder, command_for: CommandFor) -> Self {
        let mut integrity = Self::default();
        let manifest = match folder.manifest() {
            Ok(manifest) => manifest,
            Err(error) => {
                integrity.add_error(MANIFEST, &error, "put a copy of the folder in its place");
                return integrity;
            }
        };
        integrity.resumption = resumption(folder, &manifest, command_for);
        for name in [JOURNAL, AHEAD, WALL_TIMES, LOCK] {
            if let Some(kind) = kind_of_no_file(&folder.file(name)) {
                let repair = format!("remove it, then {}", integrity.resumption);
                integrity.add(name, None, format!("it is {kind}, not a file"), repair);
            }
        }
        if !integrity.is_sound() {
            return integrity;
        }
        if let Err(error) = integrity.read_journal(folder) {
            let repair = integrity.resumption.clone();
            integrity.add_error(JOURNAL, &error, &repair);
            return integrity;
        }
        if let Err(error) = kept_changes(folder) {
            integrity.add_error(CONTROLLER_CHANGES, &error, "put a copy of the folder in its place");
        }
        let is_paired = manifest.arms.len() > 1;
        let derived: &[&str] = if folder.campaign_of_fast_samples().is_some() { &[] } else { &DERIVED_FILES };
        for &file in derived {
            if integrity.missing == 0 && !folder.file(file).is_file() && (is_paired || file != "arm_pairs.parquet") {
                integrity.add_resumable(file, None, "it is missing".to_owned());
            }
        }
        integrity
    }

    /// Returns true if nothing is wrong.
    pub fn is_sound(&self) -> bool {
        self.problems.is_empty()
    }

    /// Adds a problem.
    pub fn add(&mut self, file: &str, line: Option<usize>, message: String, repair: String) {
        self.problems.push(Problem { file: file.to_owned(), line, message, repair });
    }

    /// Adds a problem that a resumed campaign repairs.
    pub fn add_resumable(&mut self, file: &str, line: Option<usize>, message: String) {
        self.add(file, line, message, self.resumption.clone());
    }

    fn add_error(&mut self, file: &str, error: &FolderError, repair: &str) {
        self.add(file, None, error.to_string(), repair.to_owned());
    }

    fn read_journal(&mut self, folder: &Folder) -> Result<(), FolderError> {
        let path = folder.file(JOURNAL);
        let mut plan = folder.plan()?;
        let fail = |source| FolderError::Read { path: path.clone(), source };
        let copies = journal::copies(&path, |record| plan.place(record)).map_err(fail)?;
        let entries = journal::read(&path).map_err(fail)?;
        for (index, entry) in entries.enumerate() {
            match entry.map_err(fail)? {
                Entry::Record { .. } if copies.contains(&(index + 1)) => {
                    self.add_resumable(JOURNAL, Some(index + 1), "it repeats another line".to_owned());
                }
                Entry::Record { record, .. } => match plan.check(&record) {
                    Ok(()) => self.records += 1,
                    Err(message) => {
                        let repair = "put a copy of the folder in its place, or run the campaign into a new folder";
                        self.add(JOURNAL, Some(index + 1), message, repair.to_owned());
                        // What follows a wrong line is not where it belongs.
                        return Ok(());
                    }
                },
                Entry::Torn { line, reason, .. } => {
                    self.add_resumable(JOURNAL, Some(line), reason);
                    return Ok(());
                }
            }
        }
        self.missing = plan.missing();
        if self.missing > 0 {
            let planned = self.records + self.missing;
            self.add_resumable(JOURNAL, None, format!("it has {} of the {planned} samples", self.records));
        }
        Ok(())
    }
}

/// Returns the words that say how the campaign is resumed in this folder, which may have been
/// moved. Fast samples are resumed with the campaign to which they belong.
fn resumption(folder: &Folder, manifest: &Manifest, command_for: CommandFor) -> String {
    let path = folder.campaign_of_fast_samples().unwrap_or_else(|| folder.path().to_owned());
    if folder.is_own().is_ok_and(|is_own| is_own) {
        let here = std::env::current_dir().ok();
        let elsewhere = manifest.controller_folder().filter(|ran_in| here.as_deref() != Some(*ran_in));
        let path = match elsewhere {
            Some(_) => std::path::absolute(&path).unwrap_or(path),
            None => path,
        };
        let (path, elsewhere) = (path.display().to_string(), elsewhere.map(|folder| folder.display().to_string()));
        let resumed = Resume {
            command: &manifest.command,
            retries_errors: false,
            moved_to: Some(&path),
            working_folder: elsewhere.as_deref(),
        };
        return format!("resume the campaign: {}", command_for(&Action::Resume(resumed)));
    }
    let path = path.display().to_string();
    format!(
        "resume the campaign with your own command line, if you trust the folder: {}; another user or another machine has \
         written the folder, so the `command` of its {MANIFEST} is not repeated here",
        command_for(&Action::ResumeForeign(&path))
    )
}

/// Returns what is at the path of a file that the campaign writes, if it is no file. Nothing may be
/// there.
fn kind_of_no_file(path: &Path) -> Option<&'static str> {
    let kind = path.symlink_metadata().ok()?.file_type();
    if kind.is_file() {
        None
    } else if kind.is_symlink() {
        Some("a symbolic link")
    } else if kind.is_dir() {
        Some("a folder")
    } else {
        Some("a named pipe, a socket or a device")
    }
}
