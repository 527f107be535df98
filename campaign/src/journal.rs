//! The journal of a campaign: a file to which the record of each sample is appended as one line, in
//! the order of the plan.
//!
//! ```text
//!  5f1c09a2b7d34e68 {"scenario":"low-thw-overtake","sample":0,"arms":[…]}
//!  └ checksum of the record          └ the record, as JSON
//! ```
//!
//! Each line is handed to the operating system in one write. A program that is killed therefore
//! leaves at most the last line incomplete. Once a second the journal is synchronised to the disk,
//! so that a machine that fails loses about one second of results. The checksum reveals an
//! incomplete or damaged line. The samples of such lines run again, and the same samples give the
//! same lines.

use std::collections::{HashMap, HashSet};
use std::fs::{File, OpenOptions};
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use closecall_traffic::atomic::WriteError;
use closecall_traffic::input;

use super::record::Record;

/// Longest time between two synchronisations to the disk, while records arrive.
const SYNC_EVERY: Duration = Duration::from_secs(1);
/// Length of a line's checksum (hexadecimal digits): the first 64 bits of the BLAKE3 hash.
const CHECKSUM_DIGITS: usize = 16;

/// Longest line that is a record (bytes). An assumption: 50 times the line of three arms with
/// 10,000 parameters each.
const MOST_LINE_BYTES: u64 = 64 << 20;

/// Opens a file for appending, and cuts it to its first `keep` bytes. Creates it if there is none.
pub(crate) fn open_for_appending(path: &Path, keep: u64) -> Result<File, WriteError> {
    let fail = |source| WriteError::new(path, source);
    let mut options = OpenOptions::new();
    options.create(true).write(true).truncate(false);
    let mut file = input::open_in_folder(path, &mut options).map_err(fail)?;
    file.set_len(keep).map_err(fail)?;
    file.seek(SeekFrom::End(0)).map_err(fail)?;
    Ok(file)
}

/// A journal that is open for appending.
#[derive(Debug)]
pub struct Journal {
    file: File,
    path: PathBuf,
    synced: Instant,
}

impl Journal {
    /// Opens a journal for appending, and cuts it to its first `keep` bytes. Creates the file if
    /// there is none.
    ///
    /// # Errors
    /// [`WriteError`] if the file cannot be created or cut.
    pub fn open(path: &Path, keep: u64) -> Result<Self, WriteError> {
        let file = open_for_appending(path, keep)?;
        Ok(Self { file, path: path.to_owned(), synced: Instant::now() })
    }

    /// Appends one record.
    ///
    /// # Errors
    /// [`WriteError`] if the line cannot be written completely. The file may then end with a part
    /// of the line, which [`read`] recognises.
    pub fn append(&mut self, record: &Record) -> Result<(), WriteError> {
        let line = line(record).map_err(|source| WriteError::new(&self.path, source))?;
        write_line(&mut self.file, &line).map_err(|source| WriteError::new(&self.path, source))?;
        if self.synced.elapsed() >= SYNC_EVERY { self.sync() } else { Ok(()) }
    }

    /// Synchronises the appended records to the disk.
    ///
    /// # Errors
    /// [`WriteError`] if the operating system reports a failure.
    pub fn sync(&mut self) -> Result<(), WriteError> {
        self.synced = Instant::now();
        self.file.sync_data().map_err(|source| WriteError::new(&self.path, source))
    }
}

#[cfg(test)]
thread_local! {
    /// The bytes that still fit on the disk of a simulated world; `None` without a limit.
    pub(crate) static FREE_BYTES: std::cell::Cell<Option<usize>> = const { std::cell::Cell::new(None) };
}

fn write_line(file: &mut File, line: &[u8]) -> io::Result<()> {
    #[cfg(test)]
    if let Some(free) = FREE_BYTES.get() {
        let fits = free.min(line.len());
        FREE_BYTES.set(Some(free - fits));
        if fits < line.len() {
            file.write_all(&line[..fits])?;
            return Err(io::ErrorKind::StorageFull.into());
        }
    }
    file.write_all(line)
}

