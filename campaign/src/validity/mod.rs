//! Whether the simulator can be believed: some samples of each campaign are run again under changes that must not matter.
//!
//! | check            | what is changed                                        | what must hold                          |
//! |------------------|--------------------------------------------------------|-----------------------------------------|
//! | half step        | vehicles and drivers at 200 Hz instead of 100 Hz       | the same verdict in nearly every sample |
//! | order of actors  | the list of actors is reversed                         | the same bits                           |
//! | threads          | a fresh thread beside those that the campaign has      | the same bits                           |
//! | repetition       | nothing                                                | the same bits                           |
//! | mirror           | left and right are exchanged, object-level sensors     | the mirror image of the outcome         |
//!
//! A bend has no mirror image: positions along the road are counted on its left edge. There the last check is left out.
//!
//! A verdict that flips at half the step says that this sample lies on the edge of what the step can resolve. The sample
//! stays in the campaign, and is judged by the verdict that speaks worse for the system under test; more than a few flips
//! make the campaign invalid. Any other difference is an error of the simulator, and makes it invalid at once.

mod counts;
mod mirror;
mod plan;
mod probe;

pub use counts::{ArmChecks, CheckCounts, Invariance};
pub use plan::{CheckPlan, NotAPlan};
pub(crate) use probe::Subject;
