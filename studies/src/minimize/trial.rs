//! Runs of a sample with other parameter values.

use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use closecall_campaign::runner::run_guarded;
use closecall_scenarios::outcome::Outcome;
use closecall_scenarios::{Scenario, Setting, SettingError};
use closecall_simulation::{Arm, NoObserver, SampleError};
use closecall_traffic::{ParameterName, Parameters, Value};
use serde::Serialize;

use super::grid;
use crate::case::{Case, fails};

/// Runs of a search that had no outcome. The search takes them for runs that do not fail.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct WithoutOutcome {
    /// Number of runs.
    pub runs: u64,
    /// The message that is first in the order of the alphabet, whichever run ended first.
    pub message: String,
}

impl WithoutOutcome {
    /// Returns the runs of two searches together.
    pub(super) fn joined(one: Option<Self>, other: Option<Self>) -> Option<Self> {
        match (one, other) {
            (Some(one), Some(other)) => {
                Some(Self { runs: one.runs + other.runs, message: one.message.min(other.message) })
            }
            (one, other) => one.or(other),
        }
    }
}

/// A sample whose parameters can be moved to their nominal values.
pub(super) struct Trial<'a> {
    pub(super) case: &'a Case,
    /// The values of the sample.
    pub(super) sampled: Parameters,
    /// The nominal values.
    pub(super) nominal: Parameters,
    /// The parameters whose two values differ, in the order of their names.
    pub(super) differing: Vec<ParameterName>,
    /// Whether a case must have the same result at half the time step, too. False if the sample
    /// itself has not.
    is_robust: bool,
    /// Results so far, by the values of the parameters.
    results: Mutex<BTreeMap<String, bool>>,
    /// Number of runs so far.
    runs: AtomicU64,
    /// The runs without an outcome so far.
    without_outcome: Mutex<Option<WithoutOutcome>>,
}

impl<'a> Trial<'a> {
    /// Creates the trials of a case.
    pub(super) fn new(case: &'a Case) -> Self {
        let (sampled, nominal) = (case.sampled(), case.file.space().nominal());
        let differing = sampled.iter().filter(|(name, value)| nominal.get(name) != Some(value));
        let differing = differing.map(|(name, _)| name.clone()).collect();
        let (results, runs, without_outcome) = (Mutex::default(), AtomicU64::default(), Mutex::default());
        let trial = Self { case, sampled, nominal, differing, is_robust: true, results, runs, without_outcome };
        let is_robust = trial.fails(&trial.sampled);
        Self { is_robust, results: Mutex::default(), ..trial }
    }

    /// Returns the number of runs so far, the runs at half the time step among them.
    pub(super) fn runs(&self) -> u64 {
        self.runs.load(Ordering::Relaxed)
    }

    /// Returns the runs without an outcome so far; `None` if there are none.
    pub(super) fn without_outcome(&self) -> Option<WithoutOutcome> {
        self.without_outcome.lock().ok().and_then(|without| without.clone())
    }

    /// Counts a run without an outcome.
    fn note(&self, error: &SampleError) {
        if let Ok(mut without) = self.without_outcome.lock() {
            let more = WithoutOutcome { runs: 1, message: error.to_string() };
            *without = WithoutOutcome::joined(without.take(), Some(more));
        }
    }

    /// Returns the nominal values with the named parameters at the values of the sample.
    pub(super) fn with(&self, names: &[ParameterName]) -> Parameters {
        let mut parameters = self.nominal.clone();
        for name in names {
            if let Some(value) = self.sampled.get(name) {
                parameters.insert(name.clone(), value.clone());
            }
        }
        parameters
    }

    /// Returns whether a case fails. A case that is no valid scenario, or has no outcome, does not.
    pub(super) fn fails(&self, parameters: &Parameters) -> bool {
        let key = parameters.iter().map(|(name, value)| format!("{name}={value:?};")).collect::<String>();
        if let Some(result) = self.results.lock().ok().and_then(|results| results.get(&key).copied()) {
            return result;
        }
        let does_fail = self.case.file.concrete(parameters).is_ok_and(|scenario| self.is_failed(&scenario));
        if let Ok(mut results) = self.results.lock() {
            results.insert(key, does_fail);
        }
        does_fail
    }

    /// Returns whether a case is a valid scenario in which no vehicle collides.
    pub(super) fn passes(&self, parameters: &Parameters) -> bool {
        self.case.file.concrete(parameters).is_ok_and(|scenario| self.is_passed(&scenario))
    }

    /// Returns whether vehicles collide in a scenario, and none in the arm that must not fail.
    fn is_failed(&self, scenario: &Scenario) -> bool {
        let passes_in = |arm: &Arm| self.holds_in(scenario, arm, |outcome| !fails(outcome));
        self.holds_in(scenario, &self.case.arm, fails) && self.case.reference.as_ref().is_none_or(passes_in)
    }

    /// Returns whether no vehicle collides in a scenario.
    pub(super) fn is_passed(&self, scenario: &Scenario) -> bool {
        self.holds_in(scenario, &self.case.arm, |outcome| !fails(outcome))
    }

    /// Returns whether a condition holds for the outcome of a scenario in an arm, at the time step
    /// and at half of it.
    fn holds_in(&self, scenario: &Scenario, arm: &Arm, holds: impl Fn(&Outcome) -> bool) -> bool {
        let run = |scenario: &Scenario| {
            self.runs.fetch_add(1, Ordering::Relaxed);
            run_guarded(scenario, self.case.key(), arm, &mut NoObserver)
        };
        let has = |scenario: &Scenario| match run(scenario) {
            Ok(outcome) => holds(&outcome),
            Err(error) => {
                self.note(&error);
                false
            }
        };
        has(scenario) && (!self.is_robust || has(&scenario.at_half_step()))
    }

    /// Returns the width of the middle 95 % of a parameter's distribution; `None` for a choice.
    pub(super) fn span(&self, name: &ParameterName) -> Option<f64> {
        let distribution = &self.case.file.space().get(name)?.distribution;
        match [0.025, 0.975].map(|u| distribution.quantile(u)) {
            [Value::Number(low), Value::Number(high)] if high > low => Some(high - low),
            _ => None,
        }
    }

    /// Returns the step of the grid of a parameter's readable values; `None` for a choice.
    pub(super) fn step(&self, name: &ParameterName) -> Option<f64> {
        self.span(name).map(grid::step)
    }

    /// Returns the settings that fix all parameters, in the order of their names.
    ///
    /// # Errors
    /// [`SettingError`] if a value cannot be written as a setting.
    pub(super) fn settings(parameters: &Parameters) -> Result<Vec<Setting>, SettingError> {
        parameters.iter().map(|(name, value)| format!("{name}={value}").parse()).collect()
    }
}
