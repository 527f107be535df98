//! Errors of reading recorded scans.

use std::fmt;
use std::io;
use std::path::PathBuf;

use closecall_sensors::lidar::{MAX_INTENSITY, PointError};

/// An error of a recording of scans, its poses or its labels. Nothing of it is used.
#[derive(Debug, thiserror::Error)]
#[error("failed to read {origin}: {problem}")]
pub struct ScanFileError {
    /// Where the error is.
    pub origin: Origin,
    /// The problem itself.
    #[source]
    pub problem: ScanFileProblem,
}

impl ScanFileError {
    /// Returns `true` if the file cannot be read at all, as opposed to having wrong content.
    pub fn is_io(&self) -> bool {
        matches!(self.problem, ScanFileProblem::Io(_) | ScanFileProblem::MissingFile { .. })
    }
}

/// A place in a recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Origin {
    /// Path of the file or folder.
    pub path: PathBuf,
    /// The place in it, such as `line 3, column x_m`; empty for the whole.
    pub place: String,
}

impl Origin {
    /// Returns the place of a whole file.
    pub fn file(path: impl Into<PathBuf>) -> Self {
        Self { path: path.into(), place: String::new() }
    }

    /// Returns a place in this file.
    #[must_use]
    pub fn at(&self, place: impl fmt::Display) -> Self {
        Self { path: self.path.clone(), place: place.to_string() }
    }

    /// Returns the error of this place.
    pub fn error(&self, problem: impl Into<ScanFileProblem>) -> ScanFileError {
        ScanFileError { origin: self.clone(), problem: problem.into() }
    }
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.path.display())?;
        if self.place.is_empty() { Ok(()) } else { write!(f, ", {}", self.place) }
    }
}

