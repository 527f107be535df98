//! ASAM Open Simulation Interface (OSI) 3: the true states of vehicles, message by message.
//!
//! (ASAM OSI 3.8; omega-prime keeps such messages in MCAP files.)
//!
//! ```text
//!   FILE.osi   length, message, length, message, … ─┐                 lanes in the first message ─▶ roads ─┐
//!   FILE.mcap  the channel of `osi3.GroundTruth`   ─┴▶ GroundTruth ─▶ moving objects that are vehicles     ─┴▶ rows
//! ```
//!
//! - Position and size are of the bounding box, whose middle is OSI's reference point.
//! - If the first message has driving lanes with their boundaries, these form the road, as the lanelets
//!   of CommonRoad do; see `lanelets`. A vehicle is in the lane that contains its middle.
//! - Without them, no lane is certain: positions are in a plane, the road is derived from the traffic,
//!   and the lanes have to be estimated. A map in the file (OpenDRIVE) is not read.
//! - Pedestrians, animals and other objects are left out, and counted in a note.
//! - `SensorView` and `SensorData` are not read: they hold what a sensor sees.

use std::collections::{BTreeMap, VecDeque};
use std::io::BufRead;

use closecall_traffic::{Time, VehicleClass, maths};
use prost::Message;

use super::class_names::{UnknownClass, UnknownClasses};
use super::collected::{Collected, CollectedRow, Facts, Position};
use super::data::MarkingDistances;
use super::error::TrajectoryFileProblem;
use super::fields::{Bounds, shown};
use super::file_layout::Layout;
use super::lanelets::{Lanelet, Roads};
use super::mapped_rows::{MappedRow, MappedRows};
use super::osi_messages::{Messages, refused};
use super::plain::allowed;
use super::plane_pieces::PlaneMoment;
use super::plane_steps::PlaneSteps;
use super::plausible::MIN_SPEED_MPS;
use super::reference_line::Point;
use super::source::{Clock, FileInfo, ReadError, Row, RowSource};
use crate::lane_change::LaneReliability;
use crate::osi::{BaseMoving, GroundTruth, Identifier, Lane, LaneBoundary, Vector3d};

/// Types of moving objects and of lanes.
const VEHICLE: i32 = 2;
const DRIVING: i32 = 2;

const ANGLE_RAD: Bounds = Bounds::closed(-100.0, 100.0);
const VELOCITY_MPS: Bounds = Bounds::closed(-150.0, 150.0);
const LONGEST_S: i64 = 4_102_444_800;

/// Largest number of vehicles whose roads are remembered.
const MAX_VEHICLES: usize = 4_000_000;
/// Number of messages that show the usual time between two.
const FIRST_MESSAGES: usize = 20;
/// Largest number of points of all lane boundaries, as of CommonRoad's lanelets.
const MAX_POINTS: usize = 200_000;

/// A vehicle in a message.
struct Observed {
    number: u64,
    time: Time,
    message: u64,
    point: Point,
    heading_rad: f64,
    velocity_mps: Point,
    acceleration_mps2: Option<Point>,
    length_m: f64,
    width_m: f64,
    class: VehicleClass,
}

impl Observed {
    /// Returns the part of a vector in the direction of `heading_rad`.
    fn along((x, y): Point, heading_rad: f64) -> f64 {
        x * maths::cos(heading_rad) + y * maths::sin(heading_rad)
    }
}

/// The messages of a file, whose first one has been read.
struct OsiReader<R> {
    messages: Messages<R>,
    first: Option<GroundTruth>,
    /// Number of messages read.
    count: u64,
    left_out: u64,
    has_vehicles: bool,
    /// Time of the latest message, and the position of each of its vehicles.
    latest: Option<(Time, BTreeMap<u64, Point>)>,
}

/// Reads a file of `messages`.
///
/// # Errors
/// The file is damaged, or no lane is stated although `lanes` are needed.
pub(super) fn read<'a, R: BufRead + 'a>(
    messages: Messages<R>,
    lanes: LaneReliability,
) -> Result<Box<dyn RowSource + 'a>, ReadError> {
    let mut reader = OsiReader { messages, first: None, count: 0, left_out: 0, has_vehicles: false, latest: None };
    let Some(first) = reader.next()? else { return Err(ReadError::of_file(TrajectoryFileProblem::Empty)) };
    let roads = Roads::from_lanelets(&lanelets(&first)?);
    reader.first = Some(first);
    if !roads.is_empty() {
        return Ok(Box::new(OsiSource {
            reader,
            roads,
            road_of: BTreeMap::new(),
            first: VecDeque::new(),
            frames: None,
            rows: VecDeque::new(),
            motion: Motion::default(),
            mapped: MappedRows::default(),
        }));
    }
    if lanes == LaneReliability::Reliable {
        let place = "the first message has no driving lane with both boundaries".to_owned();
        return Err(ReadError::of_file(TrajectoryFileProblem::NoLanes { place }));
    }
    in_plane(reader)
}

