//! Closecall: a closed-loop software-in-the-loop testbed for the *margin increase system* (MIS), an ADAS function for
//! highways.
//!
//! ```text
//!  recording ─▶ trajectories ─▶ lane changes ─▶ criticality ─▶ parameter distributions ─▶ logical scenario
//!      ─▶ concrete scenario ─▶ [ world ─▶ measurements ─▶ tracks ─▶ command ─▶ world ]* ─▶ outcome ─▶ verdict
//! ```
//!
//! This crate closes the loop and judges it. What is tested lies in `closecall-scenarios`, what E perceives in
//! `closecall-sensors`, who drives in `closecall-controllers`, and the nouns they share in `closecall-traffic`.
//!
//! * [`scenario`]: scenario files, checked into concrete scenarios
//! * [`simulation`]: the closed loop of one run
//! * [`outcome`]: what a run ends in
//! * [`campaign`]: many runs, their ledger and their verdict
//! * [`statistics`]: how sure one can be from samples
//! * [`report`]: Rerun, Parquet, JUnit, JSON, for people and machines
//! * [`cli`], [`exit_code`]: the command line

pub mod campaign;
pub mod cli;
pub mod controller;
pub mod exit_code;
pub mod outcome;
pub mod report;
pub mod scenario;
pub mod simulation;
pub mod statistics;
mod world;
