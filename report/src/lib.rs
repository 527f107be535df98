//! The output files of a run and of a campaign: pictures and recordings to view, tables to
//! evaluate, and reports that a CI gate reads.
//!
//! * [`run`](mod@run): output of one run, or of a pair of runs: Rerun recording, static figure
//! * [`campaign`]: output of many runs: HTML page, JUnit, Parquet, Markdown, recordings of selected
//!   samples
//! * [`calibration`]: the result of a calibration, and the member of a driver ensemble that it
//!   gives
//! * [`exchange`]: runs and scenarios in the formats of other tools: OpenSCENARIO, OpenDRIVE
//! * [`heartbeat`]: the progress of a long command as lines of text
//! * [`json`]: results as JSON with stable keys
//! * [`perception`]: studies of perception as text, JSON, Parquet and a page
//! * [`page`], [`table`]: the common parts of all pages and of all Parquet tables
//! * [`study`]: output of sensitivity studies, frontiers and boundaries: tables, charts and pages
//! * [`tables`]: the tables of one run: its trace, and the points of its LiDARs
//! * [`traffic`]: texts and charts of results from trajectory data
//!
//! This crate is the only one that uses rerun, plotters and plotly.

pub mod calibration;
pub mod campaign;
mod charts;
mod date;
mod escape;
pub mod exchange;
/// The parts of a page of HTML: the document, tables, and a legend.
pub mod page {
    pub use crate::campaign::html::page::{document, head, number, number_heads, table, text_heads};
}
pub mod heartbeat;
pub mod json;
pub mod perception;
pub mod run;
pub mod study;
pub mod tables;
pub mod traffic;
mod units;

pub use tables::table;
