//! Sensitivity studies and frontiers: their results, a campaign's statements about them, and their
//! ends.

use std::fs;
use std::process::Stdio;
use std::time::Duration;

use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

use crate::support::{closecall, code, folder, json, json_file, message, program, stdout};

/// Fixes all parameters of the headline but four: few runs decide.
const FIXED: [&str; 16] = [
    "--set",
    "cruise-mps=31.6",
    "--set",
    "front-thw-s=0.75",
    "--set",
    "cut-out-thw-s=0.3",
    "--set",
    "lane-change-duration-s=4.8",
    "--set",
    "hardest-braking-mps2=6.7",
    "--set",
    "rear-class=car",
    "--set",
    "closing-mps=8.4",
    "--set",
    "brake-mps2=6",
];

fn study<'a>(more: &[&'a str]) -> Vec<&'a str> {
    let fixed = ["study", "sensitivity", "low-thw-overtake", "--sensors", "object", "--seed", "5", "--format", "json"];
    [&fixed[..], &FIXED[..], more].concat()
}

/// The share of prevented collisions in a campaign with one more setting.
fn prevented(setting: &str) -> f64 {
    let fixed = ["campaign", "low-thw-overtake", "-n", "400", "--seed", "6", "--paired", "--no-gate"];
    let more = ["--sensors", "object", "--format", "json", "--set", "reaction-s=1.25", "--set", setting];
    let output = closecall([&fixed[..], &FIXED[..], &more].concat());
    json(&output, 0)["paired"]["prevented"].as_f64().unwrap() / 400.0
}

#[test]
fn a_campaign_with_the_greatest_assumption_moved_confirms_it() {
    let more = ["--no-default-factors", "--method", "sobol", "-n", "256", "--set", "reaction-s=1.25"];
    let study_json = json(&closecall(study(&more)), 0);
    let greatest = study_json["greatest"].as_str().unwrap();
    let of_prevented = &study_json["decomposition"]["outputs"][0];
    assert_eq!(of_prevented["output"], "prevented");
    let effect = &of_prevented["main_effects"][0];
    assert_eq!(effect["factor"], greatest);
    // The three parameters that vary are uniform: the middles of the quarters in which the least
    // and the most are prevented.
    let factor = study_json["factors"].as_array().unwrap().iter().find(|factor| factor["name"] == greatest).unwrap();
    let [low, high] = [0, 1].map(|end| factor["range"][end].as_f64().unwrap());
    let means: Vec<f64> =
        effect["quarter_means"].as_array().unwrap().iter().map(|mean| mean.as_f64().unwrap()).collect();
    let mut quarters: Vec<usize> = (0..4).collect();
    quarters.sort_by(|a, b| means[*a].total_cmp(&means[*b]));
    let middle = |quarter: usize| low + (quarter as f64 + 0.5) / 4.0 * (high - low);
    let [least, most] = [quarters[0], quarters[3]].map(|quarter| prevented(&format!("{greatest}={}", middle(quarter))));
    let (said, moved) = (means[quarters[3]] - means[quarters[0]], most - least);
    assert!(moved > 0.5 * said && said > 0.05, "{greatest}: moved by {moved}, {said} expected");
}

#[test]
fn the_example_of_the_help_that_varies_a_value_of_the_scenario_runs() {
    let help = stdout(&closecall(["study", "sensitivity", "--help"]), 0);
    let example = help.lines().find(|line| line.trim_start().starts_with("closecall ") && line.contains("--factor"));
    let words = shlex::split(example.unwrap()).unwrap();
    let few = ["--trajectories", "1", "-n", "1", "--sensors", "object", "--format", "json"].map(str::to_owned);
    let study_json = json(&closecall(words.into_iter().skip(1).chain(few)), 0);
    let factors = study_json["factors"].as_array().unwrap();
    assert!(factors.iter().any(|factor| factor["name"] == "environment.friction"), "{factors:?}");
}

#[test]
fn a_study_is_the_same_on_any_number_of_threads_and_its_stages_agree() {
    let folder = folder();
    let out = folder.path().join("out");
    let with = |jobs, more: &[&str]| {
        let args = ["--no-default-factors", "--trajectories", "8", "-n", "32", "--top", "2", "--jobs", jobs];
        json(&closecall(study(&[&args[..], more].concat())), 0)
    };
    let study_json = with("2", &["--out", out.to_str().unwrap()]);
    assert_eq!(study_json, with("1", &[]));
    // Screening keeps two factors and chance apart; the others are one group.
    let indices = study_json["decomposition"]["outputs"][0]["indices"].as_array().unwrap();
    let mut sizes: Vec<usize> = indices.iter().map(|index| index["factors"].as_array().unwrap().len()).collect();
    sizes.sort_unstable();
    assert_eq!(sizes, [1, 1, 1, 2]);
    assert_eq!(study_json["screening"]["points"], 8 * 6);
    let page = fs::read_to_string(out.join("sensitivity.html")).unwrap();
    assert!(page.contains("<svg") && !page.contains("<script") && !page.contains(" src="));
    assert!(fs::read_to_string(out.join("tornado-prevented.svg")).unwrap().contains("evasive-lateral-mps2"));
    let kept = json_file(&out.join("sensitivity.json"));
    assert_eq!(kept, study_json);
}

