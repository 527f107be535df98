//! Gates: criteria, where they come from, and how the samples of a campaign answer them.
//!
//! ```text
//!  GateSet ─▶ Judge ─(one record after the other)─▶ Judgement { verdict, gates, requirements, expectations, reasons }
//! ```

mod assemble;
mod course;
mod evaluate;
mod judge;
mod options;
mod project;
mod result;
mod set;

pub use assemble::{AssemblyError, PresetGates};
pub(crate) use course::{Course, checks_of_slowing, is_idle, least_action, missing_action};
pub(crate) use evaluate::value;
pub use evaluate::{Accumulator, Answer, Certainty, Evaluation, LEAST_SAMPLES, OpenReason};
pub use judge::Judge;
pub use options::GateOptions;
pub use project::{ProjectError, ProjectFile};
pub use result::{ExpectationResult, GateResult, RequirementResult, Standing};
pub(crate) use result::{rounded_up, undecided};
pub use set::{GateSet, GateSource, GateSpec, MAX_FLIP_RATE, ProbabilitySpec};
