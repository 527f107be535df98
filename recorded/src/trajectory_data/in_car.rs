//! In-car logs: what one test vehicle records about itself and its lane.
//!
//! ```text
//!   ── ── ── ── ── ── ──   marking      ▲ left_marking_m   (distance from the vehicle's centre line, positive while
//!        ┌──────┐                       ▼                    the marking is on that side)
//!    ────┤  ×   ├─────▶ s              ▲
//!        └──────┘                       │ right_marking_m
//!   ── ── ── ── ── ── ──   marking      ▼
//! ```
//!
//! One file contains data at two rates. Every row holds data of the inertial unit (100 Hz:
//! position, heading, acceleration, yaw rate). Every fourth row also holds data of the vehicle bus
//! (25 Hz: speed, and the distances to the markings that the camera measures). The bus columns are
//! empty in the rows between two bus frames. A log that has only bus rows is accepted as well.
//!
//! | column | meaning | |
//! |---|---|---|
//! | `time_s` | time since the start of the log (s), increasing | required |
//! | `s_m` | own position along the road (m) | required |
//! | `d_left_m` | own lateral position, positive to the *left* of a fixed line along the road, preferably the left edge of lane 1 (m) | required |
//! | `speed_mps` | bus: own speed (m/s); empty between bus frames | required |
//! | `left_marking_m`, `right_marking_m` | bus: distances to the markings of the own lane (m); empty if none is seen | required |
//! | `accel_mps2` | acceleration along the road (m/s²) | |
//! | `heading_rad`, `yaw_rate_radps`, `a_lat_mps2` | only validated | |
//! | `lane_id` | lane, counted from 1 at the left, if the vehicle knows it from a map; empty if unknown | |
//! | `length_m`, `width_m`, `vehicle_class` | the vehicle; a typical car if absent or empty | |
//!
//! When the vehicle changes lanes, its centre crosses a marking: the distance to that marking falls
//! to zero and then jumps up by a lane width, while the distance to the other marking does the
//! reverse. Where the log has no `lane_id`, the reader counts lanes by these jumps, from the last
//! known lane on. Without a map, the first lane follows from `d_left_m` and the lane width.
//!
//! Times within a quarter of a period of a tick of the clock are moved to that tick. A missing tick
//! is a gap.

use closecall_traffic::{Time, VehicleClass};

use super::class_names::{UnknownClass, UnknownClasses};
use super::data::MarkingDistances;
use super::error::TrajectoryFileProblem;
use super::fields::{Bounds, FieldError, integer, number, optional_number};
use super::file_layout::Layout;
use super::header::Header;
use super::plain::{allowed, class_named, to_microseconds};
use super::rows::Fields;
use super::source::{Clock, FileInfo, Row};
use super::text_layout::TextLayout;

/// Number of the log's only vehicle.
const VEHICLE: u64 = 1;

/// Allowed distance to a marking (m). Cameras do not see further than some lanes.
const MARKING_M: Bounds = Bounds::closed(-20.0, 20.0);
const YAW_RATE_RADPS: Bounds = Bounds::closed(-100.0, 100.0);

/// Maximum deviation of a time from a tick of the clock, as a share of the period.
const MAX_JITTER: f64 = 0.25;

/// Minimum movement of the lane's left edge in a lane change, as a share of the lane width. Noise
/// moves it by less.
const MIN_JUMP_SHARE: f64 = 0.5;

/// Plausible lane widths, given by the sum of both distances (m).
const LANE_WIDTH_M: std::ops::RangeInclusive<f64> = 2.0..=6.0;

/// The columns of an in-car log, and the state that earlier rows leave.
pub(super) struct InCarColumns {
    columns: ColumnIndices,
    clock: LogClock,
    speed_mps: Option<f64>,
    lane: LaneCounter,
    unknown_classes: UnknownClasses,
}

