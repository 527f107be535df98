//! Evaluates one gate over the samples of one scenario.

use closecall_scenarios::criteria::{Aggregate, EGO_COLLIDED, Expression, Measure, Operator, PairFlag, Quantity};
use closecall_traffic::maths::powf;
use closecall_traffic::statistics::binomial::{at_least, at_most};
use closecall_traffic::statistics::needed::{MAX_SAMPLES, first_that_holds};
use closecall_traffic::statistics::quantiles::quantile;

use crate::ledger::{Inference, PairFate};
use crate::record::Record;

/// Confidence of `lower` and `upper`, and of the reported intervals.
const CONFIDENCE: f64 = 0.95;

/// The result of one gate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Answer {
    /// The bound is satisfied.
    Met,
    /// The bound is not satisfied.
    Missed,
    /// The samples do not decide.
    Open(OpenReason),
}

/// The reason for which a gate is not decided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OpenReason {
    /// There are too few samples for the confidence that is asked for.
    TooFewSamples,
    /// No sample has the value that is judged.
    NoSamples,
    /// The gate compares arms, and the campaign has no baseline.
    NotPaired,
    /// No parameter varies enough, so that a bound of a probability means nothing.
    NothingVaries,
    /// A controller from outside reports the value of itself.
    SelfReported,
    /// The scenario has no coverage item or cross of this name.
    NotInCoverage,
    /// The samples have weights, and the value depends on how often they happen.
    WeightedSamples,
    /// The samples are points of a design, and a bound of a probability needs independent ones.
    DependentSamples,
    /// The bound allows every count or sum that so many samples can have.
    HoldsAlways,
}

impl OpenReason {
    /// Returns the reason in words.
    pub const fn text(self) -> &'static str {
        match self {
            Self::TooFewSamples => "too few samples to decide",
            Self::NoSamples => "no sample has this value",
            Self::NotPaired => "it needs a paired campaign",
            Self::NotInCoverage => "the scenario has no coverage item or cross of this name",
            Self::DependentSamples => {
                "the samples of the designs sobol, grid and coverage are not independent, so that no probability can be bounded"
            }
            Self::WeightedSamples => {
                "the samples of the design coverage visit each bin as often as any other, so that only a count, a smallest and a \
                 largest value say something"
            }
            Self::HoldsAlways => {
                "it holds whatever happens in these samples, and says nothing of them: set a bound that can be missed"
            }
            Self::NothingVaries => "no parameter varies enough, so that no probability can be bounded",
            Self::SelfReported => {
                "a controller from outside reports it of itself: judge a measured value, such as slowed_for_rear"
            }
        }
    }
}

/// Further facts on which the answer of a gate depends.
#[derive(Clone, Copy, Debug)]
pub struct Evidence {
    /// Whether the campaign has a baseline.
    pub is_paired: bool,
    /// Whether some parameter of the scenario varies enough.
    pub is_varied: bool,
    /// Whether the baseline, and the arm under test, are controllers of this program.
    pub is_built_in: [bool; 2],
    /// The rule that determines the number of samples.
    pub inference: Inference,
    /// Whether the samples have weights: they visit the bins of a coverage item or cross in turn.
    pub is_weighted: bool,
}

/// Smallest number of samples with which a gate on a count, a sum, a mean or an extreme is met (-):
/// an assumption; 10 to 59 are plausible. An event that none of 20 samples shows has a probability
/// of up to 14 %, with 95 % confidence.
pub const LEAST_SAMPLES: u64 = 20;

