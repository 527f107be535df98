//! From recorded traffic to distributions, and back from our own simulation.

use std::fs;

use serde_json::Value;

use crate::support::{closecall, code, data, folder, json, library, stderr, stdout};

#[test]
fn the_chain_runs_on_a_recording_of_our_own() {
    let folder = folder();
    let csv = folder.path().join("own.csv");
    let csv = csv.to_str().unwrap();
    let scenario = library("overtake-without-brake");
    let args = ["record", scenario.to_str().unwrap(), "-n", "40", "--controller", "acc", "-o", csv];
    stdout(&closecall(args), 0);
    let changes = json(&closecall(["lane-changes", csv, "--format", "json"]), 0);
    let changes = changes.as_array().unwrap();
    assert!(changes.len() >= 35, "{}", changes.len());
    // Every lane change of ours goes from lane 2 to lane 1, and takes as long as was sampled.
    let sampling = ["run", scenario.to_str().unwrap(), "--controller", "acc", "--format", "json", "--sample"];
    for change in changes {
        assert_eq!(change["direction"], "left");
        // Three vehicles per sample, the overtaking one last.
        let sample = (change["track_id"].as_u64().unwrap() - 1) / 3;
        let number = sample.to_string();
        let run = json(&closecall(sampling.into_iter().chain([number.as_str()])), 0);
        let sampled_s = run["parameters"]["lane-change-duration-s"].as_f64().unwrap();
        let found_s = change["duration_s"].as_f64().unwrap();
        if change["complete"] == Value::Bool(true) {
            assert!((found_s / sampled_s - 1.0).abs() < 0.05, "sample {sample}: {found_s} for {sampled_s}");
        }
    }
    assert!(changes.iter().filter(|change| change["complete"] == Value::Bool(true)).count() >= 30);
    let critical = json(&closecall(["criticality", csv, "--format", "json"]), 0);
    assert_eq!(critical.as_array().unwrap().len(), changes.len());
    assert!(
        critical[0]["metrics"]["thw_s"]["value"].is_number() || critical[0]["metrics"]["thw_s"]["absent"].is_string()
    );
    let fitted = folder.path().join("fitted.toml");
    stdout(&closecall(["fit", csv, "-o", fitted.to_str().unwrap()]), 0);
    assert!(fs::read_to_string(fitted).unwrap().contains("lane-change-duration-s"));
}

#[test]
fn recorded_traffic_is_read_in_both_layouts() {
    let Some(data) = data() else { return };
    let metres = data.join("ngsim_us101/trajectories/us101_a.csv");
    let feet = data.join("ngsim_us101/us101_a_ngsim18col_feet.csv");
    let crossings = |path: &std::path::Path| -> Vec<f64> {
        let changes = json(&closecall(["lane-changes", path.to_str().unwrap(), "--format", "json"]), 0);
        changes.as_array().unwrap().iter().map(|change| change["crossing_s"].as_f64().unwrap()).collect()
    };
    let (one, other) = (crossings(&metres), crossings(&feet));
    assert!(one.len() > 10);
    assert_eq!(one.len(), other.len());
}

#[test]
fn broken_recordings_are_refused_with_file_and_line() {
    let folder = folder();
    let csv = folder.path().join("own.csv");
    let scenario = library("overtake-without-brake");
    stdout(&closecall(["record", scenario.to_str().unwrap(), "-n", "1", "-o", csv.to_str().unwrap()]), 0);
    let good = fs::read_to_string(&csv).unwrap();
    let cut = &good[..good.len() - 25];
    let nan = good.replacen(",1,", ",nan,", 1);
    for (what, content) in [
        ("empty", Vec::new()),
        ("cut in a line", cut.as_bytes().to_vec()),
        ("nan", nan.into_bytes()),
        ("binary", vec![0, 1, 2, 255, 254, 0]),
        ("prose", b"once upon a time\nthere was a car\n".to_vec()),
    ] {
        fs::write(&csv, content).unwrap();
        for command in ["lane-changes", "criticality", "fit"] {
            let output = closecall([command, csv.to_str().unwrap()]);
            assert_eq!(code(&output), 3, "{what}, {command}: {}", stderr(&output));
            assert!(stderr(&output).contains("own.csv"), "{what}: {}", stderr(&output));
            assert!(!stderr(&output).contains("panicked"), "{what}");
        }
    }
}
