//! What a track is: class scores of many scans fused by Bayes' rule.
//!
//! Each look multiplies the probabilities by its scores, which are probabilities under equal priors and so in
//! proportion to the likelihoods. The errors of successive looks at the same vehicle are alike (same distance, same
//! light, same shape), so each counts only for a share of an independent one.

use closecall_traffic::ClassScores;

/// Share of an independent look that one scan is worth [1]; assumption: about three scans make one.
const LOOK_WEIGHT: f64 = 0.3;

/// Points from which on the shape of a box is worth a whole look; fewer could be one lamp of a dark car (assumption).
const SHAPELY_POINTS: f64 = 12.0;

/// No class falls below this, so that later evidence can bring it back [1].
const LEAST_PROBABILITY: f64 = 1e-3;

/// The fused probabilities of [car, truck, motorcycle, background].
#[derive(Clone, Copy, Debug)]
pub(super) struct FusedClass {
    scores: [f64; 4],
}

impl FusedClass {
    /// Before the first look.
    pub(super) const fn unknown() -> Self {
        Self { scores: ClassScores::UNKNOWN.0 }
    }

    /// Takes in the scores of one look at so many points.
    pub(super) fn look(&mut self, seen: &ClassScores, points: usize) {
        let weight = weight(points);
        for (score, seen) in self.scores.iter_mut().zip(seen.0) {
            *score *= seen.max(LEAST_PROBABILITY).powf(weight);
        }
        for _ in 0..2 {
            let sum: f64 = self.scores.iter().sum();
            self.scores = self.scores.map(|score| (score / sum).max(LEAST_PROBABILITY));
        }
        let sum: f64 = self.scores.iter().sum();
        self.scores = self.scores.map(|score| score / sum);
    }

    pub(super) fn scores(&self) -> ClassScores {
        ClassScores(self.scores)
    }
}

/// Share of an independent look that a box of so many points is worth [1].
fn weight(points: usize) -> f64 {
    LOOK_WEIGHT * (points as f64 / SHAPELY_POINTS).min(1.0)
}

/// ln of how much likelier these scores are for a vehicle of any class than for background, tempered like a look.
pub(super) fn vehicle_log_likelihood_ratio(seen: &ClassScores, points: usize) -> f64 {
    let background = seen.0[3].clamp(LEAST_PROBABILITY, 1.0 - LEAST_PROBABILITY);
    // Under equal priors a vehicle of some class has three times the prior of background.
    weight(points) * ((1.0 - background) / (3.0 * background)).ln()
}

#[cfg(test)]
mod tests {
    use closecall_traffic::VehicleClass;

    use super::*;

    #[test]
    fn looks_add_up_and_can_be_reversed() {
        let mut fused = FusedClass::unknown();
        let truck = ClassScores([0.2, 0.6, 0.1, 0.1]);
        for _ in 0..10 {
            fused.look(&truck, 50);
        }
        assert!(fused.scores().0[1] > 0.9);
        for _ in 0..30 {
            fused.look(&ClassScores::certain(VehicleClass::Motorcycle), 50);
        }
        assert_eq!(fused.scores().best_vehicle_class(), VehicleClass::Motorcycle);
        assert!((fused.scores().0.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn three_points_say_less_than_thirty() {
        let (mut few, mut many) = (FusedClass::unknown(), FusedClass::unknown());
        let seen = ClassScores([0.1, 0.1, 0.7, 0.1]);
        few.look(&seen, 3);
        many.look(&seen, 30);
        assert!(few.scores().0[2] > 0.25 && few.scores().0[2] < many.scores().0[2]);
    }

    #[test]
    fn knowing_nothing_changes_nothing() {
        let mut fused = FusedClass::unknown();
        fused.look(&ClassScores([0.7, 0.1, 0.1, 0.1]), 50);
        let before = fused.scores();
        fused.look(&ClassScores::UNKNOWN, 50);
        for (a, b) in before.0.iter().zip(fused.scores().0) {
            assert!((a - b).abs() < 1e-12);
        }
        assert!(vehicle_log_likelihood_ratio(&ClassScores::UNKNOWN, 50).abs() < 1e-12);
        assert!(vehicle_log_likelihood_ratio(&ClassScores([0.0, 0.0, 0.0, 1.0]), 50) < -1.0);
    }
}
