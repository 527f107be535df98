//! Test of a filter's covariance: the mean NEES of many runs against its 95 % bounds.
//!
//! The statistic is the normalised estimation error squared (NEES) averaged over all steps of
//! independent runs. If the covariance is consistent, its expectation is the number of dimensions n
//! (Bar-Shalom, Li, Kirubarajan, *Estimation with Applications to Tracking and Navigation*, 2001,
//! section 5.4.2). The bounds are n ± t standard errors, where t is Student's quantile for the
//! number of runs. The standard error follows from the scatter of the runs about the mean, because
//! runs are independent while the steps of one run are correlated. Runs of several scenarios with
//! the same seed and sample have the same noise, and count as one run.
//!
//! The usual bounds for N independent values are the quantiles of χ²(n·N)/N. They require normal
//! errors. Here, a motion that switches between modes puts much of the sum into the few steps after
//! a switch. The bounds used here do not require normal errors, but widely scattered runs widen
//! them. Bounds wider than a quarter of n to either side are no evidence; the result is then
//! [`Credibility::Undecided`].

use statrs::distribution::{ContinuousCDF, StudentsT};

/// Probability of the upper bound of a two-sided 95 % interval.
const QUANTILE: f64 = 0.975;

/// Number of dimensions of the state `[x, y, vx, vy]`.
const DIMENSIONS: f64 = 4.0;

/// Maximum distance of the bounds from [`DIMENSIONS`] for a statement.
const MAX_HALF_WIDTH: f64 = 1.0;

/// The mean NEES of many runs with its confidence interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Consistency {
    /// Mean over all steps; its expectation is 4 if the covariance is consistent.
    pub mean: f64,
    /// Half of the width of the 95 % confidence interval.
    pub half_width: f64,
}

/// Verdict on a covariance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Credibility {
    /// The mean is within the 95 % bounds.
    Consistent,
    /// The mean is below the bounds: errors are smaller than the covariance says.
    Conservative,
    /// The mean is above the bounds: errors are larger than the covariance says.
    Overconfident,
    /// The mean is within the bounds, but these are too wide for a statement.
    Undecided,
}

impl Consistency {
    /// Combines the NEES values of independent runs. Returns `None` if fewer than two runs have
    /// any.
    pub fn of(runs: &[Vec<f64>]) -> Option<Self> {
        let runs: Vec<(f64, f64)> =
            runs.iter().filter(|run| !run.is_empty()).map(|run| (run.iter().sum::<f64>(), run.len() as f64)).collect();
        let count = runs.len() as f64;
        let student = StudentsT::new(0.0, 1.0, count - 1.0).ok()?;
        let steps: f64 = runs.iter().map(|(_, steps)| steps).sum();
        let mean = runs.iter().map(|(sum, _)| sum).sum::<f64>() / steps;
        // The variance of a ratio of two sums over runs, to first order.
        let squares: f64 = runs.iter().map(|(sum, steps)| (sum - mean * steps).powi(2)).sum();
        let standard_error = (squares * count / (count - 1.0)).sqrt() / steps;
        Some(Self { mean, half_width: student.inverse_cdf(QUANTILE) * standard_error })
    }

    /// Returns the two-sided 95 % bounds of the mean for a consistent covariance.
    pub fn bounds(&self) -> [f64; 2] {
        [DIMENSIONS - self.half_width, DIMENSIONS + self.half_width]
    }

