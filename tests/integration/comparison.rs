//! `compare` compares one campaign with an earlier one.

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::native_controllers::{compile, lib};
use crate::support::{ROOT, closecall, code, folder, json, library, message, records, stderr, stdout};

fn campaign(out: PathBuf, more: &[&str]) -> PathBuf {
    let scenario = library("low-thw-overtake");
    let args = ["campaign", scenario.to_str().unwrap(), "--seed", "1", "--recordings", "0", "--no-gate"];
    stdout(&closecall(args.iter().chain(&["--out", out.to_str().unwrap()]).chain(more)), 0);
    out
}

fn compare(baseline: &Path, other: &Path, more: &[&str]) -> std::process::Output {
    let folders = ["compare", baseline.to_str().unwrap(), other.to_str().unwrap()];
    closecall(folders.iter().chain(more))
}

/// Returns the samples of a campaign's journal in which vehicles collided.
fn failing(folder: &Path) -> Vec<u64> {
    let collided = |record: &closecall_campaign::record::Record| {
        record.arms.last().unwrap().result.as_ref().unwrap().any_collided()
    };
    records(folder).into_iter().filter(collided).map(|record| record.sample).collect()
}

#[test]
fn compare_names_newly_failing_and_fixed_samples() {
    let folder = folder();
    let with = campaign(folder.path().join("mis"), &["-n", "80"]);
    let without = campaign(folder.path().join("acc"), &["-n", "80", "--controller", "acc"]);
    let (good, bad) = (failing(&with), failing(&without));
    let newly: Vec<u64> = bad.iter().copied().filter(|sample| !good.contains(sample)).collect();
    let fixed: Vec<u64> = good.iter().copied().filter(|sample| !bad.contains(sample)).collect();
    assert!(newly.len() > 5, "{newly:?}");
    let changes = &json(&compare(&with, &without, &["--format", "json"]), 1)["scenarios"]["low-thw-overtake"];
    let list =
        |value: &Value| value.as_array().unwrap().iter().map(|value| value.as_u64().unwrap()).collect::<Vec<_>>();
    assert_eq!((list(&changes["newly_failing"]), list(&changes["fixed"])), (newly.clone(), fixed.clone()));
    assert_eq!(changes["samples"], 80);
    // Without the MIS the ego has less headway.
    let margin = &changes["margins"]["min_thw_front_s"];
    assert!(margin["worst_change"].as_f64().unwrap() < 0.0);
    let text = stdout(&compare(&with, &without, &[]), 1);
    assert!(text.contains("REGRESSION") && text.contains("arms"), "{text}");
    assert!(text.contains(&format!("{} newly failing: {}", newly.len(), newly[0])), "{text}");
    let allowed = newly.len().to_string();
    stdout(&compare(&with, &without, &["--max-newly-failing", &allowed, "--tolerance", "1"]), 0);
    // With the folders exchanged, the fixed samples are the newly failing ones.
    let back = json(&compare(&without, &with, &["--format", "json", "--tolerance", "1"]), i32::from(!fixed.is_empty()));
    assert_eq!(list(&back["scenarios"]["low-thw-overtake"]["newly_failing"]), fixed);
}

#[test]
fn a_campaign_is_no_regression_against_itself() {
    let folder = folder();
    let results = campaign(folder.path().join("one"), &["-n", "30"]);
    let comparison = json(&compare(&results, &results, &["--format", "json"]), 0);
    let scenario = &comparison["scenarios"]["low-thw-overtake"];
    assert_eq!((&scenario["same"], &scenario["samples"]), (&Value::from(30), &Value::from(30)));
    assert_eq!(comparison["differences"].as_array().map(Vec::len), Some(0));
}

#[test]
fn a_margin_that_shrinks_is_a_regression_even_without_a_collision() {
    let folder = folder();
    let scenario = library("overtake-without-brake");
    let args = ["campaign", scenario.to_str().unwrap(), "--seed", "1", "-n", "20", "--recordings", "0", "--no-gate"];
    let [with, without] = ["mis", "acc"].map(|controller| {
        let out = folder.path().join(controller);
        stdout(&closecall(args.iter().chain(&["--controller", controller, "--out", out.to_str().unwrap()])), 0);
        out
    });
    // The rear vehicle comes closer to an ego that brakes.
    let comparison = json(&compare(&without, &with, &["--format", "json"]), 1);
    let scenario = &comparison["scenarios"]["overtake-without-brake"];
    assert_eq!(scenario["newly_failing"].as_array().map(Vec::len), Some(0));
    let lost = scenario["margin_regressions"].as_array().unwrap();
    assert!(
        !lost.is_empty() && lost.iter().all(|lost| lost["current"].as_f64() < lost["baseline"].as_f64()),
        "{lost:?}"
    );
    let text = stdout(&compare(&without, &with, &[]), 1);
    assert!(text.contains("REGRESSION: min_ttc_rear_s p50 "), "{text}");
    // With a tolerance of 1, a margin may fall to zero.
    stdout(&compare(&without, &with, &["--tolerance", "1"]), 0);
}

