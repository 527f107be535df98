//! The layout of highD: three files per data set, in metres, in the image frame (x to the right, y
//! *down*).
//!
//! ```text
//!    ◀── drivingDirection 1, upper lanes      s = −x, left is down          y │
//!    ════════════════ median ═══════════════                                  ▼
//!    drivingDirection 2, lower lanes ──▶      s = +x, left is up
//! ```
//!
//! - `NN_tracks.csv`: rows `frame, id, x, y, width, height, xVelocity, …, laneId`. `x`, `y` are the
//!   upper left corner of the bounding box, `width` is the vehicle's *length*, `height` its width.
//! - `NN_tracksMeta.csv`: class and driving direction of each vehicle, and its number of rows,
//!   which the reader checks.
//! - `NN_recordingMeta.csv`: frame rate and the positions of the lane markings.
//!
//! (R. Krajewski et al., "The highD Dataset", ITSC 2018; column names as in the data set's
//! documentation.)
//!
//! **Two carriageways, one road frame.** The lower carriageway is the road. Traffic on the upper
//! carriageway drives in the other direction. The reader turns this carriageway round and shifts it
//! 1 km to the right of the lower one, so that vehicles of different carriageways never meet. Its
//! lane numbers continue after one omitted number for the median: with three lanes each, the lanes
//! are 1 to 3 and 5 to 7. Data of a single carriageway has lanes from 1, whether it is the upper or
//! the lower.
//!
//! **Lanes.** highD counts its `laneId` from the top over all areas between markings. A vehicle
//! beside the lanes of its carriageway counts as being in the lane at that edge. Time is 0 at frame
//! 1, the first frame.

use std::collections::BTreeMap;

use closecall_traffic::{Lane, Time};

use super::class_names::{UnknownClass, UnknownClasses};
use super::data::MarkingDistances;
use super::error::TrajectoryFileProblem;
use super::fields::{Bounds, FieldError, integer, number, wrong_value};
use super::file_layout::Layout;
use super::file_set::{Meta, RecordingMeta, VehicleMeta};
use super::header::Header;
use super::markings::LaneMarkings;
use super::plain::allowed;
use super::rows::Fields;
use super::source::{Clock, FileInfo, Row};
use super::text_layout::TextLayout;

/// Allowed speed in the driving direction (m/s). Vehicles practically never reverse, and noise at
/// standstill does not reach the lower bound.
pub(super) const SPEED_MPS: Bounds = Bounds::closed(-1.0, 150.0);
const VELOCITY_MPS: Bounds = Bounds::closed(-150.0, 150.0);
const DIMENSION_M: Bounds = Bounds::above(0.0, 60.0);

/// Distance by which the upper carriageway is shifted to the right of the lower one (m).
const SEPARATION_M: f64 = 1_000.0;

/// Share of the rows of a driving direction above which vehicles do not drive in it (-): single rows
/// may be damaged. An assumption with a plausible range of 0.2 to 0.9.
const AGAINST_SHARE: f64 = 0.5;
/// Least number of rows against a driving direction that tell something about the file.
const LEAST_AGAINST: u64 = 10;

/// The rows of one driving direction, and the rows with velocities against it.
#[derive(Clone, Copy, Debug, Default)]
struct DirectionRows {
    all: u64,
    against: u64,
}

/// Position of a vehicle in the road frame.
struct RoadPosition {
    s_m: f64,
    d_m: f64,
    lane: u8,
}

/// Reads the rows of `NN_tracks.csv`.
pub(super) struct HighdColumns {
    columns: [usize; 9],
    data: RecordingMeta,
    vehicles: BTreeMap<u64, VehicleMeta>,
    /// Name of the file that describes the vehicles, for error messages.
    meta_file: String,
    unknown_classes: UnknownClasses,
    /// The rows of the lower and of the upper carriageway.
    directions: [DirectionRows; 2],
}

impl HighdColumns {
    /// Names of the required columns.
    pub(super) const NAMES: [&str; 9] =
        ["frame", "id", "x", "y", "width", "height", "xVelocity", "xAcceleration", "laneId"];

