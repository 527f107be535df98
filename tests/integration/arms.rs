//! Campaigns with more than two arms: `--arms`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use closecall_campaign::record::Record;
use closecall_campaign::runner::{Sampling, concrete};
use closecall_campaign::saved::SavedCampaign;
use closecall_scenarios::ScenarioFile;
use closecall_scenarios::outcome::Outcome;
use closecall_scenarios::sampling::Design;
use closecall_sensors::SensorMode;
use closecall_simulation::controller::ControllerChoice;
use closecall_simulation::{Arm, Observer, RunEvent, RunKey, StepView, simulate};
use closecall_traffic::{Time, VehicleState};
use serde_json::Value;

use crate::support::{all_of_library, closecall, code, folder, json, library, message, records, stderr, stdout};

const SAMPLES: usize = 24;

/// The arguments of a campaign of the main scenario in these arms.
fn args(out: &Path, arms: &str, more: &[&str]) -> Vec<String> {
    let scenario = library("low-thw-overtake");
    let samples = SAMPLES.to_string();
    let all =
        ["campaign", scenario.to_str().unwrap(), "-n", &samples, "--seed", "5", "--sensors", "object", "--no-gate"];
    let rest = ["--arms", arms, "--record", "worst:0", "--out", out.to_str().unwrap()];
    all.iter().chain(&rest).chain(more).map(|arg| (*arg).to_owned()).collect()
}

/// Runs a campaign, and returns its folder.
fn campaign(folder: &Path, name: &str, arms: &str, more: &[&str]) -> PathBuf {
    let out = folder.join(name);
    stdout(&closecall(args(&out, arms, more)), 0);
    out
}

/// The outcomes of a campaign, by sample and controller.
fn outcomes(folder: &Path) -> BTreeMap<(u64, String), Outcome> {
    let arms_of = |record: Record| {
        let sample = record.sample;
        record.arms.into_iter().map(move |arm| ((sample, arm.controller), arm.result.unwrap()))
    };
    records(folder).into_iter().flat_map(arms_of).collect()
}

/// Files that depend on the outcomes alone.
const FILES: [&str; 5] = ["journal.jsonl", "outcomes.parquet", "arm_pairs.parquet", "samples.xml", "summary.md"];

fn assert_same_files(first: &Path, second: &Path) {
    for file in FILES {
        let read = |folder: &Path| std::fs::read(folder.join(file)).unwrap();
        assert_eq!(read(first), read(second), "{file} of {} and {}", first.display(), second.display());
    }
}

const ARMS: &str = "acc,gap-1.6,mis";

#[test]
fn the_bytes_are_the_same_with_any_number_of_threads_resumed_and_merged() {
    let folder = folder();
    let whole = campaign(folder.path(), "whole", ARMS, &["--jobs", "1"]);
    assert_same_files(&whole, &campaign(folder.path(), "two-jobs", ARMS, &["--jobs", "2"]));

    let resumed = campaign(folder.path(), "resumed", ARMS, &["--jobs", "2"]);
    let journal = std::fs::read_to_string(resumed.join("journal.jsonl")).unwrap();
    let half: String = journal.lines().take(SAMPLES / 2).map(|line| format!("{line}\n")).collect();
    std::fs::write(resumed.join("journal.jsonl"), half).unwrap();
    stdout(&closecall(args(&resumed, ARMS, &["--resume"])), 0);
    assert_same_files(&whole, &resumed);
    let refused = closecall(args(&resumed, "acc,gap-2.0,mis", &["--resume"]));
    assert!(stderr(&refused).contains("gap-1.6") && stderr(&refused).contains("gap-2.0"), "{}", stderr(&refused));

    let parts =
        ["1/2", "2/2"].map(|part| campaign(folder.path(), &part.replace('/', "-"), ARMS, &["--partition", part]));
    let merged = folder.path().join("merged");
    let [first, second, out] = [&parts[0], &parts[1], &merged].map(|path| path.to_str().unwrap());
    stdout(&closecall(["tool", "merge", first, second, "--no-gate", "--record", "worst:0", "--out", out]), 0);
    for file in ["journal.jsonl", "outcomes.parquet", "arm_pairs.parquet"] {
        let read = |folder: &Path| std::fs::read(folder.join(file)).unwrap();
        assert_eq!(read(&whole), read(&merged), "{file}");
    }
    for controller in ["acc", "gap-1.6", "mis"] {
        stdout(&closecall(["replay", out, "3", "--controller", controller]), 0);
    }
    stdout(&closecall(["replay", out, "3", "--paired"]), 0);
    let compared = stdout(&closecall(["compare", out, out]), 0);
    assert!(compared.contains("NO REGRESSION"), "{compared}");
}

