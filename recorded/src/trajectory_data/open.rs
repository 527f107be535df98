//! Opening of trajectory files: selects the reader that a file needs.

use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use super::commonroad::CommonRoadSource;
use super::data::TrajectoryData;
use super::error::{TrajectoryFileError, TrajectoryFileProblem};
use super::exid::road_from_traffic;
use super::file_set::FileSet;
use super::header::Header;
use super::input::{Digest, open_file, with_path};
use super::order::{STREAM_ROWS, WINDOW_ROWS};
use super::osi_messages::Messages;
use super::parquet::{self, ParquetText};
use super::rows::io_problem;
use super::source::{ReadError, RowSource};
use super::text::{TextSource, read_first_line};
use super::tracks::{ReadOptions, Tracks};
use super::{i24, openlabel, osi, sumo, vissim};

/// The first bytes of unsupported archives and compressed files, with a description of each.
const ARCHIVES: [(&[u8], &str); 5] = [
    (b"PK\x03\x04", "a ZIP archive"),
    (b"PK\x05\x06", "an empty ZIP archive"),
    (b"BZh", "a bzip2 file"),
    (b"\xfd7zXZ\0", "an xz file"),
    (b"\x28\xb5\x2f\xfd", "a Zstandard file"),
];

/// The first bytes of formats of other programs, with a description of each.
const FOREIGN: [(&[u8], &str); 3] = [
    (b"\x89HDF", "an HDF5 file"),
    (b"[", "JSON without the fields of I-24 MOTION (`x_position`, `y_position`, `timestamp`)"),
    (b"{", "JSON without the fields of I-24 MOTION (`x_position`, `y_position`, `timestamp`), and without `openlabel`"),
];

/// The first bytes of Vissim's vehicle records.
const VISSIM: [&[u8]; 3] = [b"$V", b"* ", b"Vehicle Record"];

/// A field of I-24 MOTION, which stands near the start of its files.
const I24: &[u8] = b"\"x_position\"";
/// Fields of I-24 MOTION. One of them is at the start of its files.
const I24_START: [&[u8]; 3] = [b"\"timestamp\"", b"\"coarse_vehicle_class\"", b"\"configuration_id\""];

/// A word at the start of SUMO's floating car data, and one of CommonRoad's.
const SUMO: &[u8] = b"<fcd-export";
const COMMONROAD: &[u8] = b"<commonRoad";

/// XML formats of other programs by the beginnings of their roots, with a description of each.
const FOREIGN_ROOTS: [(&[u8], &str); 4] = [
    (b"<OpenSCENARIO", "an OpenSCENARIO scenario"),
    (b"<OpenDRIVE", "an OpenDRIVE road network"),
    (b"<osm", "a map of OpenStreetMap or Lanelet2"),
    (b"<net ", "a road network of SUMO"),
];

/// The first bytes of an MCAP file.
const MCAP: &[u8] = b"\x89MCAP";

/// End of the names of OSI's trace files, which have no beginning by which they are recognised.
const OSI_TRACE: &str = "osi";

/// Size of the buffer for the text of a Parquet file (bytes).
const PARQUET_BUFFER_BYTES: usize = 1 << 16;

const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Opens a trajectory file to read its tracks one by one. The memory use is bounded; see
/// [`WINDOW_ROWS`].
///
/// # Errors
/// Returns a [`TrajectoryFileError`] with file, line, column and allowed values.
pub fn open(path: &Path, options: ReadOptions) -> Result<Tracks<'static>, TrajectoryFileError> {
    open_window(path, options, WINDOW_ROWS)
}

/// Works like [`open`], but holds only [`STREAM_ROWS`](super::STREAM_ROWS) rows.
///
/// # Errors
/// Returns a [`TrajectoryFileError`] with file, line, column and allowed values.
pub fn open_streaming(path: &Path, options: ReadOptions) -> Result<Tracks<'static>, TrajectoryFileError> {
    open_window(path, options, STREAM_ROWS)
}

