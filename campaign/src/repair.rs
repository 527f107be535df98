//! Repairs the journal of a campaign before it is resumed. The samples of damaged lines are run
//! again, and on request the samples that ended in an error. Their new lines replace the old ones,
//! and all other lines are kept. If the campaign has grown, the samples that a scenario lacks
//! before the next one begins are run, too.
//!
//! The journal is replaced in one step. A program that is killed meanwhile leaves the old one.

use std::collections::BTreeMap;
use std::fs::OpenOptions;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::ops::{ControlFlow, Range};
use std::path::Path;

use closecall_traffic::atomic::write_file;
use closecall_traffic::input;

use super::campaign_error::CampaignError;
use super::execution::Campaign;
use super::folder::{FolderError, LockedFolder, TornLine};
use super::journal;
use super::ledger::Inference;
use super::record::{ArmRecord, Record};
use super::wall_times;
use super::workers::Finished;

/// The result of a repair.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Repair {
    /// The damaged lines whose samples were run again.
    pub(super) damaged: Vec<TornLine>,
    /// Number of samples that had ended in an error, and were run again.
    pub(super) retried: u64,
    /// Number of lines that repeated another line, and were removed.
    pub(super) doubled: u64,
    /// Number of samples that were added to a scenario before the next one.
    pub(super) added: u64,
}

/// A sample: the index of its scenario in the campaign, and its number.
type Key = (usize, u64);

/// A part of a journal that is replaced.
#[derive(Debug)]
struct Redo {
    bytes: Range<u64>,
    samples: Vec<Key>,
    /// The record of the only sample, if it is intact and incomplete.
    failed: Option<Box<Record>>,
    /// The damaged lines; empty if the part is an intact record of an error, or a repeated line.
    damaged: Vec<TornLine>,
}

/// Repairs the journal of a folder. If the campaign is stopped meanwhile, parts that are not
/// complete stay as they are.
pub(super) fn repair(campaign: &Campaign, folder: &LockedFolder) -> Result<Repair, CampaignError> {
    let path = folder.journal_path();
    let read_error = |source| FolderError::Read { path: path.clone(), source };
    if !path.try_exists().map_err(read_error)? {
        return Ok(Repair::default());
    }
    let redos = scan(campaign, &path).map_err(read_error)?;
    if redos.is_empty() {
        return Ok(Repair::default());
    }
    let results = run_again(campaign, &redos)?;
    let is_complete = |redo: &&Redo| redo.samples.iter().all(|key| results.contains_key(key));
    let complete: Vec<&Redo> = redos.iter().filter(is_complete).collect();
    let mut old = input::open_in_folder(&path, OpenOptions::new().read(true)).map_err(read_error)?;
    write_file(&path, |new| {
        let mut copied = 0;
        for redo in &complete {
            io::copy(&mut Read::by_ref(&mut old).take(redo.bytes.start - copied), new)?;
            for finished in redo.samples.iter().filter_map(|key| results.get(key)) {
                new.write_all(&journal::line(&finished.record)?)?;
            }
            copied = redo.bytes.end;
            old.seek(SeekFrom::Start(copied))?;
        }
        io::copy(&mut old, new).map(drop)
    })?;
    wall_times::replace(&folder.wall_times_path(), results.values())?;
    let of_error = complete.iter().filter(|redo| redo.damaged.is_empty() && !redo.bytes.is_empty());
    let of_growth = complete.iter().filter(|redo| redo.bytes.is_empty());
    Ok(Repair {
        retried: of_error.map(|redo| redo.samples.len() as u64).sum(),
        doubled: complete.iter().filter(|redo| redo.samples.is_empty() && redo.damaged.is_empty()).count() as u64,
        added: of_growth.map(|redo| redo.samples.len() as u64).sum(),
        damaged: complete.iter().flat_map(|redo| redo.damaged.clone()).collect(),
    })
}

