//! A distribution given by its quantiles at equally spaced probabilities from 0 to 1, with linear interpolation.

/// Returns the quantile at probability `u`, for two or more `quantiles` in non-descending order.
pub(super) fn quantile(quantiles: &[f64], u: f64) -> f64 {
    let intervals = quantiles.len() - 1;
    let position = u * intervals as f64;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "u is in [0, 1)")]
    let below = (position as usize).min(intervals - 1);
    let (low, high) = (quantiles[below], quantiles[below + 1]);
    (low + (position - below as f64) * (high - low)).clamp(low, high)
}

/// Returns the cumulative probability at `x`.
pub(super) fn cdf(quantiles: &[f64], x: f64) -> f64 {
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
