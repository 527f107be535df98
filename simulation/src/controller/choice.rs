//! The controller that a command line or a manifest names.

use std::fmt;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::BuiltIn;
use super::exec::{ExecFactory, ExecSettings};
use crate::run::ControllerFactory;

/// A controller as a manifest keeps it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum ControllerChoice {
    /// The scenario's ego stack without its margin increase system.
    Acc,
    /// The scenario's whole ego stack.
    Mis,
    /// A process of its own for each sample.
    Exec(ExecSettings),
}

impl ControllerChoice {
    /// The name in every report.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Acc => BuiltIn::Acc.name(),
            Self::Mis => BuiltIn::Mis.name(),
            Self::Exec(_) => super::exec::NAME,
        }
    }

    /// The factory of this controller.
    pub fn factory(&self) -> Arc<dyn ControllerFactory> {
        match self {
            Self::Acc => BuiltIn::Acc.factory(),
            Self::Mis => BuiltIn::Mis.factory(),
            Self::Exec(settings) => Arc::new(ExecFactory::new(settings.clone())),
        }
    }
}

/// As it is written after `--controller`.
impl fmt::Display for ControllerChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Acc | Self::Mis => f.write_str(self.name()),
            Self::Exec(settings) => write!(f, "{}:{}", super::exec::NAME, settings.command),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_manifest_reads_back_what_it_wrote() {
        let exec = ExecSettings { command: "python3 'a b.py'".to_owned(), timeout_ms: 250, memory_mib: 64 };
        for choice in [ControllerChoice::Acc, ControllerChoice::Mis, ControllerChoice::Exec(exec)] {
            let text = serde_json::to_string(&choice).unwrap();
            assert_eq!(serde_json::from_str::<ControllerChoice>(&text).unwrap(), choice, "{text}");
        }
        assert_eq!(serde_json::to_string(&ControllerChoice::Mis).unwrap(), "\"mis\"");
    }
}