#[test]
fn the_order_of_the_arms_and_the_arms_beside_it_change_no_outcome_of_an_arm() {
    let folder = folder();
    let [first, second] = [("first", ARMS), ("second", "mis,gap-1.6,mis-extended,acc")]
        .map(|(name, arms)| outcomes(&campaign(folder.path(), name, arms, &[])));
    assert_eq!(first.len(), 3 * SAMPLES);
    for (key, outcome) in &first {
        assert!(outcome.has_same_bits(&second[key]), "{key:?}");
    }
}

#[test]
fn every_report_holds_all_pairs_as_the_journal_counts_them() {
    let folder = folder();
    let out = folder.path().join("out");
    let printed = stdout(&closecall(args(&out, ARMS, &[])), 0);
    let machine = json(&closecall(args(&folder.path().join("json"), ARMS, &["--format", "json"])), 0);
    let pairs = machine["scenarios"]["low-thw-overtake"]["arm_pairs"].as_array().unwrap();
    assert_eq!(pairs, machine["arm_pairs"].as_array().unwrap());
    let named = |pair: &Value, key: &str| pair[key].as_str().unwrap().to_owned();
    let arms: Vec<_> = pairs.iter().map(|pair| (named(pair, "baseline"), named(pair, "tested"))).collect();
    let expected = [("acc", "gap-1.6"), ("acc", "mis"), ("gap-1.6", "mis")];
    assert_eq!(arms, expected.map(|(baseline, tested)| (baseline.to_owned(), tested.to_owned())));
    let outcomes = outcomes(&out);
    let (mut smallest_p, mut prevented_by_any) = (1.0_f64, 0);
    for (pair, (baseline, tested)) in pairs.iter().zip(&arms) {
        let mut counts = [0_u64; 4];
        for sample in 0..SAMPLES as u64 {
            let of_arm = |name: &String| &outcomes[&(sample, name.clone())];
            let fate = match (of_arm(baseline).ego_collided(), of_arm(tested)) {
                (true, with) => usize::from(with.ego_collided() || with.others_collided()) * 2,
                (false, with) if with.ego_collided() => 1,
                (false, with) => usize::from(!with.others_collided() || of_arm(baseline).others_collided()) * 2 + 1,
            };
            counts[fate] += 1;
        }
        for (index, key) in ["prevented", "induced", "both", "neither"].into_iter().enumerate() {
            assert_eq!(pair[key], counts[index], "{baseline} and {tested}: {key}");
        }
        prevented_by_any += counts[0];
        let [raw, corrected] = ["mcnemar_p", "mcnemar_p_corrected"].map(|key| pair[key].as_f64().unwrap());
        assert!(raw <= corrected && corrected <= 1.0, "{pair}");
        smallest_p = smallest_p.min(raw);
        let low_high: Vec<f64> =
            pair["prevented_interval_95"].as_array().unwrap().iter().map(|bound| bound.as_f64().unwrap()).collect();
        let share = counts[0] as f64 / SAMPLES as f64;
        assert!(low_high[0] <= share && share <= low_high[1], "{pair}");
        let [prevented, induced] = [counts[0], counts[1]];
        let line = printed.lines().find(|line| line.contains(&format!("{baseline} -> {tested}:"))).unwrap();
        assert!(line.contains(&format!(" {prevented} prevented")) && line.contains(&format!(" {induced} induced")));
        let junit = std::fs::read_to_string(out.join("junit.xml")).unwrap();
        let property = format!("<property name=\"{baseline}.{tested}.prevented\" value=\"{prevented}\"/>");
        assert!(junit.contains(&property), "{property}");
        let summary = std::fs::read_to_string(out.join("summary.md")).unwrap();
        assert!(summary.contains(&format!("| low-thw-overtake | {baseline} | {tested} | {prevented} | ")), "{summary}");
        let page = std::fs::read_to_string(out.join("report.html")).unwrap();
        assert!(
            page.contains("All pairs of arms")
                && page.contains(&format!(">{baseline}</td><td data-name=\"to\">{tested}</td>"))
        );
    }
    assert!(prevented_by_any > 0, "nothing is compared");
    // Holm: the smallest p counts once for each pair.
    let corrected = pairs.iter().map(|pair| pair["mcnemar_p_corrected"].as_f64().unwrap()).fold(1.0, f64::min);
    assert!((corrected - (3.0 * smallest_p).min(1.0)).abs() < 1e-12, "{corrected} of {smallest_p}");
    // The last arm is judged against the first.
    assert_eq!(machine["paired"]["prevented"], pairs[1]["prevented"]);
}

#[test]
fn two_processes_have_names_of_their_own() {
    let folder = folder();
    let out = folder.path().join("out");
    let scenario = library("paper-figure");
    let commands = ["exec:python3 examples/acc_controller.py", "exec:python3 ./examples/acc_controller.py"];
    let args = ["campaign", scenario.to_str().unwrap(), "-n", "1", "--no-gate", "--arms", "acc", "--arms", commands[0]];
    let rest = ["--arms", commands[1], "--record", "worst:0", "--out", out.to_str().unwrap()];
    stdout(&closecall(args.iter().chain(&rest)), 0);
    let names = SavedCampaign::open(&out).unwrap().manifest().arm_names();
    assert_eq!(names, ["acc", "exec-1", "exec-2"]);
    let record = &records(&out)[0];
    let outcome = |index: usize| record.arms[index].result.as_ref().unwrap();
    // The example is the built-in controller to the last bit.
    assert_eq!(outcome(0).collisions, outcome(1).collisions);
    assert_eq!(outcome(1).collisions, outcome(2).collisions);
    stdout(&closecall(["replay", out.to_str().unwrap(), "0", "--controller", "exec-2"]), 0);
}

