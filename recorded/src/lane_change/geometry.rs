//! Lane geometry: the lane that contains a lateral position.

use closecall_traffic::Lane;

use crate::trajectory_data::{LANE_WIDTHS_M, LaneMarkings};

/// Number of lanes in a grid: more than any carriageway has.
const LANES: u8 = 16;

/// A lane with its lateral position and width.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LaneGeometry {
    /// The lane.
    pub(crate) lane: Lane,
    /// Lateral position of its centre (m).
    pub(crate) centre_m: f64,
    /// Width (m).
    pub(crate) width_m: f64,
}

/// Lane markings. Unknown markings are filled in at the typical lane width.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LaneGrid {
    /// Lateral positions of the right edges of lanes 1, 2 … (m), in descending order.
    right_edges_m: Vec<f64>,
}

impl LaneGrid {
    /// Creates the grid from the known markings.
    pub(crate) fn new(markings: &LaneMarkings) -> Self {
        let typical_m = markings.typical_lane_width_m();
        let mut right_edges_m = Vec::with_capacity(usize::from(LANES));
        let mut left_m = 0.0;
        while let Some(lane) = u8::try_from(right_edges_m.len() + 1).ok().filter(|lane| *lane <= LANES) {
            // The lanes up to the next known marking share their width.
            let next_edge = (lane..=LANES).find_map(|right| Some((right, markings.right_edge_m(Lane(right))?)));
            let shared = next_edge.map(|(right, edge_m)| (left_m - edge_m) / f64::from(right - lane + 1));
            let width_m = shared.filter(|width_m| LANE_WIDTHS_M.contains(width_m)).unwrap_or(typical_m);
            left_m -= width_m;
            right_edges_m.push(left_m);
        }
        Self { right_edges_m }
    }

    /// Returns the lane at the lateral position `d_m`, or `None` if there is none.
    pub(crate) fn at(&self, d_m: f64) -> Option<LaneGeometry> {
        let index = self.right_edges_m.iter().position(|edge_m| d_m > *edge_m).filter(|_| d_m <= 0.0)?;
        let left_m = if index == 0 { 0.0 } else { self.right_edges_m[index - 1] };
        let right_m = self.right_edges_m[index];
        let lane = Lane(u8::try_from(index + 1).ok()?);
        Some(LaneGeometry { lane, centre_m: 0.5 * (left_m + right_m), width_m: left_m - right_m })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trajectory_data::DEFAULT_LANE_WIDTH_M;

    #[test]
    fn lanes_between_known_markings_share_their_width() {
        let grid = LaneGrid::new(&LaneMarkings::from_right_edges([(Lane(2), -6.8), (Lane(5), -17.3)]));
        let widths = [-3.0, -5.0, -8.0, -15.0].map(|d_m| grid.at(d_m).unwrap().width_m);
        assert!(
            widths.iter().zip([3.4, 3.4, 3.5, 3.5]).all(|(computed_m, width_m)| (computed_m - width_m).abs() < 1e-9),
            "{widths:?}"
        );
    }

    #[test]
    fn unknown_markings_are_filled_in() {
        let grid = LaneGrid::new(&LaneMarkings::default());
        let lane = grid.at(-1.5 * DEFAULT_LANE_WIDTH_M).unwrap();
        assert_eq!((lane.lane, lane.width_m), (Lane(2), DEFAULT_LANE_WIDTH_M));
        assert_eq!(lane.centre_m, -1.5 * DEFAULT_LANE_WIDTH_M);
        assert_eq!(grid.at(0.1), None);
        assert_eq!(grid.at(f64::NAN), None);
        assert_eq!(grid.at(-1_000.0), None);
    }
}
