//! Reads the output of a process. The memory needed is bounded, whatever the process writes.

use std::collections::VecDeque;
use std::io::{self, BufRead, BufReader, Read};
use std::sync::mpsc::SyncSender;

/// Longest line that is accepted (bytes).
pub(super) const MAX_LINE_BYTES: usize = 1 << 20;

/// Number of bytes of standard error that are kept.
const KEPT_STDERR_BYTES: usize = 2_048;

/// Number of lines of standard error that an error message quotes.
const QUOTED_LINES: usize = 5;

/// Longest excerpt of a line in an error message (characters).
const MAX_EXCERPT_CHARS: usize = 120;

/// The record separator of ASCII. A worker process writes it to standard error when a sample
/// begins: no message quotes the output of a previous sample.
pub const NEW_SAMPLE: u8 = 0x1e;

/// A line of standard output.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Line {
    /// A complete line, without its line feed.
    Whole(Vec<u8>),
    /// A line longer than [`MAX_LINE_BYTES`].
    TooLong,
}

/// Sends every line to `lines`, until the source ends, a line is too long, or the receiver is gone.
/// With each line goes whether more bytes arrived together with it.
pub(super) fn read_lines(source: impl Read, lines: &SyncSender<(Line, bool)>) {
    let mut source = BufReader::new(source);
    loop {
        let line = match next_line(&mut source) {
            Ok(Some(line)) => line,
            Ok(None) | Err(_) => return,
        };
        let is_last = line == Line::TooLong;
        if lines.send((line, !source.buffer().is_empty())).is_err() || is_last {
            return;
        }
    }
}

/// Returns the next line, or `None` at the end of the source. Text after the last line feed counts
/// as a line if it is not empty.
fn next_line(source: &mut impl BufRead) -> io::Result<Option<Line>> {
    let mut line = Vec::new();
    source.take(MAX_LINE_BYTES as u64 + 1).read_until(b'\n', &mut line)?;
    if line.last() == Some(&b'\n') {
        line.pop();
    } else if line.len() > MAX_LINE_BYTES {
        return Ok(Some(Line::TooLong));
    } else if line.is_empty() {
        return Ok(None);
    }
    Ok(Some(Line::Whole(line)))
}

/// The last bytes of a stream of any length.
#[derive(Debug, Default)]
pub(super) struct Tail(VecDeque<u8>);

impl Tail {
    /// Appends bytes, and drops the oldest ones beyond [`KEPT_STDERR_BYTES`].
    pub(super) fn push(&mut self, bytes: &[u8]) {
        let bytes = match bytes.iter().rposition(|byte| *byte == NEW_SAMPLE) {
            Some(at) => {
                self.0.clear();
                &bytes[at + 1..]
            }
            None => bytes,
        };
        self.0.extend(bytes);
        let excess = self.0.len().saturating_sub(KEPT_STDERR_BYTES);
        self.0.drain(..excess);
    }

    /// Returns the last non-empty lines, joined into one.
    pub(super) fn last_lines(&self) -> String {
        let bytes: Vec<u8> = self.0.iter().copied().collect();
        let text = String::from_utf8_lossy(&bytes);
        let lines: Vec<&str> = text.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
        let older = lines.len().saturating_sub(QUOTED_LINES);
        let lines: Vec<String> = lines[older..].iter().map(|line| without_thread_number(line)).collect();
        excerpt_of(&lines.join(" | "), KEPT_STDERR_BYTES)
    }
}

/// Returns a line without the number by which the system knows a thread, which differs from run to
/// run. Rust writes `thread 'main' (4711) has overflowed its stack`, Python
/// `Current thread 0x00007f3a5c6b7740 (most recent call first):`.
fn without_thread_number(line: &str) -> String {
    let of_rust = || {
        let (name, rest) = line.strip_prefix("thread '")?.split_once("' (")?;
        let (number, after) = rest.split_once(')')?;
        let is_number = !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit());
        is_number.then(|| format!("thread '{name}'{after}"))
    };
    let of_python = || {
        let (name, after) = line.split_once(" 0x").filter(|(name, _)| matches!(*name, "Thread" | "Current thread"))?;
        Some(format!("{name}{}", after.trim_start_matches(|c: char| c.is_ascii_hexdigit())))
    };
    of_rust().or_else(of_python).unwrap_or_else(|| line.to_owned())
}

/// Returns the beginning of a line, for an error message.
pub(crate) fn excerpt(line: &[u8]) -> String {
    excerpt_of(&String::from_utf8_lossy(line), MAX_EXCERPT_CHARS)
}

fn excerpt_of(text: &str, max_chars: usize) -> String {
    let mut excerpt: String = text.chars().take(max_chars).collect();
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
        receiver.iter().map(|(line, _)| line).collect()
    }

    #[test]
    fn the_source_is_split_at_line_feeds() {
        let whole = |text: &str| Line::Whole(text.as_bytes().to_vec());
        assert_eq!(lines_of(b"a\n\nbc"), [whole("a"), whole(""), whole("bc")]);
        assert_eq!(lines_of(b""), []);
    }

    #[test]
    fn a_line_says_whether_another_one_came_with_it() {
        let (sender, receiver) = sync_channel(16);
        read_lines(&b"a\nb\n"[..], &sender);
        drop(sender);
        assert_eq!(receiver.iter().map(|(_, is_followed)| is_followed).collect::<Vec<_>>(), [true, false]);
    }

    #[test]
    fn reading_stops_at_a_line_that_is_too_long() {
        assert_eq!(lines_of(&vec![b'x'; MAX_LINE_BYTES + 1]), [Line::TooLong]);
        let longest = vec![b'x'; MAX_LINE_BYTES];
        assert_eq!(lines_of(&longest), [Line::Whole(longest.clone())]);
        // Reading an endless source without a line feed stops, too.
        let (sender, receiver) = sync_channel(1);
        read_lines(io::repeat(b'x'), &sender);
        assert!(matches!(receiver.recv(), Ok((Line::TooLong, _))));
    }

    #[test]
    fn only_the_end_of_standard_error_is_kept() {
        let mut tail = Tail::default();
        for number in 0..10_000 {
            tail.push(format!("line {number}\n").as_bytes());
        }
        assert_eq!(tail.last_lines(), "line 9995 | line 9996 | line 9997 | line 9998 | line 9999");
    }

    #[test]
    fn the_number_of_a_thread_is_left_out() {
        let mut tail = Tail::default();
        tail.push(b"\nthread 'main' (4711) has overflowed its stack\nfatal runtime error: stack overflow, aborting\n");
        tail.push(b"thread 'a (b)' (x) is late\n");
        assert_eq!(
            tail.last_lines(),
            "thread 'main' has overflowed its stack | fatal runtime error: stack overflow, aborting | thread 'a (b)' (x) is late"
        );
        tail.push(b"\x1eFatal Python error: Segmentation fault\n\nCurrent thread 0x00007f3a5c6b7740 (most recent call first):\n");
        tail.push(b"Thread 0x1f [worker] (most recent call first):\nthe thread 0x1f is late\n");
        assert_eq!(
            tail.last_lines(),
            "Fatal Python error: Segmentation fault | Current thread (most recent call first): | Thread [worker] (most recent call \
             first): | the thread 0x1f is late"
        );
    }
}
