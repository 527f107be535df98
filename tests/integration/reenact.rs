//! `reenact` repeats a recorded encounter with the controller under test in the ego.

use std::fs;
use std::path::{Path, PathBuf};

use closecall_testing::data;
use serde_json::Value;

use crate::support::{closecall, code, folder, json, library, stderr, stdout};

/// Writes a trajectory file of simulated traffic without the MIS. Each sample has three vehicles,
/// the rear vehicle last.
fn own_trajectories(folder: &Path) -> PathBuf {
    let csv = folder.join("own.csv");
    let scenario = library("overtake-without-brake");
    let args = [
        "traffic",
        "record",
        scenario.to_str().unwrap(),
        "-n",
        "4",
        "--controller",
        "acc",
        "-o",
        csv.to_str().unwrap(),
    ];
    stdout(&closecall(args), 0);
    csv
}

/// Returns the JSON that `reenact` prints.
fn reenacted(trajectories: &Path, more: &[&str]) -> Value {
    let args = ["traffic", "reenact", trajectories.to_str().unwrap(), "--format", "json"];
    json(&closecall(args.iter().chain(more)), 0)
}

fn number(reenactment: &Value, half: &str, key: &str) -> f64 {
    reenactment[half][key].as_f64().unwrap_or_else(|| panic!("{half}.{key}: {reenactment}"))
}

#[test]
fn the_run_is_close_to_the_trajectory_data_without_the_mis_and_has_more_headway_with_it() {
    let folder = folder();
    let trajectories = own_trajectories(folder.path());
    for track in ["3", "6", "9", "12"] {
        let acc = reenacted(&trajectories, &["--track", track, "--controller", "acc"]);
        assert_eq!(acc["track_id"].to_string(), track);
        let ids = ["ego_track_id", "front_track_id"].map(|key| acc[key].as_u64().unwrap());
        let first = track.parse::<u64>().unwrap() - 2;
        assert_eq!(ids, [first, first + 1]);
        for (key, within) in [("crossing_s", 1.0), ("thw_front_at_crossing_s", 0.1), ("thw_rear_at_crossing_s", 0.1)] {
            let [recorded, simulated] = ["recorded", "simulated"].map(|half| number(&acc, half, key));
            assert!((recorded - simulated).abs() < within, "track {track}, {key}: {recorded} and {simulated}");
        }
        let mis = reenacted(&trajectories, &["--track", track]);
        assert_eq!(mis["recorded"], acc["recorded"]);
        let gained_s =
            number(&mis, "simulated", "thw_front_at_crossing_s") - number(&mis, "recorded", "thw_front_at_crossing_s");
        assert!(gained_s > 0.5, "track {track}: {gained_s}");
    }
}

#[test]
fn with_all_vehicles_as_recorded_the_run_reproduces_the_trajectory_data() {
    let folder = folder();
    let trajectories = own_trajectories(folder.path());
    let toml = folder.path().join("again.toml");
    let path = toml.to_str().unwrap();
    let reenactment =
        reenacted(&trajectories, &["--track", "3", "--controller", "acc", "--rear", "recorded", "-o", path]);
    for key in ["crossing_s", "thw_rear_at_crossing_s", "min_thw_rear_s", "thw_front_at_crossing_s"] {
        let [recorded, simulated] = ["recorded", "simulated"].map(|half| number(&reenactment, half, key));
        let within = if key == "crossing_s" { 0.05 } else { 0.2 };
        assert!((recorded - simulated).abs() < within, "{key}: {recorded} and {simulated}");
    }
    // The checks of the simulator mirror a scenario, lane changes at given times included.
    assert!(fs::read_to_string(&toml).unwrap().contains("lane-changes"));
    stdout(&closecall(["campaign", path, "-n", "1", "--controller", "acc", "--no-gate"]), 0);
}

#[test]
fn the_written_scenario_has_the_same_outcome_and_can_be_varied() {
    let folder = folder();
    let trajectories = own_trajectories(folder.path());
    let toml = folder.path().join("again.toml");
    let path = toml.to_str().unwrap();
    let reenactment = reenacted(&trajectories, &["--track", "6", "-o", path]);
    assert_eq!(reenactment, reenacted(&trajectories, &["--track", "6"]));
    let text = fs::read_to_string(&toml).unwrap();
    assert!(text.starts_with("# Made by `closecall traffic reenact") && text.contains("own.csv"), "{text}");
    let mut run = json(&closecall(["run", path, "--format", "json"]), 0);
    // The JSON of a run also states its origin; the JSON of `reenact` states it once, beside the
    // outcome.
    for stamp in ["schema_version", "closecall_version", "settings"] {
        assert!(run.as_object_mut().unwrap().remove(stamp).is_some(), "{stamp}");
    }
    assert_eq!(run, reenactment["outcome"]);
    stdout(&closecall(["campaign", path, "-n", "2", "--paired", "--no-gate"]), 0);
    let set = "actor.ego.driver.ego-stack.mis.max-deceleration-mps2=0.2";
    let weaker = reenacted(&trajectories, &["--track", "6", "--set", set]);
    let headway_s = |reenactment: &Value| number(reenactment, "simulated", "thw_front_at_crossing_s");
    assert!(headway_s(&weaker) < headway_s(&reenactment), "{} and {}", headway_s(&weaker), headway_s(&reenactment));
}