/// Returns the line of a record: its checksum, and the record as JSON.
pub(crate) fn line<T: serde::Serialize>(record: &T) -> io::Result<Vec<u8>> {
    let mut line = vec![b'0'; CHECKSUM_DIGITS];
    line.push(b' ');
    serde_json::to_writer(&mut line, record)?;
    let sum = checksum(&line[CHECKSUM_DIGITS + 1..]);
    line[..CHECKSUM_DIGITS].copy_from_slice(sum.as_bytes());
    line.push(b'\n');
    Ok(line)
}

fn checksum(record: &[u8]) -> String {
    blake3::hash(record).to_hex()[..CHECKSUM_DIGITS].to_owned()
}

/// One line of a journal.
#[derive(Debug)]
pub enum Entry {
    /// An intact line.
    Record {
        /// The record.
        record: Box<Record>,
        /// Offset of the end of the line in the file (bytes).
        end: u64,
    },
    /// An incomplete or damaged line. The rest of the file is not read.
    Torn {
        /// The line, counted from 1.
        line: usize,
        /// What is wrong with it.
        reason: String,
        /// True if the line is the last one and lacks its end, as a killed program leaves it.
        is_tail: bool,
    },
}

/// Returns the entries of a journal in their order. The first torn entry is the last one returned.
///
/// # Errors
/// The error of the operating system if the file cannot be opened. An item of the iterator is an
/// error if the file cannot be read further.
pub fn read(path: &Path) -> io::Result<Entries> {
    let file = input::open_in_folder(path, OpenOptions::new().read(true))?;
    Ok(Entries { reader: BufReader::new(file), end: 0, line: 0, is_over: false, buffer: Vec::new() })
}

/// An iterator over the entries of a journal: see [`read`].
#[derive(Debug)]
pub struct Entries {
    reader: BufReader<File>,
    end: u64,
    line: usize,
    is_over: bool,
    buffer: Vec<u8>,
}

impl Iterator for Entries {
    type Item = io::Result<Entry>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.is_over {
            return None;
        }
        self.buffer.clear();
        match read_line(&mut self.reader, &mut self.buffer) {
            Ok(0) => None,
            Ok(length) => {
                self.line += 1;
                self.end += length;
                Some(match parse(&self.buffer) {
                    Ok(record) => Ok(Entry::Record { record: Box::new(record), end: self.end }),
                    Err(reason) => self.torn(reason),
                })
            }
            Err(error) => {
                self.is_over = true;
                Some(Err(error))
            }
        }
    }
}

impl Entries {
    fn torn(&mut self, reason: String) -> io::Result<Entry> {
        self.is_over = true;
        let is_unfinished = self.buffer.last() != Some(&b'\n');
        let is_last = self.reader.by_ref().bytes().next().transpose()?.is_none();
        Ok(Entry::Torn { line: self.line, reason, is_tail: is_unfinished && is_last })
    }
}

/// Returns the numbers of the lines to remove, counted from 1, so that each line is in the journal
/// once. Of equal lines, the first one that precedes the line behind it in the order of the plan
/// stays. `order` returns the place of a record in the plan, or `None` for a record of another
/// campaign.
///
/// # Errors
/// The error of the operating system if the file cannot be read.
pub(crate) fn copies<K: Ord + Copy>(path: &Path, order: impl Fn(&Record) -> Option<K>) -> io::Result<HashSet<usize>> {
    let open = || -> io::Result<_> { Ok(BufReader::new(input::open_in_folder(path, OpenOptions::new().read(true))?)) };
    let (mut counts, mut line) = (HashMap::<[u8; CHECKSUM_DIGITS], u32>::new(), Vec::new());
    let mut reader = open()?;
    while read_line(&mut reader, &mut line)? > 0 {
        if let Some(sum) = line.first_chunk() {
            *counts.entry(*sum).or_default() += 1;
        }
    }
    let mut copies = HashSet::new();
    if counts.values().all(|count| *count == 1) {
        return Ok(copies);
    }
    let (mut lines, mut reader) = (Vec::new(), open()?);
    for number in 1.. {
        if read_line(&mut reader, &mut line)? == 0 {
            break;
        }
        if let (Some(sum), Ok(record)) = (line.first_chunk::<CHECKSUM_DIGITS>().copied(), parse::<Record>(&line))
            && let Some(place) = order(&record)
        {
            lines.push(IntactLine { number, sum, place });
        }
    }
    // Equal lines directly behind each other form a group, and at most one line of it stays.
    let groups: Vec<_> = lines.chunk_by(|line, next| line.sum == next.sum).collect();
    let mut kept = HashSet::new();
    for (index, group) in groups.iter().enumerate() {
        let IntactLine { sum, place, .. } = group[0];
        let is_single = counts.get(&sum) == Some(&1);
        let is_in_order = groups.get(index + 1).is_none_or(|next| next[0].place > place);
        let stays = is_single || (is_in_order && kept.insert(sum));
        copies.extend(group.iter().skip(usize::from(stays)).map(|line| line.number));
    }
    Ok(copies)
}

