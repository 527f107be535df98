//! Which layout a file has, by its first line.

use super::assemble::Row;
use super::fields::Fault;
use super::ngsim::NgsimColumns;
use super::plain::PlainColumns;
use super::rows::{Fields, Separator};
use super::{Layout, RecordingProblem};

/// How to read the rows of one file.
pub(super) struct Format {
    pub(super) columns: Columns,
    pub(super) separator: Separator,
    /// Number of fields that each row has.
    pub(super) width: usize,
    /// False where the first line is a row already.
    pub(super) has_header: bool,
}

/// Where each quantity stands.
pub(super) enum Columns {
    /// The plain layout.
    Plain(PlainColumns),
    /// NGSIM's layouts.
    Ngsim(NgsimColumns),
}

impl Columns {
    /// One row in SI units.
    pub(super) fn parse(&self, line: &str, fields: &Fields) -> Result<Row, Fault> {
        match self {
            Self::Plain(columns) => columns.parse(line, fields),
            Self::Ngsim(columns) => columns.parse(line, fields),
        }
    }

    /// The column that names the recording, and the name in this row.
    pub(super) fn recording<'l>(&self, line: &'l str, fields: &Fields) -> Option<(&'static str, &'l str)> {
        match self {
            Self::Plain(columns) => Some(("recording_id", columns.recording(line, fields)?)),
            Self::Ngsim(columns) => Some(("Location", columns.recording(line, fields)?)),
        }
    }

    /// The layout.
    pub(super) fn layout(&self) -> Layout {
        match self {
            Self::Plain(_) => Layout::Plain,
            Self::Ngsim(columns) if columns.is_export() => Layout::Ngsim25,
            Self::Ngsim(_) => Layout::Ngsim18,
        }
    }
}

/// Number of columns in NGSIM's original files.
const NGSIM_COLUMNS: usize = 18;

/// With fewer known names than this, a first line is not taken for a header of that layout.
const FEWEST_KNOWN_NAMES: usize = 4;

/// The longest beginning of a first line that an error repeats [characters].
const SHOWN: usize = 40;

/// The format of a file that begins with `line`.
pub(super) fn recognise(line: &str) -> Result<Format, RecordingProblem> {
    let separator = if line.contains(',') { Separator::Comma } else { Separator::Blank };
    let mut fields = Fields::default();
    fields.split(line, separator)?;
    let header = Header::new((0..fields.len()).map(|index| fields.get(line, index)));
    let (plain, ngsim) = (header.count(&PlainColumns::NAMES), header.count(&NgsimColumns::NAMES));
    let (width, has_header) = (fields.len(), true);
    if plain.max(ngsim) >= FEWEST_KNOWN_NAMES {
        header.refuse_duplicates()?;
        let columns = if plain > ngsim {
            Columns::Plain(PlainColumns::new(&header)?)
        } else {
            Columns::Ngsim(NgsimColumns::new(&header)?)
        };
        return Ok(Format { columns, separator, width, has_header });
    }
    if width == NGSIM_COLUMNS && header.is_numeric() {
        let columns = Columns::Ngsim(NgsimColumns::ORIGINAL);
        return Ok(Format { columns, separator, width, has_header: false });
    }
    Err(RecordingProblem::UnknownLayout { columns: width, start: line.chars().take(SHOWN).collect() })
}

/// The names in a first line, in lower case: NGSIM's spelling varies.
pub(super) struct Header {
    names: Vec<String>,
}

impl Header {
    fn new<'l>(names: impl Iterator<Item = &'l str>) -> Self {
        Self { names: names.map(str::to_ascii_lowercase).collect() }
    }

    /// The place of a column.
    pub(super) fn find(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|found| found.eq_ignore_ascii_case(name))
    }

    /// The place of a column that has to be there.
    pub(super) fn need(&self, name: &'static str, layout: &'static str) -> Result<usize, RecordingProblem> {
        self.find(name).ok_or(RecordingProblem::MissingColumn { name, layout })
    }

    fn count(&self, known: &[&str]) -> usize {
        known.iter().filter(|name| self.find(name).is_some()).count()
    }

    fn refuse_duplicates(&self) -> Result<(), RecordingProblem> {
        for (place, name) in self.names.iter().enumerate() {
            if self.names[..place].contains(name) {
                return Err(RecordingProblem::DuplicateColumn { name: name.clone() });
            }
        }
        Ok(())
    }

    fn is_numeric(&self) -> bool {
        self.names.iter().all(|name| name.parse::<f64>().is_ok())
    }
}
