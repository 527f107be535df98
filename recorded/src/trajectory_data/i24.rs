//! The layout of I-24 MOTION: JSON with one object for each trajectory.
//!
//! (D. Gloudemans et al., "I-24 MOTION: An instrument for freeway traffic science", Transportation
//! Research Part C 155, 2023; meaning of the fields as in the project's trajectory schema,
//! repository I24-MOTION.)
//!
//! - `timestamp`: seconds since 1970. `x_position`: middle of the *rear* along the road (feet);
//!   `direction` 1 is towards increasing, −1 towards decreasing x. `y_position`: across the road
//!   (feet); 0 is the left edge of the leftmost lane in either direction, and it has the sign of the
//!   direction. If most positions of a direction have the other sign, it counts the other way.
//! - `length`, `width` in feet. `coarse_vehicle_class`: 0 sedan, 1 midsize, 2 van, 3 pickup, 4 semi,
//!   5 truck, 6 motorcycle.
//! - No lane is stated. Lanes are 12 ft wide, as on US interstates (AASHTO, *A Policy on Design
//!   Standards: Interstate System*), and are counted from the left edge.
//! - Speeds are derived from the positions.
//!
//! A file is one array, or one object after the other, as MongoDB exports them.

use std::collections::HashMap;
use std::fmt;
use std::io::BufRead;

use closecall_traffic::{Lane, Time, VehicleClass};
use serde::Deserialize;
use serde::de::{DeserializeSeed, Deserializer, SeqAccess, Visitor};

use super::class_names::UnknownClasses;
use super::collected::{Collected, CollectedRow, CollectedSource, Facts, Position, derived_speed_mps};
use super::error::TrajectoryFileProblem;
use super::fields::{Bounds, wrong_value};
use super::file_layout::Layout;
use super::markings::LaneMarkings;
use super::plain::allowed;
use super::source::{Clock, ReadError};

const FORMAT: &str = "I-24 MOTION file";

const FOOT_M: f64 = 0.3048;
const LANE_M: f64 = 12.0 * FOOT_M;
/// Largest number of lanes in one direction: I-24 has up to 5, and ramps beside them.
const MAX_LANES: u8 = 8;
/// Distance by which the westbound direction is shifted to the right of the eastbound one (m).
const SEPARATION_M: f64 = 1_000.0;
/// Longest distance by which the noise of positions may move a vehicle back (m). An assumption with a plausible
/// range of 5 to 20 m.
const MOST_BACK_M: f64 = 10.0;
/// Seconds since 1970, up to the year 2100.
const TIME_S: Bounds = Bounds::closed(0.0, 4_102_444_800.0);

/// A number, or a list of measurements of it.
#[derive(Deserialize)]
#[serde(untagged)]
enum Size {
    One(f64),
    Many(Vec<f64>),
}

impl Size {
    /// Returns the number, or the median of its measurements.
    fn value(self) -> f64 {
        match self {
            Self::One(value) => value,
            Self::Many(mut values) => {
                values.sort_by(f64::total_cmp);
                values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
            }
        }
    }
}

/// Returns the lane at a distance to the right of the left edge (m).
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a float cast saturates")]
fn lane_at(right_m: f64) -> u8 {
    ((right_m / LANE_M) as u8).saturating_add(1).min(MAX_LANES)
}

/// One trajectory, as the file states it.
#[derive(Deserialize)]
struct Document {
    timestamp: Vec<f64>,
    x_position: Vec<f64>,
    y_position: Vec<f64>,
    length: Size,
    width: Size,
    direction: f64,
    coarse_vehicle_class: i64,
}

#[derive(Default)]
struct Reader {
    collected: Collected,
    documents: u64,
    /// The first trajectory that begins at this time and place: another one is its copy.
    begun: HashMap<[u64; 3], u64>,
    error: Option<ReadError>,
    has: [bool; 2],
    /// Sum of the signs of the lateral positions to the right, of each direction.
    signs: [f64; 2],
}

/// Reads a file of I-24 MOTION.
///
/// # Errors
/// The JSON is damaged, or a field is missing or holds what is not allowed.
pub(super) fn read(mut input: impl BufRead) -> Result<CollectedSource, ReadError> {
    let mut reader = Reader::default();
    let start = input.fill_buf().map_err(|error| ReadError::of_file(super::rows::io_problem(error)))?;
    let is_array = start.trim_ascii_start().first() == Some(&b'[');
    let result = if is_array {
        let mut json = serde_json::Deserializer::from_reader(input);
        json.deserialize_seq(&mut reader).and_then(|()| json.end())
    } else {
        let mut documents = serde_json::Deserializer::from_reader(input).into_iter::<Document>();
        documents.try_for_each(|document| document.map(|document| reader.push(document)))
    };
    if let Some(error) = reader.error {
        return Err(error);
    }
    if let Err(error) = result {
        let reason = error.to_string();
        let line = u64::try_from(error.line()).unwrap_or(u64::MAX);
        return Err(ReadError::new(line, TrajectoryFileProblem::Unreadable { format: FORMAT, reason }));
    }
    reader.finish()
}

impl<'de> Visitor<'de> for &mut Reader {
    type Value = ();

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("a list of trajectories")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut documents: A) -> Result<(), A::Error> {
        while let Some(document) = documents.next_element::<Document>()? {
            self.push(document);
        }
        Ok(())
    }
}

impl<'de> DeserializeSeed<'de> for &mut Reader {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_seq(self)
    }
}

impl Reader {
    /// Adds a trajectory, or keeps the first error.
    fn push(&mut self, document: Document) {
        self.documents += 1;
        if self.error.is_none() {
            self.error = self.add(document).err();
        }
    }

