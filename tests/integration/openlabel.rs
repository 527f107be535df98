//! OpenLABEL files: written with lane changes and their metrics, read back, and refused.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::{Value, json};

use crate::support::{ROOT, closecall, code, folder, json as json_of, json_file, message, stdout};

/// Runs a command on trajectory data.
fn traffic(command: &str, file: &Path, options: &[&str]) -> Output {
    let mut words = vec!["traffic".into(), command.into(), file.as_os_str().to_owned()];
    words.extend(options.iter().map(Into::into));
    closecall(words)
}

/// Records a scenario of the library as trajectory data.
fn recorded(scenario: &str, folder: &Path) -> PathBuf {
    let path = folder.join("drive.csv");
    let words = ["traffic", "record", scenario, "-n", "1", "--sensors", "ground-truth", "-o", path.to_str().unwrap()];
    stdout(&closecall(words), 0);
    path
}

/// Writes the labels of a command, and returns its results and the path of the labels.
fn labelled(command: &str, file: &Path, options: &[&str], folder: &Path) -> (Value, PathBuf) {
    let path = folder.join(format!("{command}.json"));
    let own = ["--openlabel", path.to_str().unwrap(), "--format", "json"];
    let output = traffic(command, file, &[options, &own].concat());
    (json_of(&output, 0), path)
}

/// Asserts that labels have the results of the file from which they were made.
fn assert_round_trip(file: &Path, options: &[&str], folder: &Path) -> usize {
    let mut count = 0;
    for command in ["lane-changes", "criticality"] {
        let (results, path) = labelled(command, file, options, folder);
        let again = json_of(&traffic(command, &path, &[options, &["--format", "json"]].concat()), 0);
        assert_eq!(results, again, "{command} of {}", file.display());
        count = results.as_array().unwrap().len();
    }
    count
}

/// Runs the checks of another program on files.
fn check(python: &Path, files: &[PathBuf]) -> Vec<Value> {
    let script = PathBuf::from(ROOT).join("tests/integration/exchange/openlabel.py");
    let output = Command::new(python).arg(script).args(files).output().unwrap();
    serde_json::from_str(&stdout(&output, 0)).unwrap()
}

#[test]
fn labels_of_a_run_have_the_same_lane_changes_and_metrics_when_they_are_read() {
    let folder = folder();
    let file = recorded("paper-figure", folder.path());
    assert!(assert_round_trip(&file, &[], folder.path()) >= 1);
}

#[test]
fn labels_of_recorded_traffic_have_the_same_lane_changes_and_metrics_when_they_are_read() {
    let Some(data) = closecall_testing::data() else { return };
    let folder = folder();
    let us101 = data.join("ngsim_us101/us101_a_ngsim18col_feet.csv");
    assert!(assert_round_trip(&us101, &[], folder.path()) >= 10);
    assert!(assert_round_trip(&us101, &["--lanes", "none"], folder.path()) >= 5);
    assert_round_trip(&data.join("highd_format_sample/01_tracks.csv"), &[], folder.path());
    let commonroad = fs::read_dir(data.join("ngsim_us101/commonroad_xml")).unwrap().map(|entry| entry.unwrap().path());
    let commonroad = commonroad.filter(|path| path.extension().is_some_and(|end| end == "xml")).min().unwrap();
    assert_round_trip(&commonroad, &[], folder.path());
}