#[test]
fn the_list_of_factors_and_named_keys_are_varied_and_what_does_not_apply_is_said() {
    let key = "actor.rear.driver.overtaker.follow.wiedemann99.cc2-m";
    let more = ["--method", "morris", "--trajectories", "2", "--factor"];
    let named = format!("{key}=2..6");
    let study_json = json(&closecall(study(&[&more[..], &[&named]].concat())), 0);
    let factors = study_json["factors"].as_array().unwrap();
    let factor_named = |name: &str| factors.iter().find(|factor| factor["name"] == name);
    assert_eq!(factor_named(key).unwrap()["range"], serde_json::json!([2.0, 6.0]));
    assert_eq!(factor_named("actor.ego.driver.ego-stack.aeb.trigger-mps2").unwrap()["kind"], "controller");
    assert_eq!(factor_named("sensors.rear-object.latency-s").unwrap()["kind"], "sensor");
    assert_eq!(factors.last().unwrap()["name"], "chance");
    assert!(factor_named("cruise-mps").is_none(), "a parameter that --set has fixed does not vary");
    let left_out = study_json["left_out"].as_array().unwrap();
    assert!(
        left_out.iter().any(|factor| factor["reason"] == "the scenario samples it as `reaction-s`"),
        "{left_out:?}"
    );
}

#[test]
fn a_factor_that_cannot_be_used_is_refused_by_name() {
    for (factor, expected) in [
        ("nonsense", "is not of the form KEY=LOW..HIGH"),
        ("duration-s=5..1", "the second larger than the first"),
        ("actor.ego.driver.ego-stack.aeb.trigger-mps2=1..6", "aeb.trigger-mps2=1..6 cannot be used"),
        ("actor.raer.driver.overtaker.reaction-s=1..2", "did you mean `rear`?"),
        ("road.lanes=2..4", "road.lanes=2..4 cannot be used"),
    ] {
        let output = closecall(study(&["--method", "morris", "--factor", factor]));
        assert_eq!(code(&output), 2, "{factor}");
        assert!(message(&output).contains(expected), "{factor}: {}", message(&output));
    }
    let twice = ["--factor", "duration-s=50..60", "--factor", "duration-s=40..60"];
    assert!(message(&closecall(study(&twice))).contains("duration-s is given twice"));
    let undone = closecall(study(&["--factor", "closing-mps=3..9"]));
    assert_eq!(code(&undone), 2);
    assert!(message(&undone).contains("--set closing-mps=8.4 fixes"), "{}", message(&undone));
    let vary = ["study", "frontier", "low-thw-overtake", "--vary", "brake-mps2=5,6", "--set", "brake-mps2=6"];
    let undone = closecall(vary);
    assert_eq!(code(&undone), 2);
    assert!(message(&undone).contains("--vary brake-mps2 gives values to a key"), "{}", message(&undone));
    let refused =
        closecall(["study", "frontier", "low-thw-overtake", "--vary", "actor.ego.driver.ego-stack.mis.hold-s=1,99"]);
    assert_eq!(code(&refused), 3);
    assert!(message(&refused).contains("hold-s"), "{}", message(&refused));
    assert_eq!(code(&closecall(["study", "frontier", "low-thw-overtake", "--controller", "acc"])), 2);
}

#[test]
fn runs_that_end_in_an_error_are_counted_and_have_no_result() {
    let more = ["--no-default-factors", "--method", "sobol", "-n", "32", "--controller", "exec:false"];
    let study_json = json(&closecall(study(&more)), 5);
    assert_eq!(study_json["errors"]["count"], study_json["decomposition"]["points"]);
    assert_eq!(study_json["errors"]["kinds"][0]["kind"], "controller");
    assert_eq!(study_json["greatest"], Value::Null);
    assert_eq!(study_json["decomposition"]["outputs"][0]["mean"], Value::Null);
    let text: Vec<&str> = study(&more).into_iter().filter(|word| !["--format", "json"].contains(word)).collect();
    let text = stdout(&closecall(text), 5);
    assert!(text.contains("ended in an ERROR") && text.contains("No assumption was seen"), "{text}");
    let frontier =
        ["study", "frontier", "low-thw-overtake", "-n", "3", "--controller", "exec:false", "--format", "json"];
    let vary = ["--vary", "actor.ego.driver.ego-stack.mis.hold-s=1,2"];
    let study_json = json(&closecall([&frontier[..], &vary].concat()), 5);
    assert_eq!(study_json["errors"]["count"], 6);
    assert!(study_json["points"].as_array().unwrap().iter().all(|point| point["optimal"] == false));
}

