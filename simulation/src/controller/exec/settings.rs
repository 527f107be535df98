//! Which command, and what is allowed to it.

use std::time::Duration;

use serde::{Deserialize, Serialize};

/// Time for one answer where nothing else is said (ms): 25 control steps, which an interpreter's pauses stay below.
pub const DEFAULT_TIMEOUT_MS: u64 = 1_000;

/// Memory where nothing else is said (MiB): an interpreter with its numerical libraries, with room.
pub const DEFAULT_MEMORY_MIB: u64 = 1_024;

/// A controller that is a command.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExecSettings {
    /// The command with its arguments, quoted as for a shell.
    pub command: String,
    /// Time allowed for each answer (ms).
    pub timeout_ms: u64,
    /// Most memory that the process may hold (MiB).
    pub memory_mib: u64,
}

impl ExecSettings {
    /// The command's words; nothing where its quotes do not match or it has no word.
    pub fn words(&self) -> Option<Vec<String>> {
        shlex::split(&self.command).filter(|words| !words.is_empty())
    }

    pub(super) fn timeout(&self) -> Duration {
        Duration::from_millis(self.timeout_ms)
    }
}
