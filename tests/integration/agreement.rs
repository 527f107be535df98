//! Exit code, console, JSON, HTML, Markdown and JUnit of a campaign give one verdict, whatever its
//! outcomes and gates are.
//!
//! The campaigns are synthetic: the journal of a real one, with collisions, margins, errors and
//! findings of the validity checks drawn at random, judged by randomly drawn gates through
//! `closecall tool merge`.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use closecall_campaign::journal::Journal;
use closecall_campaign::record::{Record, SampleFailure};
use closecall_campaign::saved::SavedCampaign;
use closecall_campaign::validity::{ArmChecks, Invariance};
use closecall_scenarios::outcome::Collision;
use closecall_traffic::ActorId;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use serde_json::Value;

use crate::support::{closecall, code, folder, library, stderr, stdout, words_of_gate};

/// Number of synthetic campaigns.
const CAMPAIGNS: u64 = 500;
/// The verdict that belongs to each exit code. A measurement has none.
const VERDICTS: [(i32, &[&str]); 5] = [
    (0, &["PASS", "measured, not judged"]),
    (1, &["FAIL"]),
    (4, &["INCONCLUSIVE", "NOT JUDGED"]),
    (5, &["ERROR"]),
    (7, &["INVALID"]),
];

/// How often something is drawn in one campaign: never, rarely, or often.
fn rate(random: &mut StdRng) -> f64 {
    [0.0, 0.0, 0.05, 0.5][random.random_range(0..4_usize)]
}

/// The records of a real campaign with other outcomes.
fn synthetic(records: &[Record], collision: &Collision, random: &mut StdRng) -> Vec<Record> {
    let [ego, others, errors, flips, broken, silent] = std::array::from_fn(|_| rate(random));
    let error_rate = if random.random_bool(0.2) { errors } else { 0.0 };
    let broken_rate = if random.random_bool(0.2) { broken } else { 0.0 };
    let silent_rate = if random.random_bool(0.3) { silent } else { 0.0 };
    let mut records = records.to_vec();
    for arm in records.iter_mut().flat_map(|record| &mut record.arms) {
        let outcome = arm.result.as_mut().unwrap();
        let between = |names: [&str; 2]| names.map(|name| ActorId::new(name).unwrap());
        outcome.collisions.clear();
        if random.random_bool(ego) {
            outcome.collisions.push(Collision { between: between(["ego", "rear"]), ..collision.clone() });
        }
        if random.random_bool(others) {
            outcome.collisions.push(Collision { between: between(["front", "rear"]), ..collision.clone() });
        }
        if random.random_bool(silent_rate) {
            outcome.moments.clear();
        }
        outcome.margins.max_jerk_mps3 = random.random_range(0.0..10.0);
        outcome.margins.max_speed_deficit_mps = random.random_range(0.0..12.0);
        let has_broken = random.random_bool(broken_rate);
        arm.checks = random.random_bool(0.5).then(|| ArmChecks {
            collided_at_half_step: Some(outcome.ego_collided() ^ random.random_bool(0.3 * flips)),
            broken: if has_broken { vec![Invariance::Mirror] } else { Vec::new() },
            not_checked: None,
        });
        if random.random_bool(error_rate) {
            arm.result = Err(SampleFailure { kind: "sensor".to_owned(), message: "made up".to_owned() });
            arm.checks = None;
        }
    }
    records
}

/// Draws the gates of a campaign.
fn gates(random: &mut StdRng) -> Vec<String> {
    if random.random_bool(0.1) {
        return vec!["--no-gate".to_owned()];
    }
    let mut gates = Vec::new();
    let mut add = |random: &mut StdRng, share: f64, option: &str, values: &[&str]| {
        if random.random_bool(share) {
            gates.extend([option.to_owned(), values[random.random_range(0..values.len())].to_owned()]);
        }
    };
    add(random, 0.4, "--max-collisions", &["0", "3", "24"]);
    add(random, 0.2, "--max-other-collisions", &["0", "5"]);
    add(random, 0.2, "--max-induced", &["0", "2", "20"]);
    add(random, 0.2, "--min-prevented", &["0.01", "0.3", "0.99"]);
    add(random, 0.2, "--max-harm", &["0.001", "0.5"]);
    add(random, 0.2, "--max-probability", &["0.05", "0.6", "0.99"]);
    add(random, 0.2, "--max-jerk", &["1", "9.9", "10"]);
    add(
        random,
        0.3,
        "--gate",
        &["p99(max_speed_deficit_mps) <= 11", "upper(others_collided) <= 0.5", "mean(thw_gain_s) >= 0"],
    );
    add(random, 0.1, "--max-flip-rate", &["0", "1"]);
    gates
}

