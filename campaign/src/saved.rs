//! A campaign that is saved in a folder: its plan, read back from the manifest.

use std::path::Path;
use std::sync::Arc;

use closecall_scenarios::{Scenario, ScenarioError, ScenarioFile, Setting};
use closecall_simulation::{Arm, RunKey, SampleError};

use crate::folder::{Folder, FolderError};
use crate::manifest::{Manifest, ManifestScenario};
use crate::runner::{Work, concrete};

/// The reason for which a saved campaign cannot provide what was requested.
#[derive(Debug, thiserror::Error)]
pub enum SavedError {
    /// The folder cannot be used.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// A scenario of the manifest cannot be used.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// The campaign has several scenarios, and none was named.
    #[error("the campaign has several scenarios; name one with --scenario: {}", known.join(", "))]
    ScenarioNotNamed {
        /// The names to choose from.
        known: Vec<String>,
    },
    /// The campaign has no scenario of that name.
    #[error("the campaign has no scenario `{name}`, only {}", known.join(", "))]
    UnknownScenario {
        /// The requested name.
        name: String,
        /// The names to choose from.
        known: Vec<String>,
    },
    /// The campaign has no sample with that number.
    #[error("there is no sample {sample}: the campaign has samples 0 to {last}")]
    UnknownSample {
        /// The requested number.
        sample: u64,
        /// The largest number.
        last: u64,
    },
    /// The campaign was not run with that controller.
    #[error("the campaign was not run with `{name}`, only with {}", known.join(", "))]
    UnknownArm {
        /// The requested name.
        name: String,
        /// The names to choose from.
        known: Vec<String>,
    },
    /// The sampled values of a sample contradict each other.
    #[error("failed to run sample {sample}: {source}")]
    Sample {
        /// The sample.
        sample: u64,
        /// Why it has no concrete scenario.
        source: SampleError,
    },
}

/// A campaign's folder with its manifest.
#[derive(Clone, Debug)]
pub struct SavedCampaign {
    folder: Folder,
    manifest: Manifest,
}

impl SavedCampaign {
    /// Opens the folder of a campaign.
    ///
    /// # Errors
    /// [`FolderError`] if there is no manifest, or it cannot be read.
    pub fn open(path: &Path) -> Result<Self, FolderError> {
        Self::of(Folder::open(path))
    }

    /// Reads the manifest of a folder.
    ///
    /// # Errors
    /// [`FolderError`] if there is no manifest, or it cannot be read.
    pub fn of(folder: Folder) -> Result<Self, FolderError> {
        let manifest = folder.manifest()?;
        Ok(Self { folder, manifest })
    }

    /// Returns the folder.
    pub fn folder(&self) -> &Folder {
        &self.folder
    }

    /// Returns the manifest.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// Returns the scenarios with their arms, as the campaign runs them.
    ///
    /// # Errors
    /// [`SavedError`] if a scenario of the manifest cannot be used.
    pub fn works(&self) -> Result<Vec<Arc<Work>>, SavedError> {
        works(self.folder.path(), &self.manifest)
    }

    /// Returns the arm of the named controller, or the arm under test.
    ///
    /// # Errors
    /// [`SavedError::UnknownArm`] if the campaign was not run with that controller.
    pub fn arm(&self, name: Option<&str>) -> Result<Arm, SavedError> {
        let (controllers, names) = (&self.manifest.arms, self.manifest.arm_names());
        let is_meant =
            |index: &usize| name.is_none_or(|name| names[*index] == name || controllers[*index].to_string() == name);
        let Some(index) = (0..controllers.len()).rev().find(is_meant) else {
            let known = controllers.iter().map(ToString::to_string).collect();
            return Err(SavedError::UnknownArm { name: name.unwrap_or_default().to_owned(), known });
        };
        Ok(self.manifest.arms().swap_remove(index))
    }

