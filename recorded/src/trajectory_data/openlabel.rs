//! ASAM OpenLABEL 1.0.0: vehicles as cuboids in the frames of a JSON file.
//!
//! (ASAM OpenLABEL 1.0.0, 2021.) [`label_file`](crate::openlabel::label_file) writes such files.
//!
//! ```text
//!   frames.N.objects.ID: cuboid in `closecall-road`, number `lane`  ─▶ positions on the road ─▶ rows
//!                        cuboid in another `scene_cs`               ─▶ positions in a plane ─▶ inferred road ─▶ rows
//!   frames.N.frame_properties.timestamp, or a frame rate            ─▶ time
//!   objects.ID.type                                                 ─▶ vehicle class
//! ```
//!
//! - A cuboid is x, y, z, three angles, length, width, height, or has a quaternion in place of the
//!   angles. x of the vehicle points forward.
//! - The time of a frame is its timestamp: a number of seconds, as such or as text, or an instant in
//!   UTC such as `2020-04-11T12:00:01.2Z` (ISO 8601; without an offset, UTC is meant). If no frame has
//!   a timestamp, `frame_rate` (Hz) of `metadata` or of a stream gives the times.
//! - Files of other programs state no lanes, so that these have to be estimated. Speeds that no number
//!   `speed_mps` states are derived from the positions.
//! - A file that lacks one of these is refused, with the place where it is missing.

use std::collections::{BTreeMap, BTreeSet};
use std::io::BufRead;

use closecall_traffic::{Lane, Time, VehicleClass, maths};

use super::class_names::{UnknownClass, UnknownClasses};
use super::collected::{Collected, CollectedRow, Facts, Position, derived_speed_mps, distinct_numbers};
use super::data::MarkingDistances;
use super::error::TrajectoryFileProblem;
use super::fields::{Bounds, shown};
use super::file_layout::Layout;
use super::json_input::JsonInput;
use super::markings::LaneMarkings;
use super::openlabel_text::{LabelledRow, OpenLabelText, Timestamp};
use super::plain::allowed;
use super::rows::io_problem;
use super::source::{Clock, FileInfo, ReadError, Row, RowSource};
use crate::lane_change::LaneReliability;
use crate::openlabel::names;

const FORMAT: &str = "OpenLABEL file";

/// Allowed time between two frames (s), as of CommonRoad.
const PERIOD_S: Bounds = Bounds::closed(0.001, 100.0);
/// Allowed frame rate (Hz).
const RATE_HZ: Bounds = Bounds::closed(0.01, 1_000.0);
const SPEED_MPS: Bounds = Bounds::closed(-150.0, 150.0);
const ANGLE_RAD: Bounds = Bounds::closed(-100.0, 100.0);

fn refused(reason: String) -> ReadError {
    ReadError::of_file(TrajectoryFileProblem::Unreadable { format: FORMAT, reason })
}

/// Returns true if a JSON file with this beginning is of OpenLABEL, or of VCD.
pub(super) fn is_openlabel(start: &[u8]) -> bool {
    let Some(text) = start.strip_prefix(b"{") else { return false };
    let text = text.trim_ascii_start();
    text.starts_with(b"\"openlabel\"") || text.starts_with(b"\"vcd\"")
}

/// Reads a file.
///
/// # Errors
/// The JSON is damaged, or lacks what trajectory data needs.
pub(super) fn read<'a>(input: impl BufRead + 'a, lanes: LaneReliability) -> Result<Box<dyn RowSource + 'a>, ReadError> {
    let (input, lines) = JsonInput::new(input).map_err(|error| ReadError::of_file(io_problem(error)))?;
    let mut json = serde_json::Deserializer::from_reader(input);
    let text = OpenLabelText::read(lines, &mut json).and_then(|text| json.end().map(|()| text));
    let text = text.map_err(|error| {
        let line = u64::try_from(error.line()).unwrap_or(u64::MAX);
        let reason = error.to_string();
        ReadError::new(line, TrajectoryFileProblem::Unreadable { format: FORMAT, reason })
    })?;
    check_version(&text)?;
    check_rows(&text)?;
    let systems: BTreeSet<Option<&str>> = text.rows.iter().map(|row| text.system_of(row)).collect();
    if systems.len() == 1 && systems.contains(&Some(names::ROAD)) {
        return Ok(Box::new(on_road(text)?));
    }
    for system in systems {
        check_system(&text, system)?;
    }
    if lanes == LaneReliability::Reliable {
        let at = text.rows.first().map(|row| path_of(&text, row)).unwrap_or_default();
        let place = format!("`{at}` has no number `{}` in `{}`", names::LANE, names::ROAD);
        return Err(ReadError::of_file(TrajectoryFileProblem::NoLanes { place }));
    }
    in_plane(text)
}

