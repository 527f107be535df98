//! The language of gates.
//!
//! ```text
//!  gate      = aggregate "(" quantity [ "|" condition ] ")" operator number
//!  aggregate = "count" | "share" | "lower" | "upper"          of a flag
//!            | "min" | "max" | "mean" | "sum" | "p" percent   of a number
//!            | "coverage"                                    of an item or a cross of [coverage]
//!  quantity  = [ "baseline." ] measure | pair flag | comparison
//!  condition = [ "baseline." ] flag | pair flag | comparison
//!  comparison = [ "baseline." ] number (">" | "<") threshold   a flag
//!  operator  = "<=" | ">="
//! ```
//!
//! `p99(min_ttc_rear_s) >= 1.0` asks that the 99th percentile of the smallest time to collision is
//! at least 1 s. `lower(prevented | baseline.ego_collided) >= 0.5` asks that, of the samples in
//! which the ego collides without the system, more than half are prevented with 95 % confidence.
//! `lower` and `upper` are the exact one-sided bounds of a share.
//! `coverage(closing-by-class) >= 0.95` asks that samples hit 95 % of the bins of that item or
//! cross. `share(imposed_braking_mps2 > 3) <= 0.05` asks that the vehicle behind brakes harder than
//! 3 m/s² in at most 5 % of the samples.
//!
//! A gate that every sample meets, or that no sample can meet, says nothing, and is refused: its
//! bound lies at the end of the range of the value or beyond ([`Measure::range`]), or its condition
//! decides its flag.

use std::fmt;
use std::str::FromStr;

use closecall_traffic::Range;

use crate::coverage::CoverageName;

use super::implied;
use super::measure::{MEASURES, Measure, MeasureKind, PairFlag};

/// A value that is computed from all samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Aggregate {
    /// The number of samples in which a flag holds.
    Count,
    /// The share of samples in which a flag holds.
    Share,
    /// The one-sided lower 95 % bound of that share.
    Lower,
    /// The one-sided upper 95 % bound of that share.
    Upper,
    /// The smallest value.
    Min,
    /// The largest value.
    Max,
    /// The mean.
    Mean,
    /// The sum.
    Sum,
    /// A percentile, from 0 to 100.
    Percentile(f64),
    /// The share of the bins of a coverage item or cross that samples hit.
    Coverage,
}

impl Aggregate {
    /// Returns true if the aggregate is one of a flag, false if it is one of a number.
    pub const fn is_of_flag(self) -> bool {
        matches!(self, Self::Count | Self::Share | Self::Lower | Self::Upper)
    }
}

/// The side of a threshold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Larger values.
    Above,
    /// Smaller values.
    Below,
}

/// A number that lies beyond a threshold: a flag.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// The number.
    pub measure: &'static Measure,
    /// Whether the measure is taken in the baseline, instead of the arm under test.
    pub in_baseline: bool,
    /// The side of the bound on which the flag holds.
    pub side: Side,
    /// The threshold, at which the flag does not hold.
    pub threshold: f64,
}

impl Comparison {
    /// Returns 1 if a value lies beyond the threshold, and 0 if not. What is not a number stays so,
    /// and satisfies no gate.
    pub fn of(&self, value: f64) -> f64 {
        let holds = match self.side {
            Side::Above => value > self.threshold,
            Side::Below => value < self.threshold,
        };
        if value.is_nan() { value } else { f64::from(u8::from(holds)) }
    }

    /// Returns the value of the flag if it is the same for all values of the number in `range`.
    fn foregone(&self, range: Range) -> Option<bool> {
        let Self { threshold, .. } = *self;
        match self.side {
            Side::Above if threshold < range.low() => Some(true),
            Side::Above if threshold >= range.high() => Some(false),
            Side::Below if threshold > range.high() => Some(true),
            Side::Below if threshold <= range.low() => Some(false),
            _ => None,
        }
    }
}

