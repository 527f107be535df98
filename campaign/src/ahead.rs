//! Samples that run before their turn, and wait for it.
//!
//! ```text
//!  samples that failed earlier ─▶ run first ─▶ ahead.jsonl ─▶ their turn in the plan ─▶ journal
//! ```
//!
//! The journal has the order of the plan, whatever ran first: its bytes depend on no order. So a
//! sample that runs first waits until all samples before it are done. Its result waits in memory
//! and in the file `ahead.jsonl`. A campaign that is killed meanwhile reads the file when it is
//! resumed, and does not run these samples again. A campaign that ends removes the file.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{File, OpenOptions};
use std::io::{self, BufReader, ErrorKind, Write};
use std::path::{Path, PathBuf};

use closecall_traffic::atomic::WriteError;
use closecall_traffic::input;
use serde::{Deserialize, Serialize};

use super::journal;
use super::record::Record;
use super::workers::Finished;

/// Largest number of samples that wait for their turn. An assumption: at 4 kB for each, they take
/// 40 MB of memory.
const MOST_AHEAD: usize = 10_000;

/// A sample of a campaign.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct SampleKey {
    /// Index of its scenario in the campaign.
    pub(crate) work: usize,
    /// The number of the sample.
    pub(crate) sample: u64,
}

/// A sample that has run before its turn.
#[derive(Clone, Debug)]
pub(crate) struct EarlySample {
    pub(crate) finished: Finished,
    /// True if it has just been run, false if it was read from the file.
    pub(crate) is_new: bool,
}

/// The samples of a campaign that have run before their turn, and wait for it.
#[derive(Debug, Default)]
pub struct Ahead {
    samples: BTreeMap<SampleKey, EarlySample>,
    /// True if one of them has ended the campaign.
    pub(crate) is_over: bool,
}

impl Ahead {
    /// Returns the records that still wait for their turn, in the order of the plan.
    pub fn waiting(&self) -> impl Iterator<Item = &Record> {
        self.samples.values().map(|early| &early.finished.record)
    }

    pub(crate) fn insert(&mut self, key: SampleKey, early: EarlySample) {
        self.samples.insert(key, early);
    }

    /// Removes and returns a sample, whose turn it is.
    pub(crate) fn take(&mut self, key: SampleKey) -> Option<EarlySample> {
        self.samples.remove(&key)
    }

    pub(crate) fn contains(&self, key: SampleKey) -> bool {
        self.samples.contains_key(&key)
    }

    /// Returns the waiting samples with their places in the plan, in its order.
    pub(crate) fn entries(&self) -> impl Iterator<Item = (&SampleKey, &EarlySample)> {
        self.samples.iter()
    }

    /// Removes and returns the samples for which `is_taken` holds.
    pub(crate) fn take_all(&mut self, is_taken: impl Fn(&Record) -> bool) -> BTreeMap<SampleKey, Record> {
        let taken = self.samples.extract_if(.., |_, early| is_taken(&early.finished.record));
        taken.map(|(key, early)| (key, early.finished.record)).collect()
    }

    /// Returns the numbers of the waiting samples of a scenario, which is given by its index.
    pub(crate) fn numbers(&self, work: usize) -> BTreeSet<u64> {
        self.samples.keys().filter(|key| key.work == work).map(|key| key.sample).collect()
    }

    /// Returns how many more samples may wait.
    pub(crate) fn room(&self) -> usize {
        MOST_AHEAD.saturating_sub(self.samples.len())
    }
}

/// A line of the file.
#[derive(Serialize, Deserialize)]
struct Line {
    record: Record,
    /// Wall time of each arm (s).
    wall_s: Vec<f64>,
    /// Wall time of the validity checks (s).
    check_s: f64,
}

/// The file of the samples that wait, open for appending.
#[derive(Debug)]
pub(crate) struct AheadFile {
    file: File,
    path: PathBuf,
}