/// Refuses other versions.
fn check_version(text: &OpenLabelText) -> Result<(), ReadError> {
    if let Some(version) = &text.vcd_version {
        let version = if version.is_empty() { "an unknown version".to_owned() } else { format!("version {version}") };
        return Err(refused(format!(
            "`vcd`: this is VCD ({version}), the predecessor of OpenLABEL, which is not read; the Python package `vcd` converts it to OpenLABEL {}",
            names::SCHEMA_VERSION
        )));
    }
    if !text.is_openlabel {
        return Err(refused("the root has no `openlabel`".to_owned()));
    }
    match text.metadata.as_ref().and_then(|metadata| metadata.schema_version.as_deref()) {
        Some(names::SCHEMA_VERSION) => Ok(()),
        Some(other) => {
            let reason =
                format!("`openlabel.metadata.schema_version` is `{other}`, but `{}` is needed", names::SCHEMA_VERSION);
            Err(refused(reason))
        }
        None => Err(refused("`openlabel.metadata.schema_version` is missing".to_owned())),
    }
}

/// Refuses a file without a vehicle in a frame, and says what it has instead.
fn check_rows(text: &OpenLabelText) -> Result<(), ReadError> {
    if !text.rows.is_empty() {
        return Ok(());
    }
    let needed = "a `cuboid` of each vehicle in each frame, with its position in metres, is needed";
    let reason = match (&text.pixels, &text.static_cuboid) {
        (Some(path), _) => format!("`{path}` is in pixels, but {needed}"),
        (None, Some(path)) => format!("`{path}` belongs to no frame, but {needed} (`openlabel.frames`)"),
        (None, None) if text.frames == 0 && text.objects.is_empty() => {
            format!("`openlabel.objects` and `openlabel.frames` are missing or empty, but {needed}")
        }
        (None, None) if text.frames == 0 => format!("`openlabel.frames` is missing or empty, but {needed}"),
        (None, None) => format!("no object of `openlabel.frames` has a `cuboid`, but {needed}"),
    };
    Err(refused(reason))
}

/// Refuses positions whose axes are unknown, or move.
fn check_system(text: &OpenLabelText, system: Option<&str>) -> Result<(), ReadError> {
    let row = text.rows.iter().find(|row| text.system_of(row) == system);
    let path = row.map(|row| format!("`{}.cuboid.0`", path_of(text, row))).unwrap_or_default();
    let scene = format!("a coordinate system of the type `{}`, which does not move, is needed", names::SCENE);
    let Some(name) = system else {
        return Err(refused(format!("{path} names no `coordinate_system`: {scene}")));
    };
    match text.systems.get(name).map(String::as_str) {
        _ if name == names::ROAD => Err(refused(format!(
            "{path} is in `{name}`, and other cuboids are in another coordinate system: one is needed for all"
        ))),
        Some(names::SCENE) => Ok(()),
        Some(kind) => Err(refused(format!("{path} is in `{name}`, which has the type `{kind}`: {scene}"))),
        None => Err(refused(format!("{path} is in `{name}`, which `openlabel.coordinate_systems` lacks: {scene}"))),
    }
}

/// Returns the path of the data of a vehicle in a frame.
fn path_of(text: &OpenLabelText, row: &LabelledRow) -> String {
    let uid = text.objects.get(row.object as usize).map_or("", |object| object.uid.as_str());
    format!("openlabel.frames.{}.objects.{uid}.object_data", row.frame)
}

/// The times of frames.
struct Times<'t> {
    timestamps: &'t BTreeMap<i64, Timestamp>,
    /// Time between two frames (s), if a frame rate is stated.
    period_s: Option<f64>,
}

impl<'t> Times<'t> {
    fn new(text: &'t OpenLabelText) -> Result<Self, ReadError> {
        let metadata = text.metadata.as_ref();
        let of_period = metadata.and_then(|metadata| metadata.frame_period_s);
        if let Some(period_s) = of_period.filter(|period_s| !PERIOD_S.contains(*period_s)) {
            return Err(refused(format!(
                "`openlabel.metadata.frame_period_s` is {}, but 0.001 to 100 s is needed",
                shown(period_s)
            )));
        }
        let rate_hz = metadata.and_then(|metadata| metadata.frame_rate).or(text.stream_rate);
        if let Some(rate_hz) = rate_hz.filter(|rate_hz| !RATE_HZ.contains(*rate_hz)) {
            return Err(refused(format!("`frame_rate` is {}, but 0.01 to 1000 Hz is needed", shown(rate_hz))));
        }
        Ok(Self { timestamps: &text.timestamps, period_s: of_period.or(rate_hz.map(|rate_hz| 1.0 / rate_hz)) })
    }

