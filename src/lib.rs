//! Closecall: a closed-loop software-in-the-loop testbed for the *margin increase system* (MIS), an ADAS function for
//! highways.
//!
//! ```text
//!  trajectory data ─▶ lane changes ─▶ criticality ─▶ parameter distributions ─▶ logical scenario
//!      ─▶ concrete scenario ─▶ [ world ─▶ measurements ─▶ tracks ─▶ command ─▶ world ]* ─▶ outcome ─▶ verdict
//! ```
//!
//! This crate is the command line: it parses, calls and prints. The work is done in one crate for each step of the way;
//! imports point from the bottom of this table to its top.
//!
//! | crate | holds |
//! |---|---|
//! | [`traffic`] | the shared nouns and the criticality metrics |
//! | [`statistics`] | how sure one can be from samples |
//! | [`scenarios`] | trajectory data, lane changes, distributions, sampling designs |
//! | [`sensors`] | what the ego vehicle perceives |
//! | [`controllers`] | the ego stack and the human drivers |
//! | [`simulation`] | one run: scenario file, world, closed loop, outcome |
//! | [`campaign`] | many runs: journal, workers, gates, validity, verdict |
//! | [`report`] | Rerun recordings, figures, Parquet, JUnit, HTML |
//!
//! `examples/campaign.rs` runs a campaign without the command line.

pub use closecall_campaign as campaign;
pub use closecall_controllers as controllers;
pub use closecall_report as report;
pub use closecall_scenarios as scenarios;
pub use closecall_sensors as sensors;
pub use closecall_simulation as simulation;
pub use closecall_statistics as statistics;
pub use closecall_traffic as traffic;

pub mod cli;
pub mod exit_code;
