//! The layout of exiD: three files per data set, in metres in a local plane, y *up*, headings in
//! degrees.
//!
//! (T. Moers et al., "The exiD Dataset", IV 2022; column names as in the data set's documentation.)
//!
//! - `NN_tracks.csv`: rows
//!   `recordingId, trackId, frame, …, xCenter, yCenter, heading, width, length, …, lonVelocity, …, lonAcceleration, …, laneWidth, laneletId, laneChange, …`.
//!   `width` is the vehicle's width here.
//! - `NN_tracksMeta.csv`: class of each vehicle, and its number of rows, which the reader checks.
//! - `NN_recordingMeta.csv`: frame rate.
//!
//! **Road frame.** The files name lanelets, but the shapes of the lanelets are in a separate map of
//! another format. The reader therefore infers the road from the traffic before it reads the rows;
//! see `inferred_road`. It first sorts rows that are in another order than in the data set.
//! Lanelets that follow one another are one lane; see `stated_lanes`. A vehicle changes its lane
//! where `laneChange` is 1, or where its offset from the lane's centre jumps. The offset also shows
//! whether the positions are mirrored; see `orientation`.
//!
//! **inD, rounD.** The columns of these data sets are the first columns of exiD. The data sets
//! record intersections and roundabouts, where vehicles do not follow lanes. The reader gives a
//! warning, and refuses a file in which most vehicles follow no road.

use std::collections::{BTreeMap, BTreeSet};
use std::io::BufRead;
use std::path::Path;

use closecall_traffic::{Side, Time};

use super::class_names::{UnknownClass, UnknownClasses};
use super::data::MarkingDistances;
use super::error::{TrajectoryFileError, TrajectoryFileProblem};
use super::fields::{Bounds, FieldError, integer, number, wrong_value};
use super::file_layout::Layout;
use super::file_set::{Meta, RecordingMeta, VehicleMeta};
use super::header::Header;
use super::highd::{SPEED_MPS, check_row_counts};
use super::inferred_road::{InferredRoad, Placed, Pose};
use super::input::{Digest, open_file, with_path};
use super::markings::DEFAULT_LANE_WIDTH_M;
use super::order::WINDOW_ROWS;
use super::orientation::{LaneOffset, OffsetSides};
use super::plain::allowed;
use super::plane_pieces::{PlaneMoment, PlanePieces};
use super::plane_steps::PlaneSteps;
use super::reference_line::Point;
use super::rows::{Fields, Lines, Separator};
use super::source::{Clock, FileInfo, ReadError, Row};
use super::stated_lanes::StatedLane;
use super::text_layout::TextLayout;

const HEADING_DEG: Bounds = Bounds::closed(-360.0, 720.0);
const LANE_WIDTH_M: Bounds = Bounds::closed(2.0, 6.0);
/// Numbers of lanelets, and the number that means no lanelet.
const LANELETS: (i64, i64) = (-allowed::IDS.1, allowed::IDS.1);
const NO_LANELET: i64 = -1;

/// Step of the offset from the lane's centre that shows a change of lane, as a share of the lane
/// width (-): the offset jumps by a whole lane width, and within a lane it is continuous.
const OFFSET_JUMP_SHARE: f64 = 0.5;

/// The column indices of exiD's quantities.
#[derive(Clone, Debug)]
struct ColumnIndices {
    data: Option<usize>,
    track: usize,
    frame: usize,
    x: usize,
    y: usize,
    heading: usize,
    width: usize,
    length: usize,
    speed: usize,
    acceleration: usize,
    lane_width: Option<usize>,
    lane_change: Option<usize>,
    lane_offset: Option<usize>,
    /// Index of the column that names the lanelets; inD and rounD have none.
    lanelet: Option<usize>,
}

