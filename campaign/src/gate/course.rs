//! The course of a sample: whether it shows anything about the system under test.

use closecall_scenarios::criteria::{
    EGO_COLLIDED, Expression, FlagName, Measure, PairFlag, Quantity, SLOWED_FOR_REAR, SLOWED_UNPROMPTED,
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
    /// Whether the system under test slowed the ego before a vehicle behind was near.
    pub(crate) slowed_unprompted: bool,
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
        let slowed_unprompted = Measure::named(SLOWED_UNPROMPTED).is_some_and(|slowed| holds(Quantity::Tested(slowed)));
        Some(Self { happened, acted, slowed_unprompted })
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

/// Returns true if a check of a scenario bounds how often the ego is slowed before a vehicle behind
/// is near.
pub(crate) fn forbids_unprompted_slowing(config: &ScenarioConfig) -> bool {
    let of_slowing = |check: &Expression| {
        Measure::named(SLOWED_UNPROMPTED).is_some_and(|slowed| check.quantity == Quantity::Tested(slowed))
    };
    config.checks.values().flatten().any(of_slowing)
}
