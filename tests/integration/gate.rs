//! Ten deliberately bad controllers against the library with its own requirement checks: each fails
//! or is not judged, and the requirement that it violates is named. The margin increase system
//! (MIS) itself passes.

use std::num::NonZeroUsize;
use std::sync::Arc;
use std::time::Duration;

use closecall_campaign::execution::Campaign;
use closecall_campaign::gate::{GateSet, Standing};
use closecall_campaign::runner::{Sampling, Work};
use closecall_campaign::summary::Summary;
use closecall_campaign::validity::CheckPlan;
use closecall_campaign::verdict::{Decision, Judgement};
use closecall_campaign::workers::Workers;
use closecall_controllers::{
    ControllerError, EgoCommand, EgoController, EgoInput, EgoSettings, EgoStack, EgoState, Reason,
};
use closecall_scenarios::ScenarioFile;
use closecall_scenarios::sampling::Design;
use closecall_sensors::SensorMode;
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::{Arm, ControllerFactory};
use closecall_traffic::Time;

use crate::support::library;

/// Samples of each scenario: as many as a 99th percentile needs.
const SAMPLES: u64 = 300;
/// Samples of each scenario in which a share is judged that is well below one, but not zero: twice as
/// many as decide.
const SHARE_SAMPLES: u64 = 600;
/// Samples of each scenario with a fault: enough to fail.
const FAULT_SAMPLES: u64 = 40;
const SEED: u64 = 1;
/// Every scenario of the library.
const LIBRARY: [&str; 12] = [
    "low-thw-overtake",
    "low-thw-overtake-at-cut-out",
    "overtake-without-brake",
    "left-lane-blocked",
    "rear-follower-stays",
    "slow-approach",
    "empty-wet-road",
    "paper-figure",
    "lead-brakes-at-any-time",
    "lead-brakes-partially",
    "rear-follower-stays-lead-brakes",
    "cut-in-into-margin",
];

/// The scenarios in which the faults are looked for: whatever is found in them is found in the library.
const FAULTS_IN: [&str; 6] = [
    "low-thw-overtake",
    "overtake-without-brake",
    "slow-approach",
    "paper-figure",
    "left-lane-blocked",
    "empty-wet-road",
];

/// The scenario that the system fails, and the requirement: it is more than 10 m/s slower than the
/// vehicle ahead in more than 1 % of the samples.
const MISSED: (&str, &str) = ("cut-in-into-margin", "MIS-6");
/// The scenarios in which the lead vehicle brakes, so that shares of collisions are judged.
const BRAKING: [&str; 4] =
    ["low-thw-overtake", "lead-brakes-at-any-time", "lead-brakes-partially", "rear-follower-stays-lead-brakes"];

/// A fault that a controller adds to the commands of the MIS.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fault {
    /// The MIS accelerates instead of braking.
    SignFlipped,
    /// The ego never brakes.
    NeverBrakes,
    /// The ego always brakes.
    AlwaysBrakes,
    /// The cruise control alone, which says that it has a MIS.
    MisOff,
    /// The MIS says that it is engaged at every step, and brakes gently.
    EngagesAlways,
    /// The MIS engages in every run from 5 s on, whether a rear vehicle is there or not.
    EngagesOnNothing,
    /// The MIS acts 5 s late.
    FiveSecondsLate,
    /// The MIS gains a quarter of the margin.
    GoalOfHalfASecond,
    /// The MIS releases one control step after it engages.
    ReleasesAtOnce,
    /// The commands jump between braking and accelerating.
    Random,
    /// One command in 1,000 is not a number.
    NotANumber,
}