    /// Returns the time of a frame.
    fn at(&self, frame: i64) -> Result<Time, ReadError> {
        let path = || format!("`openlabel.frames.{frame}.frame_properties.timestamp`");
        let stated = self.timestamps.get(&frame);
        let time = match (stated, self.period_s) {
            (Some(Timestamp::Seconds(seconds)), _) => in_epoch(*seconds),
            (Some(Timestamp::Text(text)), _) => text_time(text.trim()),
            (None, Some(period_s)) if self.timestamps.is_empty() => in_epoch(frame as f64 * period_s),
            (None, Some(_)) => {
                return Err(refused(format!(
                    "{} is missing, but other frames have one: a timestamp in each frame is needed, or `frame_rate` (Hz) and none",
                    path()
                )));
            }
            (None, None) => {
                return Err(refused(format!(
                    "{} is missing: the time of each frame in seconds is needed, or `frame_rate` (Hz) in `openlabel.metadata` or in the \
                     `stream_properties` of a stream",
                    path()
                )));
            }
        };
        time.ok_or_else(|| {
            let actual = match stated {
                Some(Timestamp::Seconds(seconds)) => shown(*seconds),
                Some(Timestamp::Text(text)) => format!("\"{}\"", text.chars().take(40).collect::<String>()),
                None => format!("missing, and frame {frame} of `frame_rate` is outside of the allowed times"),
            };
            refused(format!(
                "{} is {actual}, but a time in seconds from 0 to {}, or an instant in UTC such as \"2020-04-11T12:00:01.2Z\" up to the \
                 year 2100 is needed",
                path(),
                EPOCH_S.high
            ))
        })
    }
}

/// Returns a time in seconds, or `None` if it is outside of [`EPOCH_S`].
fn in_epoch(seconds: f64) -> Option<Time> {
    EPOCH_S.contains(seconds).then(|| Time::from_s(seconds))
}

/// Returns the time that a text states in seconds, or as an instant of ISO 8601. An instant without an
/// offset is in UTC, as OpenLABEL states.
fn text_time(text: &str) -> Option<Time> {
    if let Ok(seconds) = text.parse() {
        return in_epoch(seconds);
    }
    let in_utc = || {
        let instant: jiff::civil::DateTime = text.parse().ok()?;
        Some(instant.to_zoned(jiff::tz::TimeZone::UTC).ok()?.timestamp())
    };
    let instant = text.parse::<jiff::Timestamp>().ok().or_else(in_utc)?;
    let time = Time::from_ns(i64::try_from(instant.as_nanosecond()).ok()?);
    EPOCH_S.contains(time.s()).then_some(time)
}

/// Seconds since the start of the recording, or since 1970 up to the year 2100.
const EPOCH_S: Bounds = Bounds::closed(0.0, 4_102_444_800.0);

/// Returns the class that the type of an object names.
fn class_of(kind: &str, unknown: &mut UnknownClasses) -> VehicleClass {
    // The type may be an address, such as the address of a term of an ontology.
    let term = kind.rsplit(['#', '/', ':']).next().unwrap_or(kind);
    let class = VehicleClass::ALL.into_iter().find(|class| {
        names::vehicle_type(*class).eq_ignore_ascii_case(term) || class.name().eq_ignore_ascii_case(term)
    });
    class.unwrap_or_else(|| unknown.nearest_of(term))
}

/// Checks a number of a vehicle in a frame.
fn checked(path: &str, name: &str, value: f64, bounds: Bounds) -> Result<f64, ReadError> {
    if bounds.contains(value) {
        return Ok(value);
    }
    Err(refused(format!("{name} of `{path}` is {}, but {} is needed", shown(value), bounds.describe("a number"))))
}

/// Checks a whole number of a vehicle or a lane.
fn whole(path: &str, name: &str, value: f64, high: f64) -> Result<u64, ReadError> {
    let bounds = Bounds::closed(0.0, high);
    if bounds.contains(value) && value.fract() == 0.0 {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a whole number in bounds")]
        return Ok(value as u64);
    }
    Err(refused(format!("{name} of `{path}` is {}, but {} is needed", shown(value), bounds.describe("a whole number"))))
}

