//! Which share of the lane changes is critical, by each metric.

use serde::Serialize;

use super::CriticalLaneChange;

/// One metric over many lane changes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CriticalShare {
    /// The metric's name.
    pub metric: &'static str,
    /// Number of lane changes that are critical.
    pub critical: usize,
    /// Number of lane changes for which the metric has no value.
    pub absent: usize,
    /// Critical ones as a share of all lane changes; nothing where there are none.
    pub share: Option<f64>,
}

/// All metrics over many lane changes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CriticalShares {
    /// Number of lane changes.
    pub lane_changes: usize,
    /// The metrics, in their fixed order.
    pub metrics: Vec<CriticalShare>,
    /// Number of lane changes that are critical by at least one of them.
    pub any: usize,
}

/// Counts what is critical.
pub fn shares(changes: &[CriticalLaneChange]) -> CriticalShares {
    let named: Vec<_> = changes.iter().map(|change| change.metrics.named()).collect();
    let names = ["distance_m", "speed_mps", "a_lon_mps2", "a_lat_mps2", "thw_s", "dce_m", "ttce_s"];
    let metrics = names.into_iter().enumerate().map(|(place, metric)| {
        let critical = named.iter().filter(|metrics| metrics[place].1.is_critical()).count();
        let absent = named.iter().filter(|metrics| metrics[place].1.value().is_none()).count();
        let share = (!named.is_empty()).then(|| critical as f64 / named.len() as f64);
        CriticalShare { metric, critical, absent, share }
    });
    CriticalShares {
        lane_changes: changes.len(),
        metrics: metrics.collect(),
        any: named.iter().filter(|metrics| metrics.iter().any(|(_, record)| record.is_critical())).count(),
    }
}
