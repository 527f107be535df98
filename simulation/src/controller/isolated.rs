//! Controllers that a worker process runs, together with whole samples: whatever they do costs one
//! sample.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::exec::ExecSettings;
use super::hosted_process::HostedProcess;
use super::native::{NativeError, NativeFactory};
use crate::run::ControllerFactory;
use closecall_scenarios::Scenario;

/// A controller that a worker process runs, together with whole samples.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Isolated {
    /// A library or an FMU.
    Native(NativeFactory),
    /// A controller of the program that has Closecall as a library.
    Hosted(HostedProcess),
}

impl Isolated {
    /// Returns the name in reports.
    pub fn name(&self) -> &str {
        match self {
            Self::Native(native) => native.name(),
            Self::Hosted(hosted) => &hosted.name,
        }
    }

    /// Returns the library or FMU, or `None` if this is none.
    pub const fn native(&self) -> Option<&NativeFactory> {
        if let Self::Native(native) = self { Some(native) } else { None }
    }

    /// Returns the time limit of each answer (ms).
    pub const fn timeout_ms(&self) -> u64 {
        match self {
            Self::Native(native) => native.settings().timeout_ms,
            Self::Hosted(hosted) => hosted.timeout_ms,
        }
    }

    /// Returns the settings of a worker process with these arguments, under the limits of the
    /// controller.
    pub fn process(&self, arguments: &[&str]) -> ExecSettings {
        match self {
            Self::Native(native) => native.process(arguments),
            Self::Hosted(hosted) => hosted.process(arguments),
        }
    }

    /// Checks that every variable of an FMU has its counterpart in a scenario. A relative path is
    /// in `folder`, or in the folder of this program.
    ///
    /// # Errors
    /// [`NativeError`] if one has none.
    pub fn check_variables(&self, scenario: &Scenario, folder: Option<&Path>) -> Result<(), NativeError> {
        self.native().map_or(Ok(()), |native| native.settings().check_variables(scenario, folder))
    }
}
