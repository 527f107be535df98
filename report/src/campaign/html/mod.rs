//! HTML pages for people: one of the campaign, and one of its recordings.
//!
//! ```text
//!  report.html
//!    verdict in a sentence, signature  what decides the exit code
//!    gates in plain words              the worst first; those that are met are folded
//!    remarks on single scenarios       folded
//!    collisions, pairs                 counts with their intervals; one row for each of many scenarios
//!    worst samples                     pictures with links to their recordings and incident cards, outcome map
//!    causes, each scenario             folded: worst samples, what moves the result, margins, coverage
//!    provenance                        what a repetition needs
//!  recordings/index.html
//!    each recorded sample              a picture, its numbers, how to open it
//! ```
//!
//! The templates are maud's, which escapes every text. A page stands alone: it holds its style
//! sheet and its charts, and loads nothing. Only the page of the recordings runs a script. A
//! campaign's page shows wall times and its date, so that it is not among the files that are
//! byte-identical in a repetition.

mod coverage;
mod influence;
mod ledger;
pub(crate) mod page;
mod provenance;
mod recordings;
mod report;
mod samples;
mod scenario;
mod verdict;

#[cfg(test)]
mod tests;

pub(super) use page::{number, number_heads, table, text_heads};
pub(super) use recordings::{IndexEntry, write_index};
pub(super) use report::write_html;
