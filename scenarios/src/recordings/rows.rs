//! Text to rows of fields, one line at a time.
//!
//! None of the layouts lets a quoted field run over several lines. Reading by lines therefore bounds the memory that a
//! damaged file can take, and gives the line number of every error.

use std::io::{self, BufRead, Read};
use std::ops::Range;

use super::RecordingProblem;

/// The longest line that is read [bytes]; the layouts' own lines stay below 300.
const LONGEST_LINE: u64 = 16_384;

const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// How fields are told apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Separator {
    /// A comma; fields may be in double quotes.
    Comma,
    /// One or more blanks or tabs.
    Blank,
}

/// A source of lines that counts them.
pub(super) struct Lines<R> {
    source: R,
    buffer: Vec<u8>,
    number: u64,
}

impl<R: BufRead> Lines<R> {
    pub(super) fn new(source: R) -> Self {
        Self { source, buffer: Vec::new(), number: 0 }
    }

    /// The next line that is not blank, without its end and without a byte order mark, and its number, counted from 1.
    pub(super) fn next(&mut self) -> Result<Option<(u64, &str)>, (u64, RecordingProblem)> {
        loop {
            self.buffer.clear();
            let read = self.source.by_ref().take(LONGEST_LINE + 1).read_until(b'\n', &mut self.buffer);
            if read.map_err(|error| (self.number + 1, io_problem(error)))? == 0 {
                return Ok(None);
            }
            self.number += 1;
            if self.number == 1 && self.buffer.starts_with(BYTE_ORDER_MARK) {
                self.buffer.drain(..BYTE_ORDER_MARK.len());
            }
            if self.buffer.contains(&0) {
                return Err((self.number, RecordingProblem::Binary));
            }
            if self.buffer.len() as u64 > LONGEST_LINE {
                return Err((self.number, RecordingProblem::LineTooLong { allowed: LONGEST_LINE }));
            }
            if !self.buffer.trim_ascii().is_empty() {
                break;
            }
        }

        match std::str::from_utf8(&self.buffer) {
            Ok(line) => Ok(Some((self.number, line.trim()))),
            Err(_) if self.number == 1 => Err((self.number, RecordingProblem::Binary)),
            Err(_) => Err((self.number, RecordingProblem::NotText)),
        }
    }

    /// True where the latest line has no end, so that its last field may be cut.
    pub(super) fn is_cut(&self) -> bool {
        self.buffer.last().is_some_and(|byte| *byte != b'\n')
    }
}

/// An I/O failure, told apart from damaged compression, which the decoder reports in the same type.
pub(super) fn io_problem(error: io::Error) -> RecordingProblem {
    match error.kind() {
        io::ErrorKind::InvalidInput | io::ErrorKind::InvalidData | io::ErrorKind::UnexpectedEof => {
            RecordingProblem::Gzip(error)
        }
        _ => RecordingProblem::Io(error),
    }
}

/// Where the fields of one line are.
#[derive(Default)]
pub(super) struct Fields {
    spans: Vec<Range<usize>>,
}

impl Fields {
    pub(super) fn len(&self) -> usize {
        self.spans.len()
    }

    /// One field of `line`, without surrounding blanks and quotes.
    pub(super) fn get<'l>(&self, line: &'l str, index: usize) -> &'l str {
        &line[self.spans[index].clone()]
    }

    /// Splits `line`.
    pub(super) fn split(&mut self, line: &str, separator: Separator) -> Result<(), RecordingProblem> {
        self.spans.clear();
        match separator {
            Separator::Comma => self.split_commas(line),
            Separator::Blank => {
                let spans = line.split_ascii_whitespace().map(|field| span_in(line, field));
                self.spans.extend(spans);
                Ok(())
            }
        }
    }

    fn split_commas(&mut self, line: &str) -> Result<(), RecordingProblem> {
        let (mut start, mut quoted) = (0, false);
        for (place, byte) in line.bytes().enumerate() {
            match byte {
                b'"' => quoted = !quoted,
                b',' if !quoted => {
                    self.spans.push(span_in(line, unquoted(&line[start..place])));
                    start = place + 1;
                }
                _ => {}
            }
        }
        if quoted {
            return Err(RecordingProblem::OpenQuote);
        }
        self.spans.push(span_in(line, unquoted(&line[start..])));
        Ok(())
    }
}

fn unquoted(field: &str) -> &str {
    let field = field.trim();
    field.strip_prefix('"').and_then(|inner| inner.strip_suffix('"')).map_or(field, str::trim)
}

/// The place of `field`, a slice of `line`.
fn span_in(line: &str, field: &str) -> Range<usize> {
    let start = field.as_ptr() as usize - line.as_ptr() as usize;
    start..start + field.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn split(line: &str, separator: Separator) -> Result<Vec<String>, RecordingProblem> {
        let mut fields = Fields::default();
        fields.split(line, separator)?;
        Ok((0..fields.len()).map(|index| fields.get(line, index).to_owned()).collect())
    }

    #[test]
    fn quotes_hide_commas_and_blanks_join() {
        assert_eq!(split(r#"352,"1,156", 3 ,"#, Separator::Comma).unwrap(), ["352", "1,156", "3", ""]);
        assert_eq!(split("  1 \t 2   3", Separator::Blank).unwrap(), ["1", "2", "3"]);
        assert!(matches!(split(r#"1,"2,3"#, Separator::Comma), Err(RecordingProblem::OpenQuote)));
    }

    #[test]
    fn lines_are_counted_with_the_blank_ones() {
        let mut lines = Lines::new("\u{feff}a\r\n\n  \nb".as_bytes());
        assert_eq!(lines.next().unwrap(), Some((1, "a")));
        assert_eq!(lines.next().unwrap(), Some((4, "b")));
        assert_eq!(lines.next().unwrap(), None);
    }

    #[test]
    fn a_line_without_end_is_refused_without_reading_it() {
        let mut lines = Lines::new(io::BufReader::new(io::repeat(b'x')));
        assert!(matches!(lines.next(), Err((1, RecordingProblem::LineTooLong { .. }))));
    }
}
