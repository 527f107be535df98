//! Double lane changes: two lane changes that overlap in time.

use super::LaneChange;

/// Marks as double, and as not complete, each lane change that begins before the previous one in the same direction has
/// ended, and that previous one.
///
/// `found` holds the lane changes of one track in order of their crossings.
pub(super) fn mark_doubles(found: &mut [LaneChange]) {
    for next in 1..found.len() {
        let (before, after) = found.split_at_mut(next);
        let (first, second) = (&mut before[next - 1], &mut after[0]);
        if first.direction == second.direction && second.start_s < first.end_s {
            for change in [first, second] {
                change.double = true;
                change.complete = false;
            }
        }
    }
}
