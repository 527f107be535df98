//! Merges the parts of a campaign. The merged journal equals the journal of one machine that ran
//! the whole campaign.

use std::iter::Peekable;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use closecall_traffic::atomic::WriteError;

use super::campaign_error::CampaignError;
use super::folder::{Folder, FolderError, LockedFolder};
use super::folder_error::listed;
use super::manifest::Manifest;
use super::partition::Partition;
use super::rare::RareError;
use super::record::Record;
use super::runner::Work;
use super::wall_times::WallTime;

/// The reason for which parts cannot be merged.
#[derive(Debug, thiserror::Error)]
pub enum MergeError {
    /// A folder cannot be used.
    #[error(transparent)]
    Campaign(#[from] CampaignError),
    /// A folder holds a whole campaign.
    #[error("failed to merge: {} holds a whole campaign, not a part of one; only the folders of parts are merged", path.display())]
    NotAPart {
        /// The folder.
        path: PathBuf,
    },
    /// Two folders hold parts of different campaigns.
    #[error("failed to merge: {} and {} hold parts of different campaigns:\n  {}", path.display(), first.display(), listed(differences))]
    OtherCampaign {
        /// The folder.
        path: PathBuf,
        /// The first folder.
        first: PathBuf,
        /// What differs, one message for each difference.
        differences: Vec<String>,
    },
    /// Two folders hold the same part.
    #[error("failed to merge: {} and {} both hold part {part}", first.display(), second.display())]
    Duplicate {
        /// One folder.
        first: PathBuf,
        /// The other.
        second: PathBuf,
        /// The part.
        part: Partition,
    },
    /// Parts are missing.
    #[error("failed to merge: {} of {count} parts {} missing: {}", parts.len(), if parts.len() == 1 { "is" } else { "are" }, parts.join(", "))]
    Missing {
        /// Number of parts of the campaign.
        count: u64,
        /// The missing parts.
        parts: Vec<String>,
    },
    /// A part has not run to its end.
    #[error("failed to merge: {} has {has} of its {planned} samples; resume it first", path.display())]
    Incomplete {
        /// The folder.
        path: PathBuf,
        /// Number of samples that it holds.
        has: u64,
        /// Number of samples that it should hold.
        planned: u64,
    },
    /// Two parts of a rare event differ in a run that both have made.
    #[error(
        "failed to merge: {} and {} differ in run {run} of `{scenario}`: the controller, a file that it imports or the program is \
         not the same on both machines, or does not repeat",
        first.display(),
        second.display()
    )]
    OtherRun {
        /// One folder.
        first: PathBuf,
        /// The other.
        second: PathBuf,
        /// The scenario.
        scenario: String,
        /// The number of the run.
        run: u64,
    },
    /// The parts of a rare event have no estimate.
    #[error("failed to merge: {0}")]
    Rare(RareError),
    /// A part holds a sample that belongs to another part, or that is not in the order of the plan.
    #[error("failed to merge: {} holds sample {sample} of `{scenario}` out of order", path.display())]
    OutOfOrder {
        /// The folder.
        path: PathBuf,
        /// The sample.
        sample: u64,
        /// The scenario.
        scenario: String,
    },
}

impl From<FolderError> for MergeError {
    fn from(error: FolderError) -> Self {
        Self::Campaign(error.into())
    }
}

impl From<RareError> for MergeError {
    fn from(error: RareError) -> Self {
        match error {
            RareError::Campaign(error) => Self::Campaign(error),
            other => Self::Rare(other),
        }
    }
}

impl From<WriteError> for MergeError {
    fn from(error: WriteError) -> Self {
        Self::Campaign(error.into())
    }
}

/// All parts of one campaign, in the order of their numbers.
#[derive(Debug)]
pub struct Parts {
    folders: Vec<(Partition, Folder)>,
    manifest: Manifest,
}