/// The value of one sample that is aggregated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Quantity {
    /// A measure of the arm under test.
    Tested(&'static Measure),
    /// A measure of the baseline.
    Baseline(&'static Measure),
    /// A flag of the pair.
    Pair(PairFlag),
    /// A number beyond a threshold.
    Compared(Comparison),
    /// A coverage item or cross, which is a value of all samples together.
    Covered(CoverageName),
}

impl Quantity {
    /// Returns true if the quantity is one of the baseline alone, and says nothing of the arm under
    /// test.
    pub const fn is_of_baseline(self) -> bool {
        match self {
            Self::Tested(_) | Self::Pair(_) | Self::Covered(_) => false,
            Self::Baseline(_) => true,
            Self::Compared(comparison) => comparison.in_baseline,
        }
    }

    /// Returns true if the quantity exists only in a paired campaign.
    pub const fn needs_pairs(self) -> bool {
        match self {
            Self::Tested(_) | Self::Covered(_) => false,
            Self::Baseline(_) | Self::Pair(_) => true,
            Self::Compared(comparison) => comparison.in_baseline,
        }
    }

    /// Returns the measure, and whether it is taken in the baseline; `None` for a flag of the pair.
    pub const fn measure(self) -> Option<(&'static Measure, bool)> {
        match self {
            Self::Tested(measure) => Some((measure, false)),
            Self::Baseline(measure) => Some((measure, true)),
            Self::Compared(Comparison { measure, in_baseline, .. }) => Some((measure, in_baseline)),
            Self::Pair(_) | Self::Covered(_) => None,
        }
    }

    /// Returns the comparison that decides the flag in every sample that has the number; `None` if
    /// there is none.
    pub(super) fn comparison(self) -> Option<Comparison> {
        if let Self::Compared(comparison) = self {
            return Some(comparison);
        }
        let (flag, in_baseline) = self.measure()?;
        let (number, threshold) = flag.exceeds()?;
        Some(Comparison { measure: Measure::named(number)?, in_baseline, side: Side::Above, threshold })
    }

    pub(super) fn is_flag(self) -> bool {
        match self {
            Self::Tested(measure) | Self::Baseline(measure) => measure.kind == MeasureKind::Flag,
            Self::Pair(_) | Self::Compared(_) => true,
            Self::Covered(_) => false,
        }
    }
}

/// The side of the bound on which the value must lie. The bound itself is allowed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operator {
    /// The value is at most the bound.
    AtMost,
    /// The value is at least the bound.
    AtLeast,
}

impl Operator {
    /// Returns whether a value satisfies the bound. A value that is not a number never does.
    pub fn holds(self, value: f64, bound: f64) -> bool {
        match self {
            Self::AtMost => value <= bound,
            Self::AtLeast => value >= bound,
        }
    }
}

/// A gate: an aggregate, and the bound that it must satisfy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expression {
    /// The aggregate that is computed.
    pub aggregate: Aggregate,
    /// The value of each sample that is aggregated.
    pub quantity: Quantity,
    /// Only samples in which this flag holds count.
    pub condition: Option<Quantity>,
    /// The side of the bound.
    pub operator: Operator,
    /// The bound.
    pub bound: f64,
}

impl Expression {
    /// Returns true if the gate can be judged in a paired campaign only.
    pub fn needs_pairs(&self) -> bool {
        self.quantity.needs_pairs() || self.condition.is_some_and(Quantity::needs_pairs)
    }

    /// Returns the arms whose own reports the gate judges: the baseline, and the arm under test.
    pub fn reported_by(&self) -> [bool; 2] {
        let quantities = || std::iter::once(self.quantity).chain(self.condition);
        let reports = |by_baseline: bool| {
            let reported = |quantity: Quantity| {
                quantity
                    .measure()
                    .is_some_and(|(measure, in_baseline)| in_baseline == by_baseline && measure.is_reported())
            };
            quantities().any(reported)
        };
        [reports(true), reports(false)]
    }

    /// Returns the first two gates that contradict each other: they bound the same value on the
    /// same side, with different bounds.
    pub fn contradiction(gates: &[Self]) -> Option<[Self; 2]> {
        gates.iter().enumerate().find_map(|(index, later)| {
            let is_other = |earlier: &&Self| {
                earlier.operator == later.operator
                    && earlier.bound != later.bound
                    && earlier.subject() == later.subject()
            };
            Some([*gates[..index].iter().find(is_other)?, *later])
        })
    }

