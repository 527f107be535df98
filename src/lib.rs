//! Closecall: a closed-loop software-in-the-loop testbed for the *margin increase system* (MIS), an
//! ADAS function for highways.
//!
//! ```text
//!  trajectory data ─▶ lane changes ─▶ criticality ─▶ parameter distributions ─▶ logical scenario
//!      ─▶ concrete scenario ─▶ [ world ─▶ measurements ─▶ tracks ─▶ command ─▶ world ]* ─▶ outcome ─▶ verdict
//! ```
//!
//! This crate is the command line: it parses the arguments, calls the other crates, and prints the
//! results. Each step of the way has a crate of its own. A crate imports only crates above it in
//! this table.
//!
//! | crate | holds |
//! |---|---|
//! | [`traffic`] | the shared data types, the criticality metrics, and statistics |
//! | [`sensors`] | the perception of the ego vehicle |
//! | [`controllers`] | the ego stack, the human drivers, and controllers from outside |
//! | [`recorded`] | trajectory data, lane changes, criticality, fits |
//! | [`scenarios`] | scenario files, parameters, sampling, pass criteria, the library |
//! | [`simulation`] | one run: world, closed loop, outcome |
//! | [`campaign`] | many runs: journal, workers, gates, validity, verdict |
//! | [`studies`] | the cause of a collision, the smallest failing case, the map, exposure, perception |
//! | [`report`] | Rerun recordings, figures, Parquet, JUnit, HTML, JSON |
//!
//! `examples/campaign.rs` runs a campaign without the command line.

pub use closecall_campaign as campaign;
pub use closecall_controllers as controllers;
pub use closecall_recorded as recorded;
pub use closecall_report as report;
pub use closecall_scenarios as scenarios;
pub use closecall_sensors as sensors;
pub use closecall_simulation as simulation;
pub use closecall_studies as studies;
pub use closecall_traffic as traffic;

pub mod cli;
pub mod exit_code;
