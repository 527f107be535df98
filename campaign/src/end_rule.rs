//! Rules that end a campaign before its last sample: at the first failing sample, or after too many
//! errors.
//!
//! Such a campaign has no verdict. Its journal is complete up to its end, and the campaign can be
//! resumed.

use std::fmt;
use std::ops::ControlFlow;
use std::path::Path;

use closecall_scenarios::criteria::Expression;
use closecall_traffic::words::counted;
use serde_json::{Value, json};

use crate::action::{Action, CommandFor, Replay, Resume, SavedSample};
use crate::record::Record;
use crate::stop::End;
use crate::summary::Summary;

/// When a campaign ends before its last sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EndRule {
    /// True if the first failing sample ends the campaign: the ego collides under the controller
    /// under test, or a controller ends in an error. So does a gate that fails whatever the
    /// remaining samples are.
    pub fail_fast: bool,
    /// Largest number of samples that may end in an error; `None` for any number.
    pub max_errors: Option<u64>,
}

/// The sample or the samples that have ended a campaign early.
#[derive(Clone, Debug, PartialEq)]
pub enum EarlyEnd {
    /// A sample has failed.
    Failure {
        /// The name of the scenario.
        scenario: String,
        /// The sample.
        sample: u64,
        /// True if the sample ended in an error, false if the ego collided.
        is_error: bool,
    },
    /// A gate fails whatever the remaining samples are.
    Gate {
        /// The name of the scenario.
        scenario: String,
        /// The gate.
        expression: Expression,
    },
    /// Too many samples have ended in an error.
    Errors {
        /// Number of samples that have ended in an error.
        errors: u64,
    },
}

impl fmt::Display for EarlyEnd {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Failure { scenario, sample, is_error: true } => {
                write!(f, "sample {sample} of {scenario} ended in an error")
            }
            Self::Failure { scenario, sample, is_error: false } => {
                write!(f, "sample {sample} of {scenario} has a collision of the ego")
            }
            Self::Gate { scenario, expression } => write!(f, "{expression} can only fail in {scenario}"),
            Self::Errors { errors } => write!(f, "{} ended in an error", counted(*errors, "sample")),
        }
    }
}

/// A campaign that has ended early, as its user sees it.
#[derive(Clone, Debug)]
pub struct EndedEarly<'a> {
    /// Why it ended, in words.
    pub message: String,
    /// The sample or the samples that ended it; `None` if a signal did.
    pub ending: Option<&'a EarlyEnd>,
    /// Samples that are done.
    pub done: u64,
    /// Samples of the whole campaign.
    pub all: u64,
    /// Samples that ended in an error.
    pub errors: u64,
    /// Why these samples ended in an error: the counts with their failures.
    pub summary: &'a Summary,
    /// The kept part of the campaign; `None` if it has no folder.
    pub kept: Option<Kept<'a>>,
    /// The commands to go on.
    pub command_for: CommandFor,
}

/// The kept part of a campaign that has ended early.
#[derive(Clone, Debug)]
pub struct Kept<'a> {
    /// The folder of the campaign.
    pub folder: &'a Path,
    /// The command line that started it.
    pub command: Vec<String>,
}

impl EndedEarly<'_> {
    fn resume(&self) -> Option<String> {
        let retries_errors = matches!(self.ending, Some(EarlyEnd::Errors { .. }));
        let Kept { command, .. } = self.kept.as_ref()?;
        Some((self.command_for)(&Action::Resume(Resume {
            command,
            retries_errors,
            moved_to: None,
            working_folder: None,
        })))
    }

    fn sentence(&self) -> String {
        let Self { done, all, message, .. } = self;
        format!("ENDED EARLY, without a verdict: {message}; {done} of {all} samples are done")
    }

    /// Returns why samples failed, a line for each kind.
    fn reasons(&self) -> impl Iterator<Item = String> {
        self.summary.failures().map(|(scenario, failure)| format!("{scenario}: {failure}"))
    }

    /// Returns the end as JSON.
    pub fn json(&self) -> Value {
        json!({
            "ended_early": self.message,
            "sentence": self.sentence(),
            "reasons": self.reasons().collect::<Vec<_>>(),
            "samples": self.done,
            "of": self.all,
            "errors": self.errors,
            "failures": self.summary.failures_json(),
            "resume": self.resume(),
        })
    }
}

