//! The plan of a campaign: everything that determines its outcomes.
//!
//! ```text
//!  scenario files ┐
//!  sampling       ├─▶ Plan ─▶ Campaign (runs it)
//!  controllers    ┘        └─▶ Manifest (stores it)
//! ```

use std::path::Path;
use std::sync::Arc;

use closecall_controllers::{CheckedDriver, DriverConfig};
use closecall_scenarios::sampling::Design;
use closecall_scenarios::{ScenarioError, ScenarioFile};
use closecall_sensors::camera::{Backend, CameraConfig, Pipeline, SHIPPED_MASK_RCNN, SHIPPED_MODEL};
use closecall_sensors::{SensorMode, inference_backend};
use closecall_simulation::Arm;
use closecall_simulation::controller::{BuiltIn, ControllerChoice};
use closecall_simulation::perception::try_program;

use crate::execution::Campaign;
use crate::fingerprint::Fingerprint;
use crate::folder::FolderError;
use crate::ledger::Inference;
use crate::left_out::LeftOut;
use crate::manifest::{MANIFEST_VERSION, Manifest, ManifestModel, ManifestScenario, file_hash, version};
use crate::partition::Partition;
use crate::runner::Work;
use crate::sampling::Sampling;
use crate::stop::StopFlag;
use crate::validity::CheckPlan;
use crate::workers::Workers;

pub use crate::plan_error::PlanError;

/// The plan of a campaign.
#[derive(Clone, Debug)]
pub struct Plan {
    scenarios: Vec<ScenarioFile>,
    sampling: Sampling,
    controllers: Vec<ControllerChoice>,
    /// The sensors; `None` for the sensors of each scenario.
    pub sensors: Option<SensorMode>,
    /// The part of the samples that is run; all of them if `None`.
    pub partition: Option<Partition>,
    /// The samples that are checked for validity.
    pub checks: CheckPlan,
    /// The rule that determines the number of samples.
    pub inference: Inference,
    /// The number of worker threads, and the time limit of a sample.
    pub workers: Workers,
    /// How often a sample runs again in a new process after its worker process has crashed or hung.
    pub retry_crashed: u32,
    /// Scenarios and members of a driver ensemble that are not run, because the member changes
    /// nothing in the scenario.
    pub without_effect: Vec<(String, String)>,
    /// Scenarios that do not run, because a fault of them cannot act with the sensors.
    pub left_out: Vec<LeftOut>,
    /// Whether the seed was drawn when the campaign began, so that nobody knew it before.
    pub has_drawn_seed: bool,
}

impl Plan {
    /// Returns a plan that runs each sample of each scenario once for each controller. The last
    /// controller is the one under test. If there are several, the first is the baseline, and those
    /// between are references.
    ///
    /// # Errors
    /// [`PlanError`] if two scenarios have the same name, two arms the same controller, a scenario
    /// no system for one that is tested, or a variable of an FMU has no counterpart.
    pub fn new(
        scenarios: Vec<ScenarioFile>,
        sampling: Sampling,
        controllers: Vec<ControllerChoice>,
    ) -> Result<Self, PlanError> {
        Self::new_in(None, scenarios, sampling, controllers)
    }

