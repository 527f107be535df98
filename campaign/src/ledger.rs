//! Counts over the samples of a campaign, with their confidence intervals.

use serde::{Deserialize, Serialize};

use closecall_scenarios::outcome::worse;
use closecall_traffic::statistics::{interval, mcnemar, sequence};

/// Share of repetitions in which a reported interval covers the true probability, at least.
const COVERAGE: f64 = 0.95;

/// The rule that determines the number of samples. It decides which bounds of a probability are
/// valid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Inference {
    /// The number is fixed in advance: exact intervals (Clopper–Pearson).
    #[default]
    FixedSamples,
    /// The number follows from the outcomes or the clock: a confidence sequence, valid for every
    /// stopping rule.
    Sequential,
    /// The samples are points of a design, Sobol or grid: they are not independent, and no bound of
    /// a probability is valid.
    Design,
}

/// Independent samples, which every binomial bound needs. Only this type leads to a bound, and only
/// [`Inference::independent`] makes it. The points of a design and the weighted runs of a rare
/// event are not independent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Independent {
    /// True if the number of samples depends on the outcomes or the clock.
    is_sequential: bool,
}

impl Independent {
    /// Returns the one-sided upper bound of a probability.
    pub fn upper_bound(self, hits: u64, samples: u64, confidence: f64) -> f64 {
        match self.is_sequential {
            false => interval::upper_bound(hits, samples, confidence),
            true => sequence::upper_bound(hits, samples, confidence),
        }
    }

    /// Returns the one-sided lower bound of a probability.
    pub fn lower_bound(self, hits: u64, samples: u64, confidence: f64) -> f64 {
        match self.is_sequential {
            false => interval::lower_bound(hits, samples, confidence),
            true => sequence::lower_bound(hits, samples, confidence),
        }
    }

    /// Returns the two-sided interval that covers the probability in a share `coverage` of
    /// repetitions.
    pub fn interval(self, hits: u64, samples: u64, coverage: f64) -> [f64; 2] {
        match self.is_sequential {
            false => interval::clopper_pearson(hits, samples, coverage),
            true => sequence::interval(hits, samples, coverage),
        }
    }
}

impl Inference {
    /// Returns the samples as independent ones; `None` if they are points of a design.
    pub const fn independent(self) -> Option<Independent> {
        match self {
            Self::FixedSamples => Some(Independent { is_sequential: false }),
            Self::Sequential => Some(Independent { is_sequential: true }),
            Self::Design => None,
        }
    }

    /// Returns the one-sided upper bound of a probability; `None` if no bound is valid.
    pub fn upper_bound(self, hits: u64, samples: u64, confidence: f64) -> Option<f64> {
        Some(self.independent()?.upper_bound(hits, samples, confidence))
    }

    /// Returns the one-sided lower bound of a probability; `None` if no bound is valid.
    pub fn lower_bound(self, hits: u64, samples: u64, confidence: f64) -> Option<f64> {
        Some(self.independent()?.lower_bound(hits, samples, confidence))
    }

    /// Returns the two-sided interval that covers the probability in a share `coverage` of
    /// repetitions; `None` if no bound is valid.
    pub fn interval(self, hits: u64, samples: u64, coverage: f64) -> Option<[f64; 2]> {
        Some(self.independent()?.interval(hits, samples, coverage))
    }

    /// Returns the two-sided interval at 95 %; `None` if no bound is valid.
    pub fn interval_95(self, hits: u64, samples: u64) -> Option<[f64; 2]> {
        self.interval(hits, samples, COVERAGE)
    }

    /// Returns the name of the method, for reports.
    pub const fn method(self) -> &'static str {
        match self {
            Self::FixedSamples => "clopper-pearson",
            Self::Sequential => "confidence-sequence",
            Self::Design => "none",
        }
    }
}

/// What driving with a system costs: in one sample, summed over samples, or in the mean.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cost {
    /// Time lost (s).
    pub time_lost_s: f64,
    /// Largest speed deficit of the ego to the lead vehicle (m/s).
    pub speed_deficit_mps: f64,
    /// Hardest braking of the vehicle behind (m/s²).
    pub imposed_braking_mps2: f64,
}

impl Cost {
    fn add(&mut self, other: Self) {
        self.time_lost_s += other.time_lost_s;
        self.speed_deficit_mps += other.speed_deficit_mps;
        self.imposed_braking_mps2 += other.imposed_braking_mps2;
    }

    /// Returns the mean of a sum over `samples` samples.
    fn mean(self, samples: u64) -> Self {
        let samples = samples as f64;
        Self {
            time_lost_s: self.time_lost_s / samples,
            speed_deficit_mps: self.speed_deficit_mps / samples,
            imposed_braking_mps2: self.imposed_braking_mps2 / samples,
        }
    }
}

