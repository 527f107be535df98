//! Reads files of recorded pairs.

use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use closecall_traffic::input;
use flate2::read::MultiGzDecoder;

use super::{FollowingPair, LeftOut, pair_table, platoon};

/// The first two bytes of a gzip stream (RFC 1952).
const GZIP: [u8; 2] = [0x1f, 0x8b];

/// A file of recorded pairs that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum FollowingError {
    /// The file cannot be read.
    #[error("failed to read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The content has no known layout.
    #[error("failed to read {}{}: {message}", path.display(), line.map(|line| format!(":{line}")).unwrap_or_default())]
    Content {
        /// The file.
        path: PathBuf,
        /// The line, counted from 1, if one is at fault.
        line: Option<u64>,
        /// The fault, and the allowed content.
        message: String,
    },
}

/// A file from which pairs were read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FollowingFile {
    /// The path, as given.
    pub path: PathBuf,
    /// BLAKE3 hash of the file.
    pub blake3: String,
}

/// Recorded pairs, and where they come from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FollowingData {
    /// The files.
    pub files: Vec<FollowingFile>,
    /// The pairs that can be used, in the order of the files.
    pub pairs: Vec<FollowingPair>,
    /// The pairs that cannot, with the reasons.
    pub left_out: Vec<LeftOut>,
}

/// An error before the path of the file is known.
pub(super) struct LineError {
    pub(super) line: Option<u64>,
    pub(super) message: String,
}

impl From<csv::Error> for LineError {
    fn from(error: csv::Error) -> Self {
        Self { line: error.position().map(csv::Position::line), message: error.to_string() }
    }
}

/// Pairs of one file, each usable or with the reason why it is not.
pub(super) type Pairs = Vec<Result<FollowingPair, LeftOut>>;

/// Reads recorded pairs from files.
///
/// # Errors
/// [`FollowingError`] if a file cannot be read, has another layout, a column is missing, or a cell
/// is not a number.
pub fn read(paths: &[PathBuf]) -> Result<FollowingData, FollowingError> {
    let mut data = FollowingData::default();
    for path in paths {
        let mut hasher = blake3::Hasher::new();
        let hashed = input::open(path).and_then(|file| hasher.update_reader(file.take(MOST_BYTES)).map(drop));
        hashed.map_err(|source| FollowingError::Read { path: path.clone(), source })?;
        data.files.push(FollowingFile { path: path.clone(), blake3: hasher.finalize().to_string() });
        let pairs = read_one(path).map_err(|error| FollowingError::Content {
            path: path.clone(),
            line: error.line,
            message: error.message,
        })?;
        for pair in pairs {
            match pair {
                Ok(pair) => data.pairs.push(pair),
                Err(reason) => data.left_out.push(reason),
            }
        }
    }
    Ok(data)
}

fn read_one(path: &Path) -> Result<Pairs, LineError> {
    let fail = |error: std::io::Error| LineError { line: None, message: error.to_string() };
    let mut reader = opened(path).map_err(fail)?;
    let mut first = Vec::new();
    reader.read_until(b'\n', &mut first).map_err(fail)?;
    let no_text = |_| LineError { line: Some(1), message: "it is not text (UTF-8)".to_owned() };
    let first = String::from_utf8(first).map_err(no_text)?;
    let rest = Box::new(std::io::Cursor::new(first.clone().into_bytes()).chain(reader));
    if first.starts_with("pair_id,") {
        pair_table::read(rest)
    } else if first.starts_with("Date,") {
        platoon::read(rest)
    } else {
        let shown: String = first.trim_end().chars().take(40).collect();
        let begin = if shown.is_empty() { "an empty line".to_owned() } else { format!("`{shown}`") };
        let message = format!(
            "{begin} begins no known layout: expected `pair_id,…` (a table of pairs) or `Date,…` (a platoon of OpenACC)"
        );
        Err(LineError { line: Some(1), message })
    }
}

