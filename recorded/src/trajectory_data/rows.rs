//! Splitting of text into rows of fields, one line at a time.
//!
//! In none of the layouts does a quoted field span several lines. Reading line by line therefore
//! bounds the memory that a damaged file can occupy, and gives the line number of every error.

use std::io::{self, BufRead, Read};
use std::ops::Range;

use super::error::TrajectoryFileProblem;

/// Maximum length of a line (bytes). The lines of the supported layouts stay below 300.
const MAX_LINE_BYTES: u64 = 16_384;

const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// The separator between fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Separator {
    /// A comma. Fields may be in double quotes.
    Comma,
    /// A semicolon, with decimal commas or points. Fields may be in double quotes.
    Semicolon,
    /// One or more blanks or tabs.
    Blank,
}

/// A source of text lines that counts them.
pub(super) struct Lines<R> {
    source: R,
    buffer: Vec<u8>,
    number: u64,
}

impl<R: BufRead> Lines<R> {
    pub(super) fn new(source: R) -> Self {
        Self { source, buffer: Vec::new(), number: 0 }
    }

    /// Returns the next line that is not blank, and its number, counted from 1. The line has
    /// neither line end nor byte order mark.
    pub(super) fn next(&mut self) -> Result<Option<(u64, &str)>, (u64, TrajectoryFileProblem)> {
        loop {
            self.buffer.clear();
            let read = self.source.by_ref().take(MAX_LINE_BYTES + 1).read_until(b'\n', &mut self.buffer);
            if read.map_err(|error| (self.number + 1, io_problem(error)))? == 0 {
                return Ok(None);
            }
            self.number += 1;
            if self.number == 1 && self.buffer.starts_with(BYTE_ORDER_MARK) {
                self.buffer.drain(..BYTE_ORDER_MARK.len());
            }
            if self.number == 1 && is_utf16(&self.buffer) {
                return Err((self.number, TrajectoryFileProblem::Utf16));
            }
            if self.buffer.contains(&0) {
                return Err((self.number, TrajectoryFileProblem::Binary));
            }
            if self.number == 1 && has_carriage_returns(&self.buffer) {
                return Err((self.number, TrajectoryFileProblem::CarriageReturns));
            }
            if self.buffer.len() as u64 > MAX_LINE_BYTES {
                return Err((self.number, TrajectoryFileProblem::LineTooLong { allowed: MAX_LINE_BYTES }));
            }
            if !self.buffer.trim_ascii().is_empty() {
                break;
            }
        }

        match std::str::from_utf8(&self.buffer) {
            Ok(line) => Ok(Some((self.number, line.trim()))),
            Err(_) if self.number == 1 && !is_latin(&self.buffer) => Err((self.number, TrajectoryFileProblem::Binary)),
            Err(_) if self.number == 1 => Err((self.number, TrajectoryFileProblem::NotUtf8)),
            Err(_) => Err((self.number, TrajectoryFileProblem::NotText)),
        }
    }

    /// Returns `true` if the latest line is not terminated, so that its last field may be cut.
    pub(super) fn is_unterminated(&self) -> bool {
        self.buffer.last().is_some_and(|byte| *byte != b'\n')
    }
}

/// Returns true if the first line, up to a line feed, holds several lines of text that carriage returns
/// alone end.
fn has_carriage_returns(line: &[u8]) -> bool {
    // The end of a long line may be cut within a character.
    let is_text = std::str::from_utf8(line).map_or_else(|error| error.error_len().is_none(), |_| true);
    is_text && line.trim_ascii_end().contains(&b'\r')
}

/// Returns true if a line is text with separators in an encoding of one byte for each letter. The bytes 0xfe
/// and 0xff are the marks of other encodings.
fn is_latin(line: &[u8]) -> bool {
    let is_text = |byte: &u8| (!byte.is_ascii_control() || byte.is_ascii_whitespace()) && *byte < 0xfe;
    let is_separator = |byte: &u8| matches!(byte, b',' | b';' | b'\t' | b' ');
    let other_letters = line.iter().filter(|byte| !byte.is_ascii()).count();
    line.iter().all(is_text) && line.iter().any(is_separator) && 2 * other_letters < line.len()
}

/// Returns true if a file begins like text in UTF-16: with its byte order mark, or with a letter and a
/// zero byte, or the reverse.
fn is_utf16(start: &[u8]) -> bool {
    match start {
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => true,
        [letter, 0, next, 0, ..] | [0, letter, 0, next, ..] => letter.is_ascii_graphic() && next.is_ascii_graphic(),
        _ => false,
    }
}

/// Distinguishes an I/O failure from damaged compression, which the decoder reports with the same
/// error type.
pub(super) fn io_problem(error: io::Error) -> TrajectoryFileProblem {
    match error.kind() {
        io::ErrorKind::InvalidInput | io::ErrorKind::InvalidData | io::ErrorKind::UnexpectedEof => {
            TrajectoryFileProblem::Gzip(error)
        }
        _ => TrajectoryFileProblem::Io(error),
    }
}

/// The positions of the fields in one line.
#[derive(Default)]
pub(super) struct Fields {
    spans: Vec<Range<usize>>,
}

impl Fields {
    pub(super) fn len(&self) -> usize {
        self.spans.len()
    }

    /// Returns the length of the last field (bytes).
    pub(super) fn last_len(&self) -> usize {
        self.spans.last().map_or(0, ExactSizeIterator::len)
    }

