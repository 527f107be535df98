//! Every wrong scenario is refused with a clear message, before anything is run.

use std::fs;

use crate::support::{closecall, code, folder, headline_with, stderr};

/// What is wrong, the file's content, and what the message must name.
fn cases() -> Vec<(&'static str, Vec<u8>, &'static [&'static str])> {
    let text = |from: &str, to: &str| headline_with(from, to).into_bytes();
    vec![
        ("empty", Vec::new(), &["empty"]),
        ("blank", b"\n \n".to_vec(), &["empty"]),
        ("binary", vec![0, 159, 146, 150, 255, 0, 7], &["UTF-8", "line 1"]),
        ("not TOML", b"{\"name\": 1}".to_vec(), &[":1:"]),
        (
            "cut in a line",
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
        ("word for a number", text("friction = 0.9", "friction = \"wet\""), &["wet", "number"]),
        (
            "unknown parameter",
            text("time-gap-s = \"$front-thw-s\"", "time-gap-s = \"$front-twh-s\""),
            &["front-twh-s", "front-thw-s"],
        ),
        (
            "label for a number",
            text("time-gap-s = \"$front-thw-s\"", "time-gap-s = \"$rear-class\""),
            &["rear-class", "a number is needed"],
        ),
        ("unknown class", text("choice = { car = ", "choice = { boat = "), &["boat", "motorcycle"]),
        ("min above max", text("min = 4.0, max = 8.0", "min = 9.0, max = 8.0"), &["brake-mps2.uniform.max", "above 9"]),
        ("unknown actor", text("from = \"rear\"", "from = \"raer\""), &["raer", "rear"]),
        ("two of a name", text("id = \"front\"", "id = \"ego\""), &["ego", "twice"]),
        ("negative count", text("lanes = 3", "lanes = -1"), &["lanes", "whole number"]),
        ("number for a table", text("[sensors]", "[sensors]\nrear-lidar = 3\n[unused]"), &["table"]),
        ("lane beyond the road", text("lane = 2", "lane = 4"), &["lane", "4"]),
        ("no lanes", text("lanes = 3", "lanes = 0"), &["lanes", "0"]),
        ("another schema", text("schema-version = 1", "schema-version = 2"), &["schema-version", "2"]),
        (
            "never reaches its cut-out",
            text(
                "rear-cc1-s = { uniform = { min = 0.0, max = 0.05 }",
                "rear-cc1-s = { uniform = { min = 0.0, max = 1.5 }",
            ),
            &["cut-out-thw-s"],
        ),
        ("capital letters", text("name = \"low-thw-overtake\"", "name = \"Low\""), &["name", "Low"]),
        ("overlap", text("gap-m = 120.0", "gap-m = -3.0"), &["overlap"]),
        (
            "no human at the wheel",
            text("vehicle = { class = \"car\" }\n", "vehicle = { class = \"car\" }\nlane-keeping = { sdlp-m = 0.2 }\n"),
            &["actor[0].lane-keeping", "the ego stack keeps its lane"],
        ),
        ("weaves through the lanes", text("sdlp-m = 0.2", "sdlp-m = 0.6"), &["lane-keeping.sdlp-m", "0.6", "0 to 0.5"]),
        (
            "weaves on ice",
            text("friction = 0.9", "friction = 0.1"),
            &["lane-keeping.sdlp-m", "environment.friction", "m/s²"],
        ),
        (
            "a prescribed speed that wanders",
            text("sdlp-m = 0.2 }\n", "sdlp-m = 0.2 }\nspeed-keeping = { acceleration-noise-mps2 = 0.1 }\n"),
            &["speed-keeping", "a prescribed driver keeps"],
        ),
    ]
}

#[test]
fn wrong_scenarios_are_refused_with_what_is_wrong() {
    let folder = folder();
    let path = folder.path().join("scenario.toml");
    let out = folder.path().join("out");
    for (what, content, named) in cases() {
        fs::write(&path, content).unwrap();
        let output = closecall(["campaign", path.to_str().unwrap(), "-n", "5", "--out", out.to_str().unwrap()]);
        let message = stderr(&output).replace(['\n', '│'], " ");
        let message = message.split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(code(&output), 3, "{what}: {message}");
        assert!(message.contains("scenario.toml"), "{what}: {message}");
        for word in named {
            assert!(message.to_lowercase().contains(&word.to_lowercase()), "{what}: no `{word}` in: {message}");
        }
        assert!(!message.contains("panicked"), "{what}: {message}");
        assert!(!out.exists(), "{what} left something behind");
    }
}

#[test]
fn a_scenario_that_is_not_there_is_named() {
    let output = closecall(["check", "nowhere.toml"]);
    assert_eq!(code(&output), 6);
    assert!(stderr(&output).contains("nowhere.toml"));
}

#[test]
fn a_parameter_that_nothing_uses_is_pointed_out() {
    let folder = folder();
    let path = folder.path().join("scenario.toml");
    fs::write(&path, headline_with("deceleration-mps2 = \"$brake-mps2\"", "deceleration-mps2 = 6.0")).unwrap();
    for command in ["check", "run"] {
        let output = closecall([command, path.to_str().unwrap()]);
        assert_eq!(code(&output), 0);
        assert!(stderr(&output).contains("brake-mps2"), "{command}: {}", stderr(&output));
    }
}
