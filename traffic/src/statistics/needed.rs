//! The number of samples that a bound needs.
//!
//! It depends on the results of further samples, which are unknown. It is therefore computed under
//! two assumptions: that none of them is a hit, which gives the smallest possible number, and that
//! they are hits at the observed rate.

/// Largest number of samples that is considered.
pub const MAX_SAMPLES: u64 = 100_000_000;

/// Returns the smallest number of samples for which `passes(hits, samples)` holds, with a fixed
/// number of hits. `passes` must change from false to true once as the number of samples grows.
///
/// Returns `None` if more than [`MAX_SAMPLES`] would be needed.
pub fn min_samples(hits: u64, passes: impl Fn(u64, u64) -> bool) -> Option<u64> {
    let max_samples = MAX_SAMPLES.max(hits);
    first_that_holds(hits, max_samples, |samples| passes(hits, samples))
}

/// Returns the smallest number of samples for which `passes(hits, samples)` holds, if further
/// samples are hits at the rate of `hits` in `samples`. The number of hits is rounded up.
///
/// Returns `None` if more than [`MAX_SAMPLES`] would be needed, or if no number suffices.
pub fn samples_at_rate(hits: u64, samples: u64, passes: impl Fn(u64, u64) -> bool) -> Option<u64> {
    if hits == 0 || samples == 0 {
        return min_samples(hits, passes);
    }
    // At the rate of k hits in n samples, j hits mean at most j·n/k samples, and more than (j −
    // 1)·n/k.
    let max_samples_with = |total_hits: u64| u128::from(total_hits) * u128::from(samples) / u128::from(hits);
    let is_enough = |total_hits: u64| {
        min_samples(total_hits, &passes).is_some_and(|least| u128::from(least) <= max_samples_with(total_hits))
    };
    let max_hits = u64::try_from(u128::from(MAX_SAMPLES) * u128::from(hits) / u128::from(samples)).ok()?;
    let total_hits = first_that_holds(hits, max_hits.max(hits), is_enough)?;
    let before = u64::try_from(max_samples_with(total_hits - 1)).ok()?;
    min_samples(total_hits, &passes).map(|least| least.max(before + 1)).filter(|total| *total <= MAX_SAMPLES)
}

/// Returns the first number in `from ..= to` for which `holds` is true, or `None` if there is none.
/// `holds` must change from false to true once.
///
/// The search doubles the distance from `from`, then bisects, since `holds` may be slow for large
/// numbers.
pub fn first_that_holds(from: u64, to: u64, holds: impl Fn(u64) -> bool) -> Option<u64> {
    if holds(from) {
        return Some(from);
    }
    let (mut fails, mut distance) = (from, 1);
    let mut succeeds = loop {
        let tried = from.saturating_add(distance).min(to);
        if tried <= fails {
            return None;
        }
        if holds(tried) {
            break tried;
        }
        fails = tried;
        distance = distance.saturating_mul(2);
    };
    while succeeds - fails > 1 {
        let middle = fails + (succeeds - fails) / 2;
        if holds(middle) {
            succeeds = middle;
        } else {
            fails = middle;
        }
    }
    Some(succeeds)
}
