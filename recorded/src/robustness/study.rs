//! Runs every criterion at every level of each disturbance.

use closecall_traffic::Trajectory;
use serde::Serialize;

use super::disturb::{Disturbance, Repetition};
use super::matching::matches;
use crate::lane_change::{Criterion, LaneChange, LaneChangeDetector, LaneReliability};
use crate::trajectory_data::{LaneMarkings, MarkingDistances};

/// Share of missed or of invented lane changes above which a criterion fails (-), relative to the
/// number that it detects undisturbed.
pub const FAILING_SHARE: f64 = 0.05;
/// Fewest lane changes that a study needs: with fewer, the loss of a single lane change exceeds
/// [`FAILING_SHARE`].
pub const FEWEST_LANE_CHANGES: usize = 20;

/// A track, and the distances to the markings at each of its points. The distances are empty if
/// they were not measured.
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
    /// Noise up to 8 m/√s, far beyond any sensor, so that every criterion fails at some level;
    /// offsets up to half a lane width.
    fn default() -> Self {
        Self {
            noise_m_per_sqrt_s: vec![
                0.0, 0.02, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0,
            ],
            offset_m: (-6..=6).map(|quarters| 0.25 * f64::from(quarters)).collect(),
            repetitions: 5,
            seed: 0,
        }
    }
}

/// The kind of the reference, which tells how many lane changes there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ReferenceKind {
    /// Lane changes by the gradient criterion: jumps of the distances to the markings.
    Gradient,
    /// Lane changes by the peak criterion: changes of the recorded lane at peaks of the lateral
    /// speed.
    RecordedLanes,
    /// Lane changes by the peak criterion: changes of the lane that the traffic shows.
    EstimatedLanes,
    /// Lane changes by the peak criterion: lateral shifts by most of a lane.
    LateralShift,
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
    /// The lane changes that each criterion detects undisturbed, for each track.
    undisturbed: Vec<Vec<Vec<LaneChange>>>,
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
    #[serde(rename = "found")]
    pub detected: f64,
    /// Number of lane changes that the criterion detects both undisturbed and in this experiment.
    pub again: f64,
    /// Number of detected lane changes that match no lane change detected undisturbed.
    pub invented: f64,
}

impl Study {
    /// Detects the reference lane changes in `tracks` on the road with these `markings`. They are tracks of
    /// in-car logs, if distances to the markings were measured, or else have recorded lanes.
    pub fn new(tracks: Vec<Measured>, markings: &LaneMarkings) -> Self {
        let is_log = tracks.iter().any(|(_, distances)| !distances.is_empty());
        Self::of_file((!is_log).then_some(LaneReliability::Reliable), tracks, markings)
    }

    /// Works like [`Self::new`] for some tracks of a file whose lanes are as reliable as `lanes` says, or
    /// of an in-car log if it is `None`.
    pub fn of_file(lanes: Option<LaneReliability>, tracks: Vec<Measured>, markings: &LaneMarkings) -> Self {
        let kind = match lanes {
            None => ReferenceKind::Gradient,
            Some(LaneReliability::Reliable) => ReferenceKind::RecordedLanes,
            Some(LaneReliability::Estimated) => ReferenceKind::EstimatedLanes,
            Some(LaneReliability::Unreliable) => ReferenceKind::LateralShift,
        };
        let (reference_criterion, criteria) = match kind {
            ReferenceKind::Gradient => (Criterion::Gradient, Criterion::ALL.to_vec()),
            _ => (Criterion::Peak, vec![Criterion::Peak, Criterion::Distance]),
        };
        let lanes = lanes.unwrap_or_default();
        let reference_detector = LaneChangeDetector::new(lanes, markings);
        let reference: Vec<_> = tracks
            .iter()
            .map(|(track, distances)| reference_detector.detect(reference_criterion, track, distances))
            .collect();
        let detector = LaneChangeDetector::new(LaneReliability::Unreliable, markings);
        let undisturbed =
            tracks.iter().map(|(track, distances)| detector.detect_by_each(&criteria, track, distances)).collect();
        Self { undisturbed, tracks, criteria, detector, reference, kind }
    }

    /// Returns the kind of the reference.
    pub fn kind(&self) -> ReferenceKind {
        self.kind
    }

