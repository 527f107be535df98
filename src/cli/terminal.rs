//! Texts for people at a terminal: wrapped at words to its width, with verdicts in colour. A command
//! stays on its line, so that it can be copied. A pipe receives the text as it is.
//!
//! `NO_COLOR` and `CLICOLOR` are respected (crate `console`).

use std::io::{IsTerminal, stderr, stdout};
use std::os::fd::AsFd;

use console::Style;
use rustix::termios::tcgetwinsize;
use textwrap::{Options, WordSeparator, WordSplitter, wrap};

/// Further indentation of a line that goes on in the next (columns).
const HANGING: usize = 2;
/// Narrowest terminal to which texts are wrapped (columns).
const LEAST_WIDTH: usize = 20;

/// Returns a text for standard output. Nothing may replace control characters afterwards: the colours
/// are such.
pub(super) fn for_terminal(text: &str) -> String {
    if !stdout().is_terminal() {
        return text.to_owned();
    }
    let wrapped = columns(stdout()).map_or_else(|| text.to_owned(), |width| wrapped(text, width, true));
    if console::colors_enabled() { coloured(&wrapped) } else { wrapped }
}

/// Returns a text for standard error. Its words stay whole, so that paths can be copied.
pub(super) fn for_error_terminal(text: &str) -> String {
    error_columns().map_or_else(|| text.to_owned(), |width| wrapped(text, width, false))
}

/// Returns the width of messages on standard error, if that is a terminal whose width is known
/// (columns).
pub(super) fn error_columns() -> Option<usize> {
    columns(stderr()).filter(|_| stderr().is_terminal()).map(|columns| columns.max(LEAST_WIDTH))
}

/// Returns the width of a terminal (columns); `None` if it is not known. The number of rows does not
/// matter: some terminals state none.
fn columns(terminal: impl AsFd) -> Option<usize> {
    tcgetwinsize(terminal).ok().map(|size| usize::from(size.ws_col)).filter(|columns| *columns > 0)
}

/// Returns the width of standard output, if that is a terminal whose width is known (columns).
pub(super) fn output_columns() -> Option<usize> {
    columns(stdout()).filter(|_| stdout().is_terminal())
}

/// Returns a line that is cut off at the width of the terminal.
pub(super) fn cut(line: &str) -> String {
    match output_columns() {
        Some(width) if line.chars().count() > width.max(LEAST_WIDTH) => {
            let kept: String = line.chars().take(width.max(LEAST_WIDTH) - 1).collect();
            format!("{kept}…")
        }
        _ => line.to_owned(),
    }
}

/// Returns true if a line is, or ends with, a command.
fn has_command(line: &str) -> bool {
    line.split(':').any(|part| part.trim_start().starts_with("closecall "))
}

/// Wraps each line at words. A line that goes on is indented further than its begin. `breaks_words`
/// also breaks words that are wider than the terminal.
///
/// Two spaces or more separate the cells of a row. A row that is too wide goes on with a whole cell,
/// so that the end of one cell and the beginning of the next do not read as one.
fn wrapped(text: &str, width: usize, breaks_words: bool) -> String {
    let width = width.max(LEAST_WIDTH);
    let mut lines = Vec::new();
    for line in text.split('\n') {
        if has_command(line) {
            lines.push(line.to_owned());
            continue;
        }
        let content = line.trim_start();
        let indent = line.len() - content.len();
        let cells: Vec<&str> = content.split("  ").map(str::trim).filter(|cell| !cell.is_empty()).collect();
        if cells.len() < 2 || line.chars().count() <= width {
            lines.extend(wrapped_line(content, indent, width, breaks_words));
            continue;
        }
        for (number, row) in rows(&cells, width.saturating_sub(indent + HANGING)).iter().enumerate() {
            let indent = if number == 0 { indent } else { (indent + HANGING).min(width / 2) };
            lines.extend(wrapped_line(row, indent, width, breaks_words));
        }
    }
    lines.join("\n")
}

/// Joins cells to rows of at most this width (columns). A wider cell has a row of its own.
fn rows(cells: &[&str], width: usize) -> Vec<String> {
    let mut rows: Vec<String> = Vec::new();
    for cell in cells {
        match rows.last_mut() {
            Some(row) if row.chars().count() + 2 + cell.chars().count() <= width => {
                row.push_str("  ");
                row.push_str(cell);
            }
            _ => rows.push((*cell).to_owned()),
        }
    }
    rows
}

