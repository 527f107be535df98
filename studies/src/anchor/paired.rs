//! Counts of an outcome in two arms that run the same samples, and the ratio of the counts.
//!
//! The logarithm of the ratio n₁/n₀ of two paired counts has the variance (b + c)/(n₀·n₁), where b
//! samples have the outcome only without the system, and c only with it. It follows from the delta
//! method for a multinomial distribution, and is 0 if both arms agree in every sample. If the
//! outcome never happens with the system, the ratio is 0, and its upper bound is the bound of the
//! share of the n₀ samples that keep the outcome (Clopper-Pearson).

use closecall_scenarios::outcome::Outcome;
use closecall_traffic::maths;
use closecall_traffic::statistics::interval::clopper_pearson;
use closecall_traffic::statistics::sensitivity::jackknife::Estimate;

/// Number of collisions without the system from which on a ratio is part of a range: the
/// protocol's.
pub const LEAST_COLLISIONS: u64 = 10;

/// The quantile of the standard normal distribution with 97.5 % below it.
const Z_975: f64 = 1.959_963_984_540_054;

/// What happened to the ego in one run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Happened {
    /// It struck another vehicle, before another one struck it. An ego that is struck first is
    /// pushed.
    pub strikes: bool,
    /// Another vehicle struck it.
    pub is_struck: bool,
}

impl Happened {
    /// Returns what happened in a run. Touches are no collisions.
    pub fn of(outcome: &Outcome) -> Self {
        let struck_at = outcome.ego_struck().map(|collision| collision.time).min();
        let is_own = |struck_at| outcome.ego_strikes().any(|collision| collision.time <= struck_at);
        Self {
            strikes: struck_at.map_or_else(|| outcome.ego_strikes().next().is_some(), is_own),
            is_struck: struck_at.is_some(),
        }
    }
}

/// The counts of one outcome in both arms.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Paired {
    /// Samples in which it happens in both arms.
    pub both: u64,
    /// Samples in which it happens only without the system.
    pub only_without: u64,
    /// Samples in which it happens only with the system.
    pub only_with: u64,
}

impl Paired {
    /// Counts a sample in which the outcome happens without the system and with it, or does not.
    pub fn add(&mut self, without: bool, with: bool) {
        match (without, with) {
            (true, true) => self.both += 1,
            (true, false) => self.only_without += 1,
            (false, true) => self.only_with += 1,
            (false, false) => {}
        }
    }

    /// Returns the count without the system.
    pub const fn without(&self) -> u64 {
        self.both + self.only_without
    }

    /// Returns the count with the system.
    pub const fn with(&self) -> u64 {
        self.both + self.only_with
    }

    /// Returns the ratio of the count with the system to the count without it; `None` if the
    /// outcome does not happen without it.
    pub fn ratio(&self) -> Option<Estimate> {
        if self.without() == 0 {
            return None;
        }
        if self.with() == 0 {
            return Some(Estimate { value: 0.0, interval_95: clopper_pearson(0, self.without(), 0.95) });
        }
        let [without, with] = [self.without(), self.with()].map(|count| count as f64);
        let value = with / without;
        let half = Z_975 * ((self.only_without + self.only_with) as f64 / (without * with)).sqrt();
        Some(Estimate { value, interval_95: [value * maths::exp(-half), value * maths::exp(half)] })
    }

    /// Returns true if there are enough collisions without the system for a range.
    pub const fn is_enough(&self) -> bool {
        self.without() >= LEAST_COLLISIONS
    }

    /// Returns the logarithm of the ratio, with half a collision added to each count, so that it is
    /// finite.
    pub fn log_ratio(&self) -> f64 {
        maths::ln((self.with() as f64 + 0.5) / (self.without() as f64 + 0.5))
    }
}

#[cfg(test)]
mod tests {
    use closecall_traffic::Stream;
    use rand::{RngExt, SeedableRng};

    use super::*;

    #[test]
    fn the_ratio_of_a_worked_table() {
        let paired = Paired { both: 40, only_without: 60, only_with: 10 };
        let Estimate { value, interval_95: [low, high] } = paired.ratio().unwrap();
        // √(70/(100·50)) = 0.11832: 0.5·exp(∓0.2319).
        assert!(
            (value - 0.5).abs() < 1e-12 && (low - 0.3965).abs() < 1e-4 && (high - 0.6305).abs() < 1e-4,
            "{low} {high}"
        );
        assert!(paired.is_enough());
    }

    #[test]
    fn arms_that_agree_in_every_sample_have_the_ratio_1() {
        let paired = Paired { both: 3, only_without: 0, only_with: 0 };
        assert_eq!(paired.ratio().unwrap(), Estimate { value: 1.0, interval_95: [1.0, 1.0] });
        assert!(!paired.is_enough());
    }

    #[test]
    fn an_outcome_that_never_happens_with_the_system_has_the_ratio_0_and_an_upper_bound() {
        let Estimate { value, interval_95: [low, high] } =
            Paired { only_without: 15, ..Paired::default() }.ratio().unwrap();
        // 1 − 0.025^(1/15).
        assert!(value == 0.0 && low == 0.0 && (high - 0.2180).abs() < 1e-4, "{high}");
    }

    #[test]
    fn an_outcome_that_does_not_happen_without_the_system_has_no_ratio() {
        for paired in [Paired::default(), Paired { only_with: 1, ..Paired::default() }] {
            assert_eq!(paired.ratio(), None);
        }
    }

    /// The interval of paired samples covers the true ratio in about 95 % of the repetitions.
    #[test]
    fn the_interval_covers_the_true_ratio() {
        let mut rng = Stream::seed_from_u64(3);
        // Without: 10 %. With: half of those, and 1 % of the others: 5.9 %.
        let truth = (0.5 * 0.1 + 0.01 * 0.9) / 0.1;
        let covered = (0..1_000).filter(|_| {
            let mut paired = Paired::default();
            for _ in 0..2_000 {
                let without = rng.random_bool(0.1);
                paired.add(without, rng.random_bool(if without { 0.5 } else { 0.01 }));
            }
            paired.ratio().unwrap().covers(truth)
        });
        let covered = covered.count();
        assert!((930..=970).contains(&covered), "{covered}");
    }
}
