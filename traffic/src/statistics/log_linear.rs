//! Quantiles of any number of values in bounded memory.

use std::collections::BTreeMap;

/// Number of low bits of a value's mantissa that are rounded away: 13 of 52 are left, so that
/// values are exact to one part in 16,384.
const ROUNDED_BITS: u32 = 39;

/// A histogram with equal bins within each power of two, as in G. Tene's *HdrHistogram*:
/// each value counts as the nearest of the 8,192 values in its octave. Memory depends on the range
/// of the values, not on their number.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LogLinearHistogram {
    /// Counts by the bits of the rounded value, in an order in which they rise with it.
    counts: BTreeMap<i64, u64>,
    len: u64,
}

impl LogLinearHistogram {
    /// Adds a value, which is not NaN.
    pub fn push(&mut self, value: f64) {
        let half = 1_u64 << (ROUNDED_BITS - 1);
        let rounded = (value.to_bits() + half) >> ROUNDED_BITS << ROUNDED_BITS;
        *self.counts.entry(ordered(rounded.cast_signed())).or_default() += 1;
        self.len += 1;
    }

    /// Returns true if there are no values.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Returns the quantile at probability `u` of one or more values, by
    /// [`quantile`](crate::statistics::quantiles::quantile)'s rule.
    ///
    /// # Panics
    /// Panics if there are no values.
    pub fn quantile(&self, u: f64) -> f64 {
        assert!(!self.is_empty(), "quantile of no values");
        let intervals = self.len - 1;
        let position = u.clamp(0.0, 1.0) * intervals as f64;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "between 0 and the number of values"
        )]
        let below = position as u64;
        let (low, high) = (self.value(below), self.value((below + 1).min(intervals)));
        (low + (position - below as f64) * (high - low)).clamp(low, high)
    }

    /// Returns the value at a rank, counted from 0 at the smallest.
    fn value(&self, rank: u64) -> f64 {
        let mut up_to = 0;
        let bits = self.counts.iter().find_map(|(bits, count)| {
            up_to += count;
            (rank < up_to).then_some(*bits)
        });
        f64::from_bits(ordered(bits.unwrap_or_default()).cast_unsigned())
    }
}

/// Maps the bits of a number to an integer that rises with it, and back.
fn ordered(bits: i64) -> i64 {
    bits ^ ((bits >> 63).cast_unsigned() >> 1).cast_signed()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::statistics::quantiles::quantile;

    fn histogram(values: &[f64]) -> LogLinearHistogram {
        let mut histogram = LogLinearHistogram::default();
        values.iter().for_each(|value| histogram.push(*value));
        histogram
    }

    proptest! {
        #[test]
        fn quantiles_of_the_histogram_equal_the_quantiles_of_the_values(mut values in prop::collection::vec(-50.0..5e3, 1..200), u in 0.0..1.0) {
            let estimate = histogram(&values).quantile(u);
            values.sort_by(f64::total_cmp);
            let largest = values[0].abs().max(values[values.len() - 1].abs());
            prop_assert!((estimate - quantile(&values, u)).abs() <= largest / 16_384.0);
        }
    }

    #[test]
    fn a_part_in_16384_is_lost_and_no_more() {
        for value in [1e-3, 0.471_3, 1.0, 2.6, 1_234.5, -3.3] {
            let estimate = histogram(&[value]).quantile(0.5);
            assert!((estimate - value).abs() <= value.abs() / 16_384.0, "{value}: {estimate}");
        }
        assert_eq!(histogram(&[0.0, 0.0, 2.0]).quantile(0.0).to_bits(), 0.0_f64.to_bits());
        assert_eq!(histogram(&[0.0, 0.0, 2.0]).quantile(0.75), 1.0);
    }

    #[test]
    fn memory_does_not_grow_with_the_number_of_values() {
        let count = |number: u32| {
            let values: Vec<f64> = (0..number).map(|index| 1.0 + f64::from(index) / f64::from(number)).collect();
            histogram(&values).counts.len()
        };
        assert_eq!([count(100_000), count(200_000)], [8_193, 8_193]);
    }
}