/// Returns the parts of the journal that are to be replaced, in their order. Damaged lines behind
/// the last intact one are left out: they are cut off when the journal is opened.
fn scan(campaign: &Campaign, path: &Path) -> io::Result<Vec<Redo>> {
    let copies = journal::copies(path, |record| key_of(campaign, record))?;
    let mut reader = BufReader::new(input::open_in_folder(path, OpenOptions::new().read(true))?);
    let (mut redos, mut damaged, mut buffer) = (Vec::new(), Vec::new(), Vec::new());
    let (mut last, mut end, mut damaged_from) = (None, 0, 0);
    for number in 1.. {
        let read = journal::read_line(&mut reader, &mut buffer)?;
        if read == 0 {
            break;
        }
        let start = end;
        end += read;
        if copies.contains(&number) {
            // Between damaged lines, a copy is replaced with them.
            if damaged.is_empty() {
                redos.push(Redo { bytes: start..end, samples: Vec::new(), failed: None, damaged: Vec::new() });
            }
            continue;
        }
        let record: Box<Record> = match journal::parse(&buffer) {
            Ok(record) => record,
            Err(reason) => {
                if damaged.is_empty() {
                    damaged_from = start;
                }
                damaged.push(TornLine { line: number, reason });
                continue;
            }
        };
        let Some(key) = key_of(campaign, &record) else { break };
        if !damaged.is_empty() {
            let Some(samples) = between(campaign, last, key) else { break };
            let damaged = std::mem::take(&mut damaged);
            redos.push(Redo { bytes: damaged_from..start, samples, failed: None, damaged });
        } else if let Some(grown) = grown(campaign, last, key) {
            redos.push(Redo { bytes: start..start, samples: grown, failed: None, damaged: Vec::new() });
        }
        if campaign.retry_errors && record.arms.iter().any(ArmRecord::is_incomplete) {
            redos.push(Redo { bytes: start..end, samples: vec![key], failed: Some(record), damaged: Vec::new() });
        }
        last = Some(key);
    }
    Ok(redos)
}

/// Returns the sample of a record, or `None` if the campaign has no such scenario.
pub(super) fn key_of(campaign: &Campaign, record: &Record) -> Option<Key> {
    let work = campaign.works.iter().position(|work| work.file.config().name == record.scenario)?;
    Some((work, record.sample))
}

/// Returns the samples between two others in the order of the plan; from the first sample on if
/// `after` is `None`. Returns `None` if the plan does not determine them, because the outcomes
/// ended a scenario.
fn between(campaign: &Campaign, after: Option<Key>, before: Key) -> Option<Vec<Key>> {
    let first = after.map_or(0, |(work, _)| work);
    if first != before.0 && campaign.inference == Inference::Sequential {
        return None;
    }
    let mut keys = Vec::new();
    for (index, work) in campaign.works.iter().enumerate().take(before.0 + 1).skip(first) {
        let samples = work.samples(campaign.partition).map(|sample| (index, sample));
        let rest = samples.skip_while(|key| after.is_some_and(|after| *key <= after));
        keys.extend(rest.take_while(|key| *key < before));
    }
    Some(keys)
}

/// Returns the last samples of a scenario that are missing before the first one of the next
/// scenario; `None` if there are none.
fn grown(campaign: &Campaign, after: Option<Key>, before: Key) -> Option<Vec<Key>> {
    let last = after?;
    let samples = between(campaign, after, before).filter(|samples| !samples.is_empty())?;
    let is_of_last = |key: &Key| key.0 == last.0;
    (last.0 < before.0 && samples.iter().all(is_of_last)).then_some(samples)
}

/// Runs the samples of all parts again. A sample that had ended in an error keeps a note of it.
fn run_again(campaign: &Campaign, redos: &[Redo]) -> Result<BTreeMap<Key, Finished>, CampaignError> {
    let mut results = BTreeMap::new();
    let failed = redos.iter().filter_map(|redo| Some((*redo.samples.first()?, redo.failed.as_deref()?)));
    let failed: BTreeMap<Key, &Record> = failed.collect();
    for (index, work) in campaign.works.iter().enumerate() {
        let keys = redos.iter().flat_map(|redo| &redo.samples).filter(|(work, _)| *work == index);
        let samples: Vec<u64> = keys.map(|(_, sample)| *sample).collect();
        campaign.run_samples(index, work, samples.into_iter(), |mut finished| {
            let key = (index, finished.record.sample);
            failed.get(&key).iter().for_each(|failed| finished.record.follow(failed));
            results.insert(key, finished);
            Ok(ControlFlow::Continue(()))
        })?;
    }
    Ok(results)
}
