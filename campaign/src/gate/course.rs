//! The course of a sample: whether it shows anything about the system under test.

use closecall_scenarios::criteria::{
    Comparison, EGO_COLLIDED, Expression, FlagName, Measure, Operator, PairFlag, Quantity, REAR_NEAR, SLOWED_FOR_REAR,
    SLOWED_UNPROMPTED, Side, UNPROMPTED_DEFICIT,
};
use closecall_scenarios::{Function, ScenarioConfig};
use serde::{Deserialize, Serialize};

use super::evaluate::value;
use crate::record::{ArmRecord, Record};

/// What a sample says about whether it shows anything about the system under test.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Course {
    /// Whether everything that the scenario expects happened, in every arm. A run that the ego's
    /// collision ended counts as one in which everything happened. Its further course is unknown,
    /// and the collision itself is no pass.
    pub(crate) happened: bool,
    /// Whether the system under test acted: it slowed the ego for a vehicle behind, or moved it
    /// otherwise than the baseline.
    pub(crate) acted: bool,
    /// Whether the system under test slowed the ego before a vehicle behind was near, by the checks
    /// of the scenario; `None` if no check counts the sample.
    pub(crate) slowed_unprompted: Option<bool>,
}

impl Course {
    /// Returns the course of a sample, with the checks that bound how often the ego is slowed;
    /// `None` unless every arm has an outcome.
    pub(crate) fn of(
        record: &Record,
        expects: &[FlagName],
        function: Function,
        of_slowing: &[Expression],
    ) -> Option<Self> {
        if record.arms.iter().any(|arm| arm.result.is_err()) {
            return None;
        }
        let acted = match function {
            Function::Mis => {
                let slowed =
                    Measure::named(SLOWED_FOR_REAR).and_then(|measure| value(Quantity::Tested(measure), record));
                // A journal without the value does not show that the system was idle.
                slowed != Some(0.0)
            }
            Function::Aeb | Function::Acc | Function::AebWithHuman => {
                let margins = |arm: Option<&ArmRecord>| {
                    arm.and_then(|arm| arm.result.as_ref().ok()).map(|outcome| outcome.margins)
                };
                margins(record.arms.first()) != margins(record.arms.last())
            }
        };
        let holds = |quantity: Quantity| value(quantity, record) == Some(1.0);
        let collided = Measure::named(EGO_COLLIDED);
        let is_paired = record.arms.len() > 1;
        let happened = expects.iter().all(|flag| {
            let happened_in = |quantity: fn(&'static Measure) -> Quantity| {
                holds(quantity(flag.measure())) || collided.is_some_and(|collided| holds(quantity(collided)))
            };
            happened_in(Quantity::Tested) && (!is_paired || happened_in(Quantity::Baseline))
        });
        Some(Self { happened, acted, slowed_unprompted: slowed_unprompted(of_slowing, record) })
    }
}

/// Returns what a system that never, or hardly ever, acted did not do, in words. `runs` names the
/// runs in which it was tested.
pub(crate) fn missing_action(function: Function, acted: u64, runs: &str) -> String {
    let action = match function {
        Function::Mis => "slowed the ego for a vehicle behind",
        Function::Aeb | Function::Acc | Function::AebWithHuman => "moved the ego otherwise than the baseline",
    };
    if acted == 0 { format!("never {action} in {runs}") } else { format!("{action} in only {acted} of {runs}") }
}

/// Returns true if a system acted in too few runs to be tested.
pub(crate) fn is_idle(least_action: Option<f64>, (acted, runs): (u64, u64)) -> bool {
    least_action.is_some_and(|least| runs > 0 && acted as f64 <= least * runs as f64)
}

/// Share of the samples in which a margin increase system acts at least where a vehicle behind comes
/// near in nearly every one (-): an assumption; 0 to 0.5 are plausible. `mis` acts in most of them,
/// and noise of the sensors alone moves the ego in a few.
const LEAST_ACTION: f64 = 0.05;

/// Returns the share of the samples in which the system under test must act to be tested, a share
/// that it must exceed; `None` if the scenario asks for no action.
///
/// A scenario asks for action if it asks for collisions that the system prevents, or if it expects
/// that a vehicle behind meets the conditions for engaging. It does not if it bounds how often the
/// system acts.
pub(crate) fn least_action(config: &ScenarioConfig) -> Option<f64> {
    let checks = || config.checks.values().flatten();
    if checks().any(|check| check.quantity == Quantity::Pair(PairFlag::Prevented)) {
        return Some(0.0);
    }
    let is_of_action = |check: &Expression| match check.quantity {
        Quantity::Tested(measure) => measure.name == SLOWED_FOR_REAR,
        _ => false,
    };
    let stays_off = checks().any(|check| is_of_action(check) && check.operator == Operator::AtMost);
    let comes_near = config.expects.iter().any(|flag| flag.measure().name == REAR_NEAR);
    (config.function == Function::Mis && comes_near && !stays_off).then_some(LEAST_ACTION)
}

