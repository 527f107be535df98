//! Every pair of arms of a campaign, on the same samples.
//!
//! The gates judge the last arm against the first one. With references between them, each arm is
//! also compared with each arm before it. The p-values of all pairs of one scenario are corrected
//! for the number of pairs (Holm: see [`closecall_traffic::statistics::holm`]); the intervals hold
//! for each pair alone.

use closecall_traffic::statistics::holm;

use crate::ledger::{Inference, Pairs, Tally};
use crate::summary::{Counts, Summary};

/// The pairs of two arms, the earlier one as the baseline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmPair {
    /// Index of the earlier arm.
    pub baseline: usize,
    /// Index of the later arm.
    pub tested: usize,
    /// The changes by the later arm.
    pub pairs: Pairs,
}

impl ArmPair {
    /// Returns all pairs of this number of arms, without samples.
    pub(crate) fn all(arms: usize) -> Vec<Self> {
        let pairs_with =
            |baseline| (baseline + 1..arms).map(move |tested| Self { baseline, tested, pairs: Pairs::default() });
        (0..arms).flat_map(pairs_with).collect()
    }

    /// Adds the tallies of one sample, one for each arm.
    pub(crate) fn push(&mut self, tallies: &[Tally]) {
        if let (Some(baseline), Some(tested)) = (tallies.get(self.baseline), tallies.get(self.tested)) {
            self.pairs.push(baseline, tested);
        }
    }
}

/// A pair of arms as reports show it.
#[derive(Clone, Debug, PartialEq)]
pub struct PairResult<'a> {
    /// Name of the earlier arm.
    pub baseline: &'a str,
    /// Name of the later arm.
    pub tested: &'a str,
    /// The changes by the later arm.
    pub pairs: &'a Pairs,
    /// The 95 % interval of the share of samples that the later arm prevents.
    pub prevented_95: Option<[f64; 2]>,
    /// The 95 % interval of the share of samples that the later arm induces.
    pub induced_95: Option<[f64; 2]>,
    /// Mid-p value of the McNemar test of *some vehicle collides*; `None` if the number of samples
    /// was not fixed in advance.
    pub mcnemar_p: Option<f64>,
    /// The mid-p value, corrected for the number of pairs (Holm).
    pub corrected_p: Option<f64>,
}

/// The method of the correction, for reports.
pub const CORRECTION: &str = "Holm, Scandinavian Journal of Statistics 6 (1979)";

/// Returns every pair of arms of one scenario, in the order of the arms.
pub fn pair_results<'a>(summary: &'a Summary, counts: &'a Counts) -> Vec<PairResult<'a>> {
    let inference: Inference = summary.inference;
    let p_values: Option<Vec<f64>> = counts.arm_pairs.iter().map(|pair| pair.pairs.mcnemar_p(inference)).collect();
    let corrected = p_values.as_deref().map(holm::corrected);
    let result = |(index, pair): (usize, &'a ArmPair)| {
        let pairs = &pair.pairs;
        let interval = |hits| inference.interval_95(hits, pairs.samples());
        PairResult {
            baseline: summary.controllers.get(pair.baseline).map_or("", String::as_str),
            tested: summary.controllers.get(pair.tested).map_or("", String::as_str),
            pairs,
            prevented_95: interval(pairs.prevented),
            induced_95: interval(pairs.induced),
            mcnemar_p: pairs.mcnemar_p(inference),
            corrected_p: corrected.as_ref().and_then(|corrected| corrected.get(index).copied()),
        }
    };
    counts.arm_pairs.iter().enumerate().map(result).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_arm_is_compared_with_each_arm_before_it() {
        let collided = |collided| Tally { collided: Some(collided), ..Tally::default() };
        let mut all = ArmPair::all(3);
        assert_eq!(all.iter().map(|pair| (pair.baseline, pair.tested)).collect::<Vec<_>>(), [(0, 1), (0, 2), (1, 2)]);
        for tallies in [[true, false, false], [false, true, false], [true, true, false]] {
            all.iter_mut().for_each(|pair| pair.push(&tallies.map(collided)));
        }
        let counts = |pairs: &Pairs| (pairs.prevented, pairs.induced, pairs.both, pairs.neither);
        assert_eq!(
            all.iter().map(|pair| counts(&pair.pairs)).collect::<Vec<_>>(),
            [(1, 1, 1, 0), (2, 0, 0, 1), (2, 0, 0, 1)]
        );
        assert_eq!(ArmPair::all(1), []);
    }
}
