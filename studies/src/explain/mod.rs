//! Explanation of a failure: the first stage of the chain whose perfection prevents it.
//!
//! ```text
//!  points ─▶ clusters ─▶ class ─▶ tracks ─▶ timing ─▶ actuation ─▶ rear reaction ─▶ lead braking
//! ```
//!
//! Each stage is replaced by the truth while all others stay unchanged, and the sample is run
//! again. The explanation names the first stage of the chain whose perfection prevents the failure.
//! A stage that is worse than usual precedes all others: in a narrow failure, any perfect stage
//! prevents it, and the stage that is out of order is the cause. If no stage alone prevents the
//! failure, pairs of stages are tried. The explanation also states the part of the margin increase
//! system: the sample is run without the system, and, if that run passes, with the system switched
//! off in one of its states at a time.

mod explanation;
mod run;
mod stage;
mod text;
mod usual;

pub use explanation::{Cause, Explanation, MisEffect, MisRun, StageRun};
pub use run::explain;
pub use stage::Stage;
pub use text::ExplanationText;
