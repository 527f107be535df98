//! Two lane changes in one go.

use super::LaneChange;

/// Marks lane changes of one track that follow each other in the same direction before the first has ended; `found` is
/// in the order of their crossings. Those are not complete.
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
