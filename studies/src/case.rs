//! One sample of a campaign in one arm, which can be run again with settings.

use std::path::PathBuf;

use closecall_campaign::failure::FailureKind;
use closecall_campaign::folder::FolderError;
use closecall_campaign::runner::{Sampling, run_guarded};
use closecall_campaign::saved::{SavedCampaign, SavedError};
use closecall_scenarios::outcome::Outcome;
use closecall_scenarios::{Scenario, ScenarioError, ScenarioFile, Setting, SettingError};
use closecall_sensors::SensorMode;
use closecall_simulation::{Arm, NoObserver, Observer, RunKey, SampleError};
use closecall_traffic::atomic::WriteError;
use closecall_traffic::{Check, Parameters};

use crate::failures::SampleErrors;
use crate::map::MapError;

/// The reason for which no cause can be found.
#[derive(Debug, thiserror::Error)]
pub enum CausesError {
    /// The campaign has no such sample or arm.
    #[error(transparent)]
    Saved(#[from] SavedError),
    /// A map cannot be computed.
    #[error(transparent)]
    Map(#[from] MapError),
    /// The folder of the campaign cannot be used.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// A setting does not fit the scenario.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// The sample has no outcome.
    #[error("failed to run sample {sample}: {source}")]
    Sample {
        /// The sample's number.
        sample: u64,
        /// The reason for which the sample has no outcome.
        source: SampleError,
    },
    /// The sample fails in the journal of the campaign, but not when it is run again.
    #[error(
        "sample {sample} with `{controller}` collides in the journal of the campaign, but not if it is run again: the \
         controller, a file that it imports or the program has changed, or does not repeat"
    )]
    NotRepeated {
        /// The sample's number.
        sample: u64,
        /// The controller.
        controller: String,
    },
    /// The sample fails otherwise than in the journal of the campaign.
    #[error("{0}")]
    Differs(String),
    /// No failing sample fails when it is run again, and some have no outcome.
    #[error(
        "no sample of `{scenario}` that fails with `{controller}` fails if it is run again; a run ended in an error: {message}"
    )]
    NoOutcome {
        /// The scenario.
        scenario: String,
        /// The controller.
        controller: String,
        /// The message of a run without an outcome.
        message: String,
    },
    /// The reduced case of a sample does not fail when it is run again.
    #[error(
        "the reduced case of sample {sample} with `{controller}` collided while it was looked for, but not if it is run \
         again: the controller does not repeat"
    )]
    NotReduced {
        /// The sample's number.
        sample: u64,
        /// The controller.
        controller: String,
    },
    /// A setting of a reduced case cannot be read.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// A file that another program or a person has written would be overwritten.
    #[error("{} exists, and `closecall minimize` has not written it: name another file", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
    },
    /// A scenario of a campaign is not the counted encounter.
    #[error(
        "in `{scenario}` the lead vehicle brakes in {braked} of {runs} samples: the counted event is the beginning of this \
         braking, about which these samples say nothing; a scenario in which it brakes in at least 95 % is needed"
    )]
    OtherEncounter {
        /// The scenario.
        scenario: String,
        /// Samples in which the lead vehicle brakes without the system.
        braked: u64,
        /// Samples with an outcome without the system.
        runs: u64,
    },
    /// No vehicle collides in any sample.
    #[error("no sample of `{scenario}` fails with `{controller}`: no vehicle collides")]
    NoFailure {
        /// The scenario.
        scenario: String,
        /// The controller.
        controller: String,
    },
    /// No vehicle collides in any sample that has an outcome, and some have none.
    #[error("no sample of `{scenario}` that has an outcome fails with `{controller}`; {errors}")]
    NoFailureAmongOutcomes {
        /// The scenario.
        scenario: String,
        /// The controller.
        controller: String,
        /// The samples without an outcome.
        errors: Box<SampleErrors>,
    },
    /// No vehicle collides in the sample.
    #[error("sample {sample} does not fail with `{controller}`: no vehicle collides; failing samples: {failing}")]
    Passes {
        /// The sample's number.
        sample: u64,
        /// The controller.
        controller: String,
        /// Some samples that fail, in words.
        failing: String,
    },
}

impl CausesError {
    /// Returns the kind of the error.
    pub fn kind(&self) -> FailureKind {
        match self {
            Self::Saved(error) => FailureKind::from(error),
            Self::Folder(error) => FailureKind::from(error),
            Self::Map(MapError::Scenario(error)) if error.is_setting() => FailureKind::Usage,
            Self::Map(MapError::Scenario(_)) => FailureKind::InvalidInput,
            Self::Map(
                MapError::NoMis { .. } | MapError::OfGrid { .. } | MapError::Value { .. } | MapError::Sensors { .. },
            ) => FailureKind::Usage,
            Self::Map(MapError::Point { .. }) => FailureKind::Sample,
            Self::Write(_) => FailureKind::Io,
            Self::Differs(_) => FailureKind::Validity,
            Self::Scenario(error) if error.is_io() => FailureKind::Io,
            Self::Scenario(error) if error.is_setting() => FailureKind::Usage,
            Self::Scenario(_) => FailureKind::InvalidInput,
            Self::Sample { .. }
            | Self::NotRepeated { .. }
            | Self::NoOutcome { .. }
            | Self::NotReduced { .. }
            | Self::NoFailureAmongOutcomes { .. } => FailureKind::Sample,
            Self::Passes { .. }
            | Self::NoFailure { .. }
            | Self::Foreign { .. }
            | Self::OtherEncounter { .. }
            | Self::Setting(_) => FailureKind::Usage,
        }
    }
}

