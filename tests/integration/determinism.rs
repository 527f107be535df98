//! The same scenario, seed and binary give the same bits: with one thread or two, again, alone or in a campaign.

use std::path::Path;

use closecall_campaign::folder::Folder;
use serde_json::Value;

use crate::support::{closecall, folder, json, library, stdout};

fn campaign(out: &Path, jobs: &str) {
    let out = out.to_str().unwrap();
    let scenario = library("low-thw-overtake");
    let args =
        ["campaign", scenario.to_str().unwrap(), "-n", "60", "--seed", "7", "--paired", "--jobs", jobs, "--out", out];
    stdout(&closecall(args), 0);
}

#[test]
fn outcomes_are_the_same_bytes_with_any_number_of_jobs_and_again() {
    let folders = [folder(), folder(), folder()];
    for (folder, jobs) in folders.iter().zip(["1", "2", "2"]) {
        campaign(&folder.path().join("out"), jobs);
    }
    for file in ["outcomes.parquet", "journal.jsonl", "junit.xml"] {
        let bytes = |place: usize| std::fs::read(folders[place].path().join("out").join(file)).unwrap();
        assert!(!bytes(0).is_empty(), "{file}");
        assert!(bytes(0) == bytes(1), "{file} differs between one job and two");
        assert!(bytes(1) == bytes(2), "{file} differs between two runs");
    }
}

#[test]
fn a_replay_gives_the_journal_s_outcome_to_the_last_bit() {
    let folder = folder();
    let out = folder.path().join("out");
    campaign(&out, "2");
    let records: Vec<_> = Folder::open(&out).records().unwrap().map(|record| record.unwrap()).collect();
    for sample in [0, 17, 59] {
        for arm in &records[sample].arms {
            let number = sample.to_string();
            let args = ["replay", out.to_str().unwrap(), &number, "--controller", &arm.controller, "--format", "json"];
            let replayed = json(&closecall(args), 0);
            let outcome = arm.result.as_ref().unwrap();
            // JSON floats are written so that they read back exactly.
            let margin = outcome.margins.min_thw_front_s.unwrap();
            assert_eq!(replayed["margins"]["min_thw_front_s"].as_f64().unwrap().to_bits(), margin.to_bits());
            let jerk = outcome.margins.max_jerk_mps3;
            assert_eq!(replayed["margins"]["max_jerk_mps3"].as_f64().unwrap().to_bits(), jerk.to_bits());
            assert_eq!(replayed["duration_s"].as_f64().unwrap().to_bits(), outcome.duration.s().to_bits());
            assert_eq!(replayed["collisions"].as_array().map(Vec::len), Some(outcome.collisions.len()));
        }
    }
}

#[test]
fn a_single_run_is_the_campaign_s_sample() {
    let folder = folder();
    let out = folder.path().join("out");
    campaign(&out, "2");
    let replayed = json(&closecall(["replay", out.to_str().unwrap(), "5", "--format", "json"]), 0);
    let scenario = library("low-thw-overtake");
    let args = ["run", scenario.to_str().unwrap(), "--seed", "7", "--sample", "5", "--format", "json"];
    assert_eq!(json(&closecall(args), 0), replayed);
}

#[test]
fn a_sample_does_not_depend_on_how_many_there_are() {
    let scenario = library("low-thw-overtake");
    let run = |seed: &str| -> Value {
        let args = ["run", scenario.to_str().unwrap(), "--seed", seed, "--sample", "3", "--format", "json"];
        json(&closecall(args), 0)
    };
    assert_eq!(run("1"), run("1"));
    assert_ne!(run("1")["parameters"], run("0")["parameters"], "0 is a seed like any other");
}
