//! The output of every reader: rows in SI units, in the order of the file.
//!
//! ```text
//!   NGSIM, highD, exiD, plain, in-car (text, line by line) ─┐
//!   CommonRoad (XML, event by event)                       ─┼─▶ RowSource ─▶ rows ─▶ Tracks (the only exit)
//!   SUMO, Vissim, I-24 MOTION (as a whole)                 ─┘
//! ```
//!
//! A reader holds one line or one XML element at a time, apart from those that read a file as a
//! whole; see `collected`. When it is opened, it reads the other
//! files of a highD or exiD data set. A CommonRoad reader also holds the lanelets, which precede
//! the obstacles in the file.

use closecall_traffic::{Side, Time, VehicleClass};

use super::class_names::UnknownClass;
use super::data::MarkingDistances;
use super::error::TrajectoryFileProblem;
use super::fields::FieldError;
use super::file_layout::Layout;
use super::markings::LaneMarkings;

/// States whether frame numbers may restart within one file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Clock {
    /// One count of frames covers the whole file.
    Continuous,
    /// Concatenated original NGSIM files: vehicle and frame numbers recur at later times.
    MayRestart,
    /// A simulation: a vehicle keeps its number, and a lane change may take a single step.
    Simulated,
}

/// One vehicle at one frame, in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Row {
    /// Number of the vehicle or track in the file. Rows with the same number and origin form one
    /// track before it is split at gaps.
    pub(super) number: u64,
    /// Time of frame 0 if it distinguishes several data sets in one file, otherwise zero.
    pub(super) origin: Time,
    pub(super) vehicle_id: u64,
    pub(super) frame: i64,
    pub(super) time: Time,
    pub(super) clock: Clock,
    pub(super) s_m: f64,
    pub(super) d_m: f64,
    pub(super) lane: u8,
    pub(super) speed_mps: f64,
    pub(super) acceleration_mps2: Option<f64>,
    pub(super) length_m: f64,
    pub(super) width_m: f64,
    pub(super) class: VehicleClass,
    /// Distances to the lane markings; only in-car logs have them.
    pub(super) marking_distances: MarkingDistances,
    pub(super) line: u64,
}

impl Row {
    /// Returns `true` if the row has all values of `other`.
    pub(super) fn repeats(&self, other: &Self) -> bool {
        Self { line: other.line, ..*self } == *other
    }
}

/// The knowledge of a reader about its file before the last row.
#[derive(Clone, Debug)]
pub(super) struct FileInfo {
    pub(super) layout: Layout,
    /// Name that the file states; known after the first row at the latest.
    pub(super) name: Option<String>,
    /// Time between two frames, if the layout states it.
    pub(super) period: Option<Time>,
    /// Lane markings, if the layout states them.
    pub(super) markings: Option<LaneMarkings>,
}

/// A reader of one layout.
pub(super) trait RowSource {
    /// Returns the knowledge about the file so far.
    fn info(&self) -> FileInfo;

    /// Returns the unknown names of vehicle classes found so far.
    fn unknown_classes(&self) -> &[UnknownClass];

    /// Returns what a reader of results has to know of the file.
    fn warnings(&self) -> Vec<String> {
        Vec::new()
    }

    /// Returns `true` if a warning says why lane changes may be wrong or missing.
    fn is_in_doubt(&self) -> bool {
        false
    }

    /// Returns the share of the rows so far in which a vehicle does not follow the road of the map (%), if it is so
    /// large that the positions along the road mean nothing.
    fn off_road_percent(&self) -> Option<f64> {
        None
    }

    /// Checks that the velocities of the rows so far have the axes of the positions.
    ///
    /// # Errors
    /// They have others.
    fn check_velocities(&self) -> Result<(), ReadError> {
        Ok(())
    }

    /// Checks that the columns which are not read agree with the lateral position, which is mirrored
    /// if `is_mirrored`, in the rows so far.
    ///
    /// # Errors
    /// They contradict it.
    fn check_sides(&self, _is_mirrored: bool) -> Result<(), ReadError> {
        Ok(())
    }

    /// Checks that lanes which the file counts from the right agree with the positions, which are
    /// mirrored if `is_mirrored`.
    ///
    /// # Errors
    /// They contradict them.
    fn check_lane_sides(&self, _is_mirrored: bool) -> Result<(), ReadError> {
        Ok(())
    }

    /// Returns the doubt about lanes of a map, if many vehicles so far drive beside all of them.
    fn map_doubt(&self) -> Option<String> {
        None
    }

    /// Returns `true` if the file states, apart from its positions, which lane is to the left.
    fn names_sides(&self) -> bool {
        true
    }

    /// Returns `true` if rows are in the lanes at their positions, because the file states no lanes and has no map.
    fn derives_lanes(&self) -> bool {
        false
    }

    /// Returns the side on which vehicles pass the oncoming traffic, if the positions show it.
    fn oncoming_side(&self) -> Option<Side> {
        None
    }

    /// States that the position along the road falls in the direction of travel, so that speeds may be
    /// negative. It is called before the first row.
    fn expect_reversed(&mut self) {}

    /// States that no lane is taken as recorded, so that rows may state none. It is called before the first
    /// row.
    fn expect_no_lanes(&mut self) {}

    /// States that the lateral position is mirrored. It is called before the first row.
    fn expect_mirrored(&mut self) {}

    /// Returns the next row in the order of the file, or `None` at its end.
    ///
    /// # Errors
    /// Returns the line and the problem. After an error for which [`ReadError::affects_one_row`]
    /// holds, the caller can ask for the next row.
    fn next_row(&mut self) -> Result<Option<Row>, ReadError>;
}

/// An error while reading a file, before the path of the file is attached.
#[derive(Debug)]
pub(super) struct ReadError {
    pub(super) line: Option<u64>,
    pub(super) column: Option<&'static str>,
    pub(super) problem: TrajectoryFileProblem,
}

impl ReadError {
    /// Creates an error that concerns the whole file.
    pub(super) fn of_file(problem: TrajectoryFileProblem) -> Self {
        Self { line: None, column: None, problem }
    }

    /// Creates an error in the given line, counted from 1.
    pub(super) fn new(line: u64, error: impl Into<FieldError>) -> Self {
        let FieldError { column, problem } = error.into();
        Self { line: Some(line), column, problem }
    }

    /// Creates an error in a column without a line, for a problem found at the end of the file.
    pub(super) fn of_field(error: FieldError) -> Self {
        Self { line: None, column: error.column, problem: error.problem }
    }

    /// Returns `true` if only this row is unusable and reading can continue after it.
    pub(super) fn affects_one_row(&self) -> bool {
        self.problem.affects_one_row()
    }
}