/// The counts of one arm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ArmCounts {
    /// Samples with an outcome.
    pub outcomes: u64,
    /// Samples in which the ego collides, as judged: if the validity checks flip a verdict, the
    /// verdict that is worse for the system under test counts.
    pub collisions: u64,
    /// Samples in which two bumpers meet too slowly for a collision. No such contact is among the
    /// collisions.
    pub touches: u64,
    /// Samples in which the vehicle behind brakes harder than 3 m/s² before the lead vehicle
    /// brakes.
    pub imposed: u64,
    /// Samples that ended in an error.
    pub errors: u64,
    /// Samples with an outcome only because they were run again after a failure (`--retry-crashed`,
    /// `--retry-errors`).
    pub flaky: u64,
    /// Runs for whose validity checks there is a result.
    pub checked: u64,
    /// Runs that were chosen for the validity checks and have a check without a result.
    pub not_checked: u64,
    /// Samples in which the margin increase system engages.
    pub engagements: u64,
    /// Engagements whose goal is in reach.
    pub goals_in_reach: u64,
    /// Samples in which the margin increase system is not available for some time, because sensors
    /// have failed.
    pub unavailable: u64,
    /// Largest speed deficit of the ego to the lead vehicle in any sample (m/s).
    pub max_speed_deficit_mps: f64,
    /// Largest jerk of the ego in any sample, before any collision of its own (m/s³).
    pub max_jerk_mps3: f64,
    /// Largest change of the ego's velocity in any sample (m/s).
    pub max_delta_v_mps: f64,
    /// Sum of the harm of all samples: see [`super::harm`].
    pub harm: f64,
    /// Samples whose cost is known.
    pub costed: u64,
    /// Sum of the costs of these samples.
    pub cost: Cost,
}

/// The result of one sample in one arm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    /// Whether the ego collides, as judged; `None` if the sample ended in an error.
    pub collided: Option<bool>,
    /// Whether it has an outcome only because it was run again after a failure.
    pub flaky: bool,
    /// Whether two vehicles other than the ego collide with each other.
    pub others_collided: bool,
    /// Whether two bumpers meet too slowly for a collision.
    pub touched: bool,
    /// Whether the vehicle behind brakes harder than 3 m/s² before the lead vehicle brakes.
    pub imposed: bool,
    /// Whether the margin increase system engages.
    pub engaged: bool,
    /// Whether the system's goal is in reach when the system engages.
    pub goal_in_reach: bool,
    /// Whether the margin increase system is not available for some time.
    pub unavailable: bool,
    /// Largest speed deficit of the ego to the lead vehicle (m/s).
    pub speed_deficit_mps: f64,
    /// Largest jerk of the ego (m/s³).
    pub jerk_mps3: f64,
    /// Largest change of the ego's velocity (m/s).
    pub delta_v_mps: f64,
    /// Harm of all collisions, of the ego and of others.
    pub harm: f64,
    /// The cost; `None` in a journal without it.
    pub cost: Option<Cost>,
}

impl ArmCounts {
    /// Adds one sample.
    pub fn push(&mut self, tally: Tally) {
        match tally.collided {
            Some(collided) => {
                self.outcomes += 1;
                self.collisions += u64::from(collided);
            }
            None => self.errors += 1,
        }
        self.touches += u64::from(tally.touched);
        self.imposed += u64::from(tally.imposed);
        self.flaky += u64::from(tally.flaky);
        self.engagements += u64::from(tally.engaged);
        self.goals_in_reach += u64::from(tally.engaged && tally.goal_in_reach);
        self.unavailable += u64::from(tally.unavailable);
        self.max_speed_deficit_mps = worse(self.max_speed_deficit_mps, tally.speed_deficit_mps);
        self.max_jerk_mps3 = worse(self.max_jerk_mps3, tally.jerk_mps3);
        self.max_delta_v_mps = worse(self.max_delta_v_mps, tally.delta_v_mps);
        self.harm += tally.harm;
        if let Some(cost) = tally.cost {
            self.costed += 1;
            self.cost.add(cost);
        }
    }

    /// Adds the counts of other samples.
    pub fn add(&mut self, other: &Self) {
        self.outcomes += other.outcomes;
        self.collisions += other.collisions;
        self.touches += other.touches;
        self.imposed += other.imposed;
        self.errors += other.errors;
        self.flaky += other.flaky;
        self.checked += other.checked;
        self.not_checked += other.not_checked;
        self.engagements += other.engagements;
        self.goals_in_reach += other.goals_in_reach;
        self.unavailable += other.unavailable;
        self.max_speed_deficit_mps = worse(self.max_speed_deficit_mps, other.max_speed_deficit_mps);
        self.max_jerk_mps3 = worse(self.max_jerk_mps3, other.max_jerk_mps3);
        self.max_delta_v_mps = worse(self.max_delta_v_mps, other.max_delta_v_mps);
        self.harm += other.harm;
        self.costed += other.costed;
        self.cost.add(other.cost);
    }

