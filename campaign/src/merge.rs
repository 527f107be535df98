//! The parts of a campaign put together: the same journal as of one machine that ran it all.

use std::iter::Peekable;
use std::path::{Path, PathBuf};

use super::execution::CampaignError;
use super::folder::{Folder, FolderError, Held};
use super::manifest::Manifest;
use super::partition::Partition;
use super::record::Record;
use super::wall_times::WallTime;

/// Parts that do not make a campaign. Nothing has been written.
#[derive(Debug, thiserror::Error)]
pub enum MergeError {
    /// A folder cannot be used.
    #[error(transparent)]
    Campaign(#[from] CampaignError),
    /// A folder is not for a part of a campaign.
    #[error("failed to merge: {} holds a whole campaign, not a part of one; only folders that were made with --partition are merged", path.display())]
    NotAPart {
        /// The folder.
        path: PathBuf,
    },
    /// Two folders are of different campaigns.
    #[error("failed to merge: {} holds a part of another campaign than {}:\n  {}", path.display(), first.display(), differences.join("\n  "))]
    Foreign {
        /// The folder.
        path: PathBuf,
        /// The first folder.
        first: PathBuf,
        /// What they differ in.
        differences: Vec<String>,
    },
    /// Two folders hold the same part.
    #[error("failed to merge: {} and {} both hold part {part}", first.display(), second.display())]
    Twice {
        /// One folder.
        first: PathBuf,
        /// The other.
        second: PathBuf,
        /// The part.
        part: Partition,
    },
    /// Parts are missing.
    #[error("failed to merge: {} of {of} missing: {}", if parts.len() == 1 { "a part" } else { "parts" }, parts.join(", "))]
    Missing {
        /// How many there should be.
        of: u64,
        /// Those that are missing.
        parts: Vec<String>,
    },
    /// A part has not been run to its end.
    #[error("failed to merge: {} has {has} of its {of} samples; go on with it with --resume first", path.display())]
    Incomplete {
        /// The folder.
        path: PathBuf,
        /// Samples that it has.
        has: u64,
        /// Samples that it should have.
        of: u64,
    },
    /// A part holds a sample that does not belong to it, or not there.
    #[error("failed to merge: {} holds sample {sample} of `{scenario}` out of place", path.display())]
    OutOfPlace {
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

impl From<closecall_scenarios::atomic::WriteError> for MergeError {
    fn from(error: closecall_scenarios::atomic::WriteError) -> Self {
        Self::Campaign(error.into())
    }
}

/// All parts of one campaign, in their order.
#[derive(Debug)]
pub struct Parts {
    folders: Vec<(Partition, Folder)>,
    manifest: Manifest,
}

impl Parts {
    /// Opens folders that together hold a campaign.
    ///
    /// # Errors
    /// [`MergeError`] where one cannot be read, is of another campaign, is there twice, or is missing.
    pub fn open(paths: &[PathBuf]) -> Result<Self, MergeError> {
        let mut folders: Vec<(Partition, Folder)> = Vec::with_capacity(paths.len());
        let mut whole: Option<Manifest> = None;
        for path in paths {
            let folder = Folder::open(path);
            let manifest = folder.manifest()?;
            let Some(part) = manifest.partition else { return Err(MergeError::NotAPart { path: path.clone() }) };
            if let (Some(whole), Some((first_part, first))) = (&whole, folders.first()) {
                let mut differences = whole.differences(&manifest.whole());
                if first_part.of() != part.of() {
                    differences.push(format!("partition: {first_part} there, {part} here"));
                }
                if !differences.is_empty() {
                    let first = first.path().to_owned();
                    return Err(MergeError::Foreign { path: path.clone(), first, differences });
                }
            }
            if let Some((_, first)) = folders.iter().find(|(earlier, _)| *earlier == part) {
                return Err(MergeError::Twice { first: first.path().to_owned(), second: path.clone(), part });
            }
            whole.get_or_insert_with(|| manifest.whole());
            folders.push((part, folder));
        }
        folders.sort_by_key(|(part, _)| *part);
        let of = folders.first().map_or(1, |(part, _)| part.of());
        let is_there = |part: u64| folders.iter().any(|(there, _)| there.part() == part);
        let parts: Vec<String> = (1..=of).filter(|&part| !is_there(part)).map(|part| format!("{part}/{of}")).collect();
        match (parts.is_empty(), whole) {
            (true, Some(manifest)) => Ok(Self { folders, manifest }),
            _ => Err(MergeError::Missing { of, parts }),
        }
    }

    /// How the campaign was made, as if it had not been shared out.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// Checks that every part has every sample, in its place. `samples` are the scenarios with their numbers of
    /// samples.
    ///
    /// # Errors
    /// [`MergeError`] names the part that lacks one, or has another.
    pub fn check(&self, samples: &[(String, u64)]) -> Result<(), MergeError> {
        for (part, folder) in &self.folders {
            let plan = || samples.iter().flat_map(|(name, count)| (0..*count).map(move |sample| (name, sample)));
            let mut plan_of_part = plan().filter(|(_, sample)| part.has(*sample));
            let mut has = 0;
            for record in folder.records()? {
                let record = record?;
                if plan_of_part.next() != Some((&record.scenario, record.sample)) {
                    let path = folder.path().to_owned();
                    return Err(MergeError::OutOfPlace { path, sample: record.sample, scenario: record.scenario });
                }
                has += 1;
            }
            let missing = plan_of_part.count() as u64;
            if missing > 0 {
                return Err(MergeError::Incomplete { path: folder.path().to_owned(), has, of: has + missing });
            }
        }
        Ok(())
    }

    /// Writes the whole campaign into a new folder, after [`Self::check`].
    ///
    /// # Errors
    /// [`MergeError`] where a part cannot be read, or the new folder cannot be written or is not new.
    pub fn merge(&self, samples: &[(String, u64)], out: &Path, command: Vec<String>) -> Result<Held, MergeError> {
        let held = Folder::hold(out, &Manifest { command, ..self.manifest.clone() }, false)?;
        let mut taken_up = held.take_up(|_| false)?;
        let mut readers = Vec::with_capacity(self.folders.len());
        for (part, folder) in &self.folders {
            readers.push((*part, Reader { records: folder.records()?, times: folder.wall_times()?.peekable() }));
        }
        let mut place = 0;
        for (_, count) in samples {
            for sample in 0..*count {
                let Some((_, reader)) = readers.iter_mut().find(|(part, _)| part.has(sample)) else { continue };
                let Some(record) = reader.records.next().transpose()? else { continue };
                taken_up.journal.append(&record)?;
                if let Some(time) = reader.time_of(&record) {
                    taken_up.wall_times.append(&WallTime { place, ..time })?;
                }
                place += 1;
            }
        }
        taken_up.journal.sync()?;
        taken_up.wall_times.flush()?;
        Ok(held)
    }
}

struct Reader<R, T: Iterator<Item = WallTime>> {
    records: R,
    times: Peekable<T>,
}

impl<R, T: Iterator<Item = WallTime>> Reader<R, T> {
    /// What a record cost, where that was kept.
    fn time_of(&mut self, record: &Record) -> Option<WallTime> {
        self.times.next_if(|time| time.sample == record.sample && time.scenario == record.scenario)
    }
}