/// Works like [`open`], but holds all rows, which may be in any order.
///
/// # Errors
/// Returns a [`TrajectoryFileError`] with file, line, column and allowed values.
pub(crate) fn open_whole(path: &Path, options: ReadOptions) -> Result<Tracks<'static>, TrajectoryFileError> {
    open_window(path, options, usize::MAX)
}

/// Reads a whole trajectory file, with its rows in any order.
///
/// # Errors
/// Returns a [`TrajectoryFileError`] with file, line, column and allowed values.
pub fn read(path: &Path) -> Result<TrajectoryData, TrajectoryFileError> {
    read_with(path, ReadOptions::default())
}

/// Works like [`read`], with a choice of the layout and of the treatment of bad rows.
///
/// # Errors
/// Returns a [`TrajectoryFileError`] with file, line, column and allowed values.
pub fn read_with(path: &Path, options: ReadOptions) -> Result<TrajectoryData, TrajectoryFileError> {
    open_whole(path, options)?.collect_all()
}

/// Reads trajectory data that consists of one file from any byte source. `path` appears in errors
/// and supplies the name.
///
/// # Errors
/// Returns a [`TrajectoryFileError`] with line, column and allowed values.
pub fn read_from(source: impl Read, path: &Path) -> Result<TrajectoryData, TrajectoryFileError> {
    open_from(source, path, ReadOptions::default(), usize::MAX)?.collect_all()
}

/// Opens trajectory data that consists of one file from any byte source. `path` appears in errors
/// and supplies the name. Data of more than `window` rows must be sorted by vehicle or by time.
///
/// # Errors
/// Returns a [`TrajectoryFileError`] with line, column and allowed values.
pub fn open_from<'a>(
    source: impl Read + 'a,
    path: &Path,
    options: ReadOptions,
    window: usize,
) -> Result<Tracks<'a>, TrajectoryFileError> {
    let digest = Digest::default();
    let mut input = digest.input(source).map_err(|error| with_path(path, error))?;
    let is_trace = is_trace(path) && {
        let start = input.fill_buf().map_err(|error| with_path(path, ReadError::of_file(io_problem(error))))?;
        !start.starts_with(MCAP)
    };
    let source = if is_trace { trace(input, &options) } else { reader_for(input, &options) };
    let source = source.map_err(|error| with_path(path, error))?;
    Tracks::new(path, digest, source, options, window)
}

/// Returns true if `path` has the name of a trace file of OSI, compressed or not.
fn is_trace(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    name.rsplit_once('.').is_some_and(|(_, end)| end == OSI_TRACE)
}

/// Reads a trace file of OSI.
fn trace<'a>(input: Box<dyn BufRead + 'a>, options: &ReadOptions) -> Result<Box<dyn RowSource + 'a>, ReadError> {
    let source = osi::read(Messages::Trace(input), options.lanes)?;
    check_choice(source.as_ref(), options)?;
    Ok(source)
}

/// Returns the files that are read for `path`: several for a highD or exiD data set.
pub fn input_files(path: &Path) -> Vec<PathBuf> {
    match FileSet::of(path) {
        Ok(Some(set)) => set.files().to_vec(),
        Ok(None) | Err(_) => vec![path.to_owned()],
    }
}

/// Opens `path`; data of more than `window` rows must be sorted.
fn open_window(path: &Path, options: ReadOptions, window: usize) -> Result<Tracks<'static>, TrajectoryFileError> {
    match FileSet::of(path)? {
        Some(set) => open_set(&set, options, window),
        None => open_from(open_file(path)?, path, options, window),
    }
}

/// Opens a data set that consists of several files.
fn open_set(set: &FileSet, options: ReadOptions, window: usize) -> Result<Tracks<'static>, TrajectoryFileError> {
    let path = set.tracks();
    let digest = Digest::default();
    let in_tracks = |error| with_path(&path, error);
    let input = digest.input(open_file(&path)?).map_err(in_tracks)?;
    let source = TextSource::with_meta(input, || set.meta(&digest), |rate_hz| road_from_traffic(&path, rate_hz));
    let source = source.map_err(|error| error.map_or_else(|other| other, in_tracks))?;
    check_choice(&source, &options).map_err(in_tracks)?;
    Tracks::new(&path, digest, Box::new(source), options, window)
}

