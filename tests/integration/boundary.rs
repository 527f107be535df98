//! `closecall study boundary`: the boundary of failing and passing along two parameters.

use std::fs;

use serde_json::Value;

use crate::support::{closecall, code, folder, json, message, stdout};

/// Fixes all parameters of the headline but two, so that a run with both set is a run of the study.
const FIXED: [&str; 22] = [
    "--sensors",
    "object",
    "--set",
    "cruise-mps=31.6",
    "--set",
    "front-thw-s=0.75",
    "--set",
    "rear-cc1-s=0.02",
    "--set",
    "lane-change-duration-s=4.8",
    "--set",
    "hardest-braking-mps2=6.7",
    "--set",
    "rear-class=car",
    "--set",
    "reaction-s=1.25",
    "--set",
    "brake-mps2=6",
    "--set",
    "evasive-lateral-mps2=2",
    "--set",
    "brake-phase=0.3",
];

/// The smallest gap of the rear vehicle falls with its closing speed.
const GAP: [&str; 9] = [
    "study",
    "boundary",
    "low-thw-overtake",
    "--along",
    "cut-out-thw-s",
    "closing-mps=3..7",
    "--event",
    "min_gap_rear_m < 6",
    "--controller=acc",
];

fn study<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&GAP[..], &FIXED[..], &["-n", "30"], more].concat()
}

/// The smallest gap in a run at these values (m).
fn gap_m(cut_out_thw_s: f64, closing_mps: f64) -> f64 {
    let values = [format!("cut-out-thw-s={cut_out_thw_s:?}"), format!("closing-mps={closing_mps:?}")];
    let run = ["run", "low-thw-overtake", "--controller", "acc", "--sample", "0", "--format", "json"];
    let set = ["--set", &values[0], "--set", &values[1]];
    let output = closecall([&run[..], &FIXED[..], &set].concat());
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    json["margins"]["min_gap_rear_m"].as_f64().unwrap()
}

#[test]
fn the_event_happens_beyond_the_band_of_the_boundary_and_not_before_it() {
    let result = json(&closecall(study(&["--format", "json"])), 0);
    assert_eq!(result["conclusive"], true);
    let slice = &result["surface"]["slices"][10];
    let crossings = slice["crossings"].as_array().unwrap();
    assert_eq!(crossings.len(), 1, "{slice}");
    let [low, high] = [0, 1].map(|end| crossings[0]["interval_95"][end].as_f64().unwrap());
    let second = crossings[0]["second"].as_f64().unwrap();
    assert!(3.0 < low && low <= second && second <= high && high < 7.0 && high - low < 1.0, "{slice}");
    let first = slice["first"].as_f64().unwrap();
    let (before, beyond) = (gap_m(first, low - 0.3), gap_m(first, high + 0.3));
    assert!(before > 6.0 && beyond < 6.0, "{before} m, {beyond} m at {slice}");
    let runs = result["runs"].as_array().unwrap();
    assert_eq!(runs.len(), 30);
    assert_eq!(runs.iter().filter(|run| run["start"] == true).count(), 20);
    // A run of the study is a run of the program.
    let at = |axis: usize| runs[25]["at"][axis].as_f64().unwrap();
    assert_eq!(runs[25]["value"].as_f64().unwrap(), gap_m(at(0), at(1)));
    assert_eq!(runs[25]["event"], runs[25]["value"].as_f64().unwrap() < 6.0);
}

#[test]
fn a_boundary_is_the_same_on_any_number_of_threads_and_its_files_have_its_figures() {
    let folder = folder();
    let out = folder.path().join("out");
    let two = json(&closecall(study(&["--format", "json", "--jobs", "2", "--out", out.to_str().unwrap()])), 0);
    assert_eq!(two, json(&closecall(study(&["--format", "json", "--jobs", "1"])), 0));
    let kept: Value = serde_json::from_str(&fs::read_to_string(out.join("boundary.json")).unwrap()).unwrap();
    assert_eq!(kept, two);
    let page = fs::read_to_string(out.join("boundary.html")).unwrap();
    assert!(page.contains("<svg") && page.contains("min_gap_rear_m &lt; 6") && !page.contains("<script"));
    assert!(fs::read_to_string(out.join("boundary-map.svg")).unwrap().contains("closing [m/s]"));
    let text = stdout(&closecall(study(&[])), 0);
    let left_out = "they leave out the scatter of single runs about it, ±";
    for expected in
        ["boundary in closing-mps (95 %)", "area: the event happens in", "have the predicted sign", left_out]
    {
        assert!(text.contains(expected), "{expected}: {text}");
    }
    assert!(!text.contains("INCONCLUSIVE"), "{text}");
}