/// Returns the number in an attribute of the first element of an XML file.
fn attribute(xml: &str, name: &str) -> usize {
    let (_, rest) = xml.split_once("<testsuites").unwrap().1.split_once(&format!(" {name}=\"")).unwrap();
    rest.split('"').next().unwrap().parse().unwrap()
}

/// Judges one synthetic campaign, and returns its verdict.
fn verdict_of(part: &Path, records: &[Record], gates: &[String], out: &Path) -> String {
    std::fs::remove_file(part.join("journal.jsonl")).unwrap();
    let mut journal = Journal::open(&part.join("journal.jsonl"), 0).unwrap();
    for record in records {
        journal.append(record).unwrap();
    }
    let merge = |format: &str| {
        let args = ["tool", "merge", part.to_str().unwrap(), "--record", "failures:0", "--out", out.to_str().unwrap()];
        let gates = gates.iter().map(String::as_str);
        let output = closecall(args.into_iter().chain(gates).chain(["--format", format]));
        let files = ["junit.xml", "report.html", "summary.md"];
        let texts = files.map(|name| std::fs::read_to_string(out.join(name)).unwrap_or_default());
        drop(std::fs::remove_dir_all(out));
        (output, texts)
    };
    let ((human, files), (machine, _)) = (merge("human"), merge("json"));
    let context = format!("{gates:?}: {}", stderr(&human));

    // The exit code and the console.
    let printed = String::from_utf8(human.stdout.clone()).unwrap();
    let words: Vec<&str> = VERDICTS.iter().flat_map(|(_, words)| words.iter().copied()).collect();
    let verdict_of =
        |line: &'_ str| words.iter().copied().find(|word| line == *word || line.starts_with(&format!("{word}: ")));
    let shown: Vec<&str> = printed.lines().filter_map(verdict_of).collect();
    let [word] = shown[..] else { panic!("{context}: one verdict, not {shown:?}") };
    let (_, allowed) = VERDICTS.iter().find(|(exit_code, _)| *exit_code == code(&human)).expect(&context);
    assert!(allowed.contains(&word), "{context}: {word} with exit code {}", code(&human));
    let is_measured = word.starts_with("measured");

    // JSON.
    assert_eq!(code(&machine), code(&human), "{context}");
    let json: Value = serde_json::from_slice(&machine.stdout).unwrap();
    assert_eq!(json["verdict"].as_str(), (!is_measured).then_some(word), "{context}");
    let reasons: Vec<&str> =
        json["reasons"].as_array().unwrap().iter().map(|reason| reason.as_str().unwrap()).collect();
    assert!(reasons.iter().all(|reason| printed.contains(reason)), "{context}: {reasons:?} in {printed}");
    let passed: Vec<Option<bool>> =
        json["gates"].as_array().unwrap().iter().map(|gate| gate["passed"].as_bool()).collect();
    let answers: Vec<&str> = json["probabilities"]
        .as_object()
        .unwrap()
        .values()
        .map(|finding| finding["answer"].as_str().unwrap())
        .collect();
    let refuted = answers.iter().filter(|answer| **answer == "above").count();
    let failed = passed.iter().filter(|passed| **passed == Some(false)).count() + refuted;
    let met = passed.iter().filter(|passed| **passed == Some(true)).count()
        + answers.iter().filter(|a| **a == "below").count();
    match word {
        "PASS" => assert!(failed == 0 && met > 0, "{context}: {met} met, {failed} not met"),
        "FAIL" => assert!(failed > 0, "{context}"),
        "NOT JUDGED" | "INCONCLUSIVE" => assert_eq!(failed, 0, "{context}"),
        _ => {}
    }

    // What the records say, counted here once more.
    let has_error = records.iter().flat_map(|record| &record.arms).any(|arm| arm.result.is_err());
    assert_eq!(word == "ERROR", has_error, "{context}");
    let limit =
        gates.iter().position(|gate| gate == "--max-collisions").map(|at| gates[at + 1].parse::<usize>().unwrap());
    if let (Some(limit), false) = (limit, has_error) {
        let is_limit = |gate: &&Value| gate["subject"] == "count(ego_collided)" && gate["bound"] == limit as f64;
        for gate in json["gates"].as_array().unwrap().iter().filter(is_limit) {
            let of_scenario = records.iter().filter(|record| gate["scenario"] == record.scenario.as_str());
            let collided = of_scenario.filter(|record| record.tallies().last().unwrap().collided == Some(true)).count();
            // Few samples do not decide that a limit is met.
            let passed = gate["passed"].as_bool().unwrap_or(true);
            assert_eq!(passed, collided <= limit, "{context}: {collided} collisions in {}", gate["scenario"]);
        }
    }

    // The files.
    let [junit, page, summary] = files;
    let failures = attribute(&junit, "failures");
    assert_eq!(failures, junit.matches("<failure ").count(), "{context}");
    assert_eq!(failures, if is_measured { 0 } else { failed }, "{context}: {junit}");
    // A gate that is met has its value, too.
    assert_eq!(junit.matches("<system-out>met: ").count(), met, "{context}: {junit}");
    let is_green = failures + attribute(&junit, "errors") == 0;
    assert_eq!(is_green, code(&human) == 0, "{context}: {junit}");
    assert!(page.contains(&format!("<title>{word}: ")), "{context}");
    assert!(summary.starts_with(&format!("## Closecall: {word}")), "{context}");
    for reason in &reasons {
        let escaped = words_of_gate(reason).replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
        // A number keeps its percent sign in its line.
        let escaped = escaped.replace(" %", "\u{a0}%");
        assert!(page.contains(&escaped) && summary.contains(reason), "{context}: {reason}");
        if let Some((words, _)) = reason.split_once(" [max-probability ") {
            assert!(junit.contains(words), "{context}: {words}: {junit}");
        }
    }
    word.to_owned()
}

