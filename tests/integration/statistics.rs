//! The statistics of a campaign agree with a scenario of known collision probability.
//!
//! `xtask/src/validate_statistics.rs` does the same with many more campaigns.

use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use closecall_campaign::execution::{Campaign, End};
use closecall_campaign::ledger::{ArmCounts, Inference};
use closecall_campaign::probability::{Answer, ProbabilityGate};
use closecall_campaign::record::Record;
use closecall_campaign::runner::{Sampling, Work};
use closecall_campaign::validity::CheckPlan;
use closecall_campaign::workers::Workers;
use closecall_scenarios::ScenarioFile;
use closecall_scenarios::sampling::Design;
use closecall_simulation::Arm;
use closecall_simulation::controller::BuiltIn;

use crate::support::{closecall, code, folder, json, library, message, stderr, stdout};

/// The collision probability of the fixture, by construction.
const TRUTH: f64 = 0.05;

fn fixture() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/known-probability.toml")
}

/// Runs a campaign until `is_over` returns true, and calls `observe` with every journal record.
fn run(seed: u64, samples: u64, is_over: impl Fn(&ArmCounts) -> bool, mut observe: impl FnMut(&Record)) -> ArmCounts {
    let file = ScenarioFile::load(&fixture(), &[]).unwrap();
    let arms = vec![Arm { controller: BuiltIn::Acc.factory(), sensors: None }];
    let sampling = Sampling { seed, design: Design::Random, samples };
    let workers = Workers { jobs: NonZeroUsize::new(2).unwrap(), sample_timeout: Duration::from_mins(10) };
    let work = Arc::new(Work { file, sampling, arms, checks: CheckPlan::default(), retry_crashed: 0 });
    let campaign = Campaign::new(vec![work], workers);
    let mut summary = campaign.summary();
    campaign
        .run(None, |next| {
            observe(next.record);
            summary.push(next.record);
            let counts = summary.total().arms[0];
            if is_over(&counts) { ControlFlow::Break(End::Scenario) } else { ControlFlow::Continue(()) }
        })
        .unwrap();
    let total = summary.total();
    assert_eq!((total.errors(), total.invalid, total.checks.flips), (0, 0, 0), "{total:?}");
    total.arms[0]
}

#[test]
fn a_sample_of_the_fixture_collides_if_and_only_if_its_gap_is_short() {
    let mut collisions = 0;
    let counts = run(
        0,
        1_000,
        |_| false,
        |record| {
            let outcome = record.arms[0].result.as_ref().unwrap();
            let gap_m = outcome.parameters.iter().next().unwrap().1.to_string().parse::<f64>().unwrap();
            assert_eq!(!outcome.collisions.is_empty(), gap_m < 10.0, "a gap of {gap_m} m");
            collisions += u64::from(gap_m < 10.0);
        },
    );
    assert_eq!(counts.collisions, collisions);
    // Five standard deviations of a binomial count of 1,000.
    assert!((collisions as f64 - 50.0).abs() < 35.0, "{collisions}");
}

const CAMPAIGNS: u64 = 1_000;
const SAMPLES: u64 = 50;

#[test]
fn the_intervals_of_a_thousand_campaigns_cover_the_true_probability() {
    let covered = (0..CAMPAIGNS)
        .filter(|seed| {
            let counts = run(*seed, SAMPLES, |_| false, |_| {});
            let [low, high] = counts.interval_95(Inference::FixedSamples).unwrap();
            low <= TRUTH && TRUTH <= high
        })
        .count();
    assert!(covered >= 935, "{covered} of {CAMPAIGNS}");
}

