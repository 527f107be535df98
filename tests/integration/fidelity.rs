//! `study fidelity`: two campaigns of the same samples, and those that are none. `campaign
//! --fidelity`: both in one command.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Output, Stdio};

use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

use crate::support::{
    closecall, code, folder, json, json_file, library, message, program, stderr, stdout, wait_for_results,
};

fn campaign(out: &Path, words: &str) -> PathBuf {
    let path = library("low-thw-overtake");
    let fixed = ["campaign", path.to_str().unwrap(), "--paired", "--no-gate", "--out", out.to_str().unwrap()];
    let ran = closecall(fixed.into_iter().chain(words.split_whitespace()));
    assert_eq!(code(&ran), 0, "{}", message(&ran));
    out.to_owned()
}

fn study(full: &Path, fast: &Path, more: &[&str]) -> Output {
    let words = ["study", "fidelity", full.to_str().unwrap(), fast.to_str().unwrap()];
    closecall(words.iter().chain(more))
}

#[test]
fn fast_runs_narrow_the_interval_of_a_rate_and_other_campaigns_are_refused() {
    let place = folder();
    let at = |name: &str| place.path().join(name);
    let full = campaign(&at("full"), "-n 150 --seed 1 --sensors object --no-validity-checks");
    let fast = campaign(&at("fast"), "-n 900 --seed 1 --sensors ground-truth --no-validity-checks");
    let value = json(&study(&full, &fast, &["--format", "json"]), 0);
    let report = &value["scenarios"][0];
    assert_eq!(
        (&report["samples"], &report["more_samples"], &report["left_out"]),
        (&150.into(), &750.into(), &0.into())
    );
    let of_baseline = &report["rates"][0];
    assert_eq!(of_baseline["of"], "ego_collided: acc");
    let width = |interval: &serde_json::Value| interval[1].as_f64().unwrap() - interval[0].as_f64().unwrap();
    let sharp = width(&of_baseline["estimate"]["interval_95"]);
    // The cruise control does not look back: the modes hardly differ in its arm.
    assert!(of_baseline["correlation"].as_f64().unwrap() > 0.9, "{of_baseline}");
    assert!(sharp < 0.6 * width(&of_baseline["plain_interval_95"]), "{of_baseline}");
    // The exact interval of all 900 known fast samples is about as wide: the fast runs give no more than they have.
    assert!(of_baseline["estimate"]["worth_samples"].as_f64().unwrap() < 900.0, "{of_baseline}");
    let induced = &report["rates"][3];
    assert_eq!(induced["of"], "induced");
    assert!(induced["estimate"].is_null(), "few events have no such interval: {induced}");
    let text = stdout(&study(&full, &fast, &[]), 0);
    assert!(text.contains("worth ") && text.contains("events are too few or too many"), "{text}");

    let other = campaign(&at("other-seed"), "-n 900 --seed 2 --sensors ground-truth --no-validity-checks");
    for (one, two, part) in [
        (&full, &other, "sampling.seed"),
        (&fast, &full, "the fast campaign needs more of them"),
        (&full, &full, "sensors: the same there and here"),
    ] {
        let refused = study(one, two, &[]);
        assert_eq!(code(&refused), 2, "{part}");
        assert!(message(&refused).contains(part), "{part}: {}", message(&refused));
    }
    let sobol = campaign(&at("sobol"), "-n 160 --seed 1 --sensors ground-truth --design sobol --no-validity-checks");
    assert!(message(&study(&full, &sobol, &[])).contains("independent samples"));
}

/// The campaign that fast samples accompany, with its folder.
const SLOW: &str = "--seed 1 --sensors object --record failures:0 --fidelity ground-truth:3";
/// The files that depend on the samples alone.
const FILES: [&str; 5] = ["journal.jsonl", "outcomes.parquet", "summary.md", "fidelity.json", "fidelity/journal.jsonl"];

fn bytes(folder: &Path, file: &str) -> Vec<u8> {
    let bytes = fs::read(folder.join(file)).unwrap();
    assert!(!bytes.is_empty(), "{file}");
    bytes
}

fn assert_same_bytes(one: &Path, other: &Path) {
    for file in FILES {
        assert!(bytes(one, file) == bytes(other, file), "{file} differs");
    }
}

