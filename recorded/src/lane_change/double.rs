//! Overlapping lane changes, and double lane changes: from one outer lane of the road to the other
//! in one movement.

use closecall_traffic::Lane;

use super::LaneChange;
use crate::trajectory_data::LaneMarkings;

/// The lanes of each road of a trajectory file, as its markings show them.
#[derive(Clone, Debug, Default)]
pub(super) struct RoadLanes {
    /// The leftmost and the rightmost lane of each road, in ascending order.
    outer: Vec<[u8; 2]>,
}

impl RoadLanes {
    /// Groups the lanes that have a marking between them. Lane 1 is always the leftmost lane of the
    /// first road.
    pub(super) fn new(markings: &LaneMarkings) -> Self {
        let mut outer: Vec<[u8; 2]> = Vec::new();
        for left in (1..u8::MAX).filter(|&lane| markings.right_edge_m(Lane(lane)).is_some()) {
            match outer.last_mut() {
                Some([_, rightmost]) if *rightmost == left => *rightmost = left + 1,
                // Lane numbers of the next road start after one omitted number: lane 2 is no
                // leftmost lane.
                _ => outer.push([if left == 2 { 1 } else { left }, left + 1]),
            }
        }
        Self { outer }
    }

    /// Returns true if the two lanes are the outer lanes of one road that has a lane between them.
    fn are_outer(&self, from: u8, to: u8) -> bool {
        self.outer.contains(&[from.min(to), from.max(to)]) && from.abs_diff(to) > 1
    }
}

/// Marks the lane changes that overlap in time with another lane change in the same direction, and
/// the lane changes that together lead from one outer lane to the other. Neither is complete,
/// because its start and end are not its own.
///
/// `changes` holds the lane changes of one track in order of their crossings.
pub(super) fn mark_doubles(changes: &mut [LaneChange], road: &RoadLanes) {
    let continues =
        |first: &LaneChange, second: &LaneChange| first.direction == second.direction && second.start_s < first.end_s;
    for chain in changes.chunk_by_mut(continues) {
        let [first, .., last] = &*chain else { continue };
        let double = road.are_outer(first.from_lane, last.to_lane);
        for change in chain {
            change.overlapping = true;
            change.double = double;
            change.complete = false;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_outer_lanes_belong_to_one_road() {
        // Lanes 1 to 4, and a second road with lanes 6 to 8. No vehicle crosses the first marking.
        let edges = [(2, -7.0), (3, -10.5), (6, -1_003.5), (7, -1_007.0)].map(|(lane, d_m)| (Lane(lane), d_m));
        let road = RoadLanes::new(&LaneMarkings::from_right_edges(edges));
        assert_eq!(road.outer, [[1, 4], [6, 8]]);
        assert!(road.are_outer(4, 1) && road.are_outer(6, 8));
        assert!(!road.are_outer(4, 2) && !road.are_outer(1, 8));
        let two_lanes = RoadLanes::new(&LaneMarkings::from_right_edges([(Lane(1), -3.5)]));
        assert!(!two_lanes.are_outer(2, 1), "one lane change on a road of two lanes is no double one");
    }
}
