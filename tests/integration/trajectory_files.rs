//! The commands that turn trajectory files into lane changes, metrics and distributions: on
//! recorded traffic, and on trajectory files that the simulation wrote.

use std::collections::BTreeMap;
use std::fs;

use closecall_testing::data;
use serde_json::Value;

use crate::support::{closecall, code, folder, json, library, message, stderr, stdout};

#[test]
fn a_trajectory_file_of_the_simulation_gives_its_lane_changes_metrics_and_distributions() {
    let folder = folder();
    let csv = folder.path().join("own.csv");
    let csv = csv.to_str().unwrap();
    let scenario = library("overtake-without-brake");
    let args = ["traffic", "record", scenario.to_str().unwrap(), "-n", "40", "--controller", "acc", "-o", csv];
    stdout(&closecall(args), 0);
    let changes = json(&closecall(["traffic", "lane-changes", csv, "--format", "json"]), 0);
    let changes = changes.as_array().unwrap();
    assert!(changes.len() >= 35, "{}", changes.len());
    // In this scenario every lane change goes from lane 2 to lane 1, and takes the sampled time.
    let sampling = ["run", scenario.to_str().unwrap(), "--controller", "acc", "--format", "json", "--sample"];
    for change in changes {
        assert_eq!(change["direction"], "left");
        // Each sample has three vehicles, the overtaking one last.
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
    let critical = json(&closecall(["traffic", "criticality", csv, "--format", "json"]), 0);
    assert_eq!(critical.as_array().unwrap().len(), changes.len());
    assert!(
        critical[0]["metrics"]["thw_s"]["value"].is_number() || critical[0]["metrics"]["thw_s"]["absent"].is_string()
    );
    let fitted = folder.path().join("fitted.toml");
    stdout(&closecall(["traffic", "fit", csv, "-o", fitted.to_str().unwrap()]), 0);
    assert!(fs::read_to_string(fitted).unwrap().contains("lane-change-duration-s"));
}

#[test]
fn traffic_that_collides_is_read_as_it_was_written() {
    let folder = folder();
    let csv = folder.path().join("crashes.csv");
    let csv = csv.to_str().unwrap();
    let record = ["traffic", "record", "low-thw-overtake", "-n", "40", "--seed", "1", "--controller", "acc"];
    let printed = stdout(&closecall(record.iter().chain(&["--sensors", "ground-truth", "-o", csv])), 0);
    let said = printed.lines().find(|line| line.contains("in a collision: the track ends before it")).unwrap();
    let collided: usize = said.split(' ').next().unwrap().parse().unwrap();
    // The other vehicles of a run go on, as nothing has happened to them.
    let mut ends: BTreeMap<u64, f64> = BTreeMap::new();
    for line in fs::read_to_string(csv).unwrap().lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        let [time_s, speed_mps, acceleration_mps2] = [4, 8, 9].map(|column| fields[column].parse::<f64>().unwrap());
        assert!(acceleration_mps2.abs() < 15.0 && speed_mps >= 0.0, "{line}");
        ends.insert(fields[1].parse().unwrap(), time_s);
    }
    // Track numbers follow the runs, and each run has as many vehicles as the scenario has actors.
    let text = fs::read_to_string(library("low-thw-overtake")).unwrap();
    let actors = text.lines().filter(|line| line.trim() == "[[actor]]").count() as u64;
    let run_of = |track: u64| (track - 1) / actors;
    let last_of = |run: u64| {
        let of_run = ends.iter().filter(|(track, _)| run_of(**track) == run);
        of_run.map(|(_, end_s)| *end_s).fold(0.0, f64::max)
    };
    let shortened = ends.iter().filter(|(track, end_s)| **end_s < last_of(run_of(**track))).count();
    assert!(collided >= 2 && (1..=collided).contains(&shortened), "{collided} {shortened}");
    stdout(&closecall(["traffic", "inspect", csv]), 0);
    let changes = json(&closecall(["traffic", "lane-changes", csv, "--format", "json"]), 0);
    assert!(!changes.as_array().unwrap().is_empty());
}