impl<R: BufRead> OsiReader<R> {
    /// Returns the next message.
    fn next(&mut self) -> Result<Option<GroundTruth>, ReadError> {
        if let Some(first) = self.first.take() {
            return Ok(Some(first));
        }
        let number = self.count;
        let Some(bytes) = self.messages.next(number)? else { return Ok(None) };
        self.count += 1;
        let decoded = GroundTruth::decode(bytes.as_slice());
        decoded.map(Some).map_err(|error| refused(format!("message {number} is no GroundTruth: {error}")))
    }

    /// Returns the vehicles of the next message.
    fn next_vehicles(&mut self) -> Result<Option<Vec<Observed>>, ReadError> {
        let Some(message) = self.next()? else {
            if !self.has_vehicles && self.left_out > 0 {
                return Err(refused(format!(
                    "none of its {} moving objects has the `type` of a vehicle",
                    self.left_out
                )));
            }
            return Ok(None);
        };
        let number = self.count - 1;
        let wrong = |what: &str| refused(format!("message {number}: {what}"));
        let stamp = message.timestamp.as_ref().ok_or_else(|| wrong("it has no `timestamp`"))?;
        let (seconds, nanos) = (stamp.seconds.unwrap_or_default(), stamp.nanos.unwrap_or_default());
        if !(0..=LONGEST_S).contains(&seconds) || nanos >= 1_000_000_000 {
            return Err(wrong(&format!(
                "`timestamp` is {seconds} s and {nanos} ns, but a time from 1970 to 2100 is needed"
            )));
        }
        let time = Time::from_ns(1_000_000_000 * seconds + i64::from(nanos));
        let mut vehicles = Vec::new();
        for (index, object) in message.moving_object.iter().enumerate() {
            if object.r#type != Some(VEHICLE) {
                self.left_out += 1;
                continue;
            }
            let place = format!("message {number}, moving_object {index}");
            let id = value_of(object.id.as_ref()).filter(|id| *id <= allowed::TRACKS.1.unsigned_abs());
            let id = id.ok_or_else(|| refused(format!("{place}: `id` is missing or above {}", allowed::TRACKS.1)))?;
            let base = object.base.as_ref().ok_or_else(|| refused(format!("{place}: `base` is missing")))?;
            let kind = object.vehicle_classification.as_ref().and_then(|class| class.r#type);
            vehicles.push(observed(&place, base, id, time, number, class_of(kind))?);
        }
        self.has_vehicles |= !vehicles.is_empty();
        let points: BTreeMap<u64, Point> = vehicles.iter().map(|vehicle| (vehicle.number, vehicle.point)).collect();
        if let Some((before, points_before)) = self.latest.replace((time, points))
            && before == time
            && vehicles.iter().any(|vehicle| points_before.get(&vehicle.number).is_some_and(|at| *at != vehicle.point))
        {
            return Err(wrong(&format!(
                "`timestamp` is {} s as in the message before, but vehicles are at other places: time has to go on",
                time.s()
            )));
        }
        Ok(Some(vehicles))
    }

    fn notes(&self) -> Vec<String> {
        let of_others = || format!("{} moving objects that are not vehicles are left out", self.left_out);
        (self.left_out > 0).then(of_others).into_iter().collect()
    }
}

