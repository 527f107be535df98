//! The plain layout: CSV in metres, d positive to the right.

use closecall_traffic::{Time, VehicleClass};

use super::class_names::{UnknownClass, UnknownClasses};
use super::data::MarkingDistances;
use super::error::TrajectoryFileProblem;
use super::fields::{Bounds, FieldError, integer, number, optional_number};
use super::file_layout::Layout;
use super::header::Header;
use super::orientation::{Orientation, Stated};
use super::rows::Fields;
use super::source::{Clock, FileInfo, Row};
use super::text_layout::TextLayout;

/// All columns of the layout, in the order in which they are written.
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

/// Allowed values of each column. The ranges exceed what any road vehicle reaches, so that only a
/// broken file violates them.
pub(super) mod allowed {
    use super::Bounds;

    /// Numbers of vehicles. Higher numbers belong to the pieces of split tracks.
    pub(in super::super) const IDS: (i64, i64) = (0, 999_999_999_999);
    /// Numbers of tracks. They include the numbers of pieces, because files that Closecall writes
    /// contain pieces.
    pub(in super::super) const TRACKS: (i64, i64) = (0, 9_000_000_000_000_000);
    pub(in super::super) const FRAMES: (i64, i64) = (0, 1_000_000_000);
    pub(in super::super) const LANES: (i64, i64) = (0, 255);
    /// Times from the start of a file, or Unix times until the year 2100.
    pub(in super::super) const TIME_S: Bounds = Bounds::closed(0.0, 4_102_444_800.0);
    /// Positions along a road. They may count from the beginning of a motorway, or be positions on a
    /// map in metres, as in UTM.
    pub(in super::super) const POSITION_M: Bounds = Bounds::closed(-1e7, 1e7);
    pub(in super::super) const LATERAL_M: Bounds = Bounds::closed(-1e3, 1e3);
    pub(in super::super) const SPEED_MPS: Bounds = Bounds::closed(0.0, 150.0);
    /// Speeds along an axis that may point against the direction of travel.
    pub(super) const SIGNED_SPEED_MPS: Bounds = Bounds::closed(-150.0, 150.0);
    pub(in super::super) const ACCELERATION_MPS2: Bounds = Bounds::closed(-1e3, 1e3);
    pub(in super::super) const HEADING_RAD: Bounds = Bounds::closed(-3.2, 3.2);
    pub(in super::super) const PLANE_M: Bounds = Bounds::closed(-1e7, 1e7);
    pub(in super::super) const LENGTH_M: Bounds = Bounds::above(0.0, 60.0);
    pub(in super::super) const WIDTH_M: Bounds = Bounds::above(0.0, 10.0);
}

/// Largest angle in degrees (°).
const FULL_CIRCLE_DEG: f64 = 360.0;

/// Time that counts from 1970 instead of from the start of a file: 10⁷ s, about four months.
const LONG_TIME: Time = Time::from_ms(10_000_000_000);

/// The column indices of the plain layout's quantities.
pub(super) struct PlainColumns {
    track: usize,
    frame: usize,
    time: usize,
    s: usize,
    d: usize,
    lane: Option<usize>,
    speed: usize,
    acceleration: usize,
    length: usize,
    width: usize,
    class: usize,
    vehicle: Option<usize>,
    data: Option<usize>,
    /// Columns that are only checked: the lateral position gives the heading, and s and d give the
    /// position.
    heading: Option<usize>,
    x: Option<usize>,
    y: Option<usize>,
    orientation: Orientation,
    /// `true` if speeds may be negative, because the position along the road is reversed.
    is_reversed: bool,
    /// `true` if each row has to state its lane.
    needs_lanes: bool,
    unknown_classes: UnknownClasses,
}

impl PlainColumns {
    /// The column names by which the layout is detected.
    pub(super) const NAMES: [&str; 17] = HEADER;

    /// Finds the columns in `header`.
    ///
    /// # Errors
    /// Fails if a required column is missing.
    pub(super) fn new(header: &Header) -> Result<Self, TrajectoryFileProblem> {
        let need = |name| header.require(name, "plain");
        Ok(Self {
            track: need("track_id")?,
            frame: need("frame")?,
            time: need("time_s")?,
            s: need("s_m")?,
            d: need("d_m")?,
            lane: header.find("lane_id"),
            speed: need("speed_mps")?,
            acceleration: need("accel_mps2")?,
            length: need("length_m")?,
            width: need("width_m")?,
            class: need("vehicle_class")?,
            vehicle: header.find("vehicle_id"),
            data: header.find("recording_id"),
            heading: header.find("heading_rel_rad"),
            x: header.find("x_m"),
            y: header.find("y_m"),
            orientation: Orientation::default(),
            is_reversed: false,
            needs_lanes: true,
            unknown_classes: UnknownClasses::default(),
        })
    }

    /// Parses the lane of a row. Lane 0 is none.
    fn lane(&self, line: &str, fields: &Fields) -> Result<u8, FieldError> {
        let text = self.lane.map(|index| fields.get(line, index));
        match text {
            None if self.needs_lanes => {
                let place = "the header has no column `lane_id`".to_owned();
                Err(TrajectoryFileProblem::NoLanes { place }.into())
            }
            None => Ok(0),
            Some("") if !self.needs_lanes => Ok(0),
            Some(text) => Ok(integer(text, "lane_id", allowed::LANES)?.unsigned_abs() as u8),
        }
    }
}

