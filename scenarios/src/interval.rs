//! Confidence interval of a probability that was estimated by counting.

use statrs::distribution::{Beta, ContinuousCDF};

/// Confidence level: the least share of repetitions in which the interval covers the true probability.
const COVERAGE: f64 = 0.95;

/// Returns the exact (Clopper–Pearson) 95 % confidence interval `[lower, upper]` of a probability, from the number of
/// `hits` among `samples`.
///
/// Source: C. J. Clopper and E. S. Pearson, *Biometrika* 26 (1934). The interval covers the true probability in at
/// least 95 % of repetitions, whatever that probability is. Without samples it is `[0, 1]`.
pub fn clopper_pearson(hits: u64, samples: u64) -> [f64; 2] {
    let tail = 0.5 * (1.0 - COVERAGE);
    let (k, n) = (hits as f64, samples as f64);
    let quantile = |a: f64, b: f64, p: f64| Beta::new(a, b).map_or(f64::NAN, |beta| beta.inverse_cdf(p));
    let low = if hits == 0 { 0.0 } else { quantile(k, n - k + 1.0, tail) };
    let high = if hits >= samples { 1.0 } else { quantile(k + 1.0, n - k, 1.0 - tail) };
    [low, high]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_match_known_values() {
        let [low, high] = clopper_pearson(0, 200);
        assert!(low == 0.0 && (high - 0.0183).abs() < 1e-4);
        let [low, high] = clopper_pearson(29, 29);
        assert!((low - 0.8806).abs() < 1e-4 && high == 1.0);
        assert_eq!(clopper_pearson(0, 0), [0.0, 1.0]);
    }
}
