//! Golden values from SciPy, properties, and how often the bounds are right.

use closecall_traffic::{ActorId, Stream, stream};
use proptest::prelude::*;
use rand::RngExt;

use super::{binomial, interval, mcnemar, needed, sequence};

/// Made by `tests/golden/statistics.py`.
const GOLDEN: &str = include_str!("../../tests/golden/statistics.csv");

/// What SciPy's own incomplete beta function and its inverse agree to for large samples.
const GOLDEN_TOLERANCE: f64 = 1e-9;

#[test]
fn every_value_agrees_with_scipy() {
    let mut compared = 0;
    for line in GOLDEN.lines().filter(|line| !line.starts_with('#')).skip(1) {
        let [quantity, hits, samples, parameter, value] = line.split(',').collect::<Vec<_>>()[..] else {
            panic!("five columns: {line}")
        };
        let (k, n): (u64, u64) = (hits.parse().unwrap(), samples.parse().unwrap());
        let (parameter, expected): (f64, f64) = (parameter.parse().unwrap(), value.parse().unwrap());
        let found = match quantity {
            "upper" => interval::upper_bound(k, n, parameter),
            "lower" => interval::lower_bound(k, n, parameter),
            "sequence-upper" => sequence::upper_bound(k, n, parameter),
            "at-most" => binomial::at_most(k, n, parameter),
            "probability" => binomial::probability(k, n, parameter),
            "mcnemar" => mcnemar::two_sided_p(k, n),
            other => panic!("unknown quantity {other}"),
        };
        let error = if expected == 0.0 { found.abs() } else { (found / expected - 1.0).abs() };
        assert!(error < GOLDEN_TOLERANCE, "{line}: {found}");
        compared += 1;
    }
    assert!(compared > 300, "only {compared} golden values");
}

#[test]
fn zero_hits_give_an_explicit_bound() {
    // The rule of three: about 3/n at 95 %.
    let bound = interval::upper_bound(0, 300, 0.95);
    assert!((bound - (1.0 - 0.05_f64.powf(1.0 / 300.0))).abs() < 1e-15);
    assert!((bound - 0.009_936).abs() < 1e-6);
}

#[test]
fn nothing_is_known_of_no_samples_and_nonsense_gives_no_bound() {
    assert_eq!(interval::clopper_pearson(0, 0, 0.95), [0.0, 1.0]);
    assert_eq!(sequence::interval(0, 0, 0.95), [0.0, 1.0]);
    for confidence in [f64::NAN, 0.0, 1.0, 1.5] {
        assert!(interval::upper_bound(1, 10, confidence).is_nan());
        assert!(interval::lower_bound(1, 10, confidence).is_nan());
        assert!(sequence::upper_bound(1, 10, confidence).is_nan());
    }
    assert!(binomial::at_most(1, 10, f64::NAN).is_nan() && binomial::at_least(1, 10, f64::NAN).is_nan());
    assert!(!sequence::is_certain(f64::NAN, 0.95));
    assert!(sequence::evidence_below(11, 10, 0.5).is_nan());
}

#[test]
fn the_sequence_of_two_million_samples_is_finite() {
    for (hits, p) in [(0, 0.5), (2_000_000, 0.5), (1_000_000, 0.01), (1_000, 0.9)] {
        let (below, above) =
            (sequence::evidence_below(hits, 2_000_000, p), sequence::evidence_above(hits, 2_000_000, p));
        assert!(!below.is_nan() && !above.is_nan(), "{hits}: {below} {above}");
        assert!((below > 1.0) != (above > 1.0), "{hits}: {below} {above}");
    }
}

#[test]
fn as_many_samples_as_stated_are_needed() {
    let passes = |hits: u64, samples: u64| interval::upper_bound(hits, samples, 0.95) <= 0.01;
    assert_eq!(needed::least_samples(0, passes), Some(299));
    assert_eq!(needed::least_samples(1, passes), Some(473));
    // 1 of 200 is half of what is allowed: found by trying every number.
    let at_rate = needed::samples_at_rate(1, 200, passes).unwrap();
    let brute = (200..).find(|samples: &u64| passes(samples.div_ceil(200), *samples)).unwrap();
    assert_eq!(at_rate, brute);
    // At the rate allowed, or above, no number suffices.
    assert_eq!(needed::samples_at_rate(1, 100, passes), None);
    assert_eq!(needed::samples_at_rate(5, 100, passes), None);
}

