//! An estimate with its interval.
//!
//! Both methods end with independent values whose mean is the probability: the weighted values of
//! single runs, or the estimates of independent repetitions. Their mean is unbiased, and its error
//! is nearly normal. The interval of a probability is symmetric in its logarithm, because weights
//! and products of shares are skewed to the right: the interval reaches further up than down, and
//! not below 0.

use serde::Serialize;
use statrs::distribution::{ContinuousCDF, StudentsT};

use closecall_traffic::maths::{exp, ln, powf};

/// Coverage of the reported intervals.
pub const COVERAGE: f64 = 0.95;

/// A mean of independent values.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Mean {
    /// The mean.
    pub value: f64,
    /// The standard error.
    pub standard_error: f64,
    /// Degrees of freedom of the standard error.
    pub degrees_of_freedom: f64,
}

impl Mean {
    /// Returns the mean of independent values; `None` of fewer than two.
    pub fn of(values: &[f64]) -> Option<Self> {
        if values.len() < 2 {
            return None;
        }
        let count = values.len() as f64;
        let value = values.iter().sum::<f64>() / count;
        let variance = values.iter().map(|sample| (sample - value) * (sample - value)).sum::<f64>() / (count - 1.0);
        Some(Self { value, standard_error: (variance / count).sqrt(), degrees_of_freedom: count - 1.0 })
    }

    /// Returns Student's factor for a one-sided bound.
    fn factor(&self, confidence: f64) -> f64 {
        StudentsT::new(0.0, 1.0, self.degrees_of_freedom)
            .map_or(f64::INFINITY, |student| student.inverse_cdf(confidence))
    }

    /// Returns true if the values have bounds: they scatter, and their mean is above 0.
    fn has_bounds(&self) -> bool {
        self.value > 0.0 && self.standard_error > 0.0
    }

    /// Returns true if every value is 1: each run had the event.
    fn is_certain(&self) -> bool {
        self.value >= 1.0 && self.standard_error == 0.0
    }

    /// Returns the two-sided interval of a probability; `None` if the mean is not above 0, or the
    /// values do not scatter and are not all 1.
    pub fn interval_of_probability(&self, coverage: f64) -> Option<[f64; 2]> {
        let one_sided = 0.5 * (1.0 + coverage);
        Some([self.lower_bound(one_sided)?, self.upper_bound(one_sided)?])
    }

    /// Returns the one-sided lower bound of a probability; `None` if the mean is not above 0.
    pub fn lower_bound(&self, confidence: f64) -> Option<f64> {
        if self.is_certain() {
            // A probability p gives n values of 1 with pⁿ.
            return Some(powf(1.0 - confidence, 1.0 / (self.degrees_of_freedom + 1.0)));
        }
        let low = || self.value * exp(-self.factor(confidence) * self.standard_error / self.value);
        self.has_bounds().then(|| low().min(1.0))
    }

    /// Returns the one-sided upper bound of a probability; `None` if the mean is not above 0.
    pub fn upper_bound(&self, confidence: f64) -> Option<f64> {
        let high = || self.value * exp(self.factor(confidence) * self.standard_error / self.value);
        (self.has_bounds() || self.is_certain()).then(|| high().min(1.0))
    }

    /// Returns a one-sided upper bound of the mean of values from 0 to `largest` that holds for any
    /// distribution of them: the mean need not be nearly normal. It is wide (A. Maurer and M.
    /// Pontil, *Empirical Bernstein Bounds and Sample-Variance Penalization*, COLT 2009, theorem
    /// 4).
    pub fn upper_bound_of_bounded(&self, largest: f64, confidence: f64) -> f64 {
        let log = ln(2.0 / (1.0 - confidence));
        // The term of the variance is √(2·V·log/n), and V/n is the square of the standard error.
        let of_variance = self.standard_error * (2.0 * log).sqrt();
        self.value + of_variance + 7.0 * log * largest / (3.0 * self.degrees_of_freedom)
    }

    /// Returns the two-sided interval of a quantity of either sign; `None` if the values do not
    /// scatter.
    pub fn interval(&self, coverage: f64) -> Option<[f64; 2]> {
        let half = self.factor(0.5 * (1.0 + coverage)) * self.standard_error;
        (half > 0.0).then_some([self.value - half, self.value + half])
    }

    /// Returns the width of the 95 % interval, relative to the value.
    pub fn relative_width(&self) -> f64 {
        2.0 * self.factor(0.5 * (1.0 + COVERAGE)) * self.standard_error / self.value.abs()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_of_few_values_is_students() {
        let mean = Mean::of(&[1.0, 2.0, 3.0, 4.0, 5.0]).unwrap();
        // t of 4 degrees of freedom at 97.5 %: 2.776.
        let half = 2.776 * (2.5_f64 / 5.0).sqrt();
        let [low, high] = mean.interval(0.95).unwrap();
        assert!((low - 3.0 + half).abs() < 1e-3 && (high - 3.0 - half).abs() < 1e-3);
        assert!((mean.relative_width() - 2.0 * half / 3.0).abs() < 1e-3);
    }

    #[test]
    fn the_interval_of_a_probability_is_never_below_zero() {
        let mean = Mean::of(&[1e-6, 0.0, 0.0, 2e-6, 9e-6]).unwrap();
        let [low, high] = mean.interval_of_probability(0.95).unwrap();
        assert!(0.0 < low && low < mean.value && mean.value < high);
        assert!(mean.interval(0.95).unwrap()[0] < 0.0, "a symmetric interval would reach below 0");
    }

    #[test]
    fn the_bound_for_any_distribution_holds_where_a_rare_large_value_is_missing() {
        // Values of 0.01, and of 10 with a probability of 1 %, which 100 draws miss in 37 % of all
        // cases: the mean is 0.11.
        let missed: Vec<f64> = (0..100).map(|index| if index % 2 == 0 { 0.01 } else { 0.011 }).collect();
        let mean = Mean::of(&missed).unwrap();
        assert!(mean.upper_bound(0.95).unwrap() < 0.011, "the normal bound does not know what it misses");
        // 7·ln(40)·10/(3·99) = 0.869.
        let bound = mean.upper_bound_of_bounded(10.0, 0.95);
        assert!((bound - 0.8801).abs() < 1e-3, "{bound}");
        let more: Vec<f64> = missed.iter().copied().cycle().take(10_000).collect();
        assert!(Mean::of(&more).unwrap().upper_bound_of_bounded(10.0, 0.95) < 0.02);
    }

    #[test]
    fn an_event_in_every_run_has_the_exact_bound_and_no_event_has_none() {
        // Six hundred events in six hundred runs do not show that the probability is 1.
        let always = Mean::of(&[1.0; 600]).unwrap();
        let [low, high] = always.interval_of_probability(0.95).unwrap();
        assert!((low - 0.993_871).abs() < 1e-6 && high == 1.0, "{low}");
        assert_eq!(always.interval(0.95), None);
        assert_eq!(Mean::of(&[0.0; 10]).unwrap().interval_of_probability(0.95), None);
        assert_eq!(Mean::of(&[1.0]), None);
        // Weights above 1 in every run: no bound is above 1.
        let weighted: Vec<f64> = (0..600).map(|index| if index % 2 == 0 { 1.0 } else { 1.1 }).collect();
        assert_eq!(Mean::of(&weighted).unwrap().interval_of_probability(0.95), Some([1.0; 2]));
    }
}
