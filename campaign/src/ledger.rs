//! Counts over the samples of a campaign, with how sure they are.

use serde::{Deserialize, Serialize};

use closecall_simulation::outcome::worse;
use closecall_statistics::{interval, mcnemar, sequence};

/// Share of repetitions in which a reported interval covers the true probability, at least.
const COVERAGE: f64 = 0.95;

/// What the number of samples came from: which bounds of a probability hold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Inference {
    /// It was fixed in advance: exact intervals (Clopper–Pearson).
    #[default]
    FixedSamples,
    /// It came from the outcomes or the clock: a confidence sequence, valid however one stops.
    Sequential,
}

impl Inference {
    /// The one-sided upper bound of a probability.
    pub fn upper_bound(self, hits: u64, samples: u64, confidence: f64) -> f64 {
        match self {
            Self::FixedSamples => interval::upper_bound(hits, samples, confidence),
            Self::Sequential => sequence::upper_bound(hits, samples, confidence),
        }
    }

    /// The one-sided lower bound of a probability.
    pub fn lower_bound(self, hits: u64, samples: u64, confidence: f64) -> f64 {
        match self {
            Self::FixedSamples => interval::lower_bound(hits, samples, confidence),
            Self::Sequential => sequence::lower_bound(hits, samples, confidence),
        }
    }

    /// The two-sided interval at 95 %.
    pub fn interval_95(self, hits: u64, samples: u64) -> [f64; 2] {
        match self {
            Self::FixedSamples => interval::clopper_pearson(hits, samples, COVERAGE),
            Self::Sequential => sequence::interval(hits, samples, COVERAGE),
        }
    }

    /// The name of the method, for reports.
    pub const fn method(self) -> &'static str {
        match self {
            Self::FixedSamples => "clopper-pearson",
            Self::Sequential => "confidence-sequence",
        }
    }
}

/// The counts of one arm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ArmCounts {
    /// Samples with an outcome.
    pub outcomes: u64,
    /// Samples in which E collided, as judged: where the validity checks flipped a verdict, the one that speaks worse
    /// for the system under test.
    pub collisions: u64,
    /// Samples that ended in an error.
    pub errors: u64,
    /// Samples in which the margin increase system engaged.
    pub engagements: u64,
    /// Engagements whose goal was in reach.
    pub goals_in_reach: u64,
    /// Most by which E was slower than the vehicle ahead in any sample [m/s].
    pub max_speed_deficit_mps: f64,
    /// Largest jerk of E in any sample, before any collision of its own [m/s³].
    pub max_jerk_mps3: f64,
    /// Largest change of velocity of E in any sample [m/s].
    pub max_delta_v_mps: f64,
    /// Harm of all samples: see [`super::harm`].
    pub harm: f64,
}

/// What came of one sample in one arm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    /// Whether E collided, as judged; nothing where the sample ended in an error.
    pub collided: Option<bool>,
    /// Whether the margin increase system engaged.
    pub engaged: bool,
    /// Whether its goal was in reach when it did.
    pub goal_in_reach: bool,
    /// Most by which E was slower than the vehicle ahead [m/s].
    pub speed_deficit_mps: f64,
    /// Largest jerk of E [m/s³].
    pub jerk_mps3: f64,
    /// Largest change of velocity of E [m/s].
    pub delta_v_mps: f64,
    /// Harm of the collisions, E's and others'.
    pub harm: f64,
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
        self.max_speed_deficit_mps = worse(self.max_speed_deficit_mps, tally.speed_deficit_mps);
        self.max_jerk_mps3 = worse(self.max_jerk_mps3, tally.jerk_mps3);
        self.max_delta_v_mps = worse(self.max_delta_v_mps, tally.delta_v_mps);
        self.harm += tally.harm;
    }

    /// Adds the counts of another campaign.
    pub fn add(&mut self, other: &Self) {
        self.outcomes += other.outcomes;
        self.collisions += other.collisions;
        self.errors += other.errors;
        self.engagements += other.engagements;
        self.goals_in_reach += other.goals_in_reach;
        self.max_speed_deficit_mps = worse(self.max_speed_deficit_mps, other.max_speed_deficit_mps);
        self.max_jerk_mps3 = worse(self.max_jerk_mps3, other.max_jerk_mps3);
        self.max_delta_v_mps = worse(self.max_delta_v_mps, other.max_delta_v_mps);
        self.harm += other.harm;
    }

    /// Share of the samples with an outcome in which E collided; nothing of no samples.
    pub fn collision_rate(&self) -> Option<f64> {
        self.share(self.collisions)
    }

    /// Share of the samples with an outcome in which the system engaged; nothing of no samples.
    pub fn engagement_rate(&self) -> Option<f64> {
        self.share(self.engagements)
    }

    fn share(&self, count: u64) -> Option<f64> {
        (self.outcomes > 0).then(|| count as f64 / self.outcomes as f64)
    }

    /// The interval of the probability of a collision, given the sampled scenario.
    pub fn interval_95(&self, inference: Inference) -> [f64; 2] {
        inference.interval_95(self.collisions, self.outcomes)
    }
}

