//! Detection of a file's layout from its first line.

use super::error::{TrajectoryFileError, TrajectoryFileProblem};
use super::exid::ExidColumns;
use super::file_set::Meta;
use super::header::Header;
use super::highd::HighdColumns;
use super::in_car::InCarColumns;
use super::inferred_road::InferredRoad;
use super::ngsim::NgsimColumns;
use super::plain::PlainColumns;
use super::rows::Separator;
use super::text_layout::TextLayout;

/// The column layout and syntax of one file.
pub(super) struct Format {
    pub(super) columns: Box<dyn TextLayout>,
    pub(super) separator: Separator,
    /// Number of fields in each row.
    pub(super) width: usize,
    /// `false` if the first line is a row instead of a header.
    pub(super) has_header: bool,
}

/// Number of columns in NGSIM's original files.
const NGSIM_COLUMNS: usize = 18;

/// Minimum number of known column names for a first line to count as a header of that layout.
const MIN_KNOWN_NAMES: usize = 4;

/// Minimum number of column names unique to one layout for a first line to count as a header of
/// that layout.
const MIN_OWN_NAMES: usize = 2;

/// Maximum length of the first line's beginning that an error message repeats (characters).
const MAX_SHOWN_CHARS: usize = 40;

/// Returns `true` if `line` is the header of a highD or exiD tracks file, which needs metadata
/// files.
pub(super) fn is_drone_header(line: &str) -> bool {
    Header::parse(line).is_ok_and(|(header, ..)| is_highd(&header) || is_exid(&header))
}

/// Determines the format of a highD or exiD tracks file.
///
/// For exiD it calls `infer_road` with the frame rate (Hz), which derives the road from the traffic.
pub(super) fn drone_format(
    line: &str,
    meta: Meta,
    infer_road: impl FnOnce(f64) -> Result<InferredRoad, TrajectoryFileError>,
) -> Result<Format, Result<TrajectoryFileProblem, TrajectoryFileError>> {
    let (header, separator, width) = Header::parse(line).map_err(Ok)?;
    if separator == Separator::Semicolon {
        return Err(Ok(TrajectoryFileProblem::SemicolonSeparated));
    }
    header.check_no_duplicates().map_err(Ok)?;
    let columns: Box<dyn TextLayout> = if is_exid(&header) {
        let road = infer_road(meta.data.frame_rate_hz).map_err(Err)?;
        Box::new(ExidColumns::new(&header, meta, road).map_err(Ok)?)
    } else {
        Box::new(HighdColumns::new(&header, meta).map_err(Ok)?)
    };
    Ok(Format { columns, separator, width, has_header: true })
}

/// Determines the format of a file from its first line.
pub(super) fn recognise(line: &str) -> Result<Format, TrajectoryFileProblem> {
    let (header, separator, width) = Header::parse(line)?;
    if is_highd(&header) || is_exid(&header) {
        return Err(TrajectoryFileProblem::NeedsMetadata);
    }
    let (plain, ngsim) = (header.count(&PlainColumns::NAMES), header.count(&NgsimColumns::NAMES));
    let has_header = true;
    if header.count(&InCarColumns::OWN_NAMES) >= MIN_OWN_NAMES {
        header.check_no_duplicates()?;
        return Ok(Format { columns: Box::new(InCarColumns::new(&header)?), separator, width, has_header });
    }
    if plain.max(ngsim) >= MIN_KNOWN_NAMES {
        header.check_no_duplicates()?;
        let columns: Box<dyn TextLayout> =
            if plain > ngsim { Box::new(PlainColumns::new(&header)?) } else { Box::new(NgsimColumns::new(&header)?) };
        return Ok(Format { columns, separator, width, has_header });
    }
    if width == NGSIM_COLUMNS && header.is_numeric() {
        let columns = Box::new(NgsimColumns::ORIGINAL);
        return Ok(Format { columns, separator, width, has_header: false });
    }
    if let Some(value) = decimal_comma(line) {
        let value = value.chars().take(MAX_SHOWN_CHARS).collect();
        return Err(TrajectoryFileProblem::DecimalCommas { value });
    }
    Err(TrajectoryFileProblem::UnknownLayout { columns: width, start: line.chars().take(MAX_SHOWN_CHARS).collect() })
}

/// Returns the first field with a decimal comma of a row in NGSIM's columns between blanks or tabs.
fn decimal_comma(line: &str) -> Option<&str> {
    let fields: Vec<&str> = line.split_ascii_whitespace().collect();
    let is_number = |field: &&str| field.replacen(',', ".", 1).parse::<f64>().is_ok();
    let is_row = fields.len() == NGSIM_COLUMNS && fields.iter().all(is_number);
    fields.into_iter().find(|field| is_row && field.contains(','))
}

/// Returns `true` if `header` is the header of highD's tracks file.
fn is_highd(header: &Header) -> bool {
    header.count(&HighdColumns::OWN_NAMES) >= MIN_OWN_NAMES
}

/// Returns `true` if `header` is the header of exiD's tracks file.
fn is_exid(header: &Header) -> bool {
    header.count(&["xCenter", "yCenter", "lonVelocity", "laneletId"]) >= MIN_OWN_NAMES
}
