//! Runs every criterion at every level of each disturbance.

use closecall_traffic::Trajectory;
use serde::Serialize;

use super::disturb::{Disturbance, Repetition};
use crate::lane_change::{Criterion, LaneChange, LaneChangeDetector, LaneReliability};
use crate::trajectory_data::{LaneMarkings, MarkingDistances};

/// Share of missed or of invented lane changes above which a criterion fails (-), relative to the number that it
/// detects undisturbed.
pub const FAILING_SHARE: f64 = 0.05;

/// A track, and the distances to the markings for each of its points; these are empty if they were not measured.
pub type Measured = (Trajectory, Vec<MarkingDistances>);

/// The levels of the disturbances, and the repetitions and seed of the noise.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Setup {
    /// Intensities of the Brownian noise, ascending from 0 (m/√s).
    pub noise_m_per_sqrt_s: Vec<f64>,
    /// Constant offsets, ascending (m).
    pub offset_m: Vec<f64>,
    /// Number of repetitions at each noise level.
    pub repetitions: u64,
    /// Seed of the noise.
    pub seed: u64,
}

impl Default for Setup {
    /// Noise up to 1 m/√s, at which a vehicle drifts by a lane width in a dozen seconds; offsets up to half a lane
    /// width.
    fn default() -> Self {
        Self {
            noise_m_per_sqrt_s: vec![0.0, 0.02, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0],
            offset_m: (-6..=6).map(|quarters| 0.25 * f64::from(quarters)).collect(),
            repetitions: 5,
            seed: 0,
        }
    }
}

/// The kind of reference with which the lane changes are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ReferenceKind {
    /// Lane changes by the gradient criterion: jumps of the distances to the markings.
    Gradient,
    /// Lane changes by the peak criterion: changes of the recorded lane at peaks of the lateral speed.
    RecordedLanes,
}

/// A robustness study of one trajectory data set, with its reference lane changes.
#[derive(Clone, Debug)]
pub struct Study {
    tracks: Vec<Measured>,
    criteria: Vec<Criterion>,
    /// Detector that does not rely on the recorded lanes.
    detector: LaneChangeDetector,
    /// Reference lane changes of each track.
    reference: Vec<Vec<LaneChange>>,
    /// For each track, each of its reference lane changes and each criterion: true if it is detected undisturbed.
    undisturbed: Vec<Vec<Vec<bool>>>,
    kind: ReferenceKind,
}

/// One experiment: a disturbance and a repetition of its noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Experiment {
    disturbance: Disturbance,
    repetition: Repetition,
}

/// The counts of one criterion in one experiment, or their mean over several.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct CriterionCounts {
    /// Number of detected lane changes.
    pub found: f64,
    /// Number of reference lane changes that the criterion detects undisturbed and also detects here.
    pub again: f64,
    /// Number of detected lane changes that match no reference lane change.
    pub invented: f64,
}

impl Study {
    /// Detects the reference lane changes in `tracks` on the road with these `markings`.
    pub fn new(tracks: Vec<Measured>, markings: &LaneMarkings) -> Self {
        let has_distances = tracks.iter().any(|(_, distances)| !distances.is_empty());
        let (kind, reference_criterion, criteria) = if has_distances {
            (ReferenceKind::Gradient, Criterion::Gradient, Criterion::ALL.to_vec())
        } else {
            (ReferenceKind::RecordedLanes, Criterion::Peak, vec![Criterion::Peak, Criterion::Distance])
        };
        let reference_detector = LaneChangeDetector::new(LaneReliability::Reliable, markings);
        let reference: Vec<_> = tracks
            .iter()
            .map(|(track, distances)| reference_detector.detect(reference_criterion, track, distances))
            .collect();
        let detector = LaneChangeDetector::new(LaneReliability::Unreliable, markings);
        let undisturbed = tracks.iter().zip(&reference).map(|((track, distances), reference)| {
            let found = detector.detect_by_each(&criteria, track, distances);
            let by_criteria = |change: &LaneChange| {
                found.iter().map(|found| found.iter().any(|found| matches_reference(found, change))).collect()
            };
            reference.iter().map(by_criteria).collect()
        });
        Self { undisturbed: undisturbed.collect(), tracks, criteria, detector, reference, kind }
    }

    /// Returns the kind of the reference.
    pub fn kind(&self) -> ReferenceKind {
        self.kind
    }

    /// Returns the number of reference lane changes.
    pub fn reference(&self) -> usize {
        self.reference.iter().flatten().count()
    }

    /// Returns, for each criterion, the number of reference lane changes that it detects undisturbed.
    pub fn undisturbed(&self) -> Vec<usize> {
        let count = |criterion: usize| self.undisturbed.iter().flatten().filter(|found| found[criterion]).count();
        (0..self.criteria.len()).map(count).collect()
    }

