//! The choice of a controller on a command line or in a manifest.

use std::fmt;
use std::path::Path;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::BuiltIn;
use super::exec::{ExecFactory, ExecSettings};
use crate::run::ControllerFactory;

/// A controller, as a campaign's manifest stores it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum ControllerChoice {
    /// The scenario's ego stack without its margin increase system.
    Acc,
    /// The scenario's complete ego stack.
    Mis,
    /// A separate process for each sample.
    Exec(ExecSettings),
}

impl ControllerChoice {
    /// Returns the name in reports.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Acc => BuiltIn::Acc.name(),
            Self::Mis => BuiltIn::Mis.name(),
            Self::Exec(_) => super::exec::NAME,
        }
    }

    /// Returns a factory of this controller.
    pub fn factory(&self) -> Arc<dyn ControllerFactory> {
        self.factory_in(None)
    }

    /// Returns a factory of this controller. A process runs in the given folder, or in that of this program.
    pub fn factory_in(&self, folder: Option<&Path>) -> Arc<dyn ControllerFactory> {
        match self {
            Self::Acc => BuiltIn::Acc.factory(),
            Self::Mis => BuiltIn::Mis.factory(),
            Self::Exec(settings) => Arc::new(ExecFactory::new(settings.clone(), folder)),
        }
    }
}

/// Writes the controller as it is given to `--controller`.
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
    fn a_choice_survives_the_round_trip_through_a_manifest() {
        let exec = ExecSettings { command: "python3 'a b.py'".to_owned(), timeout_ms: 250, memory_mib: 64 };
        for choice in [ControllerChoice::Acc, ControllerChoice::Mis, ControllerChoice::Exec(exec)] {
            let text = serde_json::to_string(&choice).unwrap();
            assert_eq!(serde_json::from_str::<ControllerChoice>(&text).unwrap(), choice, "{text}");
        }
        assert_eq!(serde_json::to_string(&ControllerChoice::Mis).unwrap(), "\"mis\"");
    }
}
