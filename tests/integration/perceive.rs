//! `closecall study perceive`: the tracks of a run come out of its recorded scans again, a recording in the documented layout runs with
//! the documentation alone, and what is wrong with a recording is named.

use std::collections::BTreeMap;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::Command;

use arrow::array::{Array, AsArray, RecordBatch};
use arrow::datatypes::{DataType, Float32Type, Float64Type, UInt16Type, UInt32Type};
use closecall_testing::python_with;
use closecall_traffic::{Time, maths};
use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions};
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use serde_json::Value;

use crate::support::{ROOT, closecall, code, folder, json, message, stdout};

/// The rear vehicle starts near the ego.
const NEAR: &str = "actor.rear.start.behind.gap-m=45";
/// The sample of a run, for the study of its scans.
const SAMPLE: [&str; 6] = ["--seed", "3", "--sample", "2", "--set", NEAR];

/// Scenarios whose tracks must come out again: what is added to the headline, and the options of both commands.
const ROUND_TRIPS: [(&str, &str); 4] = [
    ("", "scans.parquet"),
    // A bend, guard rails, and a slower LiDAR at a corner beside one that looks ahead, whose scans are left out.
    (
        "road.curvature-per-m = 0.001\nroad.guard-rails = true\n\
         [[sensors.additional-rear-lidars]]\nname = \"left\"\nmodel = \"pandar-xt-16\"\nleft-m = 0.8\nazimuth-deg = 45\n\
         [sensors.front-lidar]\nmodel = \"scala-2\"\n",
        "scans.parquet",
    ),
    // A clothoid to the left and one to the right.
    (
        "road.guard-rails = true\nroad.alignment = [{ s-m = 0.0, curvature-per-m = 0.001 }, \
         { s-m = 1000.0, curvature-per-m = -0.001 }]\n",
        "scans.parquet",
    ),
    ("environment.visibility-m = 150\nsensors.tracker.latency-s = 0.12\n", "scans.pcd"),
];

fn read(path: &Path) -> Vec<RecordBatch> {
    let reader = ParquetRecordBatchReaderBuilder::try_new(File::open(path).unwrap()).unwrap().build().unwrap();
    reader.map(Result::unwrap).collect()
}

/// The rows of a table of tracks that the rear sensors report from time 0 on: the texts and the bits of all columns but the number of the
/// track and the truth, and the truth. Tracks are numbered in the order of their appearance.
fn rear_rows(path: &Path) -> Vec<(Vec<String>, Vec<String>)> {
    const TRUTH: [&str; 6] = ["actor", "distance_m", "error_x_m", "error_y_m", "error_vx_mps", "error_vy_mps"];
    let mut numbers: BTreeMap<u32, usize> = BTreeMap::new();
    let mut rows = Vec::new();
    for batch in read(path) {
        let source = batch.column_by_name("source").unwrap().as_string::<i32>();
        let time_s = batch.column_by_name("time_s").unwrap().as_primitive::<Float64Type>();
        for row in (0..batch.num_rows()).filter(|row| source.value(*row) == "rear" && time_s.value(*row) >= 0.0) {
            let (mut values, mut truth) = (Vec::new(), Vec::new());
            for (field, column) in batch.schema().fields().iter().zip(batch.columns()) {
                let text = match column.data_type() {
                    _ if column.is_null(row) => String::new(),
                    DataType::Utf8 => column.as_string::<i32>().value(row).to_owned(),
                    DataType::Boolean => column.as_boolean().value(row).to_string(),
                    DataType::Float64 if TRUTH.contains(&&**field.name()) => {
                        format!("{:.6}", column.as_primitive::<Float64Type>().value(row))
                    }
                    DataType::Float64 => format!("{:016x}", column.as_primitive::<Float64Type>().value(row).to_bits()),
                    DataType::UInt32 => {
                        let next = numbers.len();
                        numbers.entry(column.as_primitive::<UInt32Type>().value(row)).or_insert(next).to_string()
                    }
                    other => panic!("{}: {other}", field.name()),
                };
                if TRUTH.contains(&&**field.name()) { &mut truth } else { &mut values }.push(text);
            }
            rows.push((values, truth));
        }
    }
    rows
}

