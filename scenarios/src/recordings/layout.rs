//! Which layout a file has, by its first line.

use super::exid::{ExidColumns, Survey};
use super::fields::Fault;
use super::file_set::Meta;
use super::highd::HighdColumns;
use super::in_car::InCarColumns;
use super::ngsim::NgsimColumns;
use super::plain::PlainColumns;
use super::rows::{Fields, Separator};
use super::source::{About, Row};
use super::{RecordingError, RecordingProblem};

/// How to read the rows of one file.
pub(super) struct Format {
    pub(super) columns: Box<dyn TextLayout>,
    pub(super) separator: Separator,
    /// Number of fields that each row has.
    pub(super) width: usize,
    /// False where the first line is a row already.
    pub(super) has_header: bool,
}

/// The columns of one layout of text.
pub(super) trait TextLayout {
    /// What is known so far, but for the name.
    fn about(&self) -> About;

    /// The column that names the recording, and the name in this row.
    fn recording<'l>(&self, line: &'l str, fields: &Fields) -> Option<(&'static str, &'l str)>;

    /// One line in SI units; nothing where the line carries none.
    ///
    /// # Errors
    /// The column and what is wrong.
    fn parse(&mut self, line: &str, fields: &Fields) -> Result<Option<Row>, Fault>;

    /// The file has ended.
    ///
    /// # Errors
    /// What is then still missing; where asked again, what else.
    fn end(&mut self) -> Result<(), Fault> {
        Ok(())
    }
}

/// Number of columns in NGSIM's original files.
const NGSIM_COLUMNS: usize = 18;

/// With fewer known names than this, a first line is not taken for a header of that layout.
const FEWEST_KNOWN_NAMES: usize = 4;

/// So many of the names that only one layout has make a first line a header of that.
const FEWEST_OWN_NAMES: usize = 2;

/// The longest beginning of a first line that an error repeats [characters].
const SHOWN: usize = 40;

/// True where `line` is the header of the rows of a highD or exiD recording, which need metadata.
pub(super) fn is_of_drone(line: &str) -> bool {
    Header::of(line).is_ok_and(|(header, ..)| header.is_highd() || header.is_exid())
}

/// The format of the rows of a highD or exiD recording.
///
/// `survey` is asked for where the layout is exiD's.
pub(super) fn of_drone(
    line: &str,
    meta: Meta,
    survey: impl FnOnce() -> Result<Survey, RecordingError>,
) -> Result<Format, Result<RecordingProblem, RecordingError>> {
    let (header, separator, width) = Header::of(line).map_err(Ok)?;
    header.refuse_duplicates().map_err(Ok)?;
    let columns: Box<dyn TextLayout> = if header.is_exid() {
        Box::new(ExidColumns::new(&header, meta, survey().map_err(Err)?).map_err(Ok)?)
    } else {
        Box::new(HighdColumns::new(&header, meta).map_err(Ok)?)
    };
    Ok(Format { columns, separator, width, has_header: true })
}

/// The format of a file that begins with `line`.
pub(super) fn recognise(line: &str) -> Result<Format, RecordingProblem> {
    let (header, separator, width) = Header::of(line)?;
    if header.is_highd() || header.is_exid() {
        return Err(RecordingProblem::NeedsMetadata);
    }
    let (plain, ngsim) = (header.count(&PlainColumns::NAMES), header.count(&NgsimColumns::NAMES));
    let has_header = true;
    if header.count(&InCarColumns::OWN_NAMES) >= FEWEST_OWN_NAMES {
        header.refuse_duplicates()?;
        return Ok(Format { columns: Box::new(InCarColumns::new(&header)?), separator, width, has_header });
    }
    if plain.max(ngsim) >= FEWEST_KNOWN_NAMES {
        header.refuse_duplicates()?;
        let columns: Box<dyn TextLayout> =
            if plain > ngsim { Box::new(PlainColumns::new(&header)?) } else { Box::new(NgsimColumns::new(&header)?) };
        return Ok(Format { columns, separator, width, has_header });
    }
    if width == NGSIM_COLUMNS && header.is_numeric() {
        let columns = Box::new(NgsimColumns::ORIGINAL);
        return Ok(Format { columns, separator, width, has_header: false });
    }
    Err(RecordingProblem::UnknownLayout { columns: width, start: line.chars().take(SHOWN).collect() })
}

/// The names in a first line, in lower case: NGSIM's spelling varies.
pub(super) struct Header {
    names: Vec<String>,
}

impl Header {
    pub(super) fn new<'l>(names: impl Iterator<Item = &'l str>) -> Self {
        Self { names: names.map(str::to_ascii_lowercase).collect() }
    }

    /// The names in `line`, what is between them, and how many they are.
    fn of(line: &str) -> Result<(Self, Separator, usize), RecordingProblem> {
        let separator = if line.contains(',') { Separator::Comma } else { Separator::Blank };
        let mut fields = Fields::default();
        fields.split(line, separator)?;
        Ok((Self::new((0..fields.len()).map(|index| fields.get(line, index))), separator, fields.len()))
    }

    fn is_highd(&self) -> bool {
        self.count(&HighdColumns::OWN_NAMES) >= FEWEST_OWN_NAMES
    }

    fn is_exid(&self) -> bool {
        self.count(&["xCenter", "yCenter", "lonVelocity", "laneletId"]) >= FEWEST_OWN_NAMES
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