    /// Returns the verdict that follows from the mean and the bounds.
    pub fn credibility(&self) -> Credibility {
        let [low, high] = self.bounds();
        if self.mean < low {
            Credibility::Conservative
        } else if self.mean <= high {
            if self.half_width <= MAX_HALF_WIDTH { Credibility::Consistent } else { Credibility::Undecided }
        } else {
            // A mean that is not a number also ends here, so that it never looks consistent.
            Credibility::Overconfident
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::{ActorId, StandardNormal, stream};
    use rand::distr::Distribution;

    use super::*;

    /// Draws runs of squared errors in four dimensions. Each dimension is a first-order process
    /// that keeps the share `memory` of the last step's value. Its variance is `variance` times the
    /// claimed one.
    fn runs(count: u64, memory: f64, variance: f64) -> Vec<Vec<f64>> {
        let run = |sample| {
            let mut rng = stream(1, sample, &ActorId::new("ego").unwrap(), "consistency");
            let mut draw = || -> f64 { StandardNormal.sample(&mut rng) };
            let mut errors: [f64; 4] = std::array::from_fn(|_| draw());
            (0..400)
                .map(|_| {
                    let fresh = (1.0 - memory * memory).sqrt();
                    errors.iter_mut().for_each(|error| *error = memory * *error + fresh * draw());
                    variance * errors.iter().map(|error| error * error).sum::<f64>()
                })
                .collect()
        };
        (0..count).map(run).collect()
    }

    /// Returns the number of `cases` with this verdict.
    fn count(cases: &[Consistency], credibility: Credibility) -> usize {
        cases.iter().filter(|case| case.credibility() == credibility).count()
    }

    #[test]
    fn consistent_errors_are_within_the_bounds_in_19_of_20_cases() {
        for (memory, runs_per_case) in [(0.0, 40), (0.9, 40), (0.9, 8)] {
            let all = runs(200 * runs_per_case as u64, memory, 1.0);
            let cases: Vec<_> = all.chunks(runs_per_case).map(|case| Consistency::of(case).unwrap()).collect();
            // 190 of 200 expected, with a standard deviation of 3.
            let consistent = count(&cases, Credibility::Consistent);
            assert!((181..=199).contains(&consistent), "memory {memory}: {consistent} of 200");
        }
    }

    #[test]
    fn runs_are_weighted_by_their_number_of_steps() {
        let all: Vec<Vec<f64>> =
            runs(8_000, 0.5, 1.0).into_iter().enumerate().map(|(run, nees)| nees[..10 + run % 390].to_vec()).collect();
        let cases: Vec<_> = all.chunks(40).map(|case| Consistency::of(case).unwrap()).collect();
        let consistent = count(&cases, Credibility::Consistent);
        assert!((181..=199).contains(&consistent), "{consistent} of 200");
        let consistency = Consistency::of(&[vec![2.0; 30], vec![8.0; 10]]).unwrap();
        assert_eq!(consistency.mean, 3.5);
    }

    #[test]
    fn correlated_steps_widen_the_interval() {
        let [without, with] = [0.0, 0.9].map(|memory| Consistency::of(&runs(400, memory, 1.0)).unwrap());
        // Squares of a process with a memory of 0.9 are correlated by 0.81 per step, so (1 +
        // 0.81)/(1 − 0.81) = 9.5 steps count as one independent value.
        let expected = 1.966 * (2.0 * DIMENSIONS / 160_000.0).sqrt();
        assert!((0.9..1.1).contains(&(without.half_width / expected)), "{without:?}");
        assert!((0.9..1.1).contains(&(with.half_width / (9.5_f64.sqrt() * expected))), "{with:?}");
    }

    #[test]
    fn wrong_covariances_are_detected() {
        let with_variance = |variance| Consistency::of(&runs(40, 0.9, variance)).unwrap();
        assert_eq!(with_variance(0.8).credibility(), Credibility::Conservative);
        assert_eq!(with_variance(1.25).credibility(), Credibility::Overconfident);
        assert_eq!(Consistency { mean: f64::NAN, ..with_variance(1.0) }.credibility(), Credibility::Overconfident);
    }

    #[test]
    fn a_few_outlying_runs_leave_the_verdict_undecided() {
        let mut all = runs(40, 0.9, 1.0);
        for run in [3, 17] {
            all[run].iter_mut().for_each(|nees| *nees += 100.0);
        }
        let consistency = Consistency::of(&all).unwrap();
        assert_eq!(consistency.credibility(), Credibility::Undecided, "{consistency:?}");
    }

    #[test]
    fn fewer_than_two_runs_give_no_result() {
        assert_eq!(Consistency::of(&[]), None);
        assert_eq!(Consistency::of(&runs(1, 0.0, 1.0)), None);
        assert_eq!(Consistency::of(&[vec![4.0; 10], Vec::new()]), None);
    }
}
