//! Exact bounds of a probability, from a number of samples that was fixed in advance.
//!
//! C. J. Clopper and E. S. Pearson, *The use of confidence or fiducial limits illustrated in the case of the binomial*,
//! Biometrika 26 (1934) 404–413. A bound covers the truth in at least the stated share of campaigns, whatever the truth
//! is. Whoever looks at it on the way, and stops when it pleases, loses that: see [`super::sequence`].

use super::binomial::{at_least, at_most};

/// The least probability that `hits` or fewer of `samples` would be rarer than 1 − `confidence` at: the probability lies
/// above it in at most that share of campaigns. Of no samples nothing is known: 1. NaN where `confidence` is not in (0, 1).
pub fn upper_bound(hits: u64, samples: u64, confidence: f64) -> f64 {
    let rare = 1.0 - confidence;
    if !(rare > 0.0 && rare < 1.0) {
        return f64::NAN;
    }
    if hits >= samples {
        return 1.0;
    }
    if hits == 0 {
        // (1 − p)ⁿ = 1 − C.
        return -(rare.ln() / samples as f64).exp_m1();
    }
    let estimate = hits as f64 / samples as f64;
    let (_, above) = bisect(estimate, 1.0, |p| at_most(hits, samples, p) > rare);
    above
}

/// The largest probability that `hits` or more of `samples` would be rarer than 1 − `confidence` at. Of no samples
/// nothing is known: 0. NaN where `confidence` is not in (0, 1).
pub fn lower_bound(hits: u64, samples: u64, confidence: f64) -> f64 {
    let rare = 1.0 - confidence;
    if !(rare > 0.0 && rare < 1.0) {
        return f64::NAN;
    }
    if hits == 0 {
        return 0.0;
    }
    if hits >= samples {
        // pⁿ = 1 − C.
        return (rare.ln() / samples as f64).exp();
    }
    let estimate = hits as f64 / samples as f64;
    let (below, _) = bisect(0.0, estimate, |p| at_least(hits, samples, p) < rare);
    below
}

/// Coverage of the intervals that are reported: the least share of repetitions in which they contain the true
/// probability.
pub const COVERAGE: f64 = 0.95;

/// The two-sided interval, with half of 1 − `confidence` on either side.
pub fn clopper_pearson(hits: u64, samples: u64, confidence: f64) -> [f64; 2] {
    let one_sided = 0.5 * (1.0 + confidence);
    [lower_bound(hits, samples, one_sided), upper_bound(hits, samples, one_sided)]
}

/// Narrows [low, high] down to neighbouring numbers: `is_low` holds from `low` on, up to the one returned first.
pub(super) fn bisect(low: f64, high: f64, is_low: impl Fn(f64) -> bool) -> (f64, f64) {
    let (mut low, mut high) = (low, high);
    loop {
        let middle = 0.5 * (low + high);
        if !(low < middle && middle < high) {
            return (low, high);
        }
        if is_low(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
}
