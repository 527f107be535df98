//! Errors of reading and writing trajectory files.

use std::fmt;
use std::io;
use std::path::PathBuf;

use closecall_traffic::words::counted;

use super::file_layout::Layout;
use super::markings::LANE_WIDTHS_M;

/// An error while reading a trajectory file. None of the file's data is used.
#[derive(Debug, thiserror::Error)]
pub struct TrajectoryFileError {
    /// Path of the file.
    pub path: PathBuf,
    /// Line at error, counted from 1, if a single line is.
    pub line: Option<u64>,
    /// Name of the column at error, if a single column is.
    pub column: Option<&'static str>,
    /// The problem itself.
    #[source]
    pub problem: TrajectoryFileProblem,
}

impl fmt::Display for TrajectoryFileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "failed to read the trajectory file {}", self.path.display())?;
        if let Some(line) = self.line {
            write!(f, ", line {line}")?;
        }
        if let Some(column) = &self.column {
            write!(f, ", column `{column}`")?;
        }
        write!(f, ": {}", self.problem)
    }
}

impl TrajectoryFileError {
    /// Returns `true` if the file cannot be read at all, as opposed to having wrong content.
    pub fn is_io(&self) -> bool {
        matches!(self.problem, TrajectoryFileProblem::Io(_))
    }
}

