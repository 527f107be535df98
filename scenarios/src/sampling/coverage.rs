//! Random samples that visit the bins of a coverage item or cross in turn.
//!
//! Within a bin the numbers u are uniform and independent, so that a sample of the bin is one of
//! the scenario's distribution, given the bin.

use closecall_traffic::{ParameterName, Parameters};

use super::random;
use crate::parameters::ParameterSpace;

/// Returns the parameter values of sample `index`. Without bins the random design gives it.
pub(super) fn sample(space: &ParameterSpace, seed: u64, index: u64) -> Parameters {
    let parts = space.strata().of_sample(index);
    let number = |(parameter, (name, _)): (usize, (&ParameterName, _))| {
        let u = random::number(seed, index, name);
        parts.iter().find(|part| part.parameter == parameter).map_or(u, |part| {
            let [low, high] = part.interval;
            // Rounding must not reach the upper end, which belongs to the next bin.
            (low + u * (high - low)).min(high.next_down()).max(low)
        })
    };
    space.values(space.iter().enumerate().map(number).collect())
}