/// Returns the smallest number of samples with which a gate is met. A percentile needs enough
/// samples to reach beyond it with the confidence of a bound: 59 for the 5th and the 95th, 299 for
/// the 1st and the 99th. A scenario in which nothing varies has one sample.
fn least_samples(aggregate: Aggregate, is_varied: bool) -> u64 {
    match aggregate {
        _ if !is_varied => 1,
        // What samples cover, they cover.
        Aggregate::Lower | Aggregate::Upper | Aggregate::Coverage => 1,
        Aggregate::Percentile(percent) => {
            let inside = 0.01 * percent.max(100.0 - percent);
            let reaching = |samples: &u64| inside >= 1.0 || 1.0 - powf(inside, *samples as f64) >= CONFIDENCE;
            (LEAST_SAMPLES..MOST_ASKED).find(reaching).unwrap_or(MOST_ASKED)
        }
        _ => LEAST_SAMPLES,
    }
}

/// Largest number of samples that a percentile needs (-): the number for the 99.99th percentile.
const MOST_ASKED: u64 = 29_956;

/// What independent samples say beyond themselves about an extreme or a percentile, with the
/// confidence of a bound and for any distribution of the values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Certainty {
    /// At most this share of all such samples is beyond the extreme of these (-). A larger share
    /// would have shown itself (S. S. Wilks, *Determination of Sample Sizes for Setting Tolerance
    /// Limits*, Annals of Mathematical Statistics 12 (1941) 91–96).
    ShareBeyond(f64),
    /// One-sided bound of the percentile, on the side that the gate asks for: an order statistic
    /// (H. A. David and H. N. Nagaraja, *Order Statistics*, 3rd edition, section 7.1).
    PercentileBound(f64),
}

impl Certainty {
    /// Returns the share that may be beyond the extreme of `samples` samples.
    fn of_extreme(samples: u64) -> Self {
        Self::ShareBeyond(1.0 - powf(1.0 - CONFIDENCE, 1.0 / samples as f64))
    }

    /// Returns the bound of a percentile of sorted values: from below for a criterion `>=`, from
    /// above for `<=`. Returns `None` if there are too few values.
    fn of_percentile(sorted: &[f64], percent: f64, operator: Operator) -> Option<Self> {
        let (count, p) = (sorted.len() as u64, 0.01 * percent);
        // The value of rank r is at most the percentile if at least r values are, and it is at
        // least the percentile if at most r − 1 values are below.
        let rank = match operator {
            Operator::AtLeast => {
                let fails = first_that_holds(1, count, |rank| at_least(rank, count, p) < CONFIDENCE);
                fails.map_or(count, |rank| rank - 1)
            }
            Operator::AtMost => first_that_holds(1, count, |rank| at_most(rank - 1, count, p) >= CONFIDENCE)?,
        };
        let index = usize::try_from(rank.checked_sub(1)?).ok()?;
        sorted.get(index).copied().map(Self::PercentileBound)
    }
}

/// The value of a gate, with its interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Evaluation {
    /// The value of the left-hand side; `None` if no sample has it.
    pub value: Option<f64>,
    /// The two-sided 95 % interval of the share, for gates of flags.
    pub interval_95: Option<[f64; 2]>,
    /// What the samples say beyond themselves; `None` for other values, and if the samples are not
    /// independent or their number is not fixed in advance.
    pub certainty: Option<Certainty>,
    /// Samples that have the quantity and satisfy the condition.
    pub samples: u64,
    /// Samples among them that have the flag.
    pub hits: u64,
    /// Whether the bound is satisfied.
    pub answer: Answer,
    /// Number of samples of the campaign that decide the gate if further samples are like these,
    /// with those that do not satisfy the condition; `None` if the gate is decided, or if more than
    /// 10⁸ would be needed.
    pub needed: Option<u64>,
}

impl Evaluation {
    /// Returns the result of a gate on a coverage item or cross: its share and the samples in its
    /// bins, if the scenario has it.
    pub(super) fn of_coverage(expression: &Expression, covered: Option<(f64, u64)>) -> Self {
        let holds = |share: f64| expression.operator.holds(share, expression.bound);
        let answer = match covered {
            None => Answer::Open(OpenReason::NotInCoverage),
            Some((share, _)) if holds(share) => Answer::Met,
            Some(_) => Answer::Missed,
        };
        let (value, samples) = covered.map_or((None, 0), |(share, samples)| (Some(share), samples));
        Self { value, interval_95: None, certainty: None, samples, hits: 0, answer, needed: None }
    }
}

