//! Estimates from independent replicates, with intervals.
//!
//! A smooth function of sums, such as a ratio of variances, is evaluated on the sums of all
//! replicates, and again without each of them. The mean of the pseudo-values is the estimate
//! without its bias of the order of one over the number of replicates. The spread of the
//! pseudo-values gives the standard error of the estimate (J. W. Tukey, Annals of Mathematical
//! Statistics 29 (1958) 614; B. Efron and C. Stein, Annals of Statistics 9 (1981) 586–596). The
//! interval is Student's.
//!
//! The points of one scrambled low-discrepancy sequence depend on each other. A bootstrap, which
//! resamples them, therefore overstates the error. Independent scramblings do not depend on each
//! other. For their mean, Student's interval keeps its coverage better than the other usual
//! intervals, the bootstrap included (P. L'Ecuyer, M. K. Nakayama, A. B. Owen and B. Tuffin,
//! *Confidence intervals for randomized quasi-Monte Carlo estimators*, Winter Simulation Conference
//! 2023).

use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::maths;
use crate::statistics::interval::COVERAGE;

/// Number of replicates into which samples are divided. Student's factor is then 4 % above its
/// value for infinitely many replicates.
pub const REPLICATES: usize = 32;

/// An estimate with its interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The estimate.
    pub value: f64,
    /// The 95 % interval. Unless it is [bounded](Self::within), it may reach beyond the range of
    /// the quantity, such as below 0 for a share.
    pub interval_95: [f64; 2],
}

impl Estimate {
    /// Returns the estimate in `interval_95`, which is found in another way: the value is moved to
    /// its nearer end if it lies outside.
    #[must_use]
    pub fn with_interval(self, interval_95: [f64; 2]) -> Self {
        let [low, high] = interval_95;
        Self { value: self.value.max(low).min(high), interval_95 }
    }

    /// Returns the estimate of a quantity that has no value outside `range`.
    #[must_use]
    pub fn within(self, range: [f64; 2]) -> Self {
        self.with_interval(self.interval_95.map(|bound| bound.max(range[0]).min(range[1])))
    }

    /// Returns true if the interval contains `truth`.
    pub fn covers(&self, truth: f64) -> bool {
        self.interval_95[0] <= truth && truth <= self.interval_95[1]
    }
}

/// Estimates `function` of the sums over all replicates. `None` if the function has no value for
/// the sums of all replicates or of all but one, or if there are fewer than two replicates.
pub fn jackknife<const K: usize>(
    replicates: &[[f64; K]],
    function: impl Fn(&[f64; K]) -> Option<f64>,
) -> Option<Estimate> {
    let count = replicates.len() as f64;
    let mut all = [0.0; K];
    for replicate in replicates {
        for (sum, term) in all.iter_mut().zip(replicate) {
            *sum += term;
        }
    }
    let of_all = function(&all)?;
    let pseudo_value = |replicate: &[f64; K]| {
        let mut others = all;
        for (sum, term) in others.iter_mut().zip(replicate) {
            *sum -= term;
        }
        Some(count * of_all - (count - 1.0) * function(&others)?)
    };
    student(&replicates.iter().map(pseudo_value).collect::<Option<Vec<f64>>>()?)
}

/// Estimates the mean of independent values, with Student's interval; `None` of fewer than two
/// values.
pub fn student(values: &[f64]) -> Option<Estimate> {
    if values.len() < 2 {
        return None;
    }
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0);
    let half_width = student_factor(values.len()) * (variance / count).sqrt();
    let estimate = Estimate { value: mean, interval_95: [mean - half_width, mean + half_width] };
    (mean.is_finite() && half_width.is_finite()).then_some(estimate)
}

/// Estimates the mean of independent magnitudes, which are not negative; `None` of fewer than two
/// values, or of a negative one.
///
/// Its interval is Student's for the logarithm of the mean: it is the mean divided and multiplied
/// by `exp(t s / mean)`, where `s` is the standard error (K. P. Burnham, D. R. Anderson, G. C.
/// White, C. Brownie and K. H. Pollock, *Design and analysis methods for fish survival experiments
/// based on release-recapture*, American Fisheries Society Monograph 5 (1987) 212). It has no value
/// below 0, and contains the mean. So does the percentile bootstrap, but it covers less: of 10
/// exponential values 84 instead of 93 %, and of the magnitudes of 10 normal ones 88 instead of 95
/// %.
pub fn magnitude(values: &[f64]) -> Option<Estimate> {
    let Estimate { value, interval_95: [_, high] } =
        student(values).filter(|_| values.iter().all(|one| *one >= 0.0))?;
    let factor = if value > 0.0 { maths::exp((high - value) / value) } else { 1.0 };
    Some(Estimate { value, interval_95: [value / factor, value * factor] })
}