/// Runs a sample of the headline with these lines, and records its scans and its tracks. Returns the scenario, the scans and the tracks.
fn record(folder: &Path, lines: &str, scans: &str) -> [PathBuf; 3] {
    let [scenario, scans, tracks] = ["scenario.toml", scans, "run.parquet"].map(|name| folder.join(name));
    let text = format!("base = \"low-thw-overtake\"\nduration-s = 4\nsensors.rear-camera.pipeline = \"off\"\n{lines}");
    std::fs::write(&scenario, text).unwrap();
    let [of_scenario, of_scans, of_tracks] = [&scenario, &scans, &tracks].map(|path| path.to_str().unwrap());
    let options = ["--sensors", "full", "--seed", "3", "--sample", "2", "--controller", "mis"];
    let files = ["--set", NEAR, "--scans", of_scans, "--tracks", of_tracks];
    stdout(&closecall([&["run", of_scenario], &options[..], &files].concat()), 0);
    [scenario, scans, tracks]
}

/// Runs the chain on a recording, and returns the result and the tracks.
fn perceive(scans: &Path, scenario: &Path, more: &[&str]) -> (Value, PathBuf) {
    let tracks = scans.with_file_name("perceived.parquet");
    let paths = [scans, scenario, &tracks].map(|path| path.to_str().unwrap());
    let args = ["study", "perceive", paths[0], paths[1], "--tracks", paths[2], "--format", "json"];
    (json(&closecall([&args[..], more].concat()), 0), tracks)
}

#[test]
fn the_recorded_scans_of_a_run_give_its_tracks_again_to_the_bit() {
    for (lines, name) in ROUND_TRIPS {
        let folder = folder();
        let [scenario, scans, tracks] = record(folder.path(), lines, name);
        let (result, perceived) = perceive(&scans, &scenario, &SAMPLE);
        let (expected, perceived) = (rear_rows(&tracks), rear_rows(&perceived));
        assert!(expected.len() > 60, "{lines}: {} rows", expected.len());
        assert_eq!(perceived.len(), expected.len(), "{lines}");
        for (row, (perceived, expected)) in perceived.iter().zip(&expected).enumerate() {
            assert_eq!(perceived, expected, "{lines}: row {row}");
        }
        // Labels begin with the run.
        let truth = &result["truth"];
        assert_eq!(truth["id_switches"], 0, "{truth}");
        assert!(truth["groups"][0]["recall"].as_f64().unwrap() > 0.9, "{truth}");
        assert_eq!(result["road"], "map");
    }
}

#[test]
fn other_settings_of_the_chain_give_other_tracks() {
    let folder = folder();
    let [scenario, scans, tracks] = record(folder.path(), "", "scans.parquet");
    for setting in
        ["sensors.cluster-core-points=6", "sensors.tracker.latency-s=0", "sensors.rear-lidar.mount-height-m=0.9"]
    {
        let (_, perceived) = perceive(&scans, &scenario, &[&SAMPLE[..], &["--set", setting]].concat());
        assert_ne!(rear_rows(&perceived), rear_rows(&tracks), "{setting}");
    }
}

#[test]
fn absurd_places_and_values_of_a_recording_are_refused() {
    let folder = folder();
    let [scenario, scans, _] = record(folder.path(), "", "scans.parquet");
    // The row of each table that is changed, whose line in the file is one more.
    const ROW: usize = 30;
    let changed = |name: &str, column: &str, value: &str, is_changed: &dyn Fn(usize) -> bool| {
        let path = folder.path().join(format!("scans.{name}.csv"));
        let text = std::fs::read_to_string(&path).unwrap();
        let index = text.lines().next().unwrap().split(',').position(|field| field == column).unwrap();
        let change = |(row, line): (usize, &str)| {
            let mut fields: Vec<&str> = line.split(',').collect();
            if row > 0 && is_changed(row) {
                fields[index] = value;
            }
            fields.join(",")
        };
        std::fs::write(&path, text.lines().enumerate().map(change).collect::<Vec<_>>().join("\n") + "\n").unwrap();
        let message = refusal(&scans, &scenario);
        std::fs::write(&path, text).unwrap();
        message
    };
    let line = ROW + 1;
    for (name, column, value, expected) in [
        ("poses", "s_m", "-500", "the ego moves "),
        ("poses", "d_m", "-500", "the ego moves "),
        ("poses", "x_m", "-500", "the ego moves "),
        ("poses", "yaw_rad", "1.5", "the ego turns by 1.5 rad in 0.040 s, but 0.6 rad is allowed"),
        ("poses", "heading_rad", "3", "3 is out of range: an angle from -π/2 to π/2 rad is needed"),
        ("poses", "speed_mps", "500", "500 is out of range: a speed from 0 to 150 m/s is needed"),
        ("labels", "y_m", "-500", " moves "),
    ] {
        let text = changed(name, column, value, &|row| row == ROW);
        assert!(text.contains(&format!("scans.{name}.csv, line {line}, column `{column}`: ")), "{text}");
        assert!(text.contains(expected), "{text}");
    }
    let text = changed("poses", "d_m", "-500", &|_| true);
    assert!(
        text.contains("`d_m` is -500 at ") && text.contains("beside the road of the scenario: -21.25 to 10 m"),
        "{text}"
    );

    // The values of a table are named with their row.
    let batches = read(&scans);
    let beams = |kind: &DataType, wrong: f64| {
        let path = folder.path().join("beams.parquet");
        let batches: Vec<RecordBatch> = batches
            .iter()
            .map(|batch| {
                let beam = arrow::compute::cast(batch.column_by_name("beam").unwrap(), &DataType::Float64).unwrap();
                let mut values: Vec<f64> = beam.as_primitive::<Float64Type>().values().to_vec();
                values[3] = wrong;
                let beam = arrow::compute::cast(&arrow::array::Float64Array::from(values), kind).unwrap();
                let columns =
                    ["time_s", "x_m", "y_m", "z_m"].map(|name| (name, batch.column_by_name(name).unwrap().clone()));
                RecordBatch::try_from_iter(columns.into_iter().chain([("beam", beam)])).unwrap()
            })
            .collect();
        let mut writer =
            parquet::arrow::ArrowWriter::try_new(File::create(&path).unwrap(), batches[0].schema(), None).unwrap();
        batches.iter().for_each(|batch| writer.write(batch).unwrap());
        writer.close().unwrap();
        std::fs::copy(folder.path().join("scans.poses.csv"), folder.path().join("beams.poses.csv")).unwrap();
        refusal(&path, &scenario)
    };
    for (kind, wrong, expected) in [
        (DataType::Int32, -1.0, "row 3 has `beam` = -1, but a whole number from 0 to 65,535, column"),
        (DataType::Int64, 70_000.0, "row 3 has `beam` = 70000, but"),
        (DataType::Float64, 2.5, "row 3 has `beam` = 2.5, but"),
    ] {
        let text = beams(&kind, wrong);
        assert!(text.contains(expected), "{text}");
    }
}

