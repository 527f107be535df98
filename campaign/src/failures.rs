//! Why samples have no outcome: the first message of each kind of failure, with its count and a
//! sample to run again.
//!
//! Two failures are of one kind if they have the same controller, the same name, and the same
//! message apart from its numbers: the times and process numbers in messages differ from sample to
//! sample. The list is bounded, whatever the controllers write.

use std::fmt;

use serde::Serialize;

use super::record::Record;

/// Largest number of kinds of one scenario that are told apart by their messages.
const MOST_KINDS: usize = 16;
/// Length of a message on a line of its own (characters).
const LINE_CHARS: usize = 600;

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
/// `50 × exec (controller), first in sample 0: the process ended`.
impl fmt::Display for FailureKindCount {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { controller, kind, samples, first_sample, .. } = self;
        write!(f, "{samples} × {controller} ({kind}), first in sample {first_sample}: {}", self.line())
    }
}

/// The failures of the samples of one scenario.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Failures {
    kinds: Vec<FailureKindCount>,
}

impl Failures {
    /// Counts the failures of a record.
    pub fn push(&mut self, record: &Record) {
        for arm in &record.arms {
            let Err(failure) = &arm.result else { continue };
            let is_alike =
                |count: &&mut FailureKindCount| count.controller == arm.controller && count.kind == failure.kind;
            let is_same = |count: &FailureKindCount| shape(&count.first_message).eq(shape(&failure.message));
            let is_full = self.kinds.len() >= MOST_KINDS;
            let mut alike = self.kinds.iter_mut().filter(is_alike);
            if let Some(kind) = alike.find(|count| is_full || is_same(count)) {
                kind.samples += 1;
                continue;
            }
            self.kinds.push(FailureKindCount {
                controller: arm.controller.clone(),
                kind: failure.kind.clone(),
                samples: 1,
                first_sample: record.sample,
                first_message: failure.message.clone(),
            });
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

/// Returns the characters of a message with each number as one `#`.
fn shape(message: &str) -> impl Iterator<Item = char> {
    let is_number = |c: char| c.is_ascii_digit() || c == '.';
    let mut before = false;
    message.chars().filter_map(move |c| {
        let was = before;
        before = c.is_ascii_digit() || (was && is_number(c));
        match (before, was) {
            (true, true) => None,
            (true, false) => Some('#'),
            (false, _) => Some(c),
        }
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
    fn endless_kinds_are_bounded_and_every_failure_is_counted() {
        let mut failures = Failures::default();
        for sample in 0..1_000 {
            failures.push(&failed(sample, &"x".repeat(sample as usize + 1)));
        }
        assert_eq!(failures.iter().count(), MOST_KINDS);
        assert_eq!(failures.iter().map(|kind| kind.samples).sum::<u64>(), 1_000);
        failures.push(&failed(0, &"a\n".repeat(5_000)));
        assert!(failures.iter().all(|kind| kind.to_string().lines().count() == 1));
    }
}
