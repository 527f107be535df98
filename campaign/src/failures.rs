//! Why samples have no outcome: the first message of each kind of failure, with its count and a
//! sample to run again.
//!
//! Two failures are of one kind if they have the same controller, the same name, and the same
//! message apart from its numbers, with the plural that goes with them, and its names of temporary
//! files: measured values, times, counts, steps, process numbers and addresses differ from sample
//! to sample. Only the numbers that name an error tell kinds apart: error codes, exit statuses,
//! signals and lines of a source file. The list is bounded, whatever the controllers write: the
//! failures beyond it are counted as others.

use std::fmt;

use serde::Serialize;

use super::record::Record;
use super::variable_words::{in_one_number, without_random_names};

/// Largest number of kinds of one scenario that are told apart by their messages.
const MOST_KINDS: usize = 16;
/// Length of a message on a line of its own (characters).
const LINE_CHARS: usize = 600;

/// Words after a whole number that is a measured value or a count of steps, whatever stands before
/// it: `error 12 ms`, `error 37 steps`.
const UNITS: [&str; 24] = [
    "ns", "us", "µs", "ms", "s", "min", "h", "m", "mm", "km", "m/s", "m/s²", "km/h", "rad", "deg", "second", "seconds",
    "step", "steps", "answer", "answers", "frame", "frames", "samples",
];
/// Words before a whole number that names an error: `error 3`, `exit status: 5`, `line 12`.
const NAMES: [&str; 12] =
    ["error", "errno", "code", "status", "signal", "exit", "exception", "http", "line", "version", "case", "assertion"];
/// Longest ending of the name of a source file, as in `main.cpp:12` (characters).
const ENDING_CHARS: usize = 4;

/// The failures of one kind.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct FailureKindCount {
    /// The controller.
    pub controller: String,
    /// The name of the kind, for programs.
    pub kind: String,
    /// Number of samples that failed so.
    pub samples: u64,
    /// The first of these samples.
    pub first_sample: u64,
    /// The message of the first failure.
    pub first_message: String,
    /// True if these are several kinds: more than 16 messages differ, and the rest is counted
    /// together.
    pub others: bool,
}

impl FailureKindCount {
    /// Returns the message of the first failure in one line.
    fn line(&self) -> String {
        let mut words = self.first_message.split_whitespace().collect::<Vec<_>>().join(" ");
        if let Some((end, _)) = words.char_indices().nth(LINE_CHARS) {
            words.truncate(end);
            words.push('…');
        }
        words
    }
}

/// Writes the count, the controller, the sample and its message:
/// `50 × exec (controller), first in sample 0: the process ended`, or
/// `and 9 others × exec (controller), first in sample 3: the process ended`.
impl fmt::Display for FailureKindCount {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { controller, kind, samples, first_sample, .. } = self;
        match (self.others, samples) {
            (false, _) => write!(f, "{samples}")?,
            (true, 1) => write!(f, "and 1 other")?,
            (true, _) => write!(f, "and {samples} others")?,
        }
        write!(f, " × {controller} ({kind}), first in sample {first_sample}: {}", self.line())
    }
}

/// The failures of the samples of one scenario.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Failures {
    kinds: Vec<FailureKindCount>,
    /// The shape of the first message of each kind.
    shapes: Vec<String>,
}

impl Failures {
    /// Counts the failures of a record.
    pub fn push(&mut self, record: &Record) {
        for arm in &record.arms {
            let Err(failure) = &arm.result else { continue };
            let shape = shape(&failure.message);
            let is_alike = |count: &FailureKindCount| count.controller == arm.controller && count.kind == failure.kind;
            let is_same = |count: &FailureKindCount, other: &str| {
                is_alike(count) && !count.others && have_one_shape(other, &shape)
            };
            let others = self.kinds.iter().filter(|count| !count.others).count() >= MOST_KINDS;
            let place = self.kinds.iter().zip(&self.shapes).position(|(count, other)| is_same(count, other));
            let place = place.or_else(|| self.kinds.iter().position(|count| count.others && is_alike(count)));
            if let Some(kind) = place.and_then(|place| self.kinds.get_mut(place)) {
                kind.samples += 1;
                continue;
            }
            self.kinds.push(FailureKindCount {
                controller: arm.controller.clone(),
                kind: failure.kind.clone(),
                samples: 1,
                first_sample: record.sample,
                first_message: failure.message.clone(),
                others,
            });
            self.shapes.push(shape);
        }
    }

    /// Returns the kinds in the order of their first samples.
    pub fn iter(&self) -> impl Iterator<Item = &FailureKindCount> {
        self.kinds.iter()
    }

    /// Returns true if no sample failed.
    pub fn is_empty(&self) -> bool {
        self.kinds.is_empty()
    }
}

/// Returns what the messages of a kind have in common.
fn shape(message: &str) -> String {
    in_one_number(&without_numbers(&without_random_names(message)))
}

