//! The folder of a campaign. It is set up before the first sample runs, and an interrupted campaign
//! resumes from it.
//!
//! ```text
//!  manifest.json      how the campaign was made: everything that a replay needs
//!  journal.jsonl      one record per sample, appended as results arrive (module `journal`)
//!  ahead.jsonl        samples that wait for their turn while a campaign runs (module `ahead`)
//!  wall-times.jsonl   wall time of each sample, which differs from run to run
//!  lock               locked while a campaign runs
//!  outcomes.parquet   made from the journal: the same bytes, however the samples were shared out
//!  timings.parquet    wall times as a table
//!  junit.xml          one test case per sample and controller
//!  report.html        report for human readers; summary.md: the same for a pull request
//!  recordings/        recordings (Rerun files) of selected samples, and a page that shows them
//!  causes.json        what `explain` has found, if it was asked
//!  explorer.html      the explorer as a file, if it was asked for
//!  fidelity/          the folder of the same campaign with fast sensors, if it was asked for
//!  fidelity.json      the rates that the fast samples have sharpened
//!  controller-changes.json   what changed of the controllers while the campaign ran, if anything did
//! ```

use std::fs;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use closecall_scenarios::outcome::Outcome;
use closecall_traffic::atomic::{WriteError, create_folder, is_temporary, write_file};
use closecall_traffic::input::read_text;

use super::journal::{self, Entry, Journal};
use super::journal_plan::JournalPlan;
use super::lock::{LOCK, Lock};
use super::manifest::{MANIFEST_VERSION, Manifest};
use super::rare;
use super::record::{Agreement, Record};
use super::saved_error::SavedError;
use super::trust;
use super::wall_times::{self, WallTime, WallTimes};

use crate::folder_error::json_fault;
pub use crate::folder_error::{FolderError, listed};

/// The file of a campaign's folder that says how the campaign was made.
pub const MANIFEST: &str = "manifest.json";
pub(crate) const JOURNAL: &str = "journal.jsonl";
pub(crate) const AHEAD: &str = "ahead.jsonl";
pub(crate) const WALL_TIMES: &str = "wall-times.jsonl";

/// The report for human readers, in a campaign's folder.
pub const REPORT: &str = "report.html";
/// The file into which a user may put the explorer, in a campaign's folder.
pub const EXPLORER: &str = "explorer.html";
/// The folder of the recordings, in a campaign's folder.
pub const RECORDINGS: &str = "recordings";
/// The page of the recordings, in their folder.
pub const RECORDINGS_PAGE: &str = "index.html";
/// The folder of the same campaign with fast sensors, in a campaign's folder. It has a manifest, a
/// journal and wall times, and no reports.
pub const FAST_SAMPLES: &str = "fidelity";
/// The file with the rates that the fast samples have sharpened, in a campaign's folder.
pub const FIDELITY_FILE: &str = "fidelity.json";
pub(crate) const CONTROLLER_CHANGES: &str = "controller-changes.json";

/// All files of a campaign's folder, without its recordings and its fast samples.
pub(crate) const FILES: [&str; 16] = [
    MANIFEST,
    JOURNAL,
    AHEAD,
    WALL_TIMES,
    LOCK,
    "outcomes.parquet",
    "timings.parquet",
    "arm_pairs.parquet",
    "junit.xml",
    "samples.xml",
    REPORT,
    "summary.md",
    "causes.json",
    EXPLORER,
    FIDELITY_FILE,
    CONTROLLER_CHANGES,
];

/// The files that are made from the journal.
pub(crate) const DERIVED_FILES: [&str; 7] =
    ["outcomes.parquet", "timings.parquet", "arm_pairs.parquet", "junit.xml", "samples.xml", REPORT, "summary.md"];

/// The reports of a campaign's folder that a reader opens first.
pub const REPORT_FILES: [&str; 5] = [REPORT, "summary.md", "junit.xml", "outcomes.parquet", "recordings/index.html"];

/// The folder of a campaign.
#[derive(Clone, Debug)]
pub struct Folder {
    path: PathBuf,
}

/// A campaign's folder that this program has locked, so that it can run a campaign in it.
#[derive(Debug)]
pub struct LockedFolder {
    /// The folder.
    pub folder: Folder,
    _lock: Lock,
}