    /// Returns all experiments of `setup`: first those with noise, level by level, then those with an offset.
    pub fn cases(setup: &Setup) -> Vec<Experiment> {
        let noise = setup.noise_m_per_sqrt_s.iter().flat_map(|&noise_m_per_sqrt_s| {
            let disturbance = Disturbance { offset_m: 0.0, noise_m_per_sqrt_s };
            (0..setup.repetitions).map(move |number| (disturbance, number))
        });
        let offsets = setup.offset_m.iter();
        let offsets = offsets.map(|&offset_m| (Disturbance { offset_m, noise_m_per_sqrt_s: 0.0 }, 0));
        let case =
            |(disturbance, number)| Experiment { disturbance, repetition: Repetition { seed: setup.seed, number } };
        noise.chain(offsets).map(case).collect()
    }

    /// Runs one experiment and returns one cell for each criterion.
    pub fn run(&self, case: &Experiment) -> Vec<CriterionCounts> {
        let mut cells = vec![CriterionCounts::default(); self.criteria.len()];
        let references = self.reference.iter().zip(&self.undisturbed);
        for ((track, distances), (reference, undisturbed)) in self.tracks.iter().zip(references) {
            let (track, distances) = case.disturbance.apply(track, distances, case.repetition);
            let found = self.detector.detect_by_each(&self.criteria, &track, &distances);
            for (criterion, (cell, found)) in cells.iter_mut().zip(&found).enumerate() {
                let required: Vec<_> = reference
                    .iter()
                    .zip(undisturbed)
                    .filter(|(_, undisturbed)| undisturbed[criterion])
                    .map(|(change, _)| change)
                    .collect();
                cell.count(found, reference, &required);
            }
        }
        cells
    }

    /// Combines the `results` of all experiments of `setup`, which are in the order of [`Self::cases`].
    pub fn robustness(&self, setup: &Setup, results: &[Vec<CriterionCounts>]) -> Robustness {
        let (noise, offsets) = results.split_at(results.len() - setup.offset_m.len());
        let repetitions = usize::try_from(setup.repetitions).unwrap_or(usize::MAX).max(1);
        let noise = noise.chunks(repetitions).map(|repeated| self.mean(repeated)).collect();
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

    /// Returns the mean cell of each criterion over repeated experiments.
    fn mean(&self, repeated: &[Vec<CriterionCounts>]) -> Vec<CriterionCounts> {
        let n = repeated.len() as f64;
        let mean_of = |criterion: usize, value: fn(&CriterionCounts) -> f64| {
            repeated.iter().map(|cells| value(&cells[criterion])).sum::<f64>() / n
        };
        let cell = |criterion| CriterionCounts {
            found: mean_of(criterion, |cell| cell.found),
            again: mean_of(criterion, |cell| cell.again),
            invented: mean_of(criterion, |cell| cell.invented),
        };
        (0..self.criteria.len()).map(cell).collect()
    }
}

impl CriterionCounts {
    /// Adds the counts of one track: the lane changes that were `found`, all `reference` ones, and the `required` ones,
    /// which the criterion detects undisturbed.
    fn count(&mut self, found: &[LaneChange], reference: &[LaneChange], required: &[&LaneChange]) {
        self.found += found.len() as f64;
        let is_found = |change: &&&LaneChange| found.iter().any(|found| matches_reference(found, change));
        self.again += required.iter().filter(is_found).count() as f64;
        let invented = found.iter().filter(|found| !reference.iter().any(|change| matches_reference(found, change)));
        self.invented += invented.count() as f64;
    }
}

/// Returns true if a detected lane change has the direction of a reference lane change and overlaps it in time.
fn matches_reference(found: &LaneChange, reference: &LaneChange) -> bool {
    found.direction == reference.direction && found.start_s <= reference.end_s && reference.start_s <= found.end_s
}

/// The result of a robustness study; each row of cells is in the order of `criteria`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Robustness {
    /// Kind of the reference.
    pub reference_kind: ReferenceKind,
    /// Number of reference lane changes.
    pub reference: usize,
    /// Number of reference lane changes that each criterion detects undisturbed.
    pub undisturbed: Vec<usize>,
    /// Levels, repetitions and seed.
    pub setup: Setup,
    /// The criteria.
    pub criteria: Vec<Criterion>,
    /// One row for each noise level: the means over the repetitions.
    pub noise: Vec<Vec<CriterionCounts>>,
    /// One row for each offset.
    pub offset: Vec<Vec<CriterionCounts>>,
}

impl Robustness {
    /// Adds the result of another trajectory data set.
    ///
    /// Returns false and adds nothing if its kind of reference or its setup differs.
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

    /// Returns true if the criterion in column `criterion` fails with the counts of `cell`.
    pub fn fails(&self, criterion: usize, cell: &CriterionCounts) -> bool {
        let required = self.undisturbed[criterion] as f64;
        let allowed = FAILING_SHARE * required;
        !(required - cell.again <= allowed && cell.invented <= allowed)
    }

    /// Returns the lowest noise intensity at which the criterion in column `criterion` fails (m/√s), or `None` if it
    /// fails at no level.
    pub fn failing_noise_m_per_sqrt_s(&self, criterion: usize) -> Option<f64> {
        let levels = self.setup.noise_m_per_sqrt_s.iter().zip(&self.noise);
        levels.filter(|(_, cells)| self.fails(criterion, &cells[criterion])).map(|(level, _)| *level).next()
    }
}
