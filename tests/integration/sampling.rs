//! `sample` varies a parameter of a recorded lane change while the other vehicles drive as
//! recorded.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use closecall_testing::data;
use closecall_traffic::maths;
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
    for step in 0..=5 {
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
        ("cc1", ["1", "1"], "3", "two different finite numbers"),
        ("cc1", ["1", "2"], "1", "2 to 100"),
    ] {
        let refused = sample(vary, values, steps);
        assert_eq!(code(&refused), 2);
        assert!(message(&refused).contains(words), "{}", message(&refused));
    }
    // The message names the value that was written, and no value between.
    for (values, written) in [(["1", "-2"], "-2"), (["-2", "1"], "-2"), (["1", "10.5"], "10.5")] {
        let beyond = sample("cc1", values, "5");
        assert_eq!(code(&beyond), 3);
        let said = message(&beyond);
        assert!(said.contains(&format!("--vary cc1 cannot be {written}: ")), "{said}");
        assert!(said.contains("cc1-s") && said.contains("a number from 0 to 10 is needed"), "{said}");
        assert!(!said.contains("failed to check"), "{said}");
    }
    let nowhere = sample("actor.nobody.driver.wiedemann99.cc1-s", ["1", "2"], "2");
    assert!(message(&nowhere).contains("nobody"), "{}", message(&nowhere));
}

#[test]
fn a_lane_change_by_an_event_needs_a_driver_who_follows_and_a_lane_on_that_side() {
    let folder = folder();
    let text = "schema-version = 1\nname = 'changes'\nduration-s = 5.0\nroad = { lanes = 2 }\n\
         [[actor]]\nid = 'ego'\nvehicle = { class = 'car' }\n\
         start = { absolute = { lane = 2, s-m = 0.0, speed-mps = 20.0 } }\n\
         driver = { ego-stack = { acc = { time-gap-s = 1.8 } } }\n\
         [[actor]]\nid = 'changer'\nvehicle = { class = 'car' }\n\
         start = { absolute = { lane = 2, s-m = 300.0, speed-mps = 20.0 } }\ndriver = { wiedemann99 = {} }\n\
         [[actor.event]]\nid = 'changes-lanes'\nwhen = { at-s = 1.0 }\n\
         then = { lane-change = { to = 'left', duration-s = 4.0 } }\n";
    let check = |changed: &str| {
        let path = folder.path().join("changed.toml");
        fs::write(&path, changed).unwrap();
        closecall(["check", path.to_str().unwrap()])
    };
    let refused = |changed: String, words: &str| {
        let output = check(&changed);
        assert_eq!(code(&output), 3);
        assert!(message(&output).contains(words), "{}", message(&output));
    };
    assert_eq!(code(&check(text)), 0);
    refused(text.replacen("to = 'left'", "to = 'right'", 1), "has no lane on that side");
    let prescribed = "driver = { prescribed = { profile = [[0.0, 30.0]] } }";
    refused(text.replacen("driver = { wiedemann99 = {} }", prescribed, 1), "`wiedemann99` or `idm`");
}

/// Width of a lane of the made recordings (m).
const LANE_M: f64 = 3.5;

/// The state of a vehicle at a time: position along the road and to the right of its left edge (m).
type Motion<'a> = &'a dyn Fn(f64) -> [f64; 2];