    /// Returns what [`Plan::new`] returns if relative paths of controllers are in `folder`.
    pub(crate) fn new_in(
        folder: Option<&Path>,
        scenarios: Vec<ScenarioFile>,
        sampling: Sampling,
        controllers: Vec<ControllerChoice>,
    ) -> Result<Self, PlanError> {
        for (index, file) in scenarios.iter().enumerate() {
            let name = &file.config().name;
            if let Some(same) = scenarios[..index].iter().find(|earlier| earlier.config().name == *name) {
                let (first, second) = (same.path().to_owned(), file.path().to_owned());
                return Err(PlanError::SameName { first, second, name: name.clone() });
            }
        }
        let without_bins = |file: &&ScenarioFile| sampling.design == Design::Coverage && !file.space().has_strata();
        if let Some(file) = scenarios.iter().find(without_bins) {
            return Err(PlanError::NothingToFill { scenario: file.config().name.clone() });
        }
        let natives: Vec<_> = controllers.iter().filter_map(ControllerChoice::native).collect();
        for (index, controller) in controllers.iter().enumerate() {
            if controllers[..index].contains(controller) {
                return Err(PlanError::SameArm { controller: controller.to_string() });
            }
        }
        for file in &scenarios {
            check_mis(file, &controllers)?;
            check_functions(file, &controllers)?;
        }
        for (file, native) in scenarios.iter().flat_map(|file| natives.iter().map(move |native| (file, native))) {
            // A scenario without a nominal sample is an error of its samples.
            let Ok(nominal) = file.concrete(&file.space().nominal()) else { continue };
            let fail = |source| PlanError::Controller { scenario: file.config().name.clone(), source };
            native.check_variables(&nominal, folder).map_err(fail)?;
        }
        for file in &scenarios {
            let Some(program) = file.program() else { continue };
            let fail = |source| PlanError::Controller { scenario: file.config().name.clone(), source };
            try_program(&program).map_err(fail)?;
        }
        Ok(Self {
            scenarios,
            sampling,
            controllers,
            sensors: None,
            partition: None,
            checks: CheckPlan::default(),
            inference: Inference::default(),
            workers: Workers::default(),
            retry_crashed: 0,
            without_effect: Vec::new(),
            left_out: Vec::new(),
            has_drawn_seed: false,
        })
    }

    /// Uses these sensors instead of the sensors of each scenario, if any are given.
    ///
    /// # Errors
    /// [`ScenarioError`] if a fault of a scenario could not act in this mode: the campaign would
    /// test nothing, and pass.
    pub fn use_sensors(&mut self, sensors: Option<SensorMode>) -> Result<(), ScenarioError> {
        if let Some(mode) = sensors {
            self.scenarios.iter().try_for_each(|file| file.check_faults_in(mode))?;
        }
        self.sensors = sensors;
        Ok(())
    }

    /// Returns the plan of the same campaign with other sensors and another number of samples. Its
    /// samples are not checked for validity.
    ///
    /// # Errors
    /// As [`Self::use_sensors`].
    pub fn with_sensors(&self, mode: SensorMode, samples: u64) -> Result<Self, ScenarioError> {
        let sampling = Sampling { samples, ..self.sampling };
        let mut plan = Self { sampling, checks: CheckPlan::off(), ..self.clone() };
        plan.use_sensors(Some(mode))?;
        Ok(plan)
    }

    /// Returns the name of the first scenario that may run with these sensors.
    pub fn scenario_in(&self, mode: SensorMode) -> Option<&str> {
        let file = self.scenarios.iter().find(|file| file.may_have_mode(mode, self.sensors))?;
        Some(&file.config().name)
    }

    /// Returns how the samples are drawn.
    pub const fn sampling(&self) -> Sampling {
        self.sampling
    }

    /// Returns the names of the scenarios.
    pub fn names(&self) -> impl Iterator<Item = &str> + Clone {
        self.scenarios.iter().map(|file| file.config().name.as_str())
    }

    /// Returns the campaign, ready to run.
    pub fn campaign(&self) -> Campaign {
        let controllers = ControllerChoice::factories(&self.controllers, None);
        let arms: Vec<Arm> =
            controllers.into_iter().map(|controller| Arm { controller, sensors: self.sensors }).collect();
        let (sampling, checks, retry_crashed) = (self.sampling, self.checks, self.retry_crashed);
        let work = |file: &ScenarioFile| {
            Arc::new(Work { file: file.clone(), sampling, arms: arms.clone(), checks, retry_crashed })
        };
        Campaign {
            works: self.scenarios.iter().map(work).collect(),
            partition: self.partition,
            workers: self.workers,
            inference: self.inference,
            retry_errors: false,
            remote: None,
            goes_on_without_folder: false,
            stop: StopFlag::default(),
        }
    }

    /// Returns true if some sample may need the rear camera's network.
    pub fn uses_classifier(&self) -> bool {
        self.scenarios.iter().any(|file| file.may_have_mode(SensorMode::Full, self.sensors))
    }

    /// Returns the rear cameras whose Mask R-CNN some sample may need.
    pub fn mask_rcnn_cameras(&self) -> impl Iterator<Item = &CameraConfig> {
        self.cameras_with(Pipeline::MaskRcnn)
    }

    /// Returns the files of the scenarios' own networks that classify crops in some sample.
    pub fn crop_networks(&self) -> impl Iterator<Item = &str> {
        self.cameras_with(Pipeline::CropClassifier).filter_map(|camera| camera.model.as_deref())
    }

