//! The errors of a controller that runs as a separate process.

use std::io;
use std::process::ExitStatus;

/// What the author of a process may have missed that writes other text than answers.
pub(crate) const ANSWERS_ALONE: &str = "standard output is for answers alone, other text belongs on standard error";

/// Why a process did not give a valid answer. The process has been killed, and the sample has no
/// outcome.
///
/// The messages depend on the actions of the process, not on their duration: they are reproducible.
#[derive(Debug, thiserror::Error)]
pub enum ExecError {
    /// The quotes of the command do not match, or the command is empty.
    #[error("`{command}` is no command: its quotes do not match, or it is empty")]
    Command {
        /// The command.
        command: String,
    },
    /// The process could not be started.
    #[error("`{program}` could not be started: {}", reason.clone().unwrap_or_else(|| source.to_string()))]
    Start {
        /// The program.
        program: String,
        /// Why a program that is there cannot be started, if that is the case.
        reason: Option<String>,
        /// The system's reason.
        source: io::Error,
    },
    /// The process ended.
    #[error("the process ended ({}) {}{}", how(*status), when(*answered), last_lines(stderr))]
    Ended {
        /// The exit status of the process.
        status: ExitStatus,
        /// Number of answers before, including the greeting.
        answered: u64,
        /// The last lines of its standard error.
        stderr: String,
    },
    /// The process ended by a signal after its last answer.
    #[error("the process crashed ({}) after its last answer, when its input was closed{}", how(*status), last_lines(stderr))]
    BadEnd {
        /// The exit status of the process.
        status: ExitStatus,
        /// The last lines of its standard error.
        stderr: String,
    },
    /// The process closed its standard output without ending.
    #[error("the process closed its standard output {}{}", when(*answered), last_lines(stderr))]
    Closed {
        /// Number of answers before, including the greeting.
        answered: u64,
        /// The last lines of its standard error.
        stderr: String,
    },
    /// The process answered after the time limit, but within twice the limit.
    #[error("the process answered later than the {limit_ms} ms allowed, {}", when(*answered))]
    Late {
        /// The time limit (ms).
        limit_ms: u128,
        /// Number of answers before, including the greeting.
        answered: u64,
    },
    /// The process did not answer within twice the time limit, or within a long limit.
    #[error(
        "the process hangs: no answer in {}the {limit_ms} ms allowed, {}{}{}",
        if is_long(*limit_ms) { "" } else { "twice " }, when(*answered),
        if *has_closed_input { "; it has closed its standard input" } else { "" }, last_lines(stderr)
    )]
    Hangs {
        /// The time limit (ms).
        limit_ms: u128,
        /// Number of answers before, including the greeting.
        answered: u64,
        /// True if it has closed its standard input.
        has_closed_input: bool,
        /// The last lines of its standard error.
        stderr: String,
    },
    /// The process wrote a line that is not an answer to a message.
    #[error("the process wrote a line that nobody had asked for, {}: {line:?}", when(*answered))]
    OutOfTurn {
        /// Number of answers before, including the greeting.
        answered: u64,
        /// The beginning of the line.
        line: String,
    },
    /// The process answered another question than the one it was asked.
    #[error("the process answered {line:?} for the control step at {actual} ns, and was asked for the one at {expected} ns, {}", when(*answered))]
    OtherStep {
        /// The beginning of the line.
        line: String,
        /// The time of the control step (ns).
        expected: i64,
        /// The time that the answer repeats.
        actual: String,
        /// Number of answers before, including the greeting.
        answered: u64,
    },
    /// The process wrote a line that exceeds the length limit.
    #[error("the process answered with a line of more than {limit} bytes")]
    LongLine {
        /// The limit (bytes).
        limit: usize,
    },
    /// The line is JSON, and no object.
    #[error("the process answered {line:?}: it must be an object of JSON, such as {{\"acceleration_mps2\": …}}")]
    NotObject {
        /// The beginning of the line.
        line: String,
    },
    /// The line is not JSON.
    #[error("the process answered {line:?}, which is not JSON: {reason}")]
    NotJson {
        /// The beginning of the line.
        line: String,
        /// What is wrong.
        reason: String,
    },
    /// A key is absent, or its value has the wrong type.
    #[error("the process answered {line:?}: `{key}` must be {expected}, it is {actual}")]
    Key {
        /// The beginning of the line.
        line: String,
        /// The key.
        key: String,
        /// What is allowed.
        expected: &'static str,
        /// What was found.
        actual: String,
    },
    /// The process of a library or an FMU says why it has no answer.
    #[error("{reason}")]
    Stated {
        /// The reason.
        reason: String,
    },
    /// The acceleration is not a finite number.
    #[error("the process asked for an acceleration of {value} m/s², which is not a finite number")]
    NotFinite {
        /// The value as the process wrote it.
        value: String,
    },
    /// The process uses another version of the protocol.
    #[error("the process speaks version {actual} of the protocol, this is version {supported}")]
    Version {
        /// The version of the process.
        actual: String,
        /// The version of Closecall.
        supported: u32,
    },
    /// The process exceeded its memory limit.
    #[error("the process holds more than the {limit_mib} MiB of memory allowed")]
    Memory {
        /// The memory limit (MiB).
        limit_mib: u64,
    },
}

