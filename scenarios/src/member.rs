//! Members of a driver ensemble: small files that say how one kind of human drives, applied to any
//! scenario.
//!
//! ```text
//!  low-thw-overtake.toml ─┐
//!                         ├─▶ low-thw-overtake@distracted: the same scenario, with other human drivers
//!  distracted.toml       ─┘
//! ```
//!
//! A member sets keys of the driver tables `overtaker`, `wiedemann99` and `idm`, each with its
//! source. Every human driver of these kinds takes part in the encounter and gets the values; a
//! `prescribed` driver follows a list of times, and is no member's. A value may be a distribution,
//! which is then a parameter of the scenario. The result is an ordinary scenario: all later steps
//! (checking, hashing, the manifest of a campaign, replay) work on its text.

mod apply;
mod config;
mod keys;
mod shipped;
mod source;

pub use apply::{Application, ApplyError};
pub use config::{Member, MemberError};
pub use shipped::{MemberEntry, entries, names};
pub use source::{Ensemble, ensemble_of, members};