/// Writes a recording with 10 frames per second: each vehicle is there from its first to its last time (s).
fn recording(folder: &Path, vehicles: &[(u64, [f64; 2], Motion<'_>)]) -> PathBuf {
    let mut text =
        "recording_id,track_id,vehicle_id,frame,time_s,s_m,d_m,lane_id,speed_mps,accel_mps2,heading_rel_rad,\
                    x_m,y_m,length_m,width_m,vehicle_class,source_scenario\n"
            .to_owned();
    for (id, [from_s, to_s], motion) in vehicles {
        for frame in (0..=400).filter(|frame| (*from_s..=*to_s).contains(&(0.1 * f64::from(*frame)))) {
            let time_s = 0.1 * f64::from(frame);
            let [[s_m, d_m], [before_m, _], [after_m, _]] = [0.0, -0.05, 0.05].map(|shift_s| motion(time_s + shift_s));
            let lane = (d_m / LANE_M).floor() + 1.0;
            let speed_mps = (after_m - before_m) / 0.1;
            let _infallible = writeln!(
                text,
                "made,{id},{id},{frame},{time_s:.1},{s_m:.4},{d_m:.4},{lane},{speed_mps:.4},,0.0,{s_m:.4},{:.4},4.6,1.8,car,",
                -d_m
            );
        }
    }
    let path = folder.join("made.csv");
    fs::write(&path, text).unwrap();
    path
}

/// Returns the lateral position of a lane change from the right lane to the left one within 4 s.
fn changing(time_s: f64, start_s: f64, offset_m: f64) -> f64 {
    let share = ((time_s - start_s) / 4.0).clamp(0.0, 1.0);
    1.5 * LANE_M + offset_m - (LANE_M + offset_m) * share.powi(3) * (10.0 - 15.0 * share + 6.0 * share * share)
}

/// Samples a track with falling cc1.
fn sample(file: &Path, track: &str, more: &[&str]) -> std::process::Output {
    let words = ["traffic", "sample", file.to_str().unwrap(), "--lane-change", track, "--vary", "cc1", "--to", "0.3"];
    closecall(words.into_iter().chain(more.iter().copied()).chain(["--format", "json"]))
}

#[test]
fn a_driver_with_nobody_ahead_is_sampled_and_starts_as_recorded() {
    let folder = folder();
    // The vehicle starts 0.4 m beside the middle of its lane, and moves sideways.
    let motion = |time_s: f64| [22.0 * time_s, changing(time_s, 9.0, 0.4) - 0.05 * time_s.min(4.0)];
    let file = recording(folder.path(), &[(1, [0.0, 20.0], &motion)]);
    let out = folder.path().join("out");
    let sampled = json(&sample(&file, "1", &["--from", "1.5", "-o", out.to_str().unwrap()]), 0);
    assert!(sampled["opp1_track_id"].is_null() && sampled["opp2_track_id"].is_null(), "{sampled}");
    let reproduction = &sampled["reproduction"];
    assert!(reproduction["largest_along_m"].as_f64().unwrap() < 0.5, "{reproduction}");
    assert!(reproduction["across_rms_m"].as_f64().unwrap() < 0.05, "{reproduction}");
    assert!(reproduction["crosses_later_s"].as_f64().unwrap().abs() < 0.1, "{reproduction}");
    // Nobody is ahead, so that no headway changes anything.
    let remarks = sampled["remarks"].to_string();
    assert!(remarks.contains("cc1 = 0.3 changes nothing"), "{remarks}");
    let step: toml::Value = toml::from_str(&fs::read_to_string(out.join("step-0.toml")).unwrap()).unwrap();
    let actor = &step["actor"].as_array().unwrap()[0];
    let across_m: Vec<f64> =
        actor["path"].as_array().unwrap().iter().map(|point| point[1].as_float().unwrap()).collect();
    assert!((across_m[0] + 1.5 * LANE_M + 0.4).abs() < 0.03 && (across_m[2] - across_m[0]) > 0.03, "{across_m:?}");
    let start = &actor["start"]["absolute"];
    assert!((start["speed-mps"].as_float().unwrap() - 22.0).abs() < 0.05, "{start}");
    assert!(start["acceleration-mps2"].as_float().unwrap().abs() < 0.1, "{start}");
}

#[test]
fn a_follower_is_reproduced_and_lower_values_bring_it_closer() {
    let folder = folder();
    let leader = |time_s: f64| [60.0 + 20.0 * time_s - 4.0 * maths::sin(0.4 * time_s), 1.5 * LANE_M];
    // The follower keeps about 20 m, with a delay of 1 s.
    let follower = |time_s: f64| [leader(time_s - 1.0)[0] - 4.6, changing(time_s, 11.0, 0.0)];
    let ends_early = |to_s: f64| [(1, [0.0, to_s], &leader as Motion<'_>), (2, [0.0, 22.0], &follower)];
    let file = recording(folder.path(), &ends_early(22.0));
    let sampled = json(&sample(&file, "2", &[]), 0);
    assert_eq!(sampled["opp1_track_id"], 1);
    let runs = sampled["runs"].as_array().unwrap();
    assert_eq!((&runs[0]["name"], &runs[1]["name"]), (&"recorded".into(), &"step 0".into()));
    let reproduction = &sampled["reproduction"];
    assert!(reproduction["relative_error"].as_f64().unwrap() < 0.1, "{reproduction}");
    // Without a first value the steps start from the calibrated one.
    let cc1_s = reproduction["cc1_s"].as_f64().unwrap();
    assert!((runs[2]["value"].as_f64().unwrap() - cc1_s).abs() < 1e-9 && cc1_s > 0.5, "{sampled}");
    let smallest = |run: &Value| run["min_thw_opp1_s"].as_f64().unwrap();
    assert!(smallest(&runs[6]) < smallest(&runs[1]) - 0.2, "{sampled}");
    // The leader leaves the record before the crossing, and keeps its last speed.
    let file = recording(folder.path(), &ends_early(12.0));
    let remarks = json(&sample(&file, "2", &[]), 0)["remarks"].to_string();
    assert!(remarks.contains("track 1 is recorded until 12.0 s"), "{remarks}");
}

#[test]
fn a_lane_change_that_no_driver_reproduces_is_refused_with_the_error() {
    let folder = folder();
    // Without a reason ahead the vehicle brakes to a fifth of its speed and accelerates again, twice.
    let motion = |time_s: f64| [18.0 * time_s + 12.0 * maths::sin(1.1 * time_s), changing(time_s, 9.0, 0.0)];
    let file = recording(folder.path(), &[(1, [0.0, 20.0], &motion)]);
    let refused = sample(&file, "1", &["--from", "1.5"]);
    assert_eq!(code(&refused), 3);
    let message = message(&refused);
    for words in ["no driver reproduces the recording", "% of the gap (at most 29 %)", "9 calibrated parameters"] {
        assert!(message.contains(words), "{message}");
    }
}

#[test]
fn vehicles_that_would_collide_after_the_end_of_their_records_do_not_end_the_run() {
    let folder = folder();
    let changer = |time_s: f64| [22.0 * time_s, changing(time_s, 9.0, 0.0)];
    // Both are recorded for 2 s; at its last speed, the rear one would reach the front one at 4.2 s.
    let rear = |time_s: f64| [60.0 + 26.0 * time_s, 0.5 * LANE_M];
    let front = |time_s: f64| [90.0 + 20.0 * time_s, 0.5 * LANE_M];
    let file = recording(folder.path(), &[(1, [0.0, 20.0], &changer), (3, [0.0, 2.0], &rear), (4, [0.0, 2.0], &front)]);
    let out = folder.path().join("out");
    let sampled = json(&sample(&file, "1", &["--from", "1.5", "-o", out.to_str().unwrap()]), 0);
    assert!(sampled["runs"][1]["crossing_s"].as_f64().unwrap() > 9.0, "{sampled}");
    let step = fs::read_to_string(out.join("step-0.toml")).unwrap();
    assert_ne!(step.contains("\"track-3\""), step.contains("\"track-4\""), "{step}");
}

#[test]
fn a_short_record_before_the_lane_change_is_refused_and_a_second_lane_change_is_sampled() {
    let folder = folder();
    let short = |time_s: f64| [22.0 * time_s, changing(time_s, 9.0, 0.0)];
    let file = recording(folder.path(), &[(1, [10.0, 20.0], &short)]);
    let message = message(&sample(&file, "1", &[]));
    assert!(message.contains("before it crosses the marking; 2.0 s are needed, or a record that begins"), "{message}");
    // A quick lane change that is recorded from its start on, 1.8 s before the crossing.
    let quick = |time_s: f64| [22.0 * time_s, changing(9.0 + (time_s - 9.0) * 4.0 / 2.6, 9.0, 0.0)];
    let file = recording(folder.path(), &[(1, [8.5, 20.0], &quick)]);
    assert!(json(&sample(&file, "1", &[]), 0)["runs"][1]["crossing_s"].is_f64());
    // Two lane changes, the second one directly after the first one.
    let twice = |time_s: f64| [22.0 * time_s, changing(time_s, 6.0, 0.0) + changing(time_s, 10.5, 0.0) - 0.5 * LANE_M];
    let file = recording(folder.path(), &[(1, [0.0, 20.0], &twice)]);
    for (number, crossing_s) in [("1", 8.0), ("2", 12.5)] {
        let sampled = json(&sample(&file, "1", &["--number", number]), 0);
        let crossed_s = sampled["runs"][0]["crossing_s"].as_f64().unwrap();
        assert!((crossed_s - crossing_s).abs() < 0.3, "{number}: {crossed_s}");
    }
}

/// Number of lane changes of two windows of US-101 that are sampled, of 27.
const SAMPLED_OF_US101: usize = 19;

/// The lane changes of the US-101 windows. Each is sampled or refused for a reason that is named.
#[test]
fn most_recorded_lane_changes_are_sampled_and_the_rest_is_refused_for_a_reason() {
    let Some(data) = data() else { return };
    let (mut sampled, mut refused) = (0, Vec::new());
    for window in ["a", "h"] {
        let file = data.join(format!("ngsim_us101/trajectories/us101_{window}.csv"));
        let lane_changes = json(&closecall(["traffic", "lane-changes", file.to_str().unwrap(), "--format", "json"]), 0);
        let mut numbers = std::collections::BTreeMap::new();
        for change in lane_changes.as_array().unwrap_or(&Vec::new()) {
            let track = change["track_id"].as_u64().unwrap();
            let number = numbers.entry(track).and_modify(|number| *number += 1).or_insert(1_u32);
            let output = sample(&file, &track.to_string(), &["--number", &number.to_string(), "--steps", "2"]);
            match code(&output) {
                0 => sampled += 1,
                _ => refused.push(message(&output)),
            }
        }
    }
    let is_reason = |message: &String| {
        ["2.0 s are needed", "no driver reproduces the recording"].iter().any(|words| message.contains(words))
    };
    assert!(refused.iter().all(is_reason), "{refused:#?}");
    assert!(sampled >= SAMPLED_OF_US101, "{sampled}: {refused:#?}");
}