/// The journal of a real campaign, to be judged again with other outcomes.
struct Part {
    path: PathBuf,
    records: Vec<Record>,
}

impl Part {
    /// Runs 12 samples of each of the scenarios in these arms.
    fn new(path: PathBuf, scenarios: &[PathBuf], arms: &str) -> Self {
        let paths = scenarios.iter().map(|path| path.to_str().unwrap());
        let options = ["-n", "12", "--seed", "1", "--arms", arms, "--no-gate", "--partition", "1/1"];
        let args = std::iter::once("campaign").chain(paths).chain(options).chain(["--out", path.to_str().unwrap()]);
        stdout(&closecall(args), 0);
        let saved = SavedCampaign::open(&path).unwrap();
        let records = saved.folder().records().unwrap().collect::<Result<_, _>>().unwrap();
        Self { path, records }
    }
}

/// Writes a scenario of the library with other checks of its requirements.
fn with_checks(folder: &Path, name: &str, checks: &str) -> PathBuf {
    let text = std::fs::read_to_string(library(name)).unwrap();
    let (before, rest) = text.split_once("[checks]").unwrap();
    let (_, after) = rest.split_once("\n[").unwrap();
    let path = folder.join(format!("{name}.toml"));
    std::fs::write(&path, format!("{before}[checks]\n{checks}\n[{after}")).unwrap();
    path
}

#[test]
fn every_output_of_a_campaign_gives_the_same_verdict() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let few = "MIS-1 = [\"count(others_collided) <= 9\"]\nMIS-2 = [\"upper(induced) <= 0.5\"]\n";
    let checked = [with_checks(folder.path(), "low-thw-overtake", few), library("overtake-without-brake")];
    std::fs::create_dir(at("unchecked")).unwrap();
    let unchecked = [with_checks(&at("unchecked"), "low-thw-overtake", "")];
    let parts = [
        Part::new(at("checked-part"), &checked, "acc,mis"),
        Part::new(at("three-arms"), &checked, "acc,gap-1.6,mis"),
        Part::new(at("unchecked-part"), &unchecked, "acc,mis"),
    ];
    let outcomes = parts[0].records.iter().flat_map(|record| &record.arms).filter_map(|arm| arm.result.as_ref().ok());
    let collision = outcomes.flat_map(|outcome| &outcome.collisions).next().expect("a collision").clone();
    let mut verdicts = BTreeSet::new();
    for seed in 0..CAMPAIGNS {
        let random = &mut StdRng::seed_from_u64(seed);
        let part = &parts[[0, 1, 0, 2][(seed % 4) as usize]];
        let (changed, gates) = (synthetic(&part.records, &collision, random), gates(random));
        verdicts.insert(verdict_of(&part.path, &changed, &gates, &at("out")));
    }
    let all: BTreeSet<String> = VERDICTS.iter().flat_map(|(_, words)| words.iter().map(ToString::to_string)).collect();
    assert_eq!(verdicts, all);
}