    /// Returns true if the gate bounds the same value on the same side as `other`, and no less.
    pub fn is_as_strict_as(&self, other: &Self) -> bool {
        let is_bound_kept = match other.operator {
            Operator::AtMost => self.bound <= other.bound,
            Operator::AtLeast => self.bound >= other.bound,
        };
        self.bounds_as(other) && is_bound_kept
    }

    /// Returns true if the gate bounds the same value on the same side as `other`.
    pub fn bounds_as(&self, other: &Self) -> bool {
        self.operator == other.operator && self.subject() == other.subject()
    }

    /// Returns true if `samples` samples cannot miss the gate, whatever happens in them: it allows a
    /// count as large as their number, or a sum as large or as small as theirs. Bounds that no number
    /// of samples can miss are refused when the gate is read.
    pub fn holds_always(&self, samples: u64) -> bool {
        let range = match (self.aggregate, self.quantity.measure()) {
            (Aggregate::Count, _) => Range::UNIT,
            (Aggregate::Sum, Some((measure, in_baseline))) => range_where(measure, in_baseline, self.condition),
            _ => return false,
        };
        match self.operator {
            Operator::AtMost => self.bound >= range.high().max(0.0) * samples as f64,
            Operator::AtLeast => self.bound <= range.low().min(0.0) * samples as f64,
        }
    }

    /// Returns the range of the value that is bounded; `None` for a number without range.
    fn range(&self) -> Option<Range> {
        let of_number = || {
            let (measure, in_baseline) = self.quantity.measure()?;
            Some(range_where(measure, in_baseline, self.condition))
        };
        match self.aggregate {
            Aggregate::Count => Some(Range::closed(0.0, f64::INFINITY)),
            Aggregate::Share | Aggregate::Lower | Aggregate::Upper | Aggregate::Coverage => Some(Range::UNIT),
            Aggregate::Min | Aggregate::Max | Aggregate::Mean | Aggregate::Percentile(_) => of_number(),
            Aggregate::Sum => {
                let range = of_number()?;
                let low = if range.low() < 0.0 { f64::NEG_INFINITY } else { range.low() };
                let high = if range.high() > 0.0 { f64::INFINITY } else { range.high() };
                Some(Range::closed(low, high))
            }
        }
    }

    /// Returns why the gate says nothing, whatever happens in the samples; `None` if it says
    /// something.
    fn foregone(&self) -> Option<String> {
        let Self { aggregate, quantity, condition, operator, bound } = *self;
        for (flag, condition) in [condition.map(|flag| (flag, None)), Some((quantity, condition))].into_iter().flatten()
        {
            let Some(comparison) = flag.comparison() else { continue };
            let range = range_where(comparison.measure, comparison.in_baseline, condition);
            if let Some(holds) = comparison.foregone(range) {
                let when = if holds { "every sample" } else { "no sample" };
                return Some(format!("`{flag}` holds in {when}: `{}` is {range}", comparison.measure.name));
            }
        }
        if let Some((condition, holds)) = condition.and_then(|flag| Some((flag, implied::by(flag, quantity)?))) {
            let when = if holds { "every" } else { "no" };
            return Some(format!("`{quantity}` holds in {when} sample in which `{condition}` holds"));
        }
        let range = self.range()?;
        // With any number of samples, the bound of a share leaves room for others.
        let is_never_shown = matches!((aggregate, operator), (Aggregate::Upper, Operator::AtMost))
            && bound <= range.low()
            || matches!((aggregate, operator), (Aggregate::Lower, Operator::AtLeast)) && bound >= range.high();
        let (is_always_met, is_never_met) = match operator {
            Operator::AtMost => (bound >= range.high(), bound < range.low()),
            Operator::AtLeast => (bound <= range.low(), bound > range.high()),
        };
        let says = match (is_always_met, is_never_met || is_never_shown) {
            (true, _) => "no sample can miss it",
            (false, true) => "no samples can meet it",
            (false, false) => return None,
        };
        Some(match quantity.measure().filter(|_| !aggregate.is_of_flag()) {
            Some((measure, in_baseline)) => {
                format!("{says}: `{}` is {}", measure.name, range_where(measure, in_baseline, condition))
            }
            None if aggregate == Aggregate::Count => format!("{says}: a count is 0 or more"),
            None if is_never_shown => format!("{says}: a share is {range}, and samples show neither end"),
            None => format!("{says}: a share is {range}"),
        })
    }

