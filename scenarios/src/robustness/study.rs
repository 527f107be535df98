//! Every criterion at every level of each disturbance.

use closecall_traffic::Trajectory;
use serde::Serialize;

use super::disturb::{Disturbance, Repetition};
use crate::lane_change::{Criterion, Detector, LaneChange, Lanes};
use crate::recordings::{LaneMarkings, MarkingDistances};

/// A criterion fails where it misses, or invents, more than this share of the reference.
pub const FAILING_SHARE: f64 = 0.05;

/// One track, with the distances to the markings for each of its points where they were measured.
pub type Measured = (Trajectory, Vec<MarkingDistances>);

/// Levels of the disturbances, and how often the noise is drawn.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Setup {
    /// Intensities of Brownian noise, rising from 0 [m/√s].
    pub noise_m_per_sqrt_s: Vec<f64>,
    /// Constant offsets, rising [m].
    pub offset_m: Vec<f64>,
    /// Draws of the noise.
    pub repetitions: u64,
    /// Seed of the noise.
    pub seed: u64,
}

impl Default for Setup {
    /// Noise up to 1 m/√s, at which a vehicle drifts by a lane's width in a dozen seconds; offsets up to a lane's half.
    fn default() -> Self {
        Self {
            noise_m_per_sqrt_s: vec![0.0, 0.02, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0],
            offset_m: (-6..=6).map(|quarters| 0.25 * f64::from(quarters)).collect(),
            repetitions: 5,
            seed: 0,
        }
    }
}

/// What the lane changes are held against.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ReferenceKind {
    /// Jumps of the distances to the markings.
    Gradient,
    /// The recorded lanes, at peaks of the lateral speed.
    RecordedLanes,
}

/// A recording, ready to be disturbed.
#[derive(Clone, Debug)]
pub struct Study {
    tracks: Vec<Measured>,
    criteria: Vec<Criterion>,
    doubtful: Detector,
    /// For each track, every lane change that happened.
    happened: Vec<Vec<LaneChange>>,
    /// For each track and each of its lane changes, which criteria find it undisturbed.
    known: Vec<Vec<Vec<bool>>>,
    kind: ReferenceKind,
}

/// One experiment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Case {
    disturbance: Disturbance,
    repetition: Repetition,
}

/// What one criterion did in one experiment, or in the mean of several.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Cell {
    /// Lane changes found.
    pub found: f64,
    /// Of those that the criterion finds undisturbed, those found again.
    pub again: f64,
    /// Found where none happened.
    pub invented: f64,
}

impl Study {
    /// Finds the reference in `tracks` between `markings`.
    pub fn new(tracks: Vec<Measured>, markings: &LaneMarkings) -> Self {
        let sees_markings = tracks.iter().any(|(_, seen)| !seen.is_empty());
        let (kind, reference, criteria) = if sees_markings {
            (ReferenceKind::Gradient, Criterion::Gradient, Criterion::ALL.to_vec())
        } else {
            (ReferenceKind::RecordedLanes, Criterion::Peak, vec![Criterion::Peak, Criterion::Distance])
        };
        let trusting = Detector::new(Lanes::Recorded, markings);
        let happened: Vec<_> = tracks.iter().map(|(track, seen)| trusting.detect(reference, track, seen)).collect();
        let doubtful = Detector::new(Lanes::Doubtful, markings);
        let known = tracks.iter().zip(&happened).map(|((track, seen), happened)| {
            let found = doubtful.detect_by_each(&criteria, track, seen);
            let by_criteria = |change: &LaneChange| {
                found.iter().map(|found| found.iter().any(|found| meets(found, change))).collect()
            };
            happened.iter().map(by_criteria).collect()
        });
        Self { known: known.collect(), tracks, criteria, doubtful, happened, kind }
    }

    /// What the lane changes are held against.
    pub fn kind(&self) -> ReferenceKind {
        self.kind
    }

    /// Number of lane changes that happened.
    pub fn reference(&self) -> usize {
        self.happened.iter().flatten().count()
    }

    /// Number of those that each criterion finds undisturbed, and therefore has to find again.
    pub fn undisturbed(&self) -> Vec<usize> {
        let known = |criterion: usize| self.known.iter().flatten().filter(|found| found[criterion]).count();
        (0..self.criteria.len()).map(known).collect()
    }

    /// All experiments of `setup`: first those with noise, level by level, then those with an offset.
    pub fn cases(setup: &Setup) -> Vec<Case> {
        let noise = setup.noise_m_per_sqrt_s.iter().flat_map(|&noise_m_per_sqrt_s| {
            let disturbance = Disturbance { offset_m: 0.0, noise_m_per_sqrt_s };
            (0..setup.repetitions).map(move |number| (disturbance, number))
        });
        let offsets = setup.offset_m.iter();
        let offsets = offsets.map(|&offset_m| (Disturbance { offset_m, noise_m_per_sqrt_s: 0.0 }, 0));
        let case = |(disturbance, number)| Case { disturbance, repetition: Repetition { seed: setup.seed, number } };
        noise.chain(offsets).map(case).collect()
    }