    /// Returns one field of `line` without surrounding blanks and quotes.
    pub(super) fn get<'l>(&self, line: &'l str, index: usize) -> &'l str {
        &line[self.spans[index].clone()]
    }

    /// Splits `line` into fields.
    pub(super) fn split(&mut self, line: &str, separator: Separator) -> Result<(), TrajectoryFileProblem> {
        self.spans.clear();
        match separator {
            Separator::Comma => self.split_at(line, b','),
            Separator::Semicolon => self.split_at(line, b';'),
            Separator::Blank => {
                let spans = line.split_ascii_whitespace().map(|field| span_in(line, field));
                self.spans.extend(spans);
                Ok(())
            }
        }
    }

    /// Splits at the separators outside of double quotes.
    fn split_at(&mut self, line: &str, separator: u8) -> Result<(), TrajectoryFileProblem> {
        let (mut start, mut quoted) = (0, false);
        for (index, byte) in line.bytes().enumerate() {
            match byte {
                b'"' => quoted = !quoted,
                byte if byte == separator && !quoted => {
                    self.spans.push(span_in(line, unquoted(&line[start..index])));
                    start = index + 1;
                }
                _ => {}
            }
        }
        if quoted {
            return Err(TrajectoryFileProblem::OpenQuote);
        }
        self.spans.push(span_in(line, unquoted(&line[start..])));
        Ok(())
    }
}

/// Removes surrounding blanks and double quotes.
fn unquoted(field: &str) -> &str {
    let field = field.trim();
    field.strip_prefix('"').and_then(|inner| inner.strip_suffix('"')).map_or(field, str::trim)
}

/// Returns the byte range of `field`, which is a slice of `line`.
fn span_in(line: &str, field: &str) -> Range<usize> {
    let start = field.as_ptr() as usize - line.as_ptr() as usize;
    start..start + field.len()
}

/// A row of a table: the number of its line, and its text with its fields, or why it has none.
pub(super) type TableRow<'a> = (u64, Result<(&'a str, &'a Fields), TrajectoryFileProblem>);

/// Passes on each row of a table with `width` columns. Between semicolons, a comma is a decimal
/// point.
///
/// # Errors
/// The first error of `take`.
pub(super) fn each_row<R: BufRead, E>(
    lines: &mut Lines<R>,
    separator: Separator,
    width: usize,
    mut take: impl FnMut(TableRow<'_>) -> Result<(), E>,
) -> Result<(), E> {
    let mut fields = Fields::default();
    loop {
        let (number, line) = match lines.next() {
            Ok(Some(next)) => next,
            Ok(None) => return Ok(()),
            Err((number, problem)) => {
                take((number, Err(problem)))?;
                continue;
            }
        };
        let has_commas = separator == Separator::Semicolon && line.contains(',');
        let with_points = has_commas.then(|| line.replace(',', "."));
        let line = with_points.as_deref().unwrap_or(line);
        let split = fields.split(line, separator).and_then(|()| match fields.len() {
            actual if actual == width => Ok((line, &fields)),
            actual => Err(TrajectoryFileProblem::ColumnCount { actual, needed: width }),
        });
        take((number, split))?;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn split(line: &str, separator: Separator) -> Result<Vec<String>, TrajectoryFileProblem> {
        let mut fields = Fields::default();
        fields.split(line, separator)?;
        Ok((0..fields.len()).map(|index| fields.get(line, index).to_owned()).collect())
    }

    #[test]
    fn quoted_commas_do_not_separate_and_blanks_are_merged() {
        assert_eq!(split(r#"352,"1,156", 3 ,"#, Separator::Comma).unwrap(), ["352", "1,156", "3", ""]);
        assert_eq!(split("  1 \t 2   3", Separator::Blank).unwrap(), ["1", "2", "3"]);
        assert!(matches!(split(r#"1,"2,3"#, Separator::Comma), Err(TrajectoryFileProblem::OpenQuote)));
    }

    #[test]
    fn blank_lines_count_towards_the_line_number() {
        let mut lines = Lines::new("\u{feff}a\r\n\n  \nb".as_bytes());
        assert_eq!(lines.next().unwrap(), Some((1, "a")));
        assert_eq!(lines.next().unwrap(), Some((4, "b")));
        assert_eq!(lines.next().unwrap(), None);
    }

    #[test]
    fn lines_that_end_with_carriage_returns_alone_are_named() {
        let long = "track_id,frame\r".to_owned() + &"1,2\r".repeat(10_000);
        for text in ["a,b\r1,2\r", long.as_str()] {
            assert!(matches!(Lines::new(text.as_bytes()).next(), Err((1, TrajectoryFileProblem::CarriageReturns))));
        }
        assert_eq!(Lines::new("a,b\r\n1,2\r\n".as_bytes()).next().unwrap(), Some((1, "a,b")));
    }

    #[test]
    fn a_header_in_another_encoding_is_no_binary_file() {
        let first = |bytes: &[u8]| Lines::new(bytes).next().map(|_| ()).unwrap_err().1;
        assert!(matches!(first(b"track_id,frame,L\xe4nge\n1,2,3\n"), TrajectoryFileProblem::NotUtf8));
        for binary in [&b"\x01\xff\xfea,b\n"[..], b"\xff\xfe\xff\n", b"a\xff\xfe\xfd\n"] {
            let problem = first(binary);
            assert!(!matches!(problem, TrajectoryFileProblem::NotUtf8), "{problem}");
        }
    }

    #[test]
    fn an_endless_line_is_rejected_without_reading_it_whole() {
        let mut lines = Lines::new(io::BufReader::new(io::repeat(b'x')));
        assert!(matches!(lines.next(), Err((1, TrajectoryFileProblem::LineTooLong { .. }))));
    }
}
