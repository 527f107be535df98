//! Rare events: probabilities that plain sampling does not reach, with intervals that hold, and
//! the search for the first case of an event.
//!
//! ```text
//!  scenario ─▶ standard normal space ─▶ importance │ subset │ search ─▶ points ─▶ runs ─▶ journal
//!                                          ▲                              │
//!                                          └────────── responses ─────────┘
//! ```
//!
//! The methods, `importance`, `subset` and `search`, are pure: they know points and responses only.
//! The rest of the module runs points as samples of a scenario (`runs`), reads how near a sample
//! came to an event (`nearness`), and keeps a journal (`journal`). A method's next points depend on
//! its seed and on the responses so far, never on threads or time, so that a campaign that goes on
//! from its journal ends with the same bytes.
//!
//! The runs of these methods are not independent samples of the scenario. Their results are of
//! types of their own, which no gate and no binomial bound takes: such a bound needs an
//! [`Independent`](crate::ledger::Independent) number of samples, which only a plain campaign has.

mod error;
mod estimate;
mod files;
mod importance;
mod journal;
mod merge;
mod method;
mod mixture;
mod nearness;
mod plan;
mod points;
mod problem;
mod relevance;
mod report;
mod runs;
mod search;
mod subset;
#[cfg(test)]
mod tests;

pub(crate) use files::{MANIFEST, RESULT};

pub use error::RareError;
pub use estimate::{COVERAGE, Mean};
pub use importance::{DEFENSIVE, Goal, ImportanceResult, NoInterval, importance};
pub use journal::{RareFolder, RareJournal, RareManifest};
pub use merge::RareParts;
pub use method::Method;
pub use mixture::{Component, Mixture};
pub use nearness::{Nearness, NoGuide};
pub use plan::RarePlan;
pub use points::PointRunner;
pub(crate) use points::point_samples;
pub use problem::{Point, Response, Seed, Simulator};
pub use report::{Estimate, Nearest, RareReport};
pub use search::{SearchResult, search};
pub use subset::{Level, SubsetResult, subset};
