//! A test whether new values come from a distribution that was fitted to earlier values. It is a
//! two-sample Kolmogorov–Smirnov test in which only the quantiles of one sample are known.
//!
//! ```text
//!   n earlier values ─▶ quantiles ─▶ n values that have these quantiles ─┐
//!                                                                        ├─▶ largest difference D of the distribution functions
//!   m new values ────────────────────────────────────────────────────────┘
//! ```
//!
//! The distribution of D without drift is simulated, because the quantiles contain less information
//! about the earlier values than a sample does: n and m uniform values are drawn, the n values are
//! reduced to the same number of quantiles, and D is computed in the same way. As for every
//! Kolmogorov–Smirnov test, the distribution of the values does not matter, as long as it is about
//! linear between two quantiles. The p-value is the share of the simulated D that are larger, plus
//! half of the share that are equal: D takes few values if the samples are small, and the test
//! would otherwise find less drift than its level allows.

use rand::{Rng, RngExt};

use crate::maths;
use crate::statistics::quantiles::quantile;

/// Number of simulated distances.
const SIMULATED: usize = 999;
/// Difference below which two distances count as equal.
const EQUAL: f64 = 1e-9;

/// Returns the Kolmogorov–Smirnov distance of two sorted samples: the largest difference of their
/// distribution functions (-).
pub fn distance(first: &[f64], second: &[f64]) -> f64 {
    let (n, m) = (first.len() as f64, second.len() as f64);
    let (mut i, mut j, mut largest) = (0, 0, 0.0_f64);
    while i < first.len() && j < second.len() {
        let x = first[i].min(second[j]);
        i += first[i..].iter().take_while(|value| **value <= x).count();
        j += second[j..].iter().take_while(|value| **value <= x).count();
        largest = largest.max((i as f64 / n - j as f64 / m).abs());
    }
    largest
}

/// A sample that is known by its size and by its quantiles at equally spaced probabilities from 0
/// to 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// Number of values.
    n: usize,
    quantiles: Vec<f64>,
}

impl Summary {
    /// Creates the summary of `n` values. Returns `None` unless there are two or more quantiles in
    /// ascending order, and no more than values.
    pub fn new(n: usize, quantiles: &[f64]) -> Option<Self> {
        let is_valid = (2..=n).contains(&quantiles.len()) && quantiles.windows(2).all(|pair| pair[0] <= pair[1]);
        is_valid.then(|| Self { n, quantiles: quantiles.to_vec() })
    }

    /// Reduces sorted values to at most `levels` quantiles.
    fn of(sorted: &[f64], levels: usize) -> Self {
        let quantiles = (0..levels).map(|level| quantile(sorted, level as f64 / (levels - 1) as f64)).collect();
        Self { n: sorted.len(), quantiles }
    }

    /// Returns the number of values.
    pub fn n(&self) -> usize {
        self.n
    }

    /// Returns the median.
    pub fn median(&self) -> f64 {
        quantile(&self.quantiles, 0.5)
    }

    /// Returns `n` sorted values that have these quantiles. They are the values themselves if there
    /// are as many quantiles.
    pub fn values(&self) -> Vec<f64> {
        (0..self.n).map(|k| quantile(&self.quantiles, k as f64 / (self.n - 1) as f64)).collect()
    }

    /// Returns the distance of `new` sorted values (-).
    pub fn distance(&self, new: &[f64]) -> f64 {
        distance(&self.values(), new)
    }

    /// Returns simulated distances of `m` new values from the same distribution.
    pub fn simulated(&self, m: usize, rng: &mut impl Rng) -> Vec<f64> {
        let mut draw = |count: usize| {
            let mut values: Vec<f64> = (0..count).map(|_| rng.random()).collect();
            values.sort_by(f64::total_cmp);
            values
        };
        let levels = self.quantiles.len();
        (0..SIMULATED).map(|_| distance(&Self::of(&draw(self.n), levels).values(), &draw(m))).collect()
    }

    /// Returns the distance between these values and the same values changed by `shift`.
    pub fn distance_of_shift(&self, shift: impl Fn(f64) -> f64) -> f64 {
        let mut shifted: Vec<f64> = self.values().into_iter().map(shift).collect();
        shifted.sort_by(f64::total_cmp);
        distance(&self.values(), &shifted)
    }
}