#[test]
fn campaigns_with_different_samples_are_not_compared() {
    let folder = folder();
    let first = campaign(folder.path().join("one"), &["-n", "12"]);
    let longer = campaign(folder.path().join("longer"), &["-n", "13"]);
    let other = campaign(folder.path().join("other"), &["-n", "12", "--set", "brake-mps2=6"]);
    for (dir, named) in [(&longer, "only the second has sample 12"), (&other, "brake-mps2")] {
        let refused = compare(&first, dir, &[]);
        assert_eq!(code(&refused), 2);
        assert!(stderr(&refused).contains(named), "{}", stderr(&refused));
    }
    assert_eq!(code(&compare(&first, &folder.path().join("nothing"), &[])), 6);
}

#[test]
fn a_search_beyond_the_samples_of_two_campaigns_finds_a_regression_and_writes_its_smallest_case() {
    let folder = folder();
    let few = |name: &str, controller: &str| {
        let words = ["-n", "2", "--sensors", "object", "--controller", controller];
        campaign(folder.path().join(name), &words)
    };
    let (before, after) = (few("before", "acc"), few("after", "gap-1.6"));
    let (out, same) = (folder.path().join("found"), folder.path().join("same"));
    let search = ["--search", "--seed", "7", "--out", out.to_str().unwrap()];
    let text = stdout(&compare(&before, &after, &search), 1);
    assert!(text.contains("no vehicle collides in it with acc"), "{text}");
    let case = out.join("low-thw-overtake-found.toml");
    let run = |controller: &str| stdout(&closecall(["run", case.to_str().unwrap(), "--controller", controller]), 0);
    assert!(run("gap-1.6").contains("COLLISION") && !run("acc").contains("COLLISION"), "{text}");
    // It is the search of a campaign with both arms.
    let words =
        "campaign low-thw-overtake --arms acc,gap-1.6 --sensors object --design search --event induced --seed 7";
    stdout(&closecall(words.split_whitespace().chain(["--out", same.to_str().unwrap()])), 1);
    let journal = |folder: &Path| std::fs::read(folder.join("rare-journal.jsonl")).unwrap();
    assert!(journal(&out) == journal(&same));
    // Cut off and resumed, it has the same journal.
    let whole = journal(&out);
    std::fs::write(out.join("rare-journal.jsonl"), &whole[..whole.len() / 2]).unwrap();
    stdout(&compare(&before, &after, &[&search[..], &["--resume"]].concat()), 1);
    assert!(journal(&out) == whole);
}

/// The command that repeats a case names the file of a controller, not its name in reports.
#[test]
fn a_regression_of_a_library_is_run_by_the_command_that_the_search_prints() {
    let folder = folder();
    let source = std::fs::read_to_string(Path::new(ROOT).join("examples/acc_controller.c")).unwrap();
    let longer =
        source.replacen("own->time_gap_s = setting(setup, \"acc.time_gap_s\", NAN);", "own->time_gap_s = 1.6;", 1);
    assert_ne!(source, longer);
    let few = |name: &str, text: &str| {
        let file = folder.path().join(format!("{name}.c"));
        std::fs::write(&file, text).unwrap();
        let library = lib(&compile(file.to_str().unwrap(), &folder.path().join(format!("{name}.so")), &[]));
        let words = ["-n", "2", "--sensors", "object", "--controller", &library];
        (campaign(folder.path().join(name), &words), library)
    };
    let ((before, _), (after, library)) = (few("before", &source), few("after", &longer));
    let out = folder.path().join("found");
    let text = stdout(&compare(&before, &after, &["--search", "--seed", "7", "--out", out.to_str().unwrap()]), 1);
    assert!(text.lines().any(|line| line.starts_with("fails:") && line.ends_with(&library)), "{text}");
}

#[test]
fn a_search_between_campaigns_that_leave_nothing_to_search_is_refused() {
    let folder = folder();
    let few = |name: &str, words: &[&str]| campaign(folder.path().join(name), &[&["-n", "2"][..], words].concat());
    let acc = few("acc", &["--controller", "acc"]);
    let set = few("set", &["--controller", "gap-1.6", "--set", "brake-mps2=6"]);
    let refused = |other: &Path, words: &[&str]| {
        let output = compare(&acc, other, words);
        assert_eq!(code(&output), 2, "{words:?}: {}", stderr(&output));
        message(&output)
    };
    let said = refused(&acc, &["--search"]);
    assert!(said.contains("both campaigns tested `acc`") && said.contains("under another name"), "{said}");
    let said = refused(&set, &["--search"]);
    assert!(said.contains("no scenario with the same text"), "{said}");
    refused(&set, &["--search", "--tolerance", "0.1"]);
    for words in [&["-n", "5"][..], &["--seed", "5"], &["--out", "x"], &["--trust-folder"]] {
        assert!(refused(&set, words).contains("--search"), "{words:?}");
    }
}
