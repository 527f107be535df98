//! Reading what a process writes, in bounded memory whatever it writes.

use std::collections::VecDeque;
use std::io::{self, BufRead, BufReader, Read};
use std::sync::mpsc::SyncSender;

/// Longest line that is read (bytes).
pub(super) const LONGEST_LINE: usize = 1 << 20;

/// What is kept of standard error (bytes).
const KEPT_WORDS: usize = 2_048;

/// Lines of standard error that an error message repeats.
const REPEATED_LINES: usize = 5;

/// Longest excerpt of a line in an error message (characters).
const EXCERPT: usize = 120;

/// A line of standard output.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Line {
    /// A whole one, without its end.
    Whole(Vec<u8>),
    /// One longer than [`LONGEST_LINE`].
    TooLong,
}

/// Hands on every line until there are no more, one is too long, or nobody wants them.
pub(super) fn read_lines(source: impl Read, lines: &SyncSender<Line>) {
    let mut source = BufReader::new(source);
    loop {
        let line = match next_line(&mut source) {
            Ok(Some(line)) => line,
            Ok(None) | Err(_) => return,
        };
        let is_last = line == Line::TooLong;
        if lines.send(line).is_err() || is_last {
            return;
        }
    }
}

/// The next line; nothing at the end. What follows the last line's end counts as a line only if it is not empty.
fn next_line(source: &mut impl BufRead) -> io::Result<Option<Line>> {
    let mut line = Vec::new();
    source.take(LONGEST_LINE as u64 + 1).read_until(b'\n', &mut line)?;
    if line.last() == Some(&b'\n') {
        line.pop();
    } else if line.len() > LONGEST_LINE {
        return Ok(Some(Line::TooLong));
    } else if line.is_empty() {
        return Ok(None);
    }
    Ok(Some(Line::Whole(line)))
}

/// The end of what was written, however much that was.
#[derive(Debug, Default)]
pub(super) struct Tail(VecDeque<u8>);

impl Tail {
    pub(super) fn push(&mut self, bytes: &[u8]) {
        self.0.extend(bytes);
        let excess = self.0.len().saturating_sub(KEPT_WORDS);
        self.0.drain(..excess);
    }

    /// The last lines, joined.
    pub(super) fn words(&self) -> String {
        let bytes: Vec<u8> = self.0.iter().copied().collect();
        let text = String::from_utf8_lossy(&bytes);
        let mut lines: Vec<&str> = text.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
        let older = lines.len().saturating_sub(REPEATED_LINES);
        lines.drain(..older);
        excerpt_of(&lines.join(" | "), KEPT_WORDS)
    }
}

/// The beginning of a line, for an error message.
pub(super) fn excerpt(line: &[u8]) -> String {
    excerpt_of(&String::from_utf8_lossy(line), EXCERPT)
}

fn excerpt_of(text: &str, most: usize) -> String {
    let mut excerpt: String = text.chars().take(most).collect();
    if excerpt.len() < text.len() {
        excerpt.push('…');
    }
    excerpt
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::sync_channel;

    use super::*;

    fn lines_of(text: &[u8]) -> Vec<Line> {
        let (sender, receiver) = sync_channel(16);
        read_lines(text, &sender);
        drop(sender);
        receiver.iter().collect()
    }

    #[test]
    fn lines_are_cut_at_their_ends() {
        let whole = |text: &str| Line::Whole(text.as_bytes().to_vec());
        assert_eq!(lines_of(b"a\n\nbc"), [whole("a"), whole(""), whole("bc")]);
        assert_eq!(lines_of(b""), []);
    }

    #[test]
    fn a_line_without_an_end_is_not_read_for_ever() {
        assert_eq!(lines_of(&vec![b'x'; LONGEST_LINE + 1]), [Line::TooLong]);
        let longest = vec![b'x'; LONGEST_LINE];
        assert_eq!(lines_of(&longest), [Line::Whole(longest.clone())]);
        // An endless source ends the reading as well.
        let (sender, receiver) = sync_channel(1);
        read_lines(io::repeat(b'x'), &sender);
        assert_eq!(receiver.recv(), Ok(Line::TooLong));
    }

    #[test]
    fn of_standard_error_the_end_is_kept() {
        let mut tail = Tail::default();
        for number in 0..10_000 {
            tail.push(format!("line {number}\n").as_bytes());
        }
        assert_eq!(tail.words(), "line 9995 | line 9996 | line 9997 | line 9998 | line 9999");
    }
}