    /// Returns the left-hand side, which identifies the judged quantity.
    pub fn subject(&self) -> String {
        let condition = self.condition.map_or_else(String::new, |condition| format!(" | {condition}"));
        format!("{}({}{condition})", self.aggregate, self.quantity)
    }
}

/// Returns the range of a number in the samples in which a condition holds.
fn range_where(measure: &Measure, in_baseline: bool, condition: Option<Quantity>) -> Range {
    let (low, high) = (measure.range.low(), measure.range.high());
    match condition.and_then(Quantity::comparison) {
        Some(Comparison { measure: of, in_baseline: arm, side, threshold }) if of == measure && arm == in_baseline => {
            match side {
                Side::Above => Range::closed(low.max(threshold), high),
                Side::Below => Range::closed(low, high.min(threshold)),
            }
        }
        _ => measure.range,
    }
}

/// Text that is not a gate.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{text}` is not a gate: {problem}")]
pub struct ExpressionError {
    /// The text.
    pub text: String,
    /// What is wrong, and what is allowed.
    pub problem: String,
}

impl FromStr for Expression {
    type Err = ExpressionError;

    fn from_str(text: &str) -> Result<Self, ExpressionError> {
        let problem = |problem| ExpressionError { text: text.to_owned(), problem };
        let expression = parse(text).map_err(problem)?;
        expression.foregone().map_or(Ok(expression), |reason| Err(problem(reason)))
    }
}

const FORM: &str = "it has the form `p99(min_ttc_rear_s) >= 1.0`, `count(ego_collided) <= 0` or `share(imposed_braking_mps2 > 3) <= 0.05`";

fn parse(text: &str) -> Result<Expression, String> {
    let (left, operator, right) = match (text.split_once("<="), text.split_once(">=")) {
        (Some((left, right)), None) => (left, Operator::AtMost, right),
        (None, Some((left, right))) => (left, Operator::AtLeast, right),
        _ => return Err(format!("it needs one `<=` or `>=`; {FORM}")),
    };
    let bound = match right.trim().parse::<f64>() {
        Ok(bound) if bound.is_finite() => bound,
        _ => return Err(format!("the bound `{}` is not a finite number", right.trim())),
    };
    let Some((aggregate, inside)) = left.trim().strip_suffix(')').and_then(|left| left.split_once('(')) else {
        return Err(FORM.to_owned());
    };
    let aggregate = parse_aggregate(aggregate.trim())?;
    if aggregate == Aggregate::Coverage {
        return parse_coverage(inside.trim(), operator, bound);
    }
    let (quantity, condition) = match inside.split_once('|') {
        Some((quantity, condition)) => (quantity, Some(parse_quantity(condition.trim())?)),
        None => (inside, None),
    };
    let quantity = parse_quantity(quantity.trim())?;
    if aggregate.is_of_flag() != quantity.is_flag() {
        let (kind, allowed) = if quantity.is_flag() {
            ("a flag", "count, share, lower and upper")
        } else {
            ("a number", "min, max, mean, sum and percentiles such as p99")
        };
        return Err(format!("`{quantity}` is {kind}, which has {allowed}"));
    }
    if let Some(condition) = condition.filter(|condition| !condition.is_flag()) {
        return Err(format!("the condition `{condition}` is not a flag; flags are {}", flag_names()));
    }
    Ok(Expression { aggregate, quantity, condition, operator, bound })
}

fn parse_coverage(name: &str, operator: Operator, bound: f64) -> Result<Expression, String> {
    let name: CoverageName = name.parse()?;
    if operator == Operator::AtMost {
        return Err(format!("coverage is asked for as `coverage({name}) >= SHARE`, with a share from 0 to 1"));
    }
    let (aggregate, quantity) = (Aggregate::Coverage, Quantity::Covered(name));
    Ok(Expression { aggregate, quantity, condition: None, operator, bound })
}

