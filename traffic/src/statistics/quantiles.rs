//! Quantiles of sorted values, and the distribution that they define.
//!
//! Values at equally spaced probabilities from 0 to 1 are joined by straight lines: Hyndman and
//! Fan's type 7, the default of R and NumPy (R. J. Hyndman and Y. Fan, *Sample quantiles in
//! statistical packages*, The American Statistician 50 (1996) 361–365).

/// Returns the quantile at probability `u` of one or more `sorted` values without NaN. A
/// probability below 0 counts as 0, and a probability above 1 as 1.
///
/// # Panics
/// Panics if there are no values.
pub fn quantile(sorted: &[f64], u: f64) -> f64 {
    assert!(!sorted.is_empty(), "quantile of no values");
    let intervals = sorted.len() - 1;
    let position = u.clamp(0.0, 1.0) * intervals as f64;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 0 and the number of values")]
    let below = position as usize;
    let (low, high) = (sorted[below], sorted[(below + 1).min(intervals)]);
    (low + (position - below as f64) * (high - low)).clamp(low, high)
}

/// Returns the median of one or more values without NaN.
///
/// # Panics
/// Panics if there are no values.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    quantile(&values, 0.5)
}

/// Returns the cumulative probability at `x` of the distribution with two or more quantiles, which
/// are sorted values at equally spaced probabilities from 0 to 1.
pub fn cdf(quantiles: &[f64], x: f64) -> f64 {
    let intervals = quantiles.len() - 1;
    match quantiles.partition_point(|&quantile| quantile <= x) {
        0 => 0.0,
        above if above > intervals => 1.0,
        above => {
            let (low, high) = (quantiles[above - 1], quantiles[above]);
            ((above - 1) as f64 + (x - low) / (high - low)) / intervals as f64
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn quantiles_match_numpy() {
        // NumPy: percentile([1, 2, 3, 4, 5, 6, 7, 30], [25, 50, 75]) = 2.75, 4.5, 6.25.
        let sorted = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 30.0];
        assert_eq!([0.25, 0.5, 0.75].map(|u| quantile(&sorted, u)), [2.75, 4.5, 6.25]);
        assert_eq!(median(vec![3.0, 1.0]), 2.0);
        assert_eq!(quantile(&[7.0], 0.3), 7.0);
    }

    proptest! {
        #[test]
        fn quantiles_rise_from_the_smallest_to_the_largest(mut sorted in prop::collection::vec(0.1..50.0, 1..40)) {
            sorted.sort_by(f64::total_cmp);
            let levels: Vec<f64> = (0..=10).map(|k| quantile(&sorted, f64::from(k) / 10.0)).collect();
            prop_assert!(levels.windows(2).all(|pair| pair[0] <= pair[1]));
            prop_assert_eq!(levels[0].to_bits(), sorted[0].to_bits());
            prop_assert_eq!(levels[10].to_bits(), sorted[sorted.len() - 1].to_bits());
        }

        #[test]
        fn the_cumulative_probability_inverts_the_quantile(
            mut sorted in prop::collection::vec(0.1..50.0, 2..40), u in 0.0..1.0,
        ) {
            sorted.sort_by(f64::total_cmp);
            prop_assume!(sorted.windows(2).all(|pair| pair[1] - pair[0] > 1e-3));
            prop_assert!((cdf(&sorted, quantile(&sorted, u)) - u).abs() < 1e-9);
        }
    }
}
