//! What a campaign comes to: the counts of each scenario and of all.

use std::sync::Arc;

use closecall_simulation::Arm;

use super::ledger::{ArmCounts, Inference, Pairs};
use super::record::Record;
use super::runner::Work;
use super::validity::CheckCounts;
use super::verdict::{Evidence, Gates, Judgement};

/// The counts of one scenario, or of all.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Counts {
    /// The counts of each arm, the baseline first where the campaign is paired.
    pub arms: Vec<ArmCounts>,
    /// Pairs of baseline and tested arm.
    pub pairs: Pairs,
    /// Samples that were run.
    pub samples: u64,
    /// Samples in which a validity check made a difference where none may be.
    pub invalid: u64,
    /// What the validity checks found.
    pub checks: CheckCounts,
    /// Simulated time of all runs [s].
    pub simulated_s: f64,
}

impl Counts {
    fn new(arms: usize) -> Self {
        Self { arms: vec![ArmCounts::default(); arms], ..Self::default() }
    }

    fn push(&mut self, record: &Record) {
        let tallies = record.tallies();
        for (counts, tally) in self.arms.iter_mut().zip(&tallies) {
            counts.take(*tally);
        }
        if let [baseline, tested] = &tallies[..] {
            self.pairs.take(baseline, tested);
        }
        for arm in &record.arms {
            let Ok(outcome) = &arm.result else { continue };
            self.simulated_s += outcome.duration.s();
            if let Some(checks) = &arm.checks {
                self.checks.push(checks, outcome.ego_collided());
            }
        }
        self.samples += 1;
        self.invalid += u64::from(record.is_invalid());
    }

    fn add(&mut self, other: &Self) {
        for (sum, counts) in self.arms.iter_mut().zip(&other.arms) {
            sum.add(counts);
        }
        self.pairs.add(&other.pairs);
        self.samples += other.samples;
        self.invalid += other.invalid;
        self.checks.add(&other.checks);
        self.simulated_s += other.simulated_s;
    }

    /// Errors in any arm.
    pub fn errors(&self) -> u64 {
        self.arms.iter().map(|arm| arm.errors).sum()
    }
}

/// What a campaign comes to.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// The controllers, in the order of the arms.
    pub controllers: Vec<String>,
    /// The counts of each scenario, by name.
    pub scenarios: Vec<(String, Counts)>,
    /// What the numbers of samples came from.
    pub inference: Inference,
}

impl Summary {
    /// Returns a summary without samples. `controllers` are the names of the arms, the one under test last; `scenarios`
    /// are the names of the scenarios in the order of the plan.
    pub fn new(controllers: Vec<String>, scenarios: impl IntoIterator<Item = String>) -> Self {
        let arms = controllers.len();
        let scenarios = scenarios.into_iter().map(|name| (name, Counts::new(arms))).collect();
        Self { controllers, scenarios, inference: Inference::default() }
    }

    /// Returns a summary without samples of what is run.
    pub fn of(works: &[Arc<Work>]) -> Self {
        let name = |arm: &Arm| arm.controller.name().to_owned();
        let controllers = works.first().map_or_else(Vec::new, |work| work.arms.iter().map(name).collect());
        Self::new(controllers, works.iter().map(|work| work.file.config().name.clone()))
    }

    /// The same, where the numbers of samples come from something else.
    #[must_use]
    pub fn with_inference(self, inference: Inference) -> Self {
        Self { inference, ..self }
    }

    /// Counts a sample. A record of a scenario that is not in the plan is not counted.
    pub fn push(&mut self, record: &Record) {
        if let Some((_, counts)) = self.scenarios.iter_mut().find(|(name, _)| *name == record.scenario) {
            counts.push(record);
        }
    }

    /// Returns the counts of the arm under test in a scenario.
    pub fn tested(&self, scenario: &str) -> Option<&ArmCounts> {
        self.scenarios.iter().find(|(name, _)| name == scenario)?.1.arms.last()
    }

    /// The counts of all scenarios together.
    pub fn total(&self) -> Counts {
        let mut total = Counts::new(self.controllers.len());
        for (_, counts) in &self.scenarios {
            total.add(counts);
        }
        total
    }

    /// True where a baseline stands beside the arm under test.
    pub fn is_paired(&self) -> bool {
        self.controllers.len() == 2
    }

    /// Judges the arm under test, the last one.
    pub fn judge(&self, gates: Gates) -> Judgement {
        let total = self.total();
        let tested = total.arms.last().copied().unwrap_or_default();
        let scenarios: Vec<(&str, &ArmCounts)> = self
            .scenarios
            .iter()
            .filter_map(|(name, counts)| counts.arms.last().map(|tested| (name.as_str(), tested)))
            .collect();
        gates.judge(&Evidence {
            tested: &tested,
            scenarios: &scenarios,
            errors: total.errors(),
            checks: &total.checks,
            pairs: self.is_paired().then_some(&total.pairs),
            inference: self.inference,
        })
    }
}