/// Returns the factor of the standard error of a mean of `count` values, two or more.
fn student_factor(count: usize) -> f64 {
    match StudentsT::new(0.0, 1.0, count as f64 - 1.0) {
        Ok(distribution) => distribution.inverse_cdf(0.5 * (1.0 + COVERAGE)),
        Err(_) => f64::NAN,
    }
}

#[cfg(test)]
mod tests {
    use rand::rngs::StdRng;
    use rand::{RngExt as _, SeedableRng as _};

    use super::*;

    #[test]
    fn the_interval_of_a_magnitude_does_not_begin_below_0_and_covers_the_mean() {
        // One event in ten: Student's interval begins below 0.
        let rare: Vec<f64> = (0..10).map(|index| if index == 0 { 2.0 } else { 0.0 }).collect();
        assert!(student(&rare).unwrap().interval_95[0] < 0.0);
        let estimate = magnitude(&rare).unwrap();
        assert!(0.0 < estimate.interval_95[0] && estimate.covers(estimate.value), "{estimate:?}");
        assert_eq!(magnitude(&[0.0, 0.0, 0.0]).unwrap().interval_95, [0.0, 0.0]);
        assert_eq!(magnitude(&[1.0, -1.0]), None, "no magnitude");
        // Exponential values of mean 1, by the quantiles of independent streams: 92.6 % of the
        // intervals contain it.
        let mut rng = StdRng::seed_from_u64(1);
        let mut draw = || -maths::ln(1.0 - rng.random::<f64>());
        let covered = (0..2_000).filter(|_| {
            let values: Vec<f64> = (0..10).map(|_| draw()).collect();
            magnitude(&values).unwrap().covers(1.0)
        });
        let covered = covered.count();
        // A share of 0.926 has a standard error of 0.006.
        assert!((1_815..1_890).contains(&covered), "{covered}");
    }

    #[test]
    fn a_mean_has_the_textbook_interval() {
        // t of 4 degrees of freedom at 97.5 %: 2.776; standard deviation of 1 to 5: 1.5811.
        let estimate = student(&[1.0, 2.0, 3.0, 4.0, 5.0]).unwrap();
        assert_eq!(estimate.value, 3.0);
        assert!((estimate.interval_95[1] - 3.0 - 2.776 * 1.5811 / 5.0_f64.sqrt()).abs() < 1e-3);
        assert_eq!(student(&[1.0]), None);
    }

    #[test]
    fn an_estimate_never_lies_outside_its_interval_nor_a_rate_below_zero() {
        let below = Estimate { value: -0.004, interval_95: [-0.01, 0.002] };
        let moved = below.with_interval([0.0, 0.811]);
        assert_eq!((moved.value, moved.interval_95), (0.0, [0.0, 0.811]));
        let rate = Estimate { value: 0.01, interval_95: [-0.02, 0.04] }.within([0.0, 1.0]);
        assert_eq!((rate.value, rate.interval_95), (0.01, [0.0, 0.04]));
        let certain = Estimate { value: 1.0, interval_95: [1.0, 1.0] }.within([0.0, 1.0]);
        assert_eq!((certain.value, certain.interval_95), (1.0, [1.0, 1.0]));
    }

    #[test]
    fn the_jackknife_of_a_mean_is_the_mean_of_the_replicates() {
        let replicates: Vec<[f64; 2]> = [1.0, 2.0, 4.0, 9.0].iter().map(|sum| [*sum, 1.0]).collect();
        let estimate = jackknife(&replicates, |[sum, count]| Some(sum / count)).unwrap();
        let direct = student(&[1.0, 2.0, 4.0, 9.0]).unwrap();
        assert!((estimate.value - direct.value).abs() < 1e-12);
        assert!((estimate.interval_95[0] - direct.interval_95[0]).abs() < 1e-12);
    }

    #[test]
    fn a_function_without_a_value_for_all_but_one_replicate_has_no_estimate() {
        let replicates = [[1.0, 0.0], [1.0, 2.0]];
        let ratio = |[above, below]: &[f64; 2]| (*below > 0.0).then(|| above / below);
        assert_eq!(jackknife(&replicates, ratio), None);
    }
}