/// A line of a journal that holds a record.
#[derive(Clone, Copy)]
struct IntactLine<K> {
    /// The number of the line, counted from 1.
    number: usize,
    /// The checksum.
    sum: [u8; CHECKSUM_DIGITS],
    /// The place of the record in the plan.
    place: K,
}

/// Reads a line, and returns its length (bytes): 0 at the end of the file. A damaged disk may leave
/// a line that is too long. Only its first [`MOST_LINE_BYTES`] are kept.
pub(crate) fn read_line(reader: &mut impl BufRead, line: &mut Vec<u8>) -> io::Result<u64> {
    line.clear();
    let mut length = reader.by_ref().take(MOST_LINE_BYTES).read_until(b'\n', line)? as u64;
    if length == MOST_LINE_BYTES && line.last() != Some(&b'\n') {
        length += reader.skip_until(b'\n')? as u64;
    }
    Ok(length)
}

/// Returns the line of a sample, counted from 1, with its record or what is wrong with it. The other
/// lines are not checked, which would take seconds in a journal of 100,000 samples.
pub(crate) fn find(path: &Path, scenario: &str, sample: u64) -> io::Result<Option<(usize, Result<Record, String>)>> {
    let start = format!("{{\"scenario\":{},\"sample\":{sample},", serde_json::Value::from(scenario));
    let mut reader = BufReader::new(input::open_in_folder(path, OpenOptions::new().read(true))?);
    let mut line = Vec::new();
    for number in 1.. {
        if read_line(&mut reader, &mut line)? == 0 {
            break;
        }
        if line.get(CHECKSUM_DIGITS + 1..).is_some_and(|record| record.starts_with(start.as_bytes())) {
            return Ok(Some((number, parse(&line))));
        }
    }
    Ok(None)
}

