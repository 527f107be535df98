//! The validity checks of the simulator find the faults that they look for, and a finding makes a
//! campaign invalid.

use std::num::NonZeroUsize;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use closecall_campaign::execution::Campaign;
use closecall_campaign::gate::{GateSet, Judge};
use closecall_campaign::ledger::Inference;
use closecall_campaign::runner::{Sampling, Work};
use closecall_campaign::summary::{Counts, Summary};
use closecall_campaign::validity::{CheckPlan, Invariance};
use closecall_campaign::verdict::{Allowed, Decision, Judgement, Verdict, judge};
use closecall_campaign::workers::Workers;
use closecall_controllers::{ControllerError, EgoCommand, EgoController, EgoInput, EgoSettings, EgoStack};
use closecall_scenarios::ScenarioFile;
use closecall_scenarios::sampling::Design;
use closecall_sensors::SensorMode;
use closecall_simulation::{Arm, ControllerFactory};
use closecall_traffic::Side;

use crate::support::{closecall, folder, json, json_file, library, stdout};

/// Something that the commands of a controller must not depend on.
#[derive(Clone, Copy)]
enum DependsOn {
    Nothing,
    NumberOfRuns,
    Thread,
    TrackIds,
    OvertakingSide,
}

struct Flawed {
    on: DependsOn,
    runs: AtomicU64,
}

impl ControllerFactory for Flawed {
    fn name(&self) -> &str {
        "flawed"
    }

    fn has_mis(&self, settings: &EgoSettings) -> bool {
        settings.mis().is_some()
    }

    fn build(&self, settings: &EgoSettings) -> Box<dyn EgoController> {
        let run = self.runs.fetch_add(1, Ordering::Relaxed);
        Box::new(FlawedStack { on: self.on, run, stack: EgoStack::new(*settings) })
    }
}

struct FlawedStack {
    on: DependsOn,
    run: u64,
    stack: EgoStack,
}

/// A change of the acceleration that is too small to cause a collision, but changes the bits of the
/// outcome (m/s²).
const SMALL_MPS2: f64 = -1e-3;
/// An acceleration that leads to a collision with the lead vehicle (m/s²).
const RECKLESS_MPS2: f64 = 4.0;

impl EgoController for FlawedStack {
    fn step(&mut self, input: &EgoInput<'_>) -> Result<EgoCommand, ControllerError> {
        let command = self.stack.step(input)?;
        let acceleration_mps2 = command.acceleration_mps2
            + match self.on {
                DependsOn::Nothing => 0.0,
                DependsOn::NumberOfRuns => SMALL_MPS2 * self.run as f64,
                DependsOn::Thread if std::thread::current().name() == Some("check") => SMALL_MPS2,
                DependsOn::Thread => 0.0,
                DependsOn::TrackIds => input.tracks.iter().map(|track| SMALL_MPS2 * f64::from(track.id.0)).sum(),
                DependsOn::OvertakingSide if input.road.overtaking_side() == Side::Left => {
                    RECKLESS_MPS2 - command.acceleration_mps2
                }
                DependsOn::OvertakingSide => 0.0,
            };
        Ok(EgoCommand { acceleration_mps2, ..command })
    }
}

/// Runs `low-thw-overtake` with a flawed controller, and checks every sample.
fn checked(on: DependsOn) -> Summary {
    let file = ScenarioFile::load(&library("low-thw-overtake"), &[]).unwrap();
    let controller = Arc::new(Flawed { on, runs: AtomicU64::new(0) });
    let arms = vec![Arm { controller, sensors: Some(SensorMode::GroundTruth) }];
    let sampling = Sampling { seed: 5, design: Design::Random, samples: 6 };
    let workers = Workers { jobs: NonZeroUsize::MIN, sample_timeout: Duration::from_mins(10) };
    let work = Arc::new(Work { file, sampling, arms, checks: CheckPlan::new(1.0, 100).unwrap(), retry_crashed: 0 });
    Campaign::new(vec![work], workers).count().unwrap()
}

/// Returns the checks that found a fault, and in how many samples.
fn findings(counts: &Counts) -> Vec<(Invariance, u64)> {
    counts.checks.broken().collect()
}

/// Judges a summary without gates.
fn judged(summary: &Summary) -> Judgement {
    judge(summary, &Judge::new(&[], &GateSet::default(), Inference::FixedSamples), Allowed::default())
}

