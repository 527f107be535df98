//! Small tables in CSV: poses, labels, and the index of a folder.

use std::io::{self, Read as _};
use std::path::Path;

use closecall_traffic::{Time, input};

use super::error::{Origin, ScanFileError, ScanFileProblem};

/// Latest time (s): the year 2262. Nanoseconds count to it.
const LATEST_S: f64 = 9.2e9;

/// A row of a table: its line, and the fields of the named columns.
pub(super) struct TableRow {
    origin: Origin,
    line: u64,
    columns: &'static [&'static str],
    fields: Vec<Option<String>>,
}

/// The columns of a table, and its purpose.
#[derive(Clone, Copy, Debug)]
pub(super) struct TableFormat {
    /// The names of the columns. Those that must be there come first.
    pub(super) columns: &'static [&'static str],
    /// Number of columns that must be there.
    pub(super) needed: usize,
    /// What the table gives, for the message about a missing file.
    pub(super) gives: &'static str,
}

/// Reads a table. Columns of other names are ignored.
pub(super) fn read_table(path: &Path, format: TableFormat) -> Result<Vec<TableRow>, ScanFileError> {
    let TableFormat { columns, needed, gives } = format;
    let origin = Origin::file(path);
    let list = || columns[..needed].iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    let mut bytes = Vec::new();
    let read = input::open(path).and_then(|mut file| file.read_to_end(&mut bytes));
    read.map_err(|error| match error.kind() {
        io::ErrorKind::NotFound => origin.error(ScanFileProblem::MissingFile { gives, columns: list() }),
        _ => origin.error(error),
    })?;
    let text = input::with_line_feeds(&bytes);
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(&text[..]);
    let of_csv = |error: csv::Error| {
        let place = error.position().map(|at| format!("line {}", at.line())).unwrap_or_default();
        let problem = match error.into_kind() {
            csv::ErrorKind::Io(error) => ScanFileProblem::Io(error),
            csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
                ScanFileProblem::Csv(format!("the row has {len} fields, but the header has {expected_len}"))
            }
            _ => ScanFileProblem::Csv("the row is not text in UTF-8".to_owned()),
        };
        origin.at(place).error(problem)
    };
    let header = reader.headers().map_err(of_csv)?.clone();
    let at = |name: &str| header.iter().position(|column| bare(column) == name);
    let doubled = columns.iter().find(|name| header.iter().filter(|column| bare(column) == **name).count() > 1);
    if let Some(name) = doubled {
        let problem = ScanFileProblem::Twice { what: "the column", name: (*name).to_owned() };
        return Err(origin.at("line 1").error(problem));
    }
    let indices: Vec<Option<usize>> = columns.iter().map(|name| at(name)).collect();
    if let Some(missing) = indices[..needed].iter().position(Option::is_none) {
        let problem = ScanFileProblem::MissingColumn { name: columns[missing], needed: list() };
        return Err(origin.at("line 1").error(problem));
    }
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(of_csv)?;
        let line = record.position().map_or(0, csv::Position::line);
        let field = |index: &Option<usize>| {
            let text = index.and_then(|index| record.get(index)).filter(|text| !text.is_empty());
            text.map(str::to_owned)
        };
        rows.push(TableRow { origin: origin.clone(), line, columns, fields: indices.iter().map(field).collect() });
    }
    if rows.is_empty() { Err(origin.error(ScanFileProblem::NoRows)) } else { Ok(rows) }
}

/// Returns the name of a column without the mark of UTF-8 before the first one.
fn bare(column: &str) -> &str {
    column.trim_start_matches('\u{feff}')
}

impl TableRow {
    /// Returns the place of a column in this row.
    pub(super) fn place(&self, column: usize) -> Origin {
        self.origin.at(format_args!("line {}, column `{}`", self.line, self.columns[column]))
    }

    /// Returns the text of a column; `None` if it is empty or missing.
    pub(super) fn text(&self, column: usize) -> Option<&str> {
        self.fields[column].as_deref()
    }

    /// Returns the text of a column that every row needs.
    pub(super) fn needed_text(&self, column: usize) -> Result<&str, ScanFileError> {
        let empty = || self.place(column).error(ScanFileProblem::Csv("the field is empty".to_owned()));
        self.text(column).ok_or_else(empty)
    }

    /// Returns the finite number of a column that every row needs.
    pub(super) fn number(&self, column: usize) -> Result<f64, ScanFileError> {
        self.needed_text(column)?;
        self.number_or_none(column).map(Option::unwrap_or_default)
    }

    /// Returns the time of a column that every row needs.
    pub(super) fn time(&self, column: usize) -> Result<Time, ScanFileError> {
        match self.number(column)? {
            time_s if time_s.abs() <= LATEST_S => Ok(Time::from_s(time_s)),
            value => Err(self.place(column).error(ScanFileProblem::OutOfRange { value, allowed: "a time in seconds" })),
        }
    }

    /// Returns the finite number of a column; `None` if it is empty or missing.
    pub(super) fn number_or_none(&self, column: usize) -> Result<Option<f64>, ScanFileError> {
        let Some(text) = self.text(column) else { return Ok(None) };
        match text.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(Some(value)),
            _ => Err(self.place(column).error(ScanFileProblem::NotANumber { text: text.to_owned() })),
        }
    }
}