impl Parts {
    /// Opens the folders of all parts of a campaign, in any order.
    ///
    /// # Errors
    /// [`MergeError`] if a folder cannot be read, or if a part is of another campaign, duplicate,
    /// or missing.
    pub fn open(paths: &[PathBuf]) -> Result<Self, MergeError> {
        let mut folders: Vec<(Partition, Folder)> = Vec::with_capacity(paths.len());
        let mut whole: Option<Manifest> = None;
        for path in paths {
            let folder = Folder::open(path);
            let manifest = folder.manifest()?;
            let Some(part) = manifest.partition else { return Err(MergeError::NotAPart { path: path.clone() }) };
            if let (Some(whole), Some((first_part, first))) = (&whole, folders.first()) {
                let mut differences = whole.differences(&manifest.whole());
                if first_part.count() != part.count() {
                    differences.push(format!("partition: {first_part} there, {part} here"));
                }
                if !differences.is_empty() {
                    let first = first.path().to_owned();
                    return Err(MergeError::OtherCampaign { path: path.clone(), first, differences });
                }
            }
            if let Some((_, first)) = folders.iter().find(|(earlier, _)| *earlier == part) {
                return Err(MergeError::Duplicate { first: first.path().to_owned(), second: path.clone(), part });
            }
            whole.get_or_insert_with(|| manifest.whole());
            folders.push((part, folder));
        }
        folders.sort_by_key(|(part, _)| *part);
        let count = folders.first().map_or(1, |(part, _)| part.count());
        let is_given = |part: u64| folders.iter().any(|(folder, _)| folder.part() == part);
        let parts: Vec<String> =
            (1..=count).filter(|&part| !is_given(part)).map(|part| format!("{part}/{count}")).collect();
        match (parts.is_empty(), whole) {
            (true, Some(manifest)) => Ok(Self { folders, manifest }),
            _ => Err(MergeError::Missing { count, parts }),
        }
    }

    /// Returns the manifest of the whole campaign.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// Checks that every part holds exactly its samples of the campaign, in the order of the plan.
    /// `works` are the scenarios of the campaign.
    ///
    /// # Errors
    /// [`MergeError`] if a part lacks a sample, or holds another one.
    pub fn check(&self, works: &[Arc<Work>]) -> Result<(), MergeError> {
        for (part, folder) in &self.folders {
            let mut plan_of_part = works.iter().flat_map(|work| {
                let name = &work.file.config().name;
                work.samples(Some(*part)).map(move |sample| (name, sample))
            });
            let mut has = 0;
            for record in folder.records()? {
                let record = record?;
                if plan_of_part.next() != Some((&record.scenario, record.sample)) {
                    let path = folder.path().to_owned();
                    return Err(MergeError::OutOfOrder { path, sample: record.sample, scenario: record.scenario });
                }
                has += 1;
            }
            let missing = plan_of_part.count() as u64;
            if missing > 0 {
                return Err(MergeError::Incomplete { path: folder.path().to_owned(), has, planned: has + missing });
            }
        }
        Ok(())
    }

    /// Writes the whole campaign into a new folder. Call [`Self::check`] first. With `resume`, the
    /// folder may hold what an interrupted merge of the same campaign has left, which is written
    /// anew.
    ///
    /// # Errors
    /// [`MergeError`] if a part cannot be read, or if the new folder cannot be written or is not
    /// new.
    pub fn merge(
        &self,
        works: &[Arc<Work>],
        out: &Path,
        command: Vec<String>,
        resume: bool,
    ) -> Result<LockedFolder, MergeError> {
        let merged = Folder::lock(out, &Manifest { command, ..self.manifest.clone() }, resume)?;
        if resume {
            merged.folder.remove_journal()?;
        }
        let mut files = merged.resume(|_| Err("the folder of the merged campaign holds results already".to_owned()))?;
        let mut readers = Vec::with_capacity(self.folders.len());
        for (part, folder) in &self.folders {
            readers.push((*part, Reader { records: folder.records()?, times: folder.wall_times()?.peekable() }));
        }
        let mut index = 0;
        for work in works {
            for sample in work.samples(None) {
                let Some((_, reader)) = readers.iter_mut().find(|(part, _)| part.contains(sample)) else { continue };
                let Some(record) = reader.records.next().transpose()? else { continue };
                files.journal.append(&record)?;
                if let Some(time) = reader.time_of(&record) {
                    files.wall_times.append(&WallTime { index, ..time })?;
                }
                index += 1;
            }
        }
        files.journal.sync()?;
        files.wall_times.flush()?;
        Ok(merged)
    }
}

/// Reads the records and wall times of one part side by side.
struct Reader<R, T: Iterator<Item = WallTime>> {
    records: R,
    times: Peekable<T>,
}

impl<R, T: Iterator<Item = WallTime>> Reader<R, T> {
    /// Returns the wall time of a record, if the part has it.
    fn time_of(&mut self, record: &Record) -> Option<WallTime> {
        self.times.next_if(|time| time.sample == record.sample && time.scenario == record.scenario)
    }
}
