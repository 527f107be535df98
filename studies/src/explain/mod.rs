//! Explanation of a failure: the first stage of the chain whose perfection prevents it.
//!
//! ```text
//!  points ─▶ clusters ─▶ class ─▶ tracks ─▶ timing ─▶ actuation ─▶ rear reaction ─▶ lead braking
//! ```
//!
//! Each stage is replaced by the truth while all others stay as they were, and the sample is run again. The first stage of the
//! chain whose perfection prevents the failure is named. A stage that is worse than usual precedes all that are not: where a
//! failure is narrow, any perfect stage prevents it, and the one that is out of order is the cause. If no stage alone prevents
//! the failure, pairs of stages are tried. Beside it stands what the margin increase system did: the sample is run
//! without the system, and, if that passes, with the system switched off in one of its states at a time.

mod explanation;
mod run;
mod stage;
mod text;
mod usual;

pub use explanation::{Cause, Explanation, MisEffect, MisRun, StageRun};
pub use run::explain;
pub use stage::Stage;
pub use text::ExplanationText;
