//! The project file, `closecall.toml`: gates for every campaign that is run in a folder or below it.

use std::path::{Path, PathBuf};

use closecall_campaign::gate::{GateSet, GateSource, GateSpec, ProbabilitySpec, Scope};
use closecall_campaign::probability::ProbabilityGate;
use closecall_simulation::criteria::GateConfig;
use serde::Deserialize;

use super::CliError;

/// The name of a project file.
const NAME: &str = "closecall.toml";

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
struct ProjectConfig {
    #[serde(default)]
    gate: GateConfig,
}

/// A project file that has been read.
#[derive(Debug)]
pub(super) struct ProjectFile {
    path: PathBuf,
    gate: GateConfig,
}

impl ProjectFile {
    /// Reads the project file of the working folder, or of the nearest folder above it. Returns `None` if there is none.
    pub(super) fn find() -> Result<Option<Self>, CliError> {
        let Ok(here) = std::env::current_dir() else { return Ok(None) };
        let found = here.ancestors().map(|folder| folder.join(NAME)).find(|path| path.is_file());
        found.map(|path| Self::read(&path)).transpose()
    }

    fn read(path: &Path) -> Result<Self, CliError> {
        let fail = |message: String| CliError::Project { path: path.to_owned(), message };
        let text = std::fs::read_to_string(path).map_err(|error| fail(error.to_string()))?;
        let config: ProjectConfig = toml::from_str(&text).map_err(|error| fail(error.to_string()))?;
        Ok(Self { path: path.to_owned(), gate: config.gate })
    }

    /// Adds the gates that no gate of the command line or a preset replaces.
    pub(super) fn add_to(self, set: &mut GateSet) -> Result<(), CliError> {
        let source = GateSource::ProjectFile(self.path.clone());
        for expression in self.gate.require {
            // A bound for all scenarios together replaces one for each.
            let is_replaced = set.specs.iter().any(|spec| spec.expression.subject() == expression.subject());
            if !is_replaced {
                set.push(GateSpec { expression, source: source.clone(), scope: Scope::EachScenario });
            }
        }
        if let (None, Some(max)) = (&set.probability, self.gate.max_probability) {
            let confidence = self.gate.confidence.unwrap_or(ProbabilityGate::CONFIDENCE);
            let gate = ProbabilityGate::new(max, confidence)
                .map_err(|error| CliError::Project { path: self.path, message: error.to_string() })?;
            set.probability = Some(ProbabilitySpec { gate, source });
        }
        Ok(())
    }
}
