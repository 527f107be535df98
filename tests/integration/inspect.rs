//! `inspect` reports flaws of trajectory files and reads the logs that a vehicle records of itself.

use std::fs;

use crate::support::{closecall, code, folder, json, library, stderr, stdout};

#[test]
fn flaws_are_reported_and_unusable_rows_end_with_3() {
    let folder = folder();
    let csv = folder.path().join("own.csv");
    let csv = csv.to_str().unwrap();
    let scenario = library("overtake-without-brake");
    stdout(
        &closecall(["traffic", "record", scenario.to_str().unwrap(), "-n", "1", "--controller", "acc", "-o", csv]),
        0,
    );
    let report = json(&closecall(["traffic", "inspect", csv, "--format", "json"]), 0);
    assert_eq!(report["layout"], "plain");
    assert_eq!((report["usable"].as_bool(), report["vehicles"].as_u64()), (Some(true), Some(3)));
    assert_eq!(report["flaws"]["jumps"]["count"], 0);
    let text = fs::read_to_string(csv).unwrap();
    let mut lines: Vec<&str> = text.lines().collect();
    // A row that is repeated in all values is left out.
    lines.insert(100, lines[99]);
    fs::write(csv, lines.join("\n") + "\n").unwrap();
    let report = json(&closecall(["traffic", "inspect", csv, "--format", "json"]), 0);
    assert_eq!((report["continuity"]["repeated_rows"].as_u64(), report["usable"].as_bool()), (Some(1), Some(true)));
    let other_class = lines[99].replacen("car", "truck", 1);
    lines[100] = &other_class;
    fs::write(csv, lines.join("\n") + "\n").unwrap();
    let output = closecall(["traffic", "inspect", csv, "--format", "json"]);
    assert!(stderr(&output).contains("own.csv, line 101: frame 98"), "{}", stderr(&output));
    assert!(stderr(&output).contains("1 row cannot be used"), "{}", stderr(&output));
    let report = json(&output, 3);
    assert_eq!(report["dropped"]["duplicated rows"]["first_line"], 101);
    assert_eq!(code(&closecall(["traffic", "inspect", csv, "--drop-bad-rows"])), 0);
    assert_eq!(code(&closecall(["traffic", "inspect", csv, "--layout", "highd"])), 3);
    assert_eq!(code(&closecall(["traffic", "inspect", "nowhere.csv"])), 6);
}

#[test]
fn an_in_car_log_has_a_file_of_true_lane_changes_beside_it() {
    let folder = folder();
    let csv = folder.path().join("drive.csv");
    let csv = csv.to_str().unwrap();
    let scenario = library("overtake-without-brake");
    let scenario = scenario.to_str().unwrap();
    let args = ["traffic", "record", scenario, "-n", "3", "--controller", "acc", "--in-car", "-o", csv];
    stdout(&closecall(args), 0);
    let truth = fs::read_to_string(folder.path().join("drive.truth.csv")).unwrap();
    let crossings: Vec<f64> =
        truth.lines().skip(1).map(|line| line.split(',').nth(4).unwrap().parse().unwrap()).collect();
    assert_eq!(crossings.len(), 3, "the rear vehicle overtakes once in each sample");
    let report = json(&closecall(["traffic", "inspect", csv, "--format", "json"]), 0);
    assert_eq!((report["layout"].as_str(), report["period_s"].as_f64()), (Some("in-car"), Some(0.01)));
    let changes = json(&closecall(["traffic", "lane-changes", csv, "--format", "json"]), 0);
    for (change, truth) in changes.as_array().unwrap().iter().zip(&crossings) {
        let crossing_s = change["crossing_s"].as_f64().unwrap();
        assert!((crossing_s - truth).abs() <= 0.3, "{crossing_s} instead of {truth}");
    }
    assert_eq!(changes.as_array().unwrap().len(), 3);
    let unknown = closecall(["traffic", "record", scenario, "-n", "1", "--in-car=nobody", "-o", csv]);
    assert_eq!(code(&unknown), 2);
    assert!(stderr(&unknown).contains("rear"), "the message does not list the actors: {}", stderr(&unknown));
}
