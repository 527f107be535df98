//! The command of an external controller, and its limits.

use std::time::Duration;

use serde::{Deserialize, Serialize};

/// The name of an external controller in reports, and the prefix of its `--controller` argument.
pub const NAME: &str = "exec";

/// Default time limit of one answer (ms): 25 control steps, longer than the pauses of an
/// interpreter.
pub const DEFAULT_TIMEOUT_MS: u64 = 1_000;

/// Default memory limit (MiB): enough for an interpreter with its numerical libraries, with a
/// reserve.
pub const DEFAULT_MEMORY_MIB: u64 = 1_024;

/// The settings of a controller that runs as a separate process.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExecSettings {
    /// The command with its arguments, with the quotes of a shell.
    pub command: String,
    /// Time limit of each answer (ms).
    pub timeout_ms: u64,
    /// Largest resident memory of the process (MiB).
    pub memory_mib: u64,
}

impl ExecSettings {
    /// Returns the command and its arguments, or `None` if the quotes do not match or the command
    /// is empty.
    pub fn words(&self) -> Option<Vec<String>> {
        shlex::split(&self.command).filter(|words| !words.is_empty())
    }

    /// Returns the time limit of each answer.
    pub(super) fn timeout(&self) -> Duration {
        Duration::from_millis(self.timeout_ms)
    }
}
