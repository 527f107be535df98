//! Probabilities of the binomial distribution.
//!
//! A single probability is computed from its deviance and the error of Stirling's formula, after C.
//! Loader, *Fast and accurate computation of binomial probabilities* (2000). This avoids
//! differences of large logarithms, which would lose half of the digits at a million samples. A
//! tail is the sum of single probabilities, each a simple multiple of its neighbour. The sum has
//! positive terms only, and stops when further terms no longer change it.

use crate::maths;
use std::f64::consts::PI;

/// Smallest n for which Stirling's series is accurate to all digits. Factorials of smaller n are
/// exact in `f64`.
const SERIES_FROM: u64 = 16;

/// Ratio |x − m|/(x + m) of a count x and its mean m below which the deviance is computed as a
/// series.
const SERIES_BELOW: f64 = 0.1;

/// Returns the error of Stirling's formula: ln n! − (ln √(2πn) + n·ln n − n).
fn stirling_error(n: u64) -> f64 {
    let x = n as f64;
    if n < SERIES_FROM {
        let factorial: f64 = (1..=n).map(|factor| factor as f64).product();
        return maths::ln(factorial) - (0.5 * maths::ln(2.0 * PI * x) + x * maths::ln(x) - x);
    }
    // Stirling's series: its coefficients are Bernoulli numbers divided by 2j(2j − 1).
    let inverse = 1.0 / x;
    let square = inverse * inverse;
    inverse * (1.0 / 12.0 - square * (1.0 / 360.0 - square * (1.0 / 1_260.0 - square * (1.0 / 1_680.0))))
}

/// Returns the deviance x·ln(x/m) + m − x of a count x from its mean m, which must both be
/// positive.
fn deviance(x: f64, mean: f64) -> f64 {
    let (difference, sum) = (x - mean, x + mean);
    if difference.abs() >= SERIES_BELOW * sum {
        return x * maths::ln(x / mean) + mean - x;
    }
    // With v = (x − m)/(x + m), ln(x/m) = 2·artanh(v). The terms that would cancel are left out of
    // the series.
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

/// Returns the probability of exactly `hits` hits in `samples` samples with probability `p` each.
/// Returns NaN if `p` is not in \[0, 1\].
pub fn probability(hits: u64, samples: u64, p: f64) -> f64 {
    if !(0.0..=1.0).contains(&p) {
        return f64::NAN;
    }
    if hits > samples {
        return 0.0;
    }
    let (k, n, q) = (hits as f64, samples as f64, 1.0 - p);
    if hits == 0 {
        return maths::exp(n * maths::ln_1p(-p));
    }
    if hits == samples {
        return maths::exp(n * maths::ln(p));
    }
    if p == 0.0 || p == 1.0 {
        return 0.0;
    }
    let logarithm = stirling_error(samples)
        - stirling_error(hits)
        - stirling_error(samples - hits)
        - deviance(k, n * p)
        - deviance(n - k, n * q);
    maths::exp(logarithm) * (n / (2.0 * PI * k * (n - k))).sqrt()
}

/// Returns the probability of at most `hits` hits, divided by the probability of exactly `hits`
/// hits.
///
/// `hits` should be at or below the mean, where the terms of the sum decrease.
fn lower_tail_ratio(hits: u64, samples: u64, p: f64) -> f64 {
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

/// Returns the probability of at most `hits` hits in `samples` samples with probability `p` each.
/// Returns NaN if `p` is not in \[0, 1\].
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
        lower_tail_ratio(hits, samples, p) * probability(hits, samples, p)
    } else {
        // The upper tail starts above the mean, so that it is small and the difference does not
        // cancel.
        1.0 - at_least(hits + 1, samples, p)
    }
}

/// Returns the probability of at least `hits` hits in `samples` samples with probability `p` each.
/// Returns NaN if `p` is NaN, or if it is outside \[0, 1\] and `hits` does not exceed `samples`.
pub fn at_least(hits: u64, samples: u64, p: f64) -> f64 {
    if hits > samples {
        return if p.is_nan() { f64::NAN } else { 0.0 };
    }
    if hits == 0 && (0.0..=1.0).contains(&p) {
        return 1.0;
    }
    if hits as f64 >= samples as f64 * p && p > 0.0 && p < 1.0 {
        upper_tail_ratio(hits, samples, p) * probability(hits, samples, p)
    } else if (0.0..=1.0).contains(&p) {
        1.0 - at_most(hits - 1, samples, p)
    } else {
        f64::NAN
    }
}

/// Returns the probability of at least `hits` hits, divided by the probability of exactly `hits`
/// hits.
///
/// `hits` should be at or above the mean, where the terms of the sum decrease.
pub(super) fn upper_tail_ratio(hits: u64, samples: u64, p: f64) -> f64 {
    lower_tail_ratio(samples - hits, samples, 1.0 - p)
}
