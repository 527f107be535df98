//! Samples that repeat the parameters of an earlier one.

use std::collections::BTreeMap;

use closecall_scenarios::parameters::{ParameterSpace, Variation};
use closecall_traffic::Parameters;

use super::record::Record;

/// The parameters of the samples so far, if a scenario samples from finitely many: a repeated encounter is no new evidence.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Repeats {
    /// Whether some vehicle has collided in the arm under test with these parameters; `None` if no two samples agree.
    seen: Option<BTreeMap<String, bool>>,
}

impl Repeats {
    pub(crate) fn of(space: &ParameterSpace) -> Self {
        Self { seen: (space.variation() == Variation::Discrete).then(BTreeMap::new) }
    }

    /// Returns true if a sample counts: its parameters are new, it ended in an error, or it is the first one with its
    /// parameters in which vehicles collide. A collision is thus never left out.
    pub(crate) fn counts(&mut self, record: &Record) -> bool {
        let Some(seen) = &mut self.seen else { return true };
        if record.arms.iter().any(|arm| arm.result.is_err()) {
            return true;
        }
        let Some(outcome) = record.arms.last().and_then(|arm| arm.result.as_ref().ok()) else { return true };
        let collides = record.tallies().last().is_some_and(|tested| tested.collided == Some(true))
            || !outcome.collisions.is_empty();
        match seen.get_mut(&key(&outcome.parameters)) {
            Some(collided) => !std::mem::replace(collided, *collided || collides) && collides,
            None => {
                seen.insert(key(&outcome.parameters), collides);
                true
            }
        }
    }
}

fn key(parameters: &Parameters) -> String {
    parameters.iter().map(|(name, value)| format!("{name}={value:?};")).collect()
}