/// Gathers what a gate needs, sample by sample.
#[derive(Clone, Debug)]
pub struct Accumulator {
    expression: Expression,
    hits: u64,
    samples: u64,
    /// Samples that were added, with those that do not count.
    added: u64,
    sum: f64,
    smallest: Option<f64>,
    largest: Option<f64>,
    /// Every value, for percentiles only.
    values: Vec<f64>,
}

impl Accumulator {
    /// Returns an accumulator without samples.
    pub fn new(expression: Expression) -> Self {
        Self { expression, hits: 0, samples: 0, added: 0, sum: 0.0, smallest: None, largest: None, values: Vec::new() }
    }

    /// Adds one sample. A sample without the value, or without the condition, does not count.
    pub fn push(&mut self, record: &Record) {
        self.added += 1;
        if let Some(condition) = self.expression.condition
            && value(condition, record) != Some(1.0)
        {
            return;
        }
        let Some(value) = value(self.expression.quantity, record) else { return };
        self.samples += 1;
        self.hits += u64::from(value == 1.0);
        self.sum += value;
        // A value that is not a number is both the smallest and the largest: it never satisfies a
        // bound.
        let keep = |extreme: Option<f64>, is_beyond: fn(f64, f64) -> bool| match extreme {
            Some(extreme) if extreme.is_nan() || !(value.is_nan() || is_beyond(value, extreme)) => Some(extreme),
            _ => Some(value),
        };
        self.smallest = keep(self.smallest, |value, extreme| value < extreme);
        self.largest = keep(self.largest, |value, extreme| value > extreme);
        if matches!(self.expression.aggregate, Aggregate::Percentile(_)) {
            self.values.push(value);
        }
    }

    /// Returns the result.
    pub fn evaluate(&self, evidence: &Evidence) -> Evaluation {
        Evaluation { certainty: self.certainty(evidence), ..self.decide(evidence) }
    }

    fn certainty(&self, evidence: &Evidence) -> Option<Certainty> {
        let is_independent =
            evidence.is_varied && !evidence.is_weighted && evidence.inference == Inference::FixedSamples;
        // What is not a number is in the sum.
        if !is_independent || self.samples == 0 || self.sum.is_nan() {
            return None;
        }
        match self.expression.aggregate {
            Aggregate::Min | Aggregate::Max => Some(Certainty::of_extreme(self.samples)),
            Aggregate::Percentile(percent) => {
                Certainty::of_percentile(&sorted(&self.values), percent, self.expression.operator)
            }
            _ => None,
        }
    }