/// Returns the checks of a scenario that bound how often, or by how much, the ego is slowed before a
/// vehicle behind is near.
pub(crate) fn checks_of_slowing(config: &ScenarioConfig) -> Vec<Expression> {
    let of_slowing = |check: &&Expression| {
        let is_bounded = match check.quantity {
            Quantity::Tested(measure) => [SLOWED_UNPROMPTED, UNPROMPTED_DEFICIT].contains(&measure.name),
            Quantity::Compared(comparison) => {
                let Comparison { measure, in_baseline, side, .. } = comparison;
                measure.name == UNPROMPTED_DEFICIT && side == Side::Above && !in_baseline
            }
            Quantity::Baseline(_) | Quantity::Pair(_) | Quantity::Covered(_) => false,
        };
        is_bounded && check.operator == Operator::AtMost
    };
    config.checks.values().flatten().filter(of_slowing).copied().collect()
}

/// Returns whether the ego was slowed in the sense of a check that counts the sample; `None` if no
/// check counts it: its condition does not hold, or needs a baseline that is not there.
fn slowed_unprompted(of_slowing: &[Expression], record: &Record) -> Option<bool> {
    let slowed = |check: &Expression| {
        let counts = check.condition.is_none_or(|condition| value(condition, record) == Some(1.0));
        let value = value(check.quantity, record).filter(|_| counts)?;
        // A number is bounded by the check, and a flag holds or not.
        Some(if check.aggregate.is_of_flag() { value == 1.0 } else { value > check.bound })
    };
    of_slowing.iter().filter_map(slowed).reduce(|one, other| one || other)
}

#[cfg(test)]
mod tests {
    use closecall_scenarios::source;
    use closecall_sensors::SensorMode;
    use closecall_simulation::controller::BuiltIn;
    use closecall_simulation::{Arm, NoObserver, RunKey, simulate};

    use super::*;

    /// Returns a sample whose ego is slower by these amounts before a vehicle behind is near (m/s):
    /// with the baseline, if there is one, and with the system under test.
    fn record(deficits_mps: &[f64]) -> Record {
        let file = source::load("low-thw-overtake".as_ref(), &["duration-s=1".parse().unwrap()]).unwrap();
        let scenario = file.concrete(&file.space().nominal()).unwrap();
        let arm = Arm { controller: BuiltIn::Mis.factory(), sensors: Some(SensorMode::GroundTruth) };
        let outcome = simulate(&scenario, RunKey { seed: 1, sample: 0 }, &arm, &mut NoObserver).unwrap();
        let arm = |deficit_mps: &f64| {
            let mut outcome = outcome.clone();
            outcome.cost.as_mut().unwrap().unprompted_deficit_mps = *deficit_mps;
            ArmRecord::new("one".to_owned(), Ok(outcome))
        };
        Record { scenario: "s".to_owned(), sample: 0, arms: deficits_mps.iter().map(arm).collect() }
    }

    fn slowed(check: &str, deficits_mps: &[f64]) -> Option<bool> {
        slowed_unprompted(&[check.parse().unwrap()], &record(deficits_mps))
    }

    #[test]
    fn a_scenario_asks_for_action_unless_it_bounds_how_often_the_system_acts() {
        let least = |name: &str| least_action(source::load(name.as_ref(), &[]).unwrap().config());
        for name in ["low-thw-overtake", "busy-overtake", "aeb-lead-brakes"] {
            assert_eq!(least(name), Some(0.0), "{name}");
        }
        for name in ["overtake-without-brake", "rear-follower-stays", "ramp-merges", "paper-figure"] {
            assert_eq!(least(name), Some(LEAST_ACTION), "{name}");
        }
        for name in ["left-lane-blocked", "trucks-alongside", "slow-approach", "empty-wet-road", "acc-lead-slows"] {
            assert_eq!(least(name), None, "{name}");
        }
    }

    #[test]
    fn an_ego_is_slowed_in_the_sense_of_the_checks_with_their_conditions() {
        assert_eq!(slowed("upper(slowed_unprompted) <= 0.05", &[0.2]), Some(false));
        assert_eq!(slowed("upper(slowed_unprompted) <= 0.05", &[8.0]), Some(true));
        let compared = "upper(unprompted_deficit_mps > 2 | baseline.unprompted_deficit_mps < 0.5) <= 0.05";
        assert_eq!(slowed(compared, &[0.1, 8.0]), Some(true));
        assert_eq!(slowed(compared, &[0.1, 1.8]), Some(false));
        assert_eq!(slowed(compared, &[1.0, 8.0]), None, "the driver is slower without the system");
        assert_eq!(slowed(compared, &[8.0]), None, "there is no baseline");
        assert_eq!(slowed("p95(unprompted_deficit_mps) <= 3", &[4.0]), Some(true));
        assert_eq!(slowed_unprompted(&[], &record(&[8.0])), None);
    }
}
