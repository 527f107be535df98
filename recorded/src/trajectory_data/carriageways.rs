//! Carriageways, as the lateral positions of the traffic tell them apart.

use std::collections::BTreeSet;

use closecall_traffic::Trajectory;

use super::markings::CARRIAGEWAY_GAP_M;

/// The carriageways of a recording: between them, no vehicle drives on a strip that is wider than
/// some lanes.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Carriageways {
    /// Lateral positions between two carriageways (m), in ascending order.
    medians_m: Vec<f64>,
}

impl Carriageways {
    /// Tells apart the carriageways of `tracks`, to a metre.
    pub(crate) fn of<'t>(tracks: impl Iterator<Item = &'t Trajectory>) -> Self {
        let mut metres: BTreeSet<i64> = BTreeSet::new();
        let mut latest = None;
        for point in tracks.flat_map(|track| &track.points) {
            #[expect(clippy::cast_possible_truncation, reason = "a float cast saturates")]
            let metre = point.d_m.floor() as i64;
            if latest.replace(metre) != Some(metre) {
                metres.insert(metre);
            }
        }
        let metres: Vec<i64> = metres.into_iter().collect();
        let is_gap = |pair: &&[i64]| (pair[1] - pair[0]) as f64 > CARRIAGEWAY_GAP_M;
        let medians_m = metres.windows(2).filter(is_gap).map(|pair| 0.5 * (pair[0] + pair[1] + 1) as f64);
        Self { medians_m: medians_m.collect() }
    }

    /// Returns true if two lateral positions are on one carriageway.
    pub(crate) fn share(&self, a_m: f64, b_m: f64) -> bool {
        self.at(a_m) == self.at(b_m)
    }

    /// Returns the number of the carriageway at a lateral position, counted from the left, from 0
    /// on.
    pub(crate) fn at(&self, d_m: f64) -> usize {
        self.medians_m.len() - self.medians_m.partition_point(|median_m| *median_m < d_m)
    }

    /// Returns the number of carriageways.
    pub(crate) fn count(&self) -> usize {
        self.medians_m.len() + 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trajectory_data::test_support::straight_track;

    #[test]
    fn a_wide_strip_without_vehicles_parts_carriageways_and_an_empty_lane_does_not() {
        let tracks = [-1.75, -8.75, -40.0, -43.5].map(|d_m| straight_track(1, 0.0, 30.0, d_m, 10));
        let carriageways = Carriageways::of(tracks.iter());
        assert!(carriageways.share(-1.75, -8.75) && carriageways.share(-40.0, -43.5));
        assert!(!carriageways.share(-8.75, -40.0) && !carriageways.share(-1.75, -43.5));
        assert_eq!((carriageways.count(), carriageways.at(-1.75), carriageways.at(-43.5)), (2, 0, 1));
    }
}
