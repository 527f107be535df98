//! Every invalid scenario is refused with a message that names the fault, before any sample runs.

use std::fs;

use crate::support::{closecall, code, folder, headline_with, message, stderr};

/// Returns the invalid scenarios: the fault, the content of the file, and the words that the
/// message must contain.
fn cases() -> Vec<(&'static str, Vec<u8>, &'static [&'static str])> {
    let text = |from: &str, to: &str| headline_with(from, to).into_bytes();
    vec![
        ("empty", Vec::new(), &["empty"]),
        ("blank", b"\n \n".to_vec(), &["empty"]),
        ("binary", vec![0, 159, 146, 150, 255, 0, 7], &["UTF-8", "line 1"]),
        ("not TOML", b"{\"name\": 1}".to_vec(), &[":1:"]),
        (
            "ends within a line",
            text(
                "[[actor]]\nid = \"ego\"\nvehicle = { class = \"car\" }",
                "[[actor]]\nid = \"ego\"\nvehicle = { class =",
            ),
            &["scenario.toml:"],
        ),
        ("unknown key", text("friction = 0.9", "frction = 0.9"), &["frction", "friction"]),
        ("unknown table", text("[sensors]", "[sensor]"), &["sensor"]),
        ("unknown driver", text("overtaker = {", "overtakr = {"), &["overtakr", "overtaker"]),
        (
            "duplicated key",
            text("duration-s = 60.0", "duration-s = 60.0\nduration-s = 50.0"),
            &["duration-s", "duplicate"],
        ),
        ("missing key", text("duration-s = 60.0\n", ""), &["duration-s", "missing"]),
        ("nan", text("duration-s = 60.0", "duration-s = nan"), &["duration-s", "NaN", "finite"]),
        ("inf", text("friction = 0.9", "friction = inf"), &["inf", "finite"]),
        ("negative", text("duration-s = 60.0", "duration-s = -1.0"), &["duration-s", "-1", "0.1 to 3600"]),
        ("word instead of a number", text("friction = 0.9", "friction = \"wet\""), &["wet", "number"]),
        (
            "unknown parameter",
            text("time-gap-s = \"$front-thw-s\"", "time-gap-s = \"$front-twh-s\""),
            &["front-twh-s", "front-thw-s"],
        ),
        (
            "label instead of a number",
            text("time-gap-s = \"$front-thw-s\"", "time-gap-s = \"$rear-class\""),
            &["rear-class", "a number is needed"],
        ),
        ("unknown class", text("choice = { car = ", "choice = { boat = "), &["boat", "motorcycle"]),
        ("min above max", text("min = 4.0, max = 8.0", "min = 9.0, max = 8.0"), &["brake-mps2.uniform.max", "above 9"]),
        ("unknown actor", text("from = \"rear\"", "from = \"raer\""), &["raer", "rear"]),
        ("two actors of one name", text("id = \"front\"", "id = \"ego\""), &["ego", "twice"]),
        ("negative count", text("lanes = 3", "lanes = -1"), &["lanes", "whole number"]),
        ("number instead of a table", text("[sensors]", "[sensors]\nrear-lidar = 3\n[unused]"), &["table"]),
        ("lane beyond the road", text("lane = 2", "lane = 4"), &["lane", "4", "from 1 (leftmost) to 3"]),
        ("no lanes", text("lanes = 3", "lanes = 0"), &["lanes", "0"]),
        (
            "image without pixels",
            text("[sensors]", "[sensors]\nrear-camera = { resolution = { width-px = 0 } }"),
            &["sensors.rear-camera.resolution.width-px", "is 0", "a number of columns from 640 to 3848"],
        ),
        (
            "image beyond every sensor",
            text("[sensors]", "[sensors]\nrear-camera = { resolution = { height-px = 100000 } }"),
            &["sensors.rear-camera.resolution.height-px", "is 100000", "a number of rows from 480 to 2168"],
        ),
        (
            "rear camera that looks ahead",
            text("[sensors]", "[sensors]\nrear-camera = { yaw-deg = 180.0 }"),
            &["sensors.rear-camera.yaw-deg", "is 180", "-55 to 55"],
        ),
        ("unknown schema version", text("schema-version = 1", "schema-version = 2"), &["schema-version", "2"]),
        (
            "cut-out headway out of reach",
            text(
                "rear-cc1-s = { uniform = { min = 0.0, max = 0.05 }",
                "rear-cc1-s = { uniform = { min = 0.0, max = 1.5 }",
            ),
            &["cut-out-thw-s"],
        ),
        ("capital letters", text("name = \"low-thw-overtake\"", "name = \"Low\""), &["name", "Low"]),
        ("overlapping vehicles", text("gap-m = 120.0", "gap-m = -3.0"), &["overlap"]),
        (
            "lane keeping of an ego stack",
            text("vehicle = { class = \"car\" }\n", "vehicle = { class = \"car\" }\nlane-keeping = { sdlp-m = 0.2 }\n"),
            &["actor[0].lane-keeping", "the ego stack keeps its lane"],
        ),
        ("weaving beyond the lane", text("sdlp-m = 0.2", "sdlp-m = 0.6"), &["lane-keeping.sdlp-m", "0.6", "0 to 0.5"]),
        (
            "weaving beyond the friction",
            text("friction = 0.9", "friction = 0.1"),
            &["lane-keeping.sdlp-m", "environment.friction", "m/s²"],
        ),
        (
            "random speed of a prescribed driver",
            text("sdlp-m = 0.2 }\n", "sdlp-m = 0.2 }\nspeed-keeping = { acceleration-noise-mps2 = 0.1 }\n"),
            &["speed-keeping", "a prescribed driver keeps"],
        ),
    ]
}

#[test]
fn invalid_scenarios_are_refused_with_a_message_that_names_the_fault() {
    let folder = folder();
    let path = folder.path().join("scenario.toml");
    let out = folder.path().join("out");
    for (fault, content, words) in cases() {
        fs::write(&path, content).unwrap();
        let output = closecall(["campaign", path.to_str().unwrap(), "-n", "5", "--out", out.to_str().unwrap()]);
        let message = message(&output);
        assert_eq!(code(&output), 3, "{fault}: {message}");
        assert!(message.contains("scenario.toml"), "{fault}: {message}");
        for word in words {
            assert!(message.to_lowercase().contains(&word.to_lowercase()), "{fault}: no `{word}` in: {message}");
        }
        assert!(!message.contains("panicked"), "{fault}: {message}");
        assert!(!out.exists(), "{fault}: the campaign made a folder");
    }
}

#[test]
fn a_missing_scenario_file_is_named() {
    let output = closecall(["check", "nowhere.toml"]);
    assert_eq!(code(&output), 6);
    assert!(stderr(&output).contains("nowhere.toml"));
}

#[test]
fn a_parameter_that_nothing_uses_is_refused() {
    let folder = folder();
    let path = folder.path().join("scenario.toml");
    fs::write(&path, headline_with("deceleration-mps2 = \"$brake-mps2\"", "deceleration-mps2 = 6.0")).unwrap();
    for command in ["check", "run"] {
        let output = closecall([command, path.to_str().unwrap()]);
        assert_eq!(code(&output), 3);
        assert!(stderr(&output).contains("brake-mps2"), "{command}: {}", stderr(&output));
    }
}
