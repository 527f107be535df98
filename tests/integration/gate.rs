//! The gate distinguishes a controller that helps from one that does nothing, does harm, or acts too late.

use std::num::NonZeroUsize;
use std::sync::Arc;
use std::time::Duration;

use closecall_campaign::execution::Campaign;
use closecall_campaign::ledger::Inference;
use closecall_campaign::runner::{Sampling, Work};
use closecall_campaign::summary::Counts;
use closecall_campaign::validity::CheckPlan;
use closecall_campaign::verdict::{Decision, Evidence, Gates};
use closecall_campaign::workers::Workers;
use closecall_controllers::{ControllerError, EgoCommand, EgoController, EgoInput, EgoSettings, EgoStack, EgoState};
use closecall_scenarios::sampling::Design;
use closecall_sensors::SensorMode;
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::scenario::ScenarioFile;
use closecall_simulation::{Arm, ControllerFactory};
use closecall_traffic::Time;

use crate::support::library;

const SAMPLES: u64 = 200;
const SEED: u64 = 1;

/// A fault that a controller adds to the commands of the margin increase system (MIS).
#[derive(Clone, Copy)]
enum Fault {
    /// The MIS accelerates instead of braking.
    SignFlipped,
    /// The ego always brakes.
    AlwaysBrakes,
    /// The MIS acts 5 s late.
    FiveSecondsLate,
}

impl ControllerFactory for Fault {
    fn name(&self) -> &str {
        match self {
            Self::SignFlipped => "sign-flipped",
            Self::AlwaysBrakes => "always-brakes",
            Self::FiveSecondsLate => "late",
        }
    }

    fn has_mis(&self, settings: &EgoSettings) -> bool {
        settings.mis().is_some()
    }

    fn build(&self, settings: &EgoSettings) -> Box<dyn EgoController> {
        let without = EgoStack::new(settings.without_mis());
        Box::new(Faulty { fault: *self, stack: EgoStack::new(*settings), without, engaged_at: None })
    }
}

struct Faulty {
    fault: Fault,
    stack: EgoStack,
    without: EgoStack,
    engaged_at: Option<Time>,
}

/// The acceleration of a controller that always brakes (m/s²).
const ALWAYS_MPS2: f64 = -2.0;

impl EgoController for Faulty {
    fn step(&mut self, input: &EgoInput<'_>) -> Result<EgoCommand, ControllerError> {
        let command = self.stack.step(input)?;
        let base = self.without.step(input)?;
        let is_active = matches!(command.state, EgoState::Increasing | EgoState::Holding);
        if is_active {
            self.engaged_at.get_or_insert(input.time);
        }
        Ok(match self.fault {
            Fault::SignFlipped if command.state == EgoState::Increasing => {
                EgoCommand { acceleration_mps2: -command.acceleration_mps2, ..command }
            }
            Fault::SignFlipped => command,
            Fault::AlwaysBrakes => EgoCommand { acceleration_mps2: base.acceleration_mps2.min(ALWAYS_MPS2), ..command },
            Fault::FiveSecondsLate => match self.engaged_at {
                Some(since) if input.time >= since + Time::from_ms(5_000) => command,
                _ => EgoCommand { state: command.state, ..base },
            },
        })
    }
}

/// Runs a scenario with the cruise control and with the controller under test.
fn counts(name: &str, tested: Arc<dyn ControllerFactory>) -> Counts {
    let file = ScenarioFile::load(&library(name), &[]).unwrap();
    let sampling = Sampling { seed: SEED, design: Design::Random, samples: SAMPLES };
    let arm = |controller| Arm { controller, sensors: Some(SensorMode::Object) };
    let arms = vec![arm(BuiltIn::Acc.factory()), arm(tested)];
    let workers = Workers { jobs: NonZeroUsize::MIN.saturating_add(1), sample_timeout: Duration::from_mins(5) };
    let work = Arc::new(Work { file, sampling, arms, checks: CheckPlan::default() });
    Campaign::new(vec![work], workers).count().unwrap().total()
}

#[test]
fn the_mis_prevents_more_than_half_of_the_collisions() {
    let counts = counts("low-thw-overtake", BuiltIn::Mis.factory());
    let [without, with] = counts.arms[..] else { panic!("two arms") };
    assert_eq!(counts.errors() + counts.invalid, 0);
    let share = without.collision_rate().unwrap();
    assert!((0.15..=0.5).contains(&share), "{share}");
    assert!(2 * with.collisions <= without.collisions, "{counts:?}");
    assert!(passes(&counts), "{counts:?}");
    assert!(counts.pairs.prevented > counts.pairs.induced);
    assert_eq!(counts.pairs.prevented + counts.pairs.both, without.collisions);
    assert_eq!(counts.pairs.induced + counts.pairs.both, with.collisions);
}

#[test]
fn the_cruise_control_alone_prevents_and_induces_no_collision() {
    let counts = counts("low-thw-overtake", BuiltIn::Acc.factory());
    assert_eq!((counts.pairs.prevented, counts.pairs.induced), (0, 0));
    assert!(counts.pairs.both > 0 && counts.pairs.neither > 0);
}

/// The most by which the ego may be slower than the lead vehicle (m/s). The MIS, braking at 1 m/s² until the rear
/// vehicle has arrived, stays below.
const MAX_SPEED_DEFICIT_MPS: f64 = 15.0;

/// Returns true if a controller passes the gate of a regression test: at most half of the collisions without it, and a
/// bounded speed deficit.
fn passes(counts: &Counts) -> bool {
    let gates = Gates {
        max_collisions: Some(counts.arms[0].collisions / 2),
        max_speed_deficit_mps: Some(MAX_SPEED_DEFICIT_MPS),
        ..Gates::default()
    };
    let evidence = Evidence {
        tested: &counts.arms[1],
        scenarios: &[],
        errors: counts.errors(),
        checks: &counts.checks,
        pairs: Some(&counts.pairs),
        inference: Inference::FixedSamples,
    };
    gates.judge(&evidence).decision == Decision::Pass
}

#[test]
fn a_mis_with_a_flipped_sign_fails() {
    let counts = counts("low-thw-overtake", Arc::new(Fault::SignFlipped));
    assert!(!passes(&counts), "{counts:?}");
}

#[test]
fn a_controller_that_always_brakes_fails() {
    let counts = counts("low-thw-overtake", Arc::new(Fault::AlwaysBrakes));
    assert!(!passes(&counts), "{counts:?}");
}

#[test]
fn a_mis_that_acts_five_seconds_late_fails() {
    let counts = counts("low-thw-overtake", Arc::new(Fault::FiveSecondsLate));
    assert!(!passes(&counts), "{counts:?}");
}
