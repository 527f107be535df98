//! What can be wrong with a recording.

use std::fmt;
use std::io;
use std::path::PathBuf;

/// A recording that could not be read: nothing of it is used.
#[derive(Debug, thiserror::Error)]
pub struct RecordingError {
    /// The file.
    pub path: PathBuf,
    /// The line, counted from 1, where one is to blame.
    pub line: Option<u64>,
    /// The column's name, where one is to blame.
    pub column: Option<String>,
    /// What is wrong.
    #[source]
    pub problem: RecordingProblem,
}

impl fmt::Display for RecordingError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "failed to read the recording {}", self.path.display())?;
        if let Some(line) = self.line {
            write!(f, ", line {line}")?;
        }
        if let Some(column) = &self.column {
            write!(f, ", column `{column}`")?;
        }
        write!(f, ": {}", self.problem)
    }
}

impl RecordingError {
    /// True where the file could not be read at all, as opposed to one whose content is wrong.
    pub fn is_io(&self) -> bool {
        matches!(self.problem, RecordingProblem::Io(_))
    }
}

/// What is wrong with a recording.
#[derive(Debug, thiserror::Error)]
pub enum RecordingProblem {
    /// The file cannot be opened or read.
    #[error("{0}")]
    Io(#[source] io::Error),
    /// The compressed stream is damaged or ends too early.
    #[error("the gzip stream is damaged or cut: {0}")]
    Gzip(#[source] io::Error),
    /// Nothing in it, or a header without rows.
    #[error("there are no rows; a recording needs at least one")]
    Empty,
    /// Not a text file.
    #[error("this is not text; CSV or blank-separated text, or either compressed with gzip, is needed")]
    Binary,
    /// A line without end.
    #[error("the line is longer than {allowed} bytes")]
    LineTooLong {
        /// The longest that is read.
        allowed: u64,
    },
    /// Neither layout fits.
    #[error(
        "the first line is neither a header of the plain layout (`track_id, frame, time_s, s_m, …`) or of NGSIM's \
         (`Vehicle_ID, Frame_ID, …`), nor a row of NGSIM's 18 columns; it has {columns} columns and starts with `{start}`"
    )]
    UnknownLayout {
        /// Number of columns found.
        columns: usize,
        /// The line's beginning.
        start: String,
    },
    /// The header lacks a column.
    #[error("the header has no column `{name}`, which the {layout} layout needs")]
    MissingColumn {
        /// The column.
        name: &'static str,
        /// The layout that the rest of the header fits.
        layout: &'static str,
    },
    /// The header has a column twice.
    #[error("the header has the column `{name}` twice")]
    DuplicateColumn {
        /// The column.
        name: String,
    },
    /// A row that is cut, or has too much.
    #[error("the row has {found} columns, but {needed} are needed")]
    ColumnCount {
        /// Number found.
        found: usize,
        /// Number needed.
        needed: usize,
    },
    /// A quoted field that does not end.
    #[error("a quoted field does not end on its line")]
    OpenQuote,
    /// A field that is not what the column holds.
    #[error("is `{value}`, but {allowed} is needed")]
    Value {
        /// The text found.
        value: String,
        /// What is allowed.
        allowed: String,
    },
    /// The same instant twice.
    #[error(
        "frame {frame} of vehicle {vehicle} stands there twice, first in line {first_line}; one row for each is needed"
    )]
    DuplicateRow {
        /// The vehicle or track.
        vehicle: u64,
        /// The frame.
        frame: i64,
        /// The line of the first of them.
        first_line: u64,
    },
    /// Time and frame disagree.
    #[error(
        "from frame {frame_before} (line {line_before}) to frame {frame} the time of vehicle {vehicle} goes on by \
         {step_s} s, but {needed_s} s is needed, as between the other frames"
    )]
    UnevenTime {
        /// The vehicle or track.
        vehicle: u64,
        /// The earlier frame.
        frame_before: i64,
        /// Its line.
        line_before: u64,
        /// The later frame.
        frame: i64,
        /// Time between them as recorded [s].
        step_s: f64,
        /// Time between them as it should be [s].
        needed_s: f64,
    },
    /// Rows of several recordings in one file.
    #[error("is `{found}`, but `{first}` is needed as in the first row: one recording for each file")]
    SeveralRecordings {
        /// The first name.
        first: String,
        /// The other name.
        found: String,
    },
}

/// A recording that could not be written. The file that was there before, if any, is still there.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The file cannot be written.
    #[error("failed to write the recording {}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A number that is not finite.
    #[error("failed to write the recording: {what} of track {track_id} at {time_s} s is not finite")]
    NotFinite {
        /// The track.
        track_id: u64,
        /// When [s].
        time_s: f64,
        /// The quantity.
        what: &'static str,
    },
    /// An instant between two frames.
    #[error("failed to write the recording: track {track_id} at {time_s} s lies between two frames of {period_s} s")]
    OffClock {
        /// The track.
        track_id: u64,
        /// When [s].
        time_s: f64,
        /// Time between two frames [s].
        period_s: f64,
    },
}
