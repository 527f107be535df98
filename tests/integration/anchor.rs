//! `closecall study anchor`: emergency braking under human drivers, held against crash records; and the arms in which a human drives.

use serde_json::Value;

use crate::support::{closecall, code, folder, json, library, message, stdout};

/// A small study in which most egos strike, and are struck, without emergency braking.
fn study(more: &[&str]) -> Vec<String> {
    let small = ["study", "anchor", "-n", "16", "--seed", "5", "--ensemble", "glances", "steer-none"];
    let close = ["--set", "brake-mps2=7", "--set", "ego-cc1-s=0.4", "--set", "rear-cc1-s=0.2"];
    small.iter().chain(&close).chain(more).map(|word| (*word).to_owned()).collect()
}

#[test]
fn the_study_counts_both_outcomes_and_compares_them_with_what_was_published() {
    let folder = folder();
    let out = folder.path().join("anchor");
    let result = json(&closecall(study(&["--format", "json", "--out", out.to_str().unwrap()])), 0);
    let names: Vec<&str> =
        result["members"].as_array().unwrap().iter().map(|row| row["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["the scenario's own drivers", "glances"]);
    assert_eq!(result["without_effect"][0], "steer-none");
    assert_eq!(result["variations"].as_array().unwrap().len(), 10);
    assert_eq!(result["controllers"], serde_json::json!(["human-aeb", "human+aeb"]));
    for row in result["members"].as_array().unwrap().iter().chain(result["variations"].as_array().unwrap()) {
        assert_eq!(row["samples"], 16, "{row}");
        for outcome in ["striking", "struck"] {
            let count = |key: &str| row[outcome][key].as_u64().unwrap();
            assert!(count("both") <= count("without").min(count("with")), "{row}");
        }
        // Earlier or harder braking strikes no more often.
        assert!(row["striking"]["with"].as_u64() <= row["striking"]["without"].as_u64(), "{row}");
    }
    for (outcome, published) in [("striking", 0.5), ("struck", 1.2)] {
        assert_eq!(result["conclusions"][outcome]["published_ratio"], published);
    }
    for name in ["anchor.html", "anchor.json", "anchor-ratios.svg"] {
        assert!(out.join(name).exists(), "{name}");
    }
    let text = stdout(&closecall(study(&[])), 0);
    assert!(
        text.contains("striking: published 0.50, ensemble") && text.contains("struck from behind: published 1.20"),
        "{text}"
    );
}

#[test]
fn the_study_repeats_to_the_last_figure_on_any_number_of_threads() {
    let of = |jobs: &str| stdout(&closecall(study(&["--jobs", jobs])), 0);
    assert_eq!(of("1"), of("2"));
}

#[test]
fn wrong_arguments_of_the_study_are_named() {
    for (more, exit, part) in [
        (&["--ensemble", "no-such-member"][..], 2, "no-such-member"),
        (&["--set", "no-such-value=1"], 2, "no-such-value"),
        (&["--set", "rear-cc1-s=-1"], 3, "cc1-s"),
        (&["-n", "0"], 2, "1 or more"),
    ] {
        let output = closecall(["study", "anchor"].iter().chain(more));
        assert_eq!(code(&output), exit, "{more:?}: {}", message(&output));
        assert!(message(&output).contains(part), "{more:?}: {}", message(&output));
    }
}

#[test]
fn a_human_drives_only_an_ego_that_has_one() {
    let output = closecall([
        "campaign",
        library("aeb/aeb-lead-brakes").to_str().unwrap(),
        "-n",
        "2",
        "--arms",
        "human-aeb,human+aeb",
    ]);
    assert_eq!(code(&output), 3, "{}", message(&output));
    assert!(message(&output).contains("needs a human driver of the ego"), "{}", message(&output));
    let anchor = library("anchor/anchor-lead-brakes");
    let anchor = anchor.to_str().unwrap();
    let output = closecall(["campaign", anchor, "-n", "2", "--controller", "human+aeb+mis"]);
    assert_eq!(code(&output), 2, "{}", message(&output));
    assert!(message(&output).contains("unless a human drives"), "{}", message(&output));
    let run = |controller: &str| json(&closecall(["run", anchor, "--controller", controller, "--format", "json"]), 0);
    let wrong = closecall(["check", anchor, "--set", "actor.ego.driver.ego-stack.human.wiedemann99.cc1-s=-1"]);
    assert_eq!(code(&wrong), 3, "{}", message(&wrong));
    assert!(message(&wrong).contains("human.wiedemann99.cc1-s"), "{}", message(&wrong));
    // The scenario has emergency braking, so that `human` has it, too.
    let outcome = |controller: &str| -> Value {
        let mut outcome = run(controller);
        outcome.as_object_mut().unwrap().remove("controller");
        outcome["collisions"].clone()
    };
    assert_eq!(outcome("human"), outcome("human+aeb"));
}

/// The ego's driver and the follower are the same driver, one place further back: without emergency braking, an ego whose driver reacts
/// at once and keeps its distance strikes nobody, and one that reacts after 2.5 s at 0.5 s does.
#[test]
fn the_driver_of_the_ego_drives_by_its_own_settings() {
    let anchor = library("anchor/anchor-lead-brakes");
    let collisions = |more: &[&str]| {
        let args = [
            "campaign",
            anchor.to_str().unwrap(),
            "-n",
            "20",
            "--controller",
            "human-aeb",
            "--no-gate",
            "--format",
            "json",
        ];
        let fixed = [
            "--set",
            "following-mps=14",
            "--set",
            "rear-cc1-s=2.6",
            "--set",
            "rear-reaction-s=0.5",
            "--set",
            "brake-mps2=5",
        ];
        let report = json(&closecall(args.iter().chain(&fixed).chain(more)), 0);
        report["controllers"]["human-aeb"]["collisions"].as_u64().unwrap()
    };
    assert_eq!(collisions(&["--set", "ego-cc1-s=2.0", "--set", "ego-reaction-s=0.5"]), 0);
    assert_eq!(collisions(&["--set", "ego-cc1-s=0.5", "--set", "ego-reaction-s=2.5"]), 20);
}