#[test]
fn each_check_finds_its_fault() {
    for (on, expected) in [
        (DependsOn::NumberOfRuns, Invariance::Repetition),
        (DependsOn::Thread, Invariance::Threads),
        (DependsOn::TrackIds, Invariance::ActorOrder),
        (DependsOn::OvertakingSide, Invariance::Mirror),
    ] {
        let summary = checked(on);
        assert_eq!(findings(&summary.total()), [(expected, 6)], "{expected:?}");
        let judged = judged(&summary);
        assert_eq!((judged.verdict(), judged.decision), (Some(Verdict::Invalid), Decision::Invalid));
        let reason = &judged.reasons[0];
        assert!(reason.contains(expected.finding()), "{reason}");
        assert!(reason.contains("6 of 6 checked, first in sample 0 of low-thw-overtake with "), "{reason}");
        let blames_controller = matches!(expected, Invariance::Repetition | Invariance::Threads);
        assert_eq!(reason.contains("; the likely cause is "), blames_controller, "{reason}");
    }
}

#[test]
fn no_check_finds_a_fault_of_a_sound_controller() {
    let total = checked(DependsOn::Nothing).total();
    assert_eq!((findings(&total), total.checks.runs, total.invalid), (Vec::new(), 6, 0));
}

/// The rear vehicle brakes between two steps of 10 ms. The gaps lie so close to the limit between a
/// collision and none that half the time step changes the result of some samples.
const EDGE: &str = r#"
schema-version = 1
name = "edge-of-the-step"
duration-s = 1.0
road = { lanes = 1 }

[parameters]
gap-m = { uniform = { min = 8.18, max = 8.38 }, assumed = "around where they just touch" }

[[actor]]
id = "ego"
vehicle = { class = "car" }
start = { absolute = { lane = 1, s-m = 500.0, speed-mps = 30.0 } }
driver = { ego-stack = { acc = { time-gap-s = 0.7 } } }

[[actor]]
id = "rear"
vehicle = { class = "car" }
start = { behind = { of = "ego", gap-m = "$gap-m", closing-mps = 10.0 } }
driver = { prescribed = { profile = [[0.0, 40.0]] } }

[[actor.event]]
id = "rear-brakes"
when = { at-s = 0.005 }
then = { brake = { deceleration-mps2 = 4.0 } }

[sensors]
mode = "ground-truth"
"#;

#[test]
fn a_result_that_flips_at_half_the_time_step_counts_as_a_collision_and_flips_are_limited() {
    let folder = folder();
    let path = folder.path().join("edge.toml");
    std::fs::write(&path, EDGE).unwrap();
    let path = path.to_str().unwrap();
    let scenario = ["campaign", path, "-n", "400", "--controller", "acc", "--max-collisions", "399"];
    let args = [&scenario[..], &["--check-share", "1"]].concat();
    let run =
        |more: &[&str], expected| json(&closecall(args.iter().chain(more).chain(&["--format", "json"])), expected);
    let report = run(&[], 0);
    let flips = report["checks"]["flips"].as_u64().unwrap();
    assert!((1..=20).contains(&flips), "{flips}");
    let reasons = report["reasons"].as_array().unwrap();
    let is_flip = |reason: &serde_json::Value| reason.as_str().unwrap().contains("flipped at half the time step");
    assert!(reasons.iter().any(is_flip), "{report}");
    assert_eq!(run(&["--max-flip-rate", "0"], 7)["verdict"], "INVALID");
    // Without the checks, samples that collide only at half the step do not count.
    let unchecked = [&scenario[..], &["--check-at-most", "0", "--format", "json"]].concat();
    let collisions = |report: &serde_json::Value| report["controllers"]["acc"]["collisions"].as_u64().unwrap();
    let unchecked_collisions = collisions(&json(&closecall(unchecked), 0));
    assert!((unchecked_collisions..=unchecked_collisions + flips).contains(&collisions(&report)), "{report}");
}

#[test]
fn a_campaign_prints_the_number_of_checked_runs() {
    let path = library("slow-approach");
    let text = stdout(&closecall(["campaign", path.to_str().unwrap(), "-n", "20", "--no-gate"]), 0);
    assert!(text.contains("runs, 0 flipped at half the time step"), "{text}");
}

#[test]
fn a_campaign_without_validity_checks_says_so_in_every_report() {
    let (path, folder) = (library("slow-approach"), folder());
    let out = folder.path().join("out");
    let scenario = ["campaign", path.to_str().unwrap(), "-n", "3", "--no-gate", "--no-validity-checks"];
    let text = stdout(&closecall(scenario.iter().chain(&["--out", out.to_str().unwrap()])), 0);
    let sentence = "the validity of the simulator was not checked";
    assert!(text.contains(sentence), "{text}");
    assert!(!text.contains("for validity checks"), "{text}");
    for file in ["report.html", "junit.xml"] {
        assert!(std::fs::read_to_string(out.join(file)).unwrap().contains(sentence), "{file}");
    }
    let manifest = json_file(&out.join("manifest.json"));
    assert_eq!(manifest["checks"]["off"], true);
    let report = json(&closecall(scenario.iter().chain(&["--format", "json"])), 0);
    assert_eq!(report["checks"]["runs"], 0);
    assert!(report["reasons"].to_string().contains(sentence), "{report}");
}