    /// Returns the result without what it says beyond the samples.
    fn decide(&self, evidence: &Evidence) -> Evaluation {
        let Evidence { is_paired, is_varied, is_built_in, inference, is_weighted } = *evidence;
        let Expression { aggregate, operator, bound, .. } = self.expression;
        let (hits, samples) = (self.hits, self.samples);
        let interval_95 = (aggregate.is_of_flag() && samples > 0 && is_varied)
            .then(|| inference.interval_95(hits, samples))
            .flatten();
        let value = (samples > 0 || aggregate == Aggregate::Count).then(|| self.value(inference)).flatten();
        let whole = |answer, needed| Evaluation { value, interval_95, certainty: None, samples, hits, answer, needed };
        let open = |reason| whole(Answer::Open(reason), None);
        if self.expression.needs_pairs() && !is_paired {
            return open(OpenReason::NotPaired);
        }
        let is_reported = self
            .expression
            .reported_by()
            .into_iter()
            .zip(is_built_in)
            .any(|(reported, built_in)| reported && !built_in);
        if is_reported {
            return open(OpenReason::SelfReported);
        }
        if is_weighted && !matches!(aggregate, Aggregate::Count | Aggregate::Min | Aggregate::Max) {
            return open(OpenReason::WeightedSamples);
        }
        let is_bound = matches!(aggregate, Aggregate::Lower | Aggregate::Upper);
        if is_bound && !is_varied {
            return open(OpenReason::NothingVaries);
        }
        if is_bound && inference == Inference::Design {
            return open(OpenReason::DependentSamples);
        }
        let Some(observed) = value.filter(|_| samples > 0) else { return open(OpenReason::NoSamples) };
        let is_enough = samples >= least_samples(aggregate, is_varied);
        let is_percentile = matches!(aggregate, Aggregate::Percentile(_));
        // Few samples do not show a percentile. Their count or extreme is a fact.
        let answer = if operator.holds(observed, bound) {
            match is_enough {
                true if self.expression.holds_always(self.added.max(samples)) => Answer::Open(OpenReason::HoldsAlways),
                true => Answer::Met,
                false => Answer::Open(OpenReason::TooFewSamples),
            }
        } else if is_percentile && !is_enough || is_bound && self.is_undecided(inference) {
            Answer::Open(OpenReason::TooFewSamples)
        } else {
            Answer::Missed
        };
        let is_open = answer == Answer::Open(OpenReason::TooFewSamples);
        let of_bound = || if is_bound { self.needed(inference) } else { Some(least_samples(aggregate, is_varied)) };
        let of_all = |needed: u64| needed.saturating_mul(self.added.max(samples)).div_ceil(samples);
        let needed = is_open.then(of_bound).flatten().map(of_all);
        whole(answer, needed)
    }

    /// Returns true if the gate fails whatever the remaining `rest` samples are, even the most
    /// favourable ones. Returns false for a sum, a mean and a percentile.
    pub fn is_lost(&self, evidence: &Evidence, rest: u64) -> bool {
        let Expression { aggregate, operator, .. } = self.expression;
        if evidence.inference != Inference::FixedSamples || self.decide(evidence).answer != Answer::Missed {
            return false;
        }
        let favourable = || {
            let hits = self.hits + if operator == Operator::AtLeast { rest } else { 0 };
            let samples = self.samples + rest;
            Self { hits, samples, ..Self::new(self.expression) }.decide(evidence).answer == Answer::Missed
        };
        match (aggregate, operator) {
            // A count or an extreme beyond its bound stays there.
            (Aggregate::Count | Aggregate::Max, Operator::AtMost) | (Aggregate::Min, Operator::AtLeast) => true,
            (Aggregate::Count, Operator::AtLeast) | (Aggregate::Share | Aggregate::Lower | Aggregate::Upper, _) => {
                favourable()
            }
            _ => false,
        }
    }

    /// Returns the number of samples that decides a gate on a bound of a share, if the share stays
    /// as it is.
    fn needed(&self, inference: Inference) -> Option<u64> {
        let share = self.hits as f64 / self.samples as f64;
        let is_decided = |samples: u64| {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a share of a count; a cast saturates"
            )]
            let hits = (share * samples as f64).round() as u64;
            let grown = Self { hits, samples, ..Self::new(self.expression) };
            let Expression { operator, bound, .. } = self.expression;
            grown.value(inference).is_some_and(|value| operator.holds(value, bound)) || !grown.is_undecided(inference)
        };
        first_that_holds(self.samples, MAX_SAMPLES, is_decided)
    }

    /// Returns true if the bound of the share on the other side still satisfies the gate: more
    /// samples may decide.
    fn is_undecided(&self, inference: Inference) -> bool {
        let other = match self.expression.aggregate {
            Aggregate::Lower => inference.upper_bound(self.hits, self.samples, CONFIDENCE),
            _ => inference.lower_bound(self.hits, self.samples, CONFIDENCE),
        };
        other.is_none_or(|other| self.expression.operator.holds(other, self.expression.bound))
    }

    fn value(&self, inference: Inference) -> Option<f64> {
        let (hits, samples) = (self.hits, self.samples);
        if self.sum.is_nan() && self.expression.aggregate.is_of_flag() {
            return Some(f64::NAN);
        }
        match self.expression.aggregate {
            Aggregate::Count => Some(hits as f64),
            Aggregate::Share => Some(hits as f64 / samples as f64),
            Aggregate::Lower => inference.lower_bound(hits, samples, CONFIDENCE),
            Aggregate::Upper => inference.upper_bound(hits, samples, CONFIDENCE),
            Aggregate::Min => self.smallest,
            Aggregate::Max => self.largest,
            Aggregate::Mean => Some(self.sum / samples as f64),
            Aggregate::Sum => Some(self.sum),
            // A value of all samples together.
            Aggregate::Coverage => None,
            Aggregate::Percentile(percent) => percentile(&self.values, percent),
        }
    }
}

