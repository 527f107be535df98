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
//! another format. The reader therefore infers the road from the traffic, in two passes before it
//! reads the rows. The reference line of each direction is the longest path of a vehicle that keeps
//! its lane. The lanes beside it are as wide as the mean recorded lane width. On either side, the
//! outermost lane is the last lane that holds at least 2 % of its direction's rows. Lateral
//! positions are thus relative to the path of one driver and contain its slow weaving of a
//! decimetre or two. Vehicles on ramps count as being in the outermost lane.
//!
//! The reader shifts the second direction 1 km to the right of the first, as it does with highD's
//! upper carriageway.

use std::collections::BTreeMap;
use std::io::BufRead;
use std::path::Path;

use closecall_traffic::{Lane, Time, maths};

use super::class_names::{UnknownClass, UnknownClasses};
use super::data::MarkingDistances;
use super::error::{TrajectoryFileError, TrajectoryFileProblem};
use super::fields::{Bounds, FieldError, integer, number, wrong_value};
use super::file_layout::Layout;
use super::file_set::{Meta, RecordingMeta, VehicleMeta};
use super::header::Header;
use super::highd::{SPEED_MPS, check_row_counts};
use super::input::{Digest, open_file, with_path};
use super::markings::{DEFAULT_LANE_WIDTH_M, LaneMarkings};
use super::plain::allowed;
use super::reference_line::{Point, ReferenceLine};
use super::rows::{Fields, Lines, Separator};
use super::source::{Clock, FileInfo, ReadError, Row};
use super::text_layout::TextLayout;

const HEADING_DEG: Bounds = Bounds::closed(-360.0, 720.0);
const LANE_WIDTH_M: Bounds = Bounds::closed(2.0, 6.0);

/// Lane width if the recorded lane widths give none (m).
const FALLBACK_LANE_WIDTH_M: f64 = DEFAULT_LANE_WIDTH_M;

/// Minimum distance between two points of a path (m).
const SPACING_M: f64 = 2.0;

/// Maximum number of points of a path, which then has a length of 20 km.
const MAX_POINTS: usize = 10_000;

/// Maximum number of directions in one data set: two of the motorway and two of a crossing road.
const MAX_DIRECTIONS: usize = 4;

/// Minimum share of its direction's rows that a lane holds.
const MIN_SHARE: f64 = 0.02;

/// Maximum number of lanes considered on either side of the reference line.
const MAX_LANES_BESIDE: i64 = 20;

/// Distance by which each direction is shifted to the right of the previous one (m).
const SEPARATION_M: f64 = 1_000.0;

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
        })
    }

    /// Returns the vehicle number, the position and the heading (rad) of a row.
    fn pose(&self, line: &str, fields: &Fields) -> Result<(u64, Point, f64), FieldError> {
        let real = |index, name, bounds| number(fields.get(line, index), name, bounds);
        let track = integer(fields.get(line, self.track), "trackId", allowed::IDS)?.unsigned_abs();
        let (x_m, y_m) = (real(self.x, "xCenter", allowed::PLANE_M)?, real(self.y, "yCenter", allowed::PLANE_M)?);
        Ok((track, (x_m, y_m), real(self.heading, "heading", HEADING_DEG)?.to_radians()))
    }
}

/// One direction of the road, as inferred from the traffic.
#[derive(Clone, Debug)]
struct Direction {
    heading_rad: f64,
    line: ReferenceLine,
    /// Number of lanes to the left of the reference line's own lane.
    left: i64,
    lanes: i64,
    /// Offset of the lane numbers, so that directions share no lane.
    first_lane: i64,
    /// Offset of the lateral position, so that directions do not meet (m).
    shift_m: f64,
}

/// The road of a data set, as inferred from its traffic.
#[derive(Clone, Debug)]
pub(super) struct InferredRoad {
    lane_width_m: f64,
    directions: Vec<Direction>,
}

/// The path of one vehicle.
#[derive(Clone, Debug, Default)]
struct DrivenPath {
    vehicle: Option<u64>,
    heading_rad: f64,
    points: Vec<Point>,
    changes_lanes: bool,
}

/// Reads the rows of `NN_tracks.csv`.
pub(super) struct ExidColumns {
    columns: ColumnIndices,
    data: RecordingMeta,
    vehicles: BTreeMap<u64, VehicleMeta>,
    meta_file: String,
    unknown_classes: UnknownClasses,
    road: InferredRoad,
    /// The vehicle of the previous row and the index of its direction.
    latest: Option<(u64, usize)>,
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
            latest: None,
            unknown_classes,
        })
    }
}

