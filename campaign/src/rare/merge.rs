//! Merges the parts of a campaign that samples a rare event.
//!
//! ```text
//!  part 1: searches, pilot ─▶ last runs 1, 4, 5, …  ─┐
//!  part 2: searches, pilot ─▶ last runs 2, 3, 6, …  ─┴▶ one journal ─▶ the method again, by its lines ─▶ estimate
//! ```
//!
//! Only importance sampling has parts. Its searches and its pilot adapt, each level to the level
//! before, and every part repeats them: they depend on the seed alone. The last runs are
//! independent of each other. Each part runs its share of them, by their numbers. The merged
//! journal has each run once, in the order of the numbers, and the method goes through it as
//! through the journal of one machine. So the weights, the sums and the result have the same bits.
//!
//! Subset simulation has no parts: the number of its repetitions follows from the first of them,
//! which are most of its runs. Nor has a search, which ends with the first event.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use closecall_scenarios::criteria::{EventExpression, Guide};

use super::error::RareError;
use super::files::{JOURNAL, MANIFEST};
use super::importance::Goal;
use super::journal::{RareFolder, RareJournal, RareManifest, RareRecord, read_records};
use super::nearness::Nearness;
use super::plan::RarePlan;
use super::report::RareReport;
use crate::folder::FolderError;
use crate::manifest::Manifest;
use crate::merge::MergeError;
use crate::partition::Partition;
use crate::runner::Work;
use crate::stop::StopFlag;
use crate::workers::Workers;

/// All parts of one campaign that samples a rare event.
#[derive(Debug)]
pub struct RareParts {
    /// The first of the folders, which messages name.
    folder: PathBuf,
    manifest: RareManifest,
    /// All runs, scenario by scenario, in the order of their numbers.
    records: Vec<RareRecord>,
}

impl RareParts {
    /// Opens the folders of all parts of a campaign, in any order. Returns `None` if no folder
    /// samples a rare event.
    ///
    /// # Errors
    /// [`MergeError`] if a folder cannot be read, if a part is of another campaign, duplicate, or
    /// missing, or if two parts differ in a run that both have.
    pub fn open(paths: &[PathBuf]) -> Result<Option<Self>, MergeError> {
        let manifests: Vec<Option<RareManifest>> = paths.iter().map(|path| RareManifest::read(path)).collect();
        if manifests.iter().all(Option::is_none) {
            return Ok(None);
        }
        let mut folders: Vec<(Partition, &PathBuf)> = Vec::with_capacity(paths.len());
        let mut first: Option<(RareManifest, &PathBuf)> = None;
        for (path, manifest) in paths.iter().zip(manifests) {
            let not_a_part = || MergeError::NotAPart { path: path.clone() };
            let manifest = manifest.ok_or_else(not_a_part)?;
            let part = manifest.campaign.partition.ok_or_else(not_a_part)?;
            let whole = manifest.whole();
            if let (Some((there, first)), Some((first_part, _))) = (&first, folders.first()) {
                let mut differences = there.all_differences(&whole);
                if first_part.count() != part.count() {
                    differences.push(format!("partition: {first_part} there, {part} here"));
                }
                if !differences.is_empty() {
                    return Err(MergeError::OtherCampaign { path: path.clone(), first: (*first).clone(), differences });
                }
            }
            if let Some((_, first)) = folders.iter().find(|(earlier, _)| *earlier == part) {
                return Err(MergeError::Duplicate { first: (*first).clone(), second: path.clone(), part });
            }
            first.get_or_insert((whole, path));
            folders.push((part, path));
        }
        let count = folders.first().map_or(1, |(part, _)| part.count());
        let is_given = |part: u64| folders.iter().any(|(folder, _)| folder.part() == part);
        let parts: Vec<String> =
            (1..=count).filter(|&part| !is_given(part)).map(|part| format!("{part}/{count}")).collect();
        let Some((manifest, folder)) = first.filter(|_| parts.is_empty()) else {
            return Err(MergeError::Missing { count, parts });
        };
        let records = united(&manifest, folders.iter().map(|(_, path)| path.as_path()))?;
        Ok(Some(Self { folder: folder.clone(), manifest, records }))
    }