/// A value of a message in CDR, appended at a multiple of its size.
fn put(bytes: &mut Vec<u8>, value: &[u8]) {
    while !bytes.len().is_multiple_of(value.len()) {
        bytes.push(0);
    }
    bytes.extend_from_slice(value);
}

fn put_text(bytes: &mut Vec<u8>, text: &str) {
    put(bytes, &u32::try_from(text.len() + 1).unwrap().to_le_bytes());
    bytes.extend_from_slice(text.as_bytes());
    bytes.push(0);
}

fn put_header(bytes: &mut Vec<u8>, time_s: f64) {
    const NS_PER_S: i64 = 1_000_000_000;
    let ns = Time::from_s(time_s).ns();
    put(bytes, &i32::try_from(ns.div_euclid(NS_PER_S)).unwrap().to_le_bytes());
    put(bytes, &u32::try_from(ns.rem_euclid(NS_PER_S)).unwrap().to_le_bytes());
    put_text(bytes, "base_link");
}

fn message_of(body: &[u8]) -> Vec<u8> {
    [&[0, 1, 0, 0], body].concat()
}

/// Returns a scan as `sensor_msgs/msg/PointCloud2` with the fields `x`, `y`, `z`, `intensity`, `beam` and `time`.
fn point_cloud(time_s: f64, points: &[([f32; 4], u16, f64)]) -> Vec<u8> {
    const STEP: u32 = 28;
    let mut body = Vec::new();
    put_header(&mut body, time_s);
    let count = u32::try_from(points.len()).unwrap();
    put(&mut body, &1_u32.to_le_bytes());
    put(&mut body, &count.to_le_bytes());
    let fields = [("x", 0, 7), ("y", 4, 7), ("z", 8, 7), ("intensity", 12, 7), ("beam", 16, 4), ("time", 20, 8)];
    put(&mut body, &u32::try_from(fields.len()).unwrap().to_le_bytes());
    for (name, offset, datatype) in fields {
        put_text(&mut body, name);
        put(&mut body, &u32::to_le_bytes(offset));
        put(&mut body, &[datatype]);
        put(&mut body, &1_u32.to_le_bytes());
    }
    put(&mut body, &[0]);
    put(&mut body, &STEP.to_le_bytes());
    put(&mut body, &(STEP * count).to_le_bytes());
    put(&mut body, &(STEP * count).to_le_bytes());
    for (at, beam, time_s) in points {
        at.iter().for_each(|value| body.extend_from_slice(&value.to_le_bytes()));
        body.extend_from_slice(&beam.to_le_bytes());
        body.extend_from_slice(&[0; 2]);
        body.extend_from_slice(&time_s.to_le_bytes());
    }
    body.push(1);
    message_of(&body)
}