impl InferredRoad {
    /// Reads the rows of a file twice: first for the reference lines, then for the lanes beside
    /// them. It ignores unusable rows, because the later reading of the rows reports them.
    ///
    /// # Errors
    /// Fails if the file cannot be read or no vehicle moves.
    pub(super) fn from_traffic(path: &Path) -> Result<Self, TrajectoryFileError> {
        let mut paths: Vec<(bool, f64, DrivenPath)> = Vec::new();
        let mut current = DrivenPath::default();
        let (mut width_sum_m, mut widths) = (0.0, 0_u32);
        each_row(path, |columns, line, fields| {
            let Ok((track, point, heading_rad)) = columns.pose(line, fields) else { return };
            let field = |column: Option<usize>| column.map_or("", |index| fields.get(line, index));
            if let Ok(metres) = number(first_of(field(columns.lane_width)), "laneWidth", LANE_WIDTH_M) {
                width_sum_m += metres;
                widths = widths.saturating_add(1);
            }
            if current.vehicle != Some(track) {
                keep_best_path(&mut paths, std::mem::take(&mut current));
                current = DrivenPath { vehicle: Some(track), heading_rad, ..DrivenPath::default() };
            }
            current.changes_lanes |= first_of(field(columns.lane_change)) == "1";
            let is_far = |last: &Point| maths::hypot(point.0 - last.0, point.1 - last.1) >= SPACING_M;
            if current.points.last().is_none_or(is_far) && current.points.len() < MAX_POINTS {
                current.points.push(point);
            }
        })?;
        keep_best_path(&mut paths, current);
        let lane_width_m = if widths > 0 { width_sum_m / f64::from(widths) } else { FALLBACK_LANE_WIDTH_M };
        let directions = paths.into_iter().filter_map(|(_, _, path)| {
            let line = ReferenceLine::through(path.points.into_iter());
            line.length_m()?;
            let heading_rad = path.heading_rad;
            Some(Direction { heading_rad, line, left: 0, lanes: 1, first_lane: 0, shift_m: 0.0 })
        });
        let mut road = Self { lane_width_m, directions: directions.collect() };
        if road.directions.is_empty() {
            return Err(with_path(path, ReadError::of_file(TrajectoryFileProblem::NothingMoves)));
        }
        road.count_lanes(path)?;
        Ok(road)
    }

    /// Counts the rows in each lane, and from them sets the lanes of each direction.
    fn count_lanes(&mut self, path: &Path) -> Result<(), TrajectoryFileError> {
        let mut rows: BTreeMap<(usize, i64), u64> = BTreeMap::new();
        each_row(path, |columns, line, fields| {
            if let Ok((_, point, heading_rad)) = columns.pose(line, fields)
                && let Some(direction) = self.direction(heading_rad)
            {
                let lane = self.lane_beside(self.directions[direction].line.project(point).d_m);
                *rows.entry((direction, lane)).or_default() += 1;
            }
        })?;
        let (mut first_lane, mut shift_m) = (0, 0.0);
        for (index, direction) in self.directions.iter_mut().enumerate() {
            let in_direction = || rows.iter().filter(|((other, _), _)| *other == index);
            let least = MIN_SHARE * in_direction().map(|(_, count)| *count).sum::<u64>() as f64;
            let used = || in_direction().filter(|(_, count)| **count as f64 >= least).map(|((_, lane), _)| *lane);
            let (left, right) = (used().max().unwrap_or(0).max(0), used().min().unwrap_or(0).min(0));
            (direction.left, direction.lanes) = (left, left - right + 1);
            (direction.first_lane, direction.shift_m) = (first_lane, shift_m);
            first_lane += direction.lanes + 1;
            shift_m -= self.lane_width_m * direction.lanes as f64 + SEPARATION_M;
        }
        Ok(())
    }