/// Cuts a journal behind so many lines and a half.
fn tear(journal: &Path, lines: usize) {
    let text = fs::read(journal).unwrap();
    let ends: Vec<usize> = (0..text.len()).filter(|index| text[*index] == b'\n').collect();
    assert!(lines + 1 < ends.len());
    fs::write(journal, &text[..(ends[lines] + ends[lines + 1]) / 2]).unwrap();
}

#[test]
fn one_command_has_the_rates_of_two_campaigns_and_the_verdict_of_the_slow_one() {
    let place = folder();
    let at = |name: &str| place.path().join(name);
    let run = |out: &Path, words: &str| {
        let fixed = ["campaign", "low-thw-overtake", "--paired", "--format", "json", "--seed", "1"];
        let out = ["--gate", "upper(induced) <= 0.2", "--out", out.to_str().unwrap()];
        closecall(fixed.into_iter().chain(out).chain(words.split_whitespace()))
    };
    let slow = "-n 60 --sensors object --record failures:0";
    let alone = run(&at("full"), slow);
    let both = run(&at("both"), &format!("{slow} --fidelity ground-truth:3"));
    run(&at("fast"), "-n 180 --sensors ground-truth --no-validity-checks --record failures:0");
    assert_eq!(code(&both), code(&alone), "{}", message(&both));
    let [alone, both] = [alone, both].map(|output| serde_json::from_slice::<Value>(&output.stdout).unwrap());
    assert!(alone.get("fidelity").is_none(), "{alone}");
    for key in ["verdict", "gates", "requirements", "reasons", "paired", "controllers"] {
        assert!(!both[key].is_null() && both[key] == alone[key], "{key}: {} and {}", both[key], alone[key]);
    }
    assert!(bytes(&at("both"), "journal.jsonl") == bytes(&at("full"), "journal.jsonl"));
    assert!(bytes(&at("both"), "fidelity/journal.jsonl") == bytes(&at("fast"), "journal.jsonl"));

    let fidelity = &both["fidelity"];
    assert_eq!((&fidelity["mode"], &fidelity["factor"]), (&"ground-truth".into(), &3.into()));
    assert_eq!(*fidelity, json_file(&at("both").join("fidelity.json")));
    // The study has too few induced collisions for an interval of each rate, and some for one of them.
    let apart = json(&study(&at("full"), &at("fast"), &["--format", "json"]), 0);
    let within = json(&study(&at("both"), &at("both").join("fidelity"), &["--format", "json"]), 0);
    assert_eq!((&fidelity["scenarios"], &within["scenarios"]), (&apart["scenarios"], &apart["scenarios"]));
    let of_baseline = &fidelity["scenarios"][0]["rates"][0];
    let [worth, error] =
        ["worth_samples", "standard_error_ratio"].map(|key| of_baseline["estimate"][key].as_f64().unwrap());
    assert!(worth > 60.0 && worth < 180.0, "{of_baseline}");
    assert!((error * error * worth - 60.0).abs() < 1e-9, "{of_baseline}");

    let read = |file: &str| String::from_utf8(bytes(&at("both"), file)).unwrap();
    let summary = read("summary.md");
    assert!(summary.contains("Rates with fast sensors") && summary.contains("| ego_collided: acc | "), "{summary}");
    assert!(summary.contains("The gates do not use these rates"), "{summary}");
    let page = read("report.html");
    assert!(page.contains(">Rates with fast sensors</h2>") && page.contains("the same time gives"));
    let plain = String::from_utf8(bytes(&at("full"), "summary.md")).unwrap();
    assert!(!plain.contains("fast sensors"), "{plain}");
    // The reports of the campaign alone: a CI server that collects them finds each once.
    assert!(!at("both").join("fidelity/junit.xml").exists() && at("both").join("junit.xml").exists());
}