    /// Column names that distinguish highD from the other layouts.
    pub(super) const OWN_NAMES: [&str; 4] = ["xVelocity", "yVelocity", "laneId", "precedingId"];

    /// Finds the columns in `header`.
    ///
    /// # Errors
    /// Fails if a required column is missing.
    pub(super) fn new(header: &Header, meta: Meta) -> Result<Self, TrajectoryFileProblem> {
        let mut columns = [0; 9];
        for (index, name) in columns.iter_mut().zip(Self::NAMES) {
            *index = header.require(name, "highD")?;
        }
        let Meta { data, vehicles, file, unknown_classes } = meta;
        Ok(Self { columns, data, vehicles, meta_file: file, unknown_classes, directions: Default::default() })
    }

    /// Rejects a file whose velocities contradict the driving directions in its metadata.
    fn check_directions(&self) -> Result<(), TrajectoryFileProblem> {
        for (rows, (direction, towards)) in self.directions.iter().zip([(2, "+x"), (1, "-x")]) {
            let share = rows.against as f64 / rows.all.max(1) as f64;
            if rows.against >= LEAST_AGAINST && share > AGAINST_SHARE {
                let (percent, file) = (100.0 * share, self.meta_file.clone());
                return Err(TrajectoryFileProblem::AgainstDrivingDirection { direction, towards, percent, file });
            }
        }
        Ok(())
    }

    /// Returns the lane markings of both carriageways in the road frame.
    fn markings(&self) -> LaneMarkings {
        let lower = right_edges_m(&self.data.lower_m);
        let mut edges: Vec<f64> = lower.collect();
        if let [.., left_m] = self.data.upper_m.as_slice() {
            let shift_m = self.upper_shift_m();
            edges.extend((shift_m < 0.0).then_some(shift_m));
            edges.extend(self.data.upper_m.iter().rev().skip(1).map(|y_m| shift_m + y_m - left_m));
        }
        let lanes = (1..=u8::MAX).map(Lane);
        LaneMarkings::from_right_edges(lanes.zip(edges))
    }

    /// Returns the lateral position of the upper carriageway's left edge after the shift (m).
    fn upper_shift_m(&self) -> f64 {
        match self.data.lower_m.as_slice() {
            [first, .., last] => -(last - first) - SEPARATION_M,
            _ => 0.0,
        }
    }

    /// Returns the number of lanes on the lower carriageway.
    fn lower_lanes(&self) -> usize {
        self.data.lower_m.len().saturating_sub(1)
    }

    /// Converts a position from the image frame into the road frame.
    fn road_position(
        &self,
        vehicle: u64,
        is_upper: bool,
        x_m: f64,
        y_m: f64,
        lane_id: i64,
    ) -> Result<RoadPosition, FieldError> {
        let (upper, lower) = (&self.data.upper_m, &self.data.lower_m);
        let count = |markings: &[f64]| i64::try_from(markings.len()).unwrap_or(i64::MAX);
        let unmarked = |column| Err(FieldError::from(TrajectoryFileProblem::NoMarkings { vehicle, column }));
        let (s_m, d_m, lane, lanes, before) = if is_upper {
            let Some(left_m) = upper.last().filter(|_| upper.len() > 1) else { return unmarked("upperLaneMarkings") };
            let before = if self.lower_lanes() > 0 { self.lower_lanes() as i64 + 1 } else { 0 };
            (-x_m, y_m - left_m + self.upper_shift_m(), count(upper) + 1 - lane_id, count(upper) - 1, before)
        } else {
            let Some(left_m) = lower.first().filter(|_| lower.len() > 1) else { return unmarked("lowerLaneMarkings") };
            (x_m, left_m - y_m, lane_id - count(upper) - 1, count(lower) - 1, 0)
        };
        let lane = u8::try_from(before + lane.clamp(1, lanes)).unwrap_or(u8::MAX);
        Ok(RoadPosition { s_m, d_m, lane })
    }
}

/// Returns the right edges of the lanes between markings that are ordered from left to right (m).
fn right_edges_m(markings_m: &[f64]) -> impl Iterator<Item = f64> {
    let first = markings_m.first().copied().unwrap_or_default();
    markings_m.iter().skip(1).map(move |y_m| first - y_m)
}