/// Wraps one line at words, to a width (columns). The flag also breaks words that are wider.
fn wrapped_line(content: &str, indent: usize, width: usize, breaks_words: bool) -> Vec<String> {
    let hanging = " ".repeat((indent + HANGING).min(width / 2));
    let options = Options::new(width).subsequent_indent(&hanging).word_splitter(WordSplitter::NoHyphenation);
    let options = options.break_words(breaks_words).word_separator(WordSeparator::AsciiSpace);
    let begin = " ".repeat(indent);
    wrap(content, options.initial_indent(&begin)).into_iter().map(|line| line.into_owned()).collect()
}

/// Returns a style of the terminal.
type NewStyle = fn() -> Style;

/// The words at the beginning of a line that have a colour.
const WORDS: [(&str, NewStyle); 11] = [
    ("PASS", good),
    ("FAIL", bad),
    ("INVALID", bad),
    ("ERROR", bad),
    ("INCONCLUSIVE", undecided),
    ("NOT JUDGED", undecided),
    ("OVERRIDDEN", undecided),
    ("NOT MET", bad),
    ("met", good),
    ("open", undecided),
    ("COLLISION", bad),
];

fn good() -> Style {
    Style::new().green().bold()
}

fn bad() -> Style {
    Style::new().red().bold()
}

fn undecided() -> Style {
    Style::new().yellow().bold()
}

/// Colours the word at the beginning of each line that has one.
fn coloured(text: &str) -> String {
    let colour = |line: &str| {
        let start = line.trim_start();
        let is_word =
            |word: &str| start.strip_prefix(word).is_some_and(|rest| rest.is_empty() || rest.starts_with([':', ' ']));
        match WORDS.iter().find(|(word, _)| is_word(word)) {
            Some((word, style)) => {
                let (indent, rest) = (&line[..line.len() - start.len()], &start[word.len()..]);
                format!("{indent}{}{rest}", style().apply_to(word))
            }
            None => line.to_owned(),
        }
    };
    text.split('\n').map(colour).collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_line_is_wider_than_the_terminal_and_no_word_is_lost() {
        let text = "FAIL\n  NOT MET: low-thw-overtake: MIS-1: prevents at least 50 % of the collisions\n\n  one two\n";
        for width in [20, 34, 80] {
            let lines = wrapped(text, width, true);
            assert!(lines.split('\n').all(|line| line.chars().count() <= width), "{width}: {lines}");
            let words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
            if width > 20 {
                assert_eq!(words(&lines), words(text), "{width}");
            }
        }
        assert_eq!(wrapped(text, 200, true), text);
        assert_eq!(wrapped("  aa bb cc dd ee ff gg hh", 20, true), "  aa bb cc dd ee ff\n    gg hh");
    }

    #[test]
    fn a_row_goes_on_with_a_whole_cell() {
        let row = "  40 engaged, goal in reach in 5  up to 8.9 m/s slower  12 others";
        let lines = "  40 engaged, goal in reach in 5\n    up to 8.9 m/s slower  12 others";
        assert_eq!(wrapped(row, 40, true), lines);
        assert_eq!(wrapped(row, 100, true), row);
        // A cell that is too wide goes on farther to the right than the next cell begins.
        let narrow = "  40 engaged, goal in\n    reach in 5\n    up to 8.9 m/s\n      slower\n    12 others";
        assert_eq!(wrapped(row, 21, true), narrow);
    }

    #[test]
    fn commands_and_the_paths_of_errors_stay_whole() {
        let command = "resume: closecall campaign low-thw-overtake -n 200 --seed 1 --out results --resume";
        assert_eq!(wrapped(command, 40, true), command);
        let path = "/home/somebody/a/long/path/to/a/folder/scenario.toml";
        let lines = wrapped(&format!("failed to read {path}: it is absent"), 30, false);
        assert_eq!(lines, format!("failed to read\n  {path}:\n  it is absent"));
    }

    #[test]
    fn only_a_word_of_the_verdict_has_a_colour() {
        console::set_colors_enabled(true);
        let coloured_text = coloured("FAIL: 1 of 2\n  FAILURES\n  met: x");
        console::set_colors_enabled(false);
        let lines: Vec<&str> = coloured_text.split('\n').collect();
        assert!(lines[0].starts_with("\u{1b}[") && lines[0].ends_with(": 1 of 2"), "{lines:?}");
        assert_eq!(lines[1], "  FAILURES");
        assert!(lines[2].starts_with("  \u{1b}["), "{lines:?}");
    }
}