    /// Returns the rear cameras that may have this pipeline in some sample.
    fn cameras_with(&self, pipeline: Pipeline) -> impl Iterator<Item = &CameraConfig> {
        let may_need = |file: &&ScenarioFile| file.may_have_mode(SensorMode::Full, self.sensors);
        self.scenarios.iter().filter(may_need).flat_map(move |file| file.cameras_with(pipeline))
    }

    /// Returns the networks that some sample may need.
    fn models(&self) -> Result<Vec<ManifestModel>, FolderError> {
        if !self.uses_classifier() {
            return Ok(Vec::new());
        }
        let classifier = rear_classifier()?;
        let mut models = Vec::new();
        for path in self.crop_networks() {
            let read = |source| FolderError::Read { path: path.into(), source };
            let blake3 = file_hash(Path::new(path)).map_err(read)?.to_string();
            models.push(ManifestModel { name: path.to_owned(), blake3, backend: classifier.backend.clone() });
        }
        for camera in self.mask_rcnn_cameras() {
            let (name, blake3) = match &camera.mask_rcnn.model {
                None => ("rear-mask-rcnn".to_owned(), blake3::hash(SHIPPED_MASK_RCNN).to_string()),
                Some(path) => {
                    let hash = file_hash(Path::new(path));
                    let read = |source| FolderError::Read { path: path.into(), source };
                    (path.clone(), hash.map_err(read)?.to_string())
                }
            };
            models.push(ManifestModel { name, blake3, backend: classifier.backend.clone() });
        }
        models.dedup();
        Ok(std::iter::once(classifier).chain(models).collect())
    }

    /// Returns what identifies the controllers that run as processes in the given folder, or in the
    /// folder of this program.
    fn fingerprints(&self, folder: Option<&Path>) -> Vec<Fingerprint> {
        let nominal = self.scenarios.first().and_then(|file| file.concrete(&file.space().nominal()).ok());
        let fingerprint = |choice| Fingerprint::of_choice(choice, folder, nominal.as_ref());
        let controllers = self.controllers.iter().filter_map(fingerprint);
        let mut programs: Vec<Fingerprint> = Vec::new();
        for file in &self.scenarios {
            let nominal = file.concrete(&file.space().nominal()).ok();
            // A mode without scans runs no program.
            let mode = self.sensors.or_else(|| nominal.as_ref().map(|nominal| nominal.sensors.mode()));
            if let Some(program) = file.program().filter(|_| mode == Some(SensorMode::Full)) {
                let fingerprint = Fingerprint::of_program(&program, nominal.as_ref());
                programs.extend((!programs.contains(&fingerprint)).then_some(fingerprint));
            }
        }
        controllers.chain(programs).collect()
    }

    /// Returns the manifest of the campaign. `command` is the command line that started it.
    ///
    /// # Errors
    /// [`FolderError::Read`] if the inference library that is in use cannot be read.
    pub fn manifest(&self, command: Vec<String>) -> Result<Manifest, FolderError> {
        self.manifest_in(command, None)
    }

    /// Does the same as [`Self::manifest`] for controllers that run in another folder than this
    /// program.
    pub(crate) fn manifest_in(&self, command: Vec<String>, folder: Option<&Path>) -> Result<Manifest, FolderError> {
        let scenario = |file: &ScenarioFile| ManifestScenario {
            name: file.config().name.clone(),
            path: file.path().display().to_string(),
            blake3: blake3::hash(file.text().as_bytes()).to_string(),
            text: file.text().to_owned(),
            settings: file.settings().iter().map(ToString::to_string).collect(),
        };
        Ok(Manifest {
            manifest_version: MANIFEST_VERSION,
            closecall_version: version(),
            scenarios: self.scenarios.iter().map(scenario).collect(),
            sampling: self.sampling,
            partition: self.partition,
            arms: self.controllers.clone(),
            sensors: self.sensors,
            checks: self.checks,
            inference: self.inference,
            models: self.models()?,
            controllers: self.fingerprints(folder),
            working_folder: std::env::current_dir().ok(),
            sample_timeout_s: self.workers.sample_timeout.as_secs_f64(),
            retry_crashed: self.retry_crashed,
            without_effect: self.without_effect.clone(),
            left_out: self.left_out.clone(),
            has_drawn_seed: self.has_drawn_seed,
            replaceable: false,
            command,
        })
    }
}