/// Returns a pose as `nav_msgs/msg/Odometry`.
fn odometry([time_s, x_m, y_m, yaw_rad, speed_mps, yaw_rate_radps]: [f64; 6]) -> Vec<u8> {
    let mut body = Vec::new();
    put_header(&mut body, time_s);
    put_text(&mut body, "base_link");
    let (sin, cos) = maths::sin_cos(0.5 * yaw_rad);
    let pose = [x_m, y_m, 0.0, 0.0, 0.0, sin, cos];
    let twist = [speed_mps, 0.0, 0.0, 0.0, 0.0, yaw_rate_radps];
    for value in pose.into_iter().chain([0.0; 36]).chain(twist).chain([0.0; 36]) {
        put(&mut body, &value.to_le_bytes());
    }
    message_of(&body)
}

/// The scans of a table: time of the end, and the points.
type Scans = Vec<(f64, Vec<([f32; 4], u16, f64)>)>;

fn scans_of(path: &Path) -> Scans {
    const SWEEP_S: f64 = 0.04 * 133.0 / 360.0;
    let mut scans: Scans = Vec::new();
    for batch in read(path) {
        let single = |name: &str| batch.column_by_name(name).unwrap().as_primitive::<Float32Type>().clone();
        let [x, y, z, intensity] = ["x_m", "y_m", "z_m", "intensity"].map(single);
        let time_s = batch.column_by_name("time_s").unwrap().as_primitive::<Float64Type>();
        let beam = batch.column_by_name("beam").unwrap().as_primitive::<UInt16Type>();
        let offset_ns = batch.column_by_name("offset_ns").unwrap().as_primitive::<UInt32Type>();
        for row in 0..batch.num_rows() {
            let end_s = time_s.value(row);
            if scans.last().is_none_or(|(last_s, _)| *last_s != end_s) {
                scans.push((end_s, Vec::new()));
            }
            let at = [x.value(row), y.value(row), z.value(row), intensity.value(row)];
            let measured_s = end_s - SWEEP_S + f64::from(offset_ns.value(row)) * 1e-9;
            scans.last_mut().unwrap().1.push((at, beam.value(row), measured_s));
        }
    }
    scans
}

/// Writes an MCAP file with these messages: topic, type and contents.
fn write_mcap(path: &Path, compression: Option<Compression>, messages: &[(&str, &str, f64, Vec<u8>)]) {
    let file = std::io::BufWriter::new(File::create(path).unwrap());
    let mut writer = WriteOptions::new().compression(compression).create(file).unwrap();
    let mut channels = BTreeMap::new();
    for (topic, kind, time_s, data) in messages {
        let channel = *channels.entry(topic.to_owned()).or_insert_with(|| {
            let schema = writer.add_schema(kind, "ros2msg", b"").unwrap();
            writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).unwrap()
        });
        // The scans before the start of the run have negative times.
        let log_time = u64::try_from(Time::from_s(time_s + 2.0).ns()).unwrap();
        let header = MessageHeader { channel_id: channel, sequence: 0, log_time, publish_time: log_time };
        writer.write_to_known_channel(&header, data).unwrap();
    }
    writer.finish().unwrap();
}

const POINTS: &str = "sensor_msgs/msg/PointCloud2";
const ODOMETRY: &str = "nav_msgs/msg/Odometry";