    /// Returns the concrete scenario of one sample. `scenario` may be left out if the campaign has only one.
    ///
    /// # Errors
    /// [`SavedError`] if the campaign has no such scenario or sample.
    pub fn sample(&self, scenario: Option<&str>, sample: u64) -> Result<(Scenario, RunKey), SavedError> {
        self.sample_with(scenario, sample, &[])
    }

    /// Returns the concrete scenario of one sample with further settings.
    ///
    /// # Errors
    /// [`SavedError`] if the campaign has no such scenario or sample, a setting does not fit, or a fault that it sets cannot act with
    /// the sensors of the campaign.
    pub fn sample_with(
        &self,
        scenario: Option<&str>,
        sample: u64,
        settings: &[Setting],
    ) -> Result<(Scenario, RunKey), SavedError> {
        let file = self.file(scenario)?;
        let file = ScenarioFile::parse(file.path(), file.text(), settings)?;
        if let Some(mode) = self.manifest.sensors.filter(|_| !settings.is_empty()) {
            file.check_faults_in(mode)?;
        }
        let sampling = self.manifest.sampling;
        let samples = file.space().samples(sampling.design, sampling.samples);
        if sample >= samples {
            return Err(SavedError::UnknownSample { sample, last: samples - 1 });
        }
        let scenario = concrete(&file, sampling, sample).map_err(|source| SavedError::Sample { sample, source })?;
        Ok((scenario, RunKey { seed: sampling.seed, sample }))
    }

    /// Returns a scenario of the campaign with the campaign's settings. `scenario` may be left out if there is only one.
    ///
    /// # Errors
    /// [`SavedError`] if the campaign has no such scenario, or it cannot be used.
    pub fn file(&self, scenario: Option<&str>) -> Result<ScenarioFile, SavedError> {
        scenario_file(self.folder.path(), self.choose(scenario)?)
    }

    fn choose(&self, name: Option<&str>) -> Result<&ManifestScenario, SavedError> {
        let scenarios = &self.manifest.scenarios;
        let known = || scenarios.iter().map(|scenario| scenario.name.clone()).collect();
        match (name, &scenarios[..]) {
            (None, [only]) => Ok(only),
            (None, _) => Err(SavedError::ScenarioNotNamed { known: known() }),
            (Some(name), scenarios) => scenarios
                .iter()
                .find(|scenario| scenario.name == name)
                .ok_or_else(|| SavedError::UnknownScenario { name: name.to_owned(), known: known() }),
        }
    }
}

/// Returns the scenarios of a manifest with their arms. `folder` appears in messages only.
///
/// # Errors
/// [`SavedError`] if a scenario of the manifest cannot be used.
pub fn works(folder: &Path, manifest: &Manifest) -> Result<Vec<Arc<Work>>, SavedError> {
    let arms = manifest.arms();
    let work = |scenario| {
        let file = scenario_file(folder, scenario)?;
        let (sampling, checks, retry_crashed) = (manifest.sampling, manifest.checks, manifest.retry_crashed);
        Ok(Arc::new(Work { file, sampling, arms: arms.clone(), checks, retry_crashed }))
    };
    manifest.scenarios.iter().map(work).collect()
}

/// Returns the scenarios of a manifest. `folder` appears in messages only.
///
/// # Errors
/// [`SavedError`] if a scenario of the manifest cannot be used.
pub(crate) fn scenario_files(folder: &Path, manifest: &Manifest) -> Result<Vec<ScenarioFile>, SavedError> {
    manifest.scenarios.iter().map(|scenario| scenario_file(folder, scenario)).collect()
}

fn scenario_file(folder: &Path, scenario: &ManifestScenario) -> Result<ScenarioFile, SavedError> {
    if blake3::hash(scenario.text.as_bytes()).to_string() != scenario.blake3 {
        let message = format!("the text of `{}` has been changed since the campaign was run", scenario.name);
        return Err(FolderError::Content { path: folder.join("manifest.json"), line: 1, message }.into());
    }
    let path = folder.join(format!("manifest.json#{}", scenario.name));
    Ok(ScenarioFile::parse(&path, &scenario.text, &[])?)
}
