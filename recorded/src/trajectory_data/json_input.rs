//! The bytes of a JSON file, with a bound on what a parser may hold of them.

use std::cell::Cell;
use std::io::{self, BufRead, Read};
use std::rc::Rc;

/// Longest text (bytes). A parser holds a whole text in memory, even one that nothing reads. The
/// longest texts of a file are pictures and point clouds.
const MAX_TEXT_BYTES: usize = 1 << 26;

/// Deepest nesting: twice as deep as frames of OpenLABEL with attributes, and less than a parser
/// follows.
const MAX_DEPTH: u32 = 100;

const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// The number of the current line, shared with the parser.
#[derive(Clone, Debug, Default)]
pub(super) struct LineCounter(Rc<Cell<u64>>);

impl LineCounter {
    /// Returns the number of the current line, counted from 1.
    pub(super) fn line(&self) -> u64 {
        self.0.get() + 1
    }
}

/// A byte source that counts lines and refuses endless texts and endless nesting. It leaves out a byte order mark.
pub(super) struct JsonInput<R> {
    source: R,
    lines: LineCounter,
    /// Number of bytes of the current text; `None` outside.
    text_bytes: Option<usize>,
    is_escaped: bool,
    /// Number of objects and lists that are open.
    depth: u32,
}

impl<R: BufRead> JsonInput<R> {
    /// Creates a source of the bytes of `source`, and the counter of its lines.
    ///
    /// # Errors
    /// The source cannot be read.
    pub(super) fn new(mut source: R) -> io::Result<(Self, LineCounter)> {
        if source.fill_buf()?.starts_with(BYTE_ORDER_MARK) {
            source.consume(BYTE_ORDER_MARK.len());
        }
        let lines = LineCounter::default();
        Ok((Self { source, lines: lines.clone(), text_bytes: None, is_escaped: false, depth: 0 }, lines))
    }

    fn observe(&mut self, byte: u8) -> io::Result<()> {
        self.lines.0.set(self.lines.0.get() + u64::from(byte == b'\n'));
        match self.text_bytes {
            None => match byte {
                b'"' => self.text_bytes = Some(0),
                b'{' | b'[' if self.depth >= MAX_DEPTH => {
                    return Err(io::Error::other(format!("objects and lists are nested deeper than {MAX_DEPTH}")));
                }
                b'{' | b'[' => self.depth += 1,
                b'}' | b']' => self.depth = self.depth.saturating_sub(1),
                _ => {}
            },
            Some(_) if self.is_escaped => self.is_escaped = false,
            Some(_) if byte == b'"' => self.text_bytes = None,
            Some(bytes) if bytes >= MAX_TEXT_BYTES => {
                return Err(io::Error::other(format!("a text is longer than {MAX_TEXT_BYTES} bytes")));
            }
            Some(bytes) => {
                self.is_escaped = byte == b'\\';
                self.text_bytes = Some(bytes + 1);
            }
        }
        Ok(())
    }
}

impl<R: BufRead> Read for JsonInput<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.source.read(buffer)?;
        buffer[..count].iter().try_for_each(|byte| self.observe(*byte))?;
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_counted_and_an_endless_text_is_refused() {
        let (mut input, lines) = JsonInput::new(&b"\xef\xbb\xbf{\"a\\\"\":\n1}"[..]).unwrap();
        let mut text = String::new();
        input.read_to_string(&mut text).unwrap();
        assert_eq!((text.as_str(), lines.line()), ("{\"a\\\"\":\n1}", 2));
        let endless = io::BufReader::new(b"[\"".chain(io::repeat(b'x')));
        let (mut input, _) = JsonInput::new(endless).unwrap();
        let error = io::copy(&mut input, &mut io::sink()).unwrap_err();
        assert!(error.to_string().contains("longer than 67108864 bytes"), "{error}");
    }
}