#[test]
fn the_labels_say_what_changes_lanes_when_and_how_critical_it_is() {
    let folder = folder();
    let file = recorded("paper-figure", folder.path());
    let (results, path) = labelled("criticality", &file, &[], folder.path());
    let text = json_file(&path);
    let labels = &text["openlabel"];
    assert_eq!(labels["metadata"]["schema_version"], "1.0.0");
    let (change, action) = (&results[0], &labels["actions"]["0"]);
    let side = if change["direction"] == "left" { "MotionLaneChangeLeft" } else { "MotionLaneChangeRight" };
    assert_eq!(action["type"], side);
    let uid = change["track_id"].to_string();
    assert_eq!(labels["relations"]["0"]["rdf_subjects"], json!([{ "uid": uid, "type": "object" }]));
    let numbers = action["action_data"]["num"].as_array().unwrap();
    let number = |name: &str| numbers.iter().find(|number| number["name"] == name);
    assert_eq!(number("crossing_s").unwrap()["val"].as_f64(), change["crossing_s"].as_f64());
    let mut values = 0;
    for (name, metric) in change["metrics"].as_object().unwrap() {
        let written = number(name).map(|number| &number["val"]);
        assert_eq!(written, metric.get("value"), "{name}");
        values += usize::from(written.is_some());
    }
    assert!(values >= 4, "{change}");
    // The crossing lies in the frame interval of the action, and the vehicle is beyond it there.
    let interval = &action["frame_intervals"][0];
    let span = interval["frame_start"].as_i64().unwrap()..=interval["frame_end"].as_i64().unwrap();
    let period_s = labels["metadata"]["frame_period_s"].as_f64().unwrap();
    let crossing = (change["crossing_s"].as_f64().unwrap() / period_s).round() as i64;
    assert!(span.contains(&crossing), "{interval} {crossing}");
    let in_frame = |frame: i64| {
        let data = &labels["frames"][frame.to_string()]["objects"][&uid]["object_data"];
        (data["num"][2]["val"].as_f64().unwrap(), data["cuboid"][0]["val"][1].as_f64().unwrap())
    };
    let ((before, from_m), (after, to_m)) = (in_frame(*span.start()), in_frame(*span.end()));
    assert_eq!((Some(before), Some(after)), (change["from_lane"].as_f64(), change["to_lane"].as_f64()));
    assert_eq!(to_m > from_m, change["direction"] == "left", "y grows to the left");
}

#[test]
fn the_labels_are_valid_by_the_published_schema_and_their_pointers_agree() {
    let Some(python) = closecall_testing::python_with_exchange() else { return };
    let folder = folder();
    let file = recorded("paper-figure", folder.path());
    let (changes, first) = labelled("lane-changes", &file, &[], folder.path());
    let (_, second) = labelled("criticality", &file, &[], folder.path());
    let rows = fs::read_to_string(&file).unwrap().lines().count() - 1;
    for summary in check(&python, &[first.clone(), second]) {
        assert_eq!((&summary["errors"], &summary["wrong"]), (&json!([]), &json!([])), "{summary}");
        assert_eq!(summary["rows"], rows);
        assert_eq!(summary["actions"].as_array().unwrap().len(), changes.as_array().unwrap().len());
        assert_eq!(summary["relations"], summary["actions"].as_array().unwrap().len());
        let lanes = json!({ "num": [{ "type": "min", "val": 2.0 }] });
        assert_eq!(summary["tags"]["LaneSpecificationLaneCount"], lanes, "the third lane is not used");
        assert!(summary["tags"].get("LaneSpecificationDimensions").is_none(), "no marking is stated");
        assert!(summary["tags"].get("RoadTypeMotorway").is_none(), "plain data may be of any road");
    }
    // The check finds what is wrong.
    let text = fs::read_to_string(&first).unwrap();
    for (right, wrong) in
        [("\"schema_version\":\"1.0.0\"", "\"schema_version\":\"2.0.0\""), ("\"type\":\"Vehicle", "\"typ\":\"Vehicle")]
    {
        fs::write(&first, text.replace(right, wrong)).unwrap();
        assert_ne!(check(&python, std::slice::from_ref(&first))[0]["errors"], json!([]), "{wrong}");
    }
    fs::write(&first, text.replacen("\"frame_start\":0", "\"frame_start\":1", 1)).unwrap();
    assert_ne!(check(&python, &[first])[0]["wrong"], json!([]));
}

#[test]
fn the_layout_makes_a_motorway_certain() {
    let Some(data) = closecall_testing::data() else { return };
    let folder = folder();
    let (_, path) = labelled("lane-changes", &data.join("highd_format_sample/01_tracks.csv"), &[], folder.path());
    let text = json_file(&path);
    let tags: Vec<&Value> = text["openlabel"]["tags"].as_object().unwrap().values().collect();
    let tag = |kind: &str| *tags.iter().find(|tag| tag["type"] == kind).unwrap();
    assert!(tag("RoadTypeMotorway").get("tag_data").is_none());
    let widths = &tag("LaneSpecificationDimensions")["tag_data"]["vec"][0];
    assert_eq!(widths["type"], "range");
    assert!(widths["val"][0].as_f64() > Some(3.0) && widths["val"][1].as_f64() < Some(5.0), "{widths}");
    assert_eq!(tag("LaneSpecificationLaneCount")["tag_data"]["num"][0]["type"], "value");
}

