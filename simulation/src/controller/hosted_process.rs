//! Worker processes of the program that has Closecall as a library.

use serde::{Deserialize, Serialize};

use super::exec::ExecSettings;

/// The hidden command that serves libraries and FMUs.
pub(super) const COMMAND: &str = "host";

/// A controller of a program that worker processes run, with what starts one. The process registers
/// the controller under its name, and then runs the hidden command that serves samples.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct HostedProcess {
    /// The name with its version, under which the process registers the controller.
    pub id: String,
    /// The name in reports.
    pub name: String,
    /// The words that start the process, to which the hidden command is added.
    pub words: Vec<String>,
    /// Time limit of each answer (ms).
    pub timeout_ms: u64,
    /// Largest resident memory of the process (MiB).
    pub memory_mib: u64,
}

impl HostedProcess {
    /// Returns the settings of a process with these arguments of the hidden command.
    pub(super) fn process(&self, arguments: &[&str]) -> ExecSettings {
        let words = self.words.iter().map(String::as_str).chain([COMMAND]).chain(arguments.iter().copied());
        // A word with a NUL character, which cannot be quoted, starts nothing.
        let command = shlex::try_join(words).unwrap_or_default();
        ExecSettings { command, timeout_ms: self.timeout_ms, memory_mib: self.memory_mib }
    }
}
