//! Messages of OSI: traces with lanes and without, and damaged ones.

use std::io::Cursor;
use std::path::Path;

use closecall_recorded::filters::smooth;
use closecall_recorded::lane_change::{LaneChange, LaneReliability, detect};
use closecall_recorded::osi::{
    BaseMoving, BoundaryPoint, Dimension3d, GroundTruth, Identifier, Lane, LaneBoundary, LaneClassification,
    MovingObject, Orientation3d, Timestamp, Vector3d, VehicleClassification,
};
use closecall_recorded::trajectory_data::{
    Layout, ReadOptions, TrajectoryData, TrajectoryFileError, TrajectoryFileProblem, open_from,
};
use closecall_traffic::{Side, VehicleClass};
use prost::Message;

const LANE_M: f64 = 3.75;
const LANES: u64 = 3;
const STEP_S: f64 = 0.05;

fn id(value: u64) -> Option<Identifier> {
    Some(Identifier { value: Some(value) })
}

fn vector(x: f64, y: f64) -> Vector3d {
    Vector3d { x: Some(x), y: Some(y), z: Some(0.0) }
}

/// A car: number 5 moves from the right lane to the middle one, between 6 and 12 s.
fn car(number: u64, time_s: f64) -> MovingObject {
    let tau = if number == 5 { ((time_s - 6.0) / 6.0).clamp(0.0, 1.0) } else { 0.0 };
    let share = tau.powi(3) * (10.0 - 15.0 * tau + 6.0 * tau * tau);
    let lane = (number % LANES) as f64;
    let base = BaseMoving {
        dimension: Some(Dimension3d { length: Some(4.5), width: Some(1.8), height: Some(1.4) }),
        position: Some(vector(25.0 * number as f64 + 30.0 * time_s, -LANE_M * (lane + 0.5 - share))),
        orientation: Some(Orientation3d { roll: None, pitch: None, yaw: Some(0.0) }),
        velocity: Some(vector(30.0, 0.0)),
        acceleration: None,
        orientation_rate: None,
    };
    MovingObject {
        id: id(number),
        base: Some(base),
        r#type: Some(2),
        vehicle_classification: Some(VehicleClassification {
            r#type: Some(if number == 7 { 12 } else { 4 }),
            light_state: None,
            has_trailer: None,
            role: None,
        }),
        ..MovingObject::default()
    }
}

/// Three lanes, whose centre lines point in the direction of travel or against it.
fn lanes(follow: bool) -> (Vec<Lane>, Vec<LaneBoundary>) {
    let line = |y_m: f64, follow: bool| {
        let mut points: Vec<Vector3d> = (-1..=20).map(|index| vector(100.0 * f64::from(index), y_m)).collect();
        if !follow {
            points.reverse();
        }
        points
    };
    let boundary = |number: u64| {
        // One of the lines is listed against the others.
        let points = line(-LANE_M * number as f64, number != 2).into_iter();
        let points = points.map(|point| BoundaryPoint { position: Some(point), width: None, height: None });
        LaneBoundary { id: id(200 + number), boundary_line: points.collect(), classification: None }
    };
    let lane = |number: u64| {
        let beside = |other: Option<u64>| other.filter(|other| *other < LANES).and_then(|other| id(100 + other));
        let (mut adjacent, mut boundaries) =
            ([beside(number.checked_sub(1)), beside(Some(number + 1))], [200 + number, 201 + number]);
        if !follow {
            adjacent.reverse();
            boundaries.reverse();
        }
        let [left, right] = adjacent.map(|lane| lane.into_iter().collect());
        let [left_line, right_line] = boundaries.map(|line| id(line).into_iter().collect());
        Lane {
            id: id(100 + number),
            classification: Some(LaneClassification {
                r#type: Some(2),
                centerline: line(-LANE_M * (number as f64 + 0.5), follow),
                centerline_is_driving_direction: Some(follow),
                left_adjacent_lane_id: left,
                right_adjacent_lane_id: right,
                left_lane_boundary_id: left_line,
                right_lane_boundary_id: right_line,
                ..LaneClassification::default()
            }),
        }
    };
    ((0..LANES).map(lane).collect(), (0..=LANES).map(boundary).collect())
}

