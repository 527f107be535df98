//! The campaign's statistics on a scenario whose probability of a collision is known.
//!
//! `examples/validate_statistics.rs` is the long form of this.

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
use closecall_campaign::summary::Summary;
use closecall_campaign::validity::CheckPlan;
use closecall_campaign::workers::Workers;
use closecall_scenarios::sampling::Design;
use closecall_simulation::Arm;
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::scenario::ScenarioFile;

use crate::support::{closecall, code, folder, json, library, stderr, stdout};

/// The probability of a collision of the fixture, by construction.
const TRUTH: f64 = 0.05;

fn fixture() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/known-probability.toml")
}

/// Runs one campaign until `stops` says so, and shows every record to `see`.
fn run(seed: u64, samples: u64, stops: impl Fn(&ArmCounts) -> bool, mut see: impl FnMut(&Record)) -> ArmCounts {
    let file = ScenarioFile::load(&fixture(), &[]).unwrap();
    let arms = vec![Arm { controller: BuiltIn::Acc.factory(), sensors: None }];
    let sampling = Sampling { seed, design: Design::Random, samples };
    let workers = Workers { jobs: NonZeroUsize::new(2).unwrap(), sample_timeout: Duration::from_secs(60) };
    let work = Arc::new(Work { file, sampling, arms, checks: CheckPlan::default() });
    let campaign = Campaign::new(vec![work.clone()], workers);
    let mut summary = campaign.summary();
    campaign
        .run(None, |next| {
            see(next.record);
            summary.push(next.record);
            let counts = summary.total().arms[0];
            if stops(&counts) { ControlFlow::Break(End::Scenario) } else { ControlFlow::Continue(()) }
        })
        .unwrap();
    let total = summary.total();
    assert_eq!((total.errors(), total.invalid, total.checks.flips), (0, 0, 0), "{total:?}");
    total.arms[0]
}

#[test]
fn the_fixture_collides_exactly_where_it_should() {
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
fn intervals_of_a_thousand_campaigns_cover_the_truth() {
    let covered = (0..CAMPAIGNS)
        .filter(|seed| {
            let counts = run(*seed, SAMPLES, |_| false, |_| {});
            let [low, high] = counts.interval_95(Inference::FixedSamples);
            low <= TRUTH && TRUTH <= high
        })
        .count();
    assert!(covered >= 935, "{covered} of {CAMPAIGNS}");
}

#[test]
fn stopping_at_the_first_favourable_moment_is_seldom_wrong() {
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
fn the_gate_on_the_probability_answers_pass_fail_or_asks_for_more() {
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
    assert!(open["reasons"][0].as_str().unwrap().contains("more samples are needed"), "{open}");
}

#[test]
fn a_sequential_campaign_is_the_same_on_any_number_of_threads() {
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
    // One sample less, and it is not certain yet.
    let before = (samples - 1).to_string();
    let args = ["--max-probability", "0.1", "--until-certain", "-n", &before, "--format", "json"];
    assert_eq!(json(&campaign(&args), 4)["samples"].as_u64(), Some(samples - 1));
}

#[test]
fn a_time_budget_ends_a_campaign() {
    let output = campaign(&["--time-budget", "1s", "--max-probability", "0.2", "--format", "json"]);
    // How far one gets in a second, and so whether there is an answer by then, is the machine's affair.
    assert!([0, 4].contains(&code(&output)), "{}", stderr(&output));
    let report = json(&output, code(&output));
    let samples = report["samples"].as_u64().unwrap();
    assert!((1..1_000_000).contains(&samples), "{samples}");
}

#[test]
fn every_sample_can_be_checked_and_no_check_breaks() {
    for name in ["low-thw-overtake", "left-lane-blocked", "slow-approach", "overtake-without-brake"] {
        let path = library(name);
        let args =
            ["campaign", path.to_str().unwrap(), "-n", "40", "--paired", "--check-share", "1", "--format", "json"];
        let report = json(&closecall(args), 0);
        assert_eq!(report["checks"]["runs"].as_u64(), Some(80), "{name}: {report}");
        assert_eq!(report["checks"]["broken"].as_object().unwrap().len(), 0, "{name}: {report}");
    }
}

#[test]
fn a_preset_says_how_many_and_what_is_given_beside_it_counts_before_it() {
    let path = library("slow-approach");
    let run = |more: &[&str]| {
        let args = ["campaign", path.to_str().unwrap(), "--preset", "pr", "--set", "duration-s=2", "--format", "json"];
        json(&closecall(args.iter().chain(more)), 0)
    };
    let report = run(&[]);
    assert_eq!(report["samples"].as_u64(), Some(1_000));
    assert!(report["paired"].is_object(), "{report}");
    assert_eq!(run(&["-n", "20"])["samples"].as_u64(), Some(20));
    assert!(run(&["-n", "20", "--controller", "acc"]).get("paired").is_none());
}

#[test]
fn limits_that_make_no_sense_are_wrong_usage() {
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
fn comfort_gates_say_what_they_found() {
    let path = library("low-thw-overtake");
    let run = |more: &[&str], expected| {
        let args = ["campaign", path.to_str().unwrap(), "-n", "40"];
        stdout(&closecall(args.iter().chain(more)), expected)
    };
    assert!(run(&["--max-jerk", "0.5"], 1).contains("m/s³ allowed"));
    assert!(run(&["--max-engagement-rate", "0.01"], 1).contains("1 % allowed"));
    assert!(run(&["--max-engagement-rate", "1", "--max-jerk", "1000"], 0).contains("PASS"));
}
