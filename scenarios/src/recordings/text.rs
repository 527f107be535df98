//! Readers of text: one row a line.

use std::io::BufRead;

use super::exid::Survey;
use super::fields::Fault;
use super::file_set::Meta;
use super::layout::{Format, is_of_drone, of_drone, recognise};
use super::rows::{Fields, Lines};
use super::source::{About, Refusal, Row, RowSource};
use super::{RecordingError, RecordingProblem};

/// The rows of a text file, in any of the layouts that have a row on each line.
pub(super) struct TextSource<R> {
    lines: Lines<R>,
    format: Format,
    fields: Fields,
    name: Option<String>,
    /// The first line, where it is a row already.
    first: Option<(u64, String)>,
}

impl<R: BufRead> TextSource<R> {
    /// # Errors
    /// Where the first line is that of no layout, or of one that needs other files.
    pub(super) fn new(source: R) -> Result<Self, Refusal> {
        let (lines, number, first) = begin(source)?;
        Self::recognised(lines, number, first)
    }

    /// As [`TextSource::new`], where `meta` can be asked for what is in the other files, and `survey` for what the traffic
    /// tells about the road.
    pub(super) fn with_meta(
        source: R,
        meta: impl FnOnce() -> Result<Meta, RecordingError>,
        survey: impl FnOnce() -> Result<Survey, RecordingError>,
    ) -> Result<Self, Result<Refusal, RecordingError>> {
        let (lines, number, first) = begin(source).map_err(Ok)?;
        if !is_of_drone(&first) {
            return Self::recognised(lines, number, first).map_err(Ok);
        }
        let format = of_drone(&first, meta().map_err(Err)?, survey)
            .map_err(|error| error.map(|problem| Refusal::new(number, problem)))?;
        Ok(Self { lines, format, fields: Fields::default(), name: None, first: None })
    }

    fn recognised(lines: Lines<R>, number: u64, first: String) -> Result<Self, Refusal> {
        let format = recognise(&first).map_err(|problem| Refusal::new(number, problem))?;
        let first = (!format.has_header).then_some((number, first));
        Ok(Self { lines, format, fields: Fields::default(), name: None, first })
    }
}

/// The first line, and the lines behind it.
fn begin<R: BufRead>(source: R) -> Result<(Lines<R>, u64, String), Refusal> {
    let mut lines = Lines::new(source);
    match lines.next().map_err(at_line)? {
        Some((number, first)) => {
            let first = first.to_owned();
            Ok((lines, number, first))
        }
        None => Err(Refusal::of_file(RecordingProblem::Empty)),
    }
}

fn at_line((line, problem): (u64, RecordingProblem)) -> Refusal {
    Refusal::new(line, problem)
}

impl<R: BufRead> RowSource for TextSource<R> {
    fn about(&self) -> About {
        let about = self.format.columns.about();
        About { name: self.name.clone().or(about.name.clone()), ..about }
    }

    fn next_row(&mut self) -> Result<Option<Row>, Refusal> {
        let Self { lines, format, fields, name, first } = self;
        loop {
            let first = first.take();
            let (number, line) = match &first {
                Some((number, line)) => (*number, line.as_str()),
                None => match lines.next().map_err(at_line)? {
                    Some(next) => next,
                    None => {
                        format.columns.end().map_err(Refusal::of_fault)?;
                        return Ok(None);
                    }
                },
            };
            let row = parse(line, format, fields, name).map_err(|fault| Refusal::new(number, fault))?;
            if lines.is_cut() {
                return Err(Refusal::new(number, RecordingProblem::CutLine));
            }
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
) -> Result<Option<Row>, Fault> {
    fields.split(line, format.separator)?;
    let (found, needed) = (fields.len(), format.width);
    if found != needed {
        return Err(RecordingProblem::ColumnCount { found, needed }.into());
    }
    check_name(line, format, fields, name)?;
    format.columns.parse(line, fields)
}

/// One file holds one recording.
fn check_name(line: &str, format: &Format, fields: &Fields, name: &mut Option<String>) -> Result<(), Fault> {
    let Some((column, found)) = format.columns.recording(line, fields) else { return Ok(()) };
    match name {
        None => *name = Some(found.to_owned()),
        Some(first) if first == found => {}
        Some(first) => {
            let problem = RecordingProblem::SeveralRecordings { first: first.clone(), found: found.to_owned() };
            return Err(Fault::at(column, problem));
        }
    }
    Ok(())
}
