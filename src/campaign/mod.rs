//! Campaigns: many samples of scenarios, their ledger, and the verdict.
//!
//! ```text
//!  scenario files ─▶ samples 0..n ─▶ runner (rayon) ─▶ records in order ─▶ ledger ─▶ gates ─▶ verdict
//!                                                           └──▶ journal ─▶ Parquet, JUnit, recordings
//! ```
//!
//! Rates are conditional on the sampled scenario: they say how often a *sampled encounter* ends in a collision, not
//! how often that happens on a road.

pub mod folder;
pub mod ledger;
pub mod manifest;
pub mod record;
pub mod runner;
pub mod summary;
pub mod verdict;
