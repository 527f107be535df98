//! Whether two arms on the same samples differ: the exact test of McNemar.
//!
//! Q. McNemar, *Note on the sampling error of the difference between correlated proportions or percentages*,
//! Psychometrika 12 (1947) 153–157. Where the arms are alike, each pair that differs is as likely to speak for one as
//! for the other; the exact test asks the binomial distribution with ½ how rare the split found is. It holds at a number
//! of pairs that was fixed in advance.

use super::binomial::at_most;

/// Probability of a split at least as uneven as this among pairs that differ, where the arms are alike (two-sided).
pub fn two_sided_p(prevented: u64, induced: u64) -> f64 {
    (2.0 * at_most(prevented.min(induced), prevented + induced, 0.5)).min(1.0)
}