impl ColumnIndices {
    fn new(header: &Header) -> Result<Self, TrajectoryFileProblem> {
        let need = |name| header.require(name, "exiD");
        Ok(Self {
            data: header.find("recordingId"),
            track: need("trackId")?,
            frame: need("frame")?,
            x: need("xCenter")?,
            y: need("yCenter")?,
            heading: need("heading")?,
            width: need("width")?,
            length: need("length")?,
            speed: need("lonVelocity")?,
            acceleration: need("lonAcceleration")?,
            lane_width: header.find("laneWidth"),
            lane_change: header.find("laneChange"),
            lane_offset: header.find("latLaneCenterOffset"),
            lanelet: header.find("laneletId"),
        })
    }

    /// Returns the lanelet that a row names; `None` if its field is empty or -1.
    fn named_lane(&self, line: &str, fields: &Fields) -> Result<Option<StatedLane>, FieldError> {
        let text = self.lanelet.map_or("", |index| first_of(fields.get(line, index)));
        if text.is_empty() {
            return Ok(None);
        }
        let lanelet = integer(text, "laneletId", LANELETS)?;
        // Maps of the format may have negative numbers.
        let edge = u64::from_ne_bytes(lanelet.to_ne_bytes());
        Ok((lanelet != NO_LANELET).then_some(StatedLane { edge, index: None }))
    }

    /// Returns what a row shows of the road.
    fn plane_row(&self, line: &str, fields: &Fields) -> Result<PlaneRow, FieldError> {
        let (vehicle, point, heading_rad) = self.pose(line, fields)?;
        let field = |column: Option<usize>| first_of(column.map_or("", |index| fields.get(line, index)));
        let flag = field(self.lane_change);
        let is_one = || integer(flag, "laneChange", (0, 1)).is_ok_and(|flag| flag == 1);
        Ok(PlaneRow {
            vehicle,
            frame: integer(fields.get(line, self.frame), "frame", allowed::FRAMES)?,
            point,
            heading_rad,
            speed_mps: number(fields.get(line, self.speed), "lonVelocity", SPEED_MPS)?,
            lane_width_m: number(field(self.lane_width), "laneWidth", LANE_WIDTH_M).ok(),
            offset_m: self.offset_m(line, fields),
            is_flagged: flag.eq_ignore_ascii_case("true") || is_one(),
            // The reading of the rows reports a wrong number.
            named_lane: self.named_lane(line, fields).unwrap_or_default(),
        })
    }

    /// Returns the offset of a vehicle from the centre of its lane (m).
    fn offset_m(&self, line: &str, fields: &Fields) -> Option<f64> {
        let offset_m: f64 = first_of(fields.get(line, self.lane_offset?)).parse().ok()?;
        offset_m.is_finite().then_some(offset_m)
    }

    /// Returns the vehicle number, the position and the heading (rad) of a row.
    fn pose(&self, line: &str, fields: &Fields) -> Result<(u64, Point, f64), FieldError> {
        let real = |index, name, bounds| number(fields.get(line, index), name, bounds);
        let track = integer(fields.get(line, self.track), "trackId", allowed::IDS)?.unsigned_abs();
        let (x_m, y_m) = (real(self.x, "xCenter", allowed::PLANE_M)?, real(self.y, "yCenter", allowed::PLANE_M)?);
        Ok((track, (x_m, y_m), real(self.heading, "heading", HEADING_DEG)?.to_radians()))
    }
}

/// What a row shows of the road.
#[derive(Clone, Copy, Debug)]
struct PlaneRow {
    vehicle: u64,
    frame: i64,
    point: Point,
    heading_rad: f64,
    speed_mps: f64,
    lane_width_m: Option<f64>,
    offset_m: Option<f64>,
    /// `true` if `laneChange` says that the vehicle leaves its lane.
    is_flagged: bool,
    named_lane: Option<StatedLane>,
}