/// Returns true if the shapes of two messages are the same. A quote of a fixed length ends, with
/// `…`, in different places, because its numbers are of different lengths: the shorter quote is then
/// the beginning of the longer one.
fn have_one_shape(one: &str, other: &str) -> bool {
    match (one.split_once('…'), other.split_once('…')) {
        (Some((quote, end)), Some((other_quote, other_end))) => {
            end == other_end && (quote.starts_with(other_quote) || other_quote.starts_with(quote))
        }
        _ => one == other,
    }
}

/// Returns a message with `#` for each number, except the numbers that name an error.
fn without_numbers(message: &str) -> String {
    let is_in_word = |c: char| c.is_alphanumeric() || c == '_';
    let (mut shape, mut rest) = (String::with_capacity(message.len()), message);
    while let Some(start) = rest.find(|c: char| c.is_ascii_digit()) {
        let (before, number) = rest.split_at(start);
        shape.push_str(before);
        let end = number.find(|c: char| !is_in_word(c) && c != '.').unwrap_or(number.len());
        // A full stop ends the sentence, not the number.
        let (number, after) = number.split_at(number[..end].trim_end_matches('.').len());
        // The digits of `mps2` are no number; the digit of `track_7` is one.
        let is_number = !shape.ends_with(|c: char| c.is_alphanumeric());
        shape.push_str(if is_number && !names_error(&shape, number, after) { "#" } else { number });
        rest = after;
    }
    shape.push_str(rest);
    shape
}

/// Returns true if a number of a message names an error: `number` stands between `before` and
/// `after`, and may have its unit attached.
fn names_error(before: &str, number: &str, after: &str) -> bool {
    let is_address = number.starts_with("0x");
    let digits = number.trim_end_matches(|c: char| !c.is_ascii_digit());
    let is_value = number.contains('.') && digits.parse::<f64>().is_ok();
    let attached = &number[number.find(|c: char| !c.is_ascii_digit()).unwrap_or(number.len())..];
    let next = after.strip_prefix([' ', '\u{a0}']).unwrap_or_default();
    let next = &next[..next.find(|c: char| !c.is_alphanumeric() && c != '/').unwrap_or(next.len())];
    let is_measured = UNITS.contains(&attached) || (attached.is_empty() && UNITS.contains(&next));
    if is_value || is_measured {
        return false;
    }
    let separators = |c: char| c.is_whitespace() || "=:#([\"'\\-".contains(c);
    let named = before.trim_end_matches(separators);
    let name = named.rsplit(|c: char| !c.is_alphanumeric()).next().unwrap_or_default();
    // `error: 2 tracks are lost` counts.
    let is_sentence = name.eq_ignore_ascii_case("error") && before[named.len()..].contains(':') && !next.is_empty();
    let is_named = NAMES.iter().any(|word| name.eq_ignore_ascii_case(word)) && !is_sentence;
    is_named || (!is_address && is_place_in_source(before))
}