#[test]
fn labels_do_not_overwrite_their_input_and_nothing_is_half_written() {
    let folder = folder();
    let file = recorded("paper-figure", folder.path());
    let before = fs::read(&file).unwrap();
    let output = traffic("lane-changes", &file, &["--openlabel", file.to_str().unwrap()]);
    assert_eq!((code(&output), fs::read(&file).unwrap() == before), (2, true), "{}", message(&output));
    let nowhere = folder.path().join("no-such-folder/labels.json");
    let output = traffic("criticality", &file, &["--openlabel", nowhere.to_str().unwrap()]);
    assert_eq!(code(&output), 6, "{}", message(&output));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

/// A file of another program: cars on a road along +x, y up. One of them changes lanes.
fn of_others(system: &str, kind: &str, properties: impl Fn(i32) -> Value) -> Value {
    const LANE_M: f64 = 3.6;
    let mut frames = serde_json::Map::new();
    for frame in 0..200 {
        let time_s = 0.1 * f64::from(frame);
        let mut objects = serde_json::Map::new();
        for car in 0..24 {
            let tau = if car == 5 { ((time_s - 6.0) / 6.0).clamp(0.0, 1.0) } else { 0.0 };
            let share = tau.powi(3) * (10.0 - 15.0 * tau + 6.0 * tau * tau);
            let (along_m, lane) = (25.0 * f64::from(car), f64::from(car % 3));
            let (x_m, y_m) = (along_m + 30.0 * time_s, -LANE_M * (lane + 0.5) + LANE_M * share);
            let cuboid = json!([{ "name": "box", "coordinate_system": system,
                "val": [x_m, y_m, 0.7, 0.0, 0.0, 0.0, 4.5, 1.8, 1.4] }]);
            objects.insert(car.to_string(), json!({ "object_data": { "cuboid": cuboid } }));
        }
        let frame_text = json!({ "frame_properties": properties(frame), "objects": objects });
        frames.insert(frame.to_string(), frame_text);
    }
    let objects: serde_json::Map<_, _> =
        (0..24).map(|car| (car.to_string(), json!({ "name": format!("car {car}"), "type": "Car" }))).collect();
    json!({ "openlabel": {
        "metadata": { "schema_version": "1.0.0" },
        "coordinate_systems": { "world": { "type": kind, "parent": "", "children": [] } },
        "objects": objects,
        "frames": frames,
    } })
}

fn written(folder: &Path, value: &Value) -> PathBuf {
    let path = folder.join("others.json");
    fs::write(&path, value.to_string()).unwrap();
    path
}

#[test]
fn cuboids_of_another_program_are_read_without_lanes() {
    let folder = folder();
    let timestamp = |frame: i32| json!({ "timestamp": 0.1 * f64::from(frame) });
    let path = written(folder.path(), &of_others("world", "scene_cs", timestamp));
    let output = traffic("lane-changes", &path, &["--lanes", "none", "--format", "json"]);
    let changes = json_of(&output, 0);
    let [change] = &changes.as_array().unwrap()[..] else { panic!("{changes}") };
    assert_eq!((&change["vehicle_id"], &change["direction"]), (&json!(5), &json!("left")));
    assert!((change["crossing_s"].as_f64().unwrap() - 9.0).abs() < 0.3, "{change}");
    assert!((change["speed_mps"].as_f64().unwrap() - 30.0).abs() < 0.1, "derived from the positions: {change}");
    // A frame rate in place of times.
    let mut rated = of_others("world", "scene_cs", |_| json!({}));
    rated["openlabel"]["metadata"]["frame_rate"] = json!(10.0);
    let path = written(folder.path(), &rated);
    assert_eq!(json_of(&traffic("lane-changes", &path, &["--lanes", "none", "--format", "json"]), 0), changes);
}

/// The file of [`of_others`] with these timestamps and a frame rate of 20 Hz, which contradicts 10 Hz.
fn stamped(text: impl Fn(i32) -> Value) -> Value {
    let mut value = of_others("world", "scene_cs", |frame| match text(frame) {
        Value::Null => json!({}),
        stamp => json!({ "timestamp": stamp }),
    });
    value["openlabel"]["metadata"]["frame_rate"] = json!(20.0);
    value
}

#[test]
fn instants_of_iso_8601_are_times_of_frames_whatever_the_frame_rate_says() {
    let folder = folder();
    let found = |value: &Value| {
        let path = written(folder.path(), value);
        let changes = json_of(&traffic("lane-changes", &path, &["--lanes", "none", "--format", "json"]), 0);
        let [change] = &changes.as_array().unwrap()[..] else { panic!("{changes}") };
        let quantity = |key: &str| change[key].as_f64().unwrap();
        (quantity("speed_mps"), quantity("duration_s"), quantity("crossing_s"))
    };
    let (speed_mps, duration_s, crossing_s) = found(&stamped(|frame| json!(0.1 * f64::from(frame))));
    let clock = |frame: i32| (30 + frame / 600, frame / 10 % 60, frame % 10);
    let utc = |frame| {
        let (minute, second, tenth) = clock(frame);
        json!(format!("2020-04-11T12:{minute}:{second:02}.{tenth}Z"))
    };
    let blank = |frame| {
        let (minute, second, tenth) = clock(frame);
        json!(format!("2020-04-11 12:{minute}:{second:02}.{tenth}00"))
    };
    let offset = |frame| {
        let (minute, second, tenth) = clock(frame);
        json!(format!("2020-04-11T14:{minute}:{second:02}.{tenth}+02:00"))
    };
    let number = |frame: i32| json!(format!(" {:.1} ", 0.1 * f64::from(frame)));
    for value in [stamped(utc), stamped(blank), stamped(offset), stamped(number)] {
        let instants = found(&value);
        assert!((instants.0 - speed_mps).abs() < 1e-3 && (speed_mps - 30.0).abs() < 0.1, "{instants:?}");
        assert!((instants.1 - duration_s).abs() < 1e-3 && (instants.2 - crossing_s).abs() < 1e-3, "{instants:?}");
    }
}

#[test]
fn a_timestamp_that_is_no_time_is_refused_in_spite_of_a_frame_rate() {
    let folder = folder();
    let seconds = |frame: i32| json!(0.1 * f64::from(frame));
    let at_seven = |wrong: Value| stamped(move |frame| if frame == 7 { wrong.clone() } else { seconds(frame) });
    let cases = [
        (at_seven(json!("x")), "`openlabel.frames.7.frame_properties.timestamp` is \"x\""),
        (at_seven(json!("")), "timestamp` is \"\""),
        (at_seven(json!("2020-13-11T12:00:00Z")), "an instant in UTC"),
        (at_seven(json!("1950-04-11T12:00:00Z")), "up to the year 2100"),
        (at_seven(json!(1e308)), "timestamp` is 1e308, but"),
        (at_seven(json!("NaN")), "timestamp` is \"NaN\""),
        (at_seven(Value::Null), "frames.7.frame_properties.timestamp` is missing, but other frames have one"),
    ];
    for (value, needed) in cases {
        let output = traffic("lane-changes", &written(folder.path(), &value), &["--lanes", "none"]);
        let said = message(&output);
        assert_eq!(code(&output), 3, "{said}");
        assert!(said.contains(needed), "`{said}` does not say `{needed}`");
    }
}

#[test]
fn what_a_file_of_another_program_lacks_is_named() {
    let folder = folder();
    let timestamp = |frame: i32| json!({ "timestamp": 0.1 * f64::from(frame) });
    let fine = || of_others("world", "scene_cs", timestamp);
    let mut without_systems = fine();
    without_systems["openlabel"].as_object_mut().unwrap().remove("coordinate_systems");
    let mut without_one = fine();
    without_one["openlabel"]["frames"]["3"]["objects"]["7"]["object_data"]["cuboid"][0]
        .as_object_mut()
        .unwrap()
        .remove("coordinate_system");
    let cases = [
        (fine(), false, "`openlabel.frames.0.objects.0.object_data` has no number `lane`".to_owned()),
        (of_others("world", "local_cs", timestamp), true, "type `local_cs`".to_owned()),
        (without_systems, true, "`openlabel.coordinate_systems` lacks".to_owned()),
        (without_one, true, "`openlabel.frames.3.objects.7.object_data.cuboid.0` names no".to_owned()),
        (of_others("world", "scene_cs", |_| json!({})), true, "frame_properties.timestamp` is missing".to_owned()),
        (
            of_others("closecall-road", "scene_cs", timestamp),
            false,
            "`openlabel.frames.0.objects.0.object_data.num` has no `speed_mps`".to_owned(),
        ),
    ];
    for (value, has_none, needed) in cases {
        let path = written(folder.path(), &value);
        let options: &[&str] = if has_none { &["--lanes", "none"] } else { &[] };
        let output = traffic("lane-changes", &path, options);
        let said = message(&output).replace(' ', "");
        assert_eq!(code(&output), 3, "{}", message(&output));
        assert!(
            said.contains(&needed.replace(' ', "")) && said.contains("others.json"),
            "{needed}: {}",
            message(&output)
        );
    }
}

#[test]
fn each_published_sample_is_refused_for_what_it_lacks() {
    let Some(data) = closecall_testing::data() else { return };
    let mut counts = [0, 0];
    for (index, name) in ["openlabel100_small", "alks_vcd430"].iter().enumerate() {
        for entry in fs::read_dir(data.join("openlabel_vcd").join(name)).unwrap() {
            let path = entry.unwrap().path();
            let output = traffic("lane-changes", &path, &["--lanes", "none"]);
            let said = message(&output);
            let stem = path.file_stem().unwrap().to_string_lossy().into_owned();
            assert_eq!(code(&output), 3, "{stem}: {said}");
            let needed = match (*name, stem.trim_start_matches("openlabel100_test_")) {
                ("alks_vcd430", _) => "VCD (version 4.3.0), the predecessor of OpenLABEL",
                (_, "cuboids") => "objects.0.object_data.cuboid` belongs to no frame",
                (_, name) if name.starts_with("bbox") => "object_data.bbox` is in pixels",
                (_, "create_streams_simple" | "transforms" | "relations_1" | "relations_2") => {
                    "no object of `openlabel.frames` has a `cuboid`"
                }
                (_, "metadata" | "openlabel_tags_complex" | "openlabel_tags_complex_2" | "poses") => {
                    "`openlabel.objects` and `openlabel.frames` are missing or empty"
                }
                (_, "actions_a" | "actions_b" | "create_openlabel") => "`openlabel.frames` is missing or empty",
                _ => "a `cuboid` of each vehicle in each frame",
            };
            assert!(said.contains(needed), "{stem}: `{said}` does not say `{needed}`");
            counts[index] += 1;
        }
    }
    assert!(counts[0] >= 40 && counts[1] >= 15, "{counts:?}");
}

#[test]
fn malformed_labels_are_refused_with_their_place() {
    let folder = folder();
    let file = recorded("paper-figure", folder.path());
    let (changes, path) = labelled("lane-changes", &file, &[], folder.path());
    let text = fs::read_to_string(&path).unwrap();
    let first = text.split_once("\"closecall-road\",\"val\":[").unwrap().1;
    let x = &first[..first.find(',').unwrap()];
    let with = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        text.replacen(from, to, 1)
    };
    let (head, in_frames) = text.split_at(text.find("\"frames\":{").unwrap());
    let in_frames = |from: &str, to: &str| {
        assert!(in_frames.contains(from), "{from}");
        format!("{head}{}", in_frames.replacen(from, to, 1))
    };
    let value = format!("\"val\":[{x},");
    let mut deep = "{\"openlabel\":".to_owned();
    deep.push_str(&"[".repeat(100_000));
    let mut many = "{\"openlabel\":{\"metadata\":{\"schema_version\":\"1.0.0\"},\"objects\":{".to_owned();
    for number in 0..3 {
        write!(many, "\"7\":{{\"name\":\"{number}\",\"type\":\"Car\"}},").unwrap();
    }
    let frames = "\"frames\":{";
    let cases: Vec<(&str, String, &str)> = vec![
        ("cut in the middle", text[..text.len() / 2].to_owned(), "line"),
        ("cut before the last brace", text.trim_end()[..text.trim_end().len() - 1].to_owned(), "EOF while parsing"),
        ("empty object", "{}".to_owned(), "without the fields of I-24 MOTION"),
        ("root without content", "{\"openlabel\":{}}".to_owned(), "`openlabel.metadata.schema_version` is missing"),
        ("a list", "{\"openlabel\":[]}".to_owned(), "`openlabel`: invalid type: sequence"),
        ("not a number", in_frames(&value, "\"val\":[NaN,"), "`: expected value at line"),
        ("too large a number", in_frames(&value, "\"val\":[1e400,"), "number out of range"),
        (
            "a position beyond the earth",
            in_frames(&value, "\"val\":[1e9,"),
            "x of the cuboid of `openlabel.frames.0.objects.",
        ),
        ("a text for a number", in_frames(&value, "\"val\":[\"12\","), "invalid type: string \"12\", expected f64"),
        ("null for a number", in_frames(&value, "\"val\":[null,"), "invalid type: null"),
        ("one value more", in_frames(&value, &format!("\"val\":[0,0,{x},")), "has 11 numbers, but 9"),
        ("a list for an object", deep, "`openlabel`: invalid type: sequence"),
        (
            "deep nesting of a member that is not read",
            with("\"annotator\":\"closecall\"", &format!("\"x\":{}", "[".repeat(100_000))),
            "nested deeper than 100",
        ),
        ("an object twice", many, "`openlabel.objects.7` stands there twice"),
        ("frames twice", with(frames, "\"frames\":{},\"frames\":{"), "`openlabel.frames` stands there twice"),
        (
            "a frame twice",
            with("\n\"1\":{\"frame_properties\"", "\n\"0\":{\"frame_properties\""),
            "`openlabel.frames.0` stands there twice",
        ),
        (
            "a huge frame number",
            with("\n\"1\":{\"frame_properties\"", "\n\"99999999999999999999\":{\"frame_properties\""),
            "a whole number from 0 to 1000000000 is needed",
        ),
        (
            "a negative frame number",
            with("\n\"1\":{\"frame_properties\"", "\n\"-1\":{\"frame_properties\""),
            "the number of a frame is `-1`",
        ),
        (
            "another version",
            with("\"schema_version\":\"1.0.0\"", "\"schema_version\":\"0.3.0\""),
            "`openlabel.metadata.schema_version` is `0.3.0`",
        ),
        (
            "a version that is not text",
            with("\"schema_version\":\"1.0.0\"", "\"schema_version\":1"),
            "`openlabel.metadata`: invalid type: integer",
        ),
        ("an impossible period", with("\"frame_period_s\":", "\"frame_period_s\":-"), "frame_period_s` is -"),
        (
            "a lane that is none",
            in_frames("\"name\":\"lane\",\"val\":", "\"name\":\"lane\",\"val\":-"),
            "lane of `openlabel.frames.",
        ),
        (
            "a time that goes back",
            with("\n\"1\":{\"frame_properties\":{\"timestamp\":", "\n\"1\":{\"frame_properties\":{\"timestamp\":9"),
            "is needed, as between the other frames",
        ),
        ("text behind the end", format!("{text}{{}}"), "trailing characters"),
        ("a control character", with("\"annotator\":\"closecall\"", "\"annotator\":\"\u{1}\""), "control character"),
    ];
    assert!(cases.len() >= 20);
    for (case, text, needed) in cases {
        let path = folder.path().join("malformed.json");
        fs::write(&path, text).unwrap();
        let output = traffic("lane-changes", &path, &[]);
        let said = message(&output);
        assert_eq!(code(&output), 3, "{case}: {said}");
        assert!(said.contains("malformed.json") && said.contains(needed), "{case}: `{said}` does not say `{needed}`");
    }
    // A byte order mark is no damage.
    let path = folder.path().join("marked.json");
    fs::write(&path, format!("\u{feff}{text}")).unwrap();
    assert_eq!(json_of(&traffic("lane-changes", &path, &["--format", "json"]), 0), changes);
}
