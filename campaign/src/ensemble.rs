//! The verdict of a campaign over a driver ensemble: the median member and the worst member of each
//! scenario.
//!
//! Each entry SCENARIO@MEMBER is a scenario of its own, with gates of its own. The verdict here is
//! a statement about the members of one scenario together: which share of the baseline's collisions
//! is prevented, in which share of the samples a collision is induced, and how much harm changes.
//! The members are no sample of drivers: no weights are assumed. Of an even number of members, the
//! less favourable of the two in the middle is the median, so that the median is always a member.
//!
//! The member that looks worst is chosen by the data, so its own 95 % interval covers the worst
//! share in fewer than 95 % of repetitions. The intervals of median and worst come from intervals
//! that hold for all m members at once (Bonferroni: each with 1 - 0.05/m). If all of them hold, the
//! worst share lies between the worst of their lower and the worst of their upper bounds, and
//! likewise the median.

use std::collections::BTreeMap;

use crate::arm_pairs::ArmPair;
use crate::ledger::Inference;
use crate::summary::{Counts, Summary};

/// The sign between the names of scenario and member.
const SEPARATOR: char = '@';

/// A quantity that is compared between members.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Share of the baseline's collisions of the ego that the system prevents (-).
    Prevented,
    /// Share of the samples in which the system induces a collision (-).
    Induced,
    /// Mean change of the harm of a sample; negative if the system saves harm.
    HarmChange,
    /// Share of the samples in which the ego collides, in a campaign without a baseline (-).
    Collisions,
}

impl Quantity {
    /// Returns the name in reports for programs.
    pub const fn key(self) -> &'static str {
        match self {
            Self::Prevented => "prevented_share",
            Self::Induced => "induced_share",
            Self::HarmChange => "harm_change_per_sample",
            Self::Collisions => "collision_rate",
        }
    }

    /// Returns the name in reports for human readers.
    pub const fn text(self) -> &'static str {
        match self {
            Self::Prevented => "prevented share",
            Self::Induced => "induced share",
            Self::HarmChange => "change of harm per sample",
            Self::Collisions => "collision rate",
        }
    }

    /// Returns true if the quantity is a share.
    pub const fn is_share(self) -> bool {
        !matches!(self, Self::HarmChange)
    }

    /// Returns the value of one entry; `None` if the quantity is not defined.
    fn of(self, counts: &Counts, tested: usize) -> Option<Observed> {
        let share = |hits: u64, samples: u64| {
            (samples > 0)
                .then(|| Observed { value: hits as f64 / samples as f64, hits_of_samples: Some([hits, samples]) })
        };
        let with_baseline = |pair: &&ArmPair| (pair.baseline, pair.tested) == (0, tested);
        let pairs = match counts.arm_pairs.iter().find(with_baseline) {
            Some(pair) if tested + 1 < counts.arms.len() => &pair.pairs,
            _ => &counts.pairs,
        };
        let all = pairs.prevented + pairs.induced + pairs.both + pairs.neither;
        match self {
            Self::Prevented => share(pairs.prevented, pairs.prevented + pairs.both),
            Self::Induced => share(pairs.induced, all),
            Self::HarmChange => (all > 0).then(|| Observed {
                value: (pairs.induced_harm - pairs.prevented_harm) / all as f64,
                hits_of_samples: None,
            }),
            Self::Collisions => counts.arms.get(tested).and_then(|arm| share(arm.collisions, arm.outcomes)),
        }
    }

    /// Returns the interval of the value at a rank, the most favourable first. `intervals` hold at
    /// once, so both bounds are the bounds at the same rank.
    fn interval_of_rank(self, intervals: &[[f64; 2]], rank: usize) -> Option<[f64; 2]> {
        let bound = |side: usize| {
            let mut bounds: Vec<f64> = intervals.iter().map(|interval| interval[side]).collect();
            bounds.sort_by(|a, b| self.badness(*a).total_cmp(&self.badness(*b)));
            bounds.get(rank).copied()
        };
        Some([bound(0)?, bound(1)?])
    }

    /// Returns how unfavourable a value is: larger is worse.
    fn badness(self, value: f64) -> f64 {
        if self == Self::Prevented { -value } else { value }
    }
}

/// The observed value of one entry.
#[derive(Clone, Copy, Debug)]
struct Observed {
    /// The value of the quantity.
    value: f64,
    /// Hits and samples of a share.
    hits_of_samples: Option<[u64; 2]>,
}

/// Share of repetitions in which the interval of the median or the worst member covers the true
/// value, at least (-).
const COVERAGE: f64 = 0.95;

/// The value of one member.
#[derive(Clone, Debug, PartialEq)]
pub struct MemberValue {
    /// The member's name.
    pub member: String,
    /// The value.
    pub value: f64,
    /// The 95 % interval of a share: of the member alone in [`Spread::values`], simultaneous over
    /// the members in [`Spread::median`] and [`Spread::worst`]. `None` if no bound is valid.
    pub interval_95: Option<[f64; 2]>,
}

