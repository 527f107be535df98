//! Where a lateral position lies in its lane.

use closecall_traffic::Lane;

use crate::recordings::LaneMarkings;

/// Lanes that are laid out: more than any carriageway has.
const LANES: u8 = 16;

/// A lane narrower than this is none: two markings were mistaken for each other [m].
const NARROWEST_LANE_M: f64 = 2.0;

/// One lane and its middle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LanePlace {
    pub(crate) lane: Lane,
    pub(crate) centre_m: f64,
    pub(crate) width_m: f64,
}

/// Lane markings with those that are not known filled in at the typical distance.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LaneGrid {
    /// Right edges of lanes 1, 2 … [m], falling.
    right_edges_m: Vec<f64>,
}

impl LaneGrid {
    pub(crate) fn new(markings: &LaneMarkings) -> Self {
        let typical_m = markings.typical_lane_width_m();
        let mut left_m = 0.0;
        let right_edges_m = (1..=LANES).map(|lane| {
            let known = markings.right_edge_m(Lane(lane)).filter(|edge_m| left_m - edge_m >= NARROWEST_LANE_M);
            left_m = known.unwrap_or(left_m - typical_m);
            left_m
        });
        Self { right_edges_m: right_edges_m.collect() }
    }

    /// The lane at the lateral position `d_m`, where there is one.
    pub(crate) fn at(&self, d_m: f64) -> Option<LanePlace> {
        let index = self.right_edges_m.iter().position(|edge_m| d_m > *edge_m).filter(|_| d_m <= 0.0)?;
        let left_m = if index == 0 { 0.0 } else { self.right_edges_m[index - 1] };
        let right_m = self.right_edges_m[index];
        let lane = Lane(u8::try_from(index + 1).ok()?);
        Some(LanePlace { lane, centre_m: 0.5 * (left_m + right_m), width_m: left_m - right_m })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recordings::DEFAULT_LANE_WIDTH_M;

    #[test]
    fn unknown_markings_are_filled_in() {
        let grid = LaneGrid::new(&LaneMarkings::default());
        let place = grid.at(-1.5 * DEFAULT_LANE_WIDTH_M).unwrap();
        assert_eq!((place.lane, place.width_m), (Lane(2), DEFAULT_LANE_WIDTH_M));
        assert_eq!(place.centre_m, -1.5 * DEFAULT_LANE_WIDTH_M);
        assert_eq!(grid.at(0.1), None);
        assert_eq!(grid.at(f64::NAN), None);
        assert_eq!(grid.at(-1_000.0), None);
    }
}
