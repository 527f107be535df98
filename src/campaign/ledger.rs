//! Counts over the samples of a campaign, with how sure they are.

use serde::Serialize;
use statrs::distribution::{Beta, ContinuousCDF};

/// Share of repetitions in which the interval covers the true probability, at least.
const COVERAGE: f64 = 0.95;

/// An exact (Clopper–Pearson) interval of a probability at 95 %: C. J. Clopper and E. S. Pearson, *Biometrika* 26
/// (1934). It covers the truth in at least 95 % of campaigns, whatever the truth is. Nothing is known of no samples.
pub fn clopper_pearson(hits: u64, samples: u64) -> [f64; 2] {
    let tail = 0.5 * (1.0 - COVERAGE);
    let (k, n) = (hits as f64, samples as f64);
    let quantile = |a: f64, b: f64, p: f64| Beta::new(a, b).map_or(f64::NAN, |beta| beta.inverse_cdf(p));
    let low = if hits == 0 { 0.0 } else { quantile(k, n - k + 1.0, tail) };
    let high = if hits >= samples { 1.0 } else { quantile(k + 1.0, n - k, 1.0 - tail) };
    [low, high]
}

/// The counts of one arm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ArmCounts {
    /// Samples with an outcome.
    pub outcomes: u64,
    /// Samples in which E collided.
    pub collisions: u64,
    /// Samples that ended in an error.
    pub errors: u64,
    /// Samples in which the margin increase system engaged.
    pub engagements: u64,
    /// Engagements whose goal was in reach.
    pub goals_in_reach: u64,
    /// Most by which E was slower than the vehicle ahead in any sample [m/s].
    pub max_speed_deficit_mps: f64,
}

/// What came of one sample in one arm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tally {
    /// Whether E collided; nothing where the sample ended in an error.
    pub collided: Option<bool>,
    /// Whether the margin increase system engaged.
    pub engaged: bool,
    /// Whether its goal was in reach when it did.
    pub goal_in_reach: bool,
    /// Most by which E was slower than the vehicle ahead [m/s].
    pub speed_deficit_mps: f64,
}

impl ArmCounts {
    /// Takes in one sample.
    pub fn take(&mut self, tally: Tally) {
        match tally.collided {
            Some(collided) => {
                self.outcomes += 1;
                self.collisions += u64::from(collided);
            }
            None => self.errors += 1,
        }
        self.engagements += u64::from(tally.engaged);
        self.goals_in_reach += u64::from(tally.engaged && tally.goal_in_reach);
        self.max_speed_deficit_mps = self.max_speed_deficit_mps.max(tally.speed_deficit_mps);
    }

    /// Adds the counts of another campaign.
    pub fn add(&mut self, other: &Self) {
        self.outcomes += other.outcomes;
        self.collisions += other.collisions;
        self.errors += other.errors;
        self.engagements += other.engagements;
        self.goals_in_reach += other.goals_in_reach;
        self.max_speed_deficit_mps = self.max_speed_deficit_mps.max(other.max_speed_deficit_mps);
    }

    /// Share of the samples with an outcome in which E collided; nothing of no samples.
    pub fn collision_rate(&self) -> Option<f64> {
        (self.outcomes > 0).then(|| self.collisions as f64 / self.outcomes as f64)
    }

    /// The exact interval of the probability of a collision, given the sampled scenario.
    pub fn interval_95(&self) -> [f64; 2] {
        clopper_pearson(self.collisions, self.outcomes)
    }
}

/// Pairs of the same sample without and with the system under test.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Pairs {
    /// Collision without it, none with it.
    pub prevented: u64,
    /// None without it, collision with it.
    pub induced: u64,
    /// Collision either way.
    pub both: u64,
    /// No collision either way.
    pub neither: u64,
}

impl Pairs {
    /// Takes in one pair that has both outcomes.
    pub fn take(&mut self, baseline_collided: bool, collided: bool) {
        match (baseline_collided, collided) {
            (true, false) => self.prevented += 1,
            (false, true) => self.induced += 1,
            (true, true) => self.both += 1,
            (false, false) => self.neither += 1,
        }
    }

    /// Adds the pairs of another campaign.
    pub fn add(&mut self, other: &Self) {
        self.prevented += other.prevented;
        self.induced += other.induced;
        self.both += other.both;
        self.neither += other.neither;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_are_those_of_the_textbook() {
        // 0 of n: the upper bound is 1 − (α/2)^(1/n).
        let [low, high] = clopper_pearson(0, 200);
        assert_eq!(low, 0.0);
        assert!((high - (1.0 - 0.025_f64.powf(1.0 / 200.0))).abs() < 1e-9);
        // 10 of 100: 4.90 % to 17.62 % (tabulated).
        let [low, high] = clopper_pearson(10, 100);
        assert!((low - 0.049_005).abs() < 1e-5 && (high - 0.176_223).abs() < 1e-5, "{low} {high}");
        assert_eq!(clopper_pearson(7, 7)[1], 1.0);
        assert_eq!(clopper_pearson(0, 0), [0.0, 1.0]);
    }

    #[test]
    fn an_error_is_never_a_pass() {
        let mut counts = ArmCounts::default();
        counts.take(Tally { collided: None, engaged: false, goal_in_reach: false, speed_deficit_mps: 0.0 });
        assert_eq!((counts.outcomes, counts.errors), (0, 1));
        assert_eq!(counts.collision_rate(), None);
    }
}
