//! A perception of the user's own as a process: it drives the headline, and whatever it does wrong costs its sample with a message that
//! names the program and the field.

use std::fs::File;
use std::path::Path;
use std::process::Output;

use arrow::array::{Array, Float64Array, RecordBatch, StringArray};
use closecall_testing::{has_python, python_with};
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use serde_json::Value;

use crate::support::{closecall, code, folder, json, json_file, library, message, stdout};

/// The perception of the tests, with its kind of answers and its fault.
const GROUPS: &str = "python3 tests/fixtures/perceptions/groups.py";

/// A second camera, with another place, direction and size.
pub(crate) const SECOND_CAMERA: &str = "sensors.additional-rear-cameras=[{ name = \"left\", left-m = 0.5, yaw-deg = 20, resolution = { width-px = 2000 } }]";

fn setting(command: &str) -> String {
    format!("sensors.perception=\"exec:{command}\"")
}

/// Runs a sample with a command as perception and further arguments.
fn run(scenario: &str, command: &str, more: &[&str]) -> Output {
    run_with(scenario, &format!("exec:{command}"), more)
}

/// Runs a sample with a perception and further arguments.
pub(crate) fn run_with(scenario: &str, perception: &str, more: &[&str]) -> Output {
    let path = library(scenario).display().to_string();
    let perception = format!("sensors.perception=\"{perception}\"");
    let args = ["run", &path, "--sensors", "full", "--set", &perception];
    closecall([&args, more].concat())
}

/// Returns the arguments of a campaign that judges nothing, with two settings.
fn campaign<'a>(samples: &'a str, duration: &'a str, setting: &'a str, out: &'a Path) -> Vec<&'a str> {
    let judges_nothing = ["campaign", "low-thw-overtake", "--no-gate", "--no-validity-checks", "--set", "expects=[]"];
    let out = out.to_str().unwrap();
    let settings = ["--sensors", "full", "-n", samples, "--set", duration, "--set", setting, "--out", out];
    [&judges_nothing[..], &settings].concat()
}

/// Runs two seconds of the headline with a fault of the perception, and returns the message of the failed sample.
fn failure(kind: &str, fault: &str, more: &[&str]) -> String {
    let command = format!("{GROUPS} {kind} {fault}");
    let short = ["--set", "duration-s=2", "--set", "sensors.rear-camera.pipeline=off"];
    let output = run("low-thw-overtake", &command, &[&short, more].concat());
    assert_eq!(code(&output), 5, "{fault}: {}", message(&output));
    let text = message(&output);
    assert!(text.contains(&format!("`exec:{command}`")), "{fault}: {text}");
    text
}

/// The times, the actors and the errors of speed of the confirmed tracks behind.
fn rear_tracks(path: &Path) -> Vec<(f64, Option<String>, f64)> {
    let reader = ParquetRecordBatchReaderBuilder::try_new(File::open(path).unwrap()).unwrap().build().unwrap();
    let batches: Vec<RecordBatch> = reader.map(Result::unwrap).collect();
    let mut rows = Vec::new();
    for batch in &batches {
        let text = |name: &str| batch.column_by_name(name).unwrap().as_any().downcast_ref::<StringArray>().unwrap();
        let number = |name: &str| batch.column_by_name(name).unwrap().as_any().downcast_ref::<Float64Array>().unwrap();
        let (source, status, actor) = (text("source"), text("status"), text("actor"));
        for row in 0..batch.num_rows() {
            if source.value(row) == "rear" && status.value(row) != "tentative" {
                let name = actor.is_valid(row).then(|| actor.value(row).to_owned());
                rows.push((number("time_s").value(row), name, number("error_vx_mps").value(row)));
            }
        }
    }
    rows
}