#[test]
fn a_campaign_that_stops_at_the_first_answer_is_seldom_wrong() {
    let gate = ProbabilityGate::new(TRUTH, 0.95).unwrap();
    let mut answers = [0_u64; 3];
    for seed in 0..200 {
        let counts = run(seed, 300, |counts| gate.is_settled(counts, 1), |_| {});
        answers[gate.judge(&counts, 1, Inference::Sequential).answer as usize] += 1;
    }
    // 5 % of 200 is 10; three standard deviations above it would be 19.
    let [below, above, open] = [Answer::Below, Answer::Above, Answer::Open].map(|answer| answers[answer as usize]);
    assert!(below <= 19 && above <= 19 && open > 0, "{below} {above} {open}");
}

fn campaign(more: &[&str]) -> std::process::Output {
    let fixture = fixture();
    let args = ["campaign", fixture.to_str().unwrap(), "--controller", "acc"];
    closecall(args.iter().chain(more))
}

#[test]
fn the_gate_on_the_probability_passes_fails_or_is_inconclusive() {
    let passed = json(&campaign(&["-n", "500", "--max-probability", "0.1", "--format", "json"]), 0);
    assert_eq!(passed["verdict"], "PASS");
    let finding = &passed["probabilities"]["known-probability"];
    assert!(finding["upper_bound"].as_f64().unwrap() <= 0.1, "{finding}");
    let failed = json(&campaign(&["-n", "500", "--max-probability", "0.01", "--format", "json"]), 1);
    assert_eq!(failed["verdict"], "FAIL");
    let open = json(&campaign(&["-n", "100", "--max-probability", "0.05", "--format", "json"]), 4);
    assert_eq!(open["verdict"], "INCONCLUSIVE");
    let missing = &open["probabilities"]["known-probability"]["missing"];
    assert!(missing["without_collisions"].as_u64().unwrap() > 0, "{missing}");
    assert!(open["reasons"][0].as_str().unwrap().contains("too few samples to decide"), "{open}");
}

#[test]
fn a_sequential_campaign_does_not_depend_on_the_number_of_threads() {
    let results: Vec<_> = ["1", "2"]
        .map(|jobs| {
            let args = ["--max-probability", "0.1", "--until-certain", "--jobs", jobs, "--format", "json"];
            let mut report = json(&campaign(&args), 0);
            report.as_object_mut().unwrap().remove("wall_s");
            report
        })
        .into();
    assert_eq!(results[0], results[1]);
    let samples = results[0]["samples"].as_u64().unwrap();
    assert!((50..5_000).contains(&samples), "{samples}");
    assert_eq!(results[0]["controllers"]["acc"]["interval_method"], "confidence-sequence");
    // With one sample less there is no answer yet.
    let before = (samples - 1).to_string();
    let args = ["--max-probability", "0.1", "--until-certain", "-n", &before, "--format", "json"];
    assert_eq!(json(&campaign(&args), 4)["samples"].as_u64(), Some(samples - 1));
}

#[test]
fn a_time_budget_ends_a_campaign() {
    let output = campaign(&["--time-budget", "1s", "--max-probability", "0.2", "--format", "json"]);
    // The number of samples in a second depends on the machine, and so does whether there is an
    // answer by then.
    assert!([0, 4].contains(&code(&output)), "{}", stderr(&output));
    let report = json(&output, code(&output));
    let samples = report["samples"].as_u64().unwrap();
    // Without a number of samples, a campaign has 1,000,000.
    assert!((1..1_000_000).contains(&samples), "{samples}");
}

#[test]
fn a_campaign_that_checks_every_sample_finds_no_fault_of_the_simulator() {
    let in_object = ["low-thw-overtake", "left-lane-blocked", "slow-approach", "overtake-without-brake"];
    let in_object = in_object.map(|name| (name, "object", 40));
    for (name, sensors, samples) in in_object.into_iter().chain([("low-thw-overtake", "full", 10)]) {
        let (path, count) = (library(name), samples.to_string());
        let args = ["campaign", path.to_str().unwrap(), "-n", &count, "--paired", "--no-gate", "--check-share", "1"];
        let report = json(&closecall(args.iter().chain(&["--sensors", sensors, "--format", "json"])), 0);
        assert_eq!(report["checks"]["runs"].as_u64(), Some(2 * samples), "{name}, {sensors}: {report}");
        assert_eq!(report["checks"]["broken"].as_object().unwrap().len(), 0, "{name}, {sensors}: {report}");
    }
}

