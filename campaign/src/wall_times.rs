//! What each sample cost, beside the journal: one line of JSON for each, in the same order.
//!
//! Wall times differ from run to run, so they stand apart from everything that does not. They are for people: they are
//! written in larger pieces, and a program that is killed loses those of its last second.

use std::fs::{File, OpenOptions};
use std::io::{self, BufRead, BufReader, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use closecall_scenarios::atomic::WriteError;

/// What one sample cost.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WallTime {
    /// Its place in the journal, counted from 0.
    pub place: u64,
    /// The scenario's name.
    pub scenario: String,
    /// Number of the sample.
    pub sample: u64,
    /// Wall time of each arm [s].
    pub wall_s: Vec<f64>,
}

/// The wall times of a campaign that is being run.
#[derive(Debug)]
pub struct WallTimes {
    file: BufWriter<File>,
    path: PathBuf,
}

impl WallTimes {
    /// Opens the file to append to, cut to the samples before `place` in the journal.
    ///
    /// # Errors
    /// [`WriteError`] where it cannot be made or cut.
    pub fn open(path: &Path, place: u64) -> Result<Self, WriteError> {
        let fail = |source| WriteError::new(path, source);
        let mut file =
            OpenOptions::new().create(true).read(true).write(true).truncate(false).open(path).map_err(fail)?;
        let mut keep = 0;
        for (time, end) in lines(BufReader::new(&file)) {
            if time.place >= place {
                break;
            }
            keep = end;
        }
        file.set_len(keep).map_err(fail)?;
        file.seek(SeekFrom::End(0)).map_err(fail)?;
        Ok(Self { file: BufWriter::new(file), path: path.to_owned() })
    }

    /// Appends what one sample cost.
    ///
    /// # Errors
    /// [`WriteError`] where the disk does not take it.
    pub fn append(&mut self, time: &WallTime) -> Result<(), WriteError> {
        let written = serde_json::to_writer(&mut self.file, time).map_err(io::Error::from);
        written.and_then(|()| self.file.write_all(b"\n")).map_err(|source| WriteError::new(&self.path, source))
    }

    /// Hands everything to the operating system.
    ///
    /// # Errors
    /// [`WriteError`] where the disk does not take it.
    pub fn flush(&mut self) -> Result<(), WriteError> {
        self.file.flush().map_err(|source| WriteError::new(&self.path, source))
    }
}

/// The wall times that a file holds, up to the first line that is none.
///
/// # Errors
/// The system's reason where it cannot be opened.
pub fn read(path: &Path) -> io::Result<impl Iterator<Item = WallTime> + use<>> {
    Ok(lines(BufReader::new(File::open(path)?)).map(|(time, _)| time))
}

/// Each whole line, and where it ends [bytes].
fn lines(mut reader: impl BufRead) -> impl Iterator<Item = (WallTime, u64)> {
    let (mut end, mut line) = (0, Vec::new());
    std::iter::from_fn(move || {
        line.clear();
        end += reader.read_until(b'\n', &mut line).ok()? as u64;
        let whole = line.strip_suffix(b"\n")?;
        Some((serde_json::from_slice(whole).ok()?, end))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_behind_the_journal_and_torn_lines_are_cut_off() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("wall-times.jsonl");
        let time = |place| WallTime { place, scenario: "s".to_owned(), sample: 10 * place, wall_s: vec![0.5, 0.25] };
        let mut times = WallTimes::open(&path, 0).unwrap();
        (0..4).for_each(|place| times.append(&time(place)).unwrap());
        times.flush().unwrap();
        drop(times);
        let text = std::fs::read(&path).unwrap();
        std::fs::write(&path, &text[..text.len() - 3]).unwrap();
        assert_eq!(read(&path).unwrap().collect::<Vec<_>>(), [time(0), time(1), time(2)]);
        drop(WallTimes::open(&path, 2).unwrap());
        assert_eq!(read(&path).unwrap().collect::<Vec<_>>(), [time(0), time(1)]);
    }
}
