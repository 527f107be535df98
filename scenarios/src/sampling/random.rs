//! Independent random samples.
//!
//! Each parameter draws from a stream of its own, keyed by its name: adding or removing a parameter changes none of
//! the others.

use closecall_traffic::{ActorId, Parameters, Stream, stream};
use rand::RngExt;

use crate::parameters::ParameterSpace;

/// Keys the streams of the parameters, which belong to no actor. The channels below hold a `/`, as no name of a
/// component does, so that an actor of this name shares no stream with them.
const OWNER: &str = "scenario";

pub(super) fn sample(space: &ParameterSpace, seed: u64, index: u64) -> Parameters {
    space.map(|name, _, distribution| {
        distribution.quantile(scenario_stream(seed, index, &format!("parameter/{name}")).random())
    })
}

/// A random stream for something of the scenario as a whole.
pub(super) fn scenario_stream(seed: u64, index: u64, channel: &str) -> Stream {
    #[expect(clippy::expect_used, reason = "a constant, and a test draws from it")]
    let owner = ActorId::new(OWNER).expect("a legal name");
    stream(seed, index, &owner, channel)
}
