//! What the samples of a scenario cover.

use std::sync::Arc;

use closecall_scenarios::Scenario;
use closecall_scenarios::coverage::{CoverageName, Surroundings};
use closecall_scenarios::sampling::Design;
use serde::Serialize;

use crate::record::Record;
use crate::runner::Work;

/// Counts the samples in the bins of a scenario's coverage items and crosses.
#[derive(Clone, Debug)]
pub struct CoverageCounter {
    work: Arc<Work>,
    /// For each target the hits of each bin.
    hits: Vec<Vec<u64>>,
    /// For each target and bin the samples of each arm in which the ego collides.
    collided: Vec<Vec<Vec<u64>>>,
    /// For each target the samples that are in no bin.
    outside: Vec<u64>,
}

/// A bin of an item or a cross.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BinHits {
    /// The bin of each item.
    pub bins: Vec<String>,
    /// Number of samples in the bin.
    pub hits: u64,
    /// Number of these samples in which the ego collides, for each arm.
    pub collided: Vec<u64>,
    /// Probability of the bin by the distributions of the scenario; `None` for a measure, an
    /// attribute or correlated parameters.
    pub weight: Option<f64>,
}

/// How an item or a cross is covered.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CoverageResult {
    /// The name of the item or cross.
    pub name: CoverageName,
    /// The parameters, measures and attributes that the items divide into bins.
    pub subjects: Vec<String>,
    /// Samples by which a bin is covered.
    pub at_least: u64,
    /// Number of covered bins.
    pub covered: u64,
    /// The bins that count, in the order of their items.
    pub bins: Vec<BinHits>,
    /// Number of samples that are in no bin.
    pub outside: u64,
    /// Probability that the ego collides in each arm, given one of the bins that were hit. Only the
    /// bins that the sampling design `coverage` visits in turn have it.
    pub weighted_collision_rates: Option<Vec<f64>>,
}

impl CoverageResult {
    /// Returns the share of the bins that is covered.
    pub fn share(&self) -> f64 {
        self.covered as f64 / self.bins.len() as f64
    }

    /// Returns the bins that are not covered.
    pub fn holes(&self) -> impl Iterator<Item = &BinHits> {
        self.bins.iter().filter(|bin| bin.hits < self.at_least)
    }
}

impl CoverageCounter {
    /// Returns a counter without samples.
    pub fn new(work: &Arc<Work>) -> Self {
        let targets = &work.file.coverage().targets;
        let hits = targets.iter().map(|target| vec![0; target.counts.len()]).collect();
        let of_arms = vec![0; work.arms.len()];
        let collided = targets.iter().map(|target| vec![of_arms.clone(); target.counts.len()]).collect();
        Self { work: Arc::clone(work), hits, collided, outside: vec![0; targets.len()] }
    }

    /// Adds one sample: the run of the arm under test. A sample that ended in an error covers
    /// nothing.
    pub fn push(&mut self, record: &Record) {
        let plan = self.work.file.coverage();
        let outcome = record.arms.last().and_then(|arm| arm.result.as_ref().ok());
        let Some(outcome) = outcome.filter(|_| !plan.items.is_empty()) else { return };
        let concrete = || self.work.file.concrete(&outcome.parameters).ok();
        let surroundings = || concrete().map(|Scenario { environment, road, .. }| Surroundings { environment, road });
        let of_items: Vec<Option<usize>> = plan.items.iter().map(|item| item.bin(outcome, &surroundings)).collect();
        let tallies = record.tallies();
        for (place, target) in plan.targets.iter().enumerate() {
            let Some(index) = target.index(&of_items, &plan.items).filter(|&index| target.counts[index]) else {
                self.outside[place] += 1;
                continue;
            };
            self.hits[place][index] += 1;
            for (collided, tally) in self.collided[place][index].iter_mut().zip(&tallies) {
                *collided += u64::from(tally.collided == Some(true));
            }
        }
    }

    /// Returns how each item and cross is covered.
    pub fn results(&self) -> Vec<CoverageResult> {
        (0..self.hits.len()).map(|place| self.result(place)).collect()
    }

    /// Returns the share of an item or cross that is covered, and the number of samples in its
    /// bins; `None` if the scenario has no item or cross of this name.
    pub fn share(&self, name: &str) -> Option<(f64, u64)> {
        let plan = self.work.file.coverage();
        let place = plan.targets.iter().position(|target| target.name.as_str() == name)?;
        Some((self.result(place).share(), self.hits[place].iter().sum()))
    }

    fn result(&self, place: usize) -> CoverageResult {
        let plan = self.work.file.coverage();
        let target = &plan.targets[place];
        let bin = |index: usize| BinHits {
            bins: target.bins(index, &plan.items).iter().map(ToString::to_string).collect(),
            hits: self.hits[place][index],
            collided: self.collided[place][index].clone(),
            weight: target.weights.as_ref().map(|weights| weights[index]),
        };
        let bins: Vec<BinHits> = (0..target.counts.len()).filter(|&index| target.counts[index]).map(bin).collect();
        let is_visited = self.work.sampling.design == Design::Coverage && plan.fill == Some(target.name);
        CoverageResult {
            name: target.name,
            subjects: target.items.iter().map(|&item| plan.items[item].subject.clone()).collect(),
            at_least: target.at_least,
            covered: bins.iter().filter(|bin| bin.hits >= target.at_least).count() as u64,
            outside: self.outside[place],
            weighted_collision_rates: is_visited.then(|| weighted(&bins, self.work.arms.len())).flatten(),
            bins,
        }
    }
}

/// Returns the weighted mean of the rate in each bin that was hit, for each arm.
fn weighted(bins: &[BinHits], arms: usize) -> Option<Vec<f64>> {
    let hit = || bins.iter().filter(|bin| bin.hits > 0);
    let all: f64 = hit().map(|bin| bin.weight).sum::<Option<f64>>()?;
    let of_arm = |arm: usize| {
        let rates = hit().map(|bin| Some(bin.weight? * bin.collided[arm] as f64 / bin.hits as f64));
        Some(rates.sum::<Option<f64>>()? / all)
    };
    if all > 0.0 { (0..arms).map(of_arm).collect() } else { None }
}