/// A problem with the content or the reading of a trajectory file.
#[derive(Debug, thiserror::Error)]
pub enum TrajectoryFileProblem {
    /// The file cannot be opened or read.
    #[error("{0}")]
    Io(#[source] io::Error),
    /// The compressed stream is damaged or ends too early.
    #[error("the compressed stream is damaged or cut: {0}")]
    Gzip(#[source] io::Error),
    /// The file is empty or has only a header.
    #[error("there are no rows; a trajectory file needs at least one")]
    Empty,
    /// The file is not a text file.
    #[error("this is not text; CSV or blank-separated text, or either compressed with gzip, is needed")]
    Binary,
    /// The file is text in another encoding.
    #[error("this is text in UTF-16, but UTF-8 is needed: save it again in that encoding (`iconv -f UTF-16 -t UTF-8`)")]
    Utf16,
    /// The first line is text in an encoding of one byte for each letter.
    #[error(
        "this is text, but not in UTF-8, which is needed: save it again in that encoding (`iconv -f WINDOWS-1252 -t UTF-8`)"
    )]
    NotUtf8,
    /// A line repeats the header.
    #[error("the header stands here again: several files were joined, and each has to be read by itself")]
    RepeatedHeader,
    /// A line is not valid UTF-8 text.
    #[error("the line is not text in UTF-8")]
    NotText,
    /// The file is an archive or uses a compression that is not supported.
    #[error("this is {kind}, which is not read; unpack it first, or compress the trajectory file with gzip")]
    Archive {
        /// Kind of archive or compression.
        kind: &'static str,
    },
    /// The file is in a format of another program.
    #[error(
        "this is {kind}, which is not read here; write it as the plain layout (CSV with `track_id, frame, time_s, s_m, …`)"
    )]
    Foreign {
        /// The format.
        kind: &'static str,
    },
    /// The file has another layout than the caller requires.
    #[error("the content is in the layout {}, not in {asked} as asked for", actual.name())]
    OtherLayout {
        /// Layout found in the content.
        actual: Layout,
        /// Layout required by the caller.
        asked: &'static str,
    },
    /// The last line is not terminated.
    #[error(
        "the last line does not end, and its last field is shorter than the one before: the file may be cut there; if it is whole, end the line"
    )]
    CutLine,
    /// Carriage returns alone end the lines.
    #[error(
        "its lines end with carriage returns alone, but line feeds are needed: save it again with the line ends of Unix or Windows \
         (`tr '\\r' '\\n'`)"
    )]
    CarriageReturns,
    /// A line exceeds the permitted length.
    #[error("the line is longer than {allowed} bytes")]
    LineTooLong {
        /// Maximum line length (bytes).
        allowed: u64,
    },
    /// The file has more rows than are read at once.
    #[error(
        "it has more than {allowed} rows; `traffic lane-changes` and `traffic inspect` read it piece by piece, other commands need a part of it"
    )]
    TooManyRows {
        /// Maximum number of rows.
        allowed: usize,
    },
    /// The first line fits none of the layouts.
    #[error(
        "the first line is neither a header of the plain layout (`track_id, frame, time_s, s_m, …`) or of NGSIM's \
         (`Vehicle_ID, Frame_ID, …`), nor a row of NGSIM's 18 columns; it has {} and starts with `{start}`",
        counted(*columns, "column")
    )]
    UnknownLayout {
        /// Number of columns found.
        columns: usize,
        /// Beginning of the line.
        start: String,
    },
    /// The header lacks a column.
    #[error("the header has no column `{name}`, which the {layout} layout needs")]
    MissingColumn {
        /// Name of the missing column.
        name: &'static str,
        /// Layout that the rest of the header fits.
        layout: &'static str,
    },
    /// The header contains a column twice.
    #[error("the header has the column `{name}` twice")]
    DuplicateColumn {
        /// Name of the column.
        name: String,
    },
    /// A row has too few or too many columns.
    #[error("the row has {actual} columns, but {needed} are needed")]
    ColumnCount {
        /// Number of columns found.
        actual: usize,
        /// Number of columns required.
        needed: usize,
    },
    /// A quoted field does not end on its line.
    #[error("a quoted field does not end on its line")]
    OpenQuote,
    /// A field holds a value that its column does not allow.
    #[error("is `{value}`, but {allowed} is needed")]
    Value {
        /// Text found in the field.
        value: String,
        /// Description of the allowed values.
        allowed: String,
    },
    /// A number has a decimal comma.
    #[error(
        "is `{value}`, which has a decimal comma: decimal points are needed, or semicolons between the columns and decimal commas"
    )]
    DecimalComma {
        /// Text found in the field.
        value: String,
    },
    /// A speed is negative.
    #[error(
        "is `{speed_mps}`, but a number from 0 to 150 is needed: a negative speed is against the direction of travel"
    )]
    NegativeSpeed {
        /// The speed (m/s).
        speed_mps: f64,
    },
    /// The first line has decimal commas between blanks or tabs.
    #[error(
        "the first line has decimal commas, such as in `{value}`: decimal points are needed, or semicolons between the columns and \
         decimal commas"
    )]
    DecimalCommas {
        /// Text of the first such field.
        value: String,
    },
    /// A heading is no angle in radians.
    #[error(
        "is `{value}`, but a number from -3.2 to 3.2 is needed: are the headings in degrees, or counted from 0 to 2π?"
    )]
    HeadingUnit {
        /// The heading.
        value: f64,
    },
    /// A vehicle drives on a carriageway of highD without markings.
    #[error(
        "vehicle {vehicle} drives on a carriageway without markings: the metadata of the data set state no `{column}`, by which lateral \
         positions are counted"
    )]
    NoMarkings {
        /// Number of the vehicle.
        vehicle: u64,
        /// Column that states no markings.
        column: &'static str,
    },
    /// A vehicle has two rows with different values for the same frame.
    #[error(
        "frame {frame} of vehicle {vehicle} stands there twice, first in line {first_line}, with other values; one row for each is needed"
    )]
    DuplicateRow {
        /// Number of the vehicle or track.
        vehicle: u64,
        /// Frame number.
        frame: i64,
        /// Line of the first of the two rows.
        first_line: u64,
    },
    /// A vehicle is in two places in the same frame.
    #[error(
        "frame {frame} of vehicle {vehicle} stands there twice, first in line {first_line}, where the vehicle is at another place: the \
         number belongs to several vehicles"
    )]
    SharedNumber {
        /// Number of the vehicle or track.
        vehicle: u64,
        /// Frame number.
        frame: i64,
        /// Line of the first of the two rows.
        first_line: u64,
    },
    /// The time step between two rows contradicts their frame numbers.
    #[error(
        "from frame {frame_before} (line {line_before}) to frame {frame} the time of vehicle {vehicle} goes on by \
         {step_s} s, but {needed_s} s is needed, as between the other frames"
    )]
    UnevenTime {
        /// Number of the vehicle or track.
        vehicle: u64,
        /// Frame number of the earlier row.
        frame_before: i64,
        /// Line of the earlier row.
        line_before: u64,
        /// Frame number of the later row.
        frame: i64,
        /// Recorded time between the two rows (s).
        step_s: f64,
        /// Time between the two rows that their frame numbers require (s).
        needed_s: f64,
    },
    /// Many time steps contradict the frame numbers.
    #[error(
        "{first}; {uneven} of {steps} steps between frames are uneven: the times follow no clock, and no rows can be left out"
    )]
    IrregularClock {
        /// Problem with the first of them.
        first: Box<TrajectoryFileProblem>,
        /// Number of uneven steps.
        uneven: usize,
        /// Number of steps.
        steps: usize,
    },
    /// Time decreases or stands still in a log of one vehicle.
    #[error("is {time_s}, after {before_s} in the row before, but time has to go on from row to row")]
    TimeBackwards {
        /// Time of the previous row (s).
        before_s: f64,
        /// Time of this row (s).
        time_s: f64,
    },
    /// A time in a log lies between two ticks of the log's clock.
    #[error("is {time_s}, but the rows before are {period_s} s apart, and this lies between two of their ticks")]
    OffClock {
        /// Time of this row (s).
        time_s: f64,
        /// Time between two rows (s).
        period_s: f64,
    },
    /// A long file is not sorted by vehicle.
    #[error(
        "vehicle {vehicle} goes on here after rows of others; a file of more than {rows} rows has to be sorted by \
         vehicle or by time throughout"
    )]
    NotByVehicle {
        /// Number of the vehicle.
        vehicle: u64,
        /// Number of rows above which a file must be sorted.
        rows: usize,
    },
    /// A long file is not sorted by time.
    #[error(
        "time goes back by {back_s} s; a file of more than {rows} rows has to be sorted by vehicle or by time \
         throughout"
    )]
    NotByTime {
        /// Amount by which the time decreases (s).
        back_s: f64,
        /// Number of rows above which a file must be sorted.
        rows: usize,
    },
    /// Too many rows belong to tracks that are still incomplete.
    #[error("more than {allowed} rows belong to vehicles that are still on the road")]
    TooManyOpen {
        /// Maximum number of rows held.
        allowed: usize,
    },
    /// The content is not what its beginning announces.
    #[error("this is no {format} that can be read: {reason}")]
    Unreadable {
        /// The format.
        format: &'static str,
        /// Description of the problem.
        reason: String,
    },
    /// The file is the tracks file of a highD or exiD data set, and its metadata files are missing.
    #[error(
        "the header belongs to highD's or exiD's tracks, which need the files with their metadata beside them: \
         NN_tracks.csv, NN_tracksMeta.csv and NN_recordingMeta.csv"
    )]
    NeedsMetadata,
    /// The fields of a data set of several files are separated by semicolons.
    #[error(
        "the file is semicolon-separated, but in this layout semicolons separate the items of lists: its columns have to be \
         separated by commas, with decimal points"
    )]
    SemicolonSeparated,
    /// The vehicles follow no road.
    #[error(
        "in {percent:.0} % of the rows, a vehicle does not follow a road that the map or the traffic shows, as on intersections and \
         roundabouts: only roads with lanes are read"
    )]
    NoRoad {
        /// Share of these rows (%).
        percent: f64,
    },
    /// The headings of vehicles contradict their movements.
    #[error(
        "in {percent:.0} % of the movements, a vehicle moves in another direction than its heading states, by more than 30°: headings and \
         positions have different axes"
    )]
    HeadingsAgainstMotion {
        /// Share of these movements (%).
        percent: f64,
    },
    /// The velocities of vehicles contradict their movements, and their headings do not.
    #[error(
        "in {percent:.0} % of the movements, a vehicle moves in another direction than its velocity states, by more than 30°, although \
         its heading agrees: velocities have to be in the axes of the positions, and not in the axes of the vehicle"
    )]
    VelocitiesAgainstMotion {
        /// Share of these movements (%).
        percent: f64,
    },
    /// No row belongs to the data set that is asked for.
    #[error("no row belongs to `{asked}`; the file holds {names}")]
    NoSuchLocation {
        /// Name that is asked for.
        asked: &'static str,
        /// The names in the file.
        names: String,
    },
    /// No vehicle is in a lane, and lanes are needed.
    #[error("{place}: the lanes have to be estimated from the positions of the traffic")]
    NoLanes {
        /// What states no lane.
        place: String,
    },
    /// The road cannot be derived from the traffic, because no vehicle moves.
    #[error(
        "no vehicle moves, so that the road cannot be told from the traffic: are times or speeds missing, or in another unit?"
    )]
    NothingMoves,
    /// A folder contains several data sets.
    #[error(
        "there are {count} data sets in this folder, from {first}_tracks.csv to {last}_tracks.csv: name one of them"
    )]
    SeveralInFolder {
        /// Number of data sets found.
        count: usize,
        /// File name prefix of the first data set.
        first: String,
        /// File name prefix of the last data set.
        last: String,
    },
    /// A table has a wrong number of rows.
    #[error("there are {actual} rows, but {needed} is needed")]
    RowCount {
        /// Number of rows found.
        actual: usize,
        /// Number of rows required.
        needed: usize,
    },
    /// A vehicle appears twice in the metadata.
    #[error("vehicle {vehicle} stands there twice, first in line {first_line}")]
    VehicleTwice {
        /// Number of the vehicle.
        vehicle: u64,
        /// Line of its first entry.
        first_line: u64,
    },
    /// A vehicle has a different number of rows than its metadata states.
    #[error("vehicle {vehicle} has {actual} rows, but {stated} are stated in line {line} of {file}")]
    OtherCount {
        /// Number of the vehicle.
        vehicle: u64,
        /// Number of rows found.
        actual: u64,
        /// Number of rows stated.
        stated: u64,
        /// Name of the metadata file.
        file: String,
        /// Line in the metadata file.
        line: u64,
    },
    /// A track has a gap, but no free track number is left for its pieces.
    #[error("track {track} has a gap, but a piece already has its number; numbers of vehicles lie below 10¹²")]
    SplitPiece {
        /// Number of the track.
        track: u64,
    },
    /// The lanes lie in the opposite order of their numbers.
    #[error(
        "lane {} lies {apart_m:.1} m to the left of lane {}, but lanes are counted from the left: {}",
        lanes[1], lanes[0],
        if *is_mirrored {
            "the lateral position points to the left, or else the lanes are counted from the right"
        } else {
            "the lanes are counted from the right, or else the lateral position is mirrored"
        }
    )]
    LanesAgainstPosition {
        /// The smallest and the largest number of a lane.
        lanes: [u8; 2],
        /// Distance of their middles (m).
        apart_m: f64,
        /// Whether the positions have the sign of the other side, too.
        is_mirrored: bool,
    },
    /// Lanes that a layout counts from the right lie in the opposite order.
    #[error(
        "in {percent:.0} % of {comparisons} comparisons of vehicles beside each other, the one in the lane with the larger index is on \
         the right, but lanes are counted from the right: the file is mirrored, or its traffic drives on the left"
    )]
    IndexAgainstPosition {
        /// Share of these comparisons (%).
        percent: f64,
        /// Number of comparisons.
        comparisons: usize,
    },
    /// Some lanes lie in another order than their numbers.
    #[error(
        "lane {} lies {apart_m:.1} m to the left of lane {}, but lanes are numbered from the left, as other lanes of the file are: the \
         numbers are not in the order of the lanes",
        lanes[1], lanes[0]
    )]
    LanesOutOfOrder {
        /// Two lanes with successive numbers.
        lanes: [u8; 2],
        /// Distance by which the second one lies to the left of the first one (m).
        apart_m: f64,
    },
    /// The middles of neighbouring lanes are further apart than lanes are wide, or closer.
    #[error(
        "lanes {} and {} are {per_lane_m:.1} m apart by the recorded lanes and lateral positions, but lanes are {} to {} m wide: \
         {cause}",
        lanes[0], lanes[1], LANE_WIDTHS_M.start(), LANE_WIDTHS_M.end()
    )]
    LaneSpacing {
        /// The first two such lanes.
        lanes: [u8; 2],
        /// Distance of their middles, divided by the difference of their numbers (m), or the median of all
        /// such distances.
        per_lane_m: f64,
        /// The question for the likely cause.
        cause: &'static str,
    },
    /// Vehicles are not between the markings of their lanes.
    #[error(
        "in {percent:.0} % of the rows of lanes {} to {}, as they are numbered from the left, a vehicle is not between the \
         markings of its lane: the numbers of lanes and the stated markings contradict each other",
        lanes[0], lanes[1]
    )]
    LanesBesideMarkings {
        /// The leftmost and the rightmost lane of the carriageway.
        lanes: [u8; 2],
        /// Share of these rows (%).
        percent: f64,
    },
    /// Vehicles are not between the markings of their carriageway.
    #[error(
        "in {percent:.0} % of the rows of lanes {} to {}, as they are numbered from the left, a vehicle is not between the markings \
         of its carriageway: the file is mirrored, its traffic drives on the left, or the positions and the markings have other origins \
         or units",
        lanes[0], lanes[1]
    )]
    BesideCarriageway {
        /// The leftmost and the rightmost lane of the carriageway.
        lanes: [u8; 2],
        /// Share of these rows (%).
        percent: f64,
    },
    /// Columns that the reader only checks contradict the lateral position.
    #[error(
        "`{columns}` contradict `{position}`: in {percent:.0} % of {compared}, they say left where `{position}` says right, or the \
         reverse; one of both points to the other side"
    )]
    SidesContradict {
        /// The columns.
        columns: &'static str,
        /// The column of the lateral position.
        position: &'static str,
        /// Share of the comparisons that contradict (%).
        percent: f64,
        /// What is compared.
        compared: &'static str,
    },
    /// Lane changes on a derived road go to the other side than the file states.
    #[error(
        "in {contrary} of {all} lane changes, `latLaneCenterOffset` says left where the road that was derived from the traffic says \
         right, or the reverse: the paths of {vehicles} vehicles do not show which way the lanes lie"
    )]
    LaneChangesToTheOtherSide {
        /// Number of lane changes to the other side.
        contrary: u64,
        /// Number of lane changes that were compared.
        all: u64,
        /// Number of vehicles.
        vehicles: usize,
    },
    /// Neighbours of a map lie on the other side than it states.
    #[error(
        "in {contrary} of {all} pairs of lanes that the map states as neighbours, the right one lies to the left of the other: the file is \
         mirrored, or the neighbours are exchanged"
    )]
    NeighboursAgainstPosition {
        /// Number of these pairs.
        contrary: usize,
        /// Number of pairs.
        all: usize,
    },
    /// Vehicles drive against the road.
    #[error(
        "the position along the road falls in the direction of travel of {against} of {all} vehicles, such as vehicle {first}: \
         {}",
        if against == all {
            "it has to grow"
        } else {
            "they drive in the other direction, and each direction needs a file of its own"
        }
    )]
    AgainstTheRoad {
        /// Number of vehicles that drive against the road.
        against: usize,
        /// Number of vehicles.
        all: usize,
        /// Number of the first of them.
        first: u64,
    },
    /// The tracks fall to pieces.
    #[error(
        "the tracks of its {vehicles} vehicles fall into {pieces} pieces of {piece_s:.2} s on average, so that nothing can be \
         followed: {cause}"
    )]
    Shreds {
        /// Number of vehicles.
        vehicles: u64,
        /// Number of pieces.
        pieces: u64,
        /// Mean duration of a piece (s).
        piece_s: f64,
        /// The likely cause.
        cause: String,
    },
    /// Numbers jump from vehicle to vehicle in most steps.
    #[error(
        "in {percent:.0} % of the steps from row to row, a number jumps to another place: numbers are not unique for each vehicle, or \
         positions have errors of metres"
    )]
    JumpingNumbers {
        /// Share of these steps (%).
        percent: f64,
    },
    /// Vehicles move, but their speeds say that they hardly do.
    #[error(
        "the positions of {too_low} of {all} moving vehicles, such as vehicle {first}, advance further than their speeds make: are \
         the speeds missing or 0, or in another unit?"
    )]
    SpeedsTooLow {
        /// Number of vehicles with such speeds.
        too_low: usize,
        /// Number of moving vehicles.
        all: usize,
        /// Number of the first of them.
        first: u64,
    },
    /// Values are implausible for road traffic, which points to mixed-up units or columns.
    #[error("{quantity} is {actual}, but {allowed} is plausible: are units or columns mixed up?")]
    Implausible {
        /// Name of the quantity.
        quantity: &'static str,
        /// Rounded value with its unit.
        actual: String,
        /// Range of plausible values.
        allowed: &'static str,
    },
    /// The distances between two frames contradict the speeds, which points to mixed-up units or columns,
    /// or to a wrong clock.
    #[error(
        "the median distance between two frames, as a share of what the recorded speed makes, is {ratio:.3}, but {allowed} is plausible: \
         are units or columns mixed up, or is {clock} wrong?"
    )]
    ImplausibleSteps {
        /// The share (-).
        ratio: f64,
        /// Range of plausible values.
        allowed: &'static str,
        /// What states the times of frames.
        clock: &'static str,
    },
    /// Vehicles of highD drive against the driving direction that the metadata states.
    #[error(
        "in {percent:.0} % of the rows with drivingDirection {direction} in {file}, `xVelocity` is not towards {towards}: the driving \
         directions are swapped, x is mirrored, or `xVelocity` has no sign or the wrong one"
    )]
    AgainstDrivingDirection {
        /// The driving direction.
        direction: u8,
        /// What it means.
        towards: &'static str,
        /// Share of these rows (%).
        percent: f64,
        /// Name of the metadata file.
        file: String,
    },
    /// Most rows of a file cannot be used.
    #[error(
        "{first}; {bad} of {rows} rows cannot be used: the file is not what its layout states, and no rows can be left out"
    )]
    MostRows {
        /// Problem with the first of them.
        first: Box<TrajectoryFileProblem>,
        /// Number of rows that cannot be used.
        bad: u64,
        /// Number of rows that were read.
        rows: u64,
    },
    /// A file contains rows of several data sets.
    #[error("is `{actual}`, but `{first}` is needed as in the first row: one data set for each file")]
    SeveralRecordings {
        /// Data set name in the first row.
        first: String,
        /// Data set name in this row.
        actual: String,
    },
}