/// Median and worst member of one quantity.
#[derive(Clone, Debug, PartialEq)]
pub struct Spread {
    /// The quantity.
    pub quantity: Quantity,
    /// The member in the middle.
    pub median: MemberValue,
    /// The least favourable member.
    pub worst: MemberValue,
    /// The values of all members, the most favourable first.
    pub values: Vec<MemberValue>,
    /// Members for which the quantity is not defined, for example because nothing collides without
    /// the system.
    pub undefined: Vec<String>,
}

/// The verdict over the ensemble for one scenario.
#[derive(Clone, Debug, PartialEq)]
pub struct EnsembleVerdict {
    /// The scenario's name, without a member.
    pub scenario: String,
    /// The members that were run.
    pub members: Vec<String>,
    /// The members that change nothing in this scenario, and were not run.
    pub without_effect: Vec<String>,
    /// Median and worst of each quantity that is defined for at least one member.
    pub spreads: Vec<Spread>,
}

/// Returns the verdict over the ensemble of the arm under test, for each scenario that was run as
/// entries SCENARIO@MEMBER. `without_effect` names pairs of scenario and member that were not run
/// because the member changes nothing.
pub fn verdicts(summary: &Summary, without_effect: &[(String, String)]) -> Vec<EnsembleVerdict> {
    verdicts_of_arm(summary, without_effect, summary.controllers.len().saturating_sub(1))
}

/// Works like [`verdicts`], for the arm with the index `tested` instead of the last one.
pub fn verdicts_of_arm(summary: &Summary, without_effect: &[(String, String)], tested: usize) -> Vec<EnsembleVerdict> {
    let mut scenarios: BTreeMap<&str, Vec<(&str, &Counts)>> = BTreeMap::new();
    for (name, counts) in &summary.scenarios {
        if let Some((scenario, member)) = name.split_once(SEPARATOR) {
            scenarios.entry(scenario).or_default().push((member, counts));
        }
    }
    let quantities: &[Quantity] = match summary.is_paired() {
        true => &[Quantity::Prevented, Quantity::Induced, Quantity::HarmChange],
        false => &[Quantity::Collisions],
    };
    let verdict = |(scenario, entries): (&str, Vec<(&str, &Counts)>)| EnsembleVerdict {
        scenario: scenario.to_owned(),
        members: entries.iter().map(|(member, _)| (*member).to_owned()).collect(),
        without_effect: without_effect
            .iter()
            .filter(|(name, _)| name == scenario)
            .map(|(_, member)| member.clone())
            .collect(),
        spreads: quantities
            .iter()
            .filter_map(|quantity| spread(*quantity, &entries, summary.inference, tested))
            .collect(),
    };
    scenarios.into_iter().map(verdict).collect()
}

/// Returns median and worst member, or `None` if the quantity is defined for no member.
fn spread(quantity: Quantity, entries: &[(&str, &Counts)], inference: Inference, tested: usize) -> Option<Spread> {
    let mut undefined = Vec::new();
    let mut observed = Vec::new();
    for (member, counts) in entries {
        match quantity.of(counts, tested) {
            Some(value) => observed.push((*member, value)),
            None => undefined.push((*member).to_owned()),
        }
    }
    let interval = |observed: Observed, coverage: f64| {
        let [hits, samples] = observed.hits_of_samples?;
        inference.interval(hits, samples, coverage)
    };
    let mut values: Vec<MemberValue> = observed
        .iter()
        .map(|&(member, observed)| MemberValue {
            member: member.to_owned(),
            value: observed.value,
            interval_95: interval(observed, COVERAGE),
        })
        .collect();
    values.sort_by(|a, b| {
        quantity.badness(a.value).total_cmp(&quantity.badness(b.value)).then_with(|| a.member.cmp(&b.member))
    });
    let at_once = 1.0 - (1.0 - COVERAGE) / observed.len().max(1) as f64;
    let intervals: Option<Vec<[f64; 2]>> = observed.iter().map(|&(_, observed)| interval(observed, at_once)).collect();
    let ranked = |rank: usize| {
        let member = values.get(rank)?;
        let interval_95 = intervals.as_deref().and_then(|intervals| quantity.interval_of_rank(intervals, rank));
        Some(MemberValue { interval_95, ..member.clone() })
    };
    let (median, worst) = (ranked(values.len() / 2)?, ranked(values.len().checked_sub(1)?)?);
    Some(Spread { quantity, median, worst, values, undefined })
}

#[cfg(test)]
mod tests {
    use closecall_traffic::Stream;
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::ledger::{ArmCounts, Pairs};

    fn summary(entries: &[(&str, Pairs)]) -> Summary {
        let names = entries.iter().map(|(name, _)| (*name).to_owned());
        let mut summary = Summary::new(vec!["acc".to_owned(), "mis".to_owned()], names);
        for ((_, counts), (_, pairs)) in summary.scenarios.iter_mut().zip(entries) {
            counts.pairs = *pairs;
        }
        summary
    }

