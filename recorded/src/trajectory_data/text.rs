//! Readers of text layouts, which have one row per line.

use std::io::BufRead;

use super::class_names::UnknownClass;
use super::error::{TrajectoryFileError, TrajectoryFileProblem};
use super::exid::InferredRoad;
use super::fields::FieldError;
use super::file_set::Meta;
use super::layout::{Format, drone_format, is_drone_header, recognise};
use super::rows::{Fields, Lines, Separator};
use super::source::{FileInfo, ReadError, Row, RowSource};

/// The rows of a text file in any layout that has one row per line.
pub(super) struct TextSource<R> {
    lines: Lines<R>,
    format: Format,
    fields: Fields,
    name: Option<String>,
    /// The first line with its number, if it is a row instead of a header.
    first: Option<(u64, String)>,
    /// Length of the last field of the row before (bytes): a shorter one at the end of the file may
    /// be cut.
    usual_last_field: usize,
}

impl<R: BufRead> TextSource<R> {
    /// Detects the layout from the first line.
    ///
    /// # Errors
    /// Fails if the first line fits no layout, or fits a layout that needs other files.
    pub(super) fn new(source: R) -> Result<Self, ReadError> {
        let (lines, number, first) = read_first_line(source)?;
        Self::with_recognised_layout(lines, number, first)
    }

    /// Works like [`TextSource::new`], but also reads highD's and exiD's rows. For these layouts,
    /// it calls `meta` for the content of the metadata files. For exiD it also calls `infer_road`,
    /// which derives the road from the traffic.
    pub(super) fn with_meta(
        source: R,
        meta: impl FnOnce() -> Result<Meta, TrajectoryFileError>,
        infer_road: impl FnOnce() -> Result<InferredRoad, TrajectoryFileError>,
    ) -> Result<Self, Result<ReadError, TrajectoryFileError>> {
        let (lines, number, first) = read_first_line(source).map_err(Ok)?;
        if !is_drone_header(&first) {
            return Self::with_recognised_layout(lines, number, first).map_err(Ok);
        }
        let format = drone_format(&first, meta().map_err(Err)?, infer_road)
            .map_err(|error| error.map(|problem| ReadError::new(number, problem)))?;
        Ok(Self { lines, format, fields: Fields::default(), name: None, first: None, usual_last_field: 0 })
    }

    fn with_recognised_layout(lines: Lines<R>, number: u64, first: String) -> Result<Self, ReadError> {
        let format = recognise(&first).map_err(|problem| ReadError::new(number, problem))?;
        let first = (!format.has_header).then_some((number, first));
        Ok(Self { lines, format, fields: Fields::default(), name: None, first, usual_last_field: 0 })
    }
}

/// Reads the first line, and returns it together with the remaining lines.
fn read_first_line<R: BufRead>(source: R) -> Result<(Lines<R>, u64, String), ReadError> {
    let mut lines = Lines::new(source);
    match lines.next().map_err(at_line)? {
        Some((number, first)) => {
            let first = first.to_owned();
            Ok((lines, number, first))
        }
        None => Err(ReadError::of_file(TrajectoryFileProblem::Empty)),
    }
}

fn at_line((line, problem): (u64, TrajectoryFileProblem)) -> ReadError {
    ReadError::new(line, problem)
}

impl<R: BufRead> RowSource for TextSource<R> {
    fn info(&self) -> FileInfo {
        let info = self.format.columns.info();
        FileInfo { name: self.name.clone().or(info.name.clone()), ..info }
    }

    fn unknown_classes(&self) -> &[UnknownClass] {
        self.format.columns.unknown_classes()
    }

    fn next_row(&mut self) -> Result<Option<Row>, ReadError> {
        let Self { lines, format, fields, name, first, usual_last_field } = self;
        loop {
            let first = first.take();
            let (number, line) = match &first {
                Some((number, line)) => (*number, line.as_str()),
                None => match lines.next().map_err(at_line)? {
                    Some(next) => next,
                    None => {
                        format.columns.end().map_err(ReadError::of_field)?;
                        return Ok(None);
                    }
                },
            };
            let row = parse(line, format, fields, name).map_err(|error| ReadError::new(number, error))?;
            let last_field = fields.last_len();
            if lines.is_unterminated() && last_field < *usual_last_field {
                return Err(ReadError::new(number, TrajectoryFileProblem::CutLine));
            }
            *usual_last_field = last_field;
            if let Some(row) = row {
                return Ok(Some(Row { line: number, ..row }));
            }
        }
    }
}

fn parse(
    line: &str,
    format: &mut Format,
    fields: &mut Fields,
    name: &mut Option<String>,
) -> Result<Option<Row>, FieldError> {
    let with_points;
    let line = if format.separator == Separator::Semicolon && line.contains(',') {
        // Decimal commas, as spreadsheets of many countries write them.
        with_points = line.replace(',', ".");
        &with_points
    } else {
        line
    };
    fields.split(line, format.separator)?;
    let (actual, needed) = (fields.len(), format.width);
    if actual != needed {
        return Err(TrajectoryFileProblem::ColumnCount { actual, needed }.into());
    }
    check_name(line, format, fields, name)?;
    format.columns.parse(line, fields)
}

/// Checks that all rows with a data set name carry the same name: one file holds one data set.
fn check_name(line: &str, format: &Format, fields: &Fields, name: &mut Option<String>) -> Result<(), FieldError> {
    let Some((column, actual)) = format.columns.data(line, fields) else { return Ok(()) };
    match name {
        _ if actual.is_empty() => {}
        None => *name = Some(actual.to_owned()),
        Some(first) if first == actual => {}
        Some(first) => {
            let problem = TrajectoryFileProblem::SeveralRecordings { first: first.clone(), actual: actual.to_owned() };
            return Err(FieldError::at(column, problem));
        }
    }
    Ok(())
}