/// The faults, and a requirement that each violates; `None` if the campaign itself ends in errors.
const FAULTS: [(Fault, Option<&str>); 11] = [
    (Fault::SignFlipped, Some("MIS-1")),
    (Fault::NeverBrakes, Some("MIS-1")),
    (Fault::AlwaysBrakes, Some("MIS-6")),
    (Fault::MisOff, Some("MIS-7")),
    (Fault::EngagesAlways, Some("MIS-5")),
    (Fault::EngagesOnNothing, Some("MIS-5")),
    (Fault::FiveSecondsLate, Some("MIS-7")),
    (Fault::GoalOfHalfASecond, Some("MIS-7")),
    (Fault::ReleasesAtOnce, Some("MIS-7")),
    (Fault::Random, Some("MIS-7")),
    (Fault::NotANumber, None),
];

impl ControllerFactory for Fault {
    fn name(&self) -> &str {
        "faulty"
    }

    fn has_mis(&self, settings: &EgoSettings) -> bool {
        settings.mis().is_some()
    }

    /// The states are states of this program's system, with a fault.
    fn is_built_in(&self) -> bool {
        true
    }

    fn build(&self, settings: &EgoSettings) -> Box<dyn EgoController> {
        let without = EgoStack::new(settings.without_mis());
        Box::new(Faulty { fault: *self, stack: EgoStack::new(*settings), without, engaged_at: None, steps: 0 })
    }
}

struct Faulty {
    fault: Fault,
    stack: EgoStack,
    without: EgoStack,
    engaged_at: Option<Time>,
    steps: u64,
}

/// The acceleration of a controller that always brakes (m/s²).
const ALWAYS_MPS2: f64 = -2.0;
/// The gentle braking of one that engages without a reason (m/s²).
const GENTLE_MPS2: f64 = -0.5;
/// How late the late one is.
const LATE: Time = Time::from_ms(5_000);

impl EgoController for Faulty {
    fn step(&mut self, input: &EgoInput<'_>) -> Result<EgoCommand, ControllerError> {
        let command = self.stack.step(input)?;
        let base = self.without.step(input)?;
        self.steps += 1;
        if matches!(command.state, EgoState::Increasing | EgoState::Holding) {
            self.engaged_at.get_or_insert(input.time);
        }
        let engaged = |acceleration_mps2: f64| EgoCommand {
            acceleration_mps2,
            state: EgoState::Increasing,
            reason: Reason::Engaged,
            ..command
        };
        let accelerated = |acceleration_mps2: f64| EgoCommand { acceleration_mps2, ..command };
        Ok(match self.fault {
            Fault::SignFlipped if command.state == EgoState::Increasing => accelerated(-command.acceleration_mps2),
            Fault::SignFlipped => command,
            Fault::NeverBrakes => accelerated(command.acceleration_mps2.max(0.0)),
            Fault::AlwaysBrakes => accelerated(base.acceleration_mps2.min(ALWAYS_MPS2)),
            Fault::MisOff => base,
            Fault::EngagesAlways => engaged(base.acceleration_mps2.min(GENTLE_MPS2)),
            Fault::EngagesOnNothing if input.time >= LATE => engaged(base.acceleration_mps2.min(GENTLE_MPS2)),
            Fault::EngagesOnNothing => base,
            Fault::FiveSecondsLate => match self.engaged_at {
                Some(since) if input.time >= since + LATE => command,
                _ => EgoCommand { state: command.state, ..base },
            },
            Fault::GoalOfHalfASecond if command.state == EgoState::Increasing => {
                accelerated(base.acceleration_mps2.min(0.25 * command.acceleration_mps2))
            }
            Fault::GoalOfHalfASecond => command,
            Fault::ReleasesAtOnce => match self.engaged_at {
                Some(since) if input.time == since => command,
                _ => EgoCommand { state: base.state, ..base },
            },
            Fault::Random if self.steps.is_multiple_of(7) => accelerated(ALWAYS_MPS2),
            Fault::Random if self.steps.is_multiple_of(3) => accelerated(-ALWAYS_MPS2),
            Fault::Random => base,
            Fault::NotANumber if self.steps.is_multiple_of(1_000) => accelerated(f64::NAN),
            Fault::NotANumber => command,
        })
    }
}

