//! Share of critical lane changes, for each metric.

use serde::Serialize;

use super::CriticalLaneChange;

/// How often one metric is critical over many lane changes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CriticalShare {
    /// Name of the metric.
    pub metric: &'static str,
    /// Number of lane changes that are critical.
    pub critical: usize,
    /// Number of lane changes for which the metric has no value.
    pub absent: usize,
    /// Critical lane changes as a share of all lane changes (-); `None` if there are no lane changes.
    pub share: Option<f64>,
}

/// How often each metric is critical over many lane changes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CriticalShares {
    /// Number of lane changes.
    pub lane_changes: usize,
    /// One entry for each metric, in the order of `Metrics::named`.
    pub metrics: Vec<CriticalShare>,
    /// Number of lane changes that are critical by at least one metric.
    pub any: usize,
}

/// Counts the critical lane changes by each metric.
pub fn shares(changes: &[CriticalLaneChange]) -> CriticalShares {
    let named: Vec<_> = changes.iter().map(|change| change.metrics.named()).collect();
    let names = ["distance_m", "speed_mps", "a_lon_mps2", "a_lat_mps2", "thw_s", "dce_m", "ttce_s"];
    let metrics = names.into_iter().enumerate().map(|(index, metric)| {
        let critical = named.iter().filter(|metrics| metrics[index].1.is_critical()).count();
        let absent = named.iter().filter(|metrics| metrics[index].1.value().is_none()).count();
        let share = (!named.is_empty()).then(|| critical as f64 / named.len() as f64);
        CriticalShare { metric, critical, absent, share }
    });
    CriticalShares {
        lane_changes: changes.len(),
        metrics: metrics.collect(),
        any: named.iter().filter(|metrics| metrics.iter().any(|(_, record)| record.is_critical())).count(),
    }
}