/// Returns true if a text ends with the name of a source file and a colon: `main.cpp:`, or with its
/// line, too: `main.cpp:12:`.
fn is_place_in_source(before: &str) -> bool {
    let Some(text) = before.strip_suffix(':') else { return false };
    let text = text.trim_end_matches(|c: char| c.is_ascii_digit());
    let text = text.strip_suffix(':').unwrap_or(text);
    let file = text.rsplit(|c: char| c.is_whitespace() || "([\"'`".contains(c)).next().unwrap_or_default();
    file.rsplit_once('.').is_some_and(|(stem, ending)| {
        let is_ending = !ending.is_empty() && ending.len() <= ENDING_CHARS;
        !stem.is_empty() && is_ending && ending.chars().all(|c| c.is_ascii_alphabetic())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::{ArmRecord, SampleFailure};

    fn failed(sample: u64, message: &str) -> Record {
        let failure = SampleFailure { kind: "controller".to_owned(), message: message.to_owned() };
        Record { scenario: "s".to_owned(), sample, arms: vec![ArmRecord::new("exec".to_owned(), Err(failure))] }
    }

    #[test]
    fn quotes_that_numbers_cut_in_different_places_are_of_one_kind() {
        let mut failures = Failures::default();
        failures.push(&failed(0, "answered \"speed 30.857, yaw_rate_rad…\": `acceleration_mps2` is absent"));
        failures.push(&failed(1, "answered \"speed 30.85, yaw_rate_radp…\": `acceleration_mps2` is absent"));
        assert_eq!(failures.iter().map(|kind| kind.samples).collect::<Vec<_>>(), [2]);
        failures.push(&failed(2, "answered \"speed 30.85, yaw_rate_radp…\": `state` is absent"));
        failures.push(&failed(3, "answered \"gap 30.85, yaw_rate_radp…\": `acceleration_mps2` is absent"));
        assert_eq!(failures.iter().count(), 3, "another key and another quote are other kinds");
    }

    #[test]
    fn messages_that_differ_in_numbers_are_of_one_kind_and_the_first_is_kept() {
        let mut failures = Failures::default();
        failures.push(&failed(3, "late at 2.04 s"));
        failures.push(&failed(4, "late at 12.4 s"));
        failures.push(&failed(7, "no such file"));
        let lines: Vec<String> = failures.iter().map(ToString::to_string).collect();
        assert_eq!(
            lines,
            [
                "2 × exec (controller), first in sample 3: late at 2.04 s",
                "1 × exec (controller), first in sample 7: no such file"
            ]
        );
    }

    #[test]
    fn error_codes_exit_statuses_and_signals_are_kinds_of_their_own() {
        for (one, other) in [
            ("the controller answered with error 1", "the controller answered with error 2"),
            (
                "the process ended (exit status: 5) after 3 answers",
                "the process ended (exit status: 6) after 3 answers",
            ),
            ("ended (signal: 6 (SIGABRT) (core dumped))", "ended (signal: 11 (SIGSEGV) (core dumped))"),
            ("failed with code -4.", "failed with code -5."),
            ("my.py, line 12, in step", "my.py, line 13, in step"),
            ("panicked at src/lib.rs:12:5: lost", "panicked at src/lib.rs:13:5: lost"),
            ("E12: no map", "E13: no map"),
            ("errno=2", "errno=13"),
            ("2 tracks are lost", "2 lanes are lost"),
            ("cannot read /tmp/tmpa1b2c3d4/map.bin", "cannot read /tmp/tmpa1b2c3d4/lanes.bin"),
            ("status c0000005", "status c00000fd"),
        ] {
            assert_ne!(shape(one), shape(other));
        }
        for (one, other) in [
            ("error 1 after 3 answers", "error 1 after 41 answers"),
            ("error 1 at t=40 in process 77", "error 1 at t=1040 in process 78"),
            ("asked for -31.5 m/s² at 2.04 s", "asked for -7 m/s² at 12 s"),
            (r#"answered "{\"time_ns\": 40000}"#, r#"answered "{\"time_ns\": 80000}"#),
            ("<Track object at 0x7f3a>", "<Track object at 0x7f4b>"),
            ("==71==ERROR: AddressSanitizer", "==72==ERROR: AddressSanitizer"),
            ("late by 40ms in step 3.", "late by 41ms in step 12."),
            (r#"answered "2 tracks""#, r#"answered "1 tracks""#),
            (r#"answered "3tracks""#, r#"answered "14tracks""#),
            ("error: 2 tracks are lost", "error: 11 tracks are lost"),
            ("1 track is lost", "2 tracks are lost"),
            (r#"answered "1 track""#, r#"answered "2 tracks""#),
            ("1 of 4 boxes has no class", "3 of 4 boxes have no class"),
            ("cannot read /tmp/tmpa1b2c3d4/map.bin", "cannot read /tmp/tmpx_y2z3q9/map.bin"),
            ("[2026-11-28T12:30:05.123Z] lost", "[2026-11-29T02:31:55.001Z] lost"),
            ("thread 'main' (4711) is late", "thread 'main' (4712) is late"),
            ("track_7 is lost", "track_12 is lost"),
            ("no object with id 4", "no object with id 5"),
            ("index 4 is out of bounds for size 3", "index 7 is out of bounds for size 2"),
            ("lost [1, 2, 3] of 4: 25%", "lost [4, 5, 6] of 8: 37%"),
            ("a lateral error 3 m to the left", "a lateral error 4 m to the left"),
        ] {
            assert_eq!(shape(one), shape(other));
        }
        let mut failures = Failures::default();
        for sample in 0..9 {
            failures.push(&failed(sample, &format!("the controller answered with error {}", sample % 3)));
        }
        assert_eq!(failures.iter().map(|kind| kind.samples).collect::<Vec<_>>(), [3, 3, 3]);
    }

    #[test]
    fn endless_kinds_are_bounded_and_every_failure_is_counted() {
        let mut failures = Failures::default();
        for sample in 0..1_000 {
            failures.push(&failed(sample, &"x".repeat(sample as usize + 1)));
        }
        assert_eq!(failures.iter().count(), MOST_KINDS + 1);
        assert_eq!(failures.iter().map(|kind| kind.samples).sum::<u64>(), 1_000);
        assert!(
            failures.iter().take(MOST_KINDS).all(|kind| kind.samples == 1),
            "no kind counts the messages of others"
        );
        let last = failures.iter().last().unwrap().to_string();
        assert!(last.starts_with("and 984 others × exec (controller), first in sample 16: x"), "{last}");
        failures.push(&failed(2_000, "x"));
        assert_eq!(failures.iter().next().unwrap().samples, 2, "a kind of the list goes on to be counted");
        failures.push(&failed(0, &"a\n".repeat(5_000)));
        assert!(failures.iter().all(|kind| kind.to_string().lines().count() == 1));
    }
}
