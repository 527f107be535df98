//! Writes the text of an OpenLABEL file.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, Write};

use closecall_traffic::{Dimensions, Lane, Time, VehicleClass, maths};
use serde::Serialize;
use serde_json::{Value, json};

use super::element::{Action, Agent, Context, Data, FrameInterval, Named, Object, Pointer, Relation, Tag, Values};
use super::label::{Failure, Labels};
use super::names::{self, lane_change_type, vehicle_type};
use super::sorted_points::{LabelledPoint, SortedPoints};
use crate::criticality::MetricResult;
use crate::lane_change::LaneChange;
use crate::trajectory_data::{LaneMarkings, WriteError};

/// Number of ASAM's ontology in a file.
const ONTOLOGY_UID: &str = "0";

/// The comment in the header of the file.
const COMMENT: &str = "Positions are the centres of vehicles: x along the road, y to the left of the left edge of lane 1, z up (m). \
    Cuboids are x, y, z, three angles (rad), length, width, height; the height is the typical one of the class. The names of numbers end \
    with their units.";

/// A track without its points.
#[derive(Clone, Debug)]
pub(super) struct Vehicle {
    pub(super) track_id: u64,
    pub(super) vehicle_id: u64,
    pub(super) class: VehicleClass,
    pub(super) dimensions: Dimensions,
    pub(super) first: Time,
    pub(super) last: Time,
    /// The lanes that the vehicle uses, in their order.
    pub(super) lanes: Vec<u8>,
}

/// Facts about the whole recording.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facts<'a> {
    pub(super) name: &'a str,
    pub(super) tagged_file: &'a str,
    /// Time between two frames.
    pub(super) period: Time,
    pub(super) markings: &'a LaneMarkings,
    pub(super) is_simulated: bool,
    /// Whether the recording states the lanes of its vehicles.
    pub(super) states_lanes: bool,
    /// Whether the recording states the markings of the lanes.
    pub(super) states_markings: bool,
    pub(super) is_motorway: bool,
}

/// The frames of a recording: frame 0 is its first instant.
#[derive(Clone, Copy, Debug)]
struct Frames {
    start: Time,
    period: Time,
}

impl Frames {
    fn at(self, time: Time) -> i64 {
        ((time - self.start).ns() + self.period.ns() / 2).div_euclid(self.period.ns().max(1))
    }

    fn interval(self, first: Time, last: Time) -> FrameInterval {
        FrameInterval { frame_start: self.at(first), frame_end: self.at(last) }
    }
}

/// A lane change with its metrics as the data of an action.
struct LabelledChange<'a> {
    lane_change: &'a LaneChange,
    data: Data,
}

/// Writes a file.
///
/// # Errors
/// Fails if the file cannot be written, or if two points of a track are in one frame.
pub(super) fn write(
    file: &mut (dyn Write + Send),
    facts: &Facts<'_>,
    vehicles: &[Vehicle],
    labels: &Labels<'_>,
    points: SortedPoints,
) -> Result<(), Failure> {
    let start = vehicles.iter().map(|vehicle| vehicle.first).min().unwrap_or(Time::ZERO);
    let frames = Frames { start, period: facts.period };
    let actions = actions(labels, vehicles, frames);
    let mut metadata = json!({
        "schema_version": names::SCHEMA_VERSION,
        "name": facts.name,
        "annotator": "closecall",
        "comment": COMMENT,
        "tagged_file": facts.tagged_file,
        "frame_period_s": facts.period.s(),
    });
    if facts.is_simulated {
        metadata["simulated"] = true.into();
    }
    write!(file, "{{\"openlabel\":{{")?;
    member(file, "", "metadata", &metadata)?;
    member(file, ",\n", "ontologies", &json!({ ONTOLOGY_UID: names::ONTOLOGY }))?;
    let road = json!({ names::ROAD: { "type": names::SCENE, "parent": "", "children": [] } });
    member(file, ",\n", "coordinate_systems", &road)?;
    members(file, "tags", tags(facts, vehicles).into_iter().enumerate())?;
    members(file, "contexts", lanes(facts, vehicles).into_iter())?;
    let mut by_id: Vec<&Vehicle> = vehicles.iter().collect();
    by_id.sort_by_key(|vehicle| vehicle.track_id);
    members(file, "objects", by_id.into_iter().map(|vehicle| (vehicle.track_id, object(vehicle, frames))))?;
    members(file, "actions", actions.iter().map(|(action, _)| action).enumerate())?;
    members(file, "relations", actions.iter().map(|(_, relation)| relation).enumerate())?;
    write!(file, ",\n\"frames\":{{")?;
    let spans: Vec<FrameInterval> = actions.iter().map(|(action, _)| action.frame_intervals[0]).collect();
    let intervals = write_frames(file, frames, vehicles, &spans, points)?;
    write!(file, "}}")?;
    member(file, ",\n", "frame_intervals", &intervals)?;
    writeln!(file, "}}}}")?;
    Ok(())
}