/// A run of 20 s with 24 cars and a pedestrian. Its first message has the lanes that are given.
fn messages(lanes: Option<(Vec<Lane>, Vec<LaneBoundary>)>) -> Vec<GroundTruth> {
    let message = |step: u32| {
        let time_s = STEP_S * f64::from(step);
        let pedestrian = MovingObject { id: id(99), r#type: Some(3), ..MovingObject::default() };
        GroundTruth {
            timestamp: Some(Timestamp { seconds: Some(i64::from(step / 20)), nanos: Some(50_000_000 * (step % 20)) }),
            moving_object: (0..24).map(|number| car(number, time_s)).chain([pedestrian]).collect(),
            ..GroundTruth::default()
        }
    };
    let mut messages: Vec<GroundTruth> = (0..400).map(message).collect();
    if let Some((lane, lane_boundary)) = lanes {
        messages[0] = GroundTruth { lane, lane_boundary, ..messages[0].clone() };
    }
    messages
}

/// Returns the messages as a trace file.
fn trace(messages: &[GroundTruth]) -> Vec<u8> {
    let message = |message: &GroundTruth| {
        let bytes = message.encode_to_vec();
        [u32::try_from(bytes.len()).unwrap().to_le_bytes().to_vec(), bytes].concat()
    };
    messages.iter().flat_map(message).collect()
}

/// Returns the messages as an MCAP file, in a channel of this type.
fn mcap(messages: &[GroundTruth], kind: &str) -> Vec<u8> {
    let mut writer = mcap::WriteOptions::new().compression(None).create(Cursor::new(Vec::new())).unwrap();
    let schema = writer.add_schema(kind, "protobuf", &[]).unwrap();
    let channel_id = writer.add_channel(schema, "ground_truth", "protobuf", &Default::default()).unwrap();
    for (sequence, message) in (0..).zip(messages) {
        let time = 50_000_000 * u64::from(sequence);
        let header = mcap::records::MessageHeader { channel_id, sequence, log_time: time, publish_time: time };
        writer.write_to_known_channel(&header, &message.encode_to_vec()).unwrap();
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

fn read(name: &str, bytes: &[u8], lanes: LaneReliability) -> Result<TrajectoryData, TrajectoryFileError> {
    let options = ReadOptions { lanes, ..ReadOptions::default() };
    open_from(bytes, Path::new(name), options, usize::MAX)?.collect_all()
}

/// Asserts that only car 5 changes lanes.
fn assert_lane_change(data: &TrajectoryData) -> LaneChange {
    assert_eq!(data.layout, Layout::Osi);
    assert!(data.notes.iter().any(|note| note.starts_with("400 moving objects")), "{:?}", data.notes);
    let [change] = &detect(&smooth(data))[..] else { panic!("{}", data.trajectories.len()) };
    assert_eq!((change.track_id, change.direction, change.complete), (5, Side::Left, true));
    assert!((change.crossing_s - 9.0).abs() <= STEP_S + 1e-9, "{change:?}");
    change.clone()
}

#[test]
fn a_trace_with_lanes_is_read_with_them() {
    for follow in [true, false] {
        let messages = messages(Some(lanes(follow)));
        let of_trace = read("run.osi", &trace(&messages), LaneReliability::Reliable).unwrap();
        let change = assert_lane_change(&of_trace);
        assert_eq!((change.from_lane, change.to_lane), (3, 2));
        assert!((of_trace.markings.typical_lane_width_m() - LANE_M).abs() < 1e-9);
        let bus = of_trace.trajectories.iter().find(|track| track.track_id == 7).unwrap();
        assert_eq!((bus.class, bus.points.len()), (VehicleClass::Truck, 400));
        assert!((bus.points[0].d_m + 1.5 * LANE_M).abs() < 1e-9);
        let of_mcap = read("run.mcap", &mcap(&messages, "osi3.GroundTruth"), LaneReliability::Reliable).unwrap();
        assert_eq!(of_mcap.trajectories, of_trace.trajectories);
        let named_as_trace = read("run.osi", &mcap(&messages, "osi3.GroundTruth"), LaneReliability::Reliable).unwrap();
        assert_eq!(named_as_trace.trajectories, of_trace.trajectories);
    }
}

#[test]
fn a_number_of_vehicles_on_both_sides_of_a_road_is_the_reason_why_they_are_not_in_its_lanes() {
    let mut messages = messages(Some(lanes(true)));
    for object in
        messages.iter_mut().flat_map(|message| &mut message.moving_object).filter(|object| object.base.is_some())
    {
        let number = object.id.as_ref().and_then(|id| id.value).unwrap();
        object.id = id(number % 12);
        let position = object.base.as_mut().and_then(|base| base.position.as_mut()).unwrap();
        position.y = position.y.map(|y_m| if number >= 12 { y_m + 60.0 } else { y_m });
    }
    let problem = read("run.osi", &trace(&messages), LaneReliability::Reliable).unwrap_err().problem;
    assert!(matches!(problem, TrajectoryFileProblem::SharedNumber { vehicle: 0, .. }), "{problem}");
}

#[test]
fn vehicles_beside_the_middles_of_the_lanes_and_headings_of_other_axes_are_not_read_without_a_word() {
    let read_with = |edit: &dyn Fn(&mut BaseMoving)| {
        let mut messages = messages(Some(lanes(true)));
        let vehicles = messages.iter_mut().flat_map(|message| &mut message.moving_object);
        vehicles.filter_map(|object| object.base.as_mut()).for_each(edit);
        read("run.osi", &trace(&messages), LaneReliability::Reliable)
    };
    let shifted = |left_m: f64| {
        let data = read_with(&|base| {
            let position = base.position.as_mut().unwrap();
            position.y = position.y.map(|y_m| y_m + left_m);
        });
        let data = data.unwrap();
        assert_eq!(data.is_in_doubt, data.doubts_lanes);
        data.notes.into_iter().find(|note| note.contains("count from elsewhere"))
    };
    assert_eq!(shifted(0.5), None);
    assert!(shifted(1.5).unwrap().contains("1.5 m to the left of the middles"));
    assert!(shifted(-LANE_M).unwrap().contains("beside the lanes"));
    let turned = read_with(&|base| {
        base.orientation.as_mut().unwrap().yaw = Some(0.6);
    });
    let problem = turned.unwrap_err().problem;
    assert!(matches!(problem, TrajectoryFileProblem::HeadingsAgainstMotion { .. }), "{problem}");
}

#[test]
fn velocities_in_the_axes_of_the_vehicle_are_refused_by_that_reason() {
    // The road points to y.
    let read_with = |velocity: (f64, f64), with_lanes: bool| {
        let mut messages = messages(with_lanes.then(|| lanes(true)));
        let turned = |vector: &Vector3d| Vector3d { x: vector.y.map(|y| -y), y: vector.x, ..vector.clone() };
        for message in &mut messages {
            for base in message.moving_object.iter_mut().filter_map(|object| object.base.as_mut()) {
                base.position = base.position.as_ref().map(turned);
                base.orientation =
                    Some(Orientation3d { roll: None, pitch: None, yaw: Some(std::f64::consts::FRAC_PI_2) });
                base.velocity = Some(vector(velocity.0, velocity.1));
            }
            for point in message.lane_boundary.iter_mut().flat_map(|line| &mut line.boundary_line) {
                point.position = point.position.as_ref().map(turned);
            }
            for point in message.lane.iter_mut().filter_map(|lane| lane.classification.as_mut()) {
                point.centerline = point.centerline.iter().map(turned).collect();
            }
        }
        let lanes = if with_lanes { LaneReliability::Reliable } else { LaneReliability::Unreliable };
        read("run.osi", &trace(&messages), lanes)
    };
    for with_lanes in [true, false] {
        assert_lane_change(&read_with((0.0, 30.0), with_lanes).unwrap());
        let problem = read_with((30.0, 0.0), with_lanes).unwrap_err().problem;
        assert!(matches!(problem, TrajectoryFileProblem::VelocitiesAgainstMotion { percent: 99.0.. }), "{problem}");
    }
}

#[test]
fn lost_messages_are_bridged_and_no_uneven_clock() {
    let kept = messages(Some(lanes(true))).into_iter().enumerate().filter(|(number, _)| number % 50 != 7);
    let messages: Vec<GroundTruth> = kept.map(|(_, message)| message).collect();
    let data = read("run.osi", &trace(&messages), LaneReliability::Reliable).unwrap();
    assert_eq!(detect(&smooth(&data)).len(), 1);
    assert_eq!((data.continuity.bridged_gaps, data.continuity.pieces), (8 * 24, 24));
}

#[test]
fn a_map_that_is_mirrored_with_its_traffic_is_refused() {
    let mut messages = messages(Some(lanes(true)));
    let mirror = |vector: &mut Vector3d| vector.y = vector.y.map(|y| -y);
    for message in &mut messages {
        let vehicles = message.moving_object.iter_mut().filter_map(|object| object.base.as_mut()?.position.as_mut());
        let lines = message.lane_boundary.iter_mut().flat_map(|line| &mut line.boundary_line);
        vehicles.chain(lines.filter_map(|point| point.position.as_mut())).for_each(mirror);
    }
    let problem = read("run.osi", &trace(&messages), LaneReliability::Reliable).unwrap_err().problem;
    assert!(matches!(problem, TrajectoryFileProblem::NeighboursAgainstPosition { contrary: 4, all: 4 }), "{problem}");
}

#[test]
fn a_trace_without_lanes_is_read_if_they_are_to_be_estimated() {
    let bytes = trace(&messages(None));
    let error = read("run.osi", &bytes, LaneReliability::Reliable).unwrap_err();
    assert!(matches!(error.problem, TrajectoryFileProblem::NoLanes { .. }), "{error}");
    // The vehicle that changes lanes has the longest path: it must not become the reference.
    assert_lane_change(&read("run.osi", &bytes, LaneReliability::Unreliable).unwrap());
    // A lane without one of its boundaries is no lane.
    let (lane, mut boundaries) = lanes(true);
    boundaries.clear();
    let error = read("run.osi", &trace(&messages(Some((lane, boundaries)))), LaneReliability::Reliable).unwrap_err();
    assert!(error.to_string().contains("no driving lane with both boundaries"), "{error}");
}

#[test]
fn a_message_that_stands_there_twice_counts_once() {
    for lanes in [Some(lanes(true)), None] {
        let reliability = if lanes.is_some() { LaneReliability::Reliable } else { LaneReliability::Unreliable };
        let messages = messages(lanes);
        let mut twice = messages.clone();
        twice.insert(101, messages[100].clone());
        let [data, twice] = [messages, twice].map(|messages| read("run.osi", &trace(&messages), reliability).unwrap());
        assert_eq!((data.continuity.repeated_rows, twice.continuity.repeated_rows), (0, 24));
        assert!(
            twice.warnings().iter().any(|warning| warning.starts_with("left out: 24 rows")),
            "{:?}",
            twice.warnings()
        );
        assert_eq!(twice.trajectories, data.trajectories);
    }
}

#[test]
fn damaged_messages_are_refused_with_their_place() {
    let good = || messages(Some(lanes(true)));
    let with = |change: &dyn Fn(&mut MovingObject)| {
        let mut messages = good();
        change(&mut messages[3].moving_object[2]);
        trace(&messages)
    };
    let of_base = |change: &'static dyn Fn(&mut BaseMoving)| with(&move |object| change(object.base.as_mut().unwrap()));
    let bytes = trace(&good());
    let mut without_time = good();
    without_time[1].timestamp = None;
    let mut late = good();
    late[1].timestamp = Some(Timestamp { seconds: Some(-5), nanos: None });
    let mut nanos = good();
    nanos[1].timestamp = Some(Timestamp { seconds: Some(0), nanos: Some(u32::MAX) });
    let mut twice = good();
    twice[2].moving_object[1].id = id(0);
    let mut lines = lanes(true);
    lines.1[0].boundary_line =
        vec![BoundaryPoint { position: Some(vector(0.0, 0.0)), width: None, height: None }; 200_001];
    let mut still = good();
    still.iter_mut().for_each(|message| message.timestamp = Some(Timestamp { seconds: Some(3), nanos: Some(0) }));
    let mut pedestrians = good();
    pedestrians.iter_mut().flat_map(|message| &mut message.moving_object).for_each(|object| object.r#type = Some(3));
    let mcap_bytes = mcap(&good(), "osi3.GroundTruth");
    let mut flipped = mcap_bytes.clone();
    flipped[mcap_bytes.len() / 3] ^= 1;
    let mut wrong_magic = mcap_bytes.clone();
    wrong_magic[6] ^= 1;
    let cases: Vec<(&str, &str, Vec<u8>, &str)> = vec![
        ("empty", "a.osi", Vec::new(), "there are no rows"),
        ("cut in a message", "a.osi", bytes[..bytes.len() - 7].to_vec(), "message 399: the file is cut after"),
        ("cut in a length", "a.osi", bytes[..2].to_vec(), "message 0: the file is cut in its length"),
        ("a length beyond all", "a.osi", vec![0xff; 64], "message 0: its length is 4294967295 bytes"),
        ("text", "a.osi", b"{\"openlabel\": {}}".to_vec(), "message 0: its length is"),
        ("no message", "a.osi", [7_u32.to_le_bytes().to_vec(), vec![0xff; 7]].concat(), "message 0 is no GroundTruth"),
        ("a message without a time", "a.osi", trace(&without_time), "message 1: it has no `timestamp`"),
        ("a time before 1970", "a.osi", trace(&late), "message 1: `timestamp` is -5 s"),
        ("nanoseconds beyond a second", "a.osi", trace(&nanos), "4294967295 ns"),
        ("a time that stands still", "a.osi", trace(&still), "message 1: `timestamp` is 3 s as in the message before"),
        ("no vehicle", "a.osi", trace(&pedestrians), "none of its 10000 moving objects has the `type` of a vehicle"),
        ("a wrong bit", "a.mcap", flipped, "CRC"),
        ("a vehicle twice", "a.osi", trace(&twice), "frame 2 of vehicle 0 stands there twice"),
        ("no number", "a.osi", with(&|object| object.id = None), "message 3, moving_object 2: `id` is missing"),
        (
            "a huge number",
            "a.osi",
            with(&|object| object.id = id(u64::MAX)),
            "moving_object 2: `id` is missing or above",
        ),
        ("no base", "a.osi", with(&|object| object.base = None), "`base` is missing"),
        ("NaN", "a.osi", of_base(&|base| base.position = Some(vector(f64::NAN, 0.0))), "`base.position.x` is NaN"),
        (
            "infinity",
            "a.osi",
            of_base(&|base| base.velocity = Some(vector(f64::INFINITY, 0.0))),
            "`base.velocity.x` is inf",
        ),
        ("no size", "a.osi", of_base(&|base| base.dimension = None), "`base.dimension.length` is missing"),
        (
            "a negative size",
            "a.osi",
            of_base(&|base| {
                base.dimension = Some(Dimension3d { length: Some(-4.0), width: Some(2.0), height: None });
            }),
            "`base.dimension.length` is -4",
        ),
        ("no heading", "a.osi", of_base(&|base| base.orientation = None), "`base.orientation.yaw` is missing"),
        ("too many points", "a.osi", trace(&messages(Some(lines))), "more than 200000 points"),
        (
            "another type",
            "a.mcap",
            mcap(&good(), "osi3.SensorData"),
            "it has no message osi3.GroundTruth, only osi3.SensorData",
        ),
        ("a cut MCAP file", "a.mcap", mcap_bytes[..mcap_bytes.len() / 2].to_vec(), "ended in the middle of a record"),
        ("a wrong beginning", "a.mcap", wrong_magic, "it does not begin or end as MCAP files do"),
    ];
    assert!(cases.len() >= 20);
    for (case, name, bytes, needed) in cases {
        let message = read(name, &bytes, LaneReliability::Reliable).unwrap_err().to_string();
        assert!(message.contains(needed) && message.contains(name), "{case}: `{message}` does not say `{needed}`");
    }
}