/// Checks that the rear vehicle is followed with its speed, from the second of a run on that is stated, and that the system engages.
pub(crate) fn assert_drives(perception: &str, from_s: f64, more: &[&str]) {
    let folder = folder();
    let tracks = folder.path().join("tracks.parquet");
    let files = ["--seed", "1", "--format", "json", "--tracks", tracks.to_str().unwrap()];
    let outcome: Value = json(&run_with("low-thw-overtake", perception, &[&files, more].concat()), 0);
    let engaged_at_s = outcome["mis"]["engaged_at_s"].as_f64().unwrap_or_else(|| panic!("{}", outcome["mis"]));
    assert!(engaged_at_s > 1.0, "{engaged_at_s}");
    let rows = rear_tracks(&tracks);
    let of_rear: Vec<_> =
        rows.iter().filter(|(time_s, actor, _)| *time_s >= from_s && actor.as_deref() == Some("rear")).collect();
    assert!(of_rear.len() > 100, "{} rows", of_rear.len());
    let square: f64 = of_rear.iter().map(|(_, _, error_mps)| error_mps * error_mps).sum();
    let rmse_mps = (square / of_rear.len() as f64).sqrt();
    assert!(rmse_mps < 1.5, "{perception}: {rmse_mps} m/s");
}

#[test]
fn the_example_with_scikit_learn_drives_the_headline() {
    let Some(python) = python_with("numpy, scipy, sklearn") else { return };
    let perception = format!("exec:{} examples/dbscan_perception.py", python.display());
    assert_drives(&perception, 3.5, &["--set", "sensors.perception-timeout-ms=20000"]);
}

#[test]
fn tracks_and_detections_from_outside_drive_the_headline() {
    if !has_python() {
        return;
    }
    for kind in ["tracks", "detections"] {
        let off = ["--set", "sensors.rear-camera.pipeline=off", "--set", "duration-s=12"];
        assert_drives(&format!("exec:{GROUPS} {kind}"), 5.0, &off);
    }
}

#[test]
fn a_program_gets_the_images_that_it_is_to_have() {
    if !has_python() {
        return;
    }
    // The program checks size, rate and content itself.
    let settings = ["duration-s=2", "sensors.perception-image-hz=5", "sensors.perception-image-step=8"];
    let args: Vec<&str> = settings.iter().flat_map(|setting| ["--set", setting]).collect();
    stdout(&run("low-thw-overtake", &format!("{GROUPS} tracks"), &args), 0);
    let camera = ["resolution.width-px=1921", "resolution.height-px=1208", "yaw-deg=12"];
    let of_camera: Vec<String> = camera.map(|setting| format!("sensors.rear-camera.{setting}")).into();
    let others = of_camera.iter().flat_map(|setting| ["--set", setting.as_str()]);
    let args: Vec<&str> = args.iter().copied().chain(others).chain(["--set", SECOND_CAMERA]).collect();
    stdout(&run("low-thw-overtake", &format!("{GROUPS} tracks"), &args), 0);
    let output = closecall(["check", "low-thw-overtake", "--set", "sensors.perception-image-hz=50"]);
    assert_eq!(code(&output), 3, "{}", message(&output));
}

#[test]
fn a_program_gets_the_scans_of_rear_radars_and_none_without_radars() {
    if !has_python() {
        return;
    }
    // The program checks keys, rate and values itself.
    let settings = ["duration-s=4", "sensors.rear-camera.pipeline=off", "sensors.rear-radar={ range-m = 300 }"];
    let args: Vec<&str> = settings.iter().flat_map(|setting| ["--set", setting]).collect();
    for kind in ["tracks", "detections"] {
        stdout(&run("low-thw-overtake", &format!("{GROUPS} {kind} needs-radars"), &args), 0);
    }
    failure("tracks", "needs-radars", &[]);
}

#[test]
fn a_run_with_a_perception_has_the_same_bits_again() {
    if !has_python() {
        return;
    }
    let short = ["--set", "duration-s=14", "--seed", "1", "--format", "json"];
    let [first, second] = [0, 1].map(|_| json(&run("low-thw-overtake", &format!("{GROUPS} tracks"), &short), 0));
    assert_eq!(first, second);
    let built_in = json(&closecall([&["run", "low-thw-overtake", "--sensors", "full"], &short[..]].concat()), 0);
    assert_ne!(first["mis"], built_in["mis"], "the perception decides");
}