/// One sample of a campaign in one arm.
#[derive(Clone)]
pub struct Case {
    /// The scenario with the campaign's settings.
    pub file: ScenarioFile,
    /// How the campaign draws its samples.
    pub sampling: Sampling,
    /// The sample's number.
    pub sample: u64,
    /// The arm.
    pub arm: Arm,
    /// Values of the parameters instead of those that the campaign draws, as a search has chosen
    /// them.
    pub parameters: Option<Parameters>,
    /// An arm in which the case must not fail.
    pub reference: Option<Arm>,
}

impl std::fmt::Debug for Case {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Case").field("scenario", &self.file.config().name).field("sample", &self.sample).finish()
    }
}

impl Case {
    /// Returns a sample of a saved campaign. `scenario` may be left out if the campaign has only
    /// one, `controller` for the arm under test.
    ///
    /// # Errors
    /// [`SavedError`] if the campaign has no such scenario, sample or arm.
    pub fn of(
        saved: &SavedCampaign,
        scenario: Option<&str>,
        sample: u64,
        controller: Option<&str>,
    ) -> Result<Self, SavedError> {
        // Checks that there is such a sample.
        saved.sample(scenario, sample)?;
        let (file, sampling) = (saved.file(scenario)?, saved.manifest().sampling);
        Ok(Self { file, sampling, sample, arm: saved.arm(controller)?, parameters: None, reference: None })
    }

    /// Returns the values of the parameters of the sample.
    pub fn sampled(&self) -> Parameters {
        self.sampled_of(&self.file)
    }

    /// Returns the values of the parameters of the sample in a file with further settings.
    fn sampled_of(&self, file: &ScenarioFile) -> Parameters {
        let Sampling { design, seed, samples, .. } = self.sampling;
        let mut values = file.space().sample(design, seed, self.sample, samples);
        let chosen = self.parameters.iter().flat_map(Parameters::iter);
        for (name, value) in chosen.filter(|(name, _)| file.space().varying().any(|(varying, _)| varying == *name)) {
            values.insert(name.clone(), value.clone());
        }
        values
    }

    /// Returns the depth of the sensor simulation.
    pub fn sensors(&self) -> SensorMode {
        let of_file = || match self.concrete(&[]) {
            Ok(scenario) => scenario.sensors.mode(),
            Err(_) => SensorMode::default(),
        };
        self.arm.sensors.unwrap_or_else(of_file)
    }

    /// Returns what identifies the run.
    pub fn key(&self) -> RunKey {
        RunKey { seed: self.sampling.seed, sample: self.sample }
    }

    /// Returns the concrete scenario with further settings.
    ///
    /// # Errors
    /// [`CausesError`] if a setting does not fit, or the sampled values contradict each other.
    pub fn concrete(&self, settings: &[Setting]) -> Result<Scenario, CausesError> {
        let file = ScenarioFile::parse(self.file.path(), self.file.text(), settings)?;
        let parameters = self.sampled_of(&file);
        let scenario = file.config().check(&parameters).map_err(|source| self.failed(SampleError::Scenario(source)))?;
        Ok(self.file.with_program_folder(scenario))
    }

    /// Runs the sample with further settings.
    ///
    /// # Errors
    /// [`CausesError`] if a setting does not fit, or the sample has no outcome.
    pub fn run(&self, settings: &[Setting]) -> Result<Outcome, CausesError> {
        self.run_as(settings, &self.arm, &mut NoObserver)
    }

    /// Runs the sample with further settings in any arm.
    ///
    /// # Errors
    /// Works like [`Self::run`].
    pub fn run_as(&self, settings: &[Setting], arm: &Arm, observer: &mut dyn Observer) -> Result<Outcome, CausesError> {
        let scenario = self.concrete(settings)?;
        run_guarded(&scenario, self.key(), arm, observer).map_err(|source| self.failed(source))
    }

    fn failed(&self, source: SampleError) -> CausesError {
        CausesError::Sample { sample: self.sample, source }
    }
}

/// Checks that samples of a campaign run again as the campaign has run them.
///
/// # Errors
/// [`CausesError`] if a sample has no outcome or another one, or the journal cannot be read.
pub(crate) fn check_repeats(saved: &SavedCampaign, cases: &[Case]) -> Result<(), CausesError> {
    let outcomes: Vec<Outcome> = cases.iter().map(|case| case.run(&[])).collect::<Result<_, _>>()?;
    match saved.folder().differences(&outcomes)?.into_iter().next() {
        Some(difference) => Err(CausesError::Differs(difference)),
        None => Ok(()),
    }
}

/// Returns whether a run fails: whether any two vehicles collide.
pub fn fails(outcome: &Outcome) -> bool {
    !outcome.collisions.is_empty()
}
