//! The margins that comparisons of campaigns watch, and the rule by which one regresses.

use std::collections::BTreeMap;

use closecall_scenarios::outcome::Margins;
use closecall_traffic::Measured;
use closecall_traffic::statistics::quantiles::quantile;
use serde::Serialize;

/// A margin of a run. A smaller value is closer to a collision.
pub(crate) struct Margin {
    /// The key in reports. It ends with the unit.
    pub(crate) key: &'static str,
    /// Returns the margin of a run.
    pub(crate) value: fn(&Margins) -> Measured,
}

pub(crate) const MARGINS: [Margin; 5] = [
    Margin { key: "min_thw_front_s", value: |margins| margins.min_thw_front_s },
    Margin { key: "min_thw_rear_s", value: |margins| margins.min_thw_rear_s },
    Margin { key: "min_gap_front_m", value: |margins| margins.min_gap_front_m },
    Margin { key: "min_gap_rear_m", value: |margins| margins.min_gap_rear_m },
    Margin { key: "min_ttc_rear_s", value: |margins| margins.min_ttc_rear_s },
];

/// The quantile that is the smallest value.
pub(crate) const SMALLEST: &str = "min";

/// The probabilities of the quantiles that are compared. Small quantiles describe the runs closest
/// to a collision.
const PROBABILITIES: [(&str, f64); 4] = [(SMALLEST, 0.0), ("p01", 0.01), ("p05", 0.05), ("p50", 0.5)];

/// A change of a margin up to this much is no regression (s or m): no report shows it.
const SMALLEST_CHANGE: f64 = 0.01;

/// Quantiles of a margin, by name (s or m).
pub(crate) type Quantiles = BTreeMap<String, f64>;

/// A quantile of a margin that has fallen.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MarginRegression {
    /// The margin's key in reports. It ends with the unit.
    pub margin: String,
    /// The quantile: `min`, `p01`, `p05` or `p50`.
    pub quantile: String,
    /// The value in the baseline, in the unit of the margin.
    pub baseline: f64,
    /// The value in the later campaign, in the unit of the margin.
    pub current: f64,
}

/// Returns the quantiles of a margin, and none without values.
pub(crate) fn quantiles(values: &mut [f64]) -> Quantiles {
    values.sort_by(f64::total_cmp);
    match values.is_empty() {
        true => Quantiles::new(),
        false => PROBABILITIES.map(|(name, u)| (name.to_owned(), quantile(values, u))).into(),
    }
}

/// Returns the quantiles of `margin` that fall by more than the share `tolerance` of their value,
/// and by more than 0.01 (s or m).
pub(crate) fn regressions(
    margin: &str,
    baseline: &Quantiles,
    current: &Quantiles,
    tolerance: f64,
) -> Vec<MarginRegression> {
    let fallen = |(quantile, &before): (&String, &f64)| {
        let now = *current.get(quantile)?;
        let lost = before - now;
        let is_regression = lost > SMALLEST_CHANGE && lost > tolerance * before.abs();
        is_regression.then(|| MarginRegression {
            margin: margin.to_owned(),
            quantile: quantile.clone(),
            baseline: before,
            current: now,
        })
    };
    baseline.iter().filter_map(fallen).collect()
}

/// Returns true if no later campaign can regress: not even one in which all quantiles are 0, the
/// smallest value of a margin.
pub(crate) fn cannot_regress(baseline: &Quantiles, tolerance: f64) -> bool {
    let smallest = baseline.keys().map(|quantile| (quantile.clone(), 0.0)).collect();
    regressions("", baseline, &smallest, tolerance).is_empty()
}
