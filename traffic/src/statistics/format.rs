//! The printed form of probabilities, shares and measured values.

use crate::maths;

/// Significant digits of a printed value, unless its reader needs more.
pub const DIGITS: i32 = 3;
/// Most decimals of a printed value.
const MOST_DECIMALS: i32 = 9;
/// Size from which a printed value has an exponent.
const EXPONENT_FROM: f64 = 1e16;

/// Returns a value with at most so many significant digits and without trailing zeros. The digits
/// before the point are never cut: 31.0825 is `31.1` with three, 0.4 is `0.4`, 3290.62 is `3291`. A
/// value of more than 16 digits has an exponent, as [`exact`] writes it.
pub fn significant(value: f64, digits: i32) -> String {
    let size = value.abs();
    if size >= EXPONENT_FROM {
        return exact(value);
    }
    if !(size > 0.0) || !value.is_finite() {
        return if size > 0.0 || value.is_nan() { value.to_string() } else { "0".to_owned() };
    }
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a small number, not below 0 by the clamp"
    )]
    let decimals = (digits - 1 - maths::log10(size).floor() as i32).clamp(0, MOST_DECIMALS) as usize;
    without_trailing_zeros(&format!("{value:.decimals$}"))
}

/// Returns a value with all its digits, without trailing zeros. A very large or small one has an
/// exponent: `-9810`, `100.5`, `1e308`, `1e-7`.
pub fn exact(value: f64) -> String {
    let text = format!("{value:?}");
    text.strip_suffix(".0").map_or(text.clone(), str::to_owned)
}

/// Returns the text of a number without trailing zeros, and of zero without a sign: `2.50` is
/// `2.5`, and `-0.00` is `0`.
pub fn without_trailing_zeros(number: &str) -> String {
    let text = if number.contains('.') { number.trim_end_matches('0').trim_end_matches('.') } else { number };
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// Returns a share in percent, with three significant digits and without trailing zeros: 0.00994 is
/// `0.994 %`.
pub fn percent(share: f64) -> String {
    format!("{} %", significant(100.0 * share, DIGITS))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_have_the_digits_that_they_deserve() {
        let texts = [1_600.0, -555.4548, 3_290.624_8, 0.4, 31.0825, -0.012_345, 9.996, 0.0, -0.0, 1e-12];
        let expected = ["1600", "-555", "3291", "0.4", "31.1", "-0.0123", "10", "0", "0", "0"];
        assert_eq!(texts.map(|value| significant(value, DIGITS)), expected);
        assert_eq!(significant(10.004, 5), "10.004");
        assert_eq!([f64::NAN, f64::NEG_INFINITY].map(|value| significant(value, DIGITS)), ["NaN", "-inf"]);
        assert_eq!(
            [9e15, -1e16, 2.5e300].map(|value| significant(value, DIGITS)),
            ["9000000000000000", "-1e16", "2.5e300"]
        );
    }

    #[test]
    fn a_large_or_small_value_has_all_its_digits_and_an_exponent() {
        let values = [-9_810.0, 100.5, 0.0, 1e308, -2.5e300, 1e-7, f64::NAN, f64::NEG_INFINITY];
        assert_eq!(values.map(exact), ["-9810", "100.5", "0", "1e308", "-2.5e300", "1e-7", "NaN", "-inf"]);
    }

    #[test]
    fn percentages_have_three_digits() {
        let texts = [0.009_936_4, 0.01, 0.95, 0.5, 0.000_012_34, 1.0, 0.0].map(percent);
        assert_eq!(texts, ["0.994 %", "1 %", "95 %", "50 %", "0.00123 %", "100 %", "0 %"]);
    }
}