#[test]
fn each_wrong_answer_ends_the_sample_and_names_the_field() {
    if !has_python() {
        return;
    }
    for (kind, fault, stated) in [
        ("tracks", "nan", "`tracks[0].x_m` must be a finite number, it is NaN"),
        ("tracks", "size", "`tracks[0].covariance` must be a list of 4 lists of 4 numbers"),
        ("tracks", "negative-variance", "`tracks[0].covariance[1][1]` must be a variance"),
        ("tracks", "unknown-class", "`tracks[0].class.bus` must be a class: car, truck, motorcycle or background"),
        ("tracks", "other-question", "and was asked for the one at"),
        ("tracks", "no-time", "`time_ns` must be"),
        ("tracks", "other-list", "`tracks` must be a list of at most 256, it is absent"),
        ("tracks", "crash", "the process ended (exit status: 3) after 29 answers; it last wrote: the roof is on fire"),
        ("tracks", "last-words", "a line that nobody had asked for"),
        (
            "tracks",
            "leaves",
            "the process crashed (signal: 6 (SIGABRT)) after its last answer, when its input was closed",
        ),
        ("tracks", "hello", "the sensors failed to perceive: `"),
        ("tracks", "hello", "`answers` must be \"detections\" or \"tracks\", it is \"boxes\""),
        ("detections", "nan", "`detections[0].x_m` must be a finite number, it is NaN"),
        ("detections", "size", "`detections[0].covariance` must be a list of 2 lists of 2 numbers"),
        ("detections", "negative-variance", "`detections[0].covariance[1][1]` must be a variance"),
        ("detections", "unknown-class", "`detections[0].class.bus` must be a class"),
    ] {
        let text = failure(kind, fault, &[]);
        assert!(text.contains(stated), "{kind} {fault}: {text}");
    }
    // The line too many arrives before or after the next question.
    let text = failure("tracks", "two-lines", &[]);
    assert!(text.contains("a line that nobody had asked for") || text.contains("was asked for the one at"), "{text}");
    let text = failure("tracks", "hang", &["--set", "sensors.perception-timeout-ms=500"]);
    assert!(text.contains("hangs: no answer in twice the 500 ms allowed"), "{text}");
    let text = failure("tracks", "none", &["--set", "sensors.perception-memory-mib=1"]);
    assert!(text.contains("holds more than the 1 MiB of memory allowed"), "{text}");
}

#[test]
fn a_program_that_cannot_be_started_and_one_that_would_not_be_asked_are_refused() {
    let output = run("low-thw-overtake", "./no-such-program", &[]);
    assert_eq!(code(&output), 3, "{}", message(&output));
    assert!(message(&output).contains("perception program `exec:./no-such-program`"), "{}", message(&output));
    let perception = setting("true");
    let object = ["run", "low-thw-overtake", "--sensors", "object", "--set", &perception];
    let output = closecall(object);
    assert_eq!(code(&output), 3, "{}", message(&output));
    assert!(message(&output).contains("a program perceives in mode `full` only"), "{}", message(&output));
    let output = closecall(["check", "low-thw-overtake", "--set", "sensors.perception=\"dbscan\""]);
    assert_eq!(code(&output), 3);
    assert!(
        message(&output).contains("`built-in`, `exec:COMMAND`, `lib:PATH`")
            || String::from_utf8_lossy(&output.stdout).contains("`exec:COMMAND`, `lib:PATH`")
    );
}