#[test]
fn arms_that_cannot_be_compared_are_refused() {
    let cases: [(&[&str], &str); 6] = [
        (&["--arms", "mis"], "is only one"),
        (&["--arms", "acc,mis,acc"], "`acc` is named twice"),
        (&["--arms", "acc,miss"], "did you mean `mis`?"),
        (&["--arms", "acc,gap-9"], "0.8 to 2.5 s in steps of 0.1 s"),
        (&["--arms", "acc,mis", "--paired"], "cannot be used with '--paired'"),
        (&["--arms", "acc,mis", "--controller", "mis"], "cannot be used with '--controller"),
    ];
    for (more, expected) in cases {
        let refused = closecall(["campaign", "low-thw-overtake", "-n", "1"].iter().chain(more));
        assert_eq!(code(&refused), 2, "{more:?}");
        assert!(message(&refused).contains(expected), "{more:?}: {}", stderr(&refused));
    }
    let limits = ["run", "paper-figure", "--arms", "acc,mis", "--controller-timeout-ms", "5"];
    assert!(message(&closecall(limits)).contains("apply to a process"));
}

/// The states of all vehicles at the start, and the ego's commands of the first second.
#[derive(Default)]
struct Start {
    states: Vec<VehicleState>,
    commands_mps2: Vec<f64>,
}

impl Observer for Start {
    fn moved(&mut self, time: Time, states: &mut dyn Iterator<Item = VehicleState>) {
        if time == Time::ZERO {
            self.states = states.collect();
        }
    }

    fn step(&mut self, view: &StepView<'_>) {
        if self.commands_mps2.len() < 25 {
            self.commands_mps2.push(view.command.acceleration_mps2);
        }
    }

    fn event(&mut self, _: Time, _: &RunEvent) {}
}

#[test]
fn in_every_arm_the_ego_starts_in_balance_and_all_other_vehicles_start_as_in_the_baseline() {
    for path in all_of_library() {
        let file = ScenarioFile::load(&path, &[]).unwrap();
        let brakes_at_once = std::fs::read_to_string(&path).unwrap().contains("\nbrake-at-s");
        for sample in 0..3 {
            let key = RunKey { seed: 3, sample };
            let sampling = Sampling { seed: 3, design: Design::Random, samples: 3 };
            let scenario = concrete(&file, sampling, sample).unwrap();
            let start = |name: &str| {
                let controller: ControllerChoice = name.parse().unwrap();
                let arm = Arm { controller: controller.factory(), sensors: Some(SensorMode::GroundTruth) };
                let mut start = Start::default();
                simulate(&scenario, key, &arm, &mut start).unwrap();
                start
            };
            let baseline = start("acc");
            let r157_s = 1.0 + 0.036 * baseline.states[scenario.ego].speed_mps;
            for (name, gap_s) in [("gap-1.6", 1.6), ("r157-gap", r157_s), ("r157-driver", 2.0), ("r157-fsm", 2.0)] {
                let tested = start(name);
                let context = format!("{}, sample {sample}, {name}", path.display());
                for (actor, (baseline_state, state)) in baseline.states.iter().zip(&tested.states).enumerate() {
                    if actor != scenario.ego {
                        assert_eq!(baseline_state, state, "{context}: actor {actor}");
                    }
                }
                let [before, now] = [&baseline, &tested].map(|start| start.states[scenario.ego]);
                assert_eq!(VehicleState { s_m: before.s_m, ..now }, before, "{context}");
                // The longest gap of the baseline is 0.9 s.
                assert!(before.s_m - now.s_m > (gap_s - 0.95) * now.speed_mps, "{context}: {}", before.s_m - now.s_m);
                let is_balanced = tested.commands_mps2.iter().all(|command_mps2| command_mps2.abs() < 0.5);
                assert!(is_balanced || brakes_at_once, "{context}: {:?}", tested.commands_mps2);
            }
        }
    }
}

#[test]
fn a_vehicle_in_the_way_of_the_ego_s_start_is_an_error_of_the_sample() {
    let refused =
        closecall(["run", "low-thw-overtake", "--set", "actor.rear.start.behind.gap-m=20", "--arms", "acc,gap-2.5"]);
    assert_eq!(code(&refused), 5);
    assert!(
        message(&refused).contains("`gap-2.5`") && message(&refused).contains("`rear` leaves 20.0 m"),
        "{}",
        stderr(&refused)
    );
}
