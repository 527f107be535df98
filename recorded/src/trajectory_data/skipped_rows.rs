//! Rows that the reader skips, and why.

use std::collections::BTreeMap;

use serde::Serialize;

use super::error::SHARED_NUMBERS;
use super::source::ReadError;

/// The skipped rows, grouped by reason.
#[derive(Debug, Default, Serialize)]
#[serde(transparent)]
pub struct SkippedRows {
    reasons: BTreeMap<&'static str, SkippedRowsByReason>,
    #[serde(skip)]
    first: Option<ReadError>,
}

/// The rows skipped for one reason.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct SkippedRowsByReason {
    /// Number of rows.
    pub count: u64,
    /// Line of the first of them.
    pub first_line: Option<u64>,
    /// Problem with the first of them.
    pub first: String,
}

impl SkippedRows {
    /// Counts a row that is skipped because of `error`.
    pub(super) fn add(&mut self, error: ReadError) {
        let first = || {
            let column = error.column.map(|column| format!("column `{column}` ")).unwrap_or_default();
            SkippedRowsByReason { count: 0, first_line: error.line, first: format!("{column}{}", error.problem) }
        };
        self.reasons.entry(error.problem.kind()).or_insert_with(first).count += 1;
        if self.first.is_none() {
            self.first = Some(error);
        }
    }

    /// Returns the reasons by name, each with its rows.
    pub fn reasons(&self) -> impl Iterator<Item = (&'static str, &SkippedRowsByReason)> {
        self.reasons.iter().map(|(kind, rows)| (*kind, rows))
    }

    /// Returns the number of skipped rows.
    pub fn count(&self) -> u64 {
        self.reasons.values().map(|rows| rows.count).sum()
    }

    /// Returns the number of skipped rows whose vehicle is at another place in the same frame.
    pub(super) fn of_shared_numbers(&self) -> u64 {
        self.reasons.get(SHARED_NUMBERS).map_or(0, |rows| rows.count)
    }

    /// Removes and returns the first error.
    pub(super) fn take_first(&mut self) -> Option<ReadError> {
        self.first.take()
    }
}