/// Runs scenarios with the cruise control and with the controller under test, and judges them by
/// their own checks.
fn judged(
    names: &[&str],
    tested: &Arc<dyn ControllerFactory>,
    samples: u64,
    checks: CheckPlan,
) -> (Summary, Judgement) {
    let sampling = Sampling { seed: SEED, design: Design::Random, samples };
    let arm = |controller| Arm { controller, sensors: Some(SensorMode::GroundTruth) };
    let work = |name: &&str| {
        let file = ScenarioFile::load(&library(name), &[]).unwrap();
        let arms = vec![arm(BuiltIn::Acc.factory()), arm(tested.clone())];
        Arc::new(Work { file, sampling, arms, checks, retry_crashed: 0 })
    };
    let workers = Workers { jobs: NonZeroUsize::MIN.saturating_add(1), sample_timeout: Duration::from_mins(10) };
    Campaign::new(names.iter().map(work).collect(), workers).judge(&GateSet::default()).unwrap()
}

/// Returns the requirements that are not met.
fn violated(judged: &Judgement) -> Vec<&str> {
    let failed = judged.requirements.iter().filter(|requirement| requirement.standing == Standing::Fail);
    failed.map(|requirement| requirement.mark.as_str()).collect()
}

#[test]
fn the_mis_passes_the_requirements_of_the_library_but_the_one_that_the_readme_names() {
    let is_missed = |name: &&&str| **name == MISSED.0;
    let (braking, others): (Vec<&str>, Vec<&str>) =
        LIBRARY.iter().filter(|name| !is_missed(name)).partition(|name| BRAKING.contains(name));
    let mut headline = None;
    for (names, samples) in [(others, SAMPLES), (braking, SHARE_SAMPLES)] {
        let (summary, judged) = judged(&names, &BuiltIn::Mis.factory(), samples, CheckPlan::default());
        assert_eq!(judged.decision, Decision::Pass, "{:#?}", judged.reasons);
        assert!(judged.requirements.iter().all(|requirement| requirement.standing == Standing::Pass));
        headline = summary.scenarios.into_iter().find(|(name, _)| name == "low-thw-overtake").or(headline);
    }
    let (_, missed) = judged(&[MISSED.0], &BuiltIn::Mis.factory(), SAMPLES, CheckPlan::default());
    assert_eq!(violated(&missed), [MISSED.1], "{:#?}", missed.reasons);
    let (_, headline) = headline.unwrap();
    assert!(headline.pairs.prevented > headline.pairs.induced);
    assert_eq!(headline.pairs.prevented + headline.pairs.both, headline.arms[0].collisions);
    let of_others = headline.pairs.induced_of_others + headline.pairs.both_of_others;
    assert_eq!(headline.pairs.induced + headline.pairs.both, headline.arms[1].collisions + of_others);
}

#[test]
fn each_bad_controller_violates_a_requirement_that_is_named() {
    let mut wrong = Vec::new();
    for (fault, requirement) in FAULTS {
        let tested: Arc<dyn ControllerFactory> = Arc::new(fault);
        // Each check takes nine runs, and a failure needs none.
        let (_, judged) = judged(&FAULTS_IN, &tested, FAULT_SAMPLES, CheckPlan::off());
        let is_found = match requirement {
            Some(mark) => judged.decision == Decision::Fail && violated(&judged).contains(&mark),
            None => judged.decision == Decision::SampleError,
        };
        if !is_found {
            wrong.push(format!("{fault:?}: {:?}, {:?}", judged.decision, violated(&judged)));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn the_cruise_control_alone_prevents_and_induces_no_collision() {
    let (summary, judged) = judged(&["low-thw-overtake"], &BuiltIn::Acc.factory(), SAMPLES, CheckPlan::default());
    let pairs = summary.total().pairs;
    assert_eq!((pairs.prevented, pairs.induced), (0, 0));
    assert!(pairs.both > 0 && pairs.neither > 0);
    assert_eq!(violated(&judged), ["MIS-1"]);
}