/// The files of a resumed campaign, open for appending. See [`LockedFolder::resume`].
#[derive(Debug)]
pub struct ResumedFiles {
    /// The journal.
    pub journal: Journal,
    /// The wall times.
    pub wall_times: WallTimes,
    /// The damaged line from which on the journal was cut off; `None` if every line was readable.
    pub torn: Option<TornLine>,
}

/// A line of a journal that is incomplete or damaged.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TornLine {
    /// The line, counted from 1.
    pub line: usize,
    /// What is wrong with it.
    pub reason: String,
}

/// Says that a run of a sample is not the run of the campaign.
fn difference(outcome: &Outcome) -> String {
    let (sample, controller) = (outcome.sample, &outcome.controller);
    format!(
        "sample {sample} with `{controller}` differs from the campaign's journal: the controller, a file that it imports or the \
         program has changed, or does not repeat"
    )
}

impl Folder {
    /// Returns the folder at `path`. It is not read, and need not exist.
    pub fn open(path: &Path) -> Self {
        Self { path: path.to_owned() }
    }

    /// Locks a folder for the campaign of `manifest`. Creates the folder and writes the manifest if
    /// the folder does not exist or is empty. With `resume`, also accepts a folder that already
    /// holds the same campaign, or the first samples of it.
    ///
    /// # Errors
    /// [`FolderError`] if the folder cannot be written, holds something else, or is locked by
    /// another program.
    pub fn lock(path: &Path, manifest: &Manifest, resume: bool) -> Result<LockedFolder, FolderError> {
        let folder = Self::open(path);
        create_folder(path)?;
        let is_new = folder.is_unused()?;
        let has_manifest = folder.has(MANIFEST)?;
        if !has_manifest && folder.has(rare::MANIFEST)? {
            return Err(FolderError::RareEvent { path: path.to_owned() });
        }
        if !is_new && !has_manifest {
            return Err(FolderError::NotACampaign { path: path.to_owned() });
        }
        let lock = Lock::acquire(path)?;
        folder.remove_temporary_files()?;
        if folder.has(MANIFEST)? {
            let there = folder.manifest()?;
            let has_its_beginning = there.grows_to(manifest);
            let grows = resume && has_its_beginning;
            let differences = if has_its_beginning { Vec::new() } else { there.differences_in_growth(manifest) };
            if !differences.is_empty() {
                return Err(FolderError::OtherCampaign { path: path.to_owned(), differences });
            }
            if grows {
                // If the seed was known when the campaign began, the added samples know it, too.
                let has_drawn_seed = there.has_drawn_seed && manifest.has_drawn_seed;
                folder.write_manifest(&Manifest { has_drawn_seed, ..manifest.clone() })?;
            }
            if !resume {
                return Err(FolderError::AlreadyThere { path: path.to_owned() });
            }
        } else {
            folder.write_manifest(manifest)?;
        }
        Ok(LockedFolder { folder, _lock: lock })
    }

