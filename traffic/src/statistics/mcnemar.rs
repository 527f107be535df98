//! The exact McNemar test: whether two arms differ on the same samples.
//!
//! Q. McNemar, *Note on the sampling error of the difference between correlated proportions or percentages*,
//! Psychometrika 12 (1947) 153–157. If the arms do not differ, each discordant pair favours either arm with a
//! probability of ½. The exact test computes how improbable the observed split is under this binomial distribution. It is
//! valid for a number of pairs that is fixed in advance.

use super::binomial::at_most;

/// Returns the two-sided p-value: the probability of a split of the discordant pairs at least as uneven as the observed one,
/// if the arms do not differ. `prevented` and `induced` are the numbers of discordant pairs in favour of either arm.
pub fn two_sided_p(prevented: u64, induced: u64) -> f64 {
    (2.0 * at_most(prevented.min(induced), prevented + induced, 0.5)).min(1.0)
}
