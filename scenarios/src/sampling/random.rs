//! Independent random samples.
//!
//! Each parameter draws from its own random stream, keyed by its name, so that adding or removing a
//! parameter does not change the others.

use closecall_traffic::{ActorId, ParameterName, Parameters, Stream, stream};
use rand::RngExt;

use crate::parameters::ParameterSpace;

/// Key of the random streams of parameters, which belong to no actor. Their channel names contain a
/// `/`, which the name of a component never does, so that an actor of the same name shares no
/// stream with them.
const OWNER: &str = "scenario";

/// Returns the parameter values of sample `index`.
pub(super) fn sample(space: &ParameterSpace, seed: u64, index: u64) -> Parameters {
    space.values(space.iter().map(|(name, _)| number(seed, index, name)).collect())
}

/// Returns the number u of a parameter.
pub(super) fn number(seed: u64, index: u64, name: &ParameterName) -> f64 {
    scenario_stream(seed, index, &format!("parameter/{name}")).random()
}

/// Returns a random stream that belongs to the scenario as a whole, not to an actor.
pub(crate) fn scenario_stream(seed: u64, index: u64, channel: &str) -> Stream {
    #[expect(clippy::expect_used, reason = "a constant, and a test draws from it")]
    let owner = ActorId::new(OWNER).expect("a legal name");
    stream(seed, index, &owner, channel)
}
