//! The data of one scenario in a report.

use std::collections::BTreeMap;

use closecall_scenarios::parameters::ParameterSpace;

use super::influence::InfluenceCounts;
use super::margins::{MARGINS, MarginBins};
use super::pairs::{PairBins, cells_of};
use super::sample::{Fate, Point, WorstSample};
use super::{Axis, CELLS};
use closecall_campaign::record::{ArmRecord, Record};

/// Largest number of points of each fate in the outcome map.
const MOST_POINTS: usize = 400;
/// Largest number of samples that are listed as the worst.
const MOST_WORST: usize = 12;

/// Counts of one arm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ArmTotals {
    /// The number of samples.
    pub samples: usize,
    /// The number of samples in which the ego collided.
    pub failures: usize,
    /// The number of samples that ended in an error.
    pub errors: usize,
}

/// The flaky samples of one arm.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ErrorGroup {
    /// The number of samples.
    pub count: u64,
    /// The number of the first such sample.
    pub first_sample: u64,
    /// The message of the first error.
    pub message: String,
}

/// The data of one scenario in a report, beside the counts.
#[derive(Clone, Debug)]
pub struct ScenarioOverview {
    /// The scenario's name.
    pub name: String,
    /// The controllers, the one under test last.
    pub arms: Vec<String>,
    /// The counts of each arm.
    pub totals: Vec<ArmTotals>,
    /// The axes of the parameters that vary.
    pub axes: Vec<Axis>,
    /// For each axis: the number of samples of each fate in each cell.
    pub coverage: Vec<[[u64; Fate::ALL.len()]; CELLS]>,
    /// All pairs of axes.
    pub pairs: Vec<PairBins>,
    /// The distribution of each margin of [`MARGINS`] in each arm.
    pub margins: Vec<Vec<MarginBins>>,
    /// The influence of each parameter on each event.
    pub influence: InfluenceCounts,
    /// The worst samples of the arm under test, beginning with the worst.
    pub worst: Vec<WorstSample>,
    /// Samples with an outcome only because they were run again after a failure, by arm.
    pub flaky: BTreeMap<String, ErrorGroup>,
    /// The samples with the smallest hashes of their number, for each fate: an even choice of all
    /// samples.
    points: BTreeMap<(Fate, u64), Point>,
    /// The number of points of each fate.
    point_counts: [usize; Fate::ALL.len()],
}

impl ScenarioOverview {
    pub(super) fn new(name: &str, space: &ParameterSpace, arms: &[String]) -> Self {
        let axes: Vec<Axis> =
            space.iter().filter_map(|(name, entry)| Axis::of(name.as_str(), &entry.distribution)).collect();
        let pairs =
            (0..axes.len()).flat_map(|first| (first + 1..axes.len()).map(move |second| PairBins::new([first, second])));
        Self {
            name: name.to_owned(),
            arms: arms.to_vec(),
            totals: vec![ArmTotals::default(); arms.len()],
            coverage: vec![[[0; Fate::ALL.len()]; CELLS]; axes.len()],
            pairs: pairs.collect(),
            axes,
            influence: InfluenceCounts::new(space, arms.len() > 1),
            margins: vec![vec![MarginBins::EMPTY; arms.len()]; MARGINS.len()],
            worst: Vec::with_capacity(MOST_WORST + 1),
            flaky: BTreeMap::new(),
            points: BTreeMap::new(),
            point_counts: [0; Fate::ALL.len()],
        }
    }

    /// Returns true if there is a baseline beside the arm under test.
    pub fn is_paired(&self) -> bool {
        self.arms.len() > 1
    }

    /// Returns an even choice of the samples of each fate, in the order of gravity.
    pub fn points(&self) -> impl Iterator<Item = &Point> {
        self.points.values()
    }

    /// Returns the pair of parameters that tells the most about the outcome, or `None` if fewer
    /// than two parameters vary.
    pub fn map(&self) -> Option<&PairBins> {
        let better = |a: &&PairBins, b: &&PairBins| a.information_nat().total_cmp(&b.information_nat());
        // `max_by` returns the last of equal elements: the order is reversed to get the first.
        self.pairs.iter().rev().max_by(better)
    }

    pub(super) fn push(&mut self, record: &Record) {
        let fate = Fate::of(record);
        for (index, arm) in record.arms.iter().enumerate().take(self.arms.len()) {
            self.push_arm(index, record.sample, arm);
        }
        self.push_parameters(record, fate);
        self.influence.push(record);
        if let Some(sample) = WorstSample::of(record) {
            let index = self.worst.partition_point(|worse| worse.order(&sample).is_lt());
            if index < MOST_WORST {
                self.worst.insert(index, sample);
                self.worst.truncate(MOST_WORST);
            }
        }
    }

    fn push_arm(&mut self, index: usize, sample: u64, arm: &ArmRecord) {
        let totals = &mut self.totals[index];
        totals.samples += 1;
        match &arm.result {
            Ok(outcome) => {
                if let Some(flaky) = &arm.flaky {
                    let message = || flaky.first.message.clone();
                    let first = || ErrorGroup { count: 0, first_sample: sample, message: message() };
                    self.flaky.entry(arm.controller.clone()).or_insert_with(first).count += 1;
                }
                totals.failures += usize::from(outcome.ego_collided());
                for (kind, bins) in MARGINS.iter().zip(&mut self.margins) {
                    bins[index].push(kind, outcome);
                }
            }
            Err(_) => totals.errors += 1,
        }
    }

    fn push_parameters(&mut self, record: &Record, fate: Fate) {
        let Some(outcome) = record.arms.iter().find_map(|arm| arm.result.as_ref().ok()) else { return };
        let cells = cells_of(&self.axes, &outcome.parameters);
        for (counts, cell) in self.coverage.iter_mut().zip(&cells) {
            if let Some(cell) = cell {
                counts[*cell][fate as usize] += 1;
            }
        }
        let tested = matches!(fate, Fate::Failed | Fate::Induced);
        let collided = [tested || fate == Fate::Prevented, tested];
        for pair in &mut self.pairs {
            pair.push(&self.axes, &cells, collided);
        }
        self.push_point(Point { sample: record.sample, fate, parameters: outcome.parameters.clone() });
    }

    /// Adds a point, and removes the one with the largest hash if there are too many: a random
    /// choice that does not depend on the order of the samples.
    fn push_point(&mut self, point: Point) {
        let fate = point.fate;
        let hash = closecall_campaign::partition::split_mix(point.sample);
        let count = &mut self.point_counts[fate as usize];
        if *count == MOST_POINTS {
            let of_fate = (fate, 0)..=(fate, u64::MAX);
            let Some(largest) = self.points.range(of_fate).next_back().map(|(key, _)| *key) else { return };
            if largest.1 <= hash {
                return;
            }
            self.points.remove(&largest);
            *count -= 1;
        }
        if self.points.insert((fate, hash), point).is_none() {
            *count += 1;
        }
    }
}
