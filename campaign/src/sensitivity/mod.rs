//! Sensitivity of the result of a scenario: which assumption moves prevented, induced and harm
//! most.
//!
//! ```text
//!  parameters of the scenario ┐
//!  further keys with a range  ├─▶ factors ─▶ design ─▶ runs in every arm ─▶ outputs ─▶ effects, indices
//!  chance                     ┘  (unit cube)
//!
//!  screening (Morris)      all factors, few runs
//!  decomposition (Sobol')  the factors that matter; the rest is one group, whose index shows what screening has hidden
//! ```
//!
//! *Chance* is everything that the parameters of a sample leave open: weaving, the noise of speeds
//! and sensors, lapses. It is a separate factor, the number that keys the random streams of a run
//! (as the seed variable of B. Iooss and M. Ribatet, *Global sensitivity analysis of computer
//! models with functional inputs*, Reliability Engineering & System Safety 94 (2009) 1194–1204).
//! All points that do not differ in this factor share their random numbers, and both arms always
//! do.

mod defaults;
mod factor;
mod output;
mod plan;
mod runs;
mod study;

pub use defaults::LeftOut;
pub use factor::{CHANCE, Factor, FactorKind, FactorRange, RangeError};
pub use output::{Output, values};
pub use plan::{Method, PlanFailure, SensitivityPlan};
pub use runs::RunErrors;
pub use study::{Decomposition, Group, OutputEffects, OutputIndices, Screening, Sensitivity};
