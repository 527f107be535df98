//! One-to-one matching of lane changes.

use std::collections::{BTreeMap, BTreeSet};

use crate::lane_change::LaneChange;

/// Returns the largest number of matching pairs of a lane change of `detected` and a lane change of
/// `expected`. Each lane change belongs to at most one pair.
pub(super) fn matches(detected: &[LaneChange], expected: &[LaneChange]) -> usize {
    let partners_of = |change: &LaneChange| (0..detected.len()).filter(|&k| is_same(&detected[k], change)).collect();
    let mut matching = Matching { candidates: expected.iter().map(partners_of).collect(), taken: BTreeMap::new() };
    (0..expected.len()).filter(|&index| matching.add(index, &mut BTreeSet::new())).count()
}

/// Returns true if two lane changes have the same direction and overlap in time.
fn is_same(a: &LaneChange, b: &LaneChange) -> bool {
    a.direction == b.direction && a.start_s <= b.end_s && b.start_s <= a.end_s
}

/// A matching that grows along augmenting paths.
struct Matching {
    /// The found lane changes that match each known one.
    candidates: Vec<Vec<usize>>,
    /// The expected lane change that each detected lane change is paired with.
    taken: BTreeMap<usize, usize>,
}

impl Matching {
    /// Pairs `expected` with a free candidate, or with a candidate whose partner can take another
    /// candidate.
    fn add(&mut self, expected: usize, visited: &mut BTreeSet<usize>) -> bool {
        for detected in self.candidates[expected].clone() {
            if !visited.insert(detected) {
                continue;
            }
            let rival = self.taken.get(&detected).copied();
            if rival.is_none_or(|rival| self.add(rival, visited)) {
                self.taken.insert(detected, expected);
                return true;
            }
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filters::smooth;
    use crate::lane_change::detect;
    use crate::trajectory_data::test_support::{changing_track, trajectory_data_of};

    #[test]
    fn each_lane_change_matches_at_most_one() {
        let track = changing_track(1, (0.0, 30.0), (-5.25, -1.75), (4.0, 6.0), 150);
        let changes = detect(&smooth(&trajectory_data_of(vec![track])));
        let [change] = &changes[..] else { panic!("{changes:?}") };
        let during = |start_s, end_s| LaneChange { start_s, end_s, ..change.clone() };
        // Two pieces of one lane change, and one lane change over two.
        assert_eq!(matches(&[during(4.0, 6.0), during(7.0, 9.0)], &[during(4.0, 10.0)]), 1);
        assert_eq!(matches(&[during(4.0, 10.0)], &[during(4.0, 6.0), during(7.0, 9.0)]), 1);
        // The first takes the only partner of the second unless it gives way.
        assert_eq!(matches(&[during(5.0, 6.0), during(1.0, 2.0)], &[during(1.0, 6.0), during(5.5, 7.0)]), 2);
        assert_eq!(matches(&[during(1.0, 2.0)], &[during(3.0, 4.0)]), 0);
    }
}
