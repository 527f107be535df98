//! The plan of a frontier: the grid of settings, and its runs.

use std::ops::ControlFlow;
use std::str::FromStr;
use std::sync::Arc;

use closecall_scenarios::{ScenarioError, ScenarioFile, Setting};
use closecall_sensors::SensorMode;
use closecall_simulation::controller::ControllerChoice;
use closecall_simulation::{Arm, NoObserver, RunKey};

use super::result::{Frontier, Point};
use crate::campaign_error::WorkersError;
use crate::ledger::Tally;
use crate::runner::{concrete, guarded, run_guarded};
use crate::sampling::Sampling;
use crate::sensitivity::RunErrors;
use crate::stop::StopFlag;
use crate::workers::{UncheckedSamples, Workers};

/// The part of a key that belongs to the margin increase system, which the baseline does not have.
const OF_SYSTEM: &str = ".driver.ego-stack.mis.";

/// The settings that are varied by default, with their values: the values of the paper, and steps
/// around them. The keys are relative to the ego's margin increase system.
const DEFAULTS: [(&str, &[f64]); 4] = [
    ("max-deceleration-mps2", &[1.0, 1.5, 2.0]),
    ("engage-gap-m", &[100.0, 125.0, 150.0]),
    ("thw-gain-s", &[1.0, 2.0, 3.0]),
    ("critical-gap-m", &[5.0, 10.0]),
];

/// A key of the scenario file with the values that it takes: `KEY=a,b,c`.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// The key, as for `--set`.
    pub key: String,
    /// The values, as they are written.
    pub values: Vec<String>,
}

/// A list of values that cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{text}` is not of the form KEY=a,b,c, with a value more than once or not at all")]
pub struct GridError {
    text: String,
}

impl FromStr for Grid {
    type Err = GridError;

    fn from_str(text: &str) -> Result<Self, GridError> {
        let fail = || GridError { text: text.to_owned() };
        let (key, values) = text.split_once('=').ok_or_else(fail)?;
        let values: Vec<String> = values.split(',').map(|value| value.trim().to_owned()).collect();
        let is_twice = values.iter().enumerate().any(|(index, value)| values[..index].contains(value));
        if key.trim().is_empty() || values.iter().any(String::is_empty) || is_twice {
            return Err(fail());
        }
        Ok(Self { key: key.trim().to_owned(), values })
    }
}

/// Everything that determines a frontier.
#[derive(Clone, Debug)]
pub struct FrontierPlan {
    /// The scenario without the settings of the grid.
    pub file: ScenarioFile,
    /// The keys that are varied.
    pub grid: Vec<Grid>,
    /// How the samples are drawn.
    pub sampling: Sampling,
    /// The controllers: the baseline first, the one under test last.
    pub controllers: Vec<ControllerChoice>,
    /// The sensors; `None` for the sensors of the scenario.
    pub sensors: Option<SensorMode>,
    /// The number of worker threads, and the time limit of a run.
    pub workers: Workers,
}

impl FrontierPlan {
    /// Returns the grid for the ego of a scenario if no key is named.
    pub fn default_grid(file: &ScenarioFile) -> Vec<Grid> {
        let ego = file.ego_id().map_or("ego", |ego| ego.as_str());
        let grid = |(key, values): &(&str, &[f64])| Grid {
            key: format!("actor.{ego}{OF_SYSTEM}{key}"),
            values: values.iter().map(|value| format!("{value:?}")).collect(),
        };
        DEFAULTS.iter().map(grid).collect()
    }

    /// Returns every combination of the values, the last key changing fastest, with the scenario
    /// that it gives.
    ///
    /// # Errors
    /// [`ScenarioError`] if a value cannot be set, or does not give a valid scenario.
    fn combinations(&self) -> Result<Vec<(Vec<String>, ScenarioFile)>, ScenarioError> {
        let mut all: Vec<Vec<String>> = vec![Vec::new()];
        for grid in &self.grid {
            let with = |values: &Vec<String>| {
                grid.values.iter().map(|value| [&values[..], std::slice::from_ref(value)].concat()).collect::<Vec<_>>()
            };
            all = all.iter().flat_map(with).collect();
        }
        all.into_iter().map(|values| Ok((values.clone(), self.at(&values)?))).collect()
    }

    fn at(&self, values: &[String]) -> Result<ScenarioFile, ScenarioError> {
        let settings = self.grid.iter().zip(values).map(|(grid, value)| {
            let setting: Result<Setting, _> = format!("{}={value}", grid.key).parse();
            setting.map_err(|source| ScenarioError::Set { path: self.file.path().to_owned(), source })
        });
        let settings = settings.collect::<Result<Vec<_>, _>>()?;
        let file = ScenarioFile::parse(self.file.path(), self.file.text(), &settings)?;
        file.check()?;
        if let Some(mode) = self.sensors {
            file.check_faults_in(mode)?;
        }
        Ok(file)
    }

