//! The class of a track: class scores of many scans, fused by Bayes' rule.
//!
//! Each scan multiplies the probabilities by its scores. The scores are probabilities under equal
//! priors, and therefore proportional to the likelihoods. The errors of successive scans of a
//! vehicle are correlated (same distance, light and shape), so each scan counts only as a share of
//! an independent observation.

use closecall_traffic::{ClassScores, maths};

/// Weight of one scan relative to an independent observation; assumption: about three scans make
/// one observation.
const SCAN_WEIGHT: f64 = 0.3;

/// Number of points from which on a box has the full weight of a scan; fewer could be one lamp of a
/// dark car (assumption).
const FULL_WEIGHT_POINTS: f64 = 12.0;

/// Least probability of a class, so that later evidence can raise it again.
const MIN_PROBABILITY: f64 = 1e-3;

/// The fused probabilities of car, truck, motorcycle and background, in this order.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FusedClass {
    scores: [f64; 4],
}

impl FusedClass {
    /// Creates the probabilities before the first observation.
    pub(crate) const fn unknown() -> Self {
        Self { scores: ClassScores::UNKNOWN.0 }
    }

    /// Updates the probabilities with the scores `seen` of a box of `points` points.
    pub(crate) fn update(&mut self, seen: &ClassScores, points: usize) {
        let weight = weight(points);
        for (score, seen) in self.scores.iter_mut().zip(seen.0) {
            *score *= maths::powf(seen.max(MIN_PROBABILITY), weight);
        }
        for _ in 0..2 {
            let sum: f64 = self.scores.iter().sum();
            self.scores = self.scores.map(|score| (score / sum).max(MIN_PROBABILITY));
        }
        let sum: f64 = self.scores.iter().sum();
        self.scores = self.scores.map(|score| score / sum);
    }

    pub(crate) fn scores(&self) -> ClassScores {
        ClassScores(self.scores)
    }
}

/// Returns the weight of a box of `points` points relative to an independent observation.
fn weight(points: usize) -> f64 {
    SCAN_WEIGHT * (points as f64 / FULL_WEIGHT_POINTS).min(1.0)
}

/// Returns the log-likelihood ratio of these scores for a vehicle of any class against background,
/// with the same weight as in [`FusedClass`].
pub(crate) fn vehicle_log_likelihood_ratio(seen: &ClassScores, points: usize) -> f64 {
    let background = seen.0[ClassScores::BACKGROUND].clamp(MIN_PROBABILITY, 1.0 - MIN_PROBABILITY);
    // Under equal priors of the four classes, a vehicle of any class has three times the prior of
    // background.
    weight(points) * maths::ln((1.0 - background) / (3.0 * background))
}

#[cfg(test)]
mod tests {
    use closecall_traffic::VehicleClass;

    use super::*;

    #[test]
    fn evidence_accumulates_and_can_be_reversed() {
        let mut fused = FusedClass::unknown();
        let truck = ClassScores([0.2, 0.6, 0.1, 0.1]);
        for _ in 0..10 {
            fused.update(&truck, 50);
        }
        assert!(fused.scores().0[1] > 0.9);
        for _ in 0..30 {
            fused.update(&ClassScores::certain(VehicleClass::Motorcycle), 50);
        }
        assert_eq!(fused.scores().best_vehicle_class(), VehicleClass::Motorcycle);
        assert!((fused.scores().0.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn three_points_weigh_less_than_thirty() {
        let (mut few, mut many) = (FusedClass::unknown(), FusedClass::unknown());
        let seen = ClassScores([0.1, 0.1, 0.7, 0.1]);
        few.update(&seen, 3);
        many.update(&seen, 30);
        assert!(few.scores().0[2] > 0.25 && few.scores().0[2] < many.scores().0[2]);
    }

    #[test]
    fn unknown_scores_leave_the_class_unchanged() {
        let mut fused = FusedClass::unknown();
        fused.update(&ClassScores([0.7, 0.1, 0.1, 0.1]), 50);
        let before = fused.scores();
        fused.update(&ClassScores::UNKNOWN, 50);
        for (a, b) in before.0.iter().zip(fused.scores().0) {
            assert!((a - b).abs() < 1e-12);
        }
        assert!(vehicle_log_likelihood_ratio(&ClassScores::UNKNOWN, 50).abs() < 1e-12);
        assert!(vehicle_log_likelihood_ratio(&ClassScores([0.0, 0.0, 0.0, 1.0]), 50) < -1.0);
    }
}
