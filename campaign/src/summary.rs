//! The counts of a campaign: of each scenario, and of all together.

use std::sync::Arc;

use closecall_scenarios::promise::{Goal, Hindrance};
use closecall_simulation::Arm;

use super::arm_pairs::ArmPair;
use super::attribution::Attribution;
use super::failures::{FailureKindCount, Failures};
use super::ledger::{ArmCounts, Inference, PairFate, Pairs, Tally};
use super::record::Record;
use super::repeats::Repeats;
use super::runner::Work;
use super::validity::{CheckCounts, RunOfScenario};

/// The counts of one scenario, or of all.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Counts {
    /// The counts of each arm, the baseline first if the campaign is paired.
    pub arms: Vec<ArmCounts>,
    /// Pairs of baseline and tested arm: the first and the last one.
    pub pairs: Pairs,
    /// Why the tested arm did not prevent the collision in the samples of [`Pairs::both`], the most
    /// frequent reason first.
    pub not_prevented: Vec<(Hindrance, u64)>,
    /// What became of the goal in the tested arm, the most frequent case first.
    pub goals: Vec<(Goal, u64)>,
    /// All pairs of arms.
    pub arm_pairs: Vec<ArmPair>,
    /// Samples that were run.
    pub samples: u64,
    /// Samples in which a validity check made a difference that it must not make.
    pub invalid: u64,
    /// The findings of the validity checks.
    pub checks: CheckCounts,
    /// The runs of the arm under test in which nobody comes from behind.
    pub attribution: Attribution,
    /// Simulated time of all runs (s).
    pub simulated_s: f64,
    /// Samples that repeat the parameters or the outcome of an earlier one. They count in
    /// `invalid`, `checks` and `simulated_s` only.
    pub repeated: u64,
    /// Why samples have no outcome. The total of all scenarios has none: a sample is one of a
    /// scenario.
    pub failures: Failures,
}

impl Counts {
    fn new(arms: usize) -> Self {
        Self { arms: vec![ArmCounts::default(); arms], arm_pairs: ArmPair::all(arms), ..Self::default() }
    }

    fn push(&mut self, record: &Record, is_repeated: bool) {
        if is_repeated {
            self.repeated += 1;
        } else {
            let tallies = record.tallies();
            for (counts, tally) in self.arms.iter_mut().zip(&tallies) {
                counts.push(*tally);
            }
            if let [baseline, .., tested] = &tallies[..] {
                self.pairs.push(baseline, tested);
            }
            self.arm_pairs.iter_mut().for_each(|pair| pair.push(&tallies));
            self.push_reasons(record, &tallies);
            self.failures.push(record);
            self.samples += 1;
        }
        for (index, arm) in record.arms.iter().enumerate() {
            let Ok(outcome) = &arm.result else { continue };
            self.simulated_s += outcome.duration.s();
            if let Some(checks) = &arm.checks {
                let run = RunOfScenario { sample: record.sample, arm: index };
                self.checks.push(run, checks, outcome.ego_collided());
                if let Some(counts) = self.arms.get_mut(index) {
                    counts.checked += u64::from(checks.not_checked.is_none());
                    counts.not_checked += u64::from(checks.not_checked.is_some());
                }
            }
        }
        if let [before @ .., tested] = &record.arms[..]
            && let Some(run) = tested.nobody_behind
        {
            self.attribution.push(run, before.first().and_then(|baseline| baseline.nobody_behind));
        }
        self.invalid += u64::from(record.is_invalid());
    }

    fn push_reasons(&mut self, record: &Record, tallies: &[Tally]) {
        let Some(Ok(outcome)) = record.arms.last().map(|arm| arm.result.as_ref()) else { return };
        if outcome.mis.is_ok()
            && let Some(goal) = Goal::of(outcome)
        {
            count(&mut self.goals, goal, 1);
        }
        if let [baseline, .., tested] = tallies
            && PairFate::of(baseline, tested) == Some(PairFate::Both)
            && let Some(hindrance) = Hindrance::of(outcome)
        {
            count(&mut self.not_prevented, hindrance, 1);
        }
    }

    fn add(&mut self, other: &Self) {
        other.not_prevented.iter().for_each(|(hindrance, times)| count(&mut self.not_prevented, *hindrance, *times));
        other.goals.iter().for_each(|(goal, times)| count(&mut self.goals, *goal, *times));
        for (sum, counts) in self.arms.iter_mut().zip(&other.arms) {
            sum.add(counts);
        }
        self.pairs.add(&other.pairs);
        for (sum, pair) in self.arm_pairs.iter_mut().zip(&other.arm_pairs) {
            sum.pairs.add(&pair.pairs);
        }
        self.samples += other.samples;
        self.invalid += other.invalid;
        self.checks.add(&other.checks);
        self.attribution.add(&other.attribution);
        self.simulated_s += other.simulated_s;
        self.repeated += other.repeated;
    }

    /// Returns the number of samples, in any arm, that have an outcome only because they were run
    /// again.
    pub fn flaky(&self) -> u64 {
        self.arms.iter().map(|arm| arm.flaky).sum()
    }

    /// Returns the number of errors, in any arm.
    pub fn errors(&self) -> u64 {
        self.arms.iter().map(|arm| arm.errors).sum()
    }
}

