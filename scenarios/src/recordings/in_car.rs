//! In-car logs: what one test vehicle records about itself and the lane it is in.
//!
//! ```text
//!   ── ── ── ── ── ── ──   marking      ▲ left_marking_m   (distance from the vehicle's centre line, above 0 while
//!        ┌──────┐                       ▼                    the marking is on that side)
//!    ────┤  ×   ├─────▶ s              ▲
//!        └──────┘                       │ right_marking_m
//!   ── ── ── ── ── ── ──   marking      ▼
//! ```
//!
//! Two rates share one file: the inertial unit's rows (100 Hz: position, heading, acceleration, yaw rate) and, on every
//! fourth of them, what the vehicle's bus carries (25 Hz: speed and the camera's distances to the markings). Between two
//! bus frames the bus columns are empty. A log with bus rows only is read as well.
//!
//! | column | meaning | |
//! |---|---|---|
//! | `time_s` | since the start of the log [s], increasing | needed |
//! | `s_m` | own position along the road [m] | needed |
//! | `d_left_m` | own lateral position, to the *left* of a fixed line along the road, best the left edge of lane 1 [m] | needed |
//! | `speed_mps` | bus: own speed [m/s]; empty between bus frames | needed |
//! | `left_marking_m`, `right_marking_m` | bus: distances to the markings of the own lane [m]; empty where none is seen | needed |
//! | `accel_mps2` | acceleration along the road [m/s²] | |
//! | `heading_rad`, `yaw_rate_radps`, `a_lat_mps2` | read for their validity only | |
//! | `lane_id` | lane, counted from 1 at the left, where the vehicle knows it from a map | |
//! | `length_m`, `width_m`, `vehicle_class` | the vehicle; a typical car where absent | |
//!
//! When the vehicle changes lanes, its centre passes over a marking: one distance falls to zero and jumps up by a lane
//! width, the other the reverse. Where the log has no `lane_id`, these jumps count the lanes, from the one that
//! `d_left_m` and the lane's width tell for the first frame.
//!
//! Times that lie within a quarter of a period beside a multiple of it are put there; what is missing is a gap.

use closecall_traffic::{Time, VehicleClass};

use super::fields::{Bounds, Fault, integer, number};
use super::layout::{Header, TextLayout};
use super::plain::{allowed, class};
use super::rows::Fields;
use super::source::{About, Clock, Row};
use super::{Layout, MarkingDistances, RecordingProblem};

/// A log has one vehicle.
const VEHICLE: u64 = 1;

/// What a distance to a marking may be: cameras do not see beyond some lanes [m].
const MARKING_M: Bounds = Bounds::closed(-20.0, 20.0);
const YAW_RATE_RADPS: Bounds = Bounds::closed(-100.0, 100.0);

/// Time beside the clock by up to this share of a period is put on it.
const JITTER: f64 = 0.25;

/// The left edge of the lane moves by at least this share of a lane width in a change of lanes; noise moves it by less.
const JUMP_SHARE: f64 = 0.5;

/// Lane widths that the sum of both distances can be [m].
const LANE_WIDTH_M: std::ops::RangeInclusive<f64> = 2.0..=6.0;

/// Where the quantities of an in-car log stand, and what earlier rows told.
pub(super) struct InCarColumns {
    places: Places,
    clock: LogClock,
    speed_mps: Option<f64>,
    lane: LaneCount,
}

struct Places {
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
    recording: Option<usize>,
    unused: Vec<(usize, &'static str, Bounds)>,
}

impl InCarColumns {
    /// The names by which the layout is recognised.
    pub(super) const NAMES: [&str; 6] = ["time_s", "s_m", "d_left_m", "speed_mps", "left_marking_m", "right_marking_m"];

    /// Those that no other layout has.
    pub(super) const OWN_NAMES: [&str; 3] = ["d_left_m", "left_marking_m", "right_marking_m"];