impl PlaneRow {
    /// Returns the vehicle in the plane.
    fn moment(&self, frame_rate_hz: f64) -> PlaneMoment {
        let Self { vehicle, frame, point, heading_rad, speed_mps, .. } = *self;
        let (time, clock) = (Time::from_s(frame as f64 / frame_rate_hz), Clock::Continuous);
        PlaneMoment { vehicle, time, point, heading_rad, speed_mps, clock }
    }
}

/// Turns rows into poses. The rows of a vehicle have to follow one another.
struct Poses {
    frame_rate_hz: f64,
    pieces: PlanePieces,
    /// The piece of a vehicle in the row before, and its offset from the centre of its lane (m).
    latest: Option<(u64, f64)>,
}

impl Poses {
    fn new(frame_rate_hz: f64) -> Self {
        Self { frame_rate_hz, pieces: PlanePieces::default(), latest: None }
    }

    fn of_row(&mut self, row: &PlaneRow) -> Pose {
        let PlaneRow { point, heading_rad, lane_width_m, offset_m, named_lane, .. } = *row;
        let vehicle = self.pieces.number(row.moment(self.frame_rate_hz));
        // The flag alone is not enough: in some files it is 0 throughout. The offset from the
        // centre of the lane jumps where a vehicle enters the next lane.
        let before_m = self.latest.filter(|(before, _)| *before == vehicle).map(|(_, offset_m)| offset_m);
        let least_m = OFFSET_JUMP_SHARE * lane_width_m.unwrap_or(DEFAULT_LANE_WIDTH_M);
        let jumps = before_m.zip(offset_m).is_some_and(|(before_m, now_m)| (now_m - before_m).abs() > least_m);
        self.latest = offset_m.map(|offset_m| (vehicle, offset_m));
        Pose { vehicle, point, heading_rad, lane_width_m, changes_lane: jumps || row.is_flagged, named_lane }
    }
}

/// Reads the rows of `NN_tracks.csv`.
pub(super) struct ExidColumns {
    columns: ColumnIndices,
    data: RecordingMeta,
    vehicles: BTreeMap<u64, VehicleMeta>,
    meta_file: String,
    unknown_classes: UnknownClasses,
    road: InferredRoad,
    pieces: PlanePieces,
    /// The piece of a vehicle in the previous row, and the index of its direction.
    latest: Option<(u64, usize)>,
    sides: OffsetSides,
}

impl ExidColumns {
    /// Finds the columns in `header`.
    ///
    /// # Errors
    /// Fails if a required column is missing.
    pub(super) fn new(header: &Header, meta: Meta, road: InferredRoad) -> Result<Self, TrajectoryFileProblem> {
        let Meta { data, vehicles, file, unknown_classes } = meta;
        Ok(Self {
            columns: ColumnIndices::new(header)?,
            data,
            vehicles,
            meta_file: file,
            road,
            pieces: PlanePieces::default(),
            latest: None,
            sides: OffsetSides::default(),
            unknown_classes,
        })
    }
}

/// Infers the road of a data set from its rows. Unusable rows are ignored here, because the later
/// reading of the rows reports them.
///
/// # Errors
/// Fails if the file cannot be read, no vehicle moves, positions contradict headings or speeds, the vehicles do
/// not follow a road, or a file of more than [`WINDOW_ROWS`] rows is not sorted by vehicle.
pub(super) fn road_from_traffic(path: &Path, frame_rate_hz: f64) -> Result<InferredRoad, TrajectoryFileError> {
    let of_file = |problem| with_path(path, ReadError::of_file(problem));
    let mut steps = PlaneSteps::default();
    let road = if is_sorted(path, |row| steps.add(row.moment(frame_rate_hz)))? {
        steps.check(Layout::Exid).map_err(of_file)?;
        InferredRoad::of(|visit| {
            let mut poses = Poses::new(frame_rate_hz);
            each_plane_row(path, |_, row| {
                visit(poses.of_row(row));
                Ok(())
            })
        })?
    } else {
        let rows = sorted_rows(path)?;
        let mut steps = PlaneSteps::default();
        rows.iter().for_each(|row| steps.add(row.moment(frame_rate_hz)));
        steps.check(Layout::Exid).map_err(of_file)?;
        InferredRoad::of(|visit| {
            let mut poses = Poses::new(frame_rate_hz);
            rows.iter().for_each(|row| visit(poses.of_row(row)));
            Ok::<(), TrajectoryFileError>(())
        })?
    };
    road.map_err(of_file)
}