#[test]
fn a_file_that_is_given_twice_does_not_count_twice() {
    let folder = folder();
    let [csv, copy] = ["own.csv", "copy.csv"].map(|name| folder.path().join(name).display().to_string());
    let record = ["traffic", "record", "overtake-without-brake", "-n", "2", "--sensors", "ground-truth", "-o", &csv];
    stdout(&closecall(record), 0);
    fs::copy(&csv, &copy).unwrap();
    let commands = [["traffic", "statistics"], ["traffic", "fit"], ["traffic", "robustness"], ["study", "exposure"]];
    for command in commands {
        for again in [&csv, &copy] {
            let output = closecall(command.iter().copied().chain([csv.as_str(), again]));
            assert_eq!(code(&output), 2, "{command:?}: {}", stderr(&output));
            assert!(message(&output).contains("have the same content"), "{command:?}: {}", stderr(&output));
        }
    }
}

#[test]
fn recorded_traffic_has_the_same_lane_changes_in_both_layouts() {
    let Some(data) = data() else { return };
    let metres = data.join("ngsim_us101/trajectories/us101_a.csv");
    let feet = data.join("ngsim_us101/us101_a_ngsim18col_feet.csv");
    let crossings = |path: &std::path::Path| -> Vec<f64> {
        let changes = json(&closecall(["traffic", "lane-changes", path.to_str().unwrap(), "--format", "json"]), 0);
        changes.as_array().unwrap().iter().map(|change| change["crossing_s"].as_f64().unwrap()).collect()
    };
    let (in_metres, in_feet) = (crossings(&metres), crossings(&feet));
    assert!(in_metres.len() > 10);
    assert_eq!(in_metres.len(), in_feet.len());
}

#[test]
fn broken_trajectory_files_are_refused_by_name() {
    let folder = folder();
    let csv = folder.path().join("own.csv");
    let scenario = library("overtake-without-brake");
    stdout(&closecall(["traffic", "record", scenario.to_str().unwrap(), "-n", "1", "-o", csv.to_str().unwrap()]), 0);
    let good = fs::read_to_string(&csv).unwrap();
    let cut = &good[..good.len() - 25];
    let nan = good.replacen(",1,", ",nan,", 1);
    for (defect, content) in [
        ("empty", Vec::new()),
        ("ends within a line", cut.as_bytes().to_vec()),
        ("nan", nan.into_bytes()),
        ("binary", vec![0, 1, 2, 255, 254, 0]),
        ("prose", b"once upon a time\nthere was a car\n".to_vec()),
    ] {
        fs::write(&csv, content).unwrap();
        for command in ["lane-changes", "criticality", "fit"] {
            let output = closecall(["traffic", command, csv.to_str().unwrap()]);
            assert_eq!(code(&output), 3, "{defect}, {command}: {}", stderr(&output));
            assert!(stderr(&output).contains("own.csv"), "{defect}: {}", stderr(&output));
            assert!(!stderr(&output).contains("panicked"), "{defect}");
        }
    }
}

/// Reads the true lane changes of an in-car log: direction, time of the crossing (s), and whether
/// the log holds both ends.
fn truth(path: &std::path::Path) -> Vec<(String, f64, bool)> {
    let text = fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let index = |name| header.iter().position(|column| *column == name).unwrap();
    let [direction, crossing, complete] = ["direction", "crossing_s", "complete"].map(index);
    let row = |line: &str| {
        let fields: Vec<&str> = line.split(',').collect();
        (fields[direction].to_owned(), fields[crossing].parse().unwrap(), fields[complete] == "true")
    };
    lines.map(row).collect()
}