#[test]
fn a_campaign_that_is_killed_among_its_fast_samples_resumes_to_the_same_bytes() {
    let place = folder();
    let at = |name: &str| place.path().join(name);
    let whole = campaign(&at("whole"), &format!("-n 60 {SLOW}"));
    let killed = campaign(&at("killed"), &format!("-n 60 {SLOW}"));
    // What a program leaves that is killed after 20 fast samples.
    for file in ["outcomes.parquet", "summary.md", "report.html", "junit.xml", "fidelity.json"] {
        fs::remove_file(killed.join(file)).unwrap();
    }
    tear(&killed.join("fidelity/journal.jsonl"), 20);
    campaign(&killed, &format!("-n 60 {SLOW} --resume"));
    assert_same_bytes(&whole, &killed);
    // And before the first of them.
    fs::remove_dir_all(killed.join("fidelity")).unwrap();
    fs::remove_file(killed.join("fidelity.json")).unwrap();
    tear(&killed.join("journal.jsonl"), 30);
    campaign(&killed, &format!("-n 60 {SLOW} --resume"));
    assert_same_bytes(&whole, &killed);

    // More samples of the campaign alone leave rates behind that are not its own.
    let alone = SLOW.replace("--fidelity ground-truth:3", "");
    let summary = |out: &Path| String::from_utf8(bytes(out, "summary.md")).unwrap();
    campaign(&killed, &format!("-n 60 {alone} --resume"));
    assert!(summary(&killed).contains("Rates with fast sensors"), "the rates of the same samples stay");
    tear(&killed.join("journal.jsonl"), 30);
    campaign(&killed, &format!("-n 60 {alone} --resume"));
    assert!(!summary(&killed).contains("Rates with fast sensors"), "samples have run again since the rates");
    assert!(!killed.join("fidelity.json").exists());
    campaign(&killed, &format!("-n 70 {alone} --resume"));
    assert!(!summary(&killed).contains("Rates with fast sensors"), "rates of 60 samples are none of 70");
    campaign(&killed, &format!("-n 70 {SLOW} --resume"));
    assert_same_bytes(&campaign(&at("larger"), &format!("-n 70 {SLOW}")), &killed);

    let out = killed.to_str().unwrap();
    for (choice, said) in [("ground-truth:2", "sampling.samples: 210 there, 140 here"), ("object:3", "no faster")] {
        let words = format!("--paired --no-gate -n 70 {SLOW} --resume").replace("ground-truth:3", choice);
        let words = format!("campaign {} --out {out} {words}", library("low-thw-overtake").display());
        let refused = closecall(words.split_whitespace());
        assert_eq!(code(&refused), 2, "{choice}: {}", stderr(&refused));
        assert!(message(&refused).contains(said), "{said}: {}", message(&refused));
    }
}

#[test]
fn a_check_covers_fast_samples_and_asks_for_no_reports_of_theirs() {
    let place = folder();
    let out = campaign(&place.path().join("out"), &format!("-n 4 {SLOW}"));
    let fast = out.join("fidelity");
    let check = |path: &Path, expected| stdout(&closecall(["check", path.to_str().unwrap()]), expected);
    let text = check(&out, 0);
    assert!(text.contains("out: sound, 4 samples") && text.contains("fidelity: sound, 12 samples"), "{text}");
    assert!(check(&fast, 0).ends_with("fidelity: sound, 12 samples\n"));
    let both = closecall(["check", out.to_str().unwrap(), fast.to_str().unwrap(), "--format", "json"]);
    assert_eq!(json(&both, 0)["campaigns"].as_array().unwrap().len(), 2, "each folder is there once");

    tear(&fast.join("journal.jsonl"), 5);
    for path in [&out, &fast] {
        let text = check(path, 3);
        assert!(text.contains("fidelity/journal.jsonl:7: "), "{text}");
        // The campaign resumes its fast samples. Their folder is none of its own.
        assert!(text.contains(&format!("--out {} ", out.display())) && text.contains(" --resume"), "{text}");
        assert!(!text.contains("summary.md") && !text.contains("outcomes.parquet"), "{text}");
    }
    campaign(&out, &format!("-n 4 {SLOW} --resume"));
    check(&out, 0);
    // A campaign in a folder of this name has reports, unless the folder belongs to another campaign.
    let alone = campaign(&place.path().join("fidelity"), "-n 2 --sensors ground-truth --record failures:0");
    fs::remove_file(alone.join("summary.md")).unwrap();
    assert!(check(&alone, 3).contains("summary.md: it is missing"));
}

#[test]
fn a_signal_ends_a_campaign_among_its_fast_samples_without_a_verdict() {
    let place = folder();
    let out = place.path().join("out");
    let words = "campaign low-thw-overtake -n 4 --no-gate --sensors object --fidelity ground-truth:1000000 --out";
    let mut command = program();
    command.args(words.split_whitespace()).arg(&out).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    wait_for_results(&mut child, &out.join("fidelity/journal.jsonl"));
    kill_process(Pid::from_child(&child), Signal::INT).unwrap();
    let output = child.wait_with_output().unwrap();
    let text = stdout(&output, 130);
    assert!(text.contains("ENDED EARLY") && text.contains("of 4000004 samples are done"), "{text}");
    let resume = text.lines().find_map(|line| line.strip_prefix("resume: ")).unwrap();
    assert!(resume.contains("--fidelity ground-truth:1000000") && resume.ends_with("--resume"), "{resume}");
    assert!(!out.join("fidelity.json").exists() && !out.join("report.html").exists());
}