/// Returns true if the rows of each vehicle follow one another in the order of their frames. Calls `visit` with
/// each row.
fn is_sorted(path: &Path, mut visit: impl FnMut(&PlaneRow)) -> Result<bool, TrajectoryFileError> {
    let mut ended: BTreeSet<u64> = BTreeSet::new();
    let mut latest: Option<(u64, i64)> = None;
    let mut is_sorted = true;
    each_plane_row(path, |_, row| {
        match latest {
            Some((vehicle, frame)) if vehicle == row.vehicle => is_sorted &= row.frame >= frame,
            Some((vehicle, _)) => {
                ended.insert(vehicle);
                is_sorted &= !ended.contains(&row.vehicle);
            }
            None => {}
        }
        latest = Some((row.vehicle, row.frame));
        visit(row);
        Ok(())
    })?;
    Ok(is_sorted)
}

/// Returns the rows in the order of vehicles and frames.
fn sorted_rows(path: &Path) -> Result<Vec<PlaneRow>, TrajectoryFileError> {
    let mut rows: Vec<PlaneRow> = Vec::new();
    each_plane_row(path, |line, row| {
        if rows.len() >= WINDOW_ROWS {
            let problem = TrajectoryFileProblem::NotByVehicle { vehicle: row.vehicle, rows: WINDOW_ROWS };
            return Err(ReadError::new(line, problem));
        }
        rows.push(*row);
        Ok(())
    })?;
    rows.sort_by_key(|row| (row.vehicle, row.frame));
    Ok(rows)
}

/// Returns the first of the values in `text` that semicolons separate.
fn first_of(text: &str) -> &str {
    text.split(';').next().unwrap_or_default().trim()
}

/// Calls `visit` with the line number and the content of each row that can be used.
///
/// # Errors
/// Fails if the file cannot be read, or with the first error of `visit`.
fn each_plane_row(
    path: &Path,
    mut visit: impl FnMut(u64, &PlaneRow) -> Result<(), ReadError>,
) -> Result<(), TrajectoryFileError> {
    let in_file = |error| with_path(path, error);
    let input = Digest::default().input(open_file(path)?).map_err(in_file)?;
    visit_rows(input, &mut visit).map_err(in_file)
}

fn visit_rows(
    input: impl BufRead,
    visit: &mut impl FnMut(u64, &PlaneRow) -> Result<(), ReadError>,
) -> Result<(), ReadError> {
    let mut lines = Lines::new(input);
    let mut fields = Fields::default();
    let mut columns: Option<(Separator, usize, ColumnIndices)> = None;
    loop {
        match lines.next() {
            Ok(Some((number, line))) => {
                let Some((separator, needed, indices)) = &columns else {
                    let at_header = |problem: TrajectoryFileProblem| ReadError::new(number, problem);
                    let (header, separator, width) = Header::parse(line).map_err(at_header)?;
                    let indices = ColumnIndices::new(&header).map_err(at_header)?;
                    columns = Some((separator, width, indices));
                    continue;
                };
                let is_row = fields.split(line, *separator).is_ok() && fields.len() == *needed;
                if is_row && let Ok(row) = indices.plane_row(line, &fields) {
                    visit(number, &row)?;
                }
            }
            Ok(None) => return Ok(()),
            Err((number, problem)) => {
                let error = ReadError::new(number, problem);
                if !error.affects_one_row() {
                    return Err(error);
                }
            }
        }
    }
}