#[test]
fn the_messages_of_ros_2_give_the_tracks_of_the_table() {
    let folder = folder();
    let [scenario, scans, _] = record(folder.path(), "", "scans.parquet");
    let (expected, _) = perceive(&scans, &scenario, &SAMPLE);
    let poses = std::fs::read_to_string(folder.path().join("scans.poses.csv")).unwrap();
    let pose = |line: &str| -> Vec<f64> { line.split(',').map(|value| value.parse().unwrap()).collect() };
    let mut messages: Vec<(&str, &str, f64, Vec<u8>)> = Vec::new();
    for line in poses.lines().skip(1) {
        let values = pose(line);
        messages.push(("/odom", ODOMETRY, values[0], odometry(values[..6].try_into().unwrap())));
    }
    for (end_s, points) in scans_of(&scans) {
        messages.push(("/rear/points", POINTS, end_s, point_cloud(end_s, &points)));
    }
    std::fs::copy(folder.path().join("scans.labels.csv"), folder.path().join("drive.labels.csv")).unwrap();
    let bag = folder.path().join("drive.mcap");
    for compression in [None, Some(Compression::Zstd), Some(Compression::Lz4)] {
        write_mcap(&bag, compression, &messages);
        let (result, _) = perceive(&bag, &scenario, &SAMPLE);
        // The place on the road follows from the path, and the sensor is taken to be level.
        assert_eq!(result["road"], "path");
        for key in ["scans", "points"] {
            assert_eq!(result["lidars"][0][key], expected["lidars"][0][key], "{key}");
        }
        assert_eq!(result["tracks"]["confirmed"], expected["tracks"]["confirmed"]);
        let of_all = |value: &Value, key: &str| value["truth"]["groups"][0][key].as_f64().unwrap();
        for key in ["recall", "range_m", "along_rmse_m", "across_rmse_m", "speed_rmse_mps"] {
            let difference = of_all(&result, key) - of_all(&expected, key);
            assert!(difference.abs() < 0.05, "{key}: {result} {expected}");
        }
    }

    // Wrong messages are named by their topic and number.
    let refused_with = |messages: &[(&str, &str, f64, Vec<u8>)], expected: i32| {
        write_mcap(&bag, None, messages);
        refusal_with(&bag, &scenario, expected)
    };
    let refused = |messages: &[(&str, &str, f64, Vec<u8>)]| refused_with(messages, 3);
    let changed = |index: usize, change: &dyn Fn(&mut Vec<u8>)| {
        let mut changed = messages.clone();
        change(&mut changed[index].3);
        refused(&changed)
    };
    let last = messages.len() - 1;
    let text = changed(last, &|data| data[1] = 0);
    assert!(text.contains("drive.mcap, topic /rear/points, message ") && text.contains("big-endian"), "{text}");
    let text = changed(last, &|data| data.truncate(90));
    assert!(text.contains("no sensor_msgs/msg/PointCloud2 in CDR: it ends before"), "{text}");
    let text = changed(3, &|data| data.truncate(90));
    assert!(text.contains("topic /odom, message 3") && text.contains("nav_msgs/msg/Odometry"), "{text}");
    // The orientation lies before the covariance, the twist and its covariance.
    let text = changed(3, &|data| {
        let at = data.len() - 36 * 8 - 6 * 8 - 36 * 8 - 4 * 8;
        data[at..at + 32].fill(0);
    });
    assert!(text.contains("topic /odom, message 3") && text.contains("has the norm 0, but a rotation has 1"), "{text}");
    let ros_1 = messages.iter().cloned().map(|message| (message.0, "sensor_msgs/PointCloud2", message.2, message.3));
    let text = refused(&ros_1.collect::<Vec<_>>());
    assert!(
        text.contains("no message is a sensor_msgs/msg/PointCloud2: /odom holds sensor_msgs/PointCloud2"),
        "{text}"
    );
    let without_poses: Vec<_> = messages.iter().filter(|message| message.1 == POINTS).cloned().collect();
    let text = refused_with(&without_poses, 6);
    assert!(
        text.contains("drive.poses.csv") && text.contains("`time_s`, `x_m`, `y_m`, `yaw_rad`, `speed_mps`"),
        "{text}"
    );
    let several: Vec<_> =
        messages.iter().cloned().chain([("/front/points", POINTS, 9.0, messages[last].3.clone())]).collect();
    let text = refused(&several);
    assert!(text.contains("/front/points") && text.contains("must be the name of its LiDAR"), "{text}");
    write_mcap(&bag, Some(Compression::Zstd), &messages);
    let mut bytes = std::fs::read(&bag).unwrap();
    let at = bytes.windows(4).position(|window| window == b"zstd").unwrap();
    bytes[at..at + 4].copy_from_slice(b"zpaq");
    std::fs::write(&bag, bytes).unwrap();
    let text = refusal(&bag, &scenario);
    assert!(text.contains("compression `zpaq`, but `lz4`, `zstd` and none are read"), "{text}");
}

/// Returns the message with which a recording is refused.
fn refusal(scans: &Path, scenario: &Path) -> String {
    refusal_with(scans, scenario, 3)
}

/// Returns the message of a recording that is refused with this exit code.
fn refusal_with(scans: &Path, scenario: &Path, expected: i32) -> String {
    let output = closecall(["study", "perceive", scans.to_str().unwrap(), scenario.to_str().unwrap()]);
    assert_eq!(code(&output), expected, "{}", message(&output));
    message(&output)
}

/// Returns the code of the page on LiDARs that writes a recording.
fn documented_recording() -> String {
    let text = std::fs::read_to_string(Path::new(ROOT).join("docs/how-to/lidar.md")).unwrap();
    let (_, after) = text.split_once("<!-- recording -->\n```python\n").unwrap();
    after.split_once("```").unwrap().0.to_owned()
}