/// Checks the position and the motion of a vehicle.
fn observed(
    place: &str,
    base: &BaseMoving,
    number: u64,
    time: Time,
    message: u64,
    class: VehicleClass,
) -> Result<Observed, ReadError> {
    let checked = |name: &str, value: Option<f64>, bounds: Bounds| {
        let Some(value) = value else { return Err(refused(format!("{place}: `base.{name}` is missing"))) };
        if bounds.contains(value) {
            return Ok(value);
        }
        Err(refused(format!(
            "{place}: `base.{name}` is {}, but {} is needed",
            shown(value),
            bounds.describe("a number")
        )))
    };
    let vector = |name: &str, vector: Option<&Vector3d>, bounds: Bounds| -> Result<Point, ReadError> {
        let part = |part: &str, value: fn(&Vector3d) -> Option<f64>| {
            checked(&format!("{name}.{part}"), vector.and_then(value), bounds)
        };
        Ok((part("x", |vector| vector.x)?, part("y", |vector| vector.y)?))
    };
    let size = base.dimension.as_ref();
    let acceleration = base.acceleration.as_ref();
    let acceleration = acceleration.map(|mps2| vector("acceleration", Some(mps2), allowed::ACCELERATION_MPS2));
    Ok(Observed {
        number,
        time,
        message,
        point: vector("position", base.position.as_ref(), allowed::PLANE_M)?,
        heading_rad: checked("orientation.yaw", base.orientation.as_ref().and_then(|angles| angles.yaw), ANGLE_RAD)?,
        velocity_mps: vector("velocity", base.velocity.as_ref(), VELOCITY_MPS)?,
        acceleration_mps2: acceleration.transpose()?,
        length_m: checked("dimension.length", size.and_then(|size| size.length), allowed::LENGTH_M)?,
        width_m: checked("dimension.width", size.and_then(|size| size.width), allowed::WIDTH_M)?,
        class,
    })
}

/// Returns the class of a type of OSI's vehicles. Trailers, buses and rail vehicles count as trucks,
/// all on two wheels as motorcycles.
fn class_of(kind: Option<i32>) -> VehicleClass {
    match kind {
        Some(7 | 8 | 9 | 12 | 13 | 14 | 16 | 19) => VehicleClass::Truck,
        Some(10 | 11 | 15 | 17 | 18) => VehicleClass::Motorcycle,
        _ => VehicleClass::Car,
    }
}

fn value_of(id: Option<&Identifier>) -> Option<u64> {
    id.and_then(|id| id.value)
}

/// Returns the driving lanes of a message that have both boundaries.
fn lanelets(message: &GroundTruth) -> Result<BTreeMap<i64, Lanelet>, ReadError> {
    let boundaries: BTreeMap<u64, &LaneBoundary> =
        message.lane_boundary.iter().filter_map(|line| Some((value_of(line.id.as_ref())?, line))).collect();
    let points: usize = boundaries.values().map(|line| line.boundary_line.len()).sum();
    if points > MAX_POINTS {
        return Err(refused(format!("message 0: the lane boundaries have more than {MAX_POINTS} points")));
    }
    let lanes = message.lane.iter().filter_map(|lane| lanelet(lane, &boundaries));
    Ok(lanes.collect())
}