impl fmt::Display for EndedEarly<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.sentence())?;
        for reason in self.reasons() {
            writeln!(f, "  {reason}")?;
        }
        let (Some(resume), Some(Kept { folder, .. })) = (self.resume(), &self.kept) else {
            return writeln!(f, "nothing was kept: only a campaign with a folder can be resumed");
        };
        if let Some(EarlyEnd::Failure { scenario, sample, .. }) = self.ending {
            let folder = folder.display().to_string();
            let saved_sample = SavedSample { folder: &folder, sample: *sample, scenario: Some(scenario) };
            let replay = Replay { recording: Some("failure.rrd"), ..Replay::new(saved_sample) };
            writeln!(f, "look:   {}", (self.command_for)(&Action::Replay(replay)))?;
        }
        writeln!(f, "resume: {resume}")
    }
}

/// Applies an [`EndRule`] to the records of a running campaign.
#[derive(Clone, Debug)]
pub struct EndMonitor {
    rule: EndRule,
    errors: u64,
    ending: Option<EarlyEnd>,
}

impl EndMonitor {
    /// Returns a monitor that has seen no record.
    pub const fn new(rule: EndRule) -> Self {
        Self { rule, errors: 0, ending: None }
    }

    /// Counts a record after which the campaign has gone on.
    pub fn count(&mut self, record: &Record) {
        self.errors += u64::from(record.arms.iter().any(|arm| arm.result.is_err()));
    }

    /// Counts a record. Returns `Break` if the campaign ends after it.
    pub fn observe(&mut self, record: &Record) -> ControlFlow<End> {
        let is_error = record.arms.iter().any(|arm| arm.result.is_err());
        let has_collided = record.tallies().last().is_some_and(|tested| tested.collided == Some(true));
        self.errors += u64::from(is_error);
        if self.rule.fail_fast && (is_error || has_collided) {
            let (scenario, sample) = (record.scenario.clone(), record.sample);
            self.ending = Some(EarlyEnd::Failure { scenario, sample, is_error });
        } else if self.rule.max_errors.is_some_and(|most| self.errors > most) {
            self.ending = Some(EarlyEnd::Errors { errors: self.errors });
        }
        if self.ending.is_some() { ControlFlow::Break(End::Campaign) } else { ControlFlow::Continue(()) }
    }

    /// Ends a campaign that fails fast if `lost_gate` returns a gate that can only fail, with the
    /// name of its scenario.
    pub fn observe_gate(&mut self, lost_gate: impl FnOnce() -> Option<(String, Expression)>) -> ControlFlow<End> {
        let Some((scenario, expression)) = self.rule.fail_fast.then(lost_gate).flatten() else {
            return ControlFlow::Continue(());
        };
        self.ending = Some(EarlyEnd::Gate { scenario, expression });
        ControlFlow::Break(End::Campaign)
    }

    /// Returns the reason for which the campaign ended early, or `None` if it did not.
    pub fn into_ending(self) -> Option<EarlyEnd> {
        self.ending
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::{ArmRecord, SampleFailure};

    fn error(sample: u64) -> Record {
        let failure = SampleFailure { kind: "panic".to_owned(), message: "m".to_owned() };
        let arm = ArmRecord::new("mis".to_owned(), Err(failure));
        Record { scenario: "s".to_owned(), sample, arms: vec![arm] }
    }

    #[test]
    fn the_first_error_ends_a_campaign_that_fails_fast() {
        let mut monitor = EndMonitor::new(EndRule { fail_fast: true, max_errors: None });
        assert!(monitor.observe(&error(3)).is_break());
        assert_eq!(monitor.into_ending().unwrap().to_string(), "sample 3 of s ended in an error");
    }

    #[test]
    fn a_gate_that_can_only_fail_ends_a_campaign_that_fails_fast_and_no_other() {
        let lost = || Some(("s".to_owned(), "count(induced) <= 0".parse().unwrap()));
        let mut monitor = EndMonitor::new(EndRule { fail_fast: true, max_errors: None });
        assert!(monitor.observe_gate(|| None).is_continue() && monitor.observe_gate(lost).is_break());
        assert_eq!(monitor.into_ending().unwrap().to_string(), "count(induced) <= 0 can only fail in s");
        assert!(EndMonitor::new(EndRule::default()).observe_gate(lost).is_continue());
    }

    #[test]
    fn a_campaign_ends_when_more_samples_than_allowed_have_ended_in_an_error() {
        let mut monitor = EndMonitor::new(EndRule { fail_fast: false, max_errors: Some(1) });
        assert!(monitor.observe(&error(0)).is_continue());
        assert!(monitor.observe(&error(1)).is_break());
        assert_eq!(monitor.into_ending(), Some(EarlyEnd::Errors { errors: 2 }));
    }
}
