//! Input files: opening, decompressing and hashing them.

use std::cell::RefCell;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;
use std::rc::Rc;

use closecall_traffic::input;
use flate2::bufread::MultiGzDecoder;

use super::error::{TrajectoryFileError, TrajectoryFileProblem};
use super::source::ReadError;

/// The first two bytes of a gzip stream (RFC 1952).
const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];

/// Size of the read buffers (bytes).
const BUFFER_BYTES: usize = 1 << 16;

/// Attaches the path of the file to an error.
pub(super) fn with_path(path: &Path, ReadError { line, column, problem }: ReadError) -> TrajectoryFileError {
    TrajectoryFileError { path: path.to_owned(), line, column, problem }
}

/// Opens the file at `path`.
pub(super) fn open_file(path: &Path) -> Result<File, TrajectoryFileError> {
    input::open(path).map_err(|error| with_path(path, ReadError::of_file(TrajectoryFileProblem::Io(error))))
}

/// The BLAKE3 hash of all bytes read from the files of a data set.
#[derive(Clone, Default)]
pub(super) struct Digest(Rc<RefCell<blake3::Hasher>>);

impl Digest {
    /// Wraps `source` so that it is hashed while it is read, and decompressed if it is compressed.
    pub(super) fn input<'a>(&self, source: impl Read + 'a) -> Result<Box<dyn BufRead + 'a>, ReadError> {
        let mut hashed = BufReader::with_capacity(BUFFER_BYTES, HashingReader { source, digest: self.clone() });
        let start = hashed.fill_buf().map_err(|error| ReadError::of_file(TrajectoryFileProblem::Io(error)))?;
        Ok(if start.starts_with(&GZIP_MAGIC) {
            Box::new(BufReader::with_capacity(BUFFER_BYTES, MultiGzDecoder::new(hashed)))
        } else {
            Box::new(hashed)
        })
    }

    /// Returns the hash of the bytes read so far, in hexadecimal digits.
    pub(super) fn hex(&self) -> String {
        self.0.borrow().finalize().to_hex().to_string()
    }
}

/// A byte source that hashes what is read from it.
struct HashingReader<R> {
    source: R,
    digest: Digest,
}

impl<R: Read> Read for HashingReader<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.source.read(buffer)?;
        self.digest.0.borrow_mut().update(&buffer[..count]);
        Ok(count)
    }
}
