//! The order of lane changes by their criticality.

use std::cmp::Ordering::Equal;

use super::CriticalLaneChange;

/// Returns the lane changes of `track`, or of all tracks, the most critical first. Of two equal
/// lane changes the later is first.
pub fn by_severity(changes: &[CriticalLaneChange], track: Option<u64>) -> Vec<&CriticalLaneChange> {
    let is_wanted = |change: &&CriticalLaneChange| track.is_none_or(|track| change.lane_change.track_id == track);
    let mut wanted: Vec<&CriticalLaneChange> = changes.iter().rev().filter(is_wanted).collect();
    wanted.sort_by(|a, b| severity(b).partial_cmp(&severity(a)).unwrap_or(Equal));
    wanted
}

/// Returns the number of critical metrics, and the negative distance to the nearest vehicle (m).
fn severity(change: &CriticalLaneChange) -> (usize, f64) {
    let critical = change.metrics.named().iter().filter(|(_, metric)| metric.is_critical()).count();
    (critical, -change.metrics.distance_m.value().unwrap_or(f64::INFINITY))
}
