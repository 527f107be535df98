//! The checks of the simulator: they find what they are there for, and what they find counts.

use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use closecall_campaign::verdict::Decision;
use closecall_campaign::execution::Campaign;
use closecall_campaign::runner::{Sampling, Work};
use closecall_campaign::summary::{Counts, Summary};
use closecall_campaign::validity::{CheckPlan, Invariance};
use closecall_campaign::verdict::{Gates, Verdict};
use closecall_campaign::workers::Workers;
use closecall_controllers::{ControllerError, EgoCommand, EgoController, EgoInput, EgoSettings, EgoStack};
use closecall_scenarios::sampling::Design;
use closecall_sensors::SensorMode;
use closecall_simulation::scenario::ScenarioFile;
use closecall_simulation::{Arm, ControllerFactory};
use closecall_traffic::Side;

use crate::support::{closecall, folder, json, library, stdout};

/// What a controller must not depend on.
#[derive(Clone, Copy)]
enum DependsOn {
    Nothing,
    HowOftenItRan,
    ItsThread,
    NumbersOfTracks,
    LeftAndRight,
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

/// Far from any collision, too small to matter, and in every bit of the outcome [m/s²].
const WHIM_MPS2: f64 = -1e-3;
/// Into the vehicle ahead [m/s²].
const RECKLESS_MPS2: f64 = 4.0;

impl EgoController for FlawedStack {
    fn step(&mut self, input: &EgoInput<'_>) -> Result<EgoCommand, ControllerError> {
        let command = self.stack.step(input)?;
        let acceleration_mps2 = command.acceleration_mps2
            + match self.on {
                DependsOn::Nothing => 0.0,
                DependsOn::HowOftenItRan => WHIM_MPS2 * self.run as f64,
                DependsOn::ItsThread if std::thread::current().name() == Some("check") => WHIM_MPS2,
                DependsOn::ItsThread => 0.0,
                DependsOn::NumbersOfTracks => input.tracks.iter().map(|track| WHIM_MPS2 * f64::from(track.id.0)).sum(),
                DependsOn::LeftAndRight if input.road.overtaking_side() == Side::Left => {
                    RECKLESS_MPS2 - command.acceleration_mps2
                }
                DependsOn::LeftAndRight => 0.0,
            };
        Ok(EgoCommand { acceleration_mps2, ..command })
    }
}

/// The headline with a flawed controller, every sample checked.
fn checked(on: DependsOn) -> Summary {
    let file = ScenarioFile::load(&library("low-thw-overtake"), &[]).unwrap();
    let controller = Arc::new(Flawed { on, runs: AtomicU64::new(0) });
    let arms = vec![Arm { controller, sensors: Some(SensorMode::GroundTruth) }];
    let sampling = Sampling { seed: 5, design: Design::Random, samples: 6 };
    let workers = Workers { jobs: NonZeroUsize::MIN, sample_timeout: Duration::from_secs(60) };
    let work = Arc::new(Work { file, sampling, arms, checks: CheckPlan::new(1.0, 100).unwrap() });
    let mut summary = campaign.summary();
    Campaign::new(vec![work.clone()], workers)
        .run(None, |next| {
            summary.push(next.record);
            ControlFlow::Continue(())
        })
        .unwrap();
    summary
}

fn found(counts: &Counts) -> Vec<(Invariance, u64)> {
    counts.checks.broken().collect()
}

#[test]
fn each_check_finds_what_it_is_there_for() {
    for (on, expected) in [
        (DependsOn::HowOftenItRan, Invariance::Repetition),
        (DependsOn::ItsThread, Invariance::Threads),
        (DependsOn::NumbersOfTracks, Invariance::ActorOrder),
        (DependsOn::LeftAndRight, Invariance::Mirror),
    ] {
        let summary = checked(on);
        assert_eq!(found(&summary.total()), [(expected, 6)], "{expected:?}");
        let judged = summary.judge(Gates::default());
        assert_eq!((judged.verdict, judged.decision), (Verdict::Invalid, Decision::Invalid));
        assert!(judged.reasons[0].contains(expected.finding()), "{:?}", judged.reasons);
    }
}

#[test]
fn a_sound_controller_is_not_found_fault_with() {
    let total = checked(DependsOn::Nothing).total();
    assert_eq!((found(&total), total.checks.runs, total.invalid), (Vec::new(), 6, 0));
}

/// R brakes between two steps of 10 ms, and gaps are drawn so closely around where it just does or does not hit E that
/// half the step makes a difference in some samples.
const EDGE: &str = r#"
schema-version = 1
name = "edge-of-the-step"
duration-s = 1.0
road = { lanes = 1 }

[parameters]
gap-m = { uniform = { min = 7.8, max = 8.0 }, assumed = "around where they just touch" }

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
fn a_verdict_that_flips_at_half_the_step_is_judged_by_its_worse_side_and_bounded() {
    let folder = folder();
    let path = folder.path().join("edge.toml");
    std::fs::write(&path, EDGE).unwrap();
    let path = path.to_str().unwrap();
    let args = ["campaign", path, "-n", "400", "--controller", "acc", "--check-share", "1"];
    let run =
        |more: &[&str], expected| json(&closecall(args.iter().chain(more).chain(&["--format", "json"])), expected);
    let report = run(&[], 0);
    let flips = report["checks"]["flips"].as_u64().unwrap();
    assert!((1..=20).contains(&flips), "{flips}");
    assert!(report["reasons"][0].as_str().unwrap().contains("flipped at half the time step"), "{report}");
    assert_eq!(run(&["--max-flip-rate", "0"], 7)["verdict"], "INVALID");
    // The same samples, nearly unchecked: the flipped ones that collided only at half the step are missing.
    let unchecked = ["campaign", path, "-n", "400", "--controller", "acc", "--check-at-most", "0", "--format", "json"];
    let collisions = |report: &serde_json::Value| report["controllers"]["acc"]["collisions"].as_u64().unwrap();
    let as_run = collisions(&json(&closecall(unchecked), 0));
    assert!(collisions(&report) >= as_run && collisions(&report) <= as_run + flips, "{report}");
}

#[test]
fn people_are_told_how_much_was_checked() {
    let path = library("slow-approach");
    let text = stdout(&closecall(["campaign", path.to_str().unwrap(), "-n", "20"]), 0);
    assert!(text.contains("runs, 0 flipped at half the time step"), "{text}");
}