#[test]
fn fast_samples_without_an_outcome_say_why() {
    let place = folder();
    let words = "campaign low-thw-overtake -n 4 --no-gate --sensors object --fidelity ground-truth:3";
    let mut command = program();
    command.args(words.split_whitespace()).args(["--controller", "exec:false", "--out"]).arg(place.path().join("out"));
    let output = command.output().unwrap();
    assert_eq!(code(&output), 5, "{}", stderr(&output));
    let said = message(&output);
    assert!(said.contains("fidelity: low-thw-overtake: 12 ") && said.contains("before its greeting"), "{said}");
}

#[test]
fn parts_with_fast_samples_merge_to_the_same_bytes() {
    let place = folder();
    let at = |name: &str| place.path().join(name);
    let whole = campaign(&at("whole"), &format!("-n 60 {SLOW}"));
    let parts = ["1/2", "2/2"].map(|part| {
        let out = at(&part.replace('/', "-"));
        campaign(&out, &format!("-n 60 {SLOW} --partition {part}"));
        assert!(out.join("fidelity/journal.jsonl").exists() && !out.join("fidelity.json").exists());
        out
    });
    let merge = |name: &str| {
        let words = ["tool", "merge", parts[0].to_str().unwrap(), parts[1].to_str().unwrap(), "--no-gate"];
        let out = at(name);
        closecall(words.into_iter().chain([
            "--record",
            "failures:0",
            "--format",
            "json",
            "--out",
            out.to_str().unwrap(),
        ]))
    };
    let merged = json(&merge("merged"), 0);
    assert_same_bytes(&whole, &at("merged"));
    assert_eq!(merged["fidelity"], json_file(&whole.join("fidelity.json")));
    fs::remove_dir_all(parts[1].join("fidelity")).unwrap();
    let refused = merge("refused");
    assert_eq!(code(&refused), 2, "{}", stderr(&refused));
    assert!(message(&refused).contains("is missing, and other parts have fast samples"), "{}", message(&refused));
    assert!(!at("refused").exists());
}

#[test]
fn fast_samples_that_cannot_sharpen_a_rate_are_refused_before_a_sample_runs() {
    let place = folder();
    let out = place.path().join("out");
    let object = "low-thw-overtake --sensors object --fidelity ground-truth:5";
    for (words, expected, said) in [
        ("low-thw-overtake --fidelity full:5", 2, "`full:5` is not MODE:FACTOR"),
        ("low-thw-overtake --fidelity object:1", 2, "a whole number of 2 or more"),
        (
            "low-thw-overtake --sensors object --fidelity object:5",
            2,
            "with the sensors `object`, and `object` would be no faster",
        ),
        (
            "low-thw-overtake --sensors ground-truth --fidelity object:5",
            2,
            "`ground-truth`, and `object` would be no faster",
        ),
        (format!("{object} --design sobol").as_str(), 2, "`sobol` does not"),
        (
            format!("{object} --design importance --event collision").as_str(),
            2,
            "it cannot be combined with --fidelity",
        ),
        (format!("{object} --until-certain --max-probability 0.1").as_str(), 2, "fixed in advance"),
        (format!("{object} --time-budget 5s").as_str(), 2, "fixed in advance"),
        (format!("{object} -n 10000000000000000000").as_str(), 2, "are too many"),
        ("lidar-dirty --sensors full --fidelity object:5", 3, "`fault.rear-lidar` contradicts `sensors.mode`"),
    ] {
        let words = format!("campaign {words} --out {}", out.display());
        let refused = closecall(words.split_whitespace());
        assert_eq!(code(&refused), expected, "{words}: {}", stderr(&refused));
        assert!(message(&refused).contains(said), "{said}: {}", message(&refused));
        assert!(!out.exists(), "{words}");
    }
    let nowhere = closecall(format!("campaign {object}").split_whitespace());
    assert_eq!(code(&nowhere), 2);
    assert!(message(&nowhere).contains("leave out --no-out"), "{}", message(&nowhere));
}
