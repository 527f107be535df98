//! The course of a sample: whether it shows anything about the system under test.

use closecall_scenarios::criteria::{EGO_COLLIDED, Expression, FlagName, Measure, PairFlag, Quantity, SLOWED_FOR_REAR};
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
}

impl Course {
    /// Returns the course of a sample; `None` unless every arm has an outcome.
    pub(crate) fn of(record: &Record, expects: &[FlagName], function: Function) -> Option<Self> {
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
        Some(Self { happened, acted })
    }
}

/// Returns what a system that never acted did not do, in words.
pub(crate) const fn missing_action(function: Function) -> &'static str {
    match function {
        Function::Mis => "slowed the ego for a vehicle behind",
        Function::Aeb | Function::Acc | Function::AebWithHuman => "moved the ego otherwise than the baseline",
    }
}

/// Returns true if a scenario asks for collisions that the system under test prevents.
pub(crate) fn asks_for_action(config: &ScenarioConfig) -> bool {
    let of_prevented = |check: &Expression| check.quantity == Quantity::Pair(PairFlag::Prevented);
    config.checks.values().flatten().any(of_prevented)
}