fn member(file: &mut dyn Write, before: &str, name: &str, value: &impl Serialize) -> io::Result<()> {
    write!(file, "{before}\"{name}\":")?;
    serde_json::to_writer(file, value)?;
    Ok(())
}

/// Writes elements by their numbers, one a line. Nothing is written if there are none.
fn members<K: ToString, T: Serialize>(
    file: &mut dyn Write,
    name: &str,
    elements: impl Iterator<Item = (K, T)>,
) -> io::Result<()> {
    let mut elements = elements.peekable();
    if elements.peek().is_none() {
        return Ok(());
    }
    write!(file, ",\n\"{name}\":{{")?;
    let mut before = "\n";
    for (uid, element) in elements {
        member(file, before, &uid.to_string(), &element)?;
        before = ",\n";
    }
    write!(file, "}}")
}

/// Returns the tags that the recording makes certain, about the road and its traffic.
fn tags(facts: &Facts<'_>, vehicles: &[Vehicle]) -> Vec<Tag> {
    let tag = |kind, tag_data| Tag { kind, ontology_uid: ONTOLOGY_UID, tag_data };
    let vec = |kind, values| Some(Data { vec: vec![Named::of_tag(kind, values)], ..Data::default() });
    let lane_count = |kind, lanes: usize| {
        let num = vec![Named::of_tag(kind, lanes as f64)];
        tag("LaneSpecificationLaneCount", Some(Data { num, ..Data::default() }))
    };
    let mut tags = Vec::new();
    if facts.is_motorway {
        tags.push(tag("RoadTypeMotorway", None));
    }
    let is_lane = |lane: &Lane| !facts.markings.is_median(*lane);
    if facts.states_lanes && facts.states_markings {
        let marked = (1..=u8::MAX).map(Lane).filter(is_lane);
        let widths: Vec<f64> = marked.filter_map(|lane| facts.markings.lane_width_m(lane)).collect();
        if !widths.is_empty() {
            let (low, high) =
                widths.iter().fold((f64::INFINITY, 0.0_f64), |(low, high), m| (low.min(*m), high.max(*m)));
            tags.push(lane_count("value", widths.len()));
            tags.push(tag("LaneSpecificationDimensions", vec("range", Values::Numbers(vec![low, high]))));
        }
    } else if facts.states_lanes {
        // Lanes that no vehicle uses are unknown.
        let used = lanes_of(vehicles).into_iter().map(Lane).filter(is_lane).count();
        tags.extend((used > 0).then(|| lane_count("min", used)));
    }
    let is_present = |class: &VehicleClass| vehicles.iter().any(|vehicle| vehicle.class == *class);
    let classes: Vec<&str> = VehicleClass::ALL.into_iter().filter(is_present).map(vehicle_type).collect();
    if !classes.is_empty() {
        tags.push(tag("TrafficAgentType", vec("values", Values::Texts(classes))));
    }
    tags
}

/// Returns the lanes that vehicles use. Lane 0 is none.
fn lanes_of(vehicles: &[Vehicle]) -> BTreeSet<u8> {
    vehicles.iter().flat_map(|vehicle| &vehicle.lanes).copied().filter(|lane| *lane > 0).collect()
}

/// Returns the lanes that vehicles use or whose right edge is known.
fn lanes(facts: &Facts<'_>, vehicles: &[Vehicle]) -> BTreeMap<u8, Context> {
    let mut lanes = lanes_of(vehicles);
    lanes.extend((1..=u8::MAX).filter(|lane| facts.markings.right_edge_m(Lane(*lane)).is_some()));
    let context = |number: u8| {
        let lane = Lane(number);
        let is_median = facts.markings.is_median(lane);
        let edge = facts.markings.right_edge_m(lane).map(|edge_m| Named::new(names::RIGHT_EDGE, edge_m));
        let num = std::iter::once(Named::new(names::LANE, f64::from(number))).chain(edge).collect();
        let context = Context {
            name: if is_median { "strip between two carriageways".to_owned() } else { format!("lane {number}") },
            kind: if is_median { "median" } else { names::LANE_TYPE },
            ontology_uid: (!is_median).then_some(ONTOLOGY_UID),
            context_data: Data { num, ..Data::default() },
        };
        (number, context)
    };
    lanes.into_iter().map(context).collect()
}

