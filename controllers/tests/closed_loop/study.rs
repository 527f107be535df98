//! A paired study: every sample with and without the margin increase system.

use crate::encounter::{Case, Outcome, run};

/// Counts of one study.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Ledger {
    pub(crate) without: usize,
    pub(crate) with: usize,
    pub(crate) prevented: usize,
    pub(crate) induced: usize,
    /// Collisions that E had with F.
    pub(crate) with_front: usize,
}

/// Runs the samples of `case` in both arms.
pub(crate) fn paired(case: &Case, samples: u64) -> (Ledger, Vec<(Outcome, Outcome)>) {
    let pairs: Vec<_> = (0..samples).map(|index| (run(case, index, false), run(case, index, true))).collect();
    let mut ledger = Ledger::default();
    for (without, with) in &pairs {
        let hits = |outcome: &Outcome| outcome.collision.is_some_and(|(a, b)| a == 0 || b == 0);
        let (a, b) = (hits(without), hits(with));
        ledger.without += usize::from(a);
        ledger.with += usize::from(b);
        ledger.prevented += usize::from(a && !b);
        ledger.induced += usize::from(b && !a);
        for outcome in [without, with] {
            ledger.with_front += usize::from(outcome.collision == Some((0, 1)));
        }
    }
    (ledger, pairs)
}
