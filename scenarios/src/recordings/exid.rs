//! The layout of exiD: three files for each recording, metres in a local plane, y *up*, headings in degrees.
//!
//! (T. Moers et al., "The exiD Dataset", IV 2022; column names as in the data set's documentation.)
//!
//! - `NN_tracks.csv`: rows `recordingId, trackId, frame, …, xCenter, yCenter, heading, width, length, …, lonVelocity, …,
//!   lonAcceleration, …, laneWidth, laneletId, laneChange, …`. `width` is the vehicle's width here.
//! - `NN_tracksMeta.csv`: class of each vehicle, and how many rows it has, which is checked.
//! - `NN_recordingMeta.csv`: frame rate.
//!
//! **The road's frame.** The files name lanelets, but their shapes are in a map that is a file of another format. So the
//! road is told from the traffic, in two passes before the rows are read: the reference line of each direction is the
//! longest path of a vehicle that keeps its lane, and the lanes are steps of the mean recorded lane width beside it, those in
//! which at least 2 % of the rows lie. Lateral positions are thus relative to how one driver drove: slow weaving by a decimetre or
//! two is in them. Vehicles on ramps count to the outermost lane.
//!
//! The second direction is laid 1 km to the right of the first, as the upper carriageway of highD is.

use std::collections::BTreeMap;
use std::io::BufRead;
use std::path::Path;

use closecall_traffic::{Lane, Time};

use super::fields::{Bounds, Fault, integer, number, wrong_value};
use super::file_set::{Meta, RecordingMeta, VehicleMeta};
use super::highd::{SPEED_MPS, count_rows};
use super::layout::{Header, TextLayout};
use super::open::{Digest, at, open_file};
use super::plain::allowed;
use super::reference_line::{Point, ReferenceLine};
use super::rows::{Fields, Lines, Separator};
use super::source::{About, Clock, Refusal, Row};
use super::{LaneMarkings, Layout, MarkingDistances, RecordingError, RecordingProblem};

const HEADING_DEG: Bounds = Bounds::closed(-360.0, 720.0);
const LANE_WIDTH_M: Bounds = Bounds::closed(2.0, 6.0);

/// Where the recorded lane widths tell none [m].
const USUAL_LANE_WIDTH_M: f64 = super::DEFAULT_LANE_WIDTH_M;

/// Points of a path are this far apart [m].
const SPACING_M: f64 = 2.0;

/// The most points of a path: 20 km.
const MOST_POINTS: usize = 10_000;

/// Directions in one recording: of a motorway, and of a road across.
const MOST_DIRECTIONS: usize = 4;

/// A lane has at least this share of the rows of its direction.
const LEAST_SHARE: f64 = 0.02;

/// The most lanes beside the reference line that are looked at, on either side.
const MOST_BESIDE: i64 = 20;

/// How far to the right of the direction before the next one is laid [m].
const APART_M: f64 = 1_000.0;