fn opened(path: &Path) -> std::io::Result<Box<dyn BufRead>> {
    let mut magic = [0; 2];
    let is_gzip = input::open(path)?.read_exact(&mut magic).is_ok() && magic == GZIP;
    let file = input::open(path)?;
    let source: Box<dyn Read> = if is_gzip { Box::new(MultiGzDecoder::new(file)) } else { Box::new(file) };
    Ok(Box::new(BufReader::new(Bounded { source, read: 0, of_line: 0 })))
}

/// Largest file, decompressed (bytes). An assumption: 50 times the largest file of OpenACC.
const MOST_BYTES: u64 = 512 << 20;
/// Longest line (bytes). An assumption: 1,000 times a row of ten vehicles.
const MOST_LINE_BYTES: u64 = 1 << 20;

/// A source that ends with an error where a file or a line is longer than any that is meant.
struct Bounded<R> {
    source: R,
    /// Number of bytes so far.
    read: u64,
    /// Number of bytes since the last line feed.
    of_line: u64,
}

impl<R: Read> Read for Bounded<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.source.read(buffer)?;
        self.read += count as u64;
        self.of_line = match buffer[..count].iter().rposition(|byte| *byte == b'\n') {
            Some(at) => (count - at - 1) as u64,
            None => self.of_line + count as u64,
        };
        let fail = |subject: &str, most: u64| {
            let message = format!("{subject} is longer than {} MiB, so this is not a file of pairs", most >> 20);
            Err(std::io::Error::new(std::io::ErrorKind::InvalidData, message))
        };
        if self.of_line > MOST_LINE_BYTES {
            fail("a line", MOST_LINE_BYTES)
        } else if self.read > MOST_BYTES {
            fail("the file", MOST_BYTES)
        } else {
            Ok(count)
        }
    }
}

/// Returns the number in a cell, or `None` if the cell is empty.
pub(super) fn number(record: &csv::StringRecord, column: usize, name: &str) -> Result<Option<f64>, LineError> {
    let text = record.get(column).unwrap_or_default().trim();
    if text.is_empty() {
        return Ok(None);
    }
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(Some(number)),
        _ => Err(LineError {
            line: record.position().map(csv::Position::line),
            message: format!("column `{name}`: `{text}` is not a finite number"),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_endless_field_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("pairs.csv");
        let head =
            "pair_id,time_s,follower_front_y_m,follower_speed_mps,leader_front_y_m,leader_length_m,leader_speed_mps\n";
        std::fs::write(&path, format!("{head}{}", "a".repeat(3 << 20))).unwrap();
        assert!(read(std::slice::from_ref(&path)).unwrap_err().to_string().contains("a line is longer than 1 MiB"));
        std::fs::write(&path, "a".repeat(3 << 20)).unwrap();
        assert!(read(&[path]).unwrap_err().to_string().contains("a line is longer than 1 MiB"));
    }

    #[test]
    fn a_file_of_another_layout_or_with_a_word_for_a_number_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let message = |text: &str| {
            let path = folder.path().join("pairs.csv");
            std::fs::write(&path, text).unwrap();
            read(&[path]).unwrap_err().to_string()
        };
        assert!(message("frame,id,x\n1,2,3\n").contains("pairs.csv:1: `frame,id,x` begins no known layout"));
        assert!(message("pair_id,time_s\na,0.0\n").contains("column `follower_front_y_m` is missing"));
        let head =
            "pair_id,time_s,follower_front_y_m,follower_speed_mps,leader_front_y_m,leader_length_m,leader_speed_mps\n";
        assert!(message(&format!("{head}a,0.0,0,5,x,4,5\n")).contains("pairs.csv:2: column `leader_front_y_m`: `x`"));
        assert!(message("Date,1\nVehicle_order,A,B\nNumber,2\n").contains("the platoon has no line `Time,…`"));
        assert!(read(&["nowhere.csv".into()]).unwrap_err().to_string().contains("nowhere.csv"));
    }
}
