//! The layout of highD: three files for each recording, metres, the picture's frame (x to the right, y *down*).
//!
//! ```text
//!    ◀── drivingDirection 1, upper lanes      s = −x, left is down          y │
//!    ════════════════ median ═══════════════                                  ▼
//!    drivingDirection 2, lower lanes ──▶      s = +x, left is up
//! ```
//!
//! - `NN_tracks.csv`: rows `frame, id, x, y, width, height, xVelocity, …, laneId`. `x`, `y` are the upper left corner of
//!   the box, `width` is the vehicle's *length*, `height` its width.
//! - `NN_tracksMeta.csv`: class and driving direction of each vehicle, and how many rows it has, which is checked.
//! - `NN_recordingMeta.csv`: frame rate, and where the markings are.
//!
//! (R. Krajewski et al., "The highD Dataset", ITSC 2018; column names as in the data set's documentation.)
//!
//! **Two carriageways, one road frame.** The recording's road is the lower carriageway. The upper one, which is driven in
//! the other direction, is turned round and laid 1 km to the right of it, and its lanes are counted on after leaving out
//! one number for the median: with three lanes each, lanes 1 to 3 and 5 to 7. So vehicles of different carriageways never
//! meet. A recording of one carriageway only has lanes from 1, whichever it is.
//!
//! **Lanes.** highD counts its `laneId` from above, over all areas between markings. A vehicle beside the lanes of its
//! carriageway counts to the lane at that edge. Time is 0 at frame 1, the first.

use std::collections::BTreeMap;

use closecall_traffic::{Lane, Time};

use super::fields::{Bounds, Fault, integer, number, wrong_value};
use super::file_set::{Meta, RecordingMeta, VehicleMeta};
use super::layout::{Header, TextLayout};
use super::plain::allowed;
use super::rows::Fields;
use super::source::{About, Clock, Row};
use super::{LaneMarkings, Layout, MarkingDistances, RecordingProblem};

/// Vehicles are as good as never reversing; noise at standstill is below this [m/s].
pub(super) const SPEED_MPS: Bounds = Bounds::closed(-1.0, 150.0);
const VELOCITY_MPS: Bounds = Bounds::closed(-150.0, 150.0);
const DIMENSION_M: Bounds = Bounds::above(0.0, 60.0);

/// How far to the right of the lower carriageway the upper one is laid [m].
const APART_M: f64 = 1_000.0;

/// Where a vehicle is on the road.
struct Place {
    s_m: f64,
    d_m: f64,
    lane: u8,
}

/// Reads the rows of `NN_tracks.csv`.
pub(super) struct HighdColumns {
    places: [usize; 9],
    recording: RecordingMeta,
    vehicles: BTreeMap<u64, VehicleMeta>,
    meta_file: String,
}

impl HighdColumns {
    /// The names that are needed.
    pub(super) const NAMES: [&str; 9] =
        ["frame", "id", "x", "y", "width", "height", "xVelocity", "xAcceleration", "laneId"];

    /// Those by which the layout is told from others.
    pub(super) const OWN_NAMES: [&str; 4] = ["xVelocity", "yVelocity", "laneId", "precedingId"];

    /// # Errors
    /// Where a column is missing that the reader needs.
    pub(super) fn new(header: &Header, meta: Meta) -> Result<Self, RecordingProblem> {
        let mut places = [0; 9];
        for (place, name) in places.iter_mut().zip(Self::NAMES) {
            *place = header.need(name, "highD")?;
        }
        let Meta { recording, vehicles, file } = meta;
        Ok(Self { places, recording, vehicles, meta_file: file })
    }

    fn markings(&self) -> LaneMarkings {
        let lower = right_edges_m(&self.recording.lower_m);
        let mut edges: Vec<f64> = lower.collect();
        if let [.., left_m] = self.recording.upper_m.as_slice() {
            let shift_m = self.upper_shift_m();
            edges.extend((shift_m < 0.0).then_some(shift_m));
            edges.extend(self.recording.upper_m.iter().rev().skip(1).map(|y_m| shift_m + y_m - left_m));
        }
        let lanes = (1..=u8::MAX).map(Lane);
        LaneMarkings::stated(lanes.zip(edges))
    }

    /// Where the left edge of the upper carriageway is laid [m].
    fn upper_shift_m(&self) -> f64 {
        match self.recording.lower_m.as_slice() {
            [first, .., last] => -(last - first) - APART_M,
            _ => 0.0,
        }
    }

    /// Lanes of the lower carriageway.
    fn lower_lanes(&self) -> usize {
        self.recording.lower_m.len().saturating_sub(1)
    }