#[test]
fn a_campaign_knows_its_perception_and_a_foreign_folder_does_not_run_it() {
    if !has_python() {
        return;
    }
    let folder = folder();
    let script = folder.path().join("mine.py");
    std::fs::copy("tests/fixtures/perceptions/groups.py", &script).unwrap();
    let out = folder.path().join("out");
    let perception = setting(&format!("python3 {} tracks", script.display()));
    let mut args = campaign("2", "duration-s=4", &perception, &out);
    args.extend(["--seed", "1"]);
    stdout(&closecall(args.clone()), 0);
    let manifest = json_file(&out.join("manifest.json"));
    let stated = &manifest["controllers"][0];
    assert_eq!(stated["identity"]["name"], "groups", "{manifest}");
    assert!(stated["command"].as_str().unwrap().starts_with("sensors.perception=exec:python3 "));
    assert!(stated["files"].as_array().unwrap().iter().any(|file| file["name"] == script.to_str().unwrap()));
    // No output may take the place of a file that the program reads.
    let read = folder.path().join("read.csv");
    std::fs::write(&read, "1\n").unwrap();
    let with_file = setting(&format!("python3 {} tracks none {}", script.display(), read.display()));
    let output = closecall(["run", "low-thw-overtake", "--set", &with_file, "--trace", read.to_str().unwrap()]);
    assert_eq!(code(&output), 2, "{}", message(&output));
    assert_eq!(std::fs::read_to_string(&read).unwrap(), "1\n");
    let replay = |more: &[&str]| closecall([&["replay", out.to_str().unwrap(), "1"], more].concat());
    stdout(&replay(&[]), 0);
    // A manifest that this program has not written is somebody else's.
    let path = out.join("manifest.json");
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, text.replace("\"replaceable\": false", "\"replaceable\":  false").replacen('\n', "\n\n", 1))
        .unwrap();
    let output = replay(&[]);
    assert_eq!(code(&output), 2, "{}", message(&output));
    assert!(
        message(&output).contains("sensors.perception") || message(&output).contains("exec:python3"),
        "{}",
        message(&output)
    );
    stdout(&replay(&["--trust-folder"]), 0);
    std::fs::write(&path, text).unwrap();
    // The program changes: the campaign is not resumed with another one.
    let mut changed = std::fs::read_to_string(&script).unwrap();
    changed.push_str("# another version\n");
    std::fs::write(&script, changed).unwrap();
    let output = closecall([args.as_slice(), &["--resume"]].concat());
    assert_ne!(code(&output), 0);
    assert!(message(&output).contains("the perception program's file"), "{}", message(&output));
}

#[test]
fn a_network_of_one_s_own_classifies_the_crops() {
    let short = ["run", "low-thw-overtake", "--sensors", "full", "--set", "duration-s=3", "--format", "json"];
    let with = |model: &str| {
        let set = format!("sensors.rear-camera.model={model}");
        closecall([&short[..], &["--set", &set]].concat())
    };
    let margins = |output: &Output| json(output, 0)["margins"].clone();
    assert_eq!(margins(&with("sensors/models/rear-classifier.onnx")), margins(&closecall(short)));
    for (model, expected) in [("no-such.onnx", 6), ("tests/fixtures/perceptions/groups.py", 3)] {
        let output = with(model);
        assert_eq!(code(&output), expected, "{model}: {}", message(&output));
        assert!(message(&output).contains(model), "{}", message(&output));
    }
    let folder = folder();
    let own = "sensors.rear-camera.model=sensors/models/rear-classifier.onnx";
    stdout(&closecall(campaign("1", "duration-s=1", own, folder.path())), 0);
    let manifest = json_file(&folder.path().join("manifest.json"));
    let models = manifest["models"].as_array().unwrap();
    let [shipped, own] = &models[..] else { panic!("{models:?}") };
    assert_eq!((&own["name"], &own["blake3"]), (&"sensors/models/rear-classifier.onnx".into(), &shipped["blake3"]));
}

#[test]
fn the_parameters_of_the_clustering_are_those_of_the_scenario() {
    let folder = folder();
    let clusters = |more: &[&str]| {
        let path = folder.path().join("clusters.parquet");
        let short = ["--seed", "1", "--set", "duration-s=8", "--set", "sensors.rear-camera.pipeline=off"];
        let args = ["run", "low-thw-overtake", "--sensors", "full", "--clusters", path.to_str().unwrap()];
        stdout(&closecall([&args, &short[..], more].concat()), 0);
        let reader = ParquetRecordBatchReaderBuilder::try_new(File::open(path).unwrap()).unwrap().build().unwrap();
        reader.map(|batch| batch.unwrap().num_rows()).sum::<usize>()
    };
    let usual = clusters(&[]);
    // Fewer points make a cluster, and a greater radius joins what is apart.
    assert!(clusters(&["--set", "sensors.cluster-core-points=2"]) > usual);
    assert!(clusters(&["--set", "sensors.cluster-core-points=8"]) < usual);
    let output = closecall(["check", "low-thw-overtake", "--set", "sensors.cluster-radius=3"]);
    assert_eq!(code(&output), 3, "{}", message(&output));
}