proptest! {
    #[test]
    fn a_tail_and_its_complement_make_one(k in 0_u64..400, more in 0_u64..400, p in 0.001..0.999) {
        let n = k + more;
        let whole = binomial::at_most(k, n, p) + binomial::at_least(k + 1, n, p);
        prop_assert!((whole - 1.0).abs() < 1e-12, "{whole}");
        let sum: f64 = (0..=k).map(|hits| binomial::probability(hits, n, p)).sum();
        prop_assert!((sum - binomial::at_most(k, n, p)).abs() < 1e-12);
    }

    #[test]
    fn bounds_enclose_the_estimate_and_are_monotone(k in 0_u64..200, more in 1_u64..200, c in 0.51..0.999) {
        let n = k + more;
        let estimate = k as f64 / n as f64;
        let (low, high) = (interval::lower_bound(k, n, c), interval::upper_bound(k, n, c));
        prop_assert!(low <= estimate && estimate <= high && low >= 0.0 && high <= 1.0);
        prop_assert!(interval::upper_bound(k, n + 1, c) <= high, "a sample without a hit lowers it");
        prop_assert!(interval::upper_bound(k + 1, n + 1, c) >= high, "a hit raises it");
        prop_assert!(interval::lower_bound(k, n + 1, c) <= low);
        prop_assert!(interval::lower_bound(k + 1, n + 1, c) >= low);
        let surer = 0.5 * (1.0 + c);
        prop_assert!(interval::upper_bound(k, n, surer) >= high && interval::lower_bound(k, n, surer) <= low);
    }

    #[test]
    fn the_mirror_image_has_mirrored_bounds(k in 0_u64..200, more in 0_u64..200, c in 0.51..0.999) {
        let n = k + more;
        let mirrored = 1.0 - interval::upper_bound(n - k, n, c);
        prop_assert!((interval::lower_bound(k, n, c) - mirrored).abs() < 1e-12);
        let mirrored = 1.0 - sequence::upper_bound(n - k, n, c);
        prop_assert!((sequence::lower_bound(k, n, c) - mirrored).abs() < 1e-12);
    }

    /// To hold at every n costs something at each.
    #[test]
    fn the_sequence_is_wider_than_the_interval(k in 0_u64..300, more in 1_u64..300, c in 0.51..0.999) {
        let n = k + more;
        prop_assert!(sequence::upper_bound(k, n, c) >= interval::upper_bound(k, n, c));
        prop_assert!(sequence::lower_bound(k, n, c) <= interval::lower_bound(k, n, c));
        prop_assert!(sequence::upper_bound(k, n + 1, c) <= sequence::upper_bound(k, n, c));
    }

    /// The bet is fair where the truth is p: its mean after one sample more is what it is now.
    #[test]
    fn the_evidence_is_a_martingale(k in 0_u64..500, more in 0_u64..500, p in 0.005..0.995) {
        let n = k + more;
        for evidence in [sequence::evidence_below, sequence::evidence_above] {
            let (now, hit, miss) = (evidence(k, n, p), evidence(k + 1, n + 1, p), evidence(k, n + 1, p));
            prop_assume!(now < 1e280);
            let mean = p * hit + (1.0 - p) * miss;
            prop_assert!((mean / now - 1.0).abs() < 1e-9, "{mean} {now}");
        }
    }

    #[test]
    fn mcnemar_does_not_care_for_the_order(b in 0_u64..200, c in 0_u64..200) {
        let p = mcnemar::two_sided_p(b, c);
        prop_assert_eq!(p, mcnemar::two_sided_p(c, b));
        prop_assert!(p > 0.0 && p <= 1.0);
        prop_assert!(mcnemar::two_sided_p(b.max(c) + 1, b.min(c)) <= p);
    }

    #[test]
    fn what_is_said_to_be_needed_is_enough_and_not_too_much(k in 0_u64..20, p in 0.01..0.4, c in 0.6..0.99) {
        let passes = |hits: u64, samples: u64| interval::upper_bound(hits, samples, c) <= p;
        let least = needed::least_samples(k, passes).unwrap();
        prop_assert!(passes(k, least) && (least == k || !passes(k, least - 1)));
    }
}

fn rng(channel: &str) -> Stream {
    stream(0, 0, &ActorId::new("statistics").unwrap(), channel)
}

/// Campaigns of each experiment.
const CAMPAIGNS: u32 = 1_000;

#[test]
fn exact_intervals_cover_the_truth() {
    let mut rng = rng("coverage");
    for (truth, samples) in [(0.003, 300_u64), (0.05, 200), (0.3, 100)] {
        let covered = (0..CAMPAIGNS)
            .filter(|_| {
                let hits = (0..samples).filter(|_| rng.random::<f64>() < truth).count() as u64;
                let [low, high] = interval::clopper_pearson(hits, samples, 0.95);
                low <= truth && truth <= high
            })
            .count();
        // At least 95 % in the long run; 93.5 % leaves two standard errors of 1,000 campaigns.
        assert!(covered >= 935, "{covered} of {CAMPAIGNS} at {truth}");
    }
}

/// Looks after every sample and says whether the truth was ever on the wrong side of a bound at 95 %.
fn is_ever_refuted(truth: f64, looks: u64, rng: &mut Stream, refutes: impl Fn(u64, u64) -> bool) -> bool {
    let mut hits = 0;
    (1..=looks).any(|samples| {
        hits += u64::from(rng.random::<f64>() < truth);
        refutes(hits, samples)
    })
}

/// Number of samples after each of which one looks.
const LOOKS: u64 = 2_000;

#[test]
fn peeking_at_the_sequence_is_harmless_and_at_the_interval_is_not() {
    let mut rng = rng("peeking");
    for truth in [0.02, 0.3] {
        let below = |k, n| sequence::is_certain(sequence::evidence_below(k, n, truth), 0.95);
        let above = |k, n| sequence::is_certain(sequence::evidence_above(k, n, truth), 0.95);
        let wrong = |refutes: &dyn Fn(u64, u64) -> bool, rng: &mut Stream| {
            (0..CAMPAIGNS).filter(|_| is_ever_refuted(truth, LOOKS, rng, refutes)).count()
        };
        let (below, above) = (wrong(&below, &mut rng), wrong(&above, &mut rng));
        assert!(below <= 50 && above <= 50, "{below} and {above} of {CAMPAIGNS} at {truth}");
        // The same looks at the bound for a fixed n: the test can tell one that does not hold.
        let naive = wrong(&|k, n| binomial::at_most(k, n, truth) <= 0.05, &mut rng);
        assert!(naive > 100, "{naive}");
    }
}
