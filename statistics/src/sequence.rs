//! A confidence sequence of a probability: bounds that hold at every number of samples at once.
//!
//! Whoever looks after each sample, and stops at the first favourable moment, passes off chance for evidence if the
//! bound holds at one fixed n only. These bounds hold at all n together: with probability C no one of them, ever, has
//! the truth on its wrong side.
//!
//! ```text
//!   M⁻(p) = (1/p)·∫₀ᵖ θᵏ(1 − θ)ⁿ⁻ᵏ dθ / (pᵏ(1 − p)ⁿ⁻ᵏ) = P(X ≥ k + 1 of n + 1 samples) / ((n + 1)·p·P(X = k of n))
//! ```
//!
//! M⁻(p) bets on every probability below p alike, against p. Where the truth is p it is a martingale that starts at 1,
//! and where it lies above, a supermartingale: by Ville's inequality it ever reaches 1/(1 − C) with probability 1 − C at
//! most. The upper bound at n samples is the smallest p that M⁻ has refuted so far; M⁺ does the same from above.
//!
//! Ville, *Étude critique de la notion de collectif* (1939); H. Robbins, *Statistical methods related to the law of the
//! iterated logarithm*, Ann. Math. Stat. 41 (1970) 1397–1409; S. R. Howard, A. Ramdas, J. McAuliffe and J. Sekhon,
//! *Time-uniform, nonparametric, nonasymptotic confidence sequences*, Ann. Stat. 49 (2021) 1055–1080, whose beta-binomial
//! mixture this is, with the mixture cut at p, so that each side spends its error on its own alternatives alone.

use super::binomial::{at_most, probability, upper_tail_over_first};
use super::interval::bisect;

/// The evidence of `hits` in `samples` that the probability is below `p`: how much a bet on that has multiplied its
/// stake. NaN where `p` is not in (0, 1).
pub fn evidence_below(hits: u64, samples: u64, p: f64) -> f64 {
    if !(p > 0.0 && p < 1.0) || hits > samples {
        return f64::NAN;
    }
    let (k, n) = (hits as f64, samples as f64);
    if k + 1.0 >= (n + 1.0) * p {
        // Tail and single probability may both be too small for a number; their ratio is not.
        return upper_tail_over_first(hits + 1, samples + 1, p) / (k + 1.0);
    }
    (1.0 - at_most(hits, samples + 1, p)) / ((n + 1.0) * p * probability(hits, samples, p))
}

/// The evidence that the probability is above `p`. NaN where `p` is not in (0, 1).
pub fn evidence_above(hits: u64, samples: u64, p: f64) -> f64 {
    if hits > samples { f64::NAN } else { evidence_below(samples - hits, samples, 1.0 - p) }
}

/// True where the evidence is enough for `confidence`; NaN is none.
pub fn is_certain(evidence: f64, confidence: f64) -> bool {
    evidence * (1.0 - confidence) >= 1.0
}

/// The upper bound after `samples` samples: the truth lies above it at any time with probability 1 − `confidence` at
/// most. NaN where `confidence` is not in (0, 1).
pub fn upper_bound(hits: u64, samples: u64, confidence: f64) -> f64 {
    if !(confidence > 0.0 && confidence < 1.0) {
        return f64::NAN;
    }
    // The evidence against p grows with p.
    let (_, above) = bisect(0.0, 1.0, |p| !is_certain(evidence_below(hits, samples, p), confidence));
    above
}

/// The lower bound after `samples` samples, the mirror image of [`upper_bound`].
pub fn lower_bound(hits: u64, samples: u64, confidence: f64) -> f64 {
    if !(confidence > 0.0 && confidence < 1.0) {
        return f64::NAN;
    }
    let (below, _) = bisect(0.0, 1.0, |p| is_certain(evidence_above(hits, samples, p), confidence));
    below
}

/// The two-sided bounds, with half of 1 − `confidence` on either side.
pub fn interval(hits: u64, samples: u64, confidence: f64) -> [f64; 2] {
    let one_sided = 0.5 * (1.0 + confidence);
    [lower_bound(hits, samples, one_sided), upper_bound(hits, samples, one_sided)]
}