/// Pairs of the same sample without and with the system under test.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pairs {
    /// Collision without it, none with it.
    pub prevented: u64,
    /// None without it, collision with it.
    pub induced: u64,
    /// Collision either way.
    pub both: u64,
    /// No collision either way.
    pub neither: u64,
    /// Harm that was less with it, over the samples in which it was less.
    pub prevented_harm: f64,
    /// Harm that was more with it, over the samples in which it was more.
    pub induced_harm: f64,
}

impl Pairs {
    /// Takes in one pair that has both outcomes.
    pub fn take(&mut self, baseline: &Tally, tested: &Tally) {
        match (baseline.collided, tested.collided) {
            (Some(true), Some(false)) => self.prevented += 1,
            (Some(false), Some(true)) => self.induced += 1,
            (Some(true), Some(true)) => self.both += 1,
            (Some(false), Some(false)) => self.neither += 1,
            (None, _) | (_, None) => return,
        }
        let more = tested.harm - baseline.harm;
        if more > 0.0 {
            self.induced_harm += more;
        } else {
            self.prevented_harm -= more;
        }
    }

    /// Adds the pairs of another campaign.
    pub fn add(&mut self, other: &Self) {
        self.prevented += other.prevented;
        self.induced += other.induced;
        self.both += other.both;
        self.neither += other.neither;
        self.prevented_harm += other.prevented_harm;
        self.induced_harm += other.induced_harm;
    }

    /// How rare a split at least as uneven would be if the arms were alike (exact McNemar test, two-sided). It holds for
    /// a number of samples that was fixed in advance alone.
    pub fn mcnemar_p(&self, inference: Inference) -> Option<f64> {
        (inference == Inference::FixedSamples).then(|| mcnemar::two_sided_p(self.prevented, self.induced))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_is_never_a_pass() {
        let mut counts = ArmCounts::default();
        counts.take(Tally { collided: None, ..Tally::default() });
        assert_eq!((counts.outcomes, counts.errors), (0, 1));
        assert_eq!(counts.collision_rate(), None);
    }

    #[test]
    fn what_is_not_a_number_stays_the_worst() {
        let mut counts = ArmCounts::default();
        for jerk_mps3 in [3.0, f64::NAN, 5.0] {
            counts.take(Tally { collided: Some(false), jerk_mps3, ..Tally::default() });
        }
        assert!(counts.max_jerk_mps3.is_nan());
    }

    #[test]
    fn pairs_weigh_harm_apart_from_counts() {
        let tally = |collided, harm| Tally { collided: Some(collided), harm, ..Tally::default() };
        let mut pairs = Pairs::default();
        pairs.take(&tally(true, 0.5), &tally(false, 0.0));
        pairs.take(&tally(true, 0.25), &tally(true, 1.0));
        pairs.take(&tally(false, 0.0), &Tally::default());
        assert_eq!((pairs.prevented, pairs.induced, pairs.both, pairs.neither), (1, 0, 1, 0));
        assert_eq!((pairs.prevented_harm, pairs.induced_harm), (0.5, 0.75));
        assert_eq!(pairs.mcnemar_p(Inference::FixedSamples), Some(1.0));
        assert_eq!(pairs.mcnemar_p(Inference::Sequential), None);
    }
}