    /// Returns true if the folder holds at most a lock file and temporary files.
    fn is_unused(&self) -> Result<bool, FolderError> {
        let fail = |source| FolderError::Read { path: self.path.clone(), source };
        for entry in fs::read_dir(&self.path).map_err(fail)? {
            let name = entry.map_err(fail)?.file_name();
            // A temporary file is a manifest whose program was killed while writing it.
            let is_unfinished = is_temporary(&name);
            if !Lock::is_file_name(&name) && !is_unfinished {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Returns true if the folder has a file of this name. If the system cannot tell, that is an
    /// error: a file that is taken for missing would be overwritten.
    pub(crate) fn has(&self, name: &str) -> Result<bool, FolderError> {
        let path = self.file(name);
        path.try_exists().map_err(|source| FolderError::Read { path, source })
    }

    /// Removes the temporary files of a program that was killed while writing.
    fn remove_temporary_files(&self) -> Result<(), FolderError> {
        let fail = |source| FolderError::Read { path: self.path.clone(), source };
        for entry in fs::read_dir(&self.path).map_err(fail)? {
            let entry = entry.map_err(fail)?;
            if is_temporary(&entry.file_name()) {
                fs::remove_file(entry.path()).map_err(|source| WriteError::new(&entry.path(), source))?;
            }
        }
        Ok(())
    }

    /// Removes the journal and the wall times, if there are any.
    pub(crate) fn remove_journal(&self) -> Result<(), WriteError> {
        [JOURNAL, AHEAD, WALL_TIMES].iter().try_for_each(|name| self.remove(name))
    }

    /// Removes a file, if there is one of this name.
    pub(crate) fn remove(&self, name: &str) -> Result<(), WriteError> {
        let path = self.file(name);
        match fs::remove_file(&path) {
            Err(error) if error.kind() != ErrorKind::NotFound => Err(WriteError::new(&path, error)),
            _ => Ok(()),
        }
    }

    fn write_manifest(&self, manifest: &Manifest) -> Result<(), WriteError> {
        write_file(&self.file(MANIFEST), |file| {
            serde_json::to_writer_pretty(&mut *file, manifest)?;
            file.write_all(b"\n")
        })
    }

    /// Returns the folder's path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the path of a file in the folder.
    pub fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// Returns the folder of the campaign to which the samples in this folder belong, if they are
    /// its fast samples.
    pub fn campaign_of_fast_samples(&self) -> Option<PathBuf> {
        let path = std::path::absolute(&self.path).ok()?;
        let campaign = path.parent()?;
        let is_fast = path.file_name()? == FAST_SAMPLES && campaign.join(MANIFEST).is_file();
        is_fast.then(|| campaign.to_owned())
    }

    /// Reads the manifest, which says how the campaign was made.
    ///
    /// # Errors
    /// [`FolderError`] if there is no manifest, or if its layout has another version than this
    /// program's.
    pub fn manifest(&self) -> Result<Manifest, FolderError> {
        Ok(self.manifest_with_hash()?.0)
    }

    /// Remembers that this user's program has written the manifest: the folder is the user's own
    /// from now on.
    ///
    /// # Errors
    /// [`FolderError`] if the manifest cannot be read, or the user's state folder not be written.
    pub fn remember(&self) -> Result<(), FolderError> {
        let (_, hash) = self.manifest_with_hash()?;
        Ok(trust::remember(&hash).map_err(|source| WriteError::new(&self.path, source))?)
    }

    /// Returns the error of a manifest that cannot be read: a path that is no folder, and a folder
    /// without results, are said to be such.
    fn without_campaign(&self, source: io::Error) -> FolderError {
        let is_absent = source.kind() == ErrorKind::NotFound;
        let (path, reason) = match fs::metadata(&self.path) {
            Ok(there) if !there.is_dir() => (self.path.clone(), "it is a file, and the folder of a campaign is needed"),
            Ok(_) if is_absent => {
                (self.path.clone(), "the folder holds no results of a campaign: it has no manifest.json")
            }
            Ok(_) => return FolderError::Read { path: self.file(MANIFEST), source },
            Err(source) => return FolderError::Read { path: self.path.clone(), source },
        };
        FolderError::Read { path, source: io::Error::new(source.kind(), reason) }
    }

    /// Returns the manifest, and the BLAKE3 hash of its text.
    pub(crate) fn manifest_with_hash(&self) -> Result<(Manifest, String), FolderError> {
        let path = self.file(MANIFEST);
        if self.path.is_dir() && !self.has(MANIFEST)? && self.has(rare::MANIFEST)? {
            return Err(FolderError::RareEvent { path: self.path.clone() });
        }
        let text = read_text(&path).map_err(|source| self.without_campaign(source))?;
        let content = |line, message| FolderError::Content { path: path.clone(), line, message };
        let not_json = |error: serde_json::Error| content(error.line(), json_fault(&text, &error));
        let value: serde_json::Value = serde_json::from_str(&text).map_err(not_json)?;
        match value.get("manifest_version").and_then(serde_json::Value::as_u64) {
            Some(version) if version == u64::from(MANIFEST_VERSION) => {
                let manifest = serde_json::from_str(&text).map_err(not_json)?;
                Ok((manifest, blake3::hash(text.as_bytes()).to_string()))
            }
            Some(version) => {
                let message = format!("its layout has version {version}, this program has {MANIFEST_VERSION}");
                Err(content(1, message))
            }
            None => Err(content(1, "there is no `manifest_version`".to_owned())),
        }
    }

    /// Returns the records of the journal in their order. Skips an unfinished last line, which a
    /// killed program leaves.
    ///
    /// # Errors
    /// [`FolderError`] if the manifest cannot be read or the journal cannot be opened. An item of
    /// the iterator is an error if its line is damaged, cannot be read, or is not the next one of
    /// the manifest's plan.
    pub fn records(&self) -> Result<Records, FolderError> {
        let path = self.file(JOURNAL);
        let plan = self.plan()?;
        let entries = journal::read(&path).map_err(|source| FolderError::Read { path: path.clone(), source })?;
        Ok(Records { path, plan, entries, line: 0, is_over: false, must_be_complete: false })
    }

    /// Returns the records of a journal that must be complete. A part of the samples says nothing
    /// about all of them.
    ///
    /// # Errors
    /// As [`Self::records`]. The last item of the iterator is [`FolderError::Incomplete`] if
    /// samples of the plan are missing.
    pub fn complete_records(&self) -> Result<Records, FolderError> {
        Ok(Records { must_be_complete: true, ..self.records()? })
    }

    /// Checks that each record of the journal belongs to the plan of the manifest. A folder without
    /// a journal passes.
    ///
    /// # Errors
    /// [`FolderError`] as an item of [`Self::records`].
    pub fn check_journal(&self) -> Result<(), FolderError> {
        if !self.has(JOURNAL)? {
            return Ok(());
        }
        self.records()?.try_for_each(|record| record.map(drop))
    }

    /// Checks the journal as [`Self::check_journal`], and returns true if it has the record of a
    /// sample.
    ///
    /// # Errors
    /// [`FolderError`] as an item of [`Self::records`].
    pub fn has_record(&self, scenario: &str, sample: u64) -> Result<bool, FolderError> {
        let is_it = |record: Record| record.scenario == scenario && record.sample == sample;
        match self.has(JOURNAL)? {
            true => self.records()?.try_fold(false, |is_there, record| Ok(is_it(record?) || is_there)),
            false => Ok(false),
        }
    }

    /// Returns true if this program wrote the manifest for this user: see [`Self::remember`].
    pub(crate) fn is_own(&self) -> Result<bool, FolderError> {
        Ok(trust::is_own(&self.manifest_with_hash()?.1))
    }

    /// Returns the plan of the manifest, which the journal follows.
    pub(crate) fn plan(&self) -> Result<JournalPlan, FolderError> {
        JournalPlan::new(&self.path, &self.manifest()?).map_err(|error| self.of_manifest(error))
    }

    /// Returns the error of a manifest whose campaign cannot be read back.
    pub(crate) fn of_manifest(&self, error: SavedError) -> FolderError {
        match error {
            SavedError::Folder(error) => error,
            other => FolderError::Content { path: self.file(MANIFEST), line: 1, message: other.to_string() },
        }
    }

    /// Returns how the journal's result of this sample compares with an outcome, to the last bit.
    ///
    /// # Errors
    /// [`FolderError`] if the journal cannot be read, or a line of it is damaged.
    pub fn agreement(&self, outcome: &Outcome) -> Result<Agreement, FolderError> {
        if !self.has(JOURNAL)? {
            return Ok(Agreement::NotCompared);
        }
        for record in self.records()? {
            let agreement = record?.agreement(outcome);
            if agreement != Agreement::NotCompared {
                return Ok(agreement);
            }
        }
        Ok(Agreement::NotCompared)
    }

    /// Returns a message for each of these runs that is not the run of the campaign, to the last bit.
    ///
    /// # Errors
    /// [`FolderError`] if the journal cannot be read, or a line of it is damaged.
    pub fn differences<'a>(&self, outcomes: impl IntoIterator<Item = &'a Outcome>) -> Result<Vec<String>, FolderError> {
        let (outcomes, mut differences): (Vec<&Outcome>, _) = (outcomes.into_iter().collect(), Vec::new());
        if outcomes.is_empty() || !self.has(JOURNAL)? {
            return Ok(differences);
        }
        for record in self.records()? {
            let record = record?;
            let differs = |outcome: &&&Outcome| record.agreement(outcome) == Agreement::Differs;
            differences.extend(outcomes.iter().filter(differs).map(|outcome| difference(outcome)));
        }
        Ok(differences)
    }

    /// Returns a message if one of these runs of a sample is not the run of the campaign, to the last
    /// bit. Of the journal, only the line of this sample is checked.
    ///
    /// # Errors
    /// [`FolderError`] if the journal cannot be read, or the line is damaged.
    pub fn difference_of_sample(&self, outcomes: &[&Outcome]) -> Result<Option<String>, FolderError> {
        let Some(first) = outcomes.first() else { return Ok(None) };
        if !self.has(JOURNAL)? {
            return Ok(None);
        }
        let path = self.file(JOURNAL);
        let found = journal::find(&path, &first.scenario, first.sample)
            .map_err(|source| FolderError::Read { path: path.clone(), source })?;
        let Some((line, record)) = found else { return Ok(None) };
        let record = record.map_err(|message| FolderError::Content { path, line, message })?;
        let differing = outcomes.iter().find(|outcome| record.agreement(outcome) == Agreement::Differs);
        Ok(differing.map(|outcome| difference(outcome)))
    }

    /// Returns the wall time of each sample, in the order of the plan.
    ///
    /// # Errors
    /// [`FolderError::Read`] if the file cannot be opened.
    pub fn wall_times(&self) -> Result<impl Iterator<Item = WallTime> + use<>, FolderError> {
        let path = self.file(WALL_TIMES);
        wall_times::read(&path).map_err(|source| FolderError::Read { path, source })
    }
}

/// The records of a journal, each checked against the plan of the manifest. See
/// [`Folder::records`].
pub struct Records {
    path: PathBuf,
    plan: JournalPlan,
    entries: journal::Entries,
    /// Number of lines that have been read.
    line: usize,
    is_over: bool,
    must_be_complete: bool,
}

impl Records {
    fn content(&self, line: usize, message: String) -> FolderError {
        FolderError::Content { path: self.path.clone(), line, message }
    }
}

impl Iterator for Records {
    type Item = Result<Record, FolderError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.is_over {
            return None;
        }
        let item = match self.entries.next() {
            Some(Ok(Entry::Record { record, .. })) => {
                self.line += 1;
                Some(self.plan.check(&record).map(|()| *record).map_err(|message| self.content(self.line, message)))
            }
            Some(Ok(Entry::Torn { line, reason, is_tail: false })) => Some(Err(self.content(line, reason))),
            Some(Err(source)) => Some(Err(FolderError::Read { path: self.path.clone(), source })),
            None | Some(Ok(Entry::Torn { is_tail: true, .. })) => {
                let (has, missing) = (self.line as u64, self.plan.missing());
                let is_missing = self.must_be_complete && missing > 0;
                is_missing
                    .then(|| Err(FolderError::Incomplete { path: self.path.clone(), has, planned: has + missing }))
            }
        };
        // What follows a wrong line cannot be trusted.
        self.is_over = !matches!(item, Some(Ok(_)));
        item
    }
}

impl LockedFolder {
    /// Returns the path of the journal.
    pub(super) fn journal_path(&self) -> PathBuf {
        self.folder.file(JOURNAL)
    }