/// The category of rows of [`TrajectoryFileProblem::SharedNumber`].
pub(super) const SHARED_NUMBERS: &str = "rows of several vehicles with one number";

impl TrajectoryFileProblem {
    /// Returns `true` if the problem makes only one row unusable.
    pub fn affects_one_row(&self) -> bool {
        matches!(
            self,
            Self::ColumnCount { .. }
                | Self::OpenQuote
                | Self::Value { .. }
                | Self::DecimalComma { .. }
                | Self::NegativeSpeed { .. }
                | Self::HeadingUnit { .. }
                | Self::NoMarkings { .. }
                | Self::DuplicateRow { .. }
                | Self::SharedNumber { .. }
                | Self::UnevenTime { .. }
                | Self::TimeBackwards { .. }
                | Self::OffClock { .. }
                | Self::CutLine
                | Self::OtherCount { .. }
                | Self::NotText
                | Self::RepeatedHeader
        )
    }

    /// Returns `true` if the file can be read as a whole only: its rows are in no order that allows
    /// to read it piece by piece.
    pub(crate) fn needs_all_rows(&self) -> bool {
        matches!(
            self,
            Self::NotByVehicle { .. } | Self::NotByTime { .. } | Self::TooManyOpen { .. } | Self::SplitPiece { .. }
        )
    }

