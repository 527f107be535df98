//! Association of detections with tracks: gating, then the assignment with the least total cost.
//!
//! The cost of a pair is its negative log-likelihood up to constants, d² + ln det S. Here d is the
//! Mahalanobis distance and S the innovation covariance, enlarged for a manoeuvre that has just
//! begun. A pair is allowed if d² does not exceed the gate. A track may also stay without a
//! detection, at the cost of a detection at the edge of the gate. An implausible pair is therefore
//! never forced. The Kuhn–Munkres algorithm finds the optimum ([`super::assignment`]). It works on
//! integers, so the result does not depend on rounding.

use super::assignment::Assignment;
use super::axis::AxisFit;
use super::road_filter::{Measurement, RoadFilter};

/// Gate for d²: the 99.9 % quantile of χ² with 2 degrees of freedom.
///
/// A true pair lies outside of the gate once in a thousand scans. It does so even less often at
/// short range, where the allowance for a manoeuvre dominates S.
pub(crate) const GATE: f64 = 13.8;

/// Integer cost per unit of d² + ln det S.
const COST_SCALE: f64 = 1_000.0;

/// Cost of a pair outside of the gate: more than any sum of allowed costs.
const FORBIDDEN: i64 = 1_000_000_000;

/// Converts a cost to an integer that is far below [`FORBIDDEN`].
fn to_integer(cost: f64) -> i64 {
    #[expect(clippy::cast_possible_truncation, reason = "a float cast saturates, far above any gated cost")]
    let cost = (cost * COST_SCALE).round() as i64;
    cost.clamp(-FORBIDDEN / 1_000, FORBIDDEN / 1_000)
}

/// Writes into `assigned` the index in `measurements` of each track's detection, or `None` if it
/// has none.
///
/// Each track is given by its filter, half of its length (m), and whether it follows a face.
/// `costs` is memory that the next call may reuse.
pub(crate) fn assign<'a>(
    tracks: impl ExactSizeIterator<Item = (&'a RoadFilter, f64, bool)>,
    measurements: &[Measurement],
    costs: &mut Assignment,
    assigned: &mut Vec<Option<usize>>,
) {
    assigned.clear();
    let (rows, detections) = (tracks.len(), measurements.len());
    if rows == 0 || detections == 0 {
        assigned.resize(rows, None);
        return;
    }
    // The additional column of each track means "no detection".
    costs.begin(rows, detections + rows, FORBIDDEN);
    for (row, (track, half_length_m, has_face)) in tracks.enumerate() {
        let mut largest_log_variance = f64::NEG_INFINITY;
        // Where the face of a vehicle that is cut off lies is not measured.
        let whole = measurements.iter().enumerate().filter(|(_, measurement)| has_face && !measurement.seen.is_cut);
        for (column, measurement) in whole {
            let axes = track.fit(measurement, half_length_m);
            let sum = |term: fn(&AxisFit) -> f64| term(&axes[0]) + term(&axes[1]);
            if sum(|axis| axis.squared_distance) <= GATE {
                costs.set_cost(row, column, to_integer(sum(|axis| axis.cost)));
                largest_log_variance = largest_log_variance.max(sum(|axis| axis.log_variance));
            }
        }
        let none = if largest_log_variance.is_finite() { to_integer(GATE + largest_log_variance) } else { 0 };
        costs.set_cost(row, detections + row, none);
    }
    assigned.extend_from_slice(costs.solve());
    for (row, column) in assigned.iter_mut().enumerate() {
        *column = column.filter(|&column| column < detections && costs.cost(row, column) < FORBIDDEN);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::tracking::WheelFronts;
    use crate::tracking::axis::AxisMeasurement;
    use crate::tracking::road_filter::Span;

    fn track(s_m: f64, d_m: f64) -> RoadFilter {
        RoadFilter::new(&measurement(s_m, d_m), 0.0, None)
    }

    fn measurement(s_m: f64, d_m: f64) -> Measurement {
        let axis = |position_m| AxisMeasurement { position_m, white_sd_m: 0.5, slow_sd_m: 0.0, time_offset_s: 0.0 };
        let seen = Span {
            is_cut: false,
            is_face: true,
            along_m: [s_m; 2],
            across_m: [d_m; 2],
            spacing_m: [f64::INFINITY; 2],
            wheels: WheelFronts::NONE,
            top_m: 1.5,
            points: 40,
        };
        Measurement { along: axis(s_m), across: axis(d_m), is_part: false, knows_middle: true, seen }
    }

    fn assignment(tracks: &[RoadFilter], measurements: &[Measurement]) -> Vec<Option<usize>> {
        let mut assigned = Vec::new();
        assign(tracks.iter().map(|track| (track, 0.0, true)), measurements, &mut Assignment::new(), &mut assigned);
        assigned
    }

    #[test]
    fn the_least_total_cost_wins_over_the_best_single_pair() {
        // The first track is nearest to measurement 1, but that pair would leave the second track
        // without a measurement.
        let tracks = [track(0.0, 0.0), track(2.0, 0.0)];
        let measurements = [measurement(-1.2, 0.0), measurement(0.9, 0.0)];
        assert_eq!(assignment(&tracks, &measurements), [Some(0), Some(1)]);
    }

    #[test]
    fn measurements_outside_of_the_gate_are_not_assigned() {
        let tracks = [track(0.0, 0.0), track(50.0, 0.0)];
        assert_eq!(assignment(&tracks, &[measurement(51.0, 0.2)]), [None, Some(0)]);
        assert_eq!(assignment(&tracks, &[]), [None, None]);
        assert!(assignment(&[], &[measurement(0.0, 0.0)]).is_empty());
        assert_eq!(assignment(&tracks, &[measurement(f64::NAN, 0.0)]), [None, None]);
    }

    proptest! {
        #[test]
        fn no_detection_is_assigned_twice(
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
