//! Rank correlations between the quantities of one lane change, or of one pair of vehicles.

use super::{Quantity, Samples};
use crate::criticality::spearman;
use closecall_traffic::maths;
use closecall_traffic::statistics::cholesky;

/// Least number of lane changes or pairs with both values, from which a correlation is kept: with
/// fewer, its 95 % interval spans more than ±0.6.
pub(super) const MIN_PAIRS: usize = 10;

/// Quantities of one lane change, and of one pair of vehicles. Pairs that repeat another pair are
/// left out.
const TOGETHER: [&[Quantity]; 2] = [
    &[Quantity::CutOutThw, Quantity::LaneChangeDuration, Quantity::Closing, Quantity::CrossingSpeed],
    &[Quantity::FrontThw, Quantity::FollowingSpeed],
];

/// The rank correlation of two quantities.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RankCorrelation {
    /// The first quantity.
    pub of: Quantity,
    /// The other quantity.
    pub with: Quantity,
    /// Number of lane changes or pairs with both values.
    pub n: usize,
    /// Spearman's rank correlation (-).
    pub spearman: f64,
}

/// Returns the rank correlations of all quantities that belong together, rounded to two decimals.
/// Each pair of quantities has its own lane changes, so that they may contradict each other: they
/// are then scaled down together until a joint distribution has them.
pub(super) fn correlations(samples: &Samples) -> Vec<RankCorrelation> {
    let mut correlations = Vec::new();
    for quantities in TOGETHER {
        for (index, first) in quantities.iter().enumerate() {
            for second in &quantities[index + 1..] {
                let (a, b) = samples.pairs(*first, *second);
                if let Some(spearman) = spearman(&a, &b).filter(|_| a.len() >= MIN_PAIRS) {
                    correlations.push(RankCorrelation { of: *first, with: *second, n: a.len(), spearman });
                }
            }
        }
    }
    let rounded = |scale: f64| -> Vec<RankCorrelation> {
        let round = |spearman: f64| (100.0 * scale * spearman).round().clamp(-99.0, 99.0) / 100.0;
        correlations
            .iter()
            .map(|correlation| RankCorrelation { spearman: round(correlation.spearman), ..*correlation })
            .collect()
    };
    let scales = std::iter::successors(Some(1.0), |scale| Some(0.95 * scale));
    scales.map(rounded).find(|all| is_consistent(all)).unwrap_or_default()
}

fn is_consistent(all: &[RankCorrelation]) -> bool {
    let at = |a: Quantity, b: Quantity| {
        let pair = all.iter().find(|correlation| {
            (correlation.of, correlation.with) == (a, b) || (correlation.of, correlation.with) == (b, a)
        });
        let spearman = pair.map_or(0.0, |correlation| correlation.spearman);
        if a == b { 1.0 } else { 2.0 * maths::sin(std::f64::consts::PI * spearman / 6.0) }
    };
    let rows = Quantity::ALL.map(|a| Quantity::ALL.map(|b| at(a, b)).to_vec());
    cholesky(&rows).is_some()
}
