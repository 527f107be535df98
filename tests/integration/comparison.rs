//! `compare` compares one campaign with an earlier one.

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::native_controllers::{compile, lib, with_fault};
use crate::support::{ROOT, closecall, code, folder, json, library, message, program, records, stderr, stdout};

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
    // All of the samples may newly fail, and each margin may fall to 0.
    let any = ["--max-newly-failing", "80", "--tolerance", "1"];
    assert!(stdout(&compare(&with, &without, &any), 4).contains("NOT JUDGED: the limits hold whatever happens"));
    let told = json(&compare(&with, &without, &[&any[..], &["--format", "json"]].concat()), 4);
    assert_eq!(told["verdict"], "NOT JUDGED");
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
fn a_campaign_whose_runs_do_not_repeat_is_no_baseline_and_is_not_compared() {
    let folder = folder();
    let library = lib(&compile("tests/fixtures/controllers/faulty.c", &folder.path().join("faulty.so"), &[]));
    let [out, baseline] = ["out", "baseline.json"].map(|name| folder.path().join(name).to_str().unwrap().to_owned());
    let mut command = program();
    let words = "campaign overtake-without-brake -n 4 --sensors object --no-gate --record failures:0 --controller";
    command.args(words.split(' ')).args([&library, "--out", &out]);
    assert_eq!(code(&with_fault(&mut command, Some("process-number"))), 7);
    for words in [["baseline", "save", &out, &baseline], ["compare", &out, &out, "--format=json"]] {
        let output = closecall(words);
        assert_eq!(code(&output), 7, "{}", stderr(&output));
        assert!(message(&output).contains("the same run gave another outcome when repeated"), "{}", stderr(&output));
    }
    assert!(!Path::new(&baseline).exists());
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
    let run = |name: &str, words: &str| {
        campaign(folder.path().join(name), &words.split(' ').chain(["--check-at-most", "0"]).collect::<Vec<_>>())
    };
    let first = run("one", "-n 12 --sensors object");
    let longer = run("longer", "-n 13 --sensors object");
    let other = run("other", "-n 12 --sensors object --set brake-mps2=6");
    let part = run("part", "-n 12 --sensors object --partition 1/2");
    let wet = run("wet", "-n 12 --sensors object --set environment.friction=0.5");
    let fast = run("fast", "-n 12 --sensors ground-truth");
    let differing = [
        (&longer, "only the second has sample 12"),
        (&other, "brake-mps2"),
        (&part, "holds only part 1/2"),
        (&wet, "differs in environment"),
        (&fast, "the second with ground-truth"),
    ];
    for (dir, named) in differing {
        let refused = compare(&first, dir, &[]);
        assert_eq!(code(&refused), 2);
        assert!(message(&refused).contains(named), "{}", stderr(&refused));
    }
    // The settings of the system under test may differ.
    let gentle = run("gentle", "-n 12 --sensors object --set actor.ego.driver.ego-stack.mis.max-deceleration-mps2=0.9");
    assert_ne!(code(&compare(&first, &gentle, &["--tolerance", "1"])), 2);
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

/// A controller that always accelerates, and ends in an error in a part of the samples: the larger its
/// argument, the fewer.
const PARTLY: &str = r#"echo '{"type":"hello","protocol":1}'
read -r line
sum=$(printf %s "$line" | cksum)
[ $((${sum%% *} % $1)) = 0 ] && exit 1
while read -r line; do echo '{"acceleration_mps2":2.0,"state":"following"}'; done
"#;

#[test]
fn errors_decide_about_a_comparison_with_a_baseline_and_hide_neither_a_fix_nor_a_regression() {
    let folder = folder();
    std::fs::write(folder.path().join("partly.sh"), PARTLY).unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let run = |name: &str, controller: &str, expected: i32| {
        let words = "campaign overtake-without-brake -n 12 --seed 1 --sensors ground-truth --no-gate --no-validity-checks \
             --record failures:0";
        let limit = if controller == "mis" { &[][..] } else { &["--controller-timeout-ms", "60000"] };
        let more = [&["--controller", controller, "--out", name], limit].concat();
        let output = program().current_dir(folder.path()).args(words.split(' ')).args(more).output().unwrap();
        stdout(&output, expected);
        stdout(&closecall(["baseline", "save", &at(name), &at(&format!("{name}.json"))]), 0);
    };
    let against = |current: &str, baseline: &str, more: &[&str]| {
        let (folder, file) = (at(current), at(&format!("{baseline}.json")));
        closecall(["baseline", "compare", &folder, &file].iter().chain(more))
    };
    run("fine", "mis", 0);
    run("partly", "exec:sh partly.sh 3", 5);
    run("colliding", "exec:sh partly.sh 4294967296", 0);
    let list = |comparison: &Value, key: &str| {
        let values = comparison["scenarios"][0][key].as_array().unwrap().iter();
        values.map(|value| value.as_u64().unwrap()).collect::<Vec<_>>()
    };
    let changes =
        |current: &str, baseline: &str, expected| json(&against(current, baseline, &["--format", "json"]), expected);
    let worse = changes("partly", "fine", 5);
    let (newly, errors) = (list(&worse, "newly_failing"), list(&worse, "newly_in_error"));
    assert!(!newly.is_empty() && !errors.is_empty() && newly.len() + errors.len() == 12, "{worse}");
    let text = stdout(&against("partly", "fine", &[]), 5);
    assert!(
        text.contains("NEW ERRORS") && text.contains(&format!("{} newly failing: {}", newly.len(), newly[0])),
        "{text}"
    );
    let mended = changes("fine", "partly", 5);
    assert_eq!((list(&mended, "fixed"), list(&mended, "newly_failing")), (newly, Vec::new()), "{mended}");
    assert!(stdout(&against("fine", "partly", &[]), 5).contains("NOT COMPARED"));
    assert!(stdout(&against("partly", "partly", &[]), 5).contains("NOT COMPARED"));
    // A collision in a sample without an outcome before is a regression.
    assert_eq!(list(&changes("colliding", "partly", 1), "newly_failing"), errors);
    // Where every sample fails and each margin may fall to 0, nothing can become worse.
    let any = &["--tolerance", "1"][..];
    assert!(stdout(&against("colliding", "colliding", any), 4).contains("NOT JUDGED"));
    assert!(stdout(&against("fine", "fine", any), 0).contains("NO REGRESSION"));
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
