//! From a path to tracks: which reader a file needs.

use std::cell::RefCell;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;
use std::rc::Rc;

use flate2::bufread::MultiGzDecoder;

use super::commonroad::CommonRoadSource;
use super::exid::Survey;
use super::file_set::FileSet;
use super::order::WINDOW_ROWS;
use super::source::{Refusal, RowSource};
use super::text::TextSource;
use super::tracks::{ReadOptions, Tracks};
use super::{Recording, RecordingError, RecordingProblem};

/// The first two bytes of a gzip stream (RFC 1952).
const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];

/// The beginnings of archives and of other compressed files that are not read, and what they are.
const ARCHIVES: [(&[u8], &str); 5] = [
    (b"PK\x03\x04", "a ZIP archive"),
    (b"PK\x05\x06", "an empty ZIP archive"),
    (b"BZh", "a bzip2 file"),
    (b"\xfd7zXZ\0", "an xz file"),
    (b"\x28\xb5\x2f\xfd", "a Zstandard file"),
];

const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

const BUFFER_BYTES: usize = 1 << 16;

/// Opens a recording to take its tracks one by one. Memory is bounded; see [`WINDOW_ROWS`].
///
/// # Errors
/// [`RecordingError`] with file, line, column and what is allowed.
pub fn open(path: &Path, options: ReadOptions) -> Result<Tracks<'static>, RecordingError> {
    open_window(path, options, WINDOW_ROWS)
}

/// Reads a whole recording, rows in any order.
///
/// # Errors
/// [`RecordingError`] with file, line, column and what is allowed.
pub fn read(path: &Path) -> Result<Recording, RecordingError> {
    read_with(path, ReadOptions::default())
}

/// As [`read`], with the layout or the treatment of bad rows chosen.
///
/// # Errors
/// [`RecordingError`] with file, line, column and what is allowed.
pub fn read_with(path: &Path, options: ReadOptions) -> Result<Recording, RecordingError> {
    open_window(path, options, usize::MAX)?.collect_recording()
}

/// Reads a recording that is one file from any source of bytes; `path` stands in errors and gives the name.
///
/// # Errors
/// [`RecordingError`] with line, column and what is allowed.
pub fn read_from(source: impl Read, path: &Path) -> Result<Recording, RecordingError> {
    open_from(source, path, ReadOptions::default(), usize::MAX)?.collect_recording()
}

/// Opens a recording that is one file from any source of bytes; `path` stands in errors and gives the name.
///
/// # Errors
/// [`RecordingError`] with line, column and what is allowed.
pub fn open_from<'a>(
    source: impl Read + 'a,
    path: &Path,
    options: ReadOptions,
    window: usize,
) -> Result<Tracks<'a>, RecordingError> {
    let digest = Digest::default();
    let input = digest.input(source).map_err(|refusal| at(path, refusal))?;
    let source = choose(input, &options).map_err(|refusal| at(path, refusal))?;
    Tracks::new((path, digest), source, options.bad_rows, window)
}

fn open_window(path: &Path, options: ReadOptions, window: usize) -> Result<Tracks<'static>, RecordingError> {
    match FileSet::of(path)? {
        Some(set) => open_set(&set, options, window),
        None => open_from(open_file(path)?, path, options, window),
    }
}

/// Opens one of the recordings that are several files.
fn open_set(set: &FileSet, options: ReadOptions, window: usize) -> Result<Tracks<'static>, RecordingError> {
    let path = set.tracks();
    let digest = Digest::default();
    let in_tracks = |refusal| at(&path, refusal);
    let input = digest.input(open_file(&path)?).map_err(in_tracks)?;
    let source = TextSource::with_meta(input, || set.meta(&digest), || Survey::of(&path));
    let source = source.map_err(|error| error.map_or_else(|other| other, in_tracks))?;
    check_choice(&source, &options).map_err(in_tracks)?;
    Tracks::new((&path, digest), Box::new(source), options.bad_rows, window)
}

/// Refuses another layout than the one asked for.
fn check_choice(source: &dyn RowSource, options: &ReadOptions) -> Result<(), Refusal> {
    let found = source.about().layout;
    match options.layout {
        Some(choice) if !choice.includes(found) => {
            Err(Refusal::of_file(RecordingProblem::OtherLayout { found, asked: choice.name() }))
        }
        _ => Ok(()),
    }
}

pub(super) fn at(path: &Path, Refusal { line, column, problem }: Refusal) -> RecordingError {
    RecordingError { path: path.to_owned(), line, column, problem }
}

pub(super) fn open_file(path: &Path) -> Result<File, RecordingError> {
    File::open(path).map_err(|error| at(path, Refusal::of_file(RecordingProblem::Io(error))))
}

/// The reader for what `input` begins with.
fn choose<'a>(mut input: Box<dyn BufRead + 'a>, options: &ReadOptions) -> Result<Box<dyn RowSource + 'a>, Refusal> {
    let start = input.fill_buf().map_err(|error| Refusal::of_file(super::rows::io_problem(error)))?;
    if let Some((_, what)) = ARCHIVES.into_iter().find(|(magic, _)| start.starts_with(magic)) {
        return Err(Refusal::of_file(RecordingProblem::Archive { what }));
    }
    let text = start.strip_prefix(BYTE_ORDER_MARK).unwrap_or(start).trim_ascii_start();
    let source: Box<dyn RowSource + 'a> = if text.starts_with(b"<") {
        Box::new(CommonRoadSource::new(input)?)
    } else {
        Box::new(TextSource::new(input)?)
    };
    check_choice(source.as_ref(), options)?;
    Ok(source)
}

/// The hash of everything that was read of a recording.
#[derive(Clone, Default)]
pub(super) struct Digest(Rc<RefCell<blake3::Hasher>>);

impl Digest {
    /// `source`, hashed as it is read, and unpacked where it is compressed.
    pub(super) fn input<'a>(&self, source: impl Read + 'a) -> Result<Box<dyn BufRead + 'a>, Refusal> {
        let mut hashed = BufReader::with_capacity(BUFFER_BYTES, Hashed { source, digest: self.clone() });
        let start = hashed.fill_buf().map_err(|error| Refusal::of_file(RecordingProblem::Io(error)))?;
        Ok(if start.starts_with(&GZIP_MAGIC) {
            Box::new(BufReader::with_capacity(BUFFER_BYTES, MultiGzDecoder::new(hashed)))
        } else {
            Box::new(hashed)
        })
    }

    pub(super) fn hex(&self) -> String {
        self.0.borrow().finalize().to_hex().to_string()
    }
}

/// Hashes what is read through it.
struct Hashed<R> {
    source: R,
    digest: Digest,
}

impl<R: Read> Read for Hashed<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.source.read(buffer)?;
        self.digest.0.borrow_mut().update(&buffer[..count]);
        Ok(count)
    }
}