/// The column indices of an in-car log's quantities.
struct ColumnIndices {
    time: usize,
    s: usize,
    d: usize,
    speed: usize,
    markings: [usize; 2],
    acceleration: Option<usize>,
    lane: Option<usize>,
    length: Option<usize>,
    width: Option<usize>,
    class: Option<usize>,
    data: Option<usize>,
    /// Columns that are only validated.
    validated_only: Vec<(usize, &'static str, Bounds)>,
}

impl InCarColumns {
    /// Names of the required columns.
    pub(super) const NAMES: [&str; 6] = ["time_s", "s_m", "d_left_m", "speed_mps", "left_marking_m", "right_marking_m"];

    /// Column names that no other layout has.
    pub(super) const OWN_NAMES: [&str; 3] = ["d_left_m", "left_marking_m", "right_marking_m"];

    /// Finds the columns in `header`.
    ///
    /// # Errors
    /// Fails if a required column is missing.
    pub(super) fn new(header: &Header) -> Result<Self, TrajectoryFileProblem> {
        let [time, s, d, speed, left, right] = Self::NAMES;
        let need = |name| header.require(name, "in-car");
        let bounded = [
            ("heading_rad", allowed::HEADING_RAD),
            ("yaw_rate_radps", YAW_RATE_RADPS),
            ("a_lat_mps2", allowed::ACCELERATION_MPS2),
        ];
        let present = bounded.into_iter().filter_map(|(name, bounds)| Some((header.find(name)?, name, bounds)));
        let columns = ColumnIndices {
            time: need(time)?,
            s: need(s)?,
            d: need(d)?,
            speed: need(speed)?,
            markings: [need(left)?, need(right)?],
            acceleration: header.find("accel_mps2"),
            lane: header.find("lane_id"),
            length: header.find("length_m"),
            width: header.find("width_m"),
            class: header.find("vehicle_class"),
            data: header.find("recording_id"),
            validated_only: present.collect(),
        };
        Ok(Self {
            columns,
            clock: LogClock::default(),
            speed_mps: None,
            lane: LaneCounter::default(),
            unknown_classes: UnknownClasses::default(),
        })
    }
}

impl TextLayout for InCarColumns {
    fn info(&self) -> FileInfo {
        FileInfo { layout: Layout::InCar, name: None, period: self.clock.period, markings: None }
    }

    fn data<'l>(&self, line: &'l str, fields: &Fields) -> Option<(&'static str, &'l str)> {
        self.columns.data.map(|index| ("recording_id", fields.get(line, index)))
    }

    fn unknown_classes(&self) -> &[UnknownClass] {
        self.unknown_classes.names()
    }

    /// Yields no row before the first bus frame, because the speed is still unknown there.
    fn parse(&mut self, line: &str, fields: &Fields) -> Result<Option<Row>, FieldError> {
        let ColumnIndices { time, s, d, speed, markings, acceleration, lane, length, width, class: class_at, .. } =
            self.columns;
        let real = |index, name, bounds| number(fields.get(line, index), name, bounds);
        let optional = |index: usize, name, bounds| optional_number(fields.get(line, index), name, bounds);
        let stated = |index: Option<usize>| index.map_or("", |index| fields.get(line, index));
        for &(index, name, bounds) in &self.columns.validated_only {
            optional(index, name, bounds)?;
        }
        let (s_m, d_m) = (real(s, "s_m", allowed::POSITION_M)?, real(d, "d_left_m", allowed::LATERAL_M)?);
        let marking_distances = MarkingDistances {
            left_m: optional(markings[0], "left_marking_m", MARKING_M)?,
            right_m: optional(markings[1], "right_marking_m", MARKING_M)?,
        };
        let speed_mps = optional(speed, "speed_mps", allowed::SPEED_MPS)?;
        let acceleration_mps2 =
            acceleration.map_or(Ok(None), |index| optional(index, "accel_mps2", allowed::ACCELERATION_MPS2))?;
        let class = match stated(class_at) {
            "" => VehicleClass::Car,
            name => self.unknown_classes.resolve(class_named(name), name, "vehicle_class")?,
        };
        let typical = class.typical_dimensions();
        let length_m = optional_number(stated(length), "length_m", allowed::LENGTH_M)?.unwrap_or(typical.length_m);
        let width_m = optional_number(stated(width), "width_m", allowed::WIDTH_M)?.unwrap_or(typical.width_m);
        let mapped = match stated(lane) {
            "" => None,
            text => Some(integer(text, "lane_id", allowed::LANES)?.unsigned_abs() as u8),
        };
        let (frame, time) =
            self.clock.frame_at(to_microseconds(Time::from_s(real(time, "time_s", allowed::TIME_S)?)))?;
        let counted = self.lane.count(d_m, marking_distances);
        self.lane.correct(mapped);
        self.speed_mps = speed_mps.or(self.speed_mps);
        let row = self.speed_mps.map(|speed_mps| Row {
            number: VEHICLE,
            origin: Time::ZERO,
            vehicle_id: VEHICLE,
            frame,
            time,
            clock: Clock::Continuous,
            s_m,
            d_m,
            lane: mapped.unwrap_or(counted),
            speed_mps,
            acceleration_mps2,
            length_m,
            width_m,
            class,
            marking_distances,
            line: 0,
        });
        Ok(row)
    }
}

