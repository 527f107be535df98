//! The plain layout: CSV in metres, d positive to the right.

use closecall_traffic::{Time, VehicleClass};

use super::fields::{Bounds, Fault, integer, number, wrong_value};
use super::layout::{Header, TextLayout};
use super::rows::Fields;
use super::source::{About, Clock, Row};
use super::{Layout, MarkingDistances, RecordingProblem};

/// Every column of the layout, in the order in which they are written.
pub(super) const HEADER: [&str; 17] = [
    "recording_id",
    "track_id",
    "vehicle_id",
    "frame",
    "time_s",
    "s_m",
    "d_m",
    "lane_id",
    "speed_mps",
    "accel_mps2",
    "heading_rel_rad",
    "x_m",
    "y_m",
    "length_m",
    "width_m",
    "vehicle_class",
    "source_scenario",
];

/// What each column allows. The bounds are wider than any road vehicle, so that only a broken file meets them.
pub(super) mod allowed {
    use super::Bounds;

    /// Numbers of vehicles; above them are those of the pieces of a track with gaps.
    pub(in super::super) const IDS: (i64, i64) = (0, 999_999_999_999);
    /// Numbers of tracks: a file that we wrote has pieces.
    pub(in super::super) const TRACKS: (i64, i64) = (0, 9_000_000_000_000_000);
    pub(in super::super) const FRAMES: (i64, i64) = (0, 1_000_000_000);
    pub(in super::super) const LANES: (i64, i64) = (0, 255);
    pub(in super::super) const TIME_S: Bounds = Bounds::closed(0.0, 1e7);
    pub(in super::super) const POSITION_M: Bounds = Bounds::closed(-1e6, 1e6);
    pub(in super::super) const LATERAL_M: Bounds = Bounds::closed(-1e3, 1e3);
    pub(in super::super) const SPEED_MPS: Bounds = Bounds::closed(0.0, 150.0);
    pub(in super::super) const ACCELERATION_MPS2: Bounds = Bounds::closed(-1e3, 1e3);
    pub(in super::super) const HEADING_RAD: Bounds = Bounds::closed(-3.2, 3.2);
    pub(in super::super) const PLANE_M: Bounds = Bounds::closed(-1e7, 1e7);
    pub(in super::super) const LENGTH_M: Bounds = Bounds::above(0.0, 60.0);
    pub(in super::super) const WIDTH_M: Bounds = Bounds::above(0.0, 10.0);
}

/// Where the quantities of the plain layout stand.
pub(super) struct PlainColumns {
    track: usize,
    frame: usize,
    time: usize,
    s: usize,
    d: usize,
    lane: usize,
    speed: usize,
    acceleration: usize,
    length: usize,
    width: usize,
    class: usize,
    vehicle: Option<usize>,
    recording: Option<usize>,
    /// Read for their validity only: the lateral position tells the heading, and s and d the place.
    unused: Vec<(usize, &'static str, Bounds)>,
}

impl PlainColumns {
    /// The names by which the layout is recognised.
    pub(super) const NAMES: [&str; 17] = HEADER;

    /// # Errors
    /// Where a column is missing that the reader needs.
    pub(super) fn new(header: &Header) -> Result<Self, RecordingProblem> {
        let need = |name| header.need(name, "plain");
        let bounded = [("heading_rel_rad", allowed::HEADING_RAD), ("x_m", allowed::PLANE_M), ("y_m", allowed::PLANE_M)];
        let present = bounded.into_iter().filter_map(|(name, bounds)| Some((header.find(name)?, name, bounds)));
        Ok(Self {
            track: need("track_id")?,
            frame: need("frame")?,
            time: need("time_s")?,
            s: need("s_m")?,
            d: need("d_m")?,
            lane: need("lane_id")?,
            speed: need("speed_mps")?,
            acceleration: need("accel_mps2")?,
            length: need("length_m")?,
            width: need("width_m")?,
            class: need("vehicle_class")?,
            vehicle: header.find("vehicle_id"),
            recording: header.find("recording_id"),
            unused: present.collect(),
        })
    }
}

impl TextLayout for PlainColumns {
    fn about(&self) -> About {
        About { layout: Layout::Plain, name: None, period: None, markings: None }
    }

    fn recording<'l>(&self, line: &'l str, fields: &Fields) -> Option<(&'static str, &'l str)> {
        self.recording.map(|index| ("recording_id", fields.get(line, index)))
    }

    fn parse(&mut self, line: &str, fields: &Fields) -> Result<Option<Row>, Fault> {
        let whole = |index, name, range| integer(fields.get(line, index), name, range);
        let real = |index, name, bounds| number(fields.get(line, index), name, bounds);
        for &(index, name, bounds) in &self.unused {
            real(index, name, bounds)?;
        }
        let track = whole(self.track, "track_id", allowed::TRACKS)?;
        let vehicle = self.vehicle.map_or(Ok(track), |index| whole(index, "vehicle_id", allowed::TRACKS))?;
        let acceleration = match fields.get(line, self.acceleration) {
            "" => None,
            text => Some(number(text, "accel_mps2", allowed::ACCELERATION_MPS2)?),
        };
        let row = Row {
            number: track.unsigned_abs(),
            origin: Time::ZERO,
            vehicle_id: vehicle.unsigned_abs(),
            frame: whole(self.frame, "frame", allowed::FRAMES)?,
            time: Time::from_s(real(self.time, "time_s", allowed::TIME_S)?),
            clock: Clock::Continuous,
            s_m: real(self.s, "s_m", allowed::POSITION_M)?,
            d_m: -real(self.d, "d_m", allowed::LATERAL_M)?,
            lane: whole(self.lane, "lane_id", allowed::LANES)?.unsigned_abs() as u8,
            speed_mps: real(self.speed, "speed_mps", allowed::SPEED_MPS)?,
            acceleration_mps2: acceleration,
            length_m: real(self.length, "length_m", allowed::LENGTH_M)?,
            width_m: real(self.width, "width_m", allowed::WIDTH_M)?,
            class: class(fields.get(line, self.class))?,
            marking_distances: MarkingDistances::default(),
            line: 0,
        };
        Ok(Some(row))
    }
}

pub(super) fn class(text: &str) -> Result<VehicleClass, Fault> {
    let named = VehicleClass::ALL.into_iter().find(|class| class.name() == text);
    named.ok_or_else(|| {
        let words = VehicleClass::ALL.map(VehicleClass::name).join(", ");
        Fault::at("vehicle_class", wrong_value(text, format!("one of {words}")))
    })
}