impl TextLayout for ExidColumns {
    fn info(&self) -> FileInfo {
        FileInfo {
            layout: Layout::Exid,
            name: Some(self.data.id.clone()),
            period: Some(Time::from_s(1.0 / self.data.frame_rate_hz)),
            markings: Some(self.road.markings()),
        }
    }

    fn unknown_classes(&self) -> &[UnknownClass] {
        self.unknown_classes.names()
    }

    fn warnings(&self) -> Vec<String> {
        let urban = self.columns.lanelet.is_none().then(|| {
            "no column names lanelets, as in inD and rounD, which record intersections and roundabouts: the lanes are derived \
             from the traffic, and the quantities of motorway traffic may mean nothing here"
                .to_owned()
        });
        urban.into_iter().chain(self.road.warnings()).collect()
    }

    fn is_in_doubt(&self) -> bool {
        self.road.is_in_doubt()
    }

    fn names_sides(&self) -> bool {
        self.columns.lane_offset.is_some()
    }

    fn derives_lanes(&self) -> bool {
        !self.road.names_lanes()
    }

    fn oncoming_side(&self) -> Option<Side> {
        self.road.oncoming_side()
    }

    fn check_sides(&self, is_mirrored: bool) -> Result<(), TrajectoryFileProblem> {
        self.sides.check(is_mirrored, self.vehicles.len())
    }

    fn data<'l>(&self, line: &'l str, fields: &Fields) -> Option<(&'static str, &'l str)> {
        self.columns.data.map(|index| ("recordingId", fields.get(line, index)))
    }

    fn parse(&mut self, line: &str, fields: &Fields) -> Result<Option<Row>, FieldError> {
        let (track, point, heading_rad) = self.columns.pose(line, fields)?;
        let real = |index, name, bounds| number(fields.get(line, index), name, bounds);
        let Some(vehicle) = self.vehicles.get_mut(&track) else {
            let text = fields.get(line, self.columns.track);
            return Err(FieldError::at(
                "trackId",
                wrong_value(text, format!("one of the vehicles in {}", self.meta_file)),
            ));
        };
        vehicle.rows_read += 1;
        let class = vehicle.class;
        let frame = integer(fields.get(line, self.columns.frame), "frame", allowed::FRAMES)?;
        let time = Time::from_s(frame as f64 / self.data.frame_rate_hz);
        let speed_mps = real(self.columns.speed, "lonVelocity", SPEED_MPS)?;
        // A vehicle keeps the direction of its first row, also on a curved ramp.
        let clock = Clock::Continuous;
        let piece = self.pieces.number(PlaneMoment { vehicle: track, time, point, heading_rad, speed_mps, clock });
        let latest_index = self.latest.filter(|(latest, _)| *latest == piece).map(|(_, index)| index);
        let index = latest_index.or_else(|| self.road.direction(heading_rad)).unwrap_or(0);
        self.latest = Some((piece, index));
        let named_lane = self.columns.named_lane(line, fields)?;
        let Some(Placed { s_m, d_m, lane }) = self.road.place(index, point, named_lane) else { return Ok(None) };
        if let Some(offset_m) = self.columns.offset_m(line, fields) {
            self.sides.add(LaneOffset { vehicle: piece, d_m, offset_m, lane });
        }
        Ok(Some(Row {
            number: track,
            origin: Time::ZERO,
            vehicle_id: track,
            frame,
            time,
            clock,
            s_m,
            d_m,
            lane,
            speed_mps,
            acceleration_mps2: Some(real(self.columns.acceleration, "lonAcceleration", allowed::ACCELERATION_MPS2)?),
            length_m: real(self.columns.length, "length", allowed::LENGTH_M)?,
            width_m: real(self.columns.width, "width", allowed::WIDTH_M)?,
            class,
            marking_distances: MarkingDistances::default(),
            line: 0,
        }))
    }

    fn end(&mut self) -> Result<(), FieldError> {
        check_row_counts(&mut self.vehicles, &self.meta_file)
    }
}