#[test]
fn an_option_beside_a_preset_overrides_it() {
    let path = library("slow-approach");
    let run = |more: &[&str]| {
        let args = ["campaign", path.to_str().unwrap(), "--preset", "pr", "--set", "duration-s=2", "--format", "json"];
        // In two seconds no expected event of the scenario happens: no number of samples passes.
        json(&closecall(args.iter().chain(more)), 7)
    };
    let report = run(&[]);
    assert_eq!(report["samples"].as_u64(), Some(1_000));
    assert_eq!(report["verdict"], "INVALID");
    assert!(report["paired"].is_object(), "{report}");
    assert_eq!(run(&["-n", "20"])["samples"].as_u64(), Some(20));
    assert!(run(&["-n", "20", "--controller", "acc"]).get("paired").is_none());
}

#[test]
fn limits_out_of_range_are_wrong_usage() {
    let folder = folder();
    let out = folder.path().join("out");
    let out = out.to_str().unwrap();
    for args in [
        vec!["--max-probability", "0"],
        vec!["--max-probability", "1"],
        vec!["--max-probability", "nan"],
        vec!["--max-probability", "0.1", "--confidence", "0.5"],
        vec!["--max-probability", "0.1", "--confidence", "95"],
        vec!["--max-probability", "0.1", "--confidence", "nan"],
        vec!["--confidence", "0.9"],
        vec!["--until-certain"],
        vec!["--max-probability", "0.1", "--until-certain", "--max-collisions", "3"],
        vec!["--max-probability", "0.1", "--until-certain", "--partition", "1/2", "--out", out],
        vec!["--max-probability", "0.1", "--design", "sobol"],
        vec!["--time-budget", "0s"],
        vec!["--time-budget", "1s", "--resume", "--out", out],
        vec!["--max-jerk", "nan"],
        vec!["--max-engagement-rate", "1.5"],
        vec!["--max-flip-rate", "nan"],
        vec!["--max-flip-rate", "0.1", "--no-validity-checks"],
        vec!["--time-budget", "1e-30s"],
        vec!["--sample-timeout-s", "1e-30"],
        vec!["--check-share", "0"],
        vec!["--max-induced", "0"],
        vec!["--preset", "weekly"],
    ] {
        let output = campaign(&args);
        assert_eq!(code(&output), 2, "{args:?}: {}", stderr(&output));
        assert!(!stderr(&output).is_empty(), "{args:?}");
    }
}

#[test]
fn comfort_gates_report_the_limit_that_was_exceeded() {
    let path = library("low-thw-overtake-at-cut-out");
    let run = |more: &[&str], expected| {
        let args = ["campaign", path.to_str().unwrap(), "-n", "80", "--sensors", "object"];
        stdout(&closecall(args.iter().chain(more)), expected)
    };
    let jerk = run(&["--max-jerk", "0.5"], 1);
    assert!(
        jerk.contains("NOT MET: low-thw-overtake-at-cut-out: largest value of the largest jerk of the ego"),
        "{jerk}"
    );
    assert!(jerk.contains("required: at most 0.5 m/s³ [max(max_jerk_mps3) <= 0.5; from command line]"), "{jerk}");
    let engagements = run(&["--max-engagement-rate", "0.01"], 1);
    assert!(
        engagements.contains("the margin increase system engages: 80 of 80 (100 %, two-sided 95 % interval"),
        "{engagements}"
    );
    assert!(run(&["--max-jerk", "39"], 0).contains("PASS"));
    // A share is never above 1.
    let refused = closecall(["campaign", path.to_str().unwrap(), "--max-engagement-rate", "1"]);
    assert!(message(&refused).contains("no sample can miss it"), "{}", message(&refused));
}