/// Returns the files of the page on LiDARs, by their names.
fn documented_file(name: &str) -> String {
    let text = std::fs::read_to_string(Path::new(ROOT).join("docs/how-to/lidar.md")).unwrap();
    let (_, after) = text.split_once(&format!("```toml {name}\n")).unwrap();
    after.split_once("```").unwrap().0.to_owned()
}

/// Writes the recording of the page on LiDARs into a folder, beside its scenario. Returns both; `None` without NumPy.
fn write_documented(folder: &Path) -> Option<[PathBuf; 2]> {
    let python = python_with("numpy")?;
    for name in ["my-lidar.toml", "my-sensors.toml"] {
        std::fs::write(folder.join(name), documented_file(name)).unwrap();
    }
    let output = Command::new(python).args(["-c", &documented_recording()]).current_dir(folder).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(["my-recording", "my-sensors.toml"].map(|name| folder.join(name)))
}

#[test]
fn a_recording_in_the_documented_layout_runs_with_the_documentation_alone() {
    let folder = folder();
    let Some([recording, scenario]) = write_documented(folder.path()) else { return };
    let (result, _) = perceive(&recording, &scenario, &["--frame", "sensor", "--drop-invalid"]);
    assert_eq!((&result["lidars"][0]["scans"], &result["road"]), (&Value::from(60), &Value::from("path")));
    let (tracks, all) = (&result["tracks"], &result["truth"]["groups"][0]);
    assert_eq!(
        (&tracks["confirmed"], &result["truth"]["false_tracks"]),
        (&Value::from(1), &Value::from(0)),
        "{result}"
    );
    assert!(all["range_m"].as_f64().unwrap() > 50.0 && all["recall"].as_f64().unwrap() > 0.9, "{all}");
    for (key, most) in [("along_rmse_m", 0.3), ("across_rmse_m", 0.1), ("speed_rmse_mps", 1.0)] {
        assert!(all[key].as_f64().unwrap() < most, "{key}: {all}");
    }
    // The points are not in the ego's frame.
    let paths = [&recording, &scenario].map(|path| path.to_str().unwrap());
    let ego = closecall(["study", "perceive", paths[0], paths[1], "--drop-invalid"]);
    let text = message(&ego);
    assert_eq!(code(&ego), 3, "{text}");
    assert!(
        text.contains("points lie behind the LiDAR `rear-lidar`") && text.contains("--frame names the frame"),
        "{text}"
    );
    // Without labels, nothing is said of them.
    std::fs::remove_file(recording.join("labels.csv")).unwrap();
    let args = ["study", "perceive", recording.to_str().unwrap(), scenario.to_str().unwrap(), "--frame", "sensor"];
    let text = stdout(&closecall([&args[..], &["--drop-invalid"]].concat()), 0);
    assert!(text.contains("tracks: 1, 1 of them confirmed") && text.contains("id switches cannot be stated"), "{text}");
    assert!(text.contains("camera: none"), "{text}");
}

