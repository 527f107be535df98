//! Readers of text layouts, which have one row per line.

use std::collections::BTreeSet;
use std::io::BufRead;

use closecall_traffic::Side;

use super::class_names::UnknownClass;
use super::error::{TrajectoryFileError, TrajectoryFileProblem};
use super::fields::FieldError;
use super::file_set::Meta;
use super::inferred_road::InferredRoad;
use super::layout::{Format, drone_format, is_drone_header, recognise};
use super::rows::{Fields, Lines, Separator};
use super::source::{FileInfo, ReadError, Row, RowSource};

/// The rows of a text file in any layout that has one row per line.
pub(super) struct TextSource<R> {
    lines: Lines<R>,
    format: Format,
    fields: Fields,
    name: Option<String>,
    /// The first line, if it is a header.
    header: Option<String>,
    /// The first line with its number, if it is a row instead of a header.
    first: Option<(u64, String)>,
    /// Length of the last field of the row before (bytes): a shorter one at the end of the file may
    /// be cut.
    usual_last_field: usize,
    /// The line before, and its row.
    latest_line: String,
    latest_row: Option<Row>,
    location: Location,
}

/// The data set that is read of a file with several.
#[derive(Default)]
struct Location {
    asked: Option<&'static str>,
    was_found: bool,
    /// The names of other data sets in the file.
    others: BTreeSet<String>,
}

impl<R: BufRead> TextSource<R> {
    /// Detects the layout from the first line, which has been read. Of a file with several data
    /// sets, the one that is `asked` for is read.
    ///
    /// # Errors
    /// Fails if the first line fits no layout, or fits a layout that needs other files.
    pub(super) fn new(
        lines: Lines<R>,
        number: u64,
        first: String,
        asked: Option<&'static str>,
    ) -> Result<Self, ReadError> {
        let source = Self::with_recognised_layout(lines, number, first)?;
        Ok(Self { location: Location { asked, ..Location::default() }, ..source })
    }

    /// Works like [`TextSource::new`], but also reads highD's and exiD's rows. For these layouts,
    /// it calls `meta` for the content of the metadata files. For exiD it also calls `infer_road` with
    /// the frame rate (Hz), which derives the road from the traffic.
    pub(super) fn with_meta(
        source: R,
        meta: impl FnOnce() -> Result<Meta, TrajectoryFileError>,
        infer_road: impl FnOnce(f64) -> Result<InferredRoad, TrajectoryFileError>,
    ) -> Result<Self, Result<ReadError, TrajectoryFileError>> {
        let (lines, number, first) = read_first_line(source).map_err(Ok)?;
        if !is_drone_header(&first) {
            return Self::with_recognised_layout(lines, number, first).map_err(Ok);
        }
        let format = drone_format(&first, meta().map_err(Err)?, infer_road)
            .map_err(|error| error.map(|problem| ReadError::new(number, problem)))?;
        Ok(Self::at_start(lines, format, (number, first)))
    }

    fn with_recognised_layout(lines: Lines<R>, number: u64, first: String) -> Result<Self, ReadError> {
        let format = recognise(&first).map_err(|problem| ReadError::new(number, problem))?;
        Ok(Self::at_start(lines, format, (number, first)))
    }

    /// Creates the source after its first line, which is given with its number.
    fn at_start(lines: Lines<R>, format: Format, first: (u64, String)) -> Self {
        let (fields, location) = (Fields::default(), Location::default());
        let (header, first) = if format.has_header { (Some(first.1), None) } else { (None, Some(first)) };
        Self {
            lines,
            format,
            fields,
            name: None,
            header,
            first,
            usual_last_field: 0,
            latest_line: String::new(),
            latest_row: None,
            location,
        }
    }
}

/// Reads the first line, and returns it together with the remaining lines.
pub(super) fn read_first_line<R: BufRead>(source: R) -> Result<(Lines<R>, u64, String), ReadError> {
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

    fn warnings(&self) -> Vec<String> {
        self.format.columns.warnings()
    }

    fn is_in_doubt(&self) -> bool {
        self.format.columns.is_in_doubt()
    }

    fn check_sides(&self, is_mirrored: bool) -> Result<(), ReadError> {
        self.format.columns.check_sides(is_mirrored).map_err(ReadError::of_file)
    }

    fn expect_reversed(&mut self) {
        self.format.columns.expect_reversed();
    }

    fn names_sides(&self) -> bool {
        self.format.columns.names_sides()
    }

    fn derives_lanes(&self) -> bool {
        self.format.columns.derives_lanes()
    }

    fn oncoming_side(&self) -> Option<Side> {
        self.format.columns.oncoming_side()
    }

    fn expect_no_lanes(&mut self) {
        self.format.columns.expect_no_lanes();
    }

    fn next_row(&mut self) -> Result<Option<Row>, ReadError> {
        let Self { lines, format, fields, name, header, first, usual_last_field, latest_line, latest_row, location } =
            self;
        loop {
            let first = first.take();
            let (number, line) = match &first {
                Some((number, line)) => (*number, line.as_str()),
                None => match lines.next().map_err(at_line)? {
                    Some(next) => next,
                    None => {
                        format.columns.end().map_err(ReadError::of_field)?;
                        return location.end().map(|()| None);
                    }
                },
            };
            if header.as_deref() == Some(line) {
                return Err(ReadError::new(number, TrajectoryFileProblem::RepeatedHeader));
            }
            // A line that stands there twice is no second row: metadata count one, and a clock goes on.
            if latest_line == line {
                match *latest_row {
                    Some(row) => return Ok(Some(Row { line: number, ..row })),
                    None => continue,
                }
            }
            let row = parse(line, format, fields, name, location).map_err(|error| ReadError::new(number, error))?;
            line.clone_into(latest_line);
            *latest_row = row;
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

impl Location {
    /// Returns `true` if a row of another data set is asked for.
    fn leaves_out(&mut self, data: Option<(&'static str, &str)>) -> bool {
        let (Some(asked), Some((_, actual))) = (self.asked, data) else { return false };
        if actual.eq_ignore_ascii_case(asked) {
            self.was_found = true;
            return false;
        }
        if !self.others.contains(actual) {
            self.others.insert(actual.to_owned());
        }
        true
    }

    /// Checks, at the end of the file, that it holds the data set that is asked for.
    fn end(&self) -> Result<(), ReadError> {
        match self.asked {
            Some(asked) if !self.was_found => {
                let names: Vec<&str> = self.others.iter().map(String::as_str).collect();
                let names = if names.is_empty() { "no column with names".to_owned() } else { names.join(", ") };
                Err(ReadError::of_file(TrajectoryFileProblem::NoSuchLocation { asked, names }))
            }
            _ => Ok(()),
        }
    }
}

fn parse(
    line: &str,
    format: &mut Format,
    fields: &mut Fields,
    name: &mut Option<String>,
    location: &mut Location,
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
    if location.leaves_out(format.columns.data(line, fields)) {
        return Ok(None);
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