    /// Returns the mean cost; `None` of no samples.
    pub fn mean_cost(&self) -> Option<Cost> {
        (self.costed > 0).then(|| self.cost.mean(self.costed))
    }

    /// Returns the share of the samples with a known cost in which the vehicle behind brakes harder
    /// than 3 m/s² before the lead vehicle brakes; `None` of no samples.
    pub fn imposed_share(&self) -> Option<f64> {
        (self.costed > 0).then(|| self.imposed as f64 / self.costed as f64)
    }

    /// Returns the share of the samples with an outcome in which the ego collides; `None` of no
    /// samples.
    pub fn collision_rate(&self) -> Option<f64> {
        self.share(self.collisions)
    }

    /// Returns the share of the samples with an outcome in which the system engages; `None` of no
    /// samples.
    pub fn engagement_rate(&self) -> Option<f64> {
        self.share(self.engagements)
    }

    fn share(&self, count: u64) -> Option<f64> {
        (self.outcomes > 0).then(|| count as f64 / self.outcomes as f64)
    }

    /// Returns the 95 % interval of the probability of a collision, given the sampled scenario;
    /// `None` if no bound is valid.
    pub fn interval_95(&self, inference: Inference) -> Option<[f64; 2]> {
        inference.interval_95(self.collisions, self.outcomes)
    }
}

/// The change by the system under test in one sample.
///
/// A collision between other vehicles (the rear vehicle runs into the lead vehicle, say) counts
/// against the system: such a sample is not prevented, and it is induced if nothing collides
/// without the system.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PairFate {
    /// The ego collides without the system, and no vehicle collides with it.
    Prevented,
    /// With the system the ego collides, or other vehicles do; without it the ego does not, or no
    /// vehicle does.
    Induced,
    /// The ego collides without the system, and the ego or other vehicles collide with it.
    Both,
    /// The ego collides in neither arm, and the system adds no collision of others.
    Neither,
}

impl PairFate {
    /// Returns the fate of a sample; `None` if an arm has no outcome.
    pub fn of(baseline: &Tally, tested: &Tally) -> Option<Self> {
        Some(match (baseline.collided?, tested.collided?) {
            (true, true) => Self::Both,
            (true, false) if tested.others_collided => Self::Both,
            (true, false) => Self::Prevented,
            (false, true) => Self::Induced,
            (false, false) if tested.others_collided && !baseline.others_collided => Self::Induced,
            (false, false) => Self::Neither,
        })
    }
}

/// Pairs of the same sample without and with the system under test.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pairs {
    /// Samples of [`PairFate::Prevented`].
    pub prevented: u64,
    /// Samples of [`PairFate::Induced`].
    pub induced: u64,
    /// Samples of [`PairFate::Both`].
    pub both: u64,
    /// Samples of [`PairFate::Neither`].
    pub neither: u64,
    /// Samples of `induced` in which only vehicles other than the ego collide with the system.
    pub induced_of_others: u64,
    /// Samples of `both` in which only vehicles other than the ego collide with the system.
    pub both_of_others: u64,
    /// Samples in which some vehicle collides in the baseline, and none in the arm under test.
    pub any_prevented: u64,
    /// Samples in which some vehicle collides in the arm under test, and none in the baseline.
    pub any_induced: u64,
    /// Harm saved by the system, over the samples in which it saves harm.
    pub prevented_harm: f64,
    /// Harm added by the system, over the samples in which it adds harm.
    pub induced_harm: f64,
}

impl Pairs {
    /// Adds one pair. A pair without both outcomes does not count.
    pub fn push(&mut self, baseline: &Tally, tested: &Tally) {
        let of_others = u64::from(tested.collided == Some(false));
        match PairFate::of(baseline, tested) {
            Some(PairFate::Prevented) => self.prevented += 1,
            Some(PairFate::Induced) => {
                self.induced += 1;
                self.induced_of_others += of_others;
            }
            Some(PairFate::Both) => {
                self.both += 1;
                self.both_of_others += of_others;
            }
            Some(PairFate::Neither) => self.neither += 1,
            None => return,
        }
        let some_collides = |tally: &Tally| tally.collided == Some(true) || tally.others_collided;
        let (without, with) = (some_collides(baseline), some_collides(tested));
        self.any_prevented += u64::from(without && !with);
        self.any_induced += u64::from(with && !without);
        let more = tested.harm - baseline.harm;
        if more > 0.0 {
            self.induced_harm += more;
        } else {
            self.prevented_harm -= more;
        }
    }

    /// Returns the number of samples with two outcomes.
    pub fn samples(&self) -> u64 {
        self.prevented + self.induced + self.both + self.neither
    }

