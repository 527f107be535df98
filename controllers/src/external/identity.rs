//! The identity that a loaded controller states, and the object that drives one run.

use serde::{Deserialize, Serialize};

use crate::external::exchange::{Answer, Input};

/// The identity that a controller states.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity {
    /// The name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// The version.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub version: Option<String>,
}

/// A controller that drives one run.
pub(crate) trait Run: Send {
    /// Returns the answer to a control step, or why there is none.
    fn step(&mut self, input: &Input) -> Result<Answer, String>;

    /// Ends the run, or returns why its answers cannot be trusted.
    fn finish(&mut self) -> Result<(), String> {
        Ok(())
    }
}
