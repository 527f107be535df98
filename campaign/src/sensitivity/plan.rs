//! The plan of a study: its factors, arms and numbers of runs.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;
use std::sync::Arc;

use closecall_scenarios::parameters::Provenance;
use closecall_scenarios::{ScenarioError, ScenarioFile, SettingError};
use closecall_sensors::SensorMode;
use closecall_simulation::Arm;
use closecall_simulation::controller::ControllerChoice;
use closecall_traffic::statistics::sensitivity::jackknife::REPLICATES;
use closecall_traffic::statistics::sensitivity::saltelli::MAX_FACTORS;

use super::defaults::{LeftOut, factors_of};
use super::factor::{CHANCE, Factor, FactorKind, FactorRange};
use super::runs::Cube;
use crate::campaign_error::WorkersError;
use crate::workers::Workers;

/// The stages of a study.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Screening of all factors, then decomposition of the output's variance by those that matter.
    #[default]
    Both,
    /// Screening alone.
    Morris,
    /// Decomposition by all factors.
    Sobol,
}

impl FromStr for Method {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        match word {
            "both" => Ok(Self::Both),
            "morris" => Ok(Self::Morris),
            "sobol" => Ok(Self::Sobol),
            _ => Err(format!("`{word}` is not a method: one of `morris`, `sobol`, `both` is needed")),
        }
    }
}

/// Everything that determines a study.
#[derive(Clone)]
pub struct SensitivityPlan {
    /// The stages.
    pub method: Method,
    /// Number of trajectories of the screening.
    pub trajectories: usize,
    /// Number of rows of the decomposition.
    pub rows: usize,
    /// Number of factors that the decomposition keeps apart after a screening, besides chance.
    pub top: usize,
    /// The seed of designs and runs.
    pub seed: u64,
    /// The number of worker threads, and the time limit of a run.
    pub workers: Workers,
    pub(super) cube: Arc<Cube>,
    pub(super) factors: Vec<Factor>,
    pub(super) left_out: Vec<LeftOut>,
    pub(super) arms: Vec<Arm>,
    pub(super) settings: Vec<String>,
}

/// A study that cannot be planned or run.
#[derive(Debug, thiserror::Error)]
pub enum PlanFailure {
    /// A fault of the scenario cannot act in the mode of the sensors.
    #[error(transparent)]
    Fault(Box<ScenarioError>),
    /// The end of a range does not give a valid scenario.
    #[error("the factor {range} cannot be used: {source}")]
    Range {
        /// The factor.
        range: String,
        /// What is wrong at one of its ends.
        source: Box<ScenarioError>,
    },
    /// The key of a factor is not a path of keys.
    #[error("the factor {range} cannot be used: {source}")]
    Key {
        /// The factor.
        range: String,
        /// What is wrong.
        source: SettingError,
    },
    /// A key is given with two ranges.
    #[error("the factor {key} is given twice")]
    Twice {
        /// The key.
        key: String,
    },
    /// There is nothing to vary.
    #[error("{} has no parameter that varies, and no factor is given: there is nothing to study", path.display())]
    NoFactor {
        /// The scenario.
        path: PathBuf,
    },
    /// There are more factors than the sequence has dimensions for.
    #[error("{factors} factors are given, but at most {MAX_FACTORS} can be studied at once")]
    TooMany {
        /// The number of factors.
        factors: usize,
    },
    /// The worker threads could not be started.
    #[error(transparent)]
    Workers(#[from] WorkersError),
}

impl fmt::Debug for SensitivityPlan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SensitivityPlan")
            .field("factors", &self.factors)
            .field("seed", &self.seed)
            .finish_non_exhaustive()
    }
}