    fn place(&self, is_upper: bool, (x_m, y_m): (f64, f64), lane_id: i64) -> Result<Place, Fault> {
        let (upper, lower) = (&self.recording.upper_m, &self.recording.lower_m);
        let count = |markings: &[f64]| i64::try_from(markings.len()).unwrap_or(i64::MAX);
        let unmarked = |which| {
            let allowed =
                format!("a vehicle of a carriageway with markings ({which} has none in the recording's metadata)");
            Err(Fault::at("id", wrong_value("?", allowed)))
        };
        let (s_m, d_m, lane, lanes, before) = if is_upper {
            let Some(left_m) = upper.last().filter(|_| upper.len() > 1) else { return unmarked("upperLaneMarkings") };
            let before = if self.lower_lanes() > 0 { self.lower_lanes() as i64 + 1 } else { 0 };
            (-x_m, y_m - left_m + self.upper_shift_m(), count(upper) + 1 - lane_id, count(upper) - 1, before)
        } else {
            let Some(left_m) = lower.first().filter(|_| lower.len() > 1) else { return unmarked("lowerLaneMarkings") };
            (x_m, left_m - y_m, lane_id - count(upper) - 1, count(lower) - 1, 0)
        };
        let lane = u8::try_from(before + lane.clamp(1, lanes)).unwrap_or(u8::MAX);
        Ok(Place { s_m, d_m, lane })
    }
}

/// The right edges of the lanes between markings that go from left to right [m].
fn right_edges_m(markings_m: &[f64]) -> impl Iterator<Item = f64> {
    let first = markings_m.first().copied().unwrap_or_default();
    markings_m.iter().skip(1).map(move |y_m| first - y_m)
}

impl TextLayout for HighdColumns {
    fn about(&self) -> About {
        About {
            layout: Layout::Highd,
            name: Some(self.recording.id.clone()),
            period: Some(Time::from_s(1.0 / self.recording.frame_rate_hz)),
            markings: Some(self.markings()),
        }
    }

    fn recording<'l>(&self, _: &'l str, _: &Fields) -> Option<(&'static str, &'l str)> {
        None
    }

    fn parse(&mut self, line: &str, fields: &Fields) -> Result<Option<Row>, Fault> {
        let [frame, id, x, y, width, height, velocity, acceleration, lane] = self.places;
        let text = |index| fields.get(line, index);
        let real = |index, name, bounds| number(text(index), name, bounds);
        let number_of = integer(text(id), "id", allowed::IDS)?.unsigned_abs();
        let Some(vehicle) = self.vehicles.get_mut(&number_of) else {
            return Err(Fault::at("id", wrong_value(text(id), format!("one of the vehicles in {}", self.meta_file))));
        };
        vehicle.found += 1;
        let VehicleMeta { class, is_upper, .. } = *vehicle;
        let frame = integer(text(frame), "frame", allowed::FRAMES)?;
        let length_m = real(width, "width", DIMENSION_M)?;
        let width_m = real(height, "height", allowed::WIDTH_M)?;
        let x_m = real(x, "x", allowed::POSITION_M)? + 0.5 * length_m;
        let y_m = real(y, "y", allowed::LATERAL_M)? + 0.5 * width_m;
        let forward = if is_upper { -1.0 } else { 1.0 };
        let speed_mps = forward * real(velocity, "xVelocity", VELOCITY_MPS)?;
        if !SPEED_MPS.contains(speed_mps) {
            let towards = if is_upper { "-x" } else { "+x" };
            let needed = format!("a velocity towards {towards}, as the drivingDirection in {} says,", self.meta_file);
            return Err(Fault::at("xVelocity", wrong_value(text(velocity), needed)));
        }
        let lane_id = integer(text(lane), "laneId", allowed::LANES)?;
        let Place { s_m, d_m, lane } = self.place(is_upper, (x_m, y_m), lane_id)?;
        Ok(Some(Row {
            number: number_of,
            origin: Time::ZERO,
            vehicle_id: number_of,
            frame,
            time: Time::from_s((frame - 1) as f64 / self.recording.frame_rate_hz),
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

    fn end(&mut self) -> Result<(), Fault> {
        count_rows(&mut self.vehicles, &self.meta_file)
    }
}

/// Tells the first vehicle that has another number of rows than the metadata state, and forgets it.
pub(super) fn count_rows(vehicles: &mut BTreeMap<u64, VehicleMeta>, meta_file: &str) -> Result<(), Fault> {
    let wrong = vehicles.iter().find(|(_, vehicle)| vehicle.found != vehicle.rows);
    let Some((&number, &VehicleMeta { rows: stated, found, line, .. })) = wrong else { return Ok(()) };
    vehicles.remove(&number);
    Err(RecordingProblem::OtherCount { vehicle: number, found, stated, file: meta_file.to_owned(), line }.into())
}