/// Where the quantities of exiD stand.
#[derive(Clone, Debug)]
struct Places {
    recording: Option<usize>,
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

impl Places {
    fn new(header: &Header) -> Result<Self, RecordingProblem> {
        let need = |name| header.need(name, "exiD");
        Ok(Self {
            recording: header.find("recordingId"),
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

    fn pose(&self, line: &str, fields: &Fields) -> Result<(u64, Point, f64), Fault> {
        let real = |index, name, bounds| number(fields.get(line, index), name, bounds);
        let track = integer(fields.get(line, self.track), "trackId", allowed::IDS)?.unsigned_abs();
        let (x_m, y_m) = (real(self.x, "xCenter", allowed::PLANE_M)?, real(self.y, "yCenter", allowed::PLANE_M)?);
        Ok((track, (x_m, y_m), real(self.heading, "heading", HEADING_DEG)?.to_radians()))
    }
}

/// One direction of the road, as the traffic tells it.
#[derive(Clone, Debug)]
struct Direction {
    heading_rad: f64,
    line: ReferenceLine,
    /// Lanes to the left of the reference line's own.
    left: i64,
    lanes: i64,
    /// What is added to the lane and to d, so that directions do not meet.
    first_lane: i64,
    shift_m: f64,
}

/// What the traffic of a recording tells about its road.
#[derive(Clone, Debug)]
pub(super) struct Survey {
    lane_width_m: f64,
    directions: Vec<Direction>,
}

/// A path that a vehicle took.
#[derive(Clone, Debug, Default)]
struct Driven {
    vehicle: Option<u64>,
    heading_rad: f64,
    points: Vec<Point>,
    changes_lanes: bool,
}

/// Reads rows of `NN_tracks.csv`.
pub(super) struct ExidColumns {
    places: Places,
    recording: RecordingMeta,
    vehicles: BTreeMap<u64, VehicleMeta>,
    meta_file: String,
    survey: Survey,
    /// The direction of the vehicle of the row before.
    latest: Option<(u64, usize)>,
}

impl ExidColumns {
    /// # Errors
    /// Where a column is missing that the reader needs.
    pub(super) fn new(header: &Header, meta: Meta, survey: Survey) -> Result<Self, RecordingProblem> {
        let Meta { recording, vehicles, file } = meta;
        Ok(Self { places: Places::new(header)?, recording, vehicles, meta_file: file, survey, latest: None })
    }
}

impl Survey {
    /// Reads a recording's rows twice: for the reference lines, and for the lanes beside them. Rows that cannot be used are
    /// told when they are read for good.
    ///
    /// # Errors
    /// Where the file cannot be read, or no vehicle moves.
    pub(super) fn of(path: &Path) -> Result<Self, RecordingError> {
        let mut paths: Vec<(bool, f64, Driven)> = Vec::new();
        let mut current = Driven::default();
        let (mut width_sum_m, mut widths) = (0.0, 0_u32);
        each_row(path, |places, line, fields| {
            let Ok((track, point, heading_rad)) = places.pose(line, fields) else { return };
            let field = |place: Option<usize>| place.map_or("", |index| fields.get(line, index));
            if let Ok(metres) = number(first_of(field(places.lane_width)), "laneWidth", LANE_WIDTH_M) {
                width_sum_m += metres;
                widths = widths.saturating_add(1);
            }
            if current.vehicle != Some(track) {
                keep(&mut paths, std::mem::take(&mut current));
                current = Driven { vehicle: Some(track), heading_rad, ..Driven::default() };
            }
            current.changes_lanes |= first_of(field(places.lane_change)) == "1";
            let is_far = |last: &Point| (point.0 - last.0).hypot(point.1 - last.1) >= SPACING_M;
            if current.points.last().is_none_or(is_far) && current.points.len() < MOST_POINTS {
                current.points.push(point);
            }
        })?;
        keep(&mut paths, current);
        let lane_width_m = if widths > 0 { width_sum_m / f64::from(widths) } else { USUAL_LANE_WIDTH_M };
        let directions = paths.into_iter().filter_map(|(_, _, path)| {
            let line = ReferenceLine::through(path.points.into_iter());
            line.length_m()?;
            let heading_rad = path.heading_rad;
            Some(Direction { heading_rad, line, left: 0, lanes: 1, first_lane: 0, shift_m: 0.0 })
        });
        let mut survey = Self { lane_width_m, directions: directions.collect() };
        if survey.directions.is_empty() {
            return Err(at(path, Refusal::of_file(RecordingProblem::NothingMoves)));
        }
        survey.count_lanes(path)?;
        Ok(survey)
    }

    fn count_lanes(&mut self, path: &Path) -> Result<(), RecordingError> {
        let mut rows: BTreeMap<(usize, i64), u64> = BTreeMap::new();
        each_row(path, |places, line, fields| {
            if let Ok((_, point, heading_rad)) = places.pose(line, fields)
                && let Some(direction) = self.direction(heading_rad)
            {
                let lane = self.lane_beside(self.directions[direction].line.project(point).d_m);
                *rows.entry((direction, lane)).or_default() += 1;
            }
        })?;
        let (mut first_lane, mut shift_m) = (0, 0.0);
        for (place, direction) in self.directions.iter_mut().enumerate() {
            let own = || rows.iter().filter(|((other, _), _)| *other == place);
            let least = LEAST_SHARE * own().map(|(_, count)| *count).sum::<u64>() as f64;
            let used = || own().filter(|(_, count)| **count as f64 >= least).map(|((_, lane), _)| *lane);
            let (left, right) = (used().max().unwrap_or(0).max(0), used().min().unwrap_or(0).min(0));
            (direction.left, direction.lanes) = (left, left - right + 1);
            (direction.first_lane, direction.shift_m) = (first_lane, shift_m);
            first_lane += direction.lanes + 1;
            shift_m -= self.lane_width_m * direction.lanes as f64 + APART_M;
        }
        Ok(())
    }

    /// The direction that `heading_rad` is driven in.
    fn direction(&self, heading_rad: f64) -> Option<usize> {
        let agrees = |direction: &Direction| (heading_rad - direction.heading_rad).cos();
        let ranked = self.directions.iter().map(agrees).enumerate();
        ranked.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(place, _)| place)
    }

    /// Lanes to the left of the reference line's.
    fn lane_beside(&self, d_m: f64) -> i64 {
        #[expect(clippy::cast_possible_truncation, reason = "a float cast saturates, and what is far away is clamped")]
        let lane = (d_m / self.lane_width_m).round() as i64;
        lane.clamp(-MOST_BESIDE, MOST_BESIDE)
    }

    fn markings(&self) -> LaneMarkings {
        let edges = self.directions.iter().flat_map(|direction| {
            // Lane 0 of the first direction is none; that of a later one is the lane left out, whose right edge it has.
            (0..=direction.lanes).map(move |lane| {
                let edge_m = direction.shift_m - self.lane_width_m * lane as f64;
                (u8::try_from(direction.first_lane + lane).unwrap_or(u8::MAX), edge_m)
            })
        });
        LaneMarkings::stated(edges.filter(|(lane, _)| *lane > 0).map(|(lane, edge_m)| (Lane(lane), edge_m)))
    }
}

/// Keeps the path that tells its direction best: of a vehicle that stays in its lane, and long.
fn keep(paths: &mut Vec<(bool, f64, Driven)>, path: Driven) {
    let Some(length_m) = ReferenceLine::through(path.points.iter().copied()).length_m() else { return };
    let stays = !path.changes_lanes;
    let same = |kept: &&mut (bool, f64, Driven)| (kept.2.heading_rad - path.heading_rad).cos() > 0.0;
    match paths.iter_mut().find(same) {
        Some(kept) if (stays, length_m) > (kept.0, kept.1) => *kept = (stays, length_m, path),
        Some(_) => {}
        None => {
            paths.push((stays, length_m, path));
            paths.truncate(MOST_DIRECTIONS);
        }
    }
}

/// The first of values that are separated by semicolons.
fn first_of(text: &str) -> &str {
    text.split(';').next().unwrap_or_default().trim()
}

/// Calls `see` with each row that has as many fields as the header.
fn each_row(path: &Path, mut see: impl FnMut(&Places, &str, &Fields)) -> Result<(), RecordingError> {
    let in_file = |refusal| at(path, refusal);
    let input = Digest::default().input(open_file(path)?).map_err(in_file)?;
    rows(input, &mut see).map_err(in_file)
}

fn rows(input: impl BufRead, see: &mut impl FnMut(&Places, &str, &Fields)) -> Result<(), Refusal> {
    let mut lines = Lines::new(input);
    let mut fields = Fields::default();
    let mut places = None;
    loop {
        match lines.next() {
            Ok(Some((number, line))) => {
                let split = fields.split(line, Separator::Comma);
                let Some((needed, known)) = &places else {
                    split.map_err(|problem| Refusal::new(number, problem))?;
                    let header = Header::new((0..fields.len()).map(|index| fields.get(line, index)));
                    let known = Places::new(&header).map_err(|problem| Refusal::new(number, problem))?;
                    places = Some((fields.len(), known));
                    continue;
                };
                if split.is_ok() && fields.len() == *needed {
                    see(known, line, &fields);
                }
            }
            Ok(None) => return Ok(()),
            Err((number, problem)) => {
                let refusal = Refusal::new(number, problem);
                if !refusal.is_of_row() {
                    return Err(refusal);
                }
            }
        }
    }
}

impl TextLayout for ExidColumns {
    fn about(&self) -> About {
        About {
            layout: Layout::Exid,
            name: Some(self.recording.id.clone()),
            period: Some(Time::from_s(1.0 / self.recording.frame_rate_hz)),
            markings: Some(self.survey.markings()),
        }
    }

    fn recording<'l>(&self, line: &'l str, fields: &Fields) -> Option<(&'static str, &'l str)> {
        self.places.recording.map(|index| ("recordingId", fields.get(line, index)))
    }

    fn parse(&mut self, line: &str, fields: &Fields) -> Result<Option<Row>, Fault> {
        let (track, point, heading_rad) = self.places.pose(line, fields)?;
        let real = |index, name, bounds| number(fields.get(line, index), name, bounds);
        let Some(vehicle) = self.vehicles.get_mut(&track) else {
            let text = fields.get(line, self.places.track);
            return Err(Fault::at("trackId", wrong_value(text, format!("one of the vehicles in {}", self.meta_file))));
        };
        vehicle.found += 1;
        let class = vehicle.class;
        // A vehicle keeps the direction in which it was first seen, also on a curved ramp.
        let known = self.latest.filter(|(latest, _)| *latest == track).map(|(_, place)| place);
        let place = known.or_else(|| self.survey.direction(heading_rad)).unwrap_or(0);
        self.latest = Some((track, place));
        let Some(direction) = self.survey.directions.get(place) else { return Ok(None) };
        let beside = direction.line.project(point);
        let width_m = self.survey.lane_width_m;
        let lane = (direction.left - self.survey.lane_beside(beside.d_m) + 1).clamp(1, direction.lanes);
        let frame = integer(fields.get(line, self.places.frame), "frame", allowed::FRAMES)?;
        Ok(Some(Row {
            number: track,
            origin: Time::ZERO,
            vehicle_id: track,
            frame,
            time: Time::from_s(frame as f64 / self.recording.frame_rate_hz),
            clock: Clock::Continuous,
            s_m: beside.s_m,
            d_m: beside.d_m - width_m * (direction.left as f64 + 0.5) + direction.shift_m,
            lane: u8::try_from(lane + direction.first_lane).unwrap_or(u8::MAX),
            speed_mps: real(self.places.speed, "lonVelocity", SPEED_MPS)?,
            acceleration_mps2: Some(real(self.places.acceleration, "lonAcceleration", allowed::ACCELERATION_MPS2)?),
            length_m: real(self.places.length, "length", allowed::LENGTH_M)?,
            width_m: real(self.places.width, "width", allowed::WIDTH_M)?,
            class,
            marking_distances: MarkingDistances::default(),
            line: 0,
        }))
    }

    fn end(&mut self) -> Result<(), Fault> {
        count_rows(&mut self.vehicles, &self.meta_file)
    }
}