impl TextLayout for PlainColumns {
    fn info(&self) -> FileInfo {
        FileInfo { layout: Layout::Plain, name: None, period: None, markings: None }
    }

    fn data<'l>(&self, line: &'l str, fields: &Fields) -> Option<(&'static str, &'l str)> {
        self.data.map(|index| ("recording_id", fields.get(line, index)))
    }

    fn unknown_classes(&self) -> &[UnknownClass] {
        self.unknown_classes.names()
    }

    fn check_sides(&self, is_mirrored: bool) -> Result<(), TrajectoryFileProblem> {
        self.orientation.check(is_mirrored)
    }

    fn expect_reversed(&mut self) {
        self.is_reversed = true;
    }

    fn expect_no_lanes(&mut self) {
        self.needs_lanes = false;
    }

    fn parse(&mut self, line: &str, fields: &Fields) -> Result<Option<Row>, FieldError> {
        let whole = |index, name, range| integer(fields.get(line, index), name, range);
        let real = |index, name, bounds| number(fields.get(line, index), name, bounds);
        let checked = |column: Option<usize>, name, bounds| {
            column.map_or(Ok(None), |index| optional_number(fields.get(line, index), name, bounds))
        };
        let heading_rad = checked(self.heading, "heading_rel_rad", allowed::HEADING_RAD).map_err(|error| {
            let heading = self.heading.map_or("", |index| fields.get(line, index));
            beyond_radians(heading).unwrap_or(error)
        })?;
        let point = checked(self.x, "x_m", allowed::PLANE_M)?.zip(checked(self.y, "y_m", allowed::PLANE_M)?);
        let track = whole(self.track, "track_id", allowed::TRACKS)?;
        let stated_vehicle = self.vehicle.filter(|index| !fields.get(line, *index).is_empty());
        let vehicle = stated_vehicle.map_or(Ok(track), |index| whole(index, "vehicle_id", allowed::TRACKS))?;
        let acceleration = fields.get(line, self.acceleration);
        let class = fields.get(line, self.class);
        let signed_speed_mps = speed_mps(fields.get(line, self.speed), self.is_reversed)?;
        let row = Row {
            number: track.unsigned_abs(),
            origin: Time::ZERO,
            vehicle_id: vehicle.unsigned_abs(),
            frame: whole(self.frame, "frame", allowed::FRAMES)?,
            time: to_microseconds(Time::from_s(real(self.time, "time_s", allowed::TIME_S)?)),
            clock: Clock::Continuous,
            s_m: real(self.s, "s_m", allowed::POSITION_M)?,
            d_m: -real(self.d, "d_m", allowed::LATERAL_M)?,
            lane: self.lane(line, fields)?,
            speed_mps: signed_speed_mps.abs(),
            // Beside a negative speed, the sign of the acceleration is unknown: the speeds give it.
            acceleration_mps2: optional_number(acceleration, "accel_mps2", allowed::ACCELERATION_MPS2)?
                .filter(|_| signed_speed_mps >= 0.0),
            length_m: real(self.length, "length_m", allowed::LENGTH_M)?,
            width_m: real(self.width, "width_m", allowed::WIDTH_M)?,
            class: self.unknown_classes.resolve(class_named(class), class, "vehicle_class")?,
            marking_distances: MarkingDistances::default(),
            line: 0,
        };
        self.orientation.add(row.number, Stated { s_m: row.s_m, d_m: -row.d_m, heading_rad, point });
        Ok(Some(row))
    }
}

/// Rounds a time to microseconds: as a number, a Unix time is accurate to a quarter of one.
pub(super) fn to_microseconds(time: Time) -> Time {
    const NS_PER_US: i64 = 1_000;
    if time < LONG_TIME { time } else { Time::from_ns((time.ns() + NS_PER_US / 2) / NS_PER_US * NS_PER_US) }
}

/// Returns the problem of a heading that is an angle in another unit, or counts from 0.
fn beyond_radians(text: &str) -> Option<FieldError> {
    let value: f64 = text.parse().ok()?;
    let is_angle = value.abs() <= FULL_CIRCLE_DEG;
    is_angle.then(|| FieldError::at("heading_rel_rad", TrajectoryFileProblem::HeadingUnit { value }))
}

/// Parses a speed (m/s), which may be negative if the position along the road is reversed.
fn speed_mps(text: &str, is_reversed: bool) -> Result<f64, FieldError> {
    let column = "speed_mps";
    match number(text, column, allowed::SIGNED_SPEED_MPS) {
        Ok(speed_mps) if speed_mps < 0.0 && !is_reversed => {
            Err(FieldError::at(column, TrajectoryFileProblem::NegativeSpeed { speed_mps }))
        }
        Ok(speed_mps) => Ok(speed_mps),
        Err(_) => number(text, column, allowed::SPEED_MPS),
    }
}

/// Returns the vehicle class with this name, if there is one.
pub(super) fn class_named(text: &str) -> Option<VehicleClass> {
    VehicleClass::ALL.into_iter().find(|class| class.name() == text)
}
