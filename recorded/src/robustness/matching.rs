//! One-to-one matching of lane changes.

use std::collections::{BTreeMap, BTreeSet};

use crate::lane_change::LaneChange;

/// Returns the largest number of pairs of a lane change of `found` and one of `known` that match, if each belongs to at
/// most one pair.
pub(super) fn matches(found: &[LaneChange], known: &[LaneChange]) -> usize {
    let partners_of = |known: &LaneChange| (0..found.len()).filter(|&k| is_same(&found[k], known)).collect();
    let mut matching = Matching { candidates: known.iter().map(partners_of).collect(), taken: BTreeMap::new() };
    (0..known.len()).filter(|&known| matching.add(known, &mut BTreeSet::new())).count()
}

/// Returns true if two lane changes have the same direction and overlap in time.
fn is_same(a: &LaneChange, b: &LaneChange) -> bool {
    a.direction == b.direction && a.start_s <= b.end_s && b.start_s <= a.end_s
}

/// A matching that grows along augmenting paths.
struct Matching {
    /// The found lane changes that match each known one.
    candidates: Vec<Vec<usize>>,
    /// The known lane change with which each found one is paired.
    taken: BTreeMap<usize, usize>,
}

impl Matching {
    /// Pairs `known` with a candidate that is free, or whose own partner can take another one.
    fn add(&mut self, known: usize, visited: &mut BTreeSet<usize>) -> bool {
        for found in self.candidates[known].clone() {
            if !visited.insert(found) {
                continue;
            }
            let rival = self.taken.get(&found).copied();
            if rival.is_none_or(|rival| self.add(rival, visited)) {
                self.taken.insert(found, known);
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
        let found = detect(&smooth(&trajectory_data_of(vec![track])));
        let [change] = &found[..] else { panic!("{found:?}") };
        let during = |start_s, end_s| LaneChange { start_s, end_s, ..change.clone() };
        // Two pieces of one lane change, and one lane change over two.
        assert_eq!(matches(&[during(4.0, 6.0), during(7.0, 9.0)], &[during(4.0, 10.0)]), 1);
        assert_eq!(matches(&[during(4.0, 10.0)], &[during(4.0, 6.0), during(7.0, 9.0)]), 1);
        // The first takes the only partner of the second unless it gives way.
        assert_eq!(matches(&[during(5.0, 6.0), during(1.0, 2.0)], &[during(1.0, 6.0), during(5.5, 7.0)]), 2);
        assert_eq!(matches(&[during(1.0, 2.0)], &[during(3.0, 4.0)]), 0);
    }
}