/// A problem with the content or the reading of a recording.
#[derive(Debug, thiserror::Error)]
pub enum ScanFileProblem {
    /// A file cannot be opened or read.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// The path names no recording.
    #[error("a recording is a folder of *.pcd files, a file *.parquet, or a file *.mcap")]
    Kind,
    /// A folder has no point clouds.
    #[error("the folder has no *.pcd file")]
    EmptyFolder,
    /// The index of a folder names no files.
    #[error("it lists no file; a row such as `scan-0.pcd,0.04` is needed for each scan")]
    EmptyIndex,
    /// The index of a folder leaves out files.
    #[error("it does not list {number} of the *.pcd files in its folder, such as `{first}`: each needs a row")]
    NotListed {
        /// Number of these files.
        number: usize,
        /// The name of the first one.
        first: String,
    },
    /// A table has no rows.
    #[error("there are no rows")]
    NoRows,
    /// A recording has no scans of the LiDARs.
    #[error("there are no scans of the LiDARs {0}")]
    NoScans(String),
    /// No point of a recording can be from the LiDARs.
    #[error(
        "no point is in the field of view of the LiDARs {0} of the scenario: x looks along the axis, y to its left, z up"
    )]
    NothingSeen(String),
    /// A file that goes with the recording does not exist.
    #[error("there is no such file, which gives {gives}: a table with the columns {columns}")]
    MissingFile {
        /// What the file gives.
        gives: &'static str,
        /// The columns that are needed.
        columns: String,
    },
    /// The header of a table lacks a column.
    #[error("there is no column `{name}`; the columns {needed} are needed")]
    MissingColumn {
        /// The column.
        name: &'static str,
        /// All columns that are needed.
        needed: String,
    },
    /// A table or a point has two columns or fields of the same name, or a header two lines.
    #[error("{what} `{name}` is there twice; one is needed")]
    Twice {
        /// What is there twice, such as `the column`.
        what: &'static str,
        /// Its name.
        name: String,
    },
    /// A row has too few or too many fields, or is not text.
    #[error("{0}")]
    Csv(String),
    /// A field is not a number.
    #[error("`{text}` is not a finite number")]
    NotANumber {
        /// The text of the field.
        text: String,
    },
    /// A number is out of its range.
    #[error("{value} is out of range: {allowed} is needed")]
    OutOfRange {
        /// The number.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// A word is not one of those that are known.
    #[error("`{text}` is unknown; {allowed} are allowed")]
    UnknownWord {
        /// The word.
        text: String,
        /// What is allowed.
        allowed: String,
    },
    /// A time is not after the previous one.
    #[error("the time {time_s} s is not after {previous_s} s, the previous one{of}: times must increase")]
    TimeGoesBack {
        /// The time (s).
        time_s: f64,
        /// The time before it (s).
        previous_s: f64,
        /// Of what, with a leading blank.
        of: String,
    },
    /// A point cloud lacks a field.
    #[error("the points have no field `{name}`, only {fields}; `x`, `y` and `z` are needed")]
    MissingField {
        /// The field.
        name: &'static str,
        /// The fields that there are.
        fields: String,
    },
    /// A column of a table has another type.
    #[error("the column `{name}` has the type {actual}, but {needed} is needed")]
    ColumnType {
        /// The column.
        name: &'static str,
        /// Its type.
        actual: String,
        /// The type that is needed.
        needed: &'static str,
    },
    /// A column of a table has a value that its quantity cannot have.
    #[error("row {row} has `{name}` = {value}, but {needed} is needed")]
    Value {
        /// The row, from 0.
        row: usize,
        /// The column.
        name: &'static str,
        /// The value.
        value: String,
        /// What is needed.
        needed: &'static str,
    },
    /// A column of a table has a null.
    #[error("row {row} has no value in the column `{name}`")]
    Null {
        /// The row, from 0.
        row: usize,
        /// The column.
        name: &'static str,
    },
    /// A line of the header of a PCD file is wrong or missing.
    #[error("the header of the PCD file is wrong: {0}")]
    PcdHeader(String),
    /// The data of a PCD file have an unknown format.
    #[error("the data format `{0}` is unknown; `ascii`, `binary` and `binary_compressed` are read")]
    PcdData(String),
    /// The data of a point cloud are too short or too long.
    #[error("the points have {actual} bytes, but {points} points of {stride} bytes are stated")]
    Size {
        /// Number of bytes.
        actual: usize,
        /// Number of points that the header states.
        points: usize,
        /// Bytes of each point.
        stride: usize,
    },
    /// Compressed data cannot be decompressed.
    #[error("the compressed points are damaged: {0}")]
    Compressed(&'static str),
    /// A message cannot be decoded.
    #[error("the message is no {message} in CDR: {reason}")]
    Message {
        /// The type of the message.
        message: &'static str,
        /// What is wrong.
        reason: String,
    },
    /// A message or its points are big-endian.
    #[error("{0} are big-endian; little-endian ones are read")]
    BigEndian(&'static str),
    /// An MCAP file cannot be read.
    #[error("the MCAP file cannot be read: {0}")]
    Mcap(String),
    /// An MCAP file has no point clouds.
    #[error("no message is a sensor_msgs/msg/PointCloud2{0}")]
    NoClouds(
        /// The other topics and their types, behind a colon, or nothing.
        String,
    ),
    /// A topic belongs to no LiDAR, or two topics to one.
    #[error(
        "the topics {topics} hold point clouds, and the LiDARs are {lidars}: with one of each they belong together; else \
         a part of the topic between `/` must be the name of its LiDAR, with `_` for `-`"
    )]
    Topics {
        /// The topics.
        topics: String,
        /// The LiDARs of the scenario.
        lidars: String,
    },
    /// The points have no times, so that the end of a scan is unknown.
    #[error(
        "the stamp is the start of the scan, but the points have no times that tell its end: a field `t`, `offset_ns` or `time` is needed"
    )]
    NoEnd,
    /// There is no pose at a time.
    #[error(
        "there is no pose at {time_s} s: the poses go from {first_s} to {last_s} s, and may be at most 0.5 s apart"
    )]
    NoPose {
        /// The time (s).
        time_s: f64,
        /// Time of the first pose (s).
        first_s: f64,
        /// Time of the last pose (s).
        last_s: f64,
    },
    /// A pose lies beside the road of the scenario.
    #[error(
        "`d_m` is {d_m} at {time_s} s, which is beside the road of the scenario: {} to {} m is allowed", allowed_m[0], allowed_m[1]
    )]
    BesideRoad {
        /// The time (s).
        time_s: f64,
        /// The place across the road (m).
        d_m: f64,
        /// The range that is allowed (m).
        allowed_m: [f64; 2],
    },
    /// The poses contradict each other.
    #[error("{0}")]
    Motion(String),
    /// No label is at a time of the scans.
    #[error(
        "the labels have no time in common with the scans: the labels go from {} to {} s, the scans from {} to {} s",
        labels_s[0], labels_s[1], scans_s[0], scans_s[1]
    )]
    NoLabels {
        /// Times of the first and of the last label (s).
        labels_s: [f64; 2],
        /// Times of the first and of the last scan (s).
        scans_s: [f64; 2],
    },
    /// Every point is black.
    #[error("every point has the intensity 0: leave out the field of a sensor that measures none")]
    NoIntensity,
    /// Most points are brighter than a plate.
    #[error(
        "{brighter} of {points} points have an intensity above {MAX_INTENSITY}, at which a registration plate saturates the \
         receiver: 1 is a white surface that faces the sensor"
    )]
    Intensity {
        /// Number of these points.
        brighter: u64,
        /// Number of all points.
        points: u64,
    },
    /// The points of a file are not those that it states.
    #[error("{0}")]
    Points(String),
    /// A point cannot be used.
    #[error(transparent)]
    Point(#[from] PointError),
}