/// Rejects a file whose layout differs from the required one.
fn check_choice(source: &dyn RowSource, options: &ReadOptions) -> Result<(), ReadError> {
    let actual = source.info().layout;
    match options.layout {
        Some(choice) if !choice.includes(actual) => {
            Err(ReadError::of_file(TrajectoryFileProblem::OtherLayout { actual, asked: choice.name() }))
        }
        _ => Ok(()),
    }
}

/// Selects the reader by the first bytes of `input`.
fn reader_for<'a>(
    mut input: Box<dyn BufRead + 'a>,
    options: &ReadOptions,
) -> Result<Box<dyn RowSource + 'a>, ReadError> {
    let io = |error| ReadError::of_file(io_problem(error));
    if input.fill_buf().map_err(io)?.starts_with(BYTE_ORDER_MARK) {
        input.consume(BYTE_ORDER_MARK.len());
    }
    let start = input.fill_buf().map_err(io)?;
    if let Some((_, kind)) = ARCHIVES.into_iter().find(|(magic, _)| start.starts_with(magic)) {
        return Err(ReadError::of_file(TrajectoryFileProblem::Archive { kind }));
    }
    let text = start.trim_ascii_start();
    let is_i24 = [I24].iter().chain(&I24_START).any(|word| text.windows(word.len()).any(|window| window == *word));
    let is_read_json = is_i24 || openlabel::is_openlabel(text);
    if let Some((_, kind)) = FOREIGN.into_iter().find(|(beginning, _)| text.starts_with(beginning) && !is_read_json) {
        return Err(ReadError::of_file(TrajectoryFileProblem::Foreign { kind }));
    }
    let holds = |word: &[u8]| text.windows(word.len()).any(|window| window == word);
    if let Some((_, kind)) = FOREIGN_ROOTS.into_iter().find(|(root, _)| text.starts_with(b"<") && holds(root))
        && !holds(COMMONROAD)
        && !holds(SUMO)
    {
        return Err(ReadError::of_file(TrajectoryFileProblem::Foreign { kind }));
    }
    let source: Box<dyn RowSource + 'a> = if text.starts_with(parquet::MAGIC) {
        let rows = BufReader::with_capacity(PARQUET_BUFFER_BYTES, ParquetText::new(input)?);
        text_source(rows, options)?
    } else if text.starts_with(b"<") && holds(SUMO) && !holds(COMMONROAD) {
        Box::new(sumo::read_xml(input)?)
    } else if text.starts_with(MCAP) {
        osi::read(Messages::of_mcap(input), options.lanes)?
    } else if text.starts_with(b"<") {
        Box::new(CommonRoadSource::new(input)?)
    } else if VISSIM.iter().any(|start| text.starts_with(start)) {
        Box::new(vissim::read(input)?)
    } else if openlabel::is_openlabel(text) {
        openlabel::read(input, options.lanes)?
    } else if text.starts_with(b"[") || text.starts_with(b"{") {
        Box::new(i24::read(input)?)
    } else {
        text_source(input, options)?
    };
    check_choice(source.as_ref(), options)?;
    Ok(source)
}

/// Selects the reader of a text file by its first line.
fn text_source<'a, R: BufRead + 'a>(input: R, options: &ReadOptions) -> Result<Box<dyn RowSource + 'a>, ReadError> {
    let (lines, number, first) = read_first_line(input)?;
    if let Ok((header, separator, width)) = Header::parse(&first)
        && sumo::is_table(&header)
    {
        return Ok(Box::new(sumo::read_table(lines, (&header, separator, width))?));
    }
    Ok(Box::new(TextSource::new(lines, number, first, options.location)?))
}