/// Returns the record of a line, or what is wrong with the line.
pub(crate) fn parse<T: serde::de::DeserializeOwned>(line: &[u8]) -> Result<T, String> {
    let Some(line) = line.strip_suffix(b"\n") else { return Err("the line is incomplete".to_owned()) };
    let (Some(sum), Some(b' '), Some(record)) =
        (line.get(..CHECKSUM_DIGITS), line.get(CHECKSUM_DIGITS), line.get(CHECKSUM_DIGITS + 1..))
    else {
        return Err("the line has no checksum".to_owned());
    };
    if checksum(record).as_bytes() != sum {
        return Err("the line does not agree with its checksum".to_owned());
    }
    serde_json::from_slice(record).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::super::record::{ArmRecord, SampleFailure};
    use super::*;

    fn record(sample: u64) -> Record {
        let failure = SampleFailure { kind: "panic".to_owned(), message: "a \"quoted\"\nline".to_owned() };
        let arm = ArmRecord::new("mis".to_owned(), Err(failure));
        Record { scenario: "s".to_owned(), sample, arms: vec![arm] }
    }

    fn written(path: &Path) -> Vec<u8> {
        let mut journal = Journal::open(path, 0).unwrap();
        (0..3).for_each(|sample| journal.append(&record(sample)).unwrap());
        journal.sync().unwrap();
        std::fs::read(path).unwrap()
    }

    fn samples(path: &Path) -> (Vec<u64>, Option<bool>, u64) {
        let (mut samples, mut tail, mut kept) = (Vec::new(), None, 0);
        for entry in read(path).unwrap() {
            match entry.unwrap() {
                Entry::Record { record, end } => {
                    samples.push(record.sample);
                    kept = end;
                }
                Entry::Torn { is_tail, .. } => tail = Some(is_tail),
            }
        }
        (samples, tail, kept)
    }

    #[test]
    fn a_journal_cut_at_any_byte_keeps_its_complete_lines_and_is_continued_to_the_same_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        let whole = written(&path);
        let ends: Vec<usize> = (0..whole.len()).filter(|&index| whole[index] == b'\n').map(|index| index + 1).collect();
        for cut in 0..=whole.len() {
            std::fs::write(&path, &whole[..cut]).unwrap();
            let complete = ends.iter().filter(|&&end| end <= cut).count();
            let (numbers, tail, kept) = samples(&path);
            assert_eq!(numbers, (0..complete as u64).collect::<Vec<_>>(), "cut at {cut}");
            assert_eq!(tail, (complete == 0 && cut > 0 || complete > 0 && cut > ends[complete - 1]).then_some(true));
            let mut journal = Journal::open(&path, kept).unwrap();
            (complete as u64..3).for_each(|sample| journal.append(&record(sample)).unwrap());
            assert!(std::fs::read(&path).unwrap() == whole, "cut at {cut}");
        }
    }

    #[test]
    fn a_sample_is_found_by_its_line_and_a_damaged_line_of_it_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        let quoted = |sample: u64| Record { scenario: "a \"quoted\" name".to_owned(), ..record(sample) };
        let mut journal = Journal::open(&path, 0).unwrap();
        [quoted(1), record(12), record(1), quoted(2)].iter().for_each(|record| journal.append(record).unwrap());
        journal.sync().unwrap();
        let found = |scenario: &str, sample| find(&path, scenario, sample).unwrap();
        let (line, one) = found("s", 1).unwrap();
        assert_eq!((line, one.unwrap().scenario), (3, "s".to_owned()));
        assert_eq!(found("a \"quoted\" name", 2).unwrap().1.unwrap().sample, 2);
        assert!(found("s", 2).is_none() && found("t", 1).is_none());
        let damaged =
            std::fs::read_to_string(&path).unwrap().replace("\"sample\":12,\"arms\"", "\"sample\":12,\"arm_\"");
        std::fs::write(&path, damaged).unwrap();
        assert!(found("s", 12).unwrap().1.unwrap_err().contains("checksum"));
        assert!(found("s", 1).unwrap().1.is_ok());
    }

    #[test]
    fn of_a_line_that_is_there_more_than_once_the_copy_in_order_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        let copies_of = |samples: &[u64]| {
            let lines: Vec<u8> = samples.iter().flat_map(|&sample| line(&record(sample)).unwrap()).collect();
            std::fs::write(&path, lines).unwrap();
            let mut numbers: Vec<usize> = copies(&path, |record| Some(record.sample)).unwrap().into_iter().collect();
            numbers.sort_unstable();
            numbers
        };
        assert_eq!(copies_of(&[0, 1, 2]), [0_usize; 0]);
        // Another sample in the wrong place is no copy.
        assert_eq!(copies_of(&[0, 2, 1]), [0_usize; 0]);
        for (samples, expected) in [
            (&[0, 1, 1, 1, 2][..], &[3, 4][..]),
            (&[0, 1, 2, 3, 1], &[5]),
            (&[0, 3, 3, 1, 2, 3], &[2, 3]),
            (&[0, 1, 2, 0, 1, 2], &[3, 4, 5]),
        ] {
            assert_eq!(copies_of(samples), expected, "{samples:?}");
        }
    }

    #[test]
    fn a_single_changed_byte_is_detected() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        let whole = written(&path);
        let second = whole.iter().position(|&byte| byte == b'\n').unwrap() + 1;
        for index in 0..whole.len() {
            let mut changed = whole.clone();
            changed[index] ^= 1;
            std::fs::write(&path, &changed).unwrap();
            let (numbers, tail, _) = samples(&path);
            assert!(numbers.len() < 3 && tail.is_some(), "byte {index}");
            assert_eq!(numbers.is_empty(), index < second, "byte {index}");
        }
    }

    #[test]
    fn a_full_disk_is_an_error_that_names_the_file() {
        let full = Path::new("/dev/full");
        if !full.exists() {
            return;
        }
        let file = OpenOptions::new().write(true).open(full).unwrap();
        let mut journal = Journal { file, path: full.to_owned(), synced: Instant::now() };
        let error = journal.append(&record(0)).unwrap_err();
        assert!(error.to_string().contains("/dev/full"), "{error}");
    }
}
