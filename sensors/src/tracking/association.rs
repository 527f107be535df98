//! Which detection belongs to which track: gate, then the assignment of least total cost.
//!
//! The cost of a pair is its negative log-likelihood up to constants, d² + ln det S, d the Mahalanobis distance and S the
//! innovation's covariance. A pair is allowed where d² is below the gate. Each track may also stay without a detection
//! at the cost of one at the edge of the gate, so that a far-fetched pair is not forced. The optimum is found by the
//! Kuhn–Munkres algorithm of the `pathfinding` crate, on integers, so that the result does not depend on rounding.

use nalgebra::{Matrix2, Vector2};
use pathfinding::prelude::{Matrix, kuhn_munkres_min};

use super::kalman::GroundFilter;

/// A true pair lies outside of the gate once in a thousand scans: χ² of 2 degrees of freedom.
pub(super) const GATE: f64 = 13.8;

/// Integer cost per unit of log-likelihood.
const COST_SCALE: f64 = 1_000.0;

/// More than any sum of allowed costs: marks pairs outside of the gate.
const FORBIDDEN: i64 = 1_000_000_000;

/// A detection's face in ground axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Measurement {
    pub(super) position_m: Vector2<f64>,
    pub(super) noise_m2: Matrix2<f64>,
    /// Time from the measurement to the scan's reference [s]: a track's motion in it is added to the position.
    pub(super) age_s: f64,
}

impl Measurement {
    /// Where the face would have been measured at the scan's reference time, moving like `filter`.
    pub(super) fn position_with(&self, filter: &GroundFilter) -> Vector2<f64> {
        self.position_m + filter.velocity_mps() * self.age_s
    }
}

fn cost(filter: &GroundFilter, measurement: &Measurement) -> Option<i64> {
    let innovation = filter.innovation(measurement.position_with(filter), &measurement.noise_m2)?;
    let distance = innovation.distance();
    if !(distance <= GATE) {
        return None;
    }
    Some(to_integer(distance + innovation.covariance_m2.determinant().ln()))
}

fn to_integer(cost: f64) -> i64 {
    #[expect(clippy::cast_possible_truncation, reason = "a float cast saturates, far above any gated cost")]
    let cost = (cost * COST_SCALE).round() as i64;
    cost.clamp(-FORBIDDEN / 1_000, FORBIDDEN / 1_000)
}

/// The detection of each track, in `assigned`; its place in `measurements`, or nothing.
pub(super) fn assign<'a>(
    filters: impl ExactSizeIterator<Item = &'a GroundFilter>,
    measurements: &[Measurement],
    assigned: &mut Vec<Option<usize>>,
) {
    assigned.clear();
    let (rows, real) = (filters.len(), measurements.len());
    if rows == 0 || real == 0 {
        assigned.resize(rows, None);
        return;
    }
    // One more column for each track: its own "no detection".
    let mut costs = Matrix::new(rows, real + rows, FORBIDDEN);
    for (row, filter) in filters.enumerate() {
        let mut widest = f64::NEG_INFINITY;
        for (column, measurement) in measurements.iter().enumerate() {
            if let Some(cost) = cost(filter, measurement) {
                costs[(row, column)] = cost;
                let sum = filter.covariance.fixed_view::<2, 2>(0, 0) + measurement.noise_m2;
                widest = widest.max(sum.determinant().ln());
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

    use super::super::kalman::turned;
    use super::*;

    fn filter(x_m: f64, y_m: f64) -> GroundFilter {
        let unit = Matrix2::identity();
        GroundFilter::first(Vector2::new(x_m, y_m), unit * 0.25, Vector2::zeros(), unit)
    }

    fn measurement(x_m: f64, y_m: f64) -> Measurement {
        Measurement { position_m: Vector2::new(x_m, y_m), noise_m2: turned(0.5, 0.5, 0.0), age_s: 0.0 }
    }

    fn assignment(filters: &[GroundFilter], measurements: &[Measurement]) -> Vec<Option<usize>> {
        let mut assigned = Vec::new();
        assign(filters.iter(), measurements, &mut assigned);
        assigned
    }

    #[test]
    fn the_best_sum_wins_over_the_best_pair() {
        // The first track is nearest to measurement 1, but then the second would have none.
        let filters = [filter(0.0, 0.0), filter(2.0, 0.0)];
        let measurements = [measurement(-1.2, 0.0), measurement(0.9, 0.0)];
        assert_eq!(assignment(&filters, &measurements), [Some(0), Some(1)]);
    }

    #[test]
    fn nothing_is_assigned_beyond_the_gate() {
        let filters = [filter(0.0, 0.0), filter(50.0, 0.0)];
        assert_eq!(assignment(&filters, &[measurement(51.0, 0.2)]), [None, Some(0)]);
        assert_eq!(assignment(&filters, &[]), [None, None]);
        assert!(assignment(&[], &[measurement(0.0, 0.0)]).is_empty());
        assert_eq!(assignment(&filters, &[measurement(f64::NAN, 0.0)]), [None, None]);
    }

    proptest! {
        #[test]
        fn no_detection_is_used_twice(
            tracks in prop::collection::vec((-10.0..10.0, -4.0..4.0), 0..8),
            detections in prop::collection::vec((-10.0..10.0, -4.0..4.0), 0..8),
        ) {
            let filters: Vec<_> = tracks.iter().map(|&(x, y)| filter(x, y)).collect();
            let measurements: Vec<_> = detections.iter().map(|&(x, y)| measurement(x, y)).collect();
            let mut used: Vec<_> = assignment(&filters, &measurements).into_iter().flatten().collect();
            let count = used.len();
            used.sort_unstable();
            used.dedup();
            prop_assert_eq!(used.len(), count);
        }
    }
}