    /// Runs one experiment: a cell for each criterion.
    pub fn run(&self, case: &Case) -> Vec<Cell> {
        let mut cells = vec![Cell::default(); self.criteria.len()];
        for (((track, seen), happened), known) in self.tracks.iter().zip(&self.happened).zip(&self.known) {
            let (track, seen) = case.disturbance.apply(track, seen, case.repetition);
            let found = self.doubtful.detect_by_each(&self.criteria, &track, &seen);
            for (criterion, (cell, found)) in cells.iter_mut().zip(&found).enumerate() {
                let known: Vec<_> = happened
                    .iter()
                    .zip(known)
                    .filter(|(_, known)| known[criterion])
                    .map(|(change, _)| change)
                    .collect();
                cell.count(found, happened, &known);
            }
        }
        cells
    }

    /// Puts together what the experiments of `setup` gave, in the order of [`Self::cases`].
    pub fn robustness(&self, setup: &Setup, results: &[Vec<Cell>]) -> Robustness {
        let (noise, offsets) = results.split_at(results.len() - setup.offset_m.len());
        let repetitions = usize::try_from(setup.repetitions).unwrap_or(usize::MAX).max(1);
        let noise = noise.chunks(repetitions).map(|draws| self.mean(draws)).collect();
        Robustness {
            reference_kind: self.kind,
            reference: self.reference(),
            undisturbed: self.undisturbed(),
            setup: setup.clone(),
            criteria: self.criteria.clone(),
            noise,
            offset: offsets.to_vec(),
        }
    }

    fn mean(&self, draws: &[Vec<Cell>]) -> Vec<Cell> {
        let n = draws.len() as f64;
        let mean_of = |criterion: usize, value: fn(&Cell) -> f64| {
            draws.iter().map(|cells| value(&cells[criterion])).sum::<f64>() / n
        };
        let cell = |criterion| Cell {
            found: mean_of(criterion, |cell| cell.found),
            again: mean_of(criterion, |cell| cell.again),
            invented: mean_of(criterion, |cell| cell.invented),
        };
        (0..self.criteria.len()).map(cell).collect()
    }
}

impl Cell {
    fn count(&mut self, found: &[LaneChange], happened: &[LaneChange], known: &[&LaneChange]) {
        self.found += found.len() as f64;
        self.again += known.iter().filter(|change| found.iter().any(|found| meets(found, change))).count() as f64;
        let invented = found.iter().filter(|found| !happened.iter().any(|change| meets(found, change)));
        self.invented += invented.count() as f64;
    }
}

fn meets(found: &LaneChange, happened: &LaneChange) -> bool {
    found.direction == happened.direction && found.start_s <= happened.end_s && happened.start_s <= found.end_s
}

/// What a robustness study found; each row of cells is in the order of `criteria`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Robustness {
    /// What the lane changes are held against.
    pub reference_kind: ReferenceKind,
    /// Number of lane changes that happened.
    pub reference: usize,
    /// Number of those that each criterion finds undisturbed, and therefore has to find again.
    pub undisturbed: Vec<usize>,
    /// Levels, repetitions and seed.
    pub setup: Setup,
    /// The criteria.
    pub criteria: Vec<Criterion>,
    /// For each level of noise, the mean over the repetitions.
    pub noise: Vec<Vec<Cell>>,
    /// For each offset.
    pub offset: Vec<Vec<Cell>>,
}

impl Robustness {
    /// Adds what another recording gave at the same levels; false, and nothing added, where it is of another kind.
    #[must_use]
    pub fn add(&mut self, other: &Self) -> bool {
        if self.reference_kind != other.reference_kind || self.setup != other.setup {
            return false;
        }
        self.reference += other.reference;
        self.undisturbed.iter_mut().zip(&other.undisturbed).for_each(|(own, other)| *own += other);
        let rows = self.noise.iter_mut().zip(&other.noise).chain(self.offset.iter_mut().zip(&other.offset));
        for (cell, other) in rows.flat_map(|(row, other)| row.iter_mut().zip(other)) {
            cell.found += other.found;
            cell.again += other.again;
            cell.invented += other.invented;
        }
        true
    }

    /// Whether the criterion in column `criterion` fails with what is in `cell`.
    pub fn fails(&self, criterion: usize, cell: &Cell) -> bool {
        let known = self.undisturbed[criterion] as f64;
        let allowed = FAILING_SHARE * known;
        !(known - cell.again <= allowed && cell.invented <= allowed)
    }

    /// The lowest intensity of noise at which the criterion in column `criterion` fails, if any [m/√s].
    pub fn fails_from_noise(&self, criterion: usize) -> Option<f64> {
        let levels = self.setup.noise_m_per_sqrt_s.iter().zip(&self.noise);
        levels.filter(|(_, cells)| self.fails(criterion, &cells[criterion])).map(|(level, _)| *level).next()
    }
}
