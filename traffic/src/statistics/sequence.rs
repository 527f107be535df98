//! A confidence sequence of a probability: bounds that hold at every number of samples at once.
//!
//! If a bound holds at one fixed number of samples only, inspecting it after each sample and
//! stopping at the first favourable result mistakes chance for evidence. The bounds of this module
//! hold at all numbers of samples together: with a probability of C or more, all of them contain
//! the true probability.
//!
//! ```text
//!   M⁻(p) = (1/p)·∫₀ᵖ θᵏ(1 − θ)ⁿ⁻ᵏ dθ / (pᵏ(1 − p)ⁿ⁻ᵏ) = P(X ≥ k + 1 of n + 1 samples) / ((n + 1)·p·P(X = k of n))
//! ```
//!
//! k is the number of hits in n samples, C the confidence. M⁻(p) is the wealth of a bet against p
//! that spreads its stake evenly over all probabilities below p. If the true probability is p,
//! M⁻(p) is a martingale that starts at 1; if it is above p, M⁻(p) is a supermartingale. By Ville's
//! inequality, M⁻(p) then ever reaches 1/(1 − C) with a probability of at most 1 − C. The upper
//! bound at n samples is the smallest p for which M⁻(p) has reached this value; M⁺ gives the lower
//! bound in the same way.
//!
//! Ville, *Étude critique de la notion de collectif* (1939); H. Robbins, *Statistical methods
//! related to the law of the iterated logarithm*, Ann. Math. Stat. 41 (1970) 1397–1409; S. R.
//! Howard, A. Ramdas, J. McAuliffe and J. Sekhon, *Time-uniform, nonparametric, nonasymptotic
//! confidence sequences*, Ann. Stat. 49 (2021) 1055–1080, whose beta-binomial mixture this is. The
//! mixture is cut at p: each side then spends its error probability on its own alternatives only.

use super::binomial::{at_most, probability, upper_tail_ratio};
use super::interval::bisect;

/// Returns the evidence M⁻(p) of `hits` in `samples` that the probability is below `p`: the factor
/// by which a bet on that has multiplied its stake. Returns NaN if `p` is not in (0, 1), or if
/// `hits` exceeds `samples`.
pub fn evidence_below(hits: u64, samples: u64, p: f64) -> f64 {
    if !(p > 0.0 && p < 1.0) || hits > samples {
        return f64::NAN;
    }
    let (k, n) = (hits as f64, samples as f64);
    if k + 1.0 >= (n + 1.0) * p {
        // The tail and the single probability may both underflow, but not their ratio.
        return upper_tail_ratio(hits + 1, samples + 1, p) / (k + 1.0);
    }
    (1.0 - at_most(hits, samples + 1, p)) / ((n + 1.0) * p * probability(hits, samples, p))
}

/// Returns the evidence M⁺(p) of `hits` in `samples` that the probability is above `p`. Returns NaN
/// if `p` is not in (0, 1), or if `hits` exceeds `samples`.
pub fn evidence_above(hits: u64, samples: u64, p: f64) -> f64 {
    if hits > samples { f64::NAN } else { evidence_below(samples - hits, samples, 1.0 - p) }
}

/// Returns whether the evidence suffices for `confidence`. NaN never suffices.
pub fn is_certain(evidence: f64, confidence: f64) -> bool {
    evidence * (1.0 - confidence) >= 1.0
}

/// Returns the one-sided upper bound after `samples` samples. The probability that the true value
/// ever lies above this bound is at most 1 − `confidence`. Returns NaN if `confidence` is not in
/// (0, 1).
pub fn upper_bound(hits: u64, samples: u64, confidence: f64) -> f64 {
    if !(confidence > 0.0 && confidence < 1.0) {
        return f64::NAN;
    }
    // The evidence against p grows with p.
    bisect(0.0, 1.0, |p| !is_certain(evidence_below(hits, samples, p), confidence)).high
}

/// Returns the one-sided lower bound after `samples` samples: the mirror image of [`upper_bound`].
pub fn lower_bound(hits: u64, samples: u64, confidence: f64) -> f64 {
    if !(confidence > 0.0 && confidence < 1.0) {
        return f64::NAN;
    }
    bisect(0.0, 1.0, |p| is_certain(evidence_above(hits, samples, p), confidence)).low
}

/// Returns the two-sided interval \[lower bound, upper bound\]. Each side has an error probability
/// of half of 1 − `confidence`.
pub fn interval(hits: u64, samples: u64, confidence: f64) -> [f64; 2] {
    let one_sided = 0.5 * (1.0 + confidence);
    [lower_bound(hits, samples, one_sided), upper_bound(hits, samples, one_sided)]
}