    fn add(&mut self, document: Document) -> Result<(), ReadError> {
        let number = self.documents;
        let wrong = |field: &'static str, value: &str, allowed: &str| {
            let reason = format!("trajectory {number}: `{field}` is {value}, but {allowed} is needed",);
            ReadError::of_file(TrajectoryFileProblem::Unreadable { format: FORMAT, reason })
        };
        let Document { timestamp, x_position, y_position, length, width, direction, coarse_vehicle_class } = document;
        let count = timestamp.len();
        for (field, values) in [("x_position", &x_position), ("y_position", &y_position)] {
            if values.len() != count {
                let allowed = format!("a list of {count} numbers, as many as `timestamp` has,");
                return Err(wrong(field, &format!("a list of {}", values.len()), &allowed));
            }
        }
        let class = match coarse_vehicle_class {
            0..=3 => VehicleClass::Car,
            4 | 5 => VehicleClass::Truck,
            6 => VehicleClass::Motorcycle,
            other => return Err(wrong("coarse_vehicle_class", &other.to_string(), "a whole number from 0 to 6")),
        };
        if direction.abs() != 1.0 {
            return Err(wrong("direction", &direction.to_string(), "1 (eastbound) or -1 (westbound)"));
        }
        let (length_m, width_m) = (FOOT_M * length.value(), FOOT_M * width.value());
        if !allowed::LENGTH_M.contains(length_m) {
            return Err(wrong("length", &format!("{length_m:.2} m"), "a length above 0 and up to 60 m"));
        }
        if !allowed::WIDTH_M.contains(width_m) {
            return Err(wrong("width", &format!("{width_m:.2} m"), "a width above 0 and up to 10 m"));
        }
        let start =
            [&timestamp, &x_position, &y_position].map(|values| values.first().map_or(0, |value| value.to_bits()));
        let vehicle = self.collected.vehicle(&self.begun.entry(start).or_insert(number).to_string());
        let road = u32::from(direction < 0.0);
        self.has[road as usize] = true;
        let along_m: Vec<f64> = x_position.iter().map(|x| direction * FOOT_M * x + 0.5 * length_m).collect();
        // A vehicle at rest may seem to move back by its position noise. One that moves further back contradicts its
        // direction, and its speed shows that.
        let is_against = along_m.first().zip(along_m.last()).is_some_and(|(first, last)| last - first < -MOST_BACK_M);
        for k in 0..count {
            let time_s = timestamp[k];
            if !TIME_S.contains(time_s) {
                return Err(wrong("timestamp", &time_s.to_string(), "a time in seconds since 1970"));
            }
            if k > 0 && !(time_s > timestamp[k - 1]) {
                return Err(wrong("timestamp", &time_s.to_string(), &format!("a time after {}", timestamp[k - 1])));
            }
            if !allowed::POSITION_M.contains(along_m[k]) {
                return Err(wrong("x_position", &x_position[k].to_string(), "a position of up to 32808399 feet"));
            }
            if !allowed::LATERAL_M.contains(y_position[k]) {
                return Err(wrong("y_position", &y_position[k].to_string(), "a position of up to 1000 feet"));
            }
            let mps = derived_speed_mps(k, count, |before, after| {
                (along_m[after] - along_m[before], timestamp[after] - timestamp[before])
            });
            let forward_mps = if is_against { mps.abs() } else { mps.max(0.0) };
            let right_m = direction * FOOT_M * y_position[k];
            self.signs[road as usize] += right_m.signum();
            let row = CollectedRow {
                vehicle,
                time: Time::from_s(time_s),
                // The sign of the lateral position is known after the last row, and the lane with it.
                position: Position::Road { road, s_m: along_m[k], d_m: -right_m, lane: 0 },
                speed_mps: forward_mps.min(allowed::SPEED_MPS.high),
                acceleration_mps2: None,
                length_m,
                width_m,
                class,
                line: number,
            };
            if !(mps.abs() <= allowed::SPEED_MPS.high) {
                let allowed = "what gives a speed of 0 to 150 m/s".to_owned();
                let problem = wrong_value(&x_position[k].to_string(), allowed);
                let mut error = ReadError::new(number, problem);
                error.column = Some("x_position");
                self.collected.push(Err(error))?;
                continue;
            }
            self.collected.push(Ok(row))?;
        }
        Ok(())
    }

    fn finish(mut self) -> Result<CollectedSource, ReadError> {
        let both = self.has == [true; 2];
        let (shift_m, first_lane) =
            if both { (f64::from(MAX_LANES) * LANE_M + SEPARATION_M, MAX_LANES + 1) } else { (0.0, 0) };
        for row in self.collected.rows_mut() {
            let Position::Road { road, d_m, lane, .. } = &mut row.position else { continue };
            *d_m *= self.signs[*road as usize].signum();
            *lane = lane_at(-*d_m);
            if *road == 1 {
                *d_m -= shift_m;
                *lane += first_lane;
            }
        }
        let edges = |first: u8, shift_m: f64| {
            let from = u8::from(first == 0);
            (from..=MAX_LANES).map(move |lane| (Lane(first + lane), -shift_m - LANE_M * f64::from(lane)))
        };
        let beside = both.then(|| edges(first_lane, shift_m)).into_iter().flatten();
        let markings = LaneMarkings::from_right_edges(edges(0, 0.0).chain(beside));
        let lanes = "the file states no lanes: they are counted in steps of 12 ft from the left edge";
        self.collected.into_source(Facts {
            layout: Layout::I24,
            clock: Clock::Continuous,
            lane_width_m: None,
            markings: Some(markings),
            notes: vec![lanes.to_owned()],
            mirrored: None,
            unknown_classes: UnknownClasses::default(),
        })
    }
}
