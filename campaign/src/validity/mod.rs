//! Validity checks of the simulator: some samples of each campaign run again under changes that
//! must not matter.
//!
//! | check       | what is changed                                      | what must hold                          |
//! | ----------- | ---------------------------------------------------- | --------------------------------------- |
//! | half step   | vehicles and drivers at 200 Hz instead of 100 Hz     | the same verdict in nearly every sample |
//! | actor order | the list of actors is reversed                       | the same bits                           |
//! | threads     | the run uses a new thread besides the campaign's own | the same bits                           |
//! | repetition  | nothing; a new process, if the controller has one    | the same bits                           |
//! | mirror      | left and right are exchanged, object-level sensors   | the mirror image of the outcome         |
//! | clustering  | another DBSCAN clusters each scan a second time      | the same clusters                       |
//!
//! The mirror check is skipped on a curved road, which has no mirror image: positions along the
//! road are measured on its left edge.
//!
//! The controllers of libraries and FMUs run many samples in one process. The first two samples are
//! repeated in a new one.
//!
//! Time is no defect of the simulator: a check whose run takes too long has no result (*not
//! checked*).
//!
//! If halving the step flips the verdict of a sample, the sample lies at the limit of the step's
//! resolution. It stays in the campaign, with the verdict that is worse for the system under test.
//! More than a few flips make the campaign invalid. Any other difference is an error of the
//! simulator and makes the campaign invalid at once.

mod counts;
mod mirror;
mod plan;
mod probe;

pub use counts::{ArmChecks, CheckCounts, Invariance, RunOfScenario};
pub(crate) use plan::ALWAYS_CHECKED;
pub use plan::{CheckPlan, CheckPlanError};
pub(crate) use probe::CheckedRun;
