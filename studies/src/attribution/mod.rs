//! Attribution of a collision: which vehicle closed the gap, in which phase, and how it was
//! avoidable.
//!
//! ```text
//!  run of the sample ─▶ trace of all vehicles ─┬▶ striking vehicle, struck vehicle, phase, state of the system
//!                                              ├▶ careful driver in the place of the striking vehicle
//!                                              ├▶ full braking of the striking vehicle
//!  run with the careful driver as the ego ─────┴▶ careful driver in the place of the ego
//! ```
//!
//! The counterfactuals of the striking vehicle keep the motion of the struck vehicle. The trace
//! ends at the collision: after it, the struck vehicle keeps its last acceleration, at most to a
//! standstill, and its lane position. The counterfactual of the ego is a run of the loop, in which
//! the other drivers react to the other ego. In a rear-end collision, the braking of the striking
//! vehicle decides. About other contacts, the counterfactuals of the striking vehicle say nothing.
//!
//! An explanation has the first collision; a recording has every one ([`Motion`]).

mod collision;
mod counterfactual;
mod motion;
mod trace;

pub use collision::{Attribution, Avoidable, Party, attribute, braking_words, phase_word, state_word};
pub use motion::Motion;
pub use trace::Trace;
