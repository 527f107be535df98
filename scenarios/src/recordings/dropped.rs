//! What was left out of a recording, and why.

use std::collections::BTreeMap;

use serde::Serialize;

use super::source::Refusal;

/// Rows that were left out, by reason.
#[derive(Debug, Default, Serialize)]
#[serde(transparent)]
pub struct Dropped {
    reasons: BTreeMap<&'static str, DroppedRows>,
    #[serde(skip)]
    first: Option<Refusal>,
}

/// Rows that were left out for one reason.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct DroppedRows {
    /// How many.
    pub count: u64,
    /// Line of the first.
    pub first_line: Option<u64>,
    /// What is wrong with the first.
    pub first: String,
}

impl Dropped {
    pub(super) fn add(&mut self, refusal: Refusal) {
        let first = || {
            let column = refusal.column.map(|column| format!("column `{column}` ")).unwrap_or_default();
            DroppedRows { count: 0, first_line: refusal.line, first: format!("{column}{}", refusal.problem) }
        };
        self.reasons.entry(refusal.problem.kind()).or_insert_with(first).count += 1;
        if self.first.is_none() {
            self.first = Some(refusal);
        }
    }

    /// The reasons by name, with what they were met for.
    pub fn reasons(&self) -> impl Iterator<Item = (&'static str, &DroppedRows)> {
        self.reasons.iter().map(|(kind, rows)| (*kind, rows))
    }

    /// Number of rows that were left out.
    pub fn count(&self) -> u64 {
        self.reasons.values().map(|rows| rows.count).sum()
    }

    /// What keeps the recording from being used as a whole.
    pub(super) fn take_first(&mut self) -> Option<Refusal> {
        self.first.take()
    }
}