/// Returns the percentile of values. Any value that is not a number makes the result not a number.
fn percentile(values: &[f64], percent: f64) -> Option<f64> {
    if values.iter().any(|value| value.is_nan()) {
        return Some(f64::NAN);
    }
    let sorted = sorted(values);
    (!sorted.is_empty()).then(|| quantile(&sorted, 0.01 * percent))
}

fn sorted(values: &[f64]) -> Vec<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted
}

/// Returns the value of a quantity in one sample; `None` if the sample does not have it.
///
/// Collisions of the ego count as judged: if the validity checks flipped a verdict, the verdict
/// that is worse for the system under test counts.
pub(crate) fn value(quantity: Quantity, record: &Record) -> Option<f64> {
    let is = |holds: bool| if holds { 1.0 } else { 0.0 };
    let tested = record.arms.len().checked_sub(1)?;
    let collided = |index: usize| record.tallies().get(index)?.collided;
    let measured = |index: usize, measure: &Measure| match record.arms.get(index)?.result.as_ref() {
        Ok(_) if measure.name == EGO_COLLIDED => collided(index).map(is),
        Ok(outcome) => measure.of(outcome),
        Err(_) => None,
    };
    match quantity {
        Quantity::Tested(measure) => measured(tested, measure),
        Quantity::Baseline(measure) if tested > 0 => measured(0, measure),
        Quantity::Compared(comparison) if !comparison.in_baseline => {
            Some(comparison.of(measured(tested, comparison.measure)?))
        }
        Quantity::Compared(comparison) if tested > 0 => Some(comparison.of(measured(0, comparison.measure)?)),
        Quantity::Pair(flag) if tested > 0 => {
            let tallies = record.tallies();
            let fate = PairFate::of(tallies.first()?, tallies.get(tested)?)?;
            Some(is(match flag {
                PairFlag::Prevented => fate == PairFate::Prevented,
                PairFlag::Induced => fate == PairFate::Induced,
            }))
        }
        Quantity::Baseline(_) | Quantity::Pair(_) | Quantity::Compared(_) | Quantity::Covered(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Independent samples of a scenario that varies, without a baseline.
    const EVIDENCE: Evidence = Evidence {
        is_paired: false,
        is_varied: true,
        is_built_in: [true; 2],
        inference: Inference::FixedSamples,
        is_weighted: false,
    };

    /// Returns whether a gate of a flag is lost after these samples and hits.
    fn is_lost(gate: &str, hits: u64, samples: u64, rest: u64) -> bool {
        let evidence = Evidence { is_paired: true, ..EVIDENCE };
        Accumulator { hits, samples, ..Accumulator::new(gate.parse().unwrap()) }.is_lost(&evidence, rest)
    }

    #[test]
    fn a_gate_is_lost_if_the_best_of_the_remaining_samples_do_not_save_it() {
        for (gate, hits, samples, lost_with, saved_with) in [
            ("count(induced) <= 2", 3, 10, Some(1_000_000), None),
            ("count(engaged) >= 5", 1, 10, Some(3), Some(4)),
            ("share(induced) <= 0.1", 5, 20, Some(29), Some(30)),
            ("share(engaged) >= 0.9", 5, 10, Some(39), Some(40)),
            ("upper(induced) <= 0.01", 9, 20, Some(0), Some(10_000)),
            ("lower(engaged) >= 0.9", 1, 20, Some(5), Some(100_000)),
        ] {
            assert!(lost_with.is_none_or(|rest| is_lost(gate, hits, samples, rest)), "{gate}");
            assert!(saved_with.is_none_or(|rest| !is_lost(gate, hits, samples, rest)), "{gate}");
        }
        assert!(!is_lost("count(induced) <= 2", 2, 10, 5), "the bound is allowed");
        assert!(!is_lost("upper(induced) <= 0.01", 0, 20, 0), "too few samples are no failure");
    }

    #[test]
    fn a_gate_that_no_sample_can_miss_is_open() {
        let evidence = Evidence {
            is_paired: true,
            is_varied: true,
            is_built_in: [true; 2],
            inference: Inference::FixedSamples,
            is_weighted: false,
        };
        let answer = |gate: &str| {
            let expression: Expression = gate.parse().unwrap();
            let (smallest, largest) = (Some(1.0), Some(2.0));
            Accumulator { samples: 60, hits: 3, sum: 90.0, smallest, largest, ..Accumulator::new(expression) }
                .evaluate(&evidence)
                .answer
        };
        for gate in ["count(ego_collided) <= 60", "count(ego_collided) <= 1000"] {
            assert_eq!(answer(gate), Answer::Open(OpenReason::HoldsAlways), "{gate}");
        }
        for gate in ["sum(max_jerk_mps3) <= 2400", "sum(thw_gain_s) >= -1e300"] {
            assert_eq!(answer(gate), Answer::Open(OpenReason::HoldsAlways), "{gate}");
        }
        for gate in ["count(ego_collided) <= 59", "share(ego_collided) >= 0.01", "max(max_jerk_mps3) <= 39"] {
            assert_eq!(answer(gate), Answer::Met, "{gate}");
        }
        // Of 400 samples, any 60 could have the condition, and more of them.
        let some = Accumulator { samples: 60, added: 400, ..Accumulator::new("count(induced) <= 80".parse().unwrap()) };
        assert_eq!(some.evaluate(&evidence).answer, Answer::Met);
    }

    #[test]
    fn an_extreme_beyond_its_bound_is_lost_and_a_mean_is_not() {
        let after = |gate: &str, value: f64| {
            let expression: Expression = gate.parse().unwrap();
            let (smallest, largest) = (Some(value), Some(value));
            Accumulator { samples: 30, sum: 30.0 * value, smallest, largest, ..Accumulator::new(expression) }
                .is_lost(&EVIDENCE, 1_000)
        };
        assert!(after("min(min_ttc_rear_s) >= 1", 0.5) && !after("min(min_ttc_rear_s) >= 1", 1.0));
        assert!(after("max(max_jerk_mps3) <= 5", 5.1) && !after("max(max_jerk_mps3) >= 5", 4.0));
        assert!(after("max(max_jerk_mps3) <= 5", f64::NAN), "what is not a number satisfies no bound");
        assert!(!after("mean(max_jerk_mps3) <= 5", 9.0) && !after("sum(harm) <= 5", 9.0));
        let design = Evidence { inference: Inference::Sequential, ..EVIDENCE };
        let gate = Accumulator { hits: 9, samples: 9, ..Accumulator::new("count(engaged) <= 0".parse().unwrap()) };
        assert!(gate.is_lost(&EVIDENCE, 1) && !gate.is_lost(&design, 1));
    }

    #[test]
    fn weighted_samples_decide_only_what_does_not_depend_on_how_often_they_happen() {
        let evidence = Evidence { inference: Inference::Design, is_weighted: true, ..EVIDENCE };
        let answer = |gate: &str| {
            let expression: Expression = gate.parse().unwrap();
            let gate = Accumulator { samples: 400, hits: 0, smallest: Some(2.0), ..Accumulator::new(expression) };
            gate.evaluate(&evidence).answer
        };
        assert_eq!(answer("count(ego_collided) <= 0"), Answer::Met);
        assert_eq!(answer("min(min_ttc_rear_s) >= 1"), Answer::Met);
        for gate in
            ["share(ego_collided) <= 0.1", "upper(ego_collided) <= 0.1", "mean(harm) <= 1", "p5(min_ttc_rear_s) >= 1"]
        {
            assert_eq!(answer(gate), Answer::Open(OpenReason::WeightedSamples), "{gate}");
        }
    }

    #[test]
    fn an_extreme_and_a_percentile_say_how_sure_they_are() {
        let certainty = |gate: &str, values: &[f64], evidence: &Evidence| {
            let expression: Expression = gate.parse().unwrap();
            let samples = values.len() as u64;
            let sum = values.iter().sum();
            Accumulator { samples, sum, values: values.to_vec(), ..Accumulator::new(expression) }.certainty(evidence)
        };
        let values: Vec<f64> = (1..=299).rev().map(f64::from).collect();
        // 59 samples reach beyond the 95th percentile with 95 % confidence, and 58 do not.
        for (count, is_within) in [(58, false), (59, true)] {
            let Some(Certainty::ShareBeyond(share)) = certainty("max(max_jerk_mps3) <= 5", &values[..count], &EVIDENCE)
            else {
                panic!("an extreme has a share");
            };
            assert_eq!(share <= 0.05, is_within, "{count}: {share}");
        }
        let bound = |gate: &str, count: usize| certainty(gate, &values[..count], &EVIDENCE);
        assert_eq!(bound("p1(min_ttc_rear_s) >= 1", 299), Some(Certainty::PercentileBound(1.0)));
        assert_eq!(bound("p1(min_ttc_rear_s) >= 1", 298), None, "the smallest of 298 may be above");
        assert_eq!(bound("p99(max_jerk_mps3) <= 5", 299), Some(Certainty::PercentileBound(299.0)));
        assert_eq!(bound("p99(max_jerk_mps3) <= 5", 298), None);
        // The median of 100 values from 200 to 299, of ranks 42 and 59 (binomial distribution with
        // 1/2).
        assert_eq!(bound("p50(max_jerk_mps3) >= 5", 100), Some(Certainty::PercentileBound(241.0)));
        assert_eq!(bound("p50(max_jerk_mps3) <= 5", 100), Some(Certainty::PercentileBound(258.0)));
        assert_eq!(bound("p100(max_jerk_mps3) <= 5", 299), None, "no sample shows the largest value of all");
        for gate in ["mean(max_jerk_mps3) <= 5", "sum(harm) <= 5", "count(engaged) <= 5"] {
            assert_eq!(bound(gate, 299), None, "{gate}");
        }
        let of_design = Evidence { inference: Inference::Design, ..EVIDENCE };
        let of_one = Evidence { is_varied: false, ..EVIDENCE };
        for other in [of_design, of_one] {
            assert_eq!(certainty("max(max_jerk_mps3) <= 5", &values, &other), None);
        }
        assert_eq!(certainty("max(max_jerk_mps3) <= 5", &[1.0, f64::NAN], &EVIDENCE), None);
    }

    #[test]
    fn a_percentile_asks_for_as_many_samples_as_reach_beyond_it() {
        let least = |percent| least_samples(Aggregate::Percentile(percent), true);
        assert_eq!([least(99.0), least(1.0), least(95.0), least(5.0), least(50.0)], [299, 299, 59, 59, 20]);
        assert_eq!([least(100.0), least(0.0), least(99.999)], [20, 20, MOST_ASKED]);
        assert_eq!(
            [Aggregate::Count, Aggregate::Max, Aggregate::Min].map(|aggregate| least_samples(aggregate, true)),
            [20; 3]
        );
        assert_eq!(least_samples(Aggregate::Percentile(99.0), false), 1, "nothing varies");
    }
}