fn lanelet(lane: &Lane, boundaries: &BTreeMap<u64, &LaneBoundary>) -> Option<(i64, Lanelet)> {
    let name = |id: &Identifier| id.value.and_then(|value| i64::try_from(value).ok());
    let id = name(lane.id.as_ref()?)?;
    let classification = lane.classification.as_ref().filter(|lane| lane.r#type == Some(DRIVING))?;
    let centre: Vec<Point> = classification.centerline.iter().filter_map(|point| Some((point.x?, point.y?))).collect();
    let (first, last) = (centre.first()?, centre.last()?);
    let direction = (last.0 - first.0, last.1 - first.1);
    // Boundaries may be listed against the centre line.
    let line = |ids: &[Identifier]| {
        let lines = ids.iter().filter_map(|id| boundaries.get(&id.value?));
        let parts = lines.map(|line| {
            let points = line.boundary_line.iter().filter_map(|point| point.position.as_ref());
            let mut points: Vec<Point> = points.filter_map(|point| Some((point.x?, point.y?))).collect();
            let (begin, end) = (points.first().copied(), points.last().copied());
            let is_against = begin
                .zip(end)
                .is_some_and(|(begin, end)| (end.0 - begin.0) * direction.0 + (end.1 - begin.1) * direction.1 < 0.0);
            if is_against {
                points.reverse();
            }
            points
        });
        parts.flatten().collect::<Vec<Point>>()
    };
    let (mut left, mut right) =
        (line(&classification.left_lane_boundary_id), line(&classification.right_lane_boundary_id));
    let is_finite = |points: &[Point]| points.iter().all(|(x, y)| x.is_finite() && y.is_finite());
    if left.len() < 2 || right.len() < 2 || !is_finite(&left) || !is_finite(&right) {
        return None;
    }
    let mut left_id = classification.left_adjacent_lane_id.first().and_then(name);
    let mut right_id = classification.right_adjacent_lane_id.first().and_then(name);
    let pairs = classification.lane_pairing.iter();
    let follows = classification.centerline_is_driving_direction != Some(false);
    let next: Vec<i64> = pairs
        .filter_map(|pair| if follows { pair.successor_lane_id.as_ref() } else { pair.antecessor_lane_id.as_ref() })
        .filter_map(name)
        .collect();
    if !follows {
        (left, right) = (right, left);
        left.reverse();
        right.reverse();
        (left_id, right_id) = (right_id, left_id);
    }
    Some((id, Lanelet { left, right, left_id, right_id, successors: next }))
}

/// Rows of a file whose first message states the lanes.
struct OsiSource<R> {
    reader: OsiReader<R>,
    roads: Roads,
    /// The road of each vehicle, by its number.
    road_of: BTreeMap<u64, usize>,
    /// The vehicles of the first messages, whose frames are not yet counted.
    first: VecDeque<Vec<Observed>>,
    /// The frames of messages; known after the first messages.
    frames: Option<Frames>,
    rows: VecDeque<Row>,
    motion: Motion,
    mapped: MappedRows,
}

/// The frames of messages, by their times: messages may be missing.
struct Frames {
    /// Usual time between two messages.
    usual: Time,
    /// Time and frame of the latest message.
    latest: Option<(Time, i64)>,
}

impl Frames {
    /// Takes the usual time between two messages from the `times` of the first ones.
    fn new(times: &[Time]) -> Self {
        let mut steps: Vec<Time> =
            times.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > Time::ZERO).collect();
        steps.sort_unstable();
        Self { usual: steps.get(steps.len() / 2).copied().unwrap_or(Time::from_ms(100)), latest: None }
    }

    /// Returns the frame of the next message, which is at `time`.
    fn at(&mut self, time: Time) -> i64 {
        let frame = self.latest.map_or(0, |(before, frame)| {
            let (step, half) = (time - before, Time::from_ns(self.usual.ns() / 2));
            let steps = (step + half).ns().div_euclid(self.usual.ns()).clamp(-allowed::FRAMES.1, allowed::FRAMES.1);
            // An early message has a frame of its own.
            allowed::FRAMES.1.min(frame + if step > Time::ZERO { steps.max(1) } else { steps })
        });
        self.latest = Some((time, frame));
        frame
    }
}

/// The movements of vehicles, compared with their headings and with their velocities.
#[derive(Default)]
struct Motion {
    headings: PlaneSteps,
    velocities: PlaneSteps,
}

impl Motion {
    /// Adds a vehicle, and returns its speed (m/s).
    fn add(&mut self, vehicle: &Observed) -> f64 {
        let Observed { number, time, point, heading_rad, velocity_mps, .. } = *vehicle;
        let speed_mps = Observed::along(velocity_mps, heading_rad);
        let moment = PlaneMoment { vehicle: number, time, point, heading_rad, speed_mps, clock: Clock::Continuous };
        self.headings.add(moment);
        let (x_mps, y_mps) = velocity_mps;
        if maths::hypot(x_mps, y_mps) > MIN_SPEED_MPS {
            self.velocities.add(PlaneMoment { heading_rad: maths::atan2(y_mps, x_mps), ..moment });
        }
        speed_mps
    }

    /// Checks the axes of the headings and the velocities. Other axes are a reason why speeds
    /// contradict the positions, and why vehicles seem to leave the road of the map, too.
    ///
    /// # Errors
    /// The headings contradict the movements, or the velocities alone do.
    fn check_velocities(&self) -> Result<(), ReadError> {
        match (self.velocities.contradicted_percent(), self.headings.contradicted_percent()) {
            (Some(percent), None) => Err(TrajectoryFileProblem::VelocitiesAgainstMotion { percent }),
            (_, Some(_)) => self.headings.check(Layout::Osi),
            (None, None) => Ok(()),
        }
        .map_err(ReadError::of_file)
    }
}

impl<R: BufRead> RowSource for OsiSource<R> {
    fn info(&self) -> FileInfo {
        FileInfo { layout: Layout::Osi, name: None, period: None, markings: Some(self.roads.markings()) }
    }

    fn unknown_classes(&self) -> &[UnknownClass] {
        &[]
    }

    fn warnings(&self) -> Vec<String> {
        self.reader.notes().into_iter().chain(self.mapped.doubt_of_turns()).collect()
    }

    fn is_in_doubt(&self) -> bool {
        self.mapped.doubt_of_turns().is_some()
    }

    fn check_velocities(&self) -> Result<(), ReadError> {
        self.motion.check_velocities()
    }