fn parse_aggregate(name: &str) -> Result<Aggregate, String> {
    Ok(match name {
        "count" => Aggregate::Count,
        "share" => Aggregate::Share,
        "lower" => Aggregate::Lower,
        "upper" => Aggregate::Upper,
        "min" => Aggregate::Min,
        "max" => Aggregate::Max,
        "mean" => Aggregate::Mean,
        "sum" => Aggregate::Sum,
        "coverage" => Aggregate::Coverage,
        _ => match name.strip_prefix('p').and_then(|percent| percent.parse::<f64>().ok()) {
            Some(percent) if (0.0..=100.0).contains(&percent) => Aggregate::Percentile(percent),
            _ => {
                let aggregates = "count, share, lower, upper, min, max, mean, sum, p0 to p100, and coverage";
                return Err(format!("`{name}` is not an aggregate; there are {aggregates}"));
            }
        },
    })
}

pub(super) fn parse_quantity(name: &str) -> Result<Quantity, String> {
    if let Some(at) = name.find(['>', '<']) {
        let (number, threshold) = (name[..at].trim(), name[at + 1..].trim());
        let side = if name[at..].starts_with('>') { Side::Above } else { Side::Below };
        return parse_comparison(number, side, threshold);
    }
    if let Some(flag) = PairFlag::named(name) {
        return Ok(Quantity::Pair(flag));
    }
    let (in_baseline, measure) = match name.strip_prefix("baseline.") {
        Some(measure) => (true, measure),
        None => (false, name),
    };
    match Measure::named(measure) {
        Some(measure) if in_baseline => Ok(Quantity::Baseline(measure)),
        Some(measure) => Ok(Quantity::Tested(measure)),
        None => Err(format!("`{name}` is not a measure; there are {}", measure_names())),
    }
}

fn parse_comparison(number: &str, side: Side, threshold: &str) -> Result<Quantity, String> {
    let quantity = parse_quantity(number)?;
    let Some((measure, in_baseline)) = quantity.measure().filter(|_| !quantity.is_flag()) else {
        return Err(format!("`{number}` is a flag, which has no threshold"));
    };
    match threshold.parse::<f64>() {
        Ok(threshold) if threshold.is_finite() => {
            Ok(Quantity::Compared(Comparison { measure, in_baseline, side, threshold }))
        }
        _ => Err(format!("the threshold `{threshold}` of `{number}` is not a finite number")),
    }
}

fn measure_names() -> String {
    let names = MEASURES.iter().map(|measure| measure.name);
    names.chain(PairFlag::ALL.map(PairFlag::name)).collect::<Vec<_>>().join(", ")
}

fn flag_names() -> String {
    let flags = MEASURES.iter().filter(|measure| measure.kind == MeasureKind::Flag).map(|measure| measure.name);
    flags.chain(PairFlag::ALL.map(PairFlag::name)).collect::<Vec<_>>().join(", ")
}

impl fmt::Display for Aggregate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Count => f.write_str("count"),
            Self::Share => f.write_str("share"),
            Self::Lower => f.write_str("lower"),
            Self::Upper => f.write_str("upper"),
            Self::Min => f.write_str("min"),
            Self::Max => f.write_str("max"),
            Self::Mean => f.write_str("mean"),
            Self::Sum => f.write_str("sum"),
            Self::Percentile(percent) => write!(f, "p{percent}"),
            Self::Coverage => f.write_str("coverage"),
        }
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tested(measure) => f.write_str(measure.name),
            Self::Baseline(measure) => write!(f, "baseline.{}", measure.name),
            Self::Pair(flag) => f.write_str(flag.name()),
            Self::Covered(name) => name.fmt(f),
            Self::Compared(Comparison { measure, in_baseline, side, threshold }) => {
                let arm = if *in_baseline { "baseline." } else { "" };
                let sign = if *side == Side::Above { '>' } else { '<' };
                write!(f, "{arm}{} {sign} {threshold}", measure.name)
            }
        }
    }
}

impl fmt::Display for Operator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::AtMost => "<=",
            Self::AtLeast => ">=",
        })
    }
}