impl SensitivityPlan {
    /// Returns the plan of a study of `file`. The factors are the varying parameters, the `named`
    /// keys, the list for driver, sensor and controller if `with_defaults`, and chance. The last
    /// controller is the one under test; one before it is the baseline.
    ///
    /// # Errors
    /// [`PlanFailure`] if a factor cannot be used, or there is none.
    pub fn new(
        file: &ScenarioFile,
        controllers: &[ControllerChoice],
        sensors: Option<SensorMode>,
        named: Vec<FactorRange>,
        with_defaults: bool,
    ) -> Result<Self, PlanFailure> {
        if let Some(mode) = sensors {
            file.check_faults_in(mode).map_err(|error| PlanFailure::Fault(Box::new(error)))?;
        }
        let (mut ranges, left_out) = if with_defaults { factors_of(file, &named) } else { (Vec::new(), Vec::new()) };
        ranges.extend(named);
        for (index, range) in ranges.iter().enumerate() {
            if ranges[..index].iter().any(|earlier| earlier.key == range.key) {
                return Err(PlanFailure::Twice { key: range.key.clone() });
            }
            for end in [0.0, 1.0] {
                at(file, &[range], end)?.check().map_err(|source| range_failure(range, source))?;
            }
        }
        let middle = at(file, &ranges.iter().collect::<Vec<_>>(), 0.5)?;
        let mut factors: Vec<Factor> = middle
            .space()
            .varying()
            .map(|(name, entry)| Factor {
                name: name.as_str().to_owned(),
                kind: FactorKind::Scenario,
                range: entry.distribution.bounds(),
                source: match &entry.provenance {
                    Provenance::Fitted(fitted) => format!("fitted to {} observations of {}", fitted.n, fitted.source),
                    Provenance::Assumed(why) => format!("assumed: {why}"),
                    Provenance::Unstated => "not stated in the scenario".to_owned(),
                },
            })
            .chain(ranges.iter().map(FactorRange::factor))
            .collect();
        if factors.is_empty() {
            return Err(PlanFailure::NoFactor { path: file.path().to_owned() });
        }
        let source = "the random numbers of weaving, speeds, sensors and lapses".to_owned();
        factors.push(Factor { name: CHANCE.to_owned(), kind: FactorKind::Chance, range: None, source });
        if factors.len() > MAX_FACTORS {
            return Err(PlanFailure::TooMany { factors: factors.len() });
        }
        let settings = file.settings().iter().map(ToString::to_string).collect();
        Ok(Self {
            method: Method::default(),
            trajectories: 40,
            rows: 512,
            top: 8,
            seed: 0,
            workers: Workers::default(),
            cube: Arc::new(Cube { file: middle, text: file.text().to_owned(), ranges, seed: 0 }),
            factors,
            left_out,
            arms: controllers.iter().map(|choice| Arm { controller: choice.factory(), sensors }).collect(),
            settings,
        })
    }

    /// Returns the number of points of the stages that are planned.
    pub fn points(&self) -> usize {
        let screening = self.trajectories * (self.factors.len() + 1);
        let rows = self.rows.div_ceil(REPLICATES) * REPLICATES;
        match self.method {
            Method::Morris => screening,
            Method::Sobol => rows * (self.factors.len() + 2),
            Method::Both => screening + rows * (self.groups_after_screening() + 2),
        }
    }

    /// Returns the number of groups of a decomposition that follows a screening: the factors that
    /// are kept, chance, and the rest.
    fn groups_after_screening(&self) -> usize {
        let factors = self.factors.len() - 1;
        if factors > self.top { self.top + 2 } else { factors + 1 }
    }
}

/// Returns the file with ranges at a coordinate.
fn at(file: &ScenarioFile, ranges: &[&FactorRange], u: f64) -> Result<ScenarioFile, PlanFailure> {
    let setting =
        |range: &&FactorRange| range.at(u).map_err(|source| PlanFailure::Key { range: range.to_string(), source });
    let settings = ranges.iter().map(setting).collect::<Result<Vec<_>, _>>()?;
    ScenarioFile::parse(file.path(), file.text(), &settings).map_err(|source| match ranges {
        [range] => range_failure(range, source),
        _ => PlanFailure::Range { range: "together".to_owned(), source: Box::new(source) },
    })
}

fn range_failure(range: &FactorRange, source: ScenarioError) -> PlanFailure {
    PlanFailure::Range { range: range.to_string(), source: Box::new(source) }
}