/// The clock of the log. Its period is the time between the first two rows.
#[derive(Default)]
struct LogClock {
    first: Option<Time>,
    latest: Option<Time>,
    period: Option<Time>,
}

impl LogClock {
    /// Returns the frame number of `time`, and the time of that frame's tick.
    fn frame_at(&mut self, time: Time) -> Result<(i64, Time), FieldError> {
        let first = *self.first.get_or_insert(time);
        if let Some(latest) = self.latest
            && time <= latest
        {
            let problem = TrajectoryFileProblem::TimeBackwards { before_s: latest.s(), time_s: time.s() };
            return Err(FieldError::at("time_s", problem));
        }
        self.latest = Some(time);
        if time == first {
            return Ok((0, time));
        }
        let period = *self.period.get_or_insert(time - first);
        let frame = ((time - first).ns() + period.ns() / 2).div_euclid(period.ns());
        let on_clock = first + period * frame;
        if ((time - on_clock).ns().abs() as f64) > MAX_JITTER * period.ns() as f64 {
            let problem = TrajectoryFileProblem::OffClock { time_s: time.s(), period_s: period.s() };
            return Err(FieldError::at("time_s", problem));
        }
        Ok((frame, on_clock))
    }
}

/// Counts lanes by the jumps of the left marking.
#[derive(Default)]
struct LaneCounter {
    lane: Option<i64>,
    left_edge_m: f64,
    width_m: Option<f64>,
}

impl LaneCounter {
    /// Replaces the counted lane by a known `lane`.
    fn correct(&mut self, lane: Option<u8>) {
        self.lane = lane.map(i64::from).or(self.lane);
    }

    /// Returns the lane after a row with the lateral position `d_m` (m) and the distances in
    /// `seen`.
    fn count(&mut self, d_m: f64, seen: MarkingDistances) -> u8 {
        if let (Some(left_m), Some(right_m)) = (seen.left_m, seen.right_m)
            && LANE_WIDTH_M.contains(&(left_m + right_m))
        {
            self.width_m = Some(left_m + right_m);
        }
        if let (Some(width_m), Some(left_m)) = (self.width_m, seen.left_m) {
            let edge_m = d_m + left_m;
            #[expect(clippy::cast_possible_truncation, reason = "a few lanes, and a float cast saturates")]
            let lanes = |metres: f64| (metres / width_m).round() as i64;
            self.lane = Some(match self.lane {
                None => 1 + lanes(-edge_m),
                Some(lane) if (self.left_edge_m - edge_m).abs() >= MIN_JUMP_SHARE * width_m => {
                    lane + lanes(self.left_edge_m - edge_m)
                }
                Some(lane) => lane,
            });
            self.left_edge_m = edge_m;
        }
        let counted = self.lane.unwrap_or(1).clamp(1, i64::from(u8::MAX));
        u8::try_from(counted).unwrap_or(1)
    }
}
