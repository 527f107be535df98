//! The printed form of probabilities and shares.

use crate::maths;

/// Significant digits of a printed share.
const DIGITS: i32 = 3;

/// Returns a share in percent, with three significant digits and without trailing zeros: 0.00994 is
/// `0.994 %`.
pub fn percent(share: f64) -> String {
    let value = 100.0 * share;
    if !(value > 0.0) || !value.is_finite() {
        return format!("{value} %");
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small number, above 0 by the clamp")]
    let decimals = (DIGITS - 1 - maths::log10(value).floor() as i32).clamp(0, 9) as usize;
    let text = format!("{value:.decimals$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    format!("{text} %")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentages_have_three_digits() {
        let texts = [0.009_936_4, 0.01, 0.95, 0.5, 0.000_012_34, 1.0, 0.0].map(percent);
        assert_eq!(texts, ["0.994 %", "1 %", "95 %", "50 %", "0.00123 %", "100 %", "0 %"]);
    }
}