    /// Returns the category of a problem with a row, under which such rows are counted.
    pub(super) fn kind(&self) -> &'static str {
        match self {
            Self::ColumnCount { .. } | Self::CutLine => "cut rows",
            Self::OpenQuote | Self::NotText => "rows that are not text",
            Self::Value { .. }
            | Self::RepeatedHeader
            | Self::DecimalComma { .. }
            | Self::NegativeSpeed { .. }
            | Self::HeadingUnit { .. }
            | Self::NoMarkings { .. } => "values that are not allowed",
            Self::DuplicateRow { .. } => "duplicated rows",
            Self::SharedNumber { .. } => SHARED_NUMBERS,
            Self::UnevenTime { .. } | Self::OffClock { .. } => "times off the clock",
            Self::TimeBackwards { .. } => "times that go back",
            Self::OtherCount { .. } => "vehicles with rows missing",
            _ => "other",
        }
    }
}

/// An error while writing a trajectory file. A file that existed before at the same path is left
/// unchanged.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The file cannot be written.
    #[error("failed to write the trajectory file {}: {source}", path.display())]
    Io {
        /// Path of the file.
        path: PathBuf,
        /// The underlying I/O error.
        source: io::Error,
    },
    /// A number is not finite.
    #[error("failed to write the trajectory file: {quantity} of track {track_id} at {time_s} s is not finite")]
    NotFinite {
        /// Number of the track.
        track_id: u64,
        /// Time of the point (s).
        time_s: f64,
        /// Name of the quantity.
        quantity: &'static str,
    },
    /// The time of a point lies between two frames.
    #[error(
        "failed to write the trajectory file: track {track_id} at {time_s} s lies between two frames of {period_s} s"
    )]
    OffClock {
        /// Number of the track.
        track_id: u64,
        /// Time of the point (s).
        time_s: f64,
        /// Time between two frames (s).
        period_s: f64,
    },
}