#[test]
fn an_event_that_no_run_reaches_has_no_crossing() {
    let mut args = study(&["--format", "json"]);
    let event = args.iter_mut().find(|word| **word == "min_gap_rear_m < 6").unwrap();
    *event = "duration_s < 1";
    let output = closecall(&args);
    let result: Value = serde_json::from_slice(&output.stdout).unwrap();
    // The runs may all have the same duration: then there is no surface, and the command says so.
    match result["surface"].as_object() {
        Some(surface) => {
            let slices = surface["slices"].as_array().unwrap();
            assert!(slices.iter().all(|slice| slice["crossings"].as_array().unwrap().is_empty()));
            assert!(slices.iter().all(|slice| slice["fails"] == false));
        }
        None => {
            assert_eq!(code(&output), 4);
            assert!(result["surface_absent"].as_str().unwrap().contains("the same value in all runs"));
        }
    }
}

#[test]
fn a_number_that_is_0_without_a_collision_is_no_distance_and_the_command_says_so() {
    // The impact speed is 0 in all runs that the ego does not strike.
    let mut args = study(&[]);
    let event = args.iter_mut().find(|word| **word == "min_gap_rear_m < 6").unwrap();
    *event = "impact_speed_mps > 30";
    let text = stdout(&closecall(&args), 4);
    assert!(text.contains("INCONCLUSIVE: there is no surface"), "{text}");
}

#[test]
fn a_number_that_many_runs_do_not_have_is_no_ground_for_a_boundary() {
    // In a short run the rear vehicle does not cross, and the ego does not brake at its crossing. The
    // surface of the other runs is smooth, and says that the event happens everywhere.
    let along =
        ["study", "boundary", "low-thw-overtake", "--along", "duration-s=3..30", "closing-mps=3..9", "-n", "30"];
    let event = ["--event", "crossing_braking_mps2 > 1", "--sensors", "object"];
    let text = stdout(&closecall([&along[..], &event].concat()), 4);
    assert!(text.contains("INCONCLUSIVE: ") && text.contains("of 30 runs have no value"), "{text}");
    let result = json(&closecall([&along[..], &event, &["--format", "json"]].concat()), 4);
    assert_eq!(result["conclusive"], false);
    assert!(result["surface"]["noise_sd"].as_f64().unwrap() >= 0.0, "{result}");
}

#[test]
fn what_has_no_boundary_is_refused() {
    let refused = |along: &[&str], event: &str, more: &[&str]| {
        let start = ["study", "boundary", "low-thw-overtake", "--along"];
        let output = closecall([&start[..], along, &["--event", event], more].concat());
        assert_eq!(code(&output), 2, "{along:?} {event}: {}", message(&output));
        message(&output)
    };
    let (both, near) = (["closing-mps", "reaction-s=0.6..2"], "min_gap_rear_m < 2");
    for (said, expected) in [
        (refused(&both, "collision", &[]), "happens or does not"),
        (refused(&both, "induced", &[]), "happens or does not"),
        (refused(&both, "prevented - induced", &[]), "a difference of two events"),
        (refused(&both, near, &["-n", "29"]), "is not a whole number from 30 to 200"),
        (refused(&both, near, &["-n", "201"]), "is not a whole number from 30 to 200"),
        (refused(&["closing-mps"], near, &[]), "needs two parameters, and one is given"),
        (refused(&["closing-mps", "closing-mps"], near, &[]), "is given twice"),
        (refused(&["closing-mps", "closing"], near, &[]), "`closing` needs a range"),
        (refused(&["closing-mps", "rear-class"], near, &[]), "`rear-class` needs a range"),
        (refused(&["closing-mps", "road.lanes=2..4"], near, &[]), "road.lanes=2.0 cannot be used"),
        (refused(&["closing-mps", "reaction-s=2..1"], near, &[]), "the second larger than the first"),
        (refused(&["closing-mps", "actor.raer.start.behind.gap-m=90..120"], near, &[]), "did you mean `rear`?"),
        (refused(&both, "baseline.min_gap_rear_m < 2", &["--controller", "acc"]), "needs a baseline"),
        (
            refused(&both, near, &["--set", "reaction-s=1"]),
            "--along reaction-s gives values to a key that --set reaction-s=1 fixes",
        ),
        (refused(&both, near, &["--set", "closing-mps=4"]), "--set closing-mps=4 fixes"),
    ] {
        assert!(said.contains(expected), "{expected}: {said}");
    }
}

#[test]
fn runs_that_end_in_an_error_have_no_value() {
    let start = ["study", "boundary", "low-thw-overtake", "--along", "closing-mps=3..9", "cut-out-thw-s", "-n", "30"];
    let more = ["--event", "min_gap_rear_m < 2", "--controller", "exec:false", "--format", "json"];
    let result = json(&closecall([&start[..], &more].concat()), 5);
    assert_eq!(result["errors"]["count"], 30);
    assert_eq!((&result["surface"], &result["conclusive"]), (&Value::Null, &Value::Bool(false)));
    assert_eq!(result["surface_absent"], "0 runs have a value of `min_gap_rear_m`; 10 are required");
}
