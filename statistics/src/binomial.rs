//! Probabilities of the binomial distribution.
//!
//! A single probability is computed by its deviance and the error of Stirling's formula, after C. Loader, *Fast and
//! accurate computation of binomial probabilities* (2000): differences of large logarithms, which would cost half of
//! the digits at a million samples, do not occur. A tail is the sum of single probabilities, each a simple multiple of
//! its neighbour; the sum is over positive terms alone, and stops where they no longer count.

use std::f64::consts::PI;

/// From here on Stirling's series has all digits; below, factorials are exact.
const SERIES_FROM: u64 = 16;

/// Largest relative distance between a count and its mean at which the deviance is summed up as a series.
const NEAR: f64 = 0.1;

/// By how much ln n! exceeds Stirling's formula ln √(2πn) + n·ln n − n.
fn stirling_error(n: u64) -> f64 {
    let x = n as f64;
    if n < SERIES_FROM {
        let factorial: f64 = (1..=n).map(|factor| factor as f64).product();
        return factorial.ln() - (0.5 * (2.0 * PI * x).ln() + x * x.ln() - x);
    }
    // The series of Stirling, with Bernoulli numbers over 2j(2j − 1).
    let inverse = 1.0 / x;
    let square = inverse * inverse;
    inverse * (1.0 / 12.0 - square * (1.0 / 360.0 - square * (1.0 / 1_260.0 - square * (1.0 / 1_680.0))))
}

/// The deviance x·ln(x/m) + m − x of a count x from its mean m, both above 0.
fn deviance(x: f64, mean: f64) -> f64 {
    let (difference, sum) = (x - mean, x + mean);
    if difference.abs() >= NEAR * sum {
        return x * (x / mean).ln() + mean - x;
    }
    // With v = (x − m)/(x + m), ln(x/m) = 2·artanh(v): what cancels is left out.
    let v = difference / sum;
    let mut power = 2.0 * x * v;
    let mut total = difference * v;
    for odd in (3_u32..).step_by(2) {
        power *= v * v;
        let next = total + power / f64::from(odd);
        if next == total {
            break;
        }
        total = next;
    }
    total
}

/// Probability of exactly `hits` hits in `samples` samples of probability `p`; NaN where `p` is no probability.
pub fn probability(hits: u64, samples: u64, p: f64) -> f64 {
    if !(0.0..=1.0).contains(&p) {
        return f64::NAN;
    }
    if hits > samples {
        return 0.0;
    }
    let (k, n, q) = (hits as f64, samples as f64, 1.0 - p);
    if hits == 0 {
        return (n * (-p).ln_1p()).exp();
    }
    if hits == samples {
        return (n * p.ln()).exp();
    }
    if p == 0.0 || p == 1.0 {
        return 0.0;
    }
    let logarithm = stirling_error(samples)
        - stirling_error(hits)
        - stirling_error(samples - hits)
        - deviance(k, n * p)
        - deviance(n - k, n * q);
    logarithm.exp() * (n / (2.0 * PI * k * (n - k))).sqrt()
}

/// The tail up to and including `hits`, over the probability of `hits` itself: 1 + the ratios of the terms below.
///
/// Meant for `hits` at or below the mean, where the terms fall.
fn tail_over_last(hits: u64, samples: u64, p: f64) -> f64 {
    let odds = (1.0 - p) / p;
    let (mut term, mut sum) = (1.0, 1.0);
    for step in 1..=hits {
        term *= odds * ((hits - step + 1) as f64) / ((samples - hits + step) as f64);
        let next = sum + term;
        if next == sum {
            break;
        }
        sum = next;
    }
    sum
}

/// Probability of at most `hits` hits in `samples` samples of probability `p`; NaN where `p` is no probability.
pub fn at_most(hits: u64, samples: u64, p: f64) -> f64 {
    if !(0.0..=1.0).contains(&p) {
        return f64::NAN;
    }
    if hits >= samples {
        return 1.0;
    }
    if p == 0.0 || p == 1.0 {
        return if p == 0.0 { 1.0 } else { 0.0 };
    }
    if hits as f64 <= samples as f64 * p {
        tail_over_last(hits, samples, p) * probability(hits, samples, p)
    } else {
        // The other tail begins above the mean: small, and free of cancellation here.
        1.0 - at_least(hits + 1, samples, p)
    }
}

/// Probability of at least `hits` hits in `samples` samples of probability `p`; NaN where `p` is no probability.
pub fn at_least(hits: u64, samples: u64, p: f64) -> f64 {
    if hits > samples {
        return if p.is_nan() { f64::NAN } else { 0.0 };
    }
    if hits == 0 && (0.0..=1.0).contains(&p) {
        return 1.0;
    }
    if hits as f64 >= samples as f64 * p && p > 0.0 && p < 1.0 {
        upper_tail_over_first(hits, samples, p) * probability(hits, samples, p)
    } else if (0.0..=1.0).contains(&p) {
        1.0 - at_most(hits - 1, samples, p)
    } else {
        f64::NAN
    }
}

/// The tail from `hits` on, over the probability of `hits` itself: the other tail's mirror image.
pub(super) fn upper_tail_over_first(hits: u64, samples: u64, p: f64) -> f64 {
    tail_over_last(samples - hits, samples, 1.0 - p)
}
