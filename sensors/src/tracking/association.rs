//! Which detection belongs to which track: gate, then the assignment of least total cost.
//!
//! The cost of a pair is its negative log-likelihood up to constants, d² + ln det S, d the Mahalanobis distance and S the
//! innovation's covariance, with room for a manoeuvre that has just begun. A pair is allowed where d² is below the gate. Each track may also stay without a detection
//! at the cost of one at the edge of the gate, so that a far-fetched pair is not forced. The optimum is found by the
//! Kuhn–Munkres algorithm of the `pathfinding` crate, on integers, so that the result does not depend on rounding.

use pathfinding::prelude::{Matrix, kuhn_munkres_min};

use super::axis::AxisFit;
use super::road_filter::{Measurement, RoadFilter};

/// A true pair lies outside of the gate once in a thousand scans, and even less often near by, where the room for a manoeuvre
/// is most of S: χ² of 2 degrees of freedom.
pub(super) const GATE: f64 = 13.8;

/// Integer cost per unit of log-likelihood.
const COST_SCALE: f64 = 1_000.0;

/// More than any sum of allowed costs: marks pairs outside of the gate.
const FORBIDDEN: i64 = 1_000_000_000;

fn to_integer(cost: f64) -> i64 {
    #[expect(clippy::cast_possible_truncation, reason = "a float cast saturates, far above any gated cost")]
    let cost = (cost * COST_SCALE).round() as i64;
    cost.clamp(-FORBIDDEN / 1_000, FORBIDDEN / 1_000)
}

/// The detection of each track, given with its half length, in `assigned`: its place in `measurements`, or nothing.
pub(super) fn assign<'a>(
    tracks: impl ExactSizeIterator<Item = (&'a RoadFilter, f64)>,
    measurements: &[Measurement],
    assigned: &mut Vec<Option<usize>>,
) {
    assigned.clear();
    let (rows, real) = (tracks.len(), measurements.len());
    if rows == 0 || real == 0 {
        assigned.resize(rows, None);
        return;
    }
    // One more column for each track: its own "no detection".
    let mut costs = Matrix::new(rows, real + rows, FORBIDDEN);
    for (row, (track, half_m)) in tracks.enumerate() {
        let mut widest = f64::NEG_INFINITY;
        for (column, measurement) in measurements.iter().enumerate() {
            let axes = track.fit(measurement, half_m);
            let sum = |of: fn(&AxisFit) -> f64| of(&axes[0]) + of(&axes[1]);
            if sum(|axis| axis.distance) <= GATE {
                costs[(row, column)] = to_integer(sum(|axis| axis.cost));
                widest = widest.max(sum(|axis| axis.log_variance));
            }
        }
        costs[(row, real + row)] = if widest.is_finite() { to_integer(GATE + widest) } else { 0 };
    }
    let (_, columns) = kuhn_munkres_min(&costs);
    assigned.extend(columns.iter().enumerate().map(|(row, &column)| {
        let allowed = column < real && costs[(row, column)] < FORBIDDEN;
        allowed.then_some(column)
    }));
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::axis::AxisMeasurement;
    use super::*;

    fn track(s_m: f64, d_m: f64) -> RoadFilter {
        RoadFilter::first(&measurement(s_m, d_m), 0.0)
    }

    fn measurement(s_m: f64, d_m: f64) -> Measurement {
        let axis = |position_m| AxisMeasurement { position_m, white_sd_m: 0.5, slow_sd_m: 0.0, lever_s: 0.0 };
        Measurement { along: axis(s_m), across: axis(d_m) }
    }

    fn assignment(tracks: &[RoadFilter], measurements: &[Measurement]) -> Vec<Option<usize>> {
        let mut assigned = Vec::new();
        assign(tracks.iter().map(|track| (track, 0.0)), measurements, &mut assigned);
        assigned
    }

    #[test]
    fn the_best_sum_wins_over_the_best_pair() {
        // The first track is nearest to measurement 1, but then the second would have none.
        let tracks = [track(0.0, 0.0), track(2.0, 0.0)];
        let measurements = [measurement(-1.2, 0.0), measurement(0.9, 0.0)];
        assert_eq!(assignment(&tracks, &measurements), [Some(0), Some(1)]);
    }

    #[test]
    fn nothing_is_assigned_beyond_the_gate() {
        let tracks = [track(0.0, 0.0), track(50.0, 0.0)];
        assert_eq!(assignment(&tracks, &[measurement(51.0, 0.2)]), [None, Some(0)]);
        assert_eq!(assignment(&tracks, &[]), [None, None]);
        assert!(assignment(&[], &[measurement(0.0, 0.0)]).is_empty());
        assert_eq!(assignment(&tracks, &[measurement(f64::NAN, 0.0)]), [None, None]);
    }

    proptest! {
        #[test]
        fn no_detection_is_used_twice(
            tracks in prop::collection::vec((-10.0..10.0, -4.0..4.0), 0..8),
            detections in prop::collection::vec((-10.0..10.0, -4.0..4.0), 0..8),
        ) {
            let tracks: Vec<_> = tracks.iter().map(|&(s, d)| track(s, d)).collect();
            let measurements: Vec<_> = detections.iter().map(|&(s, d)| measurement(s, d)).collect();
            let mut used: Vec<_> = assignment(&tracks, &measurements).into_iter().flatten().collect();
            let count = used.len();
            used.sort_unstable();
            used.dedup();
            prop_assert_eq!(used.len(), count);
        }
    }
}