impl fmt::Display for Expression {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {} {}", self.subject(), self.operator, self.bound)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gate_reads_back_as_it_is_written() {
        for text in [
            "count(ego_collided) <= 0",
            "p99(min_ttc_rear_s) >= 1",
            "p2.5(min_thw_rear_s) >= 0.2",
            "lower(prevented | baseline.ego_collided) >= 0.5",
            "upper(induced) <= 0.01",
            "max(baseline.max_jerk_mps3) <= 5.5",
            "mean(thw_gain_s | goal_in_reach) >= 1.9",
            "share(imposed_braking_mps2 > 3) <= 0.05",
            "upper(imposed_braking_mps2 > 3 | baseline.imposed_braking_mps2 < 3) <= 0.05",
            "count(min_ttc_rear_s < 0.5) <= 0",
            "coverage(closing-by-class) >= 0.95",
        ] {
            let expression: Expression = text.parse().unwrap();
            assert_eq!(expression.to_string(), text);
            assert_eq!(expression.to_string().parse::<Expression>(), Ok(expression));
        }
        let spaced: Expression = "  share( engaged|rear_near )>=0.9".parse().unwrap();
        assert_eq!(spaced.to_string(), "share(engaged | rear_near) >= 0.9");
    }

    #[test]
    fn a_number_beyond_a_threshold_is_a_flag_and_what_is_not_a_number_is_neither() {
        let expression: Expression = "share(baseline.imposed_braking_mps2 > 3) <= 0.05".parse().unwrap();
        assert!(expression.needs_pairs());
        let Quantity::Compared(comparison) = expression.quantity else { panic!("{:?}", expression.quantity) };
        assert_eq!([2.9, 3.0, 3.1].map(|value| comparison.of(value)), [0.0, 0.0, 1.0]);
        assert!(comparison.of(f64::NAN).is_nan());
        let below = Comparison { side: Side::Below, ..comparison };
        assert_eq!([2.9, 3.0, 3.1].map(|value| below.of(value)), [1.0, 0.0, 0.0]);
    }

    #[test]
    fn a_gate_that_no_sample_can_miss_or_that_no_samples_can_meet_is_refused() {
        let (always, never) = ("no sample can miss it", "no samples can meet it");
        for (text, part) in [
            ("count(ego_collided) >= 0", always),
            ("share(ego_collided) <= 1", always),
            ("share(ego_collided | rear_near) >= 0", always),
            ("upper(ego_collided) <= 1", always),
            ("lower(prevented | baseline.ego_collided) >= 0", always),
            ("coverage(closing-by-class) >= 0", always),
            ("max(max_jerk_mps3) <= 40", "no sample can miss it: `max_jerk_mps3` is a number from 0 to 40"),
            ("max(max_deceleration_mps2) <= 12", always),
            ("p95(max_speed_deficit_mps) <= 200", always),
            ("min(thw_gain_s) >= -1e300", always),
            ("mean(harm) >= 0", always),
            ("min(min_thw_rear_s) >= 0", "no sample can miss it: `min_thw_rear_s` is a number from 0 to 1000000"),
            ("p1(min_ttc_rear_s) >= 0", always),
            ("min(min_gap_rear_m) >= 0", always),
            ("max(crossing_braking_mps2) >= 0", always),
            ("p99(baseline.duration_s) >= 0", always),
            ("sum(harm) >= -1", always),
            ("mean(impact_speed_mps | impact_speed_mps > 3) >= 2", always),
            ("max(min_ttc_rear_s) <= 1e300", always),
            ("max(harm) <= -1", never),
            ("min(max_jerk_mps3) >= 41", never),
            ("sum(harm) <= -0.1", never),
            ("share(ego_collided) <= -0.5", never),
            ("share(engaged) >= 1.01", never),
            ("upper(induced) <= 0", "samples show neither end"),
            ("lower(engaged) >= 1", never),
            ("max(harm | harm > 0.5) <= 0.4", never),
            ("count(imposed_braking_mps2 < 0) <= 0", "holds in no sample: `imposed_braking_mps2` is a number from 0"),
            ("share(baseline.impact_speed_mps < 0) <= 0.5", "holds in no sample"),
            ("upper(min_ttc_rear_s < -1e9) <= 0.03", "holds in no sample"),
            ("share(harm > -1) <= 0.5", "holds in every sample"),
            ("count(ego_collided | min_gap_rear_m < 0) <= 0", "`min_gap_rear_m < 0` holds in no sample"),
            ("share(harm > 0.1 | harm > 0.5) >= 0.9", "holds in every sample"),
            (
                "share(harm > 0.1 | harm > 1e9) <= 0.5",
                "`harm > 1000000000` holds in no sample: `harm` is a number from 0",
            ),
            ("mean(harm | harm > 1e9) <= 0.5", "`harm > 1000000000` holds in no sample"),
            ("share(slowed_unprompted | unprompted_deficit_mps > 1) >= 0.9", "holds in every sample"),
            ("share(slowed_unprompted | unprompted_deficit_mps > 0.5) >= 0.9", "holds in every sample"),
            ("share(slowed_unprompted | unprompted_deficit_mps < 0.5) <= 0.1", "holds in no sample"),
            ("share(unprompted_deficit_mps > 0.3 | slowed_unprompted) >= 0.9", "holds in every sample"),
            ("min(crossing_braking_mps2 | braked_at_crossing) >= 1.5", always),
            ("share(lead_braked | hazard) >= 0.9", "holds in every sample in which `hazard` holds"),
            ("sum(thw_raised_s | thw_raised_s < 0) <= 0", "no sample can miss it: `thw_raised_s` is a number from"),
            ("sum(thw_raised_s | thw_raised_s < 0) >= 1", never),
            ("share(rear_passed | rear_passed) >= 0.9", "holds in every sample in which `rear_passed` holds"),
            ("share(ego_collided | ego_collided) <= 0.5", "holds in every sample"),
            (
                "count(induced | baseline.ego_collided) <= 0",
                "holds in no sample in which `baseline.ego_collided` holds",
            ),
            ("count(prevented | ego_strikes) <= 0", "holds in no sample"),
        ] {
            let error = text.parse::<Expression>().unwrap_err().to_string();
            assert!(error.contains(part), "{text}: {error}");
        }
        for text in [
            "count(ego_collided) <= 200",
            "count(ego_collided) >= 1",
            "share(ego_collided) <= 0.999",
            "share(engaged) >= 1",
            "share(ego_collided) <= 0",
            "lower(prevented | baseline.ego_collided) >= 0.001",
            "coverage(closing-by-class) >= 0.01",
            "coverage(closing-by-class) >= 1",
            "max(max_jerk_mps3) <= 39",
            "max(max_deceleration_mps2) <= 11",
            "min(min_gap_rear_m) >= 0.01",
            "p99(min_ttc_rear_s) >= 0.01",
            "mean(thw_gain_s) >= 0",
            "min(thw_raised_s) >= 0",
            "share(rear_passed | baseline.rear_passed) >= 1",
            "share(slowed_unprompted | unprompted_deficit_mps > 0.3) <= 0.5",
            "share(slowed_unprompted) <= 0.1",
            "sum(thw_raised_s | thw_raised_s < 0) >= -5",
            "sum(thw_raised_s | thw_raised_s < 1) <= 0",
            "sum(harm) <= 0.1",
            "mean(harm) <= 0",
            "max(delta_v_mps) <= 0",
            "count(harm > 0) <= 0",
            "upper(imposed_braking_mps2 > 3) <= 0.05",
            "mean(impact_speed_mps | impact_speed_mps > 3) >= 3.5",
            "mean(impact_speed_mps | baseline.impact_speed_mps > 3) >= 2",
        ] {
            assert!(text.parse::<Expression>().is_ok(), "{text}");
        }
    }

    #[test]
    fn a_count_or_a_sum_as_large_as_the_samples_can_have_is_always_met() {
        let holds_always = |text: &str| text.parse::<Expression>().unwrap().holds_always(200);
        assert!(holds_always("count(ego_collided) <= 200") && holds_always("count(ego_collided | engaged) <= 1e9"));
        assert!(!holds_always("count(ego_collided) <= 199") && !holds_always("count(engaged) >= 200"));
        assert!(!holds_always("share(ego_collided) <= 0.999"));
        assert!(holds_always("sum(max_jerk_mps3) <= 8000") && holds_always("sum(harm) <= 1e300"));
        assert!(!holds_always("sum(max_jerk_mps3) <= 7999") && !holds_always("sum(harm) <= 5"));
        assert!(holds_always("sum(thw_gain_s) >= -1e300") && holds_always("sum(thw_gain_s) >= -2e8"));
        assert!(!holds_always("sum(thw_gain_s) >= -1e8") && !holds_always("sum(thw_gain_s) >= 0"));
        assert!(holds_always("sum(max_jerk_mps3 | max_jerk_mps3 < 30) <= 6000"));
        assert!(!holds_always("sum(max_jerk_mps3 | max_jerk_mps3 < 30) <= 5999"));
        assert!(!holds_always("sum(max_jerk_mps3 | max_jerk_mps3 > 30) >= 6000"), "few samples have the condition");
    }

    #[test]
    fn a_stricter_gate_bounds_the_same_value_on_the_same_side() {
        let is_as_strict = |new: &str, old: &str| {
            new.parse::<Expression>().unwrap().is_as_strict_as(&old.parse::<Expression>().unwrap())
        };
        assert!(is_as_strict("count(ego_collided) <= 0", "count(ego_collided) <= 3"));
        assert!(is_as_strict("share(engaged) >= 0.5", "share(engaged) >= 0.5"));
        assert!(!is_as_strict("count(ego_collided) <= 4", "count(ego_collided) <= 3"));
        assert!(!is_as_strict("share(engaged) >= 0.4", "share(engaged) >= 0.5"));
        assert!(!is_as_strict("share(engaged) <= 0.5", "share(engaged) >= 0.5"));
        assert!(!is_as_strict("count(ego_collided | rear_near) <= 0", "count(ego_collided) <= 3"));
    }

    #[test]
    fn what_is_not_a_gate_is_refused_with_what_is_allowed() {
        for (text, part) in [
            ("", "one `<=` or `>="),
            ("count(ego_collided) < 1", "one `<=` or `>="),
            ("count(ego_collided) <= nan", "not a finite number"),
            ("count(ego_collided) <= inf", "not a finite number"),
            ("count(min_ttc_rear_s) <= 1", "is a number, which has"),
            ("p99(ego_collided) <= 1", "is a flag, which has"),
            ("count(ego_collided) <= -1", "no samples can meet it: a count is 0 or more"),
            ("p101(min_ttc_rear_s) <= 1", "not an aggregate"),
            ("pnan(min_ttc_rear_s) <= 1", "not an aggregate"),
            ("max(min_ttc) <= 1", "not a measure"),
            ("max(harm | harm) <= 1", "not a flag"),
            ("share(engaged) <= 1.5", "no sample can miss it: a share is a number from 0 to 1"),
            ("count ego_collided <= 1", "has the form"),
            ("share(ego_collided > 0) <= 0.1", "is a flag, which has no threshold"),
            ("share(induced > 0) <= 0.1", "is a flag, which has no threshold"),
            ("share(imposed_braking_mps2 > hard) <= 0.1", "is not a finite number"),
            ("share(imposed_braking_mps2 > 3 > 2) <= 0.1", "is not a finite number"),
            ("share(imposed_braking_mps2 >= 3) <= 0.1", "one `<=` or `>="),
            ("max(imposed_braking_mps2 > 3) <= 1", "is a flag, which has"),
            ("coverage(closing) <= 0.5", "`coverage(closing) >= SHARE`"),
            ("coverage(closing) >= 1.5", "no samples can meet it: a share is a number from 0 to 1"),
            ("coverage(Closing) >= 0.5", "not the name of a coverage item"),
            ("coverage(a | b) >= 0.5", "not the name of a coverage item"),
            ("min(closing-by-class) >= 0.5", "not a measure"),
        ] {
            let error = text.parse::<Expression>().unwrap_err().to_string();
            assert!(error.contains(part), "{text}: {error}");
        }
    }
}