    /// Returns the number of reference lane changes.
    pub fn reference(&self) -> usize {
        self.reference.iter().flatten().count()
    }

    /// Returns the number of lane changes that each criterion detects undisturbed.
    pub fn undisturbed(&self) -> Vec<usize> {
        self.sum_by_criterion(|detected, _| detected.len())
    }

    /// Returns how many of the lane changes that each criterion detects undisturbed match one of
    /// the reference.
    pub fn confirmed(&self) -> Vec<usize> {
        self.sum_by_criterion(matches)
    }

    fn sum_by_criterion(&self, count: impl Fn(&[LaneChange], &[LaneChange]) -> usize) -> Vec<usize> {
        let of_criterion = |criterion: usize| {
            let tracks = self.undisturbed.iter().zip(&self.reference);
            tracks.map(|(detected, reference)| count(&detected[criterion], reference)).sum()
        };
        (0..self.criteria.len()).map(of_criterion).collect()
    }

    /// Returns all experiments of `setup`: first the experiments with noise, level by level, then
    /// the experiments with an offset.
    pub fn experiments(setup: &Setup) -> Vec<Experiment> {
        let noise = setup.noise_m_per_sqrt_s.iter().flat_map(|&noise_m_per_sqrt_s| {
            let disturbance = Disturbance { offset_m: 0.0, noise_m_per_sqrt_s };
            (0..setup.repetitions).map(move |number| (disturbance, number))
        });
        let offsets = setup.offset_m.iter();
        let offsets = offsets.map(|&offset_m| (Disturbance { offset_m, noise_m_per_sqrt_s: 0.0 }, 0));
        let experiment =
            |(disturbance, number)| Experiment { disturbance, repetition: Repetition { seed: setup.seed, number } };
        noise.chain(offsets).map(experiment).collect()
    }

    /// Runs one experiment and returns one cell for each criterion.
    pub fn run(&self, experiment: &Experiment) -> Vec<CriterionCounts> {
        let mut cells = vec![CriterionCounts::default(); self.criteria.len()];
        for ((track, distances), undisturbed) in self.tracks.iter().zip(&self.undisturbed) {
            let (track, distances) = experiment.disturbance.apply(track, distances, experiment.repetition);
            let detected = self.detector.detect_by_each(&self.criteria, &track, &distances);
            for (cell, (detected, undisturbed)) in cells.iter_mut().zip(detected.iter().zip(undisturbed)) {
                cell.count(detected, undisturbed);
            }
        }
        cells
    }

    /// Combines the `results` of all experiments of `setup`, which are in the order of
    /// [`Self::experiments`].
    pub fn robustness(&self, setup: &Setup, results: &[Vec<CriterionCounts>]) -> Robustness {
        let (noise, offsets) = results.split_at(results.len() - setup.offset_m.len());
        let repetitions = usize::try_from(setup.repetitions).unwrap_or(usize::MAX).max(1);
        Robustness {
            reference_kind: self.kind,
            reference: self.reference(),
            undisturbed: self.undisturbed(),
            confirmed: self.confirmed(),
            setup: setup.clone(),
            criteria: self.criteria.clone(),
            noise: noise.chunks(repetitions).map(<[_]>::to_vec).collect(),
            offset: offsets.to_vec(),
        }
    }
}

impl CriterionCounts {
    /// Adds the counts of one track: the lane changes `detected` in this experiment, and the lane
    /// changes detected `undisturbed`.
    fn count(&mut self, detected: &[LaneChange], undisturbed: &[LaneChange]) {
        let again = matches(detected, undisturbed);
        self.detected += detected.len() as f64;
        self.again += again as f64;
        self.invented += (detected.len() - again) as f64;
    }
}