impl TextLayout for HighdColumns {
    fn info(&self) -> FileInfo {
        FileInfo {
            layout: Layout::Highd,
            name: Some(self.data.id.clone()),
            period: Some(Time::from_s(1.0 / self.data.frame_rate_hz)),
            markings: Some(self.markings()),
        }
    }

    fn unknown_classes(&self) -> &[UnknownClass] {
        self.unknown_classes.names()
    }

    fn data<'l>(&self, _: &'l str, _: &Fields) -> Option<(&'static str, &'l str)> {
        None
    }

    fn parse(&mut self, line: &str, fields: &Fields) -> Result<Option<Row>, FieldError> {
        let [frame, id, x, y, width, height, velocity, acceleration, lane] = self.columns;
        let text = |index| fields.get(line, index);
        let real = |index, name, bounds| number(text(index), name, bounds);
        let vehicle_id = integer(text(id), "id", allowed::IDS)?.unsigned_abs();
        let Some(vehicle) = self.vehicles.get_mut(&vehicle_id) else {
            return Err(FieldError::at(
                "id",
                wrong_value(text(id), format!("one of the vehicles in {}", self.meta_file)),
            ));
        };
        vehicle.rows_read += 1;
        let VehicleMeta { class, is_upper, .. } = *vehicle;
        let frame = integer(text(frame), "frame", allowed::FRAMES)?;
        let length_m = real(width, "width", DIMENSION_M)?;
        let width_m = real(height, "height", allowed::WIDTH_M)?;
        let x_m = real(x, "x", allowed::POSITION_M)? + 0.5 * length_m;
        let y_m = real(y, "y", allowed::PLANE_M)? + 0.5 * width_m;
        let forward = if is_upper { -1.0 } else { 1.0 };
        let speed_mps = forward * real(velocity, "xVelocity", VELOCITY_MPS)?;
        let direction = &mut self.directions[usize::from(is_upper)];
        direction.all += 1;
        if !SPEED_MPS.contains(speed_mps) {
            direction.against += 1;
            let towards = if is_upper { "-x" } else { "+x" };
            let needed = format!("a velocity towards {towards}, as the drivingDirection in {} says,", self.meta_file);
            return Err(FieldError::at("xVelocity", wrong_value(text(velocity), needed)));
        }
        let lane_id = integer(text(lane), "laneId", allowed::LANES)?;
        let RoadPosition { s_m, d_m, lane } = self.road_position(vehicle_id, is_upper, x_m, y_m, lane_id)?;
        Ok(Some(Row {
            number: vehicle_id,
            origin: Time::ZERO,
            vehicle_id,
            frame,
            time: Time::from_s((frame - 1) as f64 / self.data.frame_rate_hz),
            clock: Clock::Continuous,
            s_m,
            d_m,
            lane,
            speed_mps,
            acceleration_mps2: Some(forward * real(acceleration, "xAcceleration", allowed::ACCELERATION_MPS2)?),
            length_m,
            width_m,
            class,
            marking_distances: MarkingDistances::default(),
            line: 0,
        }))
    }

    fn end(&mut self) -> Result<(), FieldError> {
        self.check_directions()?;
        check_row_counts(&mut self.vehicles, &self.meta_file)
    }
}

/// Checks that each vehicle has as many rows as the metadata states. Reports the first vehicle with
/// another number and removes it: the next call reports the next such vehicle.
pub(super) fn check_row_counts(vehicles: &mut BTreeMap<u64, VehicleMeta>, meta_file: &str) -> Result<(), FieldError> {
    let wrong = vehicles.iter().find(|(_, vehicle)| vehicle.rows_read != vehicle.rows);
    let Some((&number, &VehicleMeta { rows: stated, rows_read: actual, line, .. })) = wrong else { return Ok(()) };
    vehicles.remove(&number);
    Err(TrajectoryFileProblem::OtherCount { vehicle: number, actual, stated, file: meta_file.to_owned(), line }.into())
}