/// Refuses a controller that is a margin increase system for a scenario whose ego stack has none:
/// it would be the baseline under another name; and one in which a human drives, for a scenario
/// whose ego has no human driver.
///
/// # Errors
/// [`PlanError::WithoutMis`] or [`PlanError::WithoutHuman`] with the first such controller.
pub fn check_mis(file: &ScenarioFile, controllers: &[ControllerChoice]) -> Result<(), PlanError> {
    let lacks_mis = file.config().actors.iter().any(|actor| match &actor.driver {
        DriverConfig::EgoStack(stack) => stack.mis.is_none(),
        _ => false,
    });
    let lacks_human = file.config().actors.iter().any(|actor| match &actor.driver {
        DriverConfig::EgoStack(stack) => stack.human.is_none(),
        _ => false,
    });
    let needs_human = |controller: &&ControllerChoice| controller.built_in().is_some_and(BuiltIn::needs_human);
    if let Some(controller) = controllers.iter().find(needs_human).filter(|_| lacks_human) {
        let (scenario, controller) = (file.config().name.clone(), controller.to_string());
        return Err(PlanError::WithoutHuman { scenario, controller });
    }
    let needs_mis = |controller: &&ControllerChoice| controller.built_in().is_some_and(BuiltIn::needs_mis);
    match controllers.iter().find(needs_mis).filter(|_| lacks_mis) {
        Some(controller) => {
            Err(PlanError::WithoutMis { scenario: file.config().name.clone(), controller: controller.to_string() })
        }
        None => Ok(()),
    }
}

/// Refuses arms whose functions are the same in a scenario, and settings of an arm that change
/// nothing: two arms would have one outcome.
///
/// # Errors
/// [`PlanError::SameStack`] or [`PlanError::NoEffect`] with the first such arms.
pub fn check_functions(file: &ScenarioFile, controllers: &[ControllerChoice]) -> Result<(), PlanError> {
    let is_switched = |choice: &ControllerChoice| {
        matches!(choice, ControllerChoice::Tuned(_)) || matches!(choice.built_in(), Some(BuiltIn::Stack(_)))
    };
    if !controllers.iter().any(is_switched) {
        return Ok(());
    }
    // A scenario without a nominal sample is an error of its samples.
    let Ok(nominal) = file.concrete(&file.space().nominal()) else { return Ok(()) };
    let CheckedDriver::Ego(stack) = &nominal.actors[nominal.ego].driver else { return Ok(()) };
    let scenario = || file.config().name.clone();
    let settings = |choice: &ControllerChoice| choice.factory().settings(stack);
    for tuned in controllers.iter().filter(|choice| matches!(choice, ControllerChoice::Tuned(_))) {
        let base = tuned.built_in().map(ControllerChoice::from);
        if base.is_some_and(|base| settings(&base) == settings(tuned)) {
            return Err(PlanError::NoEffect { scenario: scenario(), controller: tuned.to_string() });
        }
    }
    let stacks: Vec<&ControllerChoice> =
        controllers.iter().filter(|choice| choice.built_in().is_some_and(BuiltIn::is_stack)).collect();
    for (index, second) in stacks.iter().enumerate() {
        let same = |first: &&&ControllerChoice| {
            (is_switched(first) || is_switched(second)) && settings(first) == settings(second)
        };
        if let Some(first) = stacks[..index].iter().find(same) {
            let (first, second) = (first.to_string(), second.to_string());
            return Err(PlanError::SameStack { scenario: scenario(), first, second });
        }
    }
    Ok(())
}

/// Returns the rear camera's network and the inference backend that runs it.
fn rear_classifier() -> Result<ManifestModel, FolderError> {
    let backend = match inference_backend() {
        Backend::Tract => "tract".to_owned(),
        Backend::OnnxRuntime(library) => {
            let hash = file_hash(library).map_err(|source| FolderError::Read { path: library.clone(), source })?;
            format!("onnxruntime, blake3 {hash}")
        }
    };
    let blake3 = blake3::hash(SHIPPED_MODEL).to_string();
    Ok(ManifestModel { name: "rear-classifier".to_owned(), blake3, backend })
}