#[test]
fn an_encounter_that_cannot_be_re_enacted_is_refused_with_the_reason() {
    let folder = folder();
    let trajectories = own_trajectories(folder.path());
    let trajectories = trajectories.to_str().unwrap();
    let refused = |args: &[&str], expected: i32, words: &[&str]| {
        let output = closecall(["traffic", "reenact"].iter().chain(args));
        let said = stderr(&output);
        assert_eq!(code(&output), expected, "{args:?}: {said}");
        assert!(words.iter().all(|word| said.contains(word)), "{args:?}: {said}");
    };
    let unknown = ["own.csv", "no lane change of track 99, which it does not hold", "tracks that change lanes are 3"];
    refused(&[trajectories, "--track", "99"], 2, &unknown);
    refused(&[trajectories, "--track", "1"], 2, &["no lane change of track 1; the tracks that change lanes are 3"]);
    refused(&["/no/such.csv"], 6, &["/no/such.csv"]);
    refused(&[trajectories, "--record", "/nowhere/at/all.rrd"], 6, &["/nowhere/at/all.rrd"]);
    refused(&[trajectories, "-o", trajectories], 2, &["would overwrite"]);
    refused(&[trajectories, "--set", "actor.nobody.start=1"], 2, &["actor.nobody.start"]);
    refused(&[trajectories, "--record-level", "full"], 2, &["--record"]);
    // The in-car log of the rear vehicle holds no other vehicle.
    let drive = folder.path().join("drive.csv");
    let drive = drive.to_str().unwrap();
    let scenario = library("overtake-without-brake");
    stdout(&closecall(["traffic", "record", scenario.to_str().unwrap(), "-n", "1", "--in-car", "-o", drive]), 0);
    refused(&[drive], 3, &["drive.csv", "no vehicle is ahead of track 1"]);
    // A trajectory file need not hold a lead vehicle.
    let text = fs::read_to_string(trajectories).unwrap();
    let column = text.lines().next().unwrap().split(',').position(|name| name == "track_id").unwrap();
    let is_lead = |line: &&str| line.split(',').nth(column) == Some("2");
    let without: String = text.lines().filter(|line| !is_lead(line)).map(|line| format!("{line}\n")).collect();
    let no_lead = folder.path().join("no-lead.csv");
    fs::write(&no_lead, without).unwrap();
    refused(&[no_lead.to_str().unwrap(), "--track", "3"], 3, &["ahead of track 1", "track 3", "6, 9, 12"]);
}

#[test]
fn recorded_traffic_is_re_enacted_or_refused_with_the_reason() {
    let Some(data) = data() else { return };
    // Both have the same traffic: of the second, one lane change in four is enough.
    let ngsim = [("ngsim_us101/trajectories/us101_a.csv", 1), ("ngsim_us101/us101_a_ngsim18col_feet.csv", 4)];
    for (trajectories, stride) in ngsim.map(|(file, stride)| (data.join(file), stride)) {
        let changes =
            json(&closecall(["traffic", "lane-changes", trajectories.to_str().unwrap(), "--format", "json"]), 0);
        let tried: Vec<_> = changes.as_array().unwrap().iter().step_by(stride).collect();
        let mut count = 0;
        for change in &tried {
            let track = change["track_id"].to_string();
            for rear in ["driver", "recorded"] {
                let args = ["traffic", "reenact", trajectories.to_str().unwrap(), "--track", &track, "--rear", rear];
                let output = closecall(args);
                assert!([0, 3].contains(&code(&output)), "{args:?}: {}", stderr(&output));
                assert_eq!(code(&output) == 3, stderr(&output).contains("failed to re-enact"), "{}", stderr(&output));
                count += usize::from(code(&output) == 0);
            }
        }
        assert!(count > tried.len() / 2, "{}: {count}", trajectories.display());
    }
}