#[test]
fn what_is_wrong_with_a_recording_is_named_with_its_place_and_what_is_allowed() {
    let folder = folder();
    let Some([recording, scenario]) = write_documented(folder.path()) else { return };
    let good = |name: &str| std::fs::read(recording.join(name)).unwrap();
    let replaced = |name: &str, from: &str, to: &str| {
        let text = String::from_utf8_lossy(&good(name)).replacen(from, to, 1);
        assert!(text != String::from_utf8_lossy(&good(name)), "{name} has no `{from}`");
        text.into_bytes()
    };
    let lines = |name: &str| String::from_utf8(good(name)).unwrap().lines().map(str::to_owned).collect::<Vec<_>>();
    let swapped = |name: &str| {
        let mut lines = lines(name);
        let last = lines.len() - 1;
        lines.swap(last, last - 1);
        (lines.join("\n") + "\n").into_bytes()
    };
    // The table with this value in every row of a column.
    let column = |name: &str, column: usize, value: &str| {
        let changed = lines(name).into_iter().enumerate().map(|(row, line)| {
            let mut fields: Vec<&str> = line.split(',').collect();
            if row > 0 {
                fields[column] = value;
            }
            fields.join(",")
        });
        (changed.collect::<Vec<_>>().join("\n") + "\n").into_bytes()
    };
    let cases: Vec<(&str, Vec<u8>, &str)> = vec![
        ("scan-00.pcd", replaced("scan-00.pcd", "FIELDS x ", "FIELDS u "), "no field `x`, only u, y, z"),
        (
            "scan-00.pcd",
            replaced("scan-00.pcd", "FIELDS x y z ", "FIELDS x y y "),
            "scan-00.pcd: the field `y` is there twice; one is needed",
        ),
        (
            "poses.csv",
            replaced("poses.csv", "x_m,y_m", "x_m,x_m"),
            "poses.csv, line 1: the column `x_m` is there twice; one is needed",
        ),
        ("scan-00.pcd", replaced("scan-00.pcd", "DATA binary", "DATA zip"), "`zip` is unknown; `ascii`, `binary` and"),
        ("scan-00.pcd", good("scan-00.pcd")[..900].to_vec(), "have "),
        (
            "poses.csv",
            replaced("poses.csv", "speed_mps", "speed"),
            "poses.csv, line 1: there is no column `speed_mps`; the columns",
        ),
        ("poses.csv", swapped("poses.csv"), "column `time_s`: the time"),
        ("poses.csv", (lines("poses.csv")[..20].join("\n") + "\n").into_bytes(), "there is no pose at"),
        ("poses.csv", b"time_s,x_m,y_m,yaw_rad,speed_mps\n".to_vec(), "poses.csv: there are no rows"),
        (
            "poses.csv",
            replaced("poses.csv", "\n0.0,", "\nnoon,"),
            "poses.csv, line 2, column `time_s`: `noon` is not a finite number",
        ),
        (
            "labels.csv",
            replaced("labels.csv", ",car,", ",bus,"),
            "labels.csv, line 2, column `class`: `bus` is unknown; `car`, `truck`",
        ),
        ("scans.csv", replaced("scans.csv", "time_s", "stamp"), "scans.csv, line 1: there is no column `time_s`"),
        (
            "scans.csv",
            (lines("scans.csv")
                .iter()
                .map(|line| if line.starts_with("file") { format!("{line},sensor") } else { format!("{line},roof") })
                .collect::<Vec<_>>()
                .join("\n")
                + "\n")
                .into_bytes(),
            "scans.csv, line 2, column `sensor`: `roof` is unknown; the LiDARs of the scenario, `rear-lidar`, are allowed",
        ),
        (
            "scans.csv",
            replaced("scans.csv", "scan-01.pcd,0.1", "scan-01.pcd,0.0"),
            "is not after 0 s, the previous one of `rear-lidar`",
        ),
        (
            "scans.csv",
            replaced("scans.csv", "scan-01.pcd", "scan-00.pcd"),
            "scans.csv, line 3, column `file`: `scan-00.pcd` is listed twice",
        ),
        ("scans.csv", replaced("scans.csv", "scan-00.pcd,0.0", "scan-00.pcd,1e18"), "a time in seconds is needed"),
        (
            "scans.csv",
            replaced("scans.csv", "scan-01.pcd,0.1\n", ""),
            "scans.csv: it does not list 1 of the *.pcd files in its folder, such as `scan-01.pcd`: each needs a row",
        ),
        ("poses.csv", column("poses.csv", 4, "108.0"), "m/s and m are needed"),
        (
            "poses.csv",
            (lines("poses.csv").join("\r\n") + "\r\n").replacen("\n0.1,", "\nnoon,", 1).into_bytes(),
            "poses.csv, line 3, column `time_s`: `noon` is not a finite number",
        ),
        ("poses.csv", column("poses.csv", 3, "1.6"), "counter-clockwise from x to y"),
        ("labels.csv", column("labels.csv", 0, "99.0"), "times must increase"),
        (
            "labels.csv",
            column("labels.csv", 6, "129.6"),
            "labels.csv: `a` drives 648 m by its speeds, and 180 m by its places: m in the ego's frame (x ahead, y to the left) and m/s",
        ),
        (
            "labels.csv",
            column("labels.csv", 5, "1.6"),
            "half of the headings differ by 1.6 rad or more from the direction in which `a` drives: they are in rad relative",
        ),
        ("labels.csv", column("labels.csv", 5, "180.0"), "an angle from -2π to 2π rad is needed"),
        ("labels.csv", column("labels.csv", 7, "4600"), "a length from 0.1 to 40 m is needed"),
        (
            "labels.csv",
            [lines("labels.csv")[0].as_bytes(), b"\n99.0,a,car,-50.0,0.0,0.0,36.0,4.6,1.8\n"].concat(),
            "the labels go from 99 to 99 s, the scans from 0 to 5.9 s",
        ),
    ];
    let args = ["study", "perceive", recording.to_str().unwrap(), scenario.to_str().unwrap(), "--frame", "sensor"];
    // The beams without a return have no position.
    let output = closecall(args);
    let text = message(&output);
    assert!(
        code(&output) == 3 && text.contains("scan-00.pcd: point 0 has x = NaN, but a finite number is needed"),
        "{text}"
    );
    assert!(text.contains("--drop-invalid leaves out points without a position"), "{text}");
    for (name, bytes, expected) in cases {
        let before = good(name);
        std::fs::write(recording.join(name), bytes).unwrap();
        let output = closecall([&args[..], &["--drop-invalid"]].concat());
        let text = message(&output);
        assert_eq!(code(&output), 3, "{expected}: {text}");
        assert!(text.contains(expected), "{expected}: {text}");
        std::fs::write(recording.join(name), before).unwrap();
    }
    // Labels with other axes match no track.
    for (axis, value, expected) in [
        (
            4,
            "7.5",
            "my-recording: 1 labelled vehicle behind the ego, and no confirmed track is ever near one: labels have x ahead",
        ),
        (
            3,
            "50.0",
            "my-recording: no labelled vehicle is up to 150 m behind the ego, where vehicles count: labels have x ahead",
        ),
    ] {
        let before = good("labels.csv");
        std::fs::write(recording.join("labels.csv"), column("labels.csv", axis, value)).unwrap();
        let output = closecall([&args[..], &["--drop-invalid"]].concat());
        let text = message(&output);
        assert!(code(&output) == 0 && text.contains(expected), "{expected}: {text}");
        std::fs::write(recording.join("labels.csv"), before).unwrap();
    }
    // The axis and the left of the sensor are swapped.
    let clouds: Vec<PathBuf> = std::fs::read_dir(&recording).unwrap().map(|file| file.unwrap().path()).collect();
    let clouds: Vec<PathBuf> =
        clouds.into_iter().filter(|path| path.extension().is_some_and(|end| end == "pcd")).collect();
    let swap = || {
        for path in &clouds {
            let text = String::from_utf8_lossy(&std::fs::read(path).unwrap()[..40]).into_owned();
            let [from, to] = if text.contains("x y z") { ["x y z", "y x z"] } else { ["y x z", "x y z"] };
            let mut bytes = std::fs::read(path).unwrap();
            let place = bytes.windows(5).position(|window| window == from.as_bytes()).unwrap();
            bytes[place..place + 5].copy_from_slice(to.as_bytes());
            std::fs::write(path, bytes).unwrap();
        }
    };
    swap();
    let output = closecall([&args[..], &["--drop-invalid"]].concat());
    let text = message(&output);
    assert!(code(&output) == 3 && text.contains("no point is in the field of view of the LiDARs rear-lidar"), "{text}");
    swap();
    for (scale, expected) in [
        (
            "255",
            "have an intensity above 4, at which a registration plate saturates the receiver: 1 is a white surface",
        ),
        ("1e-46", "number above 0"),
    ] {
        let output = closecall([&args[..], &["--drop-invalid", "--intensity-scale", scale]].concat());
        let text = message(&output);
        assert!(code(&output) != 0 && text.contains(expected), "{scale}: {text}");
    }
    let cloud = good("scan-00.pcd");
    for (intensity, expected) in [(-0.4_f32, "has intensity = -0.4, but a number of 0 or more is needed"), (0.0, "")] {
        let mut changed = cloud.clone();
        let header = changed.windows(12).position(|window| window == b"DATA binary\n").unwrap() + 12;
        changed[header..].chunks_exact_mut(16).for_each(|point| point[12..].copy_from_slice(&intensity.to_le_bytes()));
        std::fs::write(recording.join("scan-00.pcd"), changed).unwrap();
        let output = closecall([&args[..], &["--drop-invalid"]].concat());
        assert_eq!(code(&output), if expected.is_empty() { 0 } else { 3 }, "{}", message(&output));
        assert!(message(&output).contains(expected), "{}", message(&output));
    }
    std::fs::write(recording.join("scan-00.pcd"), cloud).unwrap();
    std::fs::remove_file(recording.join("poses.csv")).unwrap();
    let text = refusal_with(&recording, &scenario, 6);
    assert!(text.contains("poses.csv: there is no such file, which gives the poses of the ego"), "{text}");
    let empty = folder.path().join("empty");
    std::fs::create_dir(&empty).unwrap();
    assert!(refusal(&empty, &scenario).contains("empty: the folder has no *.pcd file"));
    std::fs::write(empty.join("one.pcd"), "").unwrap();
    assert!(
        refusal_with(&empty, &scenario, 6)
            .contains("scans.csv: there is no such file, which gives the time at which each scan ends")
    );
    let other = folder.path().join("scans.las");
    std::fs::write(&other, "").unwrap();
    assert!(
        refusal(&other, &scenario)
            .contains("a recording is a folder of *.pcd files, a file *.parquet, or a file *.mcap")
    );
    for name in ["cut.parquet", "cut.mcap"] {
        let cut = folder.path().join(name);
        std::fs::write(&cut, "PAR1").unwrap();
        assert!(refusal(&cut, &scenario).contains(name));
    }
}