    /// Returns the manifest of the whole campaign.
    pub const fn manifest(&self) -> &RareManifest {
        &self.manifest
    }

    /// Returns the results of the scenarios `works` of the campaign. Nothing runs.
    ///
    /// # Errors
    /// [`MergeError`] if a run is missing, or the parts have another run than the method asks for.
    pub fn estimate(&self, works: &[Arc<Work>]) -> Result<Vec<RareReport>, MergeError> {
        let (plan, path) = (self.plan()?, self.folder.join(JOURNAL));
        let mut journal = RareJournal::closed(&path, self.records.clone());
        let stop = StopFlag::default();
        let mut reports = Vec::with_capacity(works.len());
        for work in works.iter().enumerate() {
            reports.push(plan.run(work, Some(&mut journal), &stop, &mut || {})?);
        }
        match journal.rest() {
            None => Ok(reports),
            Some(RareRecord { scenario, run, .. }) => {
                let message = format!("run {run} of `{scenario}` is not one that the method asks for");
                Err(FolderError::Content { path, line: 1, message }.into())
            }
        }
    }

    /// Writes the manifest and the journal of the whole campaign into a new folder. Call
    /// [`Self::estimate`] first. With `resume`, the folder may hold the same campaign, which is
    /// written anew.
    ///
    /// # Errors
    /// [`MergeError`] if the folder cannot be written, or is not new.
    pub fn write(&self, out: &Path, command: Vec<String>, resume: bool) -> Result<RareFolder, MergeError> {
        let campaign = Manifest { command, ..self.manifest.campaign.clone() };
        let folder = RareFolder::lock(out, &RareManifest { campaign, ..self.manifest.clone() }, resume)?;
        folder.write_journal(&self.records)?;
        Ok(folder)
    }

    /// Returns the plan of the manifest.
    fn plan(&self) -> Result<RarePlan, MergeError> {
        let RareManifest { method, event, guide, relative_width, budget, .. } = &self.manifest;
        let fail = |message: String| FolderError::Content { path: self.folder.join(MANIFEST), line: 1, message };
        let event = event.parse::<EventExpression>().map_err(|error| fail(format!("event: {error}")))?;
        let guide = guide.as_ref().map(|name| name.parse::<Guide>()).transpose();
        let guide = guide.map_err(|error| fail(format!("guide: {error}")))?;
        let nearness = Nearness::new(event, guide).map_err(|error| fail(error.to_string()))?;
        let goal = Goal { relative_width: *relative_width, budget: *budget, value: nearness.value() };
        Ok(RarePlan { method: *method, nearness, goal, workers: Workers::default(), remote: None, part: None })
    }
}

/// Returns the runs of all folders, each once, scenario by scenario, in the order of their numbers.
fn united<'a>(manifest: &RareManifest, folders: impl Iterator<Item = &'a Path>) -> Result<Vec<RareRecord>, MergeError> {
    let mut runs: BTreeMap<(usize, u64), (RareRecord, &Path)> = BTreeMap::new();
    for path in folders {
        for record in read_records(path)? {
            let index = manifest.campaign.scenarios.iter().position(|scenario| scenario.name == record.scenario);
            let Some(index) = index else {
                let (path, sample, scenario) = (path.to_owned(), record.run, record.scenario);
                return Err(MergeError::OutOfOrder { path, sample, scenario });
            };
            match runs.get(&(index, record.run)) {
                None => drop(runs.insert((index, record.run), (record, path))),
                Some((other, _)) if *other == record => {}
                Some((_, first)) => {
                    let (first, second) = ((*first).to_owned(), path.to_owned());
                    return Err(MergeError::OtherRun { first, second, scenario: record.scenario, run: record.run });
                }
            }
        }
    }
    let mut next = (0, 0);
    for ((index, run), (record, _)) in &runs {
        if *index != next.0 {
            next = (*index, 0);
        }
        if *run != next.1 {
            return Err(RareError::MissingRun { scenario: record.scenario.clone(), run: next.1 }.into());
        }
        next.1 += 1;
    }
    Ok(runs.into_values().map(|(record, _)| record).collect())
}