    /// # Errors
    /// Where a column is missing that the reader needs.
    pub(super) fn new(header: &Header) -> Result<Self, RecordingProblem> {
        let [time, s, d, speed, left, right] = Self::NAMES;
        let need = |name| header.need(name, "in-car");
        let bounded = [
            ("heading_rad", allowed::HEADING_RAD),
            ("yaw_rate_radps", YAW_RATE_RADPS),
            ("a_lat_mps2", allowed::ACCELERATION_MPS2),
        ];
        let present = bounded.into_iter().filter_map(|(name, bounds)| Some((header.find(name)?, name, bounds)));
        let places = Places {
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
            recording: header.find("recording_id"),
            unused: present.collect(),
        };
        Ok(Self { places, clock: LogClock::default(), speed_mps: None, lane: LaneCount::default() })
    }
}

impl TextLayout for InCarColumns {
    fn about(&self) -> About {
        About { layout: Layout::InCar, name: None, period: self.clock.period, markings: None }
    }

    fn recording<'l>(&self, line: &'l str, fields: &Fields) -> Option<(&'static str, &'l str)> {
        self.places.recording.map(|index| ("recording_id", fields.get(line, index)))
    }

    /// Nothing for the rows before the first bus frame: the speed is not known there.
    fn parse(&mut self, line: &str, fields: &Fields) -> Result<Option<Row>, Fault> {
        let Places { time, s, d, speed, markings, acceleration, lane, length, width, class: class_at, .. } =
            self.places;
        let real = |index, name, bounds| number(fields.get(line, index), name, bounds);
        let optional = |index: usize, name, bounds| match fields.get(line, index) {
            "" => Ok(None),
            text => number(text, name, bounds).map(Some),
        };
        for &(index, name, bounds) in &self.places.unused {
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
        let class = class_at.map_or(Ok(VehicleClass::Car), |index| class(fields.get(line, index)))?;
        let typical = class.typical_dimensions();
        let length_m = length.map_or(Ok(typical.length_m), |index| real(index, "length_m", allowed::LENGTH_M))?;
        let width_m = width.map_or(Ok(typical.width_m), |index| real(index, "width_m", allowed::WIDTH_M))?;
        let mapped = lane.map_or(Ok(None), |index| {
            integer(fields.get(line, index), "lane_id", allowed::LANES).map(|lane| Some(lane.unsigned_abs() as u8))
        })?;
        let (frame, time) = self.clock.tick(Time::from_s(real(time, "time_s", allowed::TIME_S)?))?;
        let counted = self.lane.count(d_m, marking_distances);
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

/// The log's clock: its period is the first step between two rows.
#[derive(Default)]
struct LogClock {
    first: Option<Time>,
    latest: Option<Time>,
    period: Option<Time>,
}

impl LogClock {
    /// The frame that `time` is, and the frame's own time.
    fn tick(&mut self, time: Time) -> Result<(i64, Time), Fault> {
        let first = *self.first.get_or_insert(time);
        if let Some(latest) = self.latest
            && time <= latest
        {
            let problem = RecordingProblem::TimeBackwards { before_s: latest.s(), time_s: time.s() };
            return Err(Fault::at("time_s", problem));
        }
        self.latest = Some(time);
        if time == first {
            return Ok((0, time));
        }
        let period = *self.period.get_or_insert(time - first);
        let frame = ((time - first).ns() + period.ns() / 2).div_euclid(period.ns());
        let on_clock = first + period * frame;
        if ((time - on_clock).ns().abs() as f64) > JITTER * period.ns() as f64 {
            let problem = RecordingProblem::OffClock { time_s: time.s(), period_s: period.s() };
            return Err(Fault::at("time_s", problem));
        }
        Ok((frame, on_clock))
    }
}

/// Counts lanes by the jumps of the left marking.
#[derive(Default)]
struct LaneCount {
    lane: Option<i64>,
    left_edge_m: f64,
    width_m: Option<f64>,
}

impl LaneCount {
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
                Some(lane) if (self.left_edge_m - edge_m).abs() >= JUMP_SHARE * width_m => {
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