impl AheadFile {
    /// Opens the file for appending, and cuts it to its first `keep` bytes. Creates it if there is
    /// none.
    pub(crate) fn open(path: &Path, keep: u64) -> Result<Self, WriteError> {
        Ok(Self { file: journal::open_for_appending(path, keep)?, path: path.to_owned() })
    }

    /// Appends a sample, with a checksum as in the journal.
    pub(crate) fn append(&mut self, finished: &Finished) -> Result<(), WriteError> {
        let Finished { record, wall_s, check_s } = finished.clone();
        let line = journal::line(&Line { record, wall_s, check_s });
        line.and_then(|line| self.file.write_all(&line)).map_err(|source| WriteError::new(&self.path, source))
    }
}

/// The content of the file.
#[derive(Debug, Default)]
pub(crate) struct Kept {
    /// The samples that wait.
    pub(crate) ahead: Ahead,
    /// Length of the intact lines at the start of the file (bytes).
    pub(crate) bytes: u64,
}

/// Reads the file up to its first line that is damaged, or that `place` refuses: the samples from
/// there on run again. A file that does not exist holds nothing.
pub(crate) fn read(path: &Path, place: impl Fn(&Record) -> Option<SampleKey>) -> io::Result<Kept> {
    let file = match input::open_in_folder(path, OpenOptions::new().read(true)) {
        Ok(file) => file,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Kept::default()),
        Err(error) => return Err(error),
    };
    let (mut kept, mut reader, mut buffer) = (Kept::default(), BufReader::new(file), Vec::new());
    while kept.ahead.room() > 0 {
        let length = journal::read_line(&mut reader, &mut buffer)?;
        let Ok(Line { record, wall_s, check_s }) = journal::parse(&buffer) else { break };
        let Some(key) = place(&record) else { break };
        kept.bytes += length;
        kept.ahead.insert(key, EarlySample { finished: Finished { record, wall_s, check_s }, is_new: false });
    }
    Ok(kept)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::{ArmRecord, SampleFailure};

    fn finished(sample: u64) -> Finished {
        let failure = SampleFailure { kind: "panic".to_owned(), message: "m".to_owned() };
        let arm = ArmRecord::new("mis".to_owned(), Err(failure));
        let record = Record { scenario: "s".to_owned(), sample, arms: vec![arm] };
        Finished { record, wall_s: vec![0.5], check_s: 0.0 }
    }

    fn numbers(path: &Path) -> Vec<u64> {
        let place = |record: &Record| (record.sample < 8).then_some(SampleKey { work: 0, sample: record.sample });
        read(path, place).unwrap().ahead.waiting().map(|record| record.sample).collect()
    }

    #[test]
    fn a_file_cut_at_any_byte_keeps_its_complete_lines_and_goes_on_behind_them() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("ahead.jsonl");
        assert_eq!(numbers(&path), [0_u64; 0], "no file holds nothing");
        let mut file = AheadFile::open(&path, 0).unwrap();
        [7, 3].into_iter().for_each(|sample| file.append(&finished(sample)).unwrap());
        let whole = std::fs::read(&path).unwrap();
        let first = whole.iter().position(|byte| *byte == b'\n').unwrap() + 1;
        for cut in 0..=whole.len() {
            std::fs::write(&path, &whole[..cut]).unwrap();
            let expected: &[u64] = if cut == whole.len() { &[3, 7][..] } else { &[7][..usize::from(cut >= first)] };
            assert_eq!(numbers(&path), expected, "cut at {cut}");
            let kept = read(&path, |record| Some(SampleKey { work: 0, sample: record.sample })).unwrap();
            AheadFile::open(&path, kept.bytes).unwrap().append(&finished(5)).unwrap();
            assert!(numbers(&path).contains(&5), "cut at {cut}");
        }
    }

    #[test]
    fn a_line_of_another_campaign_is_not_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("ahead.jsonl");
        let mut file = AheadFile::open(&path, 0).unwrap();
        [2, 9, 4].into_iter().for_each(|sample| file.append(&finished(sample)).unwrap());
        assert_eq!(numbers(&path), [2], "sample 9 is refused, and what follows it runs again");
    }
}