/// Returns the lane with a number.
fn lane_number(path: &str, value: f64) -> Result<u8, ReadError> {
    whole(path, names::LANE, value, f64::from(u8::MAX)).map(|lane| u8::try_from(lane).unwrap_or(u8::MAX))
}

/// Returns the numbers of tracks: the names of the objects if all are numbers, else their order.
fn numbers(text: &OpenLabelText, notes: &mut Vec<String>) -> Vec<u64> {
    let names = text.objects.iter().map(|object| object.uid.as_str());
    distinct_numbers(names, allowed::TRACKS.1.unsigned_abs()).unwrap_or_else(|| {
        notes.push("the names of objects are not numbers: they are numbered in their order".to_owned());
        (1..=text.objects.len() as u64).collect()
    })
}

/// Returns the classes of the objects.
fn classes(text: &OpenLabelText, unknown: &mut UnknownClasses) -> Vec<VehicleClass> {
    text.objects.iter().map(|object| class_of(&object.kind, unknown)).collect()
}

/// Returns the clock of a file.
fn clock(text: &OpenLabelText) -> Clock {
    match text.metadata.as_ref().is_some_and(|metadata| metadata.simulated) {
        true => Clock::Simulated,
        false => Clock::Continuous,
    }
}

/// Returns the acceleration that a file states for a vehicle in a frame.
fn acceleration_mps2(path: &str, row: &LabelledRow) -> Result<Option<f64>, ReadError> {
    let checked = |mps2| checked(path, names::ACCELERATION, mps2, allowed::ACCELERATION_MPS2);
    row.acceleration_mps2.get().map(checked).transpose()
}

/// The rows of a file that states positions and lanes on the road. Each is checked when it is asked
/// for, so that the file is held once.
struct RoadRows {
    /// The file without its rows.
    text: OpenLabelText,
    rows: std::vec::IntoIter<LabelledRow>,
    /// Numbers of the tracks, by the index of the object.
    numbers: Vec<u64>,
    classes: Vec<VehicleClass>,
    /// Time between two frames (s), if a frame rate is stated.
    period_s: Option<f64>,
    clock: Clock,
    info: FileInfo,
    notes: Vec<String>,
    unknown_classes: UnknownClasses,
}

/// Returns the rows of a file that states positions and lanes on the road.
fn on_road(mut text: OpenLabelText) -> Result<RoadRows, ReadError> {
    let mut rows = std::mem::take(&mut text.rows);
    rows.sort_by_key(|row| (row.frame, row.object));
    let mut notes = Vec::new();
    let numbers = numbers(&text, &mut notes);
    let mut unknown_classes = UnknownClasses::default();
    let classes = classes(&text, &mut unknown_classes);
    let period_s = Times::new(&text)?.period_s;
    let info = FileInfo {
        layout: Layout::OpenLabel,
        name: text.metadata.as_ref().and_then(|metadata| metadata.name.clone()),
        period: period_s.map(Time::from_s),
        markings: markings(&text.right_edges_m)?,
    };
    let clock = clock(&text);
    Ok(RoadRows { text, rows: rows.into_iter(), numbers, classes, period_s, clock, info, notes, unknown_classes })
}

impl RoadRows {
    /// Checks what a frame says of a vehicle.
    fn row(&self, row: &LabelledRow) -> Result<Row, ReadError> {
        let path = path_of(&self.text, row);
        let (object, number) = (&self.text.objects[row.object as usize], self.numbers[row.object as usize]);
        let need = |name: &str, value: Option<f64>| {
            value.ok_or_else(|| {
                refused(format!("`{path}.num` has no `{name}`, which cuboids in `{}` need", names::ROAD))
            })
        };
        let speed_mps = checked(&path, names::SPEED, need(names::SPEED, row.speed_mps.get())?, SPEED_MPS)?;
        let lane = lane_number(&path, need(names::LANE, row.lane.get())?)?;
        let time = match row.time_s.get() {
            Some(time_s) => Time::from_s(checked(&path, names::TIME, time_s, EPOCH_S)?),
            None => Times { timestamps: &self.text.timestamps, period_s: self.period_s }.at(row.frame)?,
        };
        let in_object = || format!("openlabel.objects.{}.object_data", object.uid);
        let stated =
            object.vehicle_id.map(|vehicle| whole(&in_object(), names::VEHICLE, vehicle, allowed::TRACKS.1 as f64));
        let vehicle_id = stated.transpose()?.unwrap_or(number);
        Ok(Row {
            number,
            origin: Time::ZERO,
            vehicle_id,
            frame: row.frame,
            time,
            clock: self.clock,
            s_m: checked(&path, "x of the cuboid", row.x_m, allowed::POSITION_M)?,
            d_m: checked(&path, "y of the cuboid", row.y_m, LATERAL_M)?,
            lane,
            speed_mps,
            acceleration_mps2: acceleration_mps2(&path, row)?,
            length_m: checked(&path, "the length of the cuboid", row.length_m, allowed::LENGTH_M)?,
            width_m: checked(&path, "the width of the cuboid", row.width_m, allowed::WIDTH_M)?,
            class: self.classes[row.object as usize],
            marking_distances: MarkingDistances::default(),
            line: row.line,
        })
    }
}