#[test]
fn every_criterion_finds_the_true_lane_changes_of_an_in_car_log_and_two_tolerate_an_offset() {
    let folder = folder();
    let csv = folder.path().join("drive.csv");
    let csv = csv.to_str().unwrap();
    let scenario = library("overtake-without-brake");
    let args =
        ["traffic", "record", scenario.to_str().unwrap(), "-n", "24", "--controller", "acc", "--in-car", "-o", csv];
    stdout(&closecall(args), 0);
    let truth: Vec<_> =
        truth(&folder.path().join("drive.truth.csv")).into_iter().filter(|(.., complete)| *complete).collect();
    assert!(truth.len() >= 8, "{}", truth.len());
    for (criterion, within_s) in [("gradient", 0.05), ("peak", 0.05), ("distance", 0.25)] {
        let lane_changes =
            json(&closecall(["traffic", "lane-changes", csv, "--criterion", criterion, "--format", "json"]), 0);
        let lane_changes = lane_changes.as_array().unwrap();
        for (direction, crossing_s, _) in &truth {
            let is_same = |change: &&Value| {
                change["direction"] == direction.as_str()
                    && (change["crossing_s"].as_f64().unwrap() - crossing_s).abs() <= within_s
            };
            assert_eq!(lane_changes.iter().filter(is_same).count(), 1, "{criterion} at {crossing_s}");
        }
    }
    let plots = folder.path().join("plots");
    let args =
        ["traffic", "robustness", csv, "--repetitions", "1", "--format", "json", "--plot", plots.to_str().unwrap()];
    let study = json(&closecall(args), 0);
    assert_eq!(study["reference_kind"], "gradient");
    assert_eq!(study["criteria"], serde_json::json!(["peak", "distance", "gradient"]));
    let reference = study["reference"].as_f64().unwrap();
    assert!(reference >= truth.len() as f64);
    let levels = study["setup"]["offset_m"].as_array().unwrap();
    let one_metre = levels.iter().position(|level| level.as_f64() == Some(1.0)).unwrap();
    let found_again = |column: usize| study["offset"][one_metre][column]["again"].as_f64().unwrap();
    let [peak, distance, gradient] = [0, 1, 2].map(found_again);
    assert!(peak >= 0.95 * reference && gradient == reference, "peak {peak}, gradient {gradient}");
    assert!(distance <= 0.5 * reference, "distance {distance}");
    assert!(study["fails_from_noise_m_per_sqrt_s"]["peak"].as_f64().unwrap() > 0.0);
    for name in ["noise.svg", "offset.svg"] {
        let chart = fs::read_to_string(plots.join(name)).unwrap();
        assert!(chart.contains("gradient: found again") && chart.contains("distance fails"), "{name}");
    }
}

#[test]
fn statistics_count_lane_changes_by_class_and_draw_box_plots() {
    let folder = folder();
    let csv = folder.path().join("own.csv");
    let csv = csv.to_str().unwrap();
    let scenario = library("overtake-without-brake");
    stdout(
        &closecall(["traffic", "record", scenario.to_str().unwrap(), "-n", "30", "--controller", "acc", "-o", csv]),
        0,
    );
    let plots = folder.path().join("plots");
    let args = ["traffic", "statistics", csv, "--format", "json", "--plot", plots.to_str().unwrap()];
    let statistics = json(&closecall(args), 0);
    let classes = statistics["classes"].as_array().unwrap();
    let changes = json(&closecall(["traffic", "lane-changes", csv, "--format", "json"]), 0);
    let counted: u64 = classes.iter().map(|class| class["lane_changes"].as_u64().unwrap()).sum();
    assert_eq!(counted, changes.as_array().unwrap().len() as u64);
    assert!(classes.iter().any(|class| class["duration_s"]["n"].as_u64() > Some(5)));
    assert_eq!(statistics["correlations"].as_array().unwrap().len(), 15);
    for name in ["duration.svg", "width.svg", "speed.svg"] {
        let chart = fs::read_to_string(plots.join(name)).unwrap();
        let complete: u64 = classes.iter().map(|class| class["complete"].as_u64().unwrap()).sum();
        assert!(chart.contains("car (n = ") && chart.matches("<circle").count() as u64 == complete, "{name}");
    }
    let args = ["traffic", "criticality", csv, "--format", "json", "--plot", plots.to_str().unwrap()];
    let output = closecall(args);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    for (name, limit) in
        [("thw_s.svg", "critical below 0.9"), ("a_lat_mps2.svg", "critical above"), ("dce_m.svg", "below 1.0")]
    {
        assert!(fs::read_to_string(plots.join(name)).unwrap().contains(limit), "{name}");
    }
}

#[test]
fn a_criterion_or_a_reference_that_cannot_be_used_is_refused() {
    let folder = folder();
    let csv = folder.path().join("own.csv");
    let csv = csv.to_str().unwrap();
    let scenario = library("overtake-without-brake");
    stdout(&closecall(["traffic", "record", scenario.to_str().unwrap(), "-n", "1", "-o", csv]), 0);
    let refused = closecall(["traffic", "lane-changes", csv, "--criterion", "gradient"]);
    assert_eq!(code(&refused), 2);
    assert!(stderr(&refused).contains("own.csv") && stderr(&refused).contains("in-car"), "{}", stderr(&refused));
    let list = folder.path().join("list.csv");
    fs::write(&list, "track_id,time_s\n1,x\n").unwrap();
    let refused = closecall(["traffic", "lane-changes", csv, "--reference", list.to_str().unwrap()]);
    assert_eq!(code(&refused), 3);
    assert!(stderr(&refused).contains("list.csv"), "{}", stderr(&refused));
    assert_eq!(code(&closecall(["traffic", "lane-changes", csv, "--reference", "/no/such/list.csv"])), 6);
}