/// Returns the probability of a larger distance than the observed one, by simulated distances.
pub fn p_value(observed: f64, simulated: &[f64]) -> f64 {
    let equal = simulated.iter().filter(|distance| (**distance - observed).abs() <= EQUAL).count();
    let larger = simulated.iter().filter(|distance| **distance > observed + EQUAL).count();
    // The observed distance counts as one of the simulated distances, so the probability is never
    // 0.
    (larger as f64 + 0.5 * (equal + 1) as f64) / (simulated.len() + 1) as f64
}

/// Returns the distance beyond which samples of n and m values differ at a level (-), by the
/// asymptotic distribution of Smirnov: √(−½ ln(level/2)) · √((n + m)/(n·m)).
pub fn critical_distance(level: f64, n: usize, m: usize) -> f64 {
    factor(level) * (1.0 / n as f64 + 1.0 / m as f64).sqrt()
}

/// Returns the number of new values from which a distance is beyond the critical one, with `n`
/// earlier values. Returns `None` if no number suffices.
pub fn needed(level: f64, n: usize, distance: f64) -> Option<u64> {
    let inverse = (distance / factor(level)).powi(2) - 1.0 / n as f64;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
    let needed = (1.0 / inverse).ceil() as u64;
    (inverse > 0.0).then_some(needed)
}

fn factor(level: f64) -> f64 {
    (-0.5 * maths::ln(0.5 * level)).sqrt()
}

#[cfg(test)]
mod tests {
    use crate::Stream;
    use rand::SeedableRng;

    use super::*;

    #[test]
    fn distances_match_scipy() {
        // scipy.stats.ks_2samp([1, 2, 3, 4], [2.5, 3.5, 4.5]).statistic = 0.5; ties: ([1, 2, 2],
        // [2, 3]) = 0.5.
        assert!((distance(&[1.0, 2.0, 3.0, 4.0], &[2.5, 3.5, 4.5]) - 0.5).abs() < 1e-12);
        assert!((distance(&[1.0, 2.0, 2.0], &[2.0, 3.0]) - 0.5).abs() < 1e-12);
        assert_eq!(distance(&[1.0, 2.0], &[1.0, 2.0]), 0.0);
        assert_eq!(distance(&[1.0], &[2.0]), 1.0);
    }

    #[test]
    fn a_summary_gives_values_with_its_quantiles() {
        let summary = Summary::new(5, &[1.0, 2.0, 4.0]).unwrap();
        assert_eq!(summary.values(), [1.0, 1.5, 2.0, 3.0, 4.0]);
        assert_eq!(Summary::new(3, &[1.0, 2.0, 4.0]).unwrap().values(), [1.0, 2.0, 4.0]);
        assert_eq!(Summary::new(2, &[1.0, 2.0, 4.0]), None);
        assert_eq!(Summary::new(5, &[2.0, 1.0]), None);
        assert_eq!(Summary::new(5, &[f64::NAN, 1.0]), None);
    }

    #[test]
    fn values_of_another_distribution_have_a_small_p_value() {
        let summary = Summary::new(60, &[0.0, 1.0, 2.0, 3.0, 4.0]).unwrap();
        let simulated = summary.simulated(40, &mut Stream::seed_from_u64(1));
        let p_value = |offset: f64| {
            let new: Vec<f64> = (0..40).map(|k| offset + 0.1 * f64::from(k)).collect();
            p_value(summary.distance(&new), &simulated)
        };
        assert!(p_value(0.05) > 0.5 && p_value(2.0) < 0.005);
    }

    #[test]
    fn the_needed_number_makes_a_distance_critical() {
        for (n, distance) in [(50, 0.4), (400, 0.2), (10_000, 0.05)] {
            let m = usize::try_from(needed(0.05, n, distance).unwrap()).unwrap();
            assert!(critical_distance(0.05, n, m) <= distance && critical_distance(0.05, n, m - 1) > distance);
        }
        assert_eq!(needed(0.05, 10, 0.1), None);
    }
}
