//! The intervals of a rate, of a difference of shares, and of their product.

use closecall_traffic::maths;
use statrs::distribution::{ContinuousCDF, Gamma};

/// Two-sided 95 % quantile of the standard normal distribution.
const Z: f64 = 1.959_963_984_540_054;
/// Probabilities of the bounds.
const TAILS: [f64; 2] = [0.025, 0.975];

/// Returns the Jeffreys interval of a rate at 95 %, from `events` in `distance`: in events per unit
/// of the distance.
pub fn rate_interval(events: u64, distance: f64) -> [f64; 2] {
    let Ok(gamma) = Gamma::new(events as f64 + 0.5, 1.0) else { return [0.0, f64::INFINITY] };
    let [low, high] = TAILS.map(|tail| gamma.inverse_cdf(tail) / distance);
    // Without an event the lower bound is 0: no small rate is excluded.
    [if events == 0 { 0.0 } else { low }, high]
}

/// Returns the Wilson score interval of a share at 95 %, from `hits` of `samples`.
fn wilson(hits: u64, samples: u64) -> [f64; 2] {
    let (n, share) = (samples as f64, hits as f64 / samples as f64);
    let centre = (share + Z * Z / (2.0 * n)) / (1.0 + Z * Z / n);
    let half = Z / (1.0 + Z * Z / n) * (share * (1.0 - share) / n + Z * Z / (4.0 * n * n)).sqrt();
    [(centre - half).max(0.0), (centre + half).min(1.0)]
}

/// Returns the difference of two exclusive shares of the same samples, and its interval at 95 %.
pub fn share_difference(first: u64, second: u64, samples: u64) -> (f64, [f64; 2]) {
    let [p, q] = [first, second].map(|hits| hits as f64 / samples as f64);
    let ([p_low, p_high], [q_low, q_high]) = (wilson(first, samples), wilson(second, samples));
    let scale = ((1.0 - p) * (1.0 - q)).sqrt();
    let correlation = if scale > 0.0 { -(p * q).sqrt() / scale } else { 0.0 };
    let combined = |first: f64, second: f64| {
        (first * first + second * second - 2.0 * correlation * first * second).max(0.0).sqrt()
    };
    (p - q, [p - q - combined(p - p_low, q_high - q), p - q + combined(p_high - p, q - q_low)])
}

/// Returns the product of a positive and any independent quantity, and its interval, from their
/// values with intervals.
pub fn product((rate, rate_95): (f64, [f64; 2]), (effect, effect_95): (f64, [f64; 2])) -> (f64, [f64; 2]) {
    let bound =
        |rate_bound: f64, effect_bound: f64| maths::hypot(effect * (rate - rate_bound), rate * (effect - effect_bound));
    let value = rate * effect;
    // A smaller rate brings the product nearer to zero.
    let [toward_low, toward_high] = if effect >= 0.0 { rate_95 } else { [rate_95[1], rate_95[0]] };
    (value, [value - bound(toward_low, effect_95[0]), value + bound(toward_high, effect_95[1])])
}

/// Returns the smallest and the largest product of a positive quantity in a stated range and any
/// quantity in an interval.
pub fn extremes([low, high]: [f64; 2], [effect_low, effect_high]: [f64; 2]) -> [f64; 2] {
    [if effect_low >= 0.0 { low } else { high } * effect_low, if effect_high >= 0.0 { high } else { low } * effect_high]
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{ActorId, Stream, stream};
    use rand::RngExt;

    use super::*;

    /// Counts the arrivals of a Poisson process with a mean of `mean` in the unit of time.
    fn poisson(mean: f64, rng: &mut Stream) -> u64 {
        let (mut time, mut count) = (0.0, 0);
        loop {
            time -= maths::ln(1.0 - rng.random::<f64>()) / mean;
            if time > 1.0 {
                return count;
            }
            count += 1;
        }
    }

    /// Returns in how many of `worlds` synthetic worlds the interval of the net effect covers the
    /// truth. In each, `mean` events are expected in the recorded distance, and a campaign of
    /// `samples` prevents with probability `p` and induces with `q`.
    fn covered(worlds: u64, mean: f64, [p, q]: [f64; 2], samples: u64) -> usize {
        let truth = mean * (p - q);
        (0..worlds)
            .filter(|&world| {
                let mut rng = stream(5, world, &ActorId::new("world").unwrap(), "exposure");
                let events = poisson(mean, &mut rng);
                let (mut prevented, mut induced) = (0, 0);
                for _ in 0..samples {
                    let u: f64 = rng.random();
                    prevented += u64::from(u < p);
                    induced += u64::from((p..p + q).contains(&u));
                }
                let rate = (events as f64, rate_interval(events, 1.0));
                let (_, [low, high]) = product(rate, share_difference(prevented, induced, samples));
                low <= truth && truth <= high
            })
            .count()
    }

    #[test]
    fn the_interval_covers_the_truth_in_93_to_97_percent_of_200_worlds() {
        for (mean, shares, samples) in
            [(40.0, [0.15, 0.01], 500), (120.0, [0.2, 0.005], 1_000), (15.0, [0.2, 0.01], 300)]
        {
            let covered = covered(200, mean, shares, samples);
            assert!((186..=194).contains(&covered), "{covered} of 200 with {mean} events and {shares:?}");
        }
    }

    #[test]
    fn the_interval_of_many_worlds_covers_95_percent() {
        // 1,900 expected, with a standard deviation of 9.7.
        for (mean, shares) in [(30.0, [0.2, 0.01]), (100.0, [0.1, 0.02]), (60.0, [0.02, 0.06])] {
            let covered = covered(2_000, mean, shares, 400);
            assert!((1_860..=1_940).contains(&covered), "{covered} of 2,000 with {mean} events and {shares:?}");
        }
    }

    #[test]
    fn a_stated_range_gives_the_extremes_of_the_products() {
        let stated = [100.0, 10_000.0];
        let [low, high] = extremes(stated, [0.0717, 0.2803]);
        assert!((low - 7.17).abs() < 1e-9 && (high - 2_803.0).abs() < 1e-9, "{low} {high}");
        assert_eq!(extremes(stated, [-0.5, 0.25]), [-5_000.0, 2_500.0]);
        assert_eq!(extremes(stated, [-0.5, -0.25]), [-5_000.0, -25.0]);
    }

    #[test]
    fn intervals_agree_with_published_ones() {
        // Half the quantiles of chi-squared with 21 degrees of freedom, which tables give as 10.283
        // and 35.479.
        let [low, high] = rate_interval(10, 1.0);
        assert!((low - 10.283 / 2.0).abs() < 1e-3 && (high - 35.479 / 2.0).abs() < 1e-3, "{low} {high}");
        assert_eq!(rate_interval(0, 1.0)[0], 0.0);
        // Wilson interval of 81 of 263 (Newcombe, Statistics in Medicine 17 (1998) 857–872): 0.2553
        // to 0.3662.
        let [low, high] = wilson(81, 263);
        assert!((low - 0.2553).abs() < 1e-4 && (high - 0.3662).abs() < 1e-4, "{low} {high}");
    }
}
