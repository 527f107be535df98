//! Tables of text, and how numbers stand in them.

use std::fmt::{self, Formatter};

use closecall_campaign::sensitivity::{Output, RunErrors};
use closecall_traffic::statistics::format::percent;
use closecall_traffic::statistics::sensitivity::jackknife::Estimate;

/// Space between two columns.
const GAP: &str = "  ";

/// Writes rows in columns: the first to the left, the others to the right.
pub(super) fn write_rows(f: &mut Formatter<'_>, rows: &[Vec<String>]) -> fmt::Result {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| {
        rows.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    for row in rows {
        let cells = row.iter().zip(&widths).enumerate().map(|(column, (cell, width))| {
            if column == 0 { format!("{cell:<width$}") } else { format!("{cell:>width$}") }
        });
        writeln!(f, "{GAP}{}", cells.collect::<Vec<_>>().join(GAP).trim_end())?;
    }
    Ok(())
}

/// Returns an estimate with its interval; a dash if there is none.
pub(super) fn with_interval(estimate: Option<Estimate>) -> String {
    estimate.map_or_else(
        || "-".to_owned(),
        |Estimate { value, interval_95: [low, high] }| format!("{value:.3} ({low:.3} to {high:.3})"),
    )
}

/// Returns a share with its interval in percent; a dash if there is none.
pub(super) fn share(estimate: Option<Estimate>) -> String {
    estimate.map_or_else(
        || "-".to_owned(),
        |Estimate { value, interval_95: [low, high] }| {
            format!("{} ({} to {})", percent(value), percent(low.max(0.0)), percent(high.min(1.0)))
        },
    )
}

/// Returns the mean of an output: a share of the samples if it is an event.
pub(super) fn mean(output: Output, value: Option<f64>) -> String {
    match value {
        None => "-".to_owned(),
        Some(value) if output.is_event() => percent(value.max(0.0)),
        Some(value) => format!("{value:.2e}"),
    }
}

/// Returns the errors as lines: nothing if there are none.
pub(super) fn error_lines(errors: &RunErrors, runs: &str) -> Vec<String> {
    let kinds = errors
        .kinds
        .iter()
        .map(|(kind, (count, message))| format!("{count} × {kind}: {}", message.lines().next().unwrap_or_default()));
    if errors.points == 0 {
        return Vec::new();
    }
    let head =
        format!("{} {runs} ended in an ERROR and have no result; they are left out of every figure", errors.points);
    std::iter::once(head).chain(kinds).collect()
}
