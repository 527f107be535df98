//! What a run and a campaign leave behind: files to look at, to keep, and to gate on.
//!
//! * [`run`](mod@run): one run, or a pair of them: film, Rerun recording, static figure, trace
//! * [`campaign`]: many runs: HTML page, JUnit, Parquet, Markdown, recordings of chosen samples
//! * [`traffic`]: trajectory data as an in-car log or as charts
//!
//! This crate is the only one that names rerun, arrow and plotters.

pub mod campaign;
mod charts;
mod escape;
pub mod run;
mod table;
pub mod traffic;
mod units;
