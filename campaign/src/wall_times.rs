//! The wall time of each sample: a file beside the journal, with one line of JSON per sample, in
//! the same order.
//!
//! Wall times differ from run to run. They therefore have a file of their own, apart from those
//! that are reproducible. No result depends on them, so their lines are buffered: a program that is
//! killed may lose the last ones.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{self, BufRead, BufReader, BufWriter, Read as _, Seek, SeekFrom, Write};
use std::ops::AddAssign;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use closecall_traffic::atomic::{WriteError, write_file};
use closecall_traffic::input;

use super::workers::Finished;

/// Longest line (bytes). An assumption: 100 times the line of 100 arms.
const MOST_LINE_BYTES: u64 = 1 << 20;

/// The wall time of one sample.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WallTime {
    /// Index of the sample's record in the journal, counted from 0. The file calls it `place`.
    #[serde(rename = "place")]
    pub index: u64,
    /// The scenario's name.
    pub scenario: String,
    /// The sample's number.
    pub sample: u64,
    /// Wall time of each arm (s).
    pub wall_s: Vec<f64>,
}

/// A file of wall times that is open for appending.
#[derive(Debug)]
pub struct WallTimes {
    file: BufWriter<File>,
    path: PathBuf,
}

impl WallTimes {
    /// Opens the file for appending, and cuts it to the samples before `index` in the journal.
    /// Creates the file if there is none.
    ///
    /// # Errors
    /// [`WriteError`] if the file cannot be created or cut.
    pub fn open(path: &Path, index: u64) -> Result<Self, WriteError> {
        let fail = |source| WriteError::new(path, source);
        let mut options = OpenOptions::new();
        options.create(true).read(true).write(true).truncate(false);
        let mut file = input::open_in_folder(path, &mut options).map_err(fail)?;
        let mut keep = 0;
        for (time, end) in lines(BufReader::new(&file)) {
            if time.index >= index {
                break;
            }
            keep = end;
        }
        file.set_len(keep).map_err(fail)?;
        file.seek(SeekFrom::End(0)).map_err(fail)?;
        Ok(Self { file: BufWriter::new(file), path: path.to_owned() })
    }

    /// Appends the wall time of one sample.
    ///
    /// # Errors
    /// [`WriteError`] if the line cannot be written.
    pub fn append(&mut self, time: &WallTime) -> Result<(), WriteError> {
        let written = serde_json::to_writer(&mut self.file, time).map_err(io::Error::from);
        written.and_then(|()| self.file.write_all(b"\n")).map_err(|source| WriteError::new(&self.path, source))
    }

    /// Hands all buffered lines to the operating system.
    ///
    /// # Errors
    /// [`WriteError`] if they cannot be written.
    pub fn flush(&mut self) -> Result<(), WriteError> {
        self.file.flush().map_err(|source| WriteError::new(&self.path, source))
    }
}

/// Replaces the wall times of samples that were run again. The other lines stay as they are.
///
/// # Errors
/// [`WriteError`] if the file cannot be read or written.
pub(super) fn replace<'a>(path: &Path, run_again: impl Iterator<Item = &'a Finished>) -> Result<(), WriteError> {
    let new: BTreeMap<(&str, u64), &[f64]> = run_again
        .map(|finished| ((finished.record.scenario.as_str(), finished.record.sample), finished.wall_s.as_slice()))
        .collect();
    if !path.try_exists().map_err(|source| WriteError::new(path, source))? {
        return Ok(());
    }
    let times: Vec<WallTime> = read(path).map_err(|source| WriteError::new(path, source))?.collect();
    write_file(path, |file| {
        for mut time in times {
            if let Some(wall_s) = new.get(&(time.scenario.as_str(), time.sample)) {
                time.wall_s = wall_s.to_vec();
            }
            serde_json::to_writer(&mut *file, &time)?;
            file.write_all(b"\n")?;
        }
        Ok(())
    })
}

/// Returns the wall times of a file, up to the first line that cannot be parsed.
///
/// # Errors
/// The error of the operating system if the file cannot be opened.
pub fn read(path: &Path) -> io::Result<impl Iterator<Item = WallTime> + use<>> {
    let file = input::open_in_folder(path, OpenOptions::new().read(true))?;
    Ok(lines(BufReader::new(file)).map(|(time, _)| time))
}

/// Returns the content of each complete line, and the offset of its end (bytes).
fn lines(mut reader: impl BufRead) -> impl Iterator<Item = (WallTime, u64)> {
    let (mut end, mut line) = (0, Vec::new());
    std::iter::from_fn(move || {
        line.clear();
        end += reader.by_ref().take(MOST_LINE_BYTES).read_until(b'\n', &mut line).ok()? as u64;
        let whole = line.strip_suffix(b"\n")?;
        Some((serde_json::from_slice(whole).ok()?, end))
    })
}

/// The wall times of samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SpentTime {
    /// Wall time of the runs (s).
    pub runs_s: f64,
    /// Wall time of the validity checks (s).
    pub checks_s: f64,
}

impl AddAssign for SpentTime {
    fn add_assign(&mut self, other: Self) {
        self.runs_s += other.runs_s;
        self.checks_s += other.checks_s;
    }
}

impl SpentTime {
    /// Returns what share of the time the validity checks have taken, in brackets; nothing if there
    /// were none.
    pub fn check_share(self) -> String {
        let Self { runs_s, checks_s } = self;
        let share = 100.0 * checks_s / (runs_s + checks_s);
        if checks_s > 0.0 { format!(" ({share:.0} % of their time for validity checks)") } else { String::new() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wall_times_without_a_record_and_torn_lines_are_cut_off() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("wall-times.jsonl");
        let time = |index| WallTime { index, scenario: "s".to_owned(), sample: 10 * index, wall_s: vec![0.5, 0.25] };
        let mut times = WallTimes::open(&path, 0).unwrap();
        (0..4).for_each(|index| times.append(&time(index)).unwrap());
        times.flush().unwrap();
        drop(times);
        let text = std::fs::read(&path).unwrap();
        std::fs::write(&path, &text[..text.len() - 3]).unwrap();
        assert_eq!(read(&path).unwrap().collect::<Vec<_>>(), [time(0), time(1), time(2)]);
        drop(WallTimes::open(&path, 2).unwrap());
        assert_eq!(read(&path).unwrap().collect::<Vec<_>>(), [time(0), time(1)]);
    }
}