    /// Returns true if no key of the grid can change the baseline.
    fn shares_baseline(&self) -> bool {
        self.controllers.first() == Some(&ControllerChoice::ACC)
            && self.grid.iter().all(|grid| grid.key.contains(OF_SYSTEM))
    }

    /// Returns the runs, checked and ready.
    ///
    /// # Errors
    /// [`ScenarioError`] if a value cannot be set, or does not give a valid scenario.
    pub fn prepare(&self) -> Result<PreparedFrontier<'_>, ScenarioError> {
        Ok(PreparedFrontier { plan: self, combinations: self.combinations()? })
    }
}

/// A frontier whose combinations have been checked.
#[derive(Debug)]
pub struct PreparedFrontier<'a> {
    plan: &'a FrontierPlan,
    combinations: Vec<(Vec<String>, ScenarioFile)>,
}

impl PreparedFrontier<'_> {
    /// Returns the number of runs.
    pub fn runs(&self) -> u64 {
        let baselines = if self.plan.shares_baseline() { 1 } else { self.combinations.len() };
        (self.combinations.len() + baselines) as u64 * self.plan.sampling.samples
    }

    /// Runs every combination. `None` if `stop` has ended it early. `on_run` is called after each
    /// run.
    ///
    /// # Errors
    /// [`WorkersError`] if no threads can be started.
    pub fn run(&self, stop: &StopFlag, on_run: &mut dyn FnMut()) -> Result<Option<Frontier>, WorkersError> {
        let plan = self.plan;
        let mut errors = RunErrors::default();
        let mut shared = None;
        let mut points = Vec::new();
        for (values, file) in &self.combinations {
            let baseline = match shared.clone() {
                Some(baseline) => baseline,
                None => match self.arm(file, self.plan.controllers.first(), stop, &mut errors, on_run)? {
                    Some(baseline) => Arc::new(baseline),
                    None => return Ok(None),
                },
            };
            if plan.shares_baseline() {
                shared = Some(baseline.clone());
            }
            let Some(tested) = self.arm(file, self.plan.controllers.last(), stop, &mut errors, on_run)? else {
                return Ok(None);
            };
            points.push(Point::new(values.clone(), &baseline, &tested));
        }
        Ok(Some(Frontier::new(plan, points, errors)))
    }

    /// Runs all samples in one arm. `None` if `stop` has ended the runs early.
    fn arm(
        &self,
        file: &ScenarioFile,
        controller: Option<&ControllerChoice>,
        stop: &StopFlag,
        errors: &mut RunErrors,
        on_run: &mut dyn FnMut(),
    ) -> Result<Option<Vec<Tally>>, WorkersError> {
        let plan = self.plan;
        let arm = |controller: &ControllerChoice| Arm { controller: controller.factory(), sensors: plan.sensors };
        let arms = controller.map(arm).into_iter().collect();
        let (owned_file, sampling) = (file.clone(), plan.sampling);
        let work = Arc::new(UncheckedSamples::new(file, arms, move |sample: u64, arm: &Arm| {
            let scenario = guarded(|| concrete(&owned_file, sampling, sample))?;
            Ok(run_guarded(&scenario, RunKey { seed: sampling.seed, sample }, arm, &mut NoObserver)?)
        }));
        let count = file.space().samples(plan.sampling.design, plan.sampling.samples);
        let mut tallies = Vec::new();
        plan.workers.run_samples(&work, 0..count, stop, |finished| {
            for arm in &finished.record.arms {
                tallies.push(arm.tally());
                if let Err(failure) = &arm.result {
                    errors.points += 1;
                    errors.add_failure(failure);
                }
            }
            on_run();
            Ok::<_, WorkersError>(ControlFlow::Continue(()))
        })?;
        Ok((tallies.len() as u64 == count).then_some(tallies))
    }
}

#[cfg(test)]
mod tests {
    use closecall_scenarios::library;

    use super::*;

    #[test]
    fn a_grid_is_parsed() {
        let grid: Grid = "brake-mps2 = 4, 6,8".parse().unwrap();
        assert_eq!((grid.key.as_str(), grid.values), ("brake-mps2", ["4", "6", "8"].map(str::to_owned).to_vec()));
        for wrong in ["", "a", "=1", "a=", "a=1,,2", "a=1,1"] {
            assert!(wrong.parse::<Grid>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn the_default_grid_fits_the_library() {
        let name = "low-thw-overtake";
        let file = ScenarioFile::parse(&library::path(name), library::text(name).unwrap(), &[]).unwrap();
        let grid = FrontierPlan::default_grid(&file);
        let plan = FrontierPlan {
            file,
            grid,
            sampling: Sampling { seed: 0, design: Default::default(), samples: 10 },
            controllers: vec![ControllerChoice::ACC, ControllerChoice::MIS],
            sensors: None,
            workers: Workers::default(),
        };
        let prepared = plan.prepare().unwrap();
        assert_eq!(prepared.combinations.len(), 54);
        assert_eq!(prepared.runs(), 55 * 10, "the baseline runs once");
    }
}
