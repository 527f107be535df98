//! A campaign that is saved in a folder: its plan, read back from the manifest.

use std::path::Path;
use std::sync::Arc;

use closecall_scenarios::{Scenario, ScenarioFile, Setting};
use closecall_simulation::{Arm, RunKey};

use crate::folder::{Folder, FolderError};
use crate::manifest::{Manifest, ManifestScenario};

use crate::runner::{Work, concrete};
pub use crate::saved_error::SavedError;
use crate::trust;

/// A campaign's folder with its manifest.
#[derive(Clone, Debug)]
pub struct SavedCampaign {
    folder: Folder,
    manifest: Manifest,
    /// Whether the code that the manifest names may run.
    is_trusted: bool,
}

impl SavedCampaign {
    /// Opens the folder of a campaign. The code that it names runs only if the folder is the user's
    /// own, or is trusted.
    ///
    /// # Errors
    /// [`FolderError`] if there is no manifest, or it cannot be read.
    pub fn open(path: &Path) -> Result<Self, FolderError> {
        let folder = Folder::open(path);
        let (manifest, hash) = folder.manifest_with_hash()?;
        let is_trusted = manifest.foreign_code().is_empty() || trust::is_own(&hash);
        Ok(Self { folder, manifest, is_trusted })
    }

    /// Reads the manifest of a folder that this program has just written, or that is read and not
    /// run.
    ///
    /// # Errors
    /// [`FolderError`] if there is no manifest, or it cannot be read.
    pub fn of(folder: Folder) -> Result<Self, FolderError> {
        let manifest = folder.manifest()?;
        Ok(Self { folder, manifest, is_trusted: true })
    }

    /// Lets the code run that the folder names.
    pub const fn trust(&mut self) {
        self.is_trusted = true;
    }

    /// Returns the commands, libraries and FMUs that do not run, because the folder is not the
    /// user's own and not trusted.
    pub fn not_trusted(&self) -> Vec<String> {
        if self.is_trusted {
            return Vec::new();
        }
        let place = self.manifest.controller_folder().map(|folder| format!("(in {})", folder.display()));
        self.manifest.foreign_code().into_iter().chain(place).collect()
    }

    /// Checks that all arms may run.
    ///
    /// # Errors
    /// [`SavedError::NotTrusted`] if the folder names code that does not run.
    pub fn check_trust(&self) -> Result<(), SavedError> {
        let commands = self.not_trusted();
        if commands.is_empty() {
            return Ok(());
        }
        Err(SavedError::NotTrusted { path: self.folder.path().to_owned(), commands })
    }

    /// Gives the processes of the controllers other limits: the time limit of each answer (ms), and
    /// the memory (MiB). `None` leaves a limit as the campaign had it.
    pub fn limit(&mut self, timeout_ms: Option<u64>, memory_mib: Option<u64>) {
        for arm in &mut self.manifest.arms {
            *arm = arm.limited(timeout_ms, memory_mib);
        }
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

    /// Returns the arms, the baseline first.
    ///
    /// # Errors
    /// [`SavedError::NotTrusted`] if the folder names code that does not run.
    pub fn arms(&self) -> Result<Vec<Arm>, SavedError> {
        self.check_trust()?;
        Ok(self.manifest.arms())
    }

    /// Returns the arm of the named controller, or the arm under test. A controller that is named
    /// by its whole command, as in `exec:COMMAND`, is the caller's and not the folder's: it runs in
    /// the working folder if the folder is not trusted.
    ///
    /// # Errors
    /// [`SavedError::UnknownArm`] if the campaign was not run with that controller,
    /// [`SavedError::NotTrusted`] if the folder names it and is not trusted.
    pub fn arm(&self, name: Option<&str>) -> Result<Arm, SavedError> {
        if !self.manifest.perceptions().is_empty() {
            self.check_trust()?;
        }
        let (controllers, names) = (&self.manifest.arms, self.manifest.arm_names());
        let is_meant =
            |index: &usize| name.is_none_or(|name| names[*index] == name || controllers[*index].to_string() == name);
        let Some(index) = (0..controllers.len()).rev().find(is_meant) else {
            let names = controllers.iter().map(ToString::to_string).collect();
            return Err(SavedError::UnknownArm { name: name.unwrap_or_default().to_owned(), names });
        };
        let controller = &controllers[index];
        if self.is_trusted || !controller.has_limits() {
            return Ok(self.manifest.arms().swap_remove(index));
        }
        if name == Some(controller.to_string().as_str()) {
            let sensors = self.manifest.sensors;
            return Ok(Arm { controller: controller.factory_in(None, names[index].clone()), sensors });
        }
        self.check_trust()?;
        Ok(self.manifest.arms().swap_remove(index))
    }

    /// Returns the concrete scenario of one sample. `scenario` may be left out if the campaign has
    /// only one.
    ///
    /// # Errors
    /// [`SavedError`] if the campaign has no such scenario or sample.
    pub fn sample(&self, scenario: Option<&str>, sample: u64) -> Result<(Scenario, RunKey), SavedError> {
        self.sample_with(scenario, sample, &[])
    }

    /// Returns the concrete scenario of one sample with further settings.
    ///
    /// # Errors
    /// [`SavedError`] if the campaign has no such scenario or sample, a setting does not fit, or a
    /// fault that it sets cannot act with the sensors of the campaign.
    pub fn sample_with(
        &self,
        scenario: Option<&str>,
        sample: u64,
        settings: &[Setting],
    ) -> Result<(Scenario, RunKey), SavedError> {
        let file = self.file(scenario)?;
        let parsed = ScenarioFile::parse(file.path(), file.text(), settings)?;
        let file = parsed.with_program_in(self.manifest.controller_folder());
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

    /// Returns a scenario of the campaign with the campaign's settings. `scenario` may be left out
    /// if there is only one.
    ///
    /// # Errors
    /// [`SavedError`] if the campaign has no such scenario, or it cannot be used.
    pub fn file(&self, scenario: Option<&str>) -> Result<ScenarioFile, SavedError> {
        let file = scenario_file(self.folder.path(), self.choose(scenario)?)?;
        Ok(file.with_program_in(self.manifest.controller_folder()))
    }

    fn choose(&self, name: Option<&str>) -> Result<&ManifestScenario, SavedError> {
        let scenarios = &self.manifest.scenarios;
        let names = || scenarios.iter().map(|scenario| scenario.name.clone()).collect();
        match (name, &scenarios[..]) {
            (None, [only]) => Ok(only),
            (None, _) => Err(SavedError::ScenarioNotNamed { names: names() }),
            (Some(name), scenarios) => scenarios
                .iter()
                .find(|scenario| scenario.name == name)
                .ok_or_else(|| SavedError::UnknownScenario { name: name.to_owned(), names: names() }),
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
        let file = scenario_file(folder, scenario)?.with_program_in(manifest.controller_folder());
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