/// Adds to a tally, whose most frequent entry stays the first. Equally frequent ones are in the
/// order in which they came.
fn count<T: PartialEq>(tally: &mut Vec<(T, u64)>, entry: T, times: u64) {
    match tally.iter_mut().find(|(other, _)| *other == entry) {
        Some((_, sum)) => *sum += times,
        None => tally.push((entry, times)),
    }
    tally.sort_by_key(|(_, times)| std::cmp::Reverse(*times));
}

/// The counts of a campaign.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// The controllers, in the order of the arms.
    pub controllers: Vec<String>,
    /// The counts of each scenario, by name.
    pub scenarios: Vec<(String, Counts)>,
    /// The rule that determines the numbers of samples.
    pub inference: Inference,
    /// True if the validity checks were switched off.
    pub is_unchecked: bool,
    /// Whether the controller of each arm is one of this program.
    are_built_in: Vec<bool>,
    /// The samples of each scenario that are new evidence.
    repeats: Vec<Repeats>,
}

impl Summary {
    /// Returns a summary without samples. `controllers` are the names of the arms, the one under
    /// test last; `scenarios` are the names of the scenarios in the order of the plan.
    pub fn new(controllers: Vec<String>, scenarios: impl IntoIterator<Item = String>) -> Self {
        let arms = controllers.len();
        let scenarios: Vec<_> = scenarios.into_iter().map(|name| (name, Counts::new(arms))).collect();
        let repeats = vec![Repeats::default(); scenarios.len()];
        let are_built_in = vec![true; arms];
        Self { controllers, scenarios, inference: Inference::default(), is_unchecked: false, are_built_in, repeats }
    }

    /// Returns a summary without samples of these scenarios.
    pub fn of(works: &[Arc<Work>]) -> Self {
        let name = |arm: &Arm| arm.controller.name().to_owned();
        let controllers = works.first().map_or_else(Vec::new, |work| work.arms.iter().map(name).collect());
        let mut summary = Self::new(controllers, works.iter().map(|work| work.file.config().name.clone()));
        summary.is_unchecked = works.iter().any(|work| work.checks.is_off());
        if let Some(work) = works.first() {
            summary.are_built_in = work.arms.iter().map(|arm| arm.controller.is_built_in()).collect();
        }
        summary.repeats = works.iter().map(|work| Repeats::of(work.file.space())).collect();
        summary
    }

    /// Returns the same summary for another rule that determines the numbers of samples.
    #[must_use]
    pub fn with_inference(self, inference: Inference) -> Self {
        Self { inference, ..self }
    }

    /// Counts a sample. A record of a scenario that is not in the plan is not counted.
    pub fn push(&mut self, record: &Record) {
        let mut scenarios = self.scenarios.iter_mut().zip(&mut self.repeats);
        if let Some(((_, counts), repeats)) = scenarios.find(|((name, _), _)| *name == record.scenario) {
            counts.push(record, !repeats.counts(record));
        }
    }

    /// Returns the counts of the arm under test in a scenario.
    pub fn tested(&self, scenario: &str) -> Option<&ArmCounts> {
        self.scenarios.iter().find(|(name, _)| name == scenario)?.1.arms.last()
    }

    /// Returns the counts of all scenarios together. They are sums: scenarios are never pooled into
    /// one sample.
    pub fn total(&self) -> Counts {
        let mut total = Counts::new(self.controllers.len());
        for (_, counts) in &self.scenarios {
            total.add(counts);
        }
        total
    }

    /// Returns why samples have no outcome: the kinds of failure of each scenario, by its name.
    pub fn failures(&self) -> impl Iterator<Item = (&str, &FailureKindCount)> {
        self.scenarios.iter().flat_map(|(name, counts)| counts.failures.iter().map(move |kind| (name.as_str(), kind)))
    }

    /// Returns the kinds of failure as JSON, each with the name of its scenario.
    pub fn failures_json(&self) -> serde_json::Value {
        let to_json = |(scenario, failure): (&str, &FailureKindCount)| {
            let mut object = serde_json::json!(failure);
            object["scenario"] = serde_json::json!(scenario);
            object
        };
        self.failures().map(to_json).collect()
    }

    /// Returns the name of an arm's controller if it is none of this program.
    pub(crate) fn foreign_controller(&self, arm: usize) -> Option<&str> {
        let is_built_in = self.are_built_in.get(arm).copied().unwrap_or(true);
        self.controllers.get(arm).map(String::as_str).filter(|_| !is_built_in)
    }

    /// Returns true if a baseline stands beside the arm under test.
    pub fn is_paired(&self) -> bool {
        self.controllers.len() > 1
    }

    /// Returns true if reference arms stand between the baseline and the arm under test.
    pub fn has_references(&self) -> bool {
        self.controllers.len() > 2
    }

    /// Returns the mean over the scenarios of an arm's collision rate, each scenario with the same
    /// weight; `None` if a scenario has no outcome.
    pub fn mean_collision_rate(&self, arm: usize) -> Option<f64> {
        let rates: Option<Vec<f64>> =
            self.scenarios.iter().map(|(_, counts)| counts.arms.get(arm)?.collision_rate()).collect();
        rates.filter(|rates| !rates.is_empty()).map(|rates| rates.iter().sum::<f64>() / rates.len() as f64)
    }
}
