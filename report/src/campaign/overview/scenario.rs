//! What a report shows of one scenario.

use std::collections::BTreeMap;

use closecall_scenarios::parameters::ParameterSpace;

use super::margins::{MARGINS, MarginBins};
use super::pairs::{PairBins, cells_of};
use super::sample::{Fate, Point, WorstSample};
use super::{Axis, CELLS};
use closecall_campaign::record::{ArmRecord, Record};

/// Points of each fate that the outcome map shows at most.
const MOST_POINTS: usize = 400;
/// Samples that are listed as the worst.
const MOST_WORST: usize = 12;

/// Counts of one arm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ArmTotals {
    /// Samples.
    pub samples: usize,
    /// Samples in which E collided.
    pub failures: usize,
    /// Samples that ended in an error.
    pub errors: usize,
}

/// One kind of error.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ErrorKind {
    /// How many samples ended in it.
    pub count: u64,
    /// The first of them.
    pub first_sample: u64,
    /// What it said.
    pub message: String,
}

/// What a report shows of one scenario.
#[derive(Clone, Debug)]
pub struct ScenarioOverview {
    /// Its name.
    pub name: String,
    /// The controllers, the one under test last.
    pub arms: Vec<String>,
    /// The counts of each arm.
    pub totals: Vec<ArmTotals>,
    /// The parameters that vary.
    pub axes: Vec<Axis>,
    /// Samples of each fate, in each part of each axis.
    pub coverage: Vec<[[u64; Fate::ALL.len()]; CELLS]>,
    /// Every two of the parameters.
    pub pairs: Vec<PairBins>,
    /// The distribution of each margin of [`MARGINS`] in each arm.
    pub margins: Vec<Vec<MarginBins>>,
    /// The worst samples of the arm under test, the worst first.
    pub worst: Vec<WorstSample>,
    /// Errors by arm and kind.
    pub errors: BTreeMap<(String, String), ErrorKind>,
    /// Samples by fate and a hash of their number: the first of each fate are drawn evenly from all.
    points: BTreeMap<(Fate, u64), Point>,
    kept: [usize; Fate::ALL.len()],
}

impl ScenarioOverview {
    pub(super) fn new(name: &str, space: &ParameterSpace, arms: &[String]) -> Self {
        let axes: Vec<Axis> =
            space.iter().filter_map(|(name, entry)| Axis::of(name.as_str(), &entry.distribution)).collect();
        let pairs = (0..axes.len()).flat_map(|one| (one + 1..axes.len()).map(move |other| PairBins::new([one, other])));
        Self {
            name: name.to_owned(),
            arms: arms.to_vec(),
            totals: vec![ArmTotals::default(); arms.len()],
            coverage: vec![[[0; Fate::ALL.len()]; CELLS]; axes.len()],
            pairs: pairs.collect(),
            axes,
            margins: vec![vec![MarginBins::EMPTY; arms.len()]; MARGINS.len()],
            worst: Vec::with_capacity(MOST_WORST + 1),
            errors: BTreeMap::new(),
            points: BTreeMap::new(),
            kept: [0; Fate::ALL.len()],
        }
    }

    /// True where a baseline stands beside the arm under test.
    pub fn is_paired(&self) -> bool {
        self.arms.len() > 1
    }

    /// Samples of each fate.
    pub fn points(&self) -> impl Iterator<Item = &Point> {
        self.points.values()
    }

    /// The two parameters that tell most of the outcome; nothing where fewer than two vary.
    pub fn map(&self) -> Option<&PairBins> {
        let better = |one: &&PairBins, other: &&PairBins| one.information().total_cmp(&other.information());
        // Of equals the last would be taken: the order is turned round, so that it is the first.
        self.pairs.iter().rev().max_by(better)
    }

    pub(super) fn push(&mut self, record: &Record) {
        let fate = Fate::of(record);
        for (place, arm) in record.arms.iter().enumerate().take(self.arms.len()) {
            self.push_arm(place, record.sample, arm);
        }
        self.push_parameters(record, fate);
        if let Some(sample) = WorstSample::of(record) {
            let place = self.worst.partition_point(|worse| worse.order(&sample).is_lt());
            if place < MOST_WORST {
                self.worst.insert(place, sample);
                self.worst.truncate(MOST_WORST);
            }
        }
    }

    fn push_arm(&mut self, place: usize, sample: u64, arm: &ArmRecord) {
        let totals = &mut self.totals[place];
        totals.samples += 1;
        match &arm.result {
            Ok(outcome) => {
                totals.failures += usize::from(outcome.ego_collided());
                for (kind, bins) in MARGINS.iter().zip(&mut self.margins) {
                    bins[place].take(kind, outcome);
                }
            }
            Err(failure) => {
                totals.errors += 1;
                let first = || ErrorKind { count: 0, first_sample: sample, message: failure.message.clone() };
                self.errors.entry((arm.controller.clone(), failure.kind.clone())).or_insert_with(first).count += 1;
            }
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
        let collided = matches!(fate, Fate::Prevented | Fate::Failed | Fate::Induced);
        for pair in &mut self.pairs {
            pair.take(&self.axes, &cells, collided);
        }
        self.keep(Point { sample: record.sample, fate, parameters: outcome.parameters.clone() });
    }

    /// Keeps the points with the smallest hashes: a random choice that does not depend on the order.
    fn keep(&mut self, point: Point) {
        let fate = point.fate;
        let hash = closecall_campaign::partition::split_mix(point.sample);
        let kept = &mut self.kept[fate as usize];
        if *kept == MOST_POINTS {
            let of_fate = (fate, 0)..=(fate, u64::MAX);
            let Some(largest) = self.points.range(of_fate).next_back().map(|(key, _)| *key) else { return };
            if largest.1 <= hash {
                return;
            }
            self.points.remove(&largest);
            *kept -= 1;
        }
        if self.points.insert((fate, hash), point).is_none() {
            *kept += 1;
        }
    }
}
