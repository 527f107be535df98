//! What a process can do wrong.

use std::io;
use std::process::ExitStatus;

/// Why a process gave no proper answer. It has been killed, and this sample has no outcome.
///
/// The messages depend on what the process did, and not on how long it took, so that they repeat.
#[derive(Debug, thiserror::Error)]
pub enum ExecError {
    /// The command's quotes do not match, or it has no word.
    #[error("`{command}` is no command: its quotes do not match, or it is empty")]
    Command {
        /// The command.
        command: String,
    },
    /// The process could not be started.
    #[error("`{program}` could not be started: {source}")]
    Start {
        /// The program.
        program: String,
        /// The system's reason.
        source: io::Error,
    },
    /// It ended.
    #[error("the process ended ({status}) {}{}", when(*answered), tail(words))]
    Ended {
        /// How.
        status: ExitStatus,
        /// Answers that it had given, the greeting among them.
        answered: u64,
        /// The last lines of its standard error.
        words: String,
    },
    /// It closed its standard output and went on.
    #[error("the process closed its standard output {}{}", when(*answered), tail(words))]
    Closed {
        /// Answers that it had given, the greeting among them.
        answered: u64,
        /// The last lines of its standard error.
        words: String,
    },
    /// It answered, but too late.
    #[error("the process answered later than the {limit_ms} ms allowed, {}", when(*answered))]
    Late {
        /// Time allowed (ms).
        limit_ms: u128,
        /// Answers that it had given, the greeting among them.
        answered: u64,
    },
    /// It hangs.
    #[error("the process hangs: no answer in twice the {limit_ms} ms allowed, {}{}", when(*answered), tail(words))]
    Hangs {
        /// Time allowed (ms).
        limit_ms: u128,
        /// Answers that it had given, the greeting among them.
        answered: u64,
        /// The last lines of its standard error.
        words: String,
    },
    /// It spoke before it was asked.
    #[error("the process wrote a line that nobody had asked for, {}: {line:?}", when(*answered))]
    OutOfTurn {
        /// Answers that it had given, the greeting among them.
        answered: u64,
        /// The beginning of the line.
        line: String,
    },
    /// A line without an end.
    #[error("the process answered with a line of more than {limit} bytes")]
    LongLine {
        /// Most that is read.
        limit: usize,
    },
    /// The line is not JSON.
    #[error("the process answered {line:?}, which is not JSON: {reason}")]
    NotJson {
        /// The beginning of the line.
        line: String,
        /// What is wrong.
        reason: String,
    },
    /// A key is absent, or has a value of the wrong kind.
    #[error("the process answered {line:?}: `{key}` must be {expected}, it is {found}")]
    Key {
        /// The beginning of the line.
        line: String,
        /// The key.
        key: &'static str,
        /// What is allowed.
        expected: &'static str,
        /// What was found.
        found: String,
    },
    /// The acceleration is not a finite number.
    #[error("the process asked for an acceleration of {value} m/s², which is not a finite number")]
    NotFinite {
        /// As it was written.
        value: String,
    },
    /// It speaks another version.
    #[error("the process speaks version {found} of the protocol, this is version {own}")]
    Version {
        /// Its version.
        found: String,
        /// This one.
        own: u32,
    },
    /// It holds too much memory.
    #[error("the process holds more than the {limit_mib} MiB of memory allowed")]
    Memory {
        /// Most that is allowed (MiB).
        limit_mib: u64,
    },
}

/// When it happened, counted in answers, of which the first is the greeting.
fn when(answered: u64) -> String {
    match answered {
        0 => "before its greeting".to_owned(),
        1 => "before its first answer".to_owned(),
        2 => "after 1 answer".to_owned(),
        more => format!("after {} answers", more - 1),
    }
}

fn tail(words: &str) -> String {
    if words.is_empty() { String::new() } else { format!("; it last wrote: {words}") }
}
