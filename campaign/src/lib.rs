//! Campaigns: many samples of scenarios, their ledger, and the verdict.
//!
//! ```text
//!  scenario files ─▶ plan ─▶ workers ─▶ records in the order of the plan ─▶ ledger ─▶ gates ─▶ verdict
//!                     ▲                       └──▶ journal ─▶ Parquet, JUnit, HTML, recordings
//!                     └──────── resume ◀────────────────┘
//! ```
//!
//! Rates are conditional on the sampled scenario: they say how often a *sampled encounter* ends in a collision, not
//! how often that happens on a road.

pub mod compare;
pub mod execution;
pub mod folder;
mod folder_error;
pub use closecall_simulation::harm;
pub mod journal;
pub mod ledger;
pub mod lock;
pub mod manifest;
pub mod merge;
pub mod partition;
pub mod plan;
pub mod probability;
pub mod record;
pub mod runner;
pub mod saved;
pub mod selection;
pub mod stop;
pub mod summary;
pub mod validity;
pub mod verdict;
pub mod wall_times;
pub mod workers;