    fn pairs(prevented: u64, induced: u64, both: u64, harm: [f64; 2]) -> Pairs {
        let neither = 100 - prevented - induced - both;
        let [prevented_harm, induced_harm] = harm;
        Pairs { prevented, induced, both, neither, prevented_harm, induced_harm, ..Pairs::default() }
    }

    #[test]
    fn median_and_worst_are_members_and_the_less_favourable_of_two_in_the_middle_counts() {
        let summary = summary(&[
            ("a@calm", pairs(40, 0, 10, [4.0, 0.0])),
            ("a@slow", pairs(30, 2, 20, [3.0, 0.5])),
            ("a@idm", pairs(45, 0, 5, [5.0, 0.0])),
            ("a@alert", pairs(9, 5, 1, [0.5, 1.0])),
            ("b", pairs(1, 1, 1, [1.0, 1.0])),
        ]);
        let [verdict] = &verdicts(&summary, &[("a".into(), "steer".into()), ("b".into(), "x".into())])[..] else {
            panic!("one scenario has members")
        };
        assert_eq!((verdict.scenario.as_str(), verdict.members.len()), ("a", 4));
        assert_eq!(verdict.without_effect, ["steer"]);
        let named = |index: usize| {
            let spread: &Spread = &verdict.spreads[index];
            (spread.median.member.as_str(), spread.median.value, spread.worst.member.as_str(), spread.worst.value)
        };
        // Prevented: 0.9 idm, 0.9 alert, 0.8 calm, 0.6 slow.
        assert_eq!(named(0), ("calm", 0.8, "slow", 0.6));
        assert_eq!(named(1), ("slow", 0.02, "alert", 0.05));
        assert_eq!(named(2), ("slow", -0.025, "alert", 0.005));
        let interval = verdict.spreads[0].worst.interval_95.unwrap();
        assert!(interval[0] < 0.6 && 0.6 < interval[1] && verdict.spreads[2].worst.interval_95.is_none());
    }

    /// Twelve alike members: the one that looks worst is so by chance. Its own interval would miss
    /// the true share in every second repetition.
    #[test]
    fn the_interval_of_the_worst_member_covers_the_worst_share() {
        const MEMBERS: usize = 12;
        const SAMPLES: u64 = 300;
        const REPETITIONS: usize = 1_000;
        for truths in [[0.05; MEMBERS], std::array::from_fn(|member| 0.01 + 0.005 * member as f64)] {
            let worst_truth = truths[MEMBERS - 1];
            let mut random = Stream::seed_from_u64(1);
            let covered = |interval: Option<[f64; 2]>| {
                interval.is_some_and(|[low, high]| low <= worst_truth && worst_truth <= high)
            };
            let (mut at_once, mut alone) = (0, 0);
            for _ in 0..REPETITIONS {
                let entries: Vec<(String, Pairs)> = truths
                    .iter()
                    .enumerate()
                    .map(|(member, truth)| {
                        let induced = (0..SAMPLES).filter(|_| random.random_bool(*truth)).count() as u64;
                        let neither = SAMPLES - induced;
                        (format!("a@{member}"), Pairs { induced, neither, ..Pairs::default() })
                    })
                    .collect();
                let entries: Vec<(&str, Pairs)> = entries.iter().map(|(name, pairs)| (name.as_str(), *pairs)).collect();
                let verdicts = verdicts(&summary(&entries), &[]);
                let induced = &verdicts[0].spreads[0];
                assert_eq!(induced.quantity, Quantity::Induced);
                at_once += usize::from(covered(induced.worst.interval_95));
                alone += usize::from(covered(induced.values.last().unwrap().interval_95));
            }
            assert!(at_once >= 940, "{at_once} of {REPETITIONS}");
            assert!(alone < at_once, "{alone} of {REPETITIONS} by the interval of the member alone");
        }
    }

    #[test]
    fn a_member_without_any_collision_is_named_and_not_ranked() {
        let summary = summary(&[("a@alert", pairs(0, 0, 0, [0.0; 2])), ("a@slow", pairs(1, 0, 1, [0.1, 0.0]))]);
        let verdicts = verdicts(&summary, &[]);
        let prevented = &verdicts[0].spreads[0];
        assert_eq!((prevented.undefined.clone(), prevented.worst.value), (vec!["alert".to_owned()], 0.5));
        assert_eq!(verdicts[0].spreads[1].worst.value, 0.0);
    }

    #[test]
    fn without_a_baseline_the_collision_rates_are_compared() {
        let mut summary = Summary::new(vec!["mis".to_owned()], ["a@x".to_owned(), "a@y".to_owned()]);
        for ((_, counts), collisions) in summary.scenarios.iter_mut().zip([1, 5]) {
            counts.arms[0] = ArmCounts { outcomes: 10, collisions, ..ArmCounts::default() };
        }
        let verdicts = verdicts(&summary, &[]);
        assert_eq!(verdicts[0].spreads.len(), 1);
        assert_eq!((verdicts[0].spreads[0].worst.member.as_str(), verdicts[0].spreads[0].worst.value), ("y", 0.5));
    }
}