fn object(vehicle: &Vehicle, frames: Frames) -> Object {
    let interval = frames.interval(vehicle.first, vehicle.last);
    let Dimensions { length_m, width_m, .. } = vehicle.dimensions;
    let mut num = vec![Named::new("length_m", length_m), Named::new("width_m", width_m)];
    if vehicle.vehicle_id != vehicle.track_id {
        num.push(Named::new(names::VEHICLE, vehicle.vehicle_id as f64));
    }
    let pointer = |kind| Pointer { kind, frame_intervals: vec![interval] };
    let of_frames = [names::SPEED, names::ACCELERATION, names::LANE].map(|name| (name, pointer("num")));
    let pointers = std::iter::once((names::SHAPE, pointer("cuboid"))).chain(of_frames);
    Object {
        name: format!("vehicle {}", vehicle.vehicle_id),
        kind: vehicle_type(vehicle.class),
        ontology_uid: ONTOLOGY_UID,
        frame_intervals: [interval],
        object_data: Data { num, ..Data::default() },
        object_data_pointers: pointers.collect(),
    }
}

/// Returns the actions in the order of their lane changes, each with the relation to its vehicle.
fn actions(labels: &Labels<'_>, vehicles: &[Vehicle], frames: Frames) -> Vec<(Action, Relation)> {
    let changes: Vec<LabelledChange<'_>> = match labels {
        Labels::LaneChanges(changes) => {
            changes.iter().map(|change| LabelledChange { lane_change: change, data: data_of(change) }).collect()
        }
        Labels::Criticality(changes, _) => {
            let labelled = |change: &'_ crate::criticality::CriticalLaneChange| {
                let mut data = data_of(&change.lane_change);
                for (name, whole, crossing) in change.named() {
                    add_metric(&mut data, name, whole);
                    add_metric(&mut data, &format!("{name}_at_crossing"), crossing);
                }
                data
            };
            changes
                .iter()
                .map(|change| LabelledChange { lane_change: &change.lane_change, data: labelled(change) })
                .collect()
        }
    };
    let by_id: BTreeMap<u64, &Vehicle> = vehicles.iter().map(|vehicle| (vehicle.track_id, vehicle)).collect();
    let action = |(uid, LabelledChange { lane_change, data }): (usize, LabelledChange<'_>)| {
        let vehicle = by_id.get(&lane_change.track_id)?;
        // A lane change that is not complete may begin before its track, and end after it.
        let within = |time_s: f64| Time::from_s(time_s).max(vehicle.first).min(vehicle.last);
        let (from, to) =
            (lane_change.start_s.min(lane_change.crossing_s), lane_change.end_s.max(lane_change.crossing_s));
        let (track, kind) = (lane_change.track_id, lane_change_type(lane_change.direction));
        let action = Action {
            name: format!("lane change of vehicle {}", lane_change.vehicle_id),
            kind,
            ontology_uid: ONTOLOGY_UID,
            frame_intervals: [frames.interval(within(from), within(to))],
            action_data: data,
        };
        let relation = Relation {
            name: format!("vehicle {} changes lanes", lane_change.vehicle_id),
            kind: "isSubjectOfAction",
            rdf_subjects: [Agent { uid: track.to_string(), kind: "object" }],
            rdf_objects: [Agent { uid: uid.to_string(), kind: "action" }],
        };
        Some((action, relation))
    };
    changes.into_iter().enumerate().filter_map(action).collect()
}

/// Returns the values of a lane change with their names in the command's JSON output. The speed at
/// the crossing is `crossing_speed_mps`, as `speed_mps` is the metric.
fn data_of(change: &LaneChange) -> Data {
    let mut data = Data::default();
    if let Ok(Value::Object(values)) = serde_json::to_value(change) {
        for (name, value) in values {
            let name = if name == "speed_mps" { "crossing_speed_mps".to_owned() } else { name };
            match value {
                Value::Number(number) => data.num.extend(number.as_f64().map(|number| Named::new(name, number))),
                Value::Bool(flag) => data.boolean.push(Named::new(name, flag)),
                Value::String(text) => data.text.push(Named::new(name, text)),
                Value::Null | Value::Array(_) | Value::Object(_) => {}
            }
        }
    }
    data
}

