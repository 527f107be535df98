//! Exact bounds of a probability for a number of samples that is fixed in advance.
//!
//! C. J. Clopper and E. S. Pearson, *The use of confidence or fiducial limits illustrated in the
//! case of the binomial*, Biometrika 26 (1934) 404–413. A bound holds in at least the stated
//! fraction of campaigns, whatever the true probability is. This guarantee is lost if the bound is
//! inspected during a campaign and decides when to stop; see [`super::sequence`] for that case.

use super::binomial::{at_least, at_most};
use crate::maths;

/// Returns the one-sided upper bound: the smallest probability at which at most `hits` hits in
/// `samples` samples would occur with a probability of 1 − `confidence` or less. The true
/// probability lies above it in at most a fraction of 1 − `confidence` of all campaigns.
///
/// Returns 1 if there are no samples, and NaN if `confidence` is not in (0, 1).
pub fn upper_bound(hits: u64, samples: u64, confidence: f64) -> f64 {
    let error = 1.0 - confidence;
    if !(error > 0.0 && error < 1.0) {
        return f64::NAN;
    }
    if hits >= samples {
        return 1.0;
    }
    if hits == 0 {
        // (1 − p)ⁿ = 1 − C.
        return -maths::exp_m1(maths::ln(error) / samples as f64);
    }
    let estimate = hits as f64 / samples as f64;
    bisect(estimate, 1.0, |p| at_most(hits, samples, p) > error).high
}

/// Returns the one-sided lower bound: the largest probability at which at least `hits` hits in
/// `samples` samples would occur with a probability of 1 − `confidence` or less.
///
/// Returns 0 if there are no samples, and NaN if `confidence` is not in (0, 1).
pub fn lower_bound(hits: u64, samples: u64, confidence: f64) -> f64 {
    let error = 1.0 - confidence;
    if !(error > 0.0 && error < 1.0) {
        return f64::NAN;
    }
    if hits == 0 {
        return 0.0;
    }
    if hits >= samples {
        // pⁿ = 1 − C.
        return maths::exp(maths::ln(error) / samples as f64);
    }
    let estimate = hits as f64 / samples as f64;
    bisect(0.0, estimate, |p| at_least(hits, samples, p) < error).low
}

/// Coverage of the reported intervals: the least share of repetitions in which they contain the
/// true probability.
pub const COVERAGE: f64 = 0.95;

/// Returns the two-sided interval \[lower bound, upper bound\]. Each side has an error probability
/// of half of 1 − `confidence`.
pub fn clopper_pearson(hits: u64, samples: u64, confidence: f64) -> [f64; 2] {
    let one_sided = 0.5 * (1.0 + confidence);
    [lower_bound(hits, samples, one_sided), upper_bound(hits, samples, one_sided)]
}

/// Two neighbouring floating-point numbers.
pub(super) struct Bracket {
    pub(super) low: f64,
    pub(super) high: f64,
}

/// Finds the point between `low` and `high` at which `is_low` changes from true to false, by
/// bisection.
///
/// Returns the two neighbouring numbers around it: `is_low` holds at the lower number and not at
/// the upper number, unless they are the ends of the interval.
pub(super) fn bisect(low: f64, high: f64, is_low: impl Fn(f64) -> bool) -> Bracket {
    let (mut low, mut high) = (low, high);
    loop {
        let middle = 0.5 * (low + high);
        if !(low < middle && middle < high) {
            return Bracket { low, high };
        }
        if is_low(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
}
