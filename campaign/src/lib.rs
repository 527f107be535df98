//! Campaigns: many samples of one or more scenarios, run with one or two controllers, counted, and
//! judged.
//!
//! ```text
//!  scenario files ─▶ plan ─▶ workers ─▶ records in the order of the plan ─▶ counts ─▶ gates ─▶ verdict
//!                     ▲                       └──▶ journal ─▶ Parquet, JUnit, HTML, recordings
//!                     └──────── resume ◀────────────────┘
//! ```
//!
//! - A *sample* is one concrete scenario, drawn from the distributions of a scenario file. Its
//!   number, the seed, and the sampling design determine it.
//! - An *arm* is a controller with its sensors. In a *paired* campaign each sample runs in several
//!   arms: the baseline first, the arm under test last, and references between them.
//! - A *record* is the result of one sample in all arms: one line of the [`journal`].
//!
//! Rates are conditional on the sampled scenario: they are the share of *sampled encounters* that
//! end in a collision, not the frequency of collisions on a road.

pub mod action;
mod ahead;
pub mod arguments;
pub mod arm_pairs;
pub mod attribution;
pub mod baseline;
pub mod belief;
pub mod boundary;
mod campaign_error;
pub mod compare;
pub mod controller_watch;
pub mod coverage;
pub mod drift;
pub mod earlier_failures;
pub mod end_rule;
pub mod ensemble;
pub mod execution;
pub mod failure;
pub mod failures;
pub mod fingerprint;
pub mod folder;
mod folder_error;
pub mod frontier;
pub mod gate;
pub mod host;
mod identity;
pub mod inputs;
pub mod integrity;
pub mod interrupt;
pub mod journal;
mod journal_plan;
pub mod late_repetition;
pub mod ledger;
pub mod left_out;
pub mod lock;
pub mod manifest;
pub mod margins;
pub mod merge;
pub mod partition;
pub mod plan;
mod plan_error;
pub mod probability;
pub mod rare;
pub mod record;
pub mod remote;
mod repair;
mod repeats;
pub mod repository;
pub mod results;
pub mod robustness;
pub mod runner;
mod sampling;
pub mod saved;
mod saved_error;
pub mod selection;
pub mod sensitivity;
pub mod session;
pub mod stop;
pub mod summary;
mod trust;
pub mod validity;
mod variable_words;
pub mod verdict;
pub mod wall_times;
pub mod workers;

pub use closecall_scenarios::harm;