    fn check_sides(&self, _is_mirrored: bool) -> Result<(), ReadError> {
        let neighbours = self.roads.check_neighbours();
        neighbours.and_then(|()| self.motion.headings.check(Layout::Osi)).map_err(ReadError::of_file)
    }

    fn off_road_percent(&self) -> Option<f64> {
        self.mapped.off_road_percent()
    }

    fn map_doubt(&self) -> Option<String> {
        self.mapped.doubt_of_place()
    }

    fn next_row(&mut self) -> Result<Option<Row>, ReadError> {
        while self.rows.is_empty() {
            let Some(vehicles) = self.next_vehicles()? else { return Ok(None) };
            let frame =
                vehicles.first().zip(self.frames.as_mut()).map_or(0, |(vehicle, frames)| frames.at(vehicle.time));
            for vehicle in vehicles {
                let Observed { number, point, heading_rad, .. } = vehicle;
                let road = match self.road_of.get(&number) {
                    Some(road) => *road,
                    None if self.road_of.len() >= MAX_VEHICLES => {
                        return Err(refused(format!("there are more than {MAX_VEHICLES} vehicles")));
                    }
                    None => {
                        let road = self.roads.road_at(point, heading_rad);
                        self.road_of.insert(number, road);
                        road
                    }
                };
                let Some(place) = self.roads.locate(road, point) else { continue };
                let speed_mps = self.motion.add(&vehicle);
                self.mapped.add(
                    MappedRow { vehicle: number, time: vehicle.time, point, heading_rad, speed_mps, place },
                    &self.roads,
                );
                let along = |vector| Observed::along(vector, place.heading_rad);
                self.rows.push_back(Row {
                    number,
                    origin: Time::ZERO,
                    vehicle_id: number,
                    frame,
                    time: vehicle.time,
                    clock: Clock::Continuous,
                    s_m: place.s_m,
                    d_m: place.d_m,
                    lane: place.lane,
                    speed_mps: along(vehicle.velocity_mps),
                    acceleration_mps2: vehicle.acceleration_mps2.map(along),
                    length_m: vehicle.length_m,
                    width_m: vehicle.width_m,
                    class: vehicle.class,
                    marking_distances: MarkingDistances::default(),
                    line: vehicle.message + 1,
                });
            }
        }
        Ok(self.rows.pop_front())
    }
}

impl<R: BufRead> OsiSource<R> {
    /// Returns the vehicles of the next message. Reads some messages ahead at first, which show the usual time
    /// between two.
    fn next_vehicles(&mut self) -> Result<Option<Vec<Observed>>, ReadError> {
        if self.frames.is_none() {
            while self.first.len() < FIRST_MESSAGES
                && let Some(vehicles) = self.reader.next_vehicles()?
            {
                self.first.push_back(vehicles);
            }
            let times: Vec<Time> = self.first.iter().filter_map(|vehicles| Some(vehicles.first()?.time)).collect();
            self.frames = Some(Frames::new(&times));
        }
        match self.first.pop_front() {
            Some(vehicles) => Ok(Some(vehicles)),
            None => self.reader.next_vehicles(),
        }
    }
}

/// Reads the rows of a file that states no lanes.
fn in_plane<'a, R: BufRead + 'a>(mut reader: OsiReader<R>) -> Result<Box<dyn RowSource + 'a>, ReadError> {
    let mut collected = Collected::default();
    let mut motion = Motion::default();
    while let Some(vehicles) = reader.next_vehicles()? {
        for vehicle in vehicles {
            let Observed { point, heading_rad, .. } = vehicle;
            motion.add(&vehicle);
            let along = |vector| Observed::along(vector, heading_rad);
            let index = collected.vehicle(&vehicle.number.to_string());
            collected.push(Ok(CollectedRow {
                vehicle: index,
                time: vehicle.time,
                position: Position::Plane { point, heading_rad, changes_lane: false, named_lane: None },
                speed_mps: along(vehicle.velocity_mps),
                acceleration_mps2: vehicle.acceleration_mps2.map(along),
                length_m: vehicle.length_m,
                width_m: vehicle.width_m,
                class: vehicle.class,
                line: vehicle.message + 1,
            }))?;
        }
    }
    motion.check_velocities()?;
    Ok(Box::new(collected.into_source(Facts {
        layout: Layout::Osi,
        clock: Clock::Continuous,
        lane_width_m: None,
        markings: None,
        notes: reader.notes(),
        mirrored: None,
        unknown_classes: UnknownClasses::default(),
    })?))
}
