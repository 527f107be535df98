//! A test whether new values come from a distribution that was fitted to earlier values. It is a
//! two-sample Kolmogorov–Smirnov test that compares the distribution functions where both are known:
//! at the quantiles of the earlier values.
//!
//! ```text
//!   share of values
//!   0.3 ┤        ┌── new values, of any number
//!       │   ┌────┘ ↕ D: the largest difference at a quantile
//!   0.2 ┤───●──────
//!       │   quantile of the earlier values at 0.2
//! ```
//!
//! Nothing is assumed about the values between two quantiles, so that any number of values of any
//! distribution agrees with its own quantiles. If many values are equal to a quantile, its probability
//! may lie anywhere between the shares below it and up to it.
//!
//! The distribution of D without drift is simulated: n and m uniform values are drawn, the n values
//! are reduced to the same number of quantiles, and D is computed in the same way. As for every
//! Kolmogorov–Smirnov test, the distribution of the values does not matter. The p-value is the share
//! of the simulated D that are larger, plus half of the share that are equal: D takes few values if
//! the samples are small, and the test would otherwise find less drift than its level allows.

use rand::{Rng, RngExt};

use crate::maths;
use crate::statistics::quantiles::quantile;

/// Number of simulated distances.
const SIMULATED: usize = 999;
/// Difference below which two distances count as equal.
const EQUAL: f64 = 1e-9;

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

    /// Returns the distance of `new` sorted values (-): the largest difference between the probability
    /// of a quantile and the share of the new values up to it.
    pub fn distance(&self, new: &[f64]) -> f64 {
        let share = |values: usize| values as f64 / new.len() as f64;
        let below = |x: f64| share(new.partition_point(|value| *value < x));
        let up_to = |x: f64| share(new.partition_point(|value| *value <= x));
        self.largest_difference(self.quantiles.iter().map(|quantile| [below(*quantile), up_to(*quantile)]))
    }

    /// Returns the largest difference between the probabilities of the quantiles and the shares of
    /// values below each of them and up to it.
    fn largest_difference(&self, shares: impl Iterator<Item = [f64; 2]>) -> f64 {
        let last = (self.quantiles.len() - 1) as f64;
        let differences = (0_u32..).zip(shares).map(|(level, [below, up_to])| {
            let probability = f64::from(level) / last;
            (below - probability).max(probability - up_to)
        });
        differences.fold(0.0, f64::max)
    }

    /// Returns simulated distances of `m` new values from the same distribution, in ascending order.
    pub fn simulated(&self, m: usize, rng: &mut impl Rng) -> Vec<f64> {
        let levels = self.quantiles.len();
        let mut distance = || {
            let mut values: Vec<f64> = (0..self.n).map(|_| rng.random()).collect();
            values.sort_unstable_by(f64::total_cmp);
            let summary = Self::of(&values, levels);
            // Number of new values between two quantiles.
            let mut between = vec![0_usize; levels + 1];
            (0..m).map(|_| rng.random()).for_each(|new: f64| {
                between[summary.quantiles.partition_point(|quantile| *quantile < new)] += 1;
            });
            let mut up_to = 0;
            summary.largest_difference(between.iter().take(levels).map(|values| {
                up_to += values;
                [up_to as f64 / m as f64; 2]
            }))
        };
        let mut distances: Vec<f64> = (0..SIMULATED).map(|_| distance()).collect();
        distances.sort_by(f64::total_cmp);
        distances
    }

    /// Returns the distance between these values and the same values changed by `shift`. Between two
    /// quantiles, the values are taken as evenly spread.
    pub fn distance_of_shift(&self, shift: impl Fn(f64) -> f64) -> f64 {
        let mut shifted: Vec<f64> = self.values().into_iter().map(shift).collect();
        shifted.sort_by(f64::total_cmp);
        self.distance(&shifted)
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

/// Returns the distance beyond which the p-value is below `level`, by simulated distances in ascending
/// order (-).
pub fn critical_distance(simulated: &[f64], level: f64) -> f64 {
    let first = simulated.partition_point(|distance| p_value(*distance + 2.0 * EQUAL, simulated) >= level);
    simulated.get(first).or(simulated.last()).copied().unwrap_or(1.0)
}

/// Returns the factor by which samples differ at a level beyond √((n + m)/(n·m)), by the asymptotic
/// distribution of Smirnov (-): √(−½ ln(level/2)).
pub fn asymptotic_factor(level: f64) -> f64 {
    (-0.5 * maths::ln(0.5 * level)).sqrt()
}

/// Returns the factor to which a critical distance of samples of n and m values belongs (-).
pub fn factor(critical_distance: f64, n: usize, m: usize) -> f64 {
    critical_distance / (1.0 / n as f64 + 1.0 / m as f64).sqrt()
}

/// Returns the number of new values from which a distance is beyond the critical one, with `n`
/// earlier values, by the factor of critical distances. Returns `None` if no number suffices.
pub fn needed(factor: f64, n: usize, distance: f64) -> Option<u64> {
    let inverse = (distance / factor).powi(2) - 1.0 / n as f64;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
    let needed = (1.0 / inverse).ceil() as u64;
    (inverse > 0.0).then_some(needed)
}

#[cfg(test)]
mod tests {
    use crate::Stream;
    use rand::SeedableRng;

    use super::*;

    #[test]
    fn distances_are_differences_at_the_quantiles() {
        let summary = Summary::new(40, &[0.0, 1.0, 2.0, 3.0, 4.0]).unwrap();
        assert_eq!(summary.distance(&[0.5, 1.5, 2.5, 3.5]), 0.0);
        // 3 of 4 values are up to the first quartile.
        assert_eq!(summary.distance(&[0.5, 0.6, 0.7, 3.5]), 0.5);
        // What lies beyond the smallest and the largest earlier value counts, too.
        assert_eq!([summary.distance(&[-1.0]), summary.distance(&[5.0])], [1.0, 1.0]);
        // Equal values: the shares of 1 are 0.25 to 0.75, and hold the probabilities of all its quantiles.
        let tied = Summary::new(40, &[0.0, 1.0, 1.0, 1.0, 4.0]).unwrap();
        assert_eq!(tied.distance(&[0.0, 1.0, 1.0, 4.0]), 0.0);
        assert_eq!(tied.distance(&[0.0, 2.0, 2.0, 4.0]), 0.5);
    }

    #[test]
    fn any_number_of_values_agrees_with_its_own_quantiles() {
        // Far from linear between two quantiles: few values, most of them near the ends, and a tail.
        let shapes: [fn(f64) -> f64; 3] =
            [|u| (5.0 * u).floor() + 0.01 * u, |u| 1.0 / (1.001 - u), |u| (u - 0.5).powi(9)];
        for (shape, n) in shapes.into_iter().flat_map(|shape| [12, 400, 20_000].map(|n| (shape, n))) {
            let values: Vec<f64> = (0..n).map(|k| shape((f64::from(k) + 0.5) / f64::from(n))).collect();
            let summary = Summary::of(&values, 11);
            let distance = summary.distance(&values);
            assert!(distance <= 1.0 / f64::from(n), "{n}: {distance}");
            let simulated = summary.simulated(values.len(), &mut Stream::seed_from_u64(1));
            assert!(p_value(distance, &simulated) > 0.9);
            // What must not pass: one value in five is another one.
            let mut others = values.clone();
            others.iter_mut().step_by(5).for_each(|value| *value = values[values.len() - 1] + 1.0);
            others.sort_by(f64::total_cmp);
            let p_value = p_value(summary.distance(&others), &simulated);
            assert_eq!(p_value < 0.01, n > 12, "{n}: {p_value}");
        }
    }

    #[test]
    fn a_distance_beyond_the_critical_one_has_a_p_value_below_the_level() {
        let summary = Summary::new(60, &[0.0, 1.0, 2.0, 3.0, 4.0]).unwrap();
        let simulated = summary.simulated(40, &mut Stream::seed_from_u64(1));
        for level in [0.05, 0.01] {
            let critical = critical_distance(&simulated, level);
            assert!(p_value(critical + 1e-6, &simulated) < level && p_value(critical - 1e-6, &simulated) >= level);
            // With few points of comparison, less than the distance of Smirnov.
            let factor = factor(critical, 60, 40);
            assert!((0.6..=1.0).contains(&(factor / asymptotic_factor(level))), "{factor}");
        }
        assert!(critical_distance(&simulated, 1e-9) >= *simulated.last().unwrap());
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
        let factor_of_level = asymptotic_factor(0.05);
        for (n, distance) in [(50, 0.4), (400, 0.2), (10_000, 0.05)] {
            let m = usize::try_from(needed(factor_of_level, n, distance).unwrap()).unwrap();
            assert!(factor(distance, n, m) >= factor_of_level && factor(distance, n, m - 1) < factor_of_level);
        }
        assert_eq!(needed(factor_of_level, 10, 0.1), None);
    }
}