impl RowSource for RoadRows {
    fn info(&self) -> FileInfo {
        self.info.clone()
    }

    fn unknown_classes(&self) -> &[UnknownClass] {
        self.unknown_classes.names()
    }

    fn warnings(&self) -> Vec<String> {
        self.notes.clone()
    }

    fn next_row(&mut self) -> Result<Option<Row>, ReadError> {
        self.rows.next().map(|row| self.row(&row)).transpose()
    }
}

/// Lateral positions of several roads beside each other, 1 km apart (m).
const LATERAL_M: Bounds = Bounds::closed(-1e5, 1e5);

/// Returns the markings that the contexts state, if there are some.
fn markings(right_edges_m: &[(f64, f64)]) -> Result<Option<LaneMarkings>, ReadError> {
    let edge = |&(lane, edge_m): &(f64, f64)| {
        let path = "openlabel.contexts";
        let lane = Lane(lane_number(path, lane)?);
        Ok((lane, checked(path, names::RIGHT_EDGE, edge_m, LATERAL_M)?))
    };
    let edges = right_edges_m.iter().map(edge).collect::<Result<Vec<_>, ReadError>>()?;
    Ok((!edges.is_empty()).then(|| LaneMarkings::from_right_edges(edges)))
}

/// Returns the rows of a file that states positions in a plane, and no lanes.
fn in_plane<'a>(mut text: OpenLabelText) -> Result<Box<dyn RowSource + 'a>, ReadError> {
    let mut rows = std::mem::take(&mut text.rows);
    rows.sort_by_key(|row| (row.object, row.frame));
    let mut unknown_classes = UnknownClasses::default();
    let classes = classes(&text, &mut unknown_classes);
    let times = Times::new(&text)?;
    let mut collected = Collected::default();
    for of_object in rows.chunk_by(|a, b| a.object == b.object) {
        let instants: Vec<Time> = of_object.iter().map(|row| times.at(row.frame)).collect::<Result<_, _>>()?;
        for (k, row) in of_object.iter().enumerate() {
            let path = path_of(&text, row);
            let in_plane = |name, value| checked(&path, name, value, allowed::PLANE_M);
            let point = (in_plane("x of the cuboid", row.x_m)?, in_plane("y of the cuboid", row.y_m)?);
            let heading_rad = checked(&path, "the yaw angle of the cuboid", row.yaw_rad, ANGLE_RAD)?;
            let derived = || {
                derived_speed_mps(k, of_object.len(), |before, after| {
                    let (from, to) = (&of_object[before], &of_object[after]);
                    let (dx, dy) = (to.x_m - from.x_m, to.y_m - from.y_m);
                    let along_m = dx * maths::cos(heading_rad) + dy * maths::sin(heading_rad);
                    (along_m, (instants[after] - instants[before]).s())
                })
            };
            let speed_mps = match row.speed_mps.get() {
                Some(stated_mps) => checked(&path, "the speed", stated_mps, SPEED_MPS)?,
                // A step to another vehicle of the same name is refused as such later.
                None => derived().clamp(SPEED_MPS.low, SPEED_MPS.high),
            };
            let vehicle = collected.vehicle(&text.objects[row.object as usize].uid);
            collected.push(Ok(CollectedRow {
                vehicle,
                time: instants[k],
                position: Position::Plane { point, heading_rad, changes_lane: false, named_lane: None },
                speed_mps,
                acceleration_mps2: acceleration_mps2(&path, row)?,
                length_m: checked(&path, "the length of the cuboid", row.length_m, allowed::LENGTH_M)?,
                width_m: checked(&path, "the width of the cuboid", row.width_m, allowed::WIDTH_M)?,
                class: classes[row.object as usize],
                line: row.line,
            }))?;
        }
    }
    Ok(Box::new(collected.into_source(Facts {
        mirrored: None,
        layout: Layout::OpenLabel,
        clock: clock(&text),
        lane_width_m: None,
        markings: None,
        notes: Vec::new(),
        unknown_classes,
    })?))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file with one car in two frames. The second has these numbers.
    fn file(second: &str) -> String {
        let road = names::ROAD;
        let frame = |time_s: f64, s_m: f64, numbers: &str| {
            format!(
                r#"{{"frame_properties": {{"timestamp": {time_s}}}, "objects": {{"7": {{"object_data": {{
                "cuboid": [{{"coordinate_system": "{road}", "val": [{s_m}, -1.75, 0, 0, 0, 0, 4.5, 1.8, 1.5]}}],
                "num": [{numbers}]}}}}}}}}"#
            )
        };
        let speed = format!(r#"{{"name": "{}", "val": 30}}"#, names::SPEED);
        let first = format!(r#"{speed}, {{"name": "{}", "val": 1}}"#, names::LANE);
        format!(
            r#"{{"openlabel": {{"metadata": {{"schema_version": "{}"}}, "objects": {{"7": {{"type": "car"}}}},
            "frames": {{"0": {}, "1": {}}}}}}}"#,
            names::SCHEMA_VERSION,
            frame(0.0, 100.0, &first),
            frame(0.1, 103.0, &format!("{speed}{second}"))
        )
    }

    #[test]
    fn rows_on_the_road_are_checked_when_they_are_asked_for() {
        let lane = format!(r#", {{"name": "{}", "val": 1}}"#, names::LANE);
        let text = file(&lane);
        let mut rows = read(text.as_bytes(), LaneReliability::Reliable).unwrap();
        let [first, second] = [(); 2].map(|()| rows.next_row().unwrap().unwrap());
        assert_eq!((first.number, first.frame, first.s_m, first.lane), (7, 0, 100.0, 1));
        assert_eq!((second.time, second.speed_mps, second.acceleration_mps2), (Time::from_ms(100), 30.0, None));
        assert!(rows.next_row().unwrap().is_none());
        let text = file("");
        let mut rows = read(text.as_bytes(), LaneReliability::Reliable).unwrap();
        assert!(rows.next_row().unwrap().is_some());
        let error = rows.next_row().unwrap_err();
        let message = error.problem.to_string();
        assert!(message.contains("`openlabel.frames.1.objects.7.object_data.num` has no `lane`"), "{message}");
        assert!(!error.affects_one_row());
    }

    #[test]
    fn two_vehicles_of_one_name_in_a_frame_are_the_reason_of_a_refusal_and_not_their_speed() {
        let cuboid = |x_m: f64| {
            format!(
                r#""7": {{"object_data": {{"cuboid": [{{"coordinate_system": "world",
                "val": [{x_m}, 0, 0, 0, 0, 0, 4.5, 1.8, 1.5]}}]}}}}"#
            )
        };
        let frame = |frame: i32| {
            let (first, second) = (cuboid(2.0 * f64::from(frame)), cuboid(300.0 + 2.0 * f64::from(frame)));
            let time_s = 0.1 * f64::from(frame);
            format!(r#""{frame}": {{"frame_properties": {{"timestamp": {time_s}}}, "objects": {{{first}, {second}}}}}"#)
        };
        let frames: Vec<String> = (0..20).map(frame).collect();
        let text = format!(
            r#"{{"openlabel": {{"metadata": {{"schema_version": "{}"}}, "coordinate_systems": {{"world": {{"type": "scene_cs"}}}},
            "objects": {{"7": {{"type": "car"}}}}, "frames": {{{}}}}}}}"#,
            names::SCHEMA_VERSION,
            frames.join(", ")
        );
        let error = match read(text.as_bytes(), LaneReliability::Unreliable) {
            Err(error) => error,
            Ok(mut rows) => std::iter::from_fn(|| rows.next_row().transpose()).find_map(Result::err).unwrap(),
        };
        let problem = error.problem;
        assert!(matches!(problem, TrajectoryFileProblem::SharedNumber { vehicle: 7, .. }), "{problem}");
    }

    #[test]
    fn a_row_takes_no_more_memory_than_its_numbers() {
        // Twelve numbers of 8 bytes: two of them for object, frame and coordinate system.
        assert!(size_of::<LabelledRow>() <= 96, "{}", size_of::<LabelledRow>());
    }
}
