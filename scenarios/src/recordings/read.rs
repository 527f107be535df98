//! From a path to a recording.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;

use flate2::bufread::MultiGzDecoder;

use super::assemble::{Assembly, Row};
use super::fields::Fault;
use super::layout::{Format, recognise};
use super::rows::{Fields, Lines};
use super::{Recording, RecordingError, RecordingProblem};

/// The first two bytes of a gzip stream (RFC 1952).
const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];

const BUFFER_BYTES: usize = 1 << 16;

/// Reads the recording in a file of either layout, compressed or not.
///
/// # Errors
/// [`RecordingError`] with file, line, column and what is allowed.
pub fn read(path: &Path) -> Result<Recording, RecordingError> {
    match File::open(path) {
        Ok(file) => read_from(file, path),
        Err(error) => {
            let problem = RecordingProblem::Io(error);
            Err(RecordingError { path: path.to_owned(), line: None, column: None, problem })
        }
    }
}

/// Reads a recording from any source of bytes; `path` stands in errors and gives the name.
///
/// # Errors
/// [`RecordingError`] with line, column and what is allowed.
pub fn read_from(source: impl Read, path: &Path) -> Result<Recording, RecordingError> {
    let mut hashing = BufReader::with_capacity(BUFFER_BYTES, Hashing { source, hasher: blake3::Hasher::new() });
    let content = read_content(&mut hashing).map_err(|Refusal { line, column, problem }| RecordingError {
        path: path.to_owned(),
        line,
        column,
        problem,
    })?;
    let file_name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let stem = file_name.split('.').next().unwrap_or_default().to_owned();
    Ok(Recording {
        name: content.name.unwrap_or(stem),
        hash: hashing.get_ref().hasher.finalize().to_hex().to_string(),
        ..content.recording
    })
}

struct Content {
    name: Option<String>,
    recording: Recording,
}

/// An error before it knows its file.
struct Refusal {
    line: Option<u64>,
    column: Option<String>,
    problem: RecordingProblem,
}

impl Refusal {
    fn new(line: u64, fault: Fault) -> Self {
        Self { line: Some(line), column: fault.column.map(str::to_owned), problem: fault.problem }
    }

    fn of_file(problem: RecordingProblem) -> Self {
        Self { line: None, column: None, problem }
    }
}

fn read_content(source: &mut impl BufRead) -> Result<Content, Refusal> {
    let start = source.fill_buf().map_err(|error| Refusal::of_file(RecordingProblem::Io(error)))?;
    if start.starts_with(&GZIP_MAGIC) {
        read_text(BufReader::with_capacity(BUFFER_BYTES, MultiGzDecoder::new(source)))
    } else {
        read_text(source)
    }
}

fn read_text(source: impl BufRead) -> Result<Content, Refusal> {
    let mut lines = Lines::new(source);
    let at_line = |(line, problem): (u64, RecordingProblem)| Refusal::new(line, problem.into());
    let Some((number, first)) = lines.next().map_err(at_line)? else {
        return Err(Refusal::of_file(RecordingProblem::Empty));
    };
    let format = recognise(first).map_err(|problem| at_line((number, problem)))?;
    let mut rows = Rows { format, fields: Fields::default(), name: None, assembly: Assembly::default(), count: 0 };
    if !rows.format.has_header {
        rows.push(number, first)?;
    }
    while let Some((number, line)) = lines.next().map_err(at_line)? {
        rows.push(number, line)?;
    }
    rows.finish()
}

/// The rows of one file as they come.
struct Rows {
    format: Format,
    fields: Fields,
    name: Option<String>,
    assembly: Assembly,
    count: u64,
}

impl Rows {
    fn push(&mut self, number: u64, line: &str) -> Result<(), Refusal> {
        let row = self.parse(line).map_err(|fault| Refusal::new(number, fault))?;
        self.assembly.push(Row { line: number, ..row });
        self.count += 1;
        Ok(())
    }

    fn parse(&mut self, line: &str) -> Result<Row, Fault> {
        self.fields.split(line, self.format.separator)?;
        let (found, needed) = (self.fields.len(), self.format.width);
        if found != needed {
            return Err(RecordingProblem::ColumnCount { found, needed }.into());
        }
        self.check_name(line)?;
        self.format.columns.parse(line, &self.fields)
    }

    /// One file holds one recording.
    fn check_name(&mut self, line: &str) -> Result<(), Fault> {
        let Some((column, found)) = self.format.columns.recording(line, &self.fields) else { return Ok(()) };
        match &self.name {
            None => self.name = Some(found.to_owned()),
            Some(first) if first == found => {}
            Some(first) => {
                let problem = RecordingProblem::SeveralRecordings { first: first.clone(), found: found.to_owned() };
                return Err(Fault::at(column, problem));
            }
        }
        Ok(())
    }

    fn finish(self) -> Result<Content, Refusal> {
        if self.count == 0 {
            return Err(Refusal::of_file(RecordingProblem::Empty));
        }
        let blame = |(line, problem): (u64, RecordingProblem)| Refusal::new(line, problem.into());
        let (trajectories, period) = self.assembly.finish().map_err(blame)?;
        let recording = Recording {
            layout: self.format.columns.layout(),
            ..Recording::new(self.name.as_deref().unwrap_or_default(), period, trajectories)
        };
        Ok(Content { name: self.name, recording })
    }
}

/// Hashes what is read through it.
struct Hashing<R> {
    source: R,
    hasher: blake3::Hasher,
}

impl<R: Read> Read for Hashing<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.source.read(buffer)?;
        self.hasher.update(&buffer[..count]);
        Ok(count)
    }
}
