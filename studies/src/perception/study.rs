//! Runs all approaches of all cases.

use std::sync::atomic::{AtomicU64, Ordering};

use closecall_campaign::failure::FailureKind;
use closecall_scenarios::{ScenarioError, ScenarioFile};
use closecall_sensors::{SensorError, SensorMode, Sensors};
use closecall_traffic::Road;
use rayon::prelude::*;

use crate::perception::approach::{Address, Approach, approach};
use crate::perception::cases::{Case, cases};
use crate::perception::figures::Figures;

/// The number of approaches of each case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// Few: within a minute on two cores.
    Quick,
    /// Many approaches: within a quarter of an hour on two cores.
    Full,
    /// This many.
    Runs(u64),
}

impl Extent {
    /// Returns the number of approaches of each case.
    pub const fn runs(self) -> u64 {
        match self {
            Self::Quick => 8,
            Self::Full => 120,
            Self::Runs(runs) => runs,
        }
    }
}

/// The reason for which a study cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// The scenario with the sensors cannot be used.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// The sensors have no error: there is nothing to study.
    #[error("failed to study the sensors: sensors of mode `ground-truth` have no errors; choose `full` or `object`")]
    GroundTruth,
    /// A run of a sample fails.
    #[error("failed to compare the sensors: sample {sample}: {message}")]
    Run {
        /// The sample.
        sample: u64,
        /// Why.
        message: String,
    },
    /// A sensor model fails.
    #[error("failed to study the sensors: {case}, approach {run}: {source}")]
    Sensor {
        /// The case.
        case: String,
        /// The number of the approach.
        run: u64,
        /// The sensor's error.
        source: SensorError,
    },
}

impl StudyError {
    /// Returns the kind of the error, and so the exit code of a program.
    pub fn kind(&self) -> FailureKind {
        match self {
            Self::Scenario(error) => error.into(),
            Self::GroundTruth => FailureKind::Usage,
            Self::Sensor { .. } | Self::Run { .. } => FailureKind::Sample,
        }
    }
}

/// The figures of all cases for one set of sensors.
#[derive(Clone, Debug, PartialEq)]
pub struct Study {
    /// The name of the scenario that the sensors come from.
    pub name: String,
    /// The depth of the sensor simulation.
    pub mode: SensorMode,
    /// The seed.
    pub seed: u64,
    /// Number of approaches of each case.
    pub runs: u64,
    /// Each case with its figures.
    pub cases: Vec<(Case, Figures)>,
}

impl Study {
    /// Studies the sensors of a scenario at the nominal values of its parameters, in its light and
    /// weather and on its road. `mode` replaces the mode of the scenario.
    ///
    /// The result does not depend on the number of threads.
    ///
    /// # Errors
    /// [`StudyError`] if the scenario cannot be used, or a sensor model fails.
    pub fn of(file: &ScenarioFile, mode: Option<SensorMode>, seed: u64, extent: Extent) -> Result<Self, StudyError> {
        Self::watched(file, mode, seed, extent, &|_| ())
    }

    /// Works like [`Self::of`]. `on_progress` receives the number of finished approaches and the number of
    /// all approaches.
    ///
    /// # Errors
    /// The errors of [`Self::of`].
    pub fn watched(
        file: &ScenarioFile,
        mode: Option<SensorMode>,
        seed: u64,
        extent: Extent,
        on_progress: &(dyn Fn([u64; 2]) + Sync),
    ) -> Result<Self, StudyError> {
        let scenario = file.concrete(&file.space().nominal())?;
        let sensors = mode.map_or(scenario.sensors, |mode| scenario.sensors.with_mode(mode));
        if sensors.mode() == SensorMode::GroundTruth {
            return Err(StudyError::GroundTruth);
        }
        let cases = cases(sensors.mode(), &scenario.environment, &scenario.road)?;
        let batch = Batch { seed, runs: extent.runs() };
        let cases = study(&cases, &sensors, &scenario.road, batch, on_progress)?;
        let name = file.config().name.clone();
        Ok(Self { name, mode: sensors.mode(), seed, runs: extent.runs(), cases })
    }
}

/// The approaches of each case.
#[derive(Clone, Copy)]
struct Batch {
    seed: u64,
    /// Number of approaches.
    runs: u64,
}

/// Runs all approaches of the cases in parallel. The results are in the order of their numbers.
fn study(
    cases: &[Case],
    sensors: &Sensors,
    road: &Road,
    Batch { seed, runs }: Batch,
    on_progress: &(dyn Fn([u64; 2]) + Sync),
) -> Result<Vec<(Case, Figures)>, StudyError> {
    let jobs: Vec<(usize, u64)> = (0..cases.len()).flat_map(|case| (0..runs).map(move |run| (case, run))).collect();
    let (all, done) = (jobs.len() as u64, AtomicU64::new(0));
    let run_one = |&(case, run): &(usize, u64)| {
        let case = &cases[case];
        let made = approach(case, &case.sensors(sensors), &case.road(road), Address { seed, run })
            .map_err(|source| StudyError::Sensor { case: case.name.clone(), run, source });
        on_progress([done.fetch_add(1, Ordering::Relaxed) + 1, all]);
        made
    };
    let approaches: Vec<Approach> = jobs.par_iter().map(run_one).collect::<Result<_, _>>()?;
    let of_case = approaches.chunks(usize::try_from(runs.max(1)).unwrap_or(usize::MAX));
    Ok(cases.iter().cloned().zip(of_case.map(Figures::of)).collect())
}
