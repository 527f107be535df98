//! Share of critical lane changes, for each metric.

use closecall_traffic::statistics::interval::{COVERAGE, clopper_pearson};
use serde::Serialize;

use super::{CriticalLaneChange, MetricResult};

/// The lane changes that are counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Counted {
    /// The lane changes that were recorded as a whole, shift the vehicle by at least 2.5 m, and
    /// overlap with no other lane change.
    #[default]
    Complete,
    /// All.
    All,
}

/// How often one metric is critical over many lane changes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CriticalShare {
    /// Name of the metric.
    pub metric: &'static str,
    /// Number of lane changes that are critical.
    pub critical: usize,
    /// Number of lane changes for which the metric has no value.
    pub absent: usize,
    /// Critical lane changes as a share of the counted lane changes (-); `None` if there are none.
    pub share: Option<f64>,
    /// Exact 95 % interval of the share (Clopper-Pearson) (-).
    pub interval_95: Option<[f64; 2]>,
}

/// How often each metric is critical over many lane changes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CriticalShares {
    /// Number of lane changes that are counted.
    pub lane_changes: usize,
    /// Number of lane changes that are left out.
    pub left_out: usize,
    /// One entry for each metric, in the order of `Metrics::named`, and of
    /// `CurvilinearMetrics::named` if these were asked for.
    pub metrics: Vec<CriticalShare>,
    /// Number of lane changes that are critical by at least one metric of `Metrics`.
    pub any: usize,
}

/// Counts the critical lane changes by each metric.
pub fn shares(changes: &[CriticalLaneChange], counted: Counted) -> CriticalShares {
    let is_counted = |change: &&CriticalLaneChange| counted == Counted::All || change.lane_change.complete;
    let named: Vec<_> = changes.iter().filter(is_counted).map(|change| change.metrics.named()).collect();
    let names = ["distance_m", "speed_mps", "a_lon_mps2", "a_lat_mps2", "thw_s", "dce_m", "ttce_s"];
    let column = |index: usize| named.iter().map(move |metrics| metrics[index].1);
    let metrics = names.into_iter().enumerate().map(|(index, metric)| share_of(metric, column(index)));
    let curvilinear = changes.iter().filter(is_counted).filter_map(|change| change.curvilinear);
    let curvilinear: Vec<_> = curvilinear.map(|metrics| metrics.named()).collect();
    let along_lanes = ["dce_curvilinear_m", "ttce_curvilinear_s"].into_iter().enumerate();
    let along_lanes = along_lanes
        .filter(|_| !curvilinear.is_empty())
        .map(|(index, metric)| share_of(metric, curvilinear.iter().map(move |metrics| metrics[index].1)));
    CriticalShares {
        lane_changes: named.len(),
        left_out: changes.len() - named.len(),
        metrics: metrics.chain(along_lanes).collect(),
        any: named.iter().filter(|metrics| metrics.iter().any(|(_, record)| record.is_critical())).count(),
    }
}

/// Returns how often one metric is critical.
fn share_of(metric: &'static str, results: impl Iterator<Item = MetricResult>) -> CriticalShare {
    let results: Vec<MetricResult> = results.collect();
    let critical = results.iter().filter(|result| result.is_critical()).count();
    let absent = results.iter().filter(|result| result.value().is_none()).count();
    let share = (!results.is_empty()).then(|| critical as f64 / results.len() as f64);
    let interval_95 = share.map(|_| clopper_pearson(critical as u64, results.len() as u64, COVERAGE));
    CriticalShare { metric, critical, absent, share, interval_95 }
}