impl ExecError {
    /// Returns true if the wall clock caused the error.
    pub const fn is_late(&self) -> bool {
        matches!(self, Self::Late { .. } | Self::Hangs { .. })
    }

    /// Returns what the author of a process may have missed that never answers, or that writes other
    /// text than answers; `None` of another error.
    pub fn advice(&self) -> Option<&'static str> {
        match self {
            Self::Hangs { answered: 0 | 1, .. } => {
                Some("an answer is one line, which ends with a line feed and is flushed, before the next message comes")
            }
            Self::NotJson { line, .. } | Self::OutOfTurn { line, .. } if is_other_text(line) => Some(ANSWERS_ALONE),
            _ => None,
        }
    }

    /// Returns how a library or another controller ended the process in which it runs; `None` if it
    /// did not. `who` ended it, such as `the controller`. The message does not depend on what the
    /// process did before: it is the same whether the process answers each step or runs whole
    /// samples.
    pub fn end_of_isolated(&self, who: &str) -> Option<String> {
        match self {
            Self::Ended { status, stderr, .. } | Self::BadEnd { status, stderr } => {
                Some(format!("{who} ended its process ({}){}", how(*status), last_lines(stderr)))
            }
            Self::Closed { stderr, .. } => {
                Some(format!("{who} closed the output of its process{}", last_lines(stderr)))
            }
            _ => None,
        }
    }
}

/// Returns true if a line is not even meant as an answer.
pub(crate) fn is_other_text(line: &str) -> bool {
    // The mark of UTF-16 is no UTF-8.
    !line.trim_start_matches(['\u{feff}', char::REPLACEMENT_CHARACTER]).trim_start().starts_with('{')
}

/// Returns true if a time limit is as long as the limit of a start: whoever exceeds it hangs.
pub(super) const fn is_long(limit_ms: u128) -> bool {
    limit_ms >= 10_000
}

/// Describes how a process ended: its exit status, or the name of its signal.
pub(super) fn how(status: ExitStatus) -> String {
    // Whether the system keeps a memory dump depends on its settings.
    status.to_string().replace(" (core dumped)", "")
}

/// Describes when an error happened by the number of answers before it. The first answer is the
/// greeting.
fn when(answered: u64) -> String {
    match answered {
        0 => "before its greeting".to_owned(),
        1 => "before its first answer".to_owned(),
        2 => "after 1 answer".to_owned(),
        more => format!("after {} answers", more - 1),
    }
}

/// Returns the part of a message that quotes the last lines of standard error, if there are any.
pub(super) fn last_lines(stderr: &str) -> String {
    if stderr.is_empty() { String::new() } else { format!("; it last wrote: {stderr}") }
}