    /// Adds other pairs.
    pub fn add(&mut self, other: &Self) {
        self.prevented += other.prevented;
        self.induced += other.induced;
        self.both += other.both;
        self.neither += other.neither;
        self.induced_of_others += other.induced_of_others;
        self.both_of_others += other.both_of_others;
        self.any_prevented += other.any_prevented;
        self.any_induced += other.any_induced;
        self.prevented_harm += other.prevented_harm;
        self.induced_harm += other.induced_harm;
    }

    /// Returns the probability of a split at least as uneven if the arms are alike (McNemar test,
    /// two-sided, mid-p). It is valid only for a number of samples that is fixed in advance; `None`
    /// otherwise.
    ///
    /// The event is that some vehicle collides. *Prevented* and *induced* treat the two arms
    /// differently: a collision of others alone counts against the system in the tested arm, and
    /// does not count in the baseline. If others collide in some samples, alike arms then induce
    /// more than they prevent.
    pub fn mcnemar_p(&self, inference: Inference) -> Option<f64> {
        (inference == Inference::FixedSamples).then(|| mcnemar::mid_p(self.any_prevented, self.any_induced))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_is_never_a_pass() {
        let mut counts = ArmCounts::default();
        counts.push(Tally { collided: None, ..Tally::default() });
        assert_eq!((counts.outcomes, counts.errors), (0, 1));
        assert_eq!(counts.collision_rate(), None);
    }

    #[test]
    fn what_is_not_a_number_stays_the_worst() {
        let mut counts = ArmCounts::default();
        for jerk_mps3 in [3.0, f64::NAN, 5.0] {
            counts.push(Tally { collided: Some(false), jerk_mps3, ..Tally::default() });
        }
        assert!(counts.max_jerk_mps3.is_nan());
    }

    #[test]
    fn pairs_weigh_harm_apart_from_counts() {
        let tally = |collided, harm| Tally { collided: Some(collided), harm, ..Tally::default() };
        let mut pairs = Pairs::default();
        pairs.push(&tally(true, 0.5), &tally(false, 0.0));
        pairs.push(&tally(true, 0.25), &tally(true, 1.0));
        pairs.push(&tally(false, 0.0), &Tally::default());
        assert_eq!((pairs.prevented, pairs.induced, pairs.both, pairs.neither), (1, 0, 1, 0));
        assert_eq!((pairs.prevented_harm, pairs.induced_harm), (0.5, 0.75));
        assert_eq!(pairs.mcnemar_p(Inference::FixedSamples), Some(0.5));
        assert_eq!(pairs.mcnemar_p(Inference::Sequential), None);
        assert_eq!(pairs.mcnemar_p(Inference::Design), None);
    }

    #[test]
    fn the_test_of_pairs_is_symmetric_in_the_arms_if_only_others_collide() {
        let others = Tally { collided: Some(false), others_collided: true, ..Tally::default() };
        let none = Tally { collided: Some(false), ..Tally::default() };
        let mut pairs = Pairs::default();
        // Alike arms: as many samples in which others collide with the system alone as without it
        // alone.
        for _ in 0..20 {
            pairs.push(&none, &others);
            pairs.push(&others, &none);
        }
        assert_eq!((pairs.prevented, pairs.induced), (0, 20), "the counts of the system's fault are not symmetric");
        assert_eq!((pairs.any_prevented, pairs.any_induced), (20, 20));
        assert_eq!(pairs.mcnemar_p(Inference::FixedSamples), Some(1.0));
    }

    #[test]
    fn a_collision_of_others_with_the_system_is_not_a_prevented_one() {
        let tally = |collided, others_collided| Tally { collided: Some(collided), others_collided, ..Tally::default() };
        let cases = [
            (tally(true, false), tally(false, false), PairFate::Prevented),
            (tally(true, true), tally(false, false), PairFate::Prevented),
            (tally(true, false), tally(false, true), PairFate::Both),
            (tally(true, false), tally(true, false), PairFate::Both),
            (tally(false, false), tally(true, false), PairFate::Induced),
            (tally(false, true), tally(true, false), PairFate::Induced),
            (tally(false, false), tally(false, true), PairFate::Induced),
            (tally(false, true), tally(false, true), PairFate::Neither),
            (tally(false, true), tally(false, false), PairFate::Neither),
        ];
        let mut pairs = Pairs::default();
        for (baseline, tested, fate) in cases {
            assert_eq!(PairFate::of(&baseline, &tested), Some(fate), "{baseline:?}, {tested:?}");
            pairs.push(&baseline, &tested);
        }
        assert_eq!((pairs.prevented, pairs.induced, pairs.both, pairs.neither), (2, 3, 2, 2));
        assert_eq!((pairs.induced_of_others, pairs.both_of_others), (1, 1));
        assert_eq!(PairFate::of(&Tally::default(), &tally(true, false)), None);
    }
}