    /// Returns the index of the direction that agrees best with `heading_rad`.
    fn direction(&self, heading_rad: f64) -> Option<usize> {
        let agrees = |direction: &Direction| maths::cos(heading_rad - direction.heading_rad);
        let ranked = self.directions.iter().map(agrees).enumerate();
        ranked.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(index, _)| index)
    }

    /// Returns by how many lanes `d_m` lies to the left of the reference line's lane.
    fn lane_beside(&self, d_m: f64) -> i64 {
        #[expect(clippy::cast_possible_truncation, reason = "a float cast saturates, and what is far away is clamped")]
        let lane = (d_m / self.lane_width_m).round() as i64;
        lane.clamp(-MAX_LANES_BESIDE, MAX_LANES_BESIDE)
    }

    /// Returns the lane markings of all directions.
    fn markings(&self) -> LaneMarkings {
        let edges = self.directions.iter().flat_map(|direction| {
            // Lane 0 of the first direction does not exist. Lane 0 of a later direction is the
            // omitted lane, whose right edge is the direction's left edge.
            (0..=direction.lanes).map(move |lane| {
                let edge_m = direction.shift_m - self.lane_width_m * lane as f64;
                (u8::try_from(direction.first_lane + lane).unwrap_or(u8::MAX), edge_m)
            })
        });
        LaneMarkings::from_right_edges(edges.filter(|(lane, _)| *lane > 0).map(|(lane, edge_m)| (Lane(lane), edge_m)))
    }
}

/// Keeps the best path of each direction. A path without a lane change is better than a path with
/// one, and a longer path is better than a shorter path.
fn keep_best_path(paths: &mut Vec<(bool, f64, DrivenPath)>, path: DrivenPath) {
    let Some(length_m) = ReferenceLine::through(path.points.iter().copied()).length_m() else { return };
    let stays = !path.changes_lanes;
    let same = |kept: &&mut (bool, f64, DrivenPath)| maths::cos(kept.2.heading_rad - path.heading_rad) > 0.0;
    match paths.iter_mut().find(same) {
        Some(kept) if (stays, length_m) > (kept.0, kept.1) => *kept = (stays, length_m, path),
        Some(_) => {}
        None => {
            paths.push((stays, length_m, path));
            paths.truncate(MAX_DIRECTIONS);
        }
    }
}

/// Returns the first of the values in `text` that semicolons separate.
fn first_of(text: &str) -> &str {
    text.split(';').next().unwrap_or_default().trim()
}

/// Calls `visit` with each row that has as many fields as the header.
fn each_row(path: &Path, mut visit: impl FnMut(&ColumnIndices, &str, &Fields)) -> Result<(), TrajectoryFileError> {
    let in_file = |error| with_path(path, error);
    let input = Digest::default().input(open_file(path)?).map_err(in_file)?;
    rows(input, &mut visit).map_err(in_file)
}

fn rows(input: impl BufRead, visit: &mut impl FnMut(&ColumnIndices, &str, &Fields)) -> Result<(), ReadError> {
    let mut lines = Lines::new(input);
    let mut fields = Fields::default();
    let mut columns = None;
    loop {
        match lines.next() {
            Ok(Some((number, line))) => {
                let split = fields.split(line, Separator::Comma);
                let Some((needed, indices)) = &columns else {
                    split.map_err(|problem| ReadError::new(number, problem))?;
                    let header = Header::new((0..fields.len()).map(|index| fields.get(line, index)));
                    let indices = ColumnIndices::new(&header).map_err(|problem| ReadError::new(number, problem))?;
                    columns = Some((fields.len(), indices));
                    continue;
                };
                if split.is_ok() && fields.len() == *needed {
                    visit(indices, line, &fields);
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
        // A vehicle keeps the direction of its first row, also on a curved ramp.
        let latest_index = self.latest.filter(|(latest, _)| *latest == track).map(|(_, index)| index);
        let index = latest_index.or_else(|| self.road.direction(heading_rad)).unwrap_or(0);
        self.latest = Some((track, index));
        let Some(direction) = self.road.directions.get(index) else { return Ok(None) };
        let projection = direction.line.project(point);
        let width_m = self.road.lane_width_m;
        let lane = (direction.left - self.road.lane_beside(projection.d_m) + 1).clamp(1, direction.lanes);
        let frame = integer(fields.get(line, self.columns.frame), "frame", allowed::FRAMES)?;
        Ok(Some(Row {
            number: track,
            origin: Time::ZERO,
            vehicle_id: track,
            frame,
            time: Time::from_s(frame as f64 / self.data.frame_rate_hz),
            clock: Clock::Continuous,
            s_m: projection.s_m,
            d_m: projection.d_m - width_m * (direction.left as f64 + 0.5) + direction.shift_m,
            lane: u8::try_from(lane + direction.first_lane).unwrap_or(u8::MAX),
            speed_mps: real(self.columns.speed, "lonVelocity", SPEED_MPS)?,
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
