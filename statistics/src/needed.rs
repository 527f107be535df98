//! How many samples a bound still needs.
//!
//! The answer depends on what the further samples will show, which nobody knows; so it is given under two assumptions:
//! that none of them is a hit, which is the least that can be needed, and that they are hits at the rate observed.

/// Numbers of samples above this are not looked for.
pub const MOST_SAMPLES: u64 = 100_000_000;

/// The smallest number of samples, `hits` of them hits, with which `passes`: which has to go from false to true once as
/// the samples grow. Nothing where that is more than [`MOST_SAMPLES`].
pub fn least_samples(hits: u64, passes: impl Fn(u64, u64) -> bool) -> Option<u64> {
    let most = MOST_SAMPLES.max(hits);
    first(hits, most, |samples| passes(hits, samples))
}

/// The smallest number of samples with which `passes` where they go on to be hits at the rate of `hits` in `samples`,
/// rounded up. Nothing where that is more than [`MOST_SAMPLES`], or never.
pub fn samples_at_rate(hits: u64, samples: u64, passes: impl Fn(u64, u64) -> bool) -> Option<u64> {
    if hits == 0 || samples == 0 {
        return least_samples(hits, passes);
    }
    // With j hits at that rate there are at most j·n/k samples, and more than (j − 1)·n/k.
    let with = |total_hits: u64| u128::from(total_hits) * u128::from(samples) / u128::from(hits);
    let enough =
        |total_hits: u64| least_samples(total_hits, &passes).is_some_and(|least| u128::from(least) <= with(total_hits));
    let most_hits = u64::try_from(u128::from(MOST_SAMPLES) * u128::from(hits) / u128::from(samples)).ok()?;
    let total_hits = first(hits, most_hits.max(hits), enough)?;
    let before = u64::try_from(with(total_hits - 1)).ok()?;
    least_samples(total_hits, &passes).map(|least| least.max(before + 1)).filter(|total| *total <= MOST_SAMPLES)
}

/// The first number in `from ..= to` with which `holds`, which has to go from false to true once.
///
/// Looked for by doubling the distance from `from`, then by halving: `holds` may become slow for large numbers.
fn first(from: u64, to: u64, holds: impl Fn(u64) -> bool) -> Option<u64> {
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
