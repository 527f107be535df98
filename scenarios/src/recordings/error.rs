//! What can be wrong with a recording.

use std::fmt;
use std::io;
use std::path::PathBuf;

use super::Layout;

/// A recording that could not be read: nothing of it is used.
#[derive(Debug, thiserror::Error)]
pub struct RecordingError {
    /// The file.
    pub path: PathBuf,
    /// The line, counted from 1, where one is to blame.
    pub line: Option<u64>,
    /// The column's name, where one is to blame.
    pub column: Option<&'static str>,
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
    /// A line that is no text.
    #[error("the line is not text in UTF-8")]
    NotText,
    /// Packed in a way that is not read.
    #[error("this is {what}, which is not read; unpack it first, or compress the recording with gzip")]
    Archive {
        /// What it is.
        what: &'static str,
    },
    /// Another layout than the one asked for.
    #[error("the content is in the layout {}, not in {asked} as asked for", found.name())]
    OtherLayout {
        /// The layout that the content tells.
        found: Layout,
        /// The layout asked for.
        asked: &'static str,
    },
    /// The last line has no end.
    #[error("the last line does not end: the recording may be cut there; if it is whole, end the line")]
    CutLine,
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
    /// Time that goes back, or stands still, in a log of one vehicle.
    #[error("is {time_s}, after {before_s} in the row before, but time has to go on from row to row")]
    TimeBackwards {
        /// Time of the row before [s].
        before_s: f64,
        /// Time of this row [s].
        time_s: f64,
    },
    /// A time between two ticks of a log's clock.
    #[error("is {time_s}, but the rows before are {period_s} s apart, and this lies between two of their ticks")]
    OffClock {
        /// Time of this row [s].
        time_s: f64,
        /// Time between two rows [s].
        period_s: f64,
    },
    /// A long recording that is not sorted by vehicle.
    #[error(
        "vehicle {vehicle} goes on here after rows of others; a recording of more than {rows} rows has to be sorted by \
         vehicle or by time throughout"
    )]
    NotByVehicle {
        /// The vehicle.
        vehicle: u64,
        /// Longer ones have to be sorted.
        rows: usize,
    },
    /// A long recording that is not sorted by time.
    #[error(
        "time goes back by {back_s} s; a recording of more than {rows} rows has to be sorted by vehicle or by time \
         throughout"
    )]
    NotByTime {
        /// By how much [s].
        back_s: f64,
        /// Longer ones have to be sorted.
        rows: usize,
    },
    /// Tracks that never end.
    #[error("more than {allowed} rows belong to vehicles that are still on the road")]
    TooManyOpen {
        /// The most that is kept.
        allowed: usize,
    },
    /// XML that is no CommonRoad scenario.
    #[error("this is no CommonRoad scenario that can be read: {what}")]
    Xml {
        /// What is wrong.
        what: String,
    },
    /// The rows of a recording of several files, without the others.
    #[error(
        "the header is that of highD's or exiD's tracks, which need the files with their metadata beside them: \
         NN_tracks.csv, NN_tracksMeta.csv and NN_recordingMeta.csv"
    )]
    NeedsMetadata,
    /// Traffic that tells no road.
    #[error("no vehicle moves, so that the road cannot be told from the traffic")]
    NothingMoves,
    /// Several recordings in one folder.
    #[error(
        "there are {count} recordings in this folder, from {first}_tracks.csv to {last}_tracks.csv: name one of them"
    )]
    SeveralInFolder {
        /// How many.
        count: usize,
        /// What the first one's name begins with.
        first: String,
        /// What the last one's name begins with.
        last: String,
    },
    /// A table with another number of rows than it has to have.
    #[error("there are {found} rows, but {needed} is needed")]
    RowCount {
        /// Rows found.
        found: usize,
        /// Rows needed.
        needed: usize,
    },
    /// A vehicle that stands in the metadata twice.
    #[error("vehicle {vehicle} stands there twice, first in line {first_line}")]
    VehicleTwice {
        /// The vehicle.
        vehicle: u64,
        /// The line of the first of them.
        first_line: u64,
    },
    /// A vehicle with another number of rows than the metadata state.
    #[error("vehicle {vehicle} has {found} rows, but {stated} are stated in line {line} of {file}")]
    OtherCount {
        /// The vehicle.
        vehicle: u64,
        /// Rows found.
        found: u64,
        /// Rows stated.
        stated: u64,
        /// The file with the metadata.
        file: String,
        /// Its line.
        line: u64,
    },
    /// A track with gaps for whose pieces there is no number.
    #[error("track {track} has a gap, but its number is that of a piece already; numbers of vehicles lie below 10¹²")]
    SplitPiece {
        /// The track.
        track: u64,
    },
    /// Numbers that no traffic has: units or columns are mixed up.
    #[error("{what} is {found}, but {allowed} is plausible: are units or columns mixed up?")]
    Implausible {
        /// The quantity.
        what: &'static str,
        /// Its value, rounded, with its unit.
        found: String,
        /// What is plausible.
        allowed: &'static str,
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

impl RecordingProblem {
    /// True where one row is unusable, and the ones behind it need not be.
    pub(super) fn is_of_row(&self) -> bool {
        matches!(
            self,
            Self::ColumnCount { .. }
                | Self::OpenQuote
                | Self::Value { .. }
                | Self::DuplicateRow { .. }
                | Self::UnevenTime { .. }
                | Self::TimeBackwards { .. }
                | Self::OffClock { .. }
                | Self::CutLine
                | Self::OtherCount { .. }
                | Self::NotText
        )
    }

    /// A name for what is wrong with a row, for counting.
    pub(super) fn kind(&self) -> &'static str {
        match self {
            Self::ColumnCount { .. } | Self::CutLine => "cut rows",
            Self::OpenQuote | Self::NotText => "rows that are no text",
            Self::Value { .. } => "values that are not allowed",
            Self::DuplicateRow { .. } => "duplicated rows",
            Self::UnevenTime { .. } | Self::OffClock { .. } => "times off the clock",
            Self::TimeBackwards { .. } => "times that go back",
            Self::OtherCount { .. } => "vehicles with rows missing",
            _ => "other",
        }
    }
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