    /// Returns the path of the file of wall times.
    pub(super) fn wall_times_path(&self) -> PathBuf {
        self.folder.file(WALL_TIMES)
    }

    /// Hands each existing record to `check`, and opens the journal for appending behind the last
    /// one. A torn line is cut off together with everything after it: those samples run again.
    ///
    /// `check` returns an error, in words, if the record is not the next one in the plan.
    ///
    /// # Errors
    /// [`FolderError::Content`] if `check` refuses a record; the journal is then unchanged. Other
    /// [`FolderError`]s if a file cannot be read or written.
    pub fn resume(&self, mut check: impl FnMut(&Record) -> Result<(), String>) -> Result<ResumedFiles, FolderError> {
        let path = self.folder.file(JOURNAL);
        let (mut kept_bytes, mut kept_records, mut torn) = (0, 0_u64, None);
        if self.folder.has(JOURNAL)? {
            let fail = |source| FolderError::Read { path: path.clone(), source };
            for (index, entry) in journal::read(&path).map_err(fail)?.enumerate() {
                match entry.map_err(fail)? {
                    Entry::Record { record, end } => {
                        let wrong = |message| FolderError::Content { path: path.clone(), line: index + 1, message };
                        check(&record).map_err(wrong)?;
                        (kept_bytes, kept_records) = (end, kept_records + 1);
                    }
                    Entry::Torn { line, reason, .. } => torn = Some(TornLine { line, reason }),
                }
            }
        }
        let wall_times = WallTimes::open(&self.folder.file(WALL_TIMES), kept_records)?;
        Ok(ResumedFiles { journal: Journal::open(&path, kept_bytes)?, wall_times, torn })
    }
}