/// The result of a robustness study; each row of cells is in the order of `criteria`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Robustness {
    /// Kind of the reference.
    pub reference_kind: ReferenceKind,
    /// Number of reference lane changes.
    pub reference: usize,
    /// Number of lane changes that each criterion detects undisturbed.
    pub undisturbed: Vec<usize>,
    /// Number of undisturbed lane changes that match a reference lane change, for each criterion.
    pub confirmed: Vec<usize>,
    /// Levels, repetitions and seed.
    pub setup: Setup,
    /// The criteria.
    pub criteria: Vec<Criterion>,
    /// One row for each noise level and repetition.
    pub noise: Vec<Vec<Vec<CriterionCounts>>>,
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
        self.undisturbed.iter_mut().zip(&other.undisturbed).for_each(|(sum, other)| *sum += other);
        self.confirmed.iter_mut().zip(&other.confirmed).for_each(|(sum, other)| *sum += other);
        let noise = self.noise.iter_mut().flatten().zip(other.noise.iter().flatten());
        for (row, other) in noise.chain(self.offset.iter_mut().zip(&other.offset)) {
            for (cell, other) in row.iter_mut().zip(other) {
                cell.detected += other.detected;
                cell.again += other.again;
                cell.invented += other.invented;
            }
        }
        true
    }

    /// Returns the means over the repetitions: one row for each noise level.
    pub fn mean_noise(&self) -> Vec<Vec<CriterionCounts>> {
        let mean = |repetitions: &Vec<Vec<CriterionCounts>>, criterion: usize| {
            let mean_of = |value: fn(&CriterionCounts) -> f64| {
                repetitions.iter().map(|cells| value(&cells[criterion])).sum::<f64>() / repetitions.len() as f64
            };
            let (detected, again) = (mean_of(|cell| cell.detected), mean_of(|cell| cell.again));
            CriterionCounts { detected, again, invented: mean_of(|cell| cell.invented) }
        };
        let row = |level| (0..self.criteria.len()).map(|criterion| mean(level, criterion)).collect();
        self.noise.iter().map(row).collect()
    }

    /// Returns true if the criterion in column `criterion` fails with the counts of `cell`. A
    /// criterion that detects nothing undisturbed is not judged.
    pub fn fails(&self, criterion: usize, cell: &CriterionCounts) -> bool {
        let required = self.undisturbed[criterion] as f64;
        let allowed = FAILING_SHARE * required;
        required > 0.0 && !(required - cell.again <= allowed && cell.invented <= allowed)
    }

    /// Returns the lowest noise intensity at which the criterion in column `criterion` fails in the
    /// mean over the repetitions (m/√s), or `None` if it fails at no level.
    pub fn failing_noise_m_per_sqrt_s(&self, criterion: usize) -> Option<f64> {
        self.first_failing(criterion, &self.mean_noise())
    }

    /// Works like [`Self::failing_noise_m_per_sqrt_s`], for each repetition by itself.
    pub fn failing_noise_by_repetition(&self, criterion: usize) -> Vec<Option<f64>> {
        let repetitions = self.noise.first().map_or(0, Vec::len);
        let rows = |number: usize| -> Vec<_> { self.noise.iter().map(|level| level[number].clone()).collect() };
        (0..repetitions).map(|number| self.first_failing(criterion, &rows(number))).collect()
    }

    fn first_failing(&self, criterion: usize, rows: &[Vec<CriterionCounts>]) -> Option<f64> {
        let mut levels = self.setup.noise_m_per_sqrt_s.iter().zip(rows);
        levels.find(|(_, cells)| self.fails(criterion, &cells[criterion])).map(|(level, _)| *level)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trajectory_data::test_support::changing_track;

    #[test]
    fn undisturbed_detections_are_no_failure_and_repetitions_are_kept() {
        // The vehicle moves by one lane, but its recorded lane never changes: the reference is
        // empty.
        let mut track = changing_track(1, (0.0, 30.0), (-5.25, -1.75), (4.0, 6.0), 150);
        track.points.iter_mut().for_each(|point| point.lane = closecall_traffic::Lane(2));
        let study = Study::new(vec![(track, Vec::new())], &LaneMarkings::default());
        let setup = Setup { noise_m_per_sqrt_s: vec![0.0, 8.0], offset_m: vec![0.0], repetitions: 3, seed: 1 };
        let results: Vec<_> = Study::experiments(&setup).iter().map(|experiment| study.run(experiment)).collect();
        let result = study.robustness(&setup, &results);
        assert_eq!((result.reference, result.undisturbed[0], result.confirmed[0]), (0, 1, 0));
        assert_eq!(result.failing_noise_m_per_sqrt_s(0), Some(8.0));
        assert_eq!((result.noise.len(), result.noise[1].len()), (2, 3));
        assert_eq!(result.failing_noise_by_repetition(0).len(), 3);
    }
}
