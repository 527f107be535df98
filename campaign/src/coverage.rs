//! Counts which bins of a scenario's coverage plan the samples hit, and in which bins the ego
//! collides.

use std::sync::Arc;

use closecall_scenarios::Scenario;
use closecall_scenarios::coverage::{CoverageName, Surroundings, Target};
use closecall_scenarios::sampling::Design;
use serde::Serialize;

use crate::record::Record;
use crate::runner::Work;

/// Counts the samples in the bins of a scenario's coverage items and crosses.
#[derive(Clone, Debug)]
pub struct CoverageCounter {
    work: Arc<Work>,
    /// The counts of each target of the plan.
    counts: Vec<TargetCounts>,
}

/// The counts of one item or cross.
#[derive(Clone, Debug)]
struct TargetCounts {
    /// Number of samples in each bin.
    hits: Vec<u64>,
    /// For each bin the number of samples of each arm in which the ego collides.
    collided: Vec<Vec<u64>>,
    /// Number of samples in no bin.
    outside: u64,
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
    /// Number of samples that cover a bin.
    pub at_least: u64,
    /// Number of covered bins.
    pub covered: u64,
    /// The bins that are to be covered, in the order of their items.
    pub bins: Vec<BinHits>,
    /// Number of samples that are in no bin.
    pub outside: u64,
    /// Probability that the ego collides in each arm, given that the sample is in one of the hit
    /// bins. Only the target whose bins the sampling design `coverage` visits in turn has it.
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
        let zero = |bins: usize| TargetCounts {
            hits: vec![0; bins],
            collided: vec![vec![0; work.arms.len()]; bins],
            outside: 0,
        };
        let counts = work.file.coverage().targets.iter().map(|target| zero(target.counts.len())).collect();
        Self { work: Arc::clone(work), counts }
    }

    /// Adds one sample: the run of the arm under test. A sample that ended in an error covers
    /// nothing.
    pub fn push(&mut self, record: &Record) {
        let plan = self.work.file.coverage();
        let outcome = record.arms.last().and_then(|arm| arm.result.as_ref().ok());
        let Some(outcome) = outcome.filter(|_| !plan.items.is_empty()) else { return };
        let concrete = || self.work.file.concrete(&outcome.parameters).ok();
        let surroundings = || concrete().map(|Scenario { environment, road, .. }| Surroundings { environment, road });
        let item_bins: Vec<Option<usize>> = plan.items.iter().map(|item| item.bin(outcome, &surroundings)).collect();
        let tallies = record.tallies();
        for (target, counts) in plan.targets.iter().zip(&mut self.counts) {
            let Some(bin) = target.index(&item_bins, &plan.items).filter(|&bin| target.counts[bin]) else {
                counts.outside += 1;
                continue;
            };
            counts.hits[bin] += 1;
            for (collided, tally) in counts.collided[bin].iter_mut().zip(&tallies) {
                *collided += u64::from(tally.collided == Some(true));
            }
        }
    }

    /// Returns how each item and cross is covered.
    pub fn results(&self) -> Vec<CoverageResult> {
        let targets = &self.work.file.coverage().targets;
        targets.iter().zip(&self.counts).map(|(target, counts)| self.result(target, counts)).collect()
    }

    /// Returns the share of an item or cross that is covered, and the number of samples in its
    /// bins; `None` if the scenario has no item or cross of this name.
    pub fn share(&self, name: &str) -> Option<(f64, u64)> {
        let targets = &self.work.file.coverage().targets;
        let (target, counts) = targets.iter().zip(&self.counts).find(|(target, _)| target.name.as_str() == name)?;
        Some((self.result(target, counts).share(), counts.hits.iter().sum()))
    }

    fn result(&self, target: &Target, counts: &TargetCounts) -> CoverageResult {
        let plan = self.work.file.coverage();
        let bin = |index: usize| BinHits {
            bins: target.bins(index, &plan.items).iter().map(ToString::to_string).collect(),
            hits: counts.hits[index],
            collided: counts.collided[index].clone(),
            weight: target.weights.as_ref().map(|weights| weights[index]),
        };
        let bins: Vec<BinHits> = (0..target.counts.len()).filter(|&index| target.counts[index]).map(bin).collect();
        let is_visited = self.work.sampling.design == Design::Coverage && plan.fill == Some(target.name);
        CoverageResult {
            name: target.name,
            subjects: target.items.iter().map(|&item| plan.items[item].subject.clone()).collect(),
            at_least: target.at_least,
            covered: bins.iter().filter(|bin| bin.hits >= target.at_least).count() as u64,
            outside: counts.outside,
            weighted_collision_rates: is_visited.then(|| weighted_rates(&bins, self.work.arms.len())).flatten(),
            bins,
        }
    }
}

/// Returns for each arm the mean of the collision rates in the hit bins, weighted by the
/// probability of the bins. Returns `None` if a probability is unknown, or if no bin was hit.
fn weighted_rates(bins: &[BinHits], arms: usize) -> Option<Vec<f64>> {
    let hit_bins = || bins.iter().filter(|bin| bin.hits > 0);
    let probability: f64 = hit_bins().map(|bin| bin.weight).sum::<Option<f64>>()?;
    let arm_rate = |arm: usize| {
        let rates = hit_bins().map(|bin| Some(bin.weight? * bin.collided[arm] as f64 / bin.hits as f64));
        Some(rates.sum::<Option<f64>>()? / probability)
    };
    if probability > 0.0 { (0..arms).map(arm_rate).collect() } else { None }
}