#[test]
fn a_signal_ends_a_study_without_a_result() {
    let folder = folder();
    let out = folder.path().join("out");
    let mut command = program();
    // Without the list of factors there is nothing to check first, and the runs begin at once.
    let args = ["study", "sensitivity", "low-thw-overtake", "--no-default-factors", "--method", "sobol", "-n", "16384"];
    command.args(args).args(["--out", out.to_str().unwrap()]);
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    std::thread::sleep(Duration::from_secs(5));
    kill_process(Pid::from_child(&child), Signal::INT).unwrap();
    let output = child.wait_with_output().unwrap();
    let text = stdout(&output, 130);
    assert!(text.contains("ENDED EARLY") && !text.contains("The assumption"), "{text}");
    assert!(!out.exists());
}

#[test]
fn a_frontier_runs_every_combination_on_the_same_samples() {
    let folder = folder();
    let out = folder.path().join("out");
    let mis = "actor.ego.driver.ego-stack.mis";
    let vary = [format!("{mis}.max-deceleration-mps2=1.0,2.0"), format!("{mis}.engage-gap-m=100,150")];
    let same = ["-n", "60", "--seed", "3", "--sensors", "object", "--format", "json"];
    let more = [&same[..], &["--out", out.to_str().unwrap()]].concat();
    let frontier = json(
        &closecall(
            [&["study", "frontier", "low-thw-overtake", "--vary", &vary[0], "--vary", &vary[1]], &more[..]].concat(),
        ),
        0,
    );
    let points = frontier["points"].as_array().unwrap();
    assert_eq!(points.len(), 4);
    assert!(points.iter().all(|point| point["collisions_without"] == points[0]["collisions_without"]));
    assert!(points.iter().any(|point| point["optimal"] == true));
    // A campaign with the settings of one combination has its figures.
    let settings = ["--set", &format!("{mis}.max-deceleration-mps2=2.0"), "--set", &format!("{mis}.engage-gap-m=150")];
    let args = ["campaign", "low-thw-overtake", "--paired", "--no-gate"];
    let campaign = json(&closecall([&args[..], &same, &settings].concat()), 0);
    for key in ["prevented", "induced", "prevented_harm", "induced_harm"] {
        assert_eq!(campaign["paired"][key], points[3][key], "{key}");
    }
    assert_eq!(campaign["controllers"]["acc"]["collisions"], points[3]["collisions_without"]);
    assert!(fs::read_to_string(out.join("frontier.html")).unwrap().contains("Pareto-optimal"));
    assert!(out.join("frontier-induced.svg").is_file() && out.join("frontier-speed.svg").is_file());
}

#[test]
fn every_report_of_a_campaign_says_what_moves_its_result_or_that_it_cannot() {
    let folder = folder();
    let out = folder.path().join("out");
    let path = out.to_str().unwrap();
    let args = ["campaign", "low-thw-overtake", "-n", "400", "--seed", "8", "--paired", "--no-gate", "--out", path];
    let more = ["--sensors", "object", "--record", "failures:0", "--format", "json"];
    let result = json(&closecall([&args[..], &more].concat()), 0);
    let events = result["influence"]["low-thw-overtake"]["events"].as_array().unwrap();
    let event_named = |name: &str| events.iter().find(|event| event["event"] == name).unwrap();
    let without = event_named("collided_without")["parameters"].as_array().unwrap();
    assert_eq!(without[0]["parameter"], "evasive-lateral-mps2", "{without:?}");
    assert_eq!(event_named("collided_without")["events"], result["controllers"]["acc"]["collisions"]);
    assert!(without[0]["interval_95"][0].as_f64().unwrap() > 0.0);
    assert_eq!(event_named("induced")["parameters"], Value::Null);
    assert!(event_named("induced")["parameters_absent"].as_str().unwrap().contains("too few"));
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    let summary = fs::read_to_string(out.join("summary.md")).unwrap();
    for text in [&page, &summary] {
        assert!(text.contains("What moves the result") && text.contains("evasive-lateral-mps2"));
        assert!(text.contains("too few samples with or without it to say"));
    }
    let grid = ["campaign", "low-thw-overtake", "-n", "4", "--design", "grid", "--no-gate", "--format", "json"];
    let grid = json(&closecall(grid), 0);
    assert!(grid["influence"]["low-thw-overtake"]["events_absent"].as_str().unwrap().contains("grid"));
}