/// Adds a metric: its value with opponent, time and verdict, or else the reason why it has none.
fn add_metric(data: &mut Data, name: &str, metric: MetricResult) {
    match metric {
        MetricResult::Value { value, opponent, time_s, critical } if value.is_finite() => {
            let opponent = opponent.map(|track| Named::new("opponent", track as f64));
            let num = opponent.into_iter().chain([Named::new("time_s", time_s)]).collect();
            let attributes = Data { num, boolean: vec![Named::new("critical", critical)], ..Data::default() };
            data.num.push(Named::new(name, value).with(attributes));
        }
        MetricResult::Value { .. } => data.text.push(Named::new(format!("{name}_absent"), "not finite".to_owned())),
        MetricResult::Absent { absent } => {
            let reason = serde_json::to_value(absent).ok().and_then(|reason| reason.as_str().map(str::to_owned));
            data.text.push(Named::new(format!("{name}_absent"), reason.unwrap_or_default()));
        }
    }
}

/// Writes the frames. Returns the intervals in which no frame is missing.
fn write_frames(
    file: &mut dyn Write,
    frames: Frames,
    vehicles: &[Vehicle],
    spans: &[FrameInterval],
    mut points: SortedPoints,
) -> Result<Vec<FrameInterval>, Failure> {
    let mut latest = vec![-1_i64; vehicles.len()];
    let mut intervals: Vec<FrameInterval> = Vec::new();
    let mut open: Option<(i64, Time)> = None;
    let mut before = "\n";
    while let Some(point) = points.next()? {
        let track = point.track as usize;
        let frame = frames.at(point.time);
        if frame <= latest[track] {
            let (track_id, time_s, period_s) = (vehicles[track].track_id, point.time.s(), frames.period.s());
            return Err(WriteError::OffClock { track_id, time_s, period_s }.into());
        }
        latest[track] = frame;
        let frame_time = match open {
            Some((number, time)) if number == frame => {
                write!(file, ",")?;
                time
            }
            _ => {
                if let Some((number, _)) = open {
                    end_frame(file, number, spans)?;
                }
                write!(file, "{before}\"{frame}\":{{\"frame_properties\":")?;
                serde_json::to_writer(&mut *file, &json!({ "timestamp": point.time.s() })).map_err(io::Error::from)?;
                write!(file, ",\"objects\":{{")?;
                before = ",\n";
                match intervals.last_mut() {
                    Some(interval) if interval.frame_end + 1 == frame => interval.frame_end = frame,
                    _ => intervals.push(FrameInterval { frame_start: frame, frame_end: frame }),
                }
                open = Some((frame, point.time));
                point.time
            }
        };
        write_point(file, &point, &vehicles[track], frame_time)?;
    }
    if let Some((number, _)) = open {
        end_frame(file, number, spans)?;
    }
    Ok(intervals)
}

/// Ends a frame with the actions that happen in it.
fn end_frame(file: &mut dyn Write, frame: i64, spans: &[FrameInterval]) -> io::Result<()> {
    let happens = |span: &FrameInterval| (span.frame_start..=span.frame_end).contains(&frame);
    let happening = spans.iter().enumerate().filter(|(_, span)| happens(span));
    let happening: BTreeMap<usize, Value> = happening.map(|(uid, _)| (uid, json!({}))).collect();
    write!(file, "}}")?;
    if !happening.is_empty() {
        write!(file, ",\"actions\":")?;
        serde_json::to_writer(&mut *file, &happening)?;
    }
    write!(file, "}}")
}

fn write_point(file: &mut dyn Write, point: &LabelledPoint, vehicle: &Vehicle, frame_time: Time) -> io::Result<()> {
    let &LabelledPoint { s_m, d_m, speed_mps, acceleration_mps2, lateral_speed_mps, lane, .. } = point;
    let Dimensions { length_m, width_m, height_m } = vehicle.dimensions;
    let yaw_rad = maths::atan2(lateral_speed_mps, speed_mps);
    let cuboid = [s_m, d_m, 0.5 * height_m, 0.0, 0.0, yaw_rad, length_m, width_m, height_m];
    write!(
        file,
        "\"{}\":{{\"object_data\":{{\"cuboid\":[{{\"name\":\"{}\",\"coordinate_system\":\"{}\",\"val\":",
        vehicle.track_id,
        names::SHAPE,
        names::ROAD
    )?;
    serde_json::to_writer(&mut *file, &cuboid)?;
    write!(file, "}}],\"num\":[")?;
    let numbers = [(names::SPEED, speed_mps), (names::ACCELERATION, acceleration_mps2), (names::LANE, f64::from(lane))];
    let time = (point.time != frame_time).then(|| (names::TIME, point.time.s()));
    let mut before = "";
    for (name, value) in numbers.into_iter().chain(time) {
        write!(file, "{before}{{\"name\":\"{name}\",\"val\":")?;
        serde_json::to_writer(&mut *file, &value)?;
        write!(file, "}}")?;
        before = ",";
    }
    write!(file, "]}}}}")
}
