//! `sample` varies a parameter of a recorded lane change while the other vehicles drive as
//! recorded.

use std::fs;
use std::path::{Path, PathBuf};

use closecall_testing::data;
use serde_json::Value;

use crate::support::{closecall, code, folder, json, library, message, stdout};

/// A vehicle that overtakes the rear vehicle in the left lane before this changes lanes.
const PASSING: &str = "
[[actor]]
id = \"passing\"
vehicle = { class = \"car\" }
start = { behind = { of = \"rear\", gap-m = 10.0, closing-mps = 8.0, lane = 1 } }
driver = { prescribed = { acceleration-profile = [[0.0, 0.0]] } }
";

/// Writes a trajectory file of simulated traffic. Each sample has four vehicles: the ego, the lead
/// vehicle, the rear vehicle, and one that overtakes it.
fn own_trajectories(folder: &Path) -> PathBuf {
    let (scenario, csv) = (folder.join("passing.toml"), folder.join("own.csv"));
    fs::write(&scenario, fs::read_to_string(library("overtake-without-brake")).unwrap() + PASSING).unwrap();
    let [scenario, path] = [&scenario, &csv].map(|path| path.to_str().unwrap());
    stdout(&closecall(["traffic", "record", scenario, "-n", "4", "--controller", "acc", "--seed", "1", "-o", path]), 0);
    csv
}

/// Returns the words of a command that lets cc1 fall.
fn falling_cc1<'a>(trajectories: &'a Path, track: &'a str) -> Vec<&'a str> {
    let file = trajectories.to_str().unwrap();
    vec![
        "traffic",
        "sample",
        file,
        "--lane-change",
        track,
        "--vary",
        "cc1",
        "--from",
        "1.5",
        "--to",
        "0.3",
        "--steps",
        "5",
    ]
}

/// Checks that the smallest headway to the vehicle that is overtaken falls with each step, and that
/// to the vehicle that has overtaken stays.
fn check_headways(sampled: &Value) {
    let runs: Vec<&Value> = sampled["runs"].as_array().unwrap().iter().filter(|run| !run["value"].is_null()).collect();
    assert_eq!(runs.len(), 5);
    let column = |key: &str| -> Vec<f64> { runs.iter().map(|run| run[key].as_f64().unwrap()).collect() };
    let (opp1, opp2) = (column("min_thw_opp1_s"), column("min_thw_opp2_s"));
    assert!(opp1.windows(2).all(|pair| pair[1] < pair[0]), "{opp1:?}");
    assert!(opp1[0] - opp1[4] > 0.5, "{opp1:?}");
    let spread_s = opp2.iter().fold(0.0, |spread: f64, thw_s| spread.max((thw_s - opp2[0]).abs()));
    assert!(spread_s < 0.1, "{opp2:?}");
    assert!(runs.iter().all(|run| run["collision"].is_null()), "{sampled}");
}

#[test]
fn as_cc1_falls_the_headway_to_the_overtaken_vehicle_falls_and_that_to_the_overtaking_one_stays() {
    let folder = folder();
    let trajectories = own_trajectories(folder.path());
    for track in ["11", "15"] {
        let sampled = json(&closecall(falling_cc1(&trajectories, track).into_iter().chain(["--format", "json"])), 0);
        check_headways(&sampled);
        let smallest = sampled["runs"][1]["min_thw_opp2_s"].as_f64().unwrap();
        assert!(smallest > 0.1, "track {track}: the overtaking vehicle is ahead from the start: {smallest}");
    }
}

#[test]
fn as_cc1_falls_the_headways_of_a_recorded_lane_change_do_the_same() {
    let Some(data) = data() else { return };
    let recorded = data.join("ngsim_us101/trajectories/us101_b.csv");
    check_headways(&json(&closecall(falling_cc1(&recorded, "120").into_iter().chain(["--format", "json"])), 0));
}

#[test]
fn each_step_runs_and_its_transfer_is_a_campaign_with_the_margin_increase_system() {
    let folder = folder();
    let trajectories = own_trajectories(folder.path());
    let out = folder.path().join("sampled");
    let outputs = ["--transfer", "-o", out.to_str().unwrap()];
    let table = stdout(&closecall(falling_cc1(&trajectories, "11").into_iter().chain(outputs)), 0);
    assert!(table.contains("Opp1: track 9; Opp2: track 12") && table.contains("cc1 = 0.3"), "{table}");
    let svg = fs::read_to_string(out.join("sample.svg")).unwrap();
    assert!(["recorded", "cc1 = 1.5", "Opp1", "Opp2"].iter().all(|text| svg.contains(text)));
    assert!(fs::metadata(out.join("sample.rrd")).unwrap().len() > 10_000);
    let path = |name: &str| out.join(name).to_str().unwrap().to_owned();
    for step in 1..=5 {
        let run = json(
            &closecall(["run", &path(&format!("step-{step}.toml")), "--controller", "acc", "--format", "json"]),
            0,
        );
        assert!(run["collisions"].as_array().unwrap().is_empty(), "{run}");
    }
    // The validity checks mirror the scenario, with its lane change.
    stdout(&closecall(["campaign", &path("step-5.toml"), "-n", "1", "--controller", "acc", "--no-gate"]), 0);
    let transferred = fs::read_to_string(out.join("transferred-5.toml")).unwrap();
    for text in ["id = \"ego\"", "id = \"front\"", "id = \"rear\"", "overtaker", "cc1-s = 0.3"] {
        assert!(transferred.contains(text), "{text}: {transferred}");
    }
    stdout(&closecall(["campaign", &path("transferred-5.toml"), "-n", "1", "--paired", "--no-gate"]), 0);
}

#[test]
fn any_parameter_of_a_driver_can_be_varied_and_a_wrong_one_is_refused() {
    let folder = folder();
    let trajectories = own_trajectories(folder.path());
    let sample = |vary: &str, values: [&str; 2], steps: &str| {
        let file = trajectories.to_str().unwrap();
        let [from, to] = values;
        closecall(["traffic", "sample", file, "--vary", vary, "--from", from, "--to", to, "--steps", steps])
    };
    for vary in ["cc0", "desired-speed-mps", "actor.opp1.start.absolute.speed-mps"] {
        let table = stdout(&sample(vary, ["20", "18"], "2"), 0);
        assert!(table.contains("= 18"), "{table}");
    }
    for (vary, values, steps, words) in [
        ("cc99", ["1", "2"], "3", "allowed are cc0-m, cc1-s"),
        ("cc1", ["1", "1"], "3", "two different numbers"),
        ("cc1", ["1", "2"], "1", "2 to 100"),
    ] {
        let refused = sample(vary, values, steps);
        assert_eq!(code(&refused), 2);
        assert!(message(&refused).contains(words), "{}", message(&refused));
    }
    let beyond = sample("cc1", ["1", "-2"], "2");
    assert_eq!(code(&beyond), 3);
    assert!(message(&beyond).contains("cc1-s"), "{}", message(&beyond));
    let nowhere = sample("actor.nobody.driver.wiedemann99.cc1-s", ["1", "2"], "2");
    assert!(message(&nowhere).contains("nobody"), "{}", message(&nowhere));
}

#[test]
fn a_lane_change_by_an_event_needs_a_driver_who_follows_and_a_lane_on_that_side() {
    let folder = folder();
    let trajectories = own_trajectories(folder.path());
    let out = folder.path().join("sampled");
    stdout(&closecall(falling_cc1(&trajectories, "11").into_iter().chain(["-o", out.to_str().unwrap()])), 0);
    let text = fs::read_to_string(out.join("step-1.toml")).unwrap();
    let refused = |changed: String, words: &str| {
        let path = folder.path().join("changed.toml");
        fs::write(&path, changed).unwrap();
        let output = closecall(["check", path.to_str().unwrap()]);
        assert_eq!(code(&output), 3);
        assert!(message(&output).contains(words), "{}", message(&output));
    };
    let side = text.replacen("to = \"left\"", "to = \"right\"", 1);
    refused(side, "has no lane on that side");
    let start = text.find("[actor.driver.wiedemann99]").unwrap();
    let end = start + text[start..].find("\n\n").unwrap();
    let prescribed = "[actor.driver.prescribed]\nprofile = [[0.0, 30.0]]";
    refused(text.replacen(&text[start..end], prescribed, 1), "`wiedemann99` or `idm`");
}
