//! The journal: the results of a campaign on disk as they come, one line for each sample, in the order of the plan.
//!
//! ```text
//!  5f1c09a2b7d34e68 {"scenario":"low-thw-overtake","sample":0,"arms":[…]}
//!  └ checksum of the record          └ the record, as JSON
//! ```
//!
//! Each line is handed to the operating system in one piece as soon as its sample's turn has come, so that a program
//! that is killed loses no line that it had begun to write, but the last at most. The disk is asked to keep what it
//! was handed once a second, so that a machine that fails loses a second. Whatever is lost is recognised by its
//! checksum, cut off, and run again: the same samples give the same lines.

use std::fs::{File, OpenOptions};
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::record::Record;
use closecall_scenarios::atomic::WriteError;

/// Longest time between two requests to the disk to keep what it was handed.
const SYNC_EVERY: Duration = Duration::from_secs(1);
/// Hexadecimal digits of a line's checksum: the first 64 bits of BLAKE3.
const CHECKSUM_DIGITS: usize = 16;

/// A journal that is being written.
#[derive(Debug)]
pub struct Journal {
    file: File,
    path: PathBuf,
    synced: Instant,
}

impl Journal {
    /// Opens a journal to append to, cut to its first `keep` bytes.
    ///
    /// # Errors
    /// [`WriteError`] where it cannot be made or cut.
    pub fn open(path: &Path, keep: u64) -> Result<Self, WriteError> {
        let fail = |source| WriteError::new(path, source);
        let options = OpenOptions::new().create(true).write(true).truncate(false).open(path);
        let mut file = options.map_err(fail)?;
        file.set_len(keep).map_err(fail)?;
        file.seek(SeekFrom::End(0)).map_err(fail)?;
        Ok(Self { file, path: path.to_owned(), synced: Instant::now() })
    }

    /// Appends one record.
    ///
    /// # Errors
    /// [`WriteError`] where the disk does not take it. A part of the line may then stand at the end, which
    /// [`read`] recognises.
    pub fn append(&mut self, record: &Record) -> Result<(), WriteError> {
        let line = line(record).map_err(|source| WriteError::new(&self.path, source))?;
        self.file.write_all(&line).map_err(|source| WriteError::new(&self.path, source))?;
        if self.synced.elapsed() >= SYNC_EVERY { self.sync() } else { Ok(()) }
    }

    /// Has the disk keep what was appended.
    ///
    /// # Errors
    /// [`WriteError`] where it does not.
    pub fn sync(&mut self) -> Result<(), WriteError> {
        self.synced = Instant::now();
        self.file.sync_data().map_err(|source| WriteError::new(&self.path, source))
    }
}

fn line(record: &Record) -> io::Result<Vec<u8>> {
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

/// A line of a journal.
#[derive(Debug)]
pub enum Entry {
    /// A record, and where its line ends in the file [bytes].
    Record {
        /// The record.
        record: Box<Record>,
        /// Bytes of the file up to the end of its line.
        end: u64,
    },
    /// The rest of the file is no journal: its line was not written to its end, or damaged later.
    Torn {
        /// The line, counted from 1.
        line: usize,
        /// What is wrong with it.
        reason: String,
        /// True where nothing but this one unfinished line follows, as a program leaves it that was killed.
        is_tail: bool,
    },
}

/// The entries of a journal, in their order; a torn one is the last.
///
/// # Errors
/// The system's reason where the file cannot be opened, or read on.
pub fn read(path: &Path) -> io::Result<Entries> {
    Ok(Entries { reader: BufReader::new(File::open(path)?), end: 0, line: 0, is_over: false, buffer: Vec::new() })
}

/// The entries of a journal: see [`read`].
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
        match self.reader.read_until(b'\n', &mut self.buffer) {
            Ok(0) => None,
            Ok(read) => {
                self.line += 1;
                self.end += read as u64;
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

fn parse(line: &[u8]) -> Result<Record, String> {
    let Some(line) = line.strip_suffix(b"\n") else { return Err("the line ends before its time".to_owned()) };
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
        let arm = ArmRecord { controller: "mis".to_owned(), result: Err(failure), checks: None };
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
    fn a_journal_cut_at_any_byte_gives_its_whole_lines_and_continues_to_the_same_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        let whole = written(&path);
        let ends: Vec<usize> = (0..whole.len()).filter(|&place| whole[place] == b'\n').map(|place| place + 1).collect();
        for cut in 0..=whole.len() {
            std::fs::write(&path, &whole[..cut]).unwrap();
            let complete = ends.iter().filter(|&&end| end <= cut).count();
            let (found, tail, kept) = samples(&path);
            assert_eq!(found, (0..complete as u64).collect::<Vec<_>>(), "cut at {cut}");
            assert_eq!(tail, (complete == 0 && cut > 0 || complete > 0 && cut > ends[complete - 1]).then_some(true));
            let mut journal = Journal::open(&path, kept).unwrap();
            (complete as u64..3).for_each(|sample| journal.append(&record(sample)).unwrap());
            assert!(std::fs::read(&path).unwrap() == whole, "cut at {cut}");
        }
    }

    #[test]
    fn a_single_changed_byte_is_found() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        let whole = written(&path);
        let second = whole.iter().position(|&byte| byte == b'\n').unwrap() + 1;
        for place in 0..whole.len() {
            let mut changed = whole.clone();
            changed[place] ^= 1;
            std::fs::write(&path, &changed).unwrap();
            let (found, tail, _) = samples(&path);
            assert!(found.len() < 3 && tail.is_some(), "byte {place}");
            assert_eq!(found.is_empty(), place < second, "byte {place}");
        }
    }

    #[test]
    fn a_disk_that_is_full_is_an_error_that_names_the_file() {
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
