//! The verdict in words that a release manager can sign, and the gates in plain words, the worst
//! first.
//!
//! ```text
//!  FAIL: 2 of 14 scenarios miss a requirement: cut-in-into-margin (MIS-6), busy-overtake (MIS-1)
//!    NOT MET: cut-in-into-margin: MIS-6: …
//! ```
//!
//! The page, the summary and the terminal have the same words, and the same order of the gates.
//! Gates that are met and remarks on single scenarios are folded on the page and in the summary. On
//! the terminal, many are above it.

use closecall_campaign::gate::{Answer, Certainty, Evaluation, GateResult, GateSource, RequirementResult, Standing};
use closecall_campaign::probability::Finding;
use closecall_campaign::summary::Summary;
use closecall_campaign::verdict::{Decision, Judgement};
use closecall_scenarios::criteria::{Aggregate, Comparison, Operator, Quantity, Side};
use closecall_traffic::statistics::format::{DIGITS, percent, significant, without_trailing_zeros};
use closecall_traffic::words::counted;

use crate::units::unit_of;

/// Largest number of scenarios that a sentence names.
const NAMED: usize = 4;

/// What a sentence adds to a verdict that a system that does nothing gets as well.
const NO_BENEFIT: &str =
    "a system that does nothing passes as well, so that this shows only that the system does no harm";

/// Returns the verdict in one sentence. `scenarios` is the number of scenarios of the campaign.
pub(crate) fn sentence(judged: &Judgement, scenarios: usize) -> String {
    let word = judged.word();
    let because = |decided: Standing, verb: &str| {
        let names = scenarios_of(judged, decided);
        let mut listed: Vec<String> = names.iter().take(NAMED).map(|(name, marks)| named(name, marks)).collect();
        if names.len() > NAMED {
            listed.push(format!("and {} more", names.len() - NAMED));
        }
        let subject = if names.iter().all(|(_, marks)| !marks.is_empty()) { "a requirement" } else { "a gate" };
        (!listed.is_empty()).then(|| match names.len() {
            1 if scenarios == 1 => format!("{word}: the scenario {} {subject}: {}", singular(verb), listed.join(", ")),
            1 => format!("{word}: 1 of {scenarios} scenarios {} {subject}: {}", singular(verb), listed.join(", ")),
            count => format!("{word}: {count} of {scenarios} scenarios {verb} {subject}: {}", listed.join(", ")),
        })
    };
    let first_reason = || {
        let is_of_gate = |reason: &&String| judged.gates.iter().any(|gate| gate.to_string() == **reason);
        let told = |reason: &String| reason.strip_prefix(&format!("{word}: ")).unwrap_or(reason).to_owned();
        judged.reasons.iter().find(|reason| !is_of_gate(reason)).map(|reason| format!("{word}: {}", told(reason)))
    };
    let told = match judged.decision {
        Decision::Fail => because(Standing::Fail, "miss").or_else(first_reason),
        Decision::Inconclusive => because(Standing::Inconclusive, "do not decide").or_else(first_reason),
        Decision::Pass => {
            let of_probability = judged.probabilities.iter().map(|(_, finding)| finding.standing());
            let standings: Vec<Standing> =
                judged.gates.iter().map(GateResult::standing).chain(of_probability).collect();
            let met = standings.iter().filter(|standing| **standing == Standing::Pass).count();
            let all = if scenarios == 1 {
                "the scenario meets".to_owned()
            } else {
                format!("all {scenarios} scenarios meet")
            };
            let unchecked = standings.iter().filter(|standing| **standing == Standing::NotChecked).count();
            let has_criteria = |requirement: &&RequirementResult| {
                judged.gates.iter().any(|gate| gate.scenario == requirement.scenario && gate.is_of(&requirement.mark))
            };
            let without_criteria = judged.requirements.len() - judged.requirements.iter().filter(has_criteria).count();
            let rest = [
                (unchecked > 0).then(|| format!("{unchecked} not checked")),
                (without_criteria > 0)
                    .then(|| format!("{} without criteria", counted(without_criteria, "requirement"))),
            ];
            let rest: Vec<String> = rest.into_iter().flatten().collect();
            let met = match rest.is_empty() {
                true => format!("{word}: {all} what is required, {met} of {} gates", standings.len()),
                false => format!("{word}: {met} of {} gates are met, {}", standings.len(), rest.join(", ")),
            };
            Some(if judged.shows_no_benefit { format!("{met}; {NO_BENEFIT}") } else { met })
        }
        Decision::NotJudged | Decision::Overridden | Decision::SampleError | Decision::Invalid => first_reason(),
        Decision::Measured => None,
    };
    told.unwrap_or_else(|| word.to_owned())
}

/// Returns a verb as one scenario has it.
fn singular(verb: &str) -> String {
    if verb == "miss" { "misses".to_owned() } else { verb.replacen("do not", "does not", 1) }
}

/// Returns the scenarios with a gate of this standing, in the order of the gates, each with the
/// marks of its requirements.
fn scenarios_of(judged: &Judgement, standing: Standing) -> Vec<(String, Vec<String>)> {
    let mut names: Vec<(String, Vec<String>)> = Vec::new();
    for gate in worst_first(judged).into_iter().filter(|gate| gate.standing() == standing) {
        let name = gate.scenario.clone();
        let index = names.iter().position(|(scenario, _)| *scenario == name).unwrap_or_else(|| {
            names.push((name, Vec::new()));
            names.len() - 1
        });
        if let GateSource::Requirement(mark) = &gate.source
            && !names[index].1.contains(mark)
        {
            names[index].1.push(mark.clone());
        }
    }
    for (name, _) in judged.probabilities.iter().filter(|(_, finding)| finding.standing() == standing) {
        if !names.iter().any(|(scenario, _)| scenario == name) {
            names.push((name.clone(), Vec::new()));
        }
    }
    names
}

fn named(name: &str, marks: &[String]) -> String {
    if marks.is_empty() { name.to_owned() } else { format!("{name} ({})", marks.join(", ")) }
}

/// Returns the gates, first the gates that are not met. Of these, the gate that misses its bound by
/// the largest share comes first.
pub(crate) fn worst_first(judged: &Judgement) -> Vec<&GateResult> {
    let mut gates: Vec<&GateResult> = judged.gates.iter().collect();
    gates.sort_by(|a, b| b.standing().cmp(&a.standing()).then_with(|| missed_by(b).total_cmp(&missed_by(a))));
    gates
}

/// Smallest magnitude of a bound to which a distance is related.
const LEAST_BOUND: f64 = 0.001;

/// Returns the distance of the value from the bound, as a share of the bound; 0 if the bound is met
/// or there is no value.
fn missed_by(gate: &GateResult) -> f64 {
    let (Some(value), Answer::Missed) = (gate.evaluation.value, gate.evaluation.answer) else { return 0.0 };
    let bound = gate.expression.bound;
    (value - bound).abs() / bound.abs().max(LEAST_BOUND)
}

/// Returns a gate in one line for terminal and summary: standing, scenario, requirement, the value
/// and the required one, and the criterion.
pub(crate) fn gate_line(gate: &GateResult) -> String {
    let scenario = &gate.scenario;
    let mark = match &gate.source {
        GateSource::Requirement(mark) => format!("{mark}: "),
        _ => String::new(),
    };
    let source = match &gate.source {
        GateSource::Requirement(_) => String::new(),
        source => format!("; from {source}"),
    };
    format!("{}: {scenario}: {mark}{} [{}{source}]", gate.standing().word(), gate_words(gate), gate.expression)
}

/// Returns the line of a gate on the probability of a collision in a scenario, in the words of
/// every gate.
pub(crate) fn probability_line(scenario: &str, finding: &Finding, summary: &Summary) -> String {
    let words = summary.tested(scenario).map_or_else(String::new, |counts| finding.words(counts));
    format!("{}: {scenario}: {words} [{}]", finding.standing().word(), finding.criterion())
}

/// Returns the value of a gate and its required value, in plain words.
pub(crate) fn gate_words(gate: &GateResult) -> String {
    let expression = &gate.expression;
    let Evaluation { value, interval_95, certainty, samples, hits, .. } = gate.evaluation;
    let (subject, is_share) = subject(expression.aggregate, &expression.quantity);
    let condition =
        expression.condition.map_or_else(String::new, |condition| format!(", where {}", quantity_words(&condition)));
    let unit = match (&expression.quantity, is_share) {
        (Quantity::Tested(measure) | Quantity::Baseline(measure), false) if !expression.aggregate.is_of_flag() => {
            unit_of(measure.name)
        }
        _ => None,
    };
    let with_unit = |number: String| unit.map_or_else(|| number.clone(), |unit| format!("{number} {unit}"));
    let bound = if is_share { percent(expression.bound) } else { with_unit(number(expression.bound)) };
    let shown = |value: f64| match is_share {
        true => percent(value),
        false => with_unit(measured(value, expression.bound)),
    };
    let sides = match expression.operator {
        Operator::AtLeast => "at least",
        Operator::AtMost => "at most",
    };
    let share = || percent(hits as f64 / samples as f64);
    let interval = interval_95.map_or_else(String::new, |[low, high]| {
        format!(", two-sided 95 % interval {} to {}", percent(low), percent(high))
    });
    let of_samples = counted(samples, "sample");
    let is = match (expression.aggregate, value) {
        (_, None) => format!("has no value ({of_samples})"),
        (Aggregate::Lower, Some(value)) => {
            format!("{hits} of {samples} ({}), one-sided lower 95 % bound {}", share(), shown(value))
        }
        (Aggregate::Upper, Some(value)) => {
            format!("{hits} of {samples} ({}), one-sided upper 95 % bound {}", share(), shown(value))
        }
        (Aggregate::Share, Some(_)) => {
            format!("{hits} of {samples} ({}{interval}; the point estimate decides)", share())
        }
        (Aggregate::Count, Some(value)) if samples > 0 => {
            format!("{} ({of_samples}, share {}{interval}; the count decides)", shown(value), share())
        }
        (Aggregate::Count | Aggregate::Coverage, Some(value)) => format!("{} ({of_samples})", shown(value)),
        (Aggregate::Min, Some(value)) => {
            format!("{} (smallest of {of_samples}{})", shown(value), beyond(certainty, "below"))
        }
        (Aggregate::Max, Some(value)) => {
            format!("{} (largest of {of_samples}{})", shown(value), beyond(certainty, "above"))
        }
        (Aggregate::Mean, Some(value)) => {
            format!("{} (point estimate from {of_samples}, without a confidence bound)", shown(value))
        }
        (Aggregate::Sum, Some(value)) => {
            format!("{} (sum over {of_samples}, without a confidence bound)", shown(value))
        }
        (Aggregate::Percentile(_), Some(value)) => {
            let side = match expression.operator {
                Operator::AtLeast => "lower",
                Operator::AtMost => "upper",
            };
            let bound = match certainty {
                Some(Certainty::PercentileBound(bound)) => format!("one-sided {side} 95 % bound {}", shown(bound)),
                _ => "without a confidence bound".to_owned(),
            };
            format!("{} (point estimate from {of_samples}, {bound}; the point estimate decides)", shown(value))
        }
    };
    let open = gate.evaluation.undecided().map_or_else(String::new, |why| format!(" ({why})"));
    format!("{subject}{condition}: {is}{open}; required: {sides} {bound}")
}

/// Returns what the samples say beyond their extreme, as the end of its words. `side` is where the
/// values beyond it are.
fn beyond(certainty: Option<Certainty>, side: &str) -> String {
    match certainty {
        Some(Certainty::ShareBeyond(share)) => {
            format!("; with 95 % confidence, at most {} of such samples are {side} it", percent(share))
        }
        _ => ", which says nothing about others".to_owned(),
    }
}

/// Returns the judged quantity in words, and whether it is a share.
fn subject(aggregate: Aggregate, quantity: &Quantity) -> (String, bool) {
    let words = quantity_words(quantity);
    match aggregate {
        Aggregate::Count => (format!("number of samples in which {words}"), false),
        Aggregate::Share | Aggregate::Lower | Aggregate::Upper => {
            (format!("share of the samples in which {words}"), true)
        }
        Aggregate::Min => (format!("smallest value of the {words}"), false),
        Aggregate::Max => (format!("largest value of the {words}"), false),
        Aggregate::Mean => (format!("mean of the {words}"), false),
        Aggregate::Sum => (format!("sum of the {words}"), false),
        Aggregate::Percentile(percent) => (format!("{} percentile of the {words}", ordinal(percent)), false),
        Aggregate::Coverage => (format!("share of the bins of {words} that samples hit"), true),
    }
}

/// Returns a percentage as an ordinal number: *99th*, *2.5th*.
fn ordinal(percent: f64) -> String {
    let ending = match (percent % 10.0, (percent % 100.0 / 10.0).floor()) {
        (_, 1.0) => "th",
        (1.0, _) => "st",
        (2.0, _) => "nd",
        (3.0, _) => "rd",
        _ => "th",
    };
    format!("{percent}{ending}")
}

fn quantity_words(quantity: &Quantity) -> String {
    match quantity {
        Quantity::Tested(measure) => measure.meaning.to_owned(),
        Quantity::Baseline(measure) => format!("{} in the baseline", measure.meaning),
        Quantity::Pair(flag) => format!("a collision is {}", flag.name()),
        Quantity::Covered(name) => name.to_string(),
        Quantity::Compared(Comparison { measure, in_baseline, side, threshold }) => {
            let arm = if *in_baseline { " in the baseline" } else { "" };
            let side = if *side == Side::Above { "above" } else { "below" };
            let unit = unit_of(measure.name).map_or_else(String::new, |unit| format!(" {unit}"));
            format!("the {}{arm} is {side} {}{unit}", measure.meaning, number(*threshold))
        }
    }
}

/// Most significant digits of a measured value (-): as many as an `f64` in a table of results has.
const MOST_DIGITS: i32 = 9;

/// Returns a measured value with three significant digits, or with as many as tell it from the
/// bound: 10.004 beside 10.
fn measured(value: f64, bound: f64) -> String {
    let is_told = |text: &String| value.total_cmp(&bound).is_eq() || *text != significant(bound, MOST_DIGITS);
    let mut texts = (DIGITS..=MOST_DIGITS).map(|digits| significant(value, digits));
    texts.find(is_told).unwrap_or_else(|| value.to_string())
}

/// Returns a number with as many digits as tell it apart, and no more than four.
fn number(value: f64) -> String {
    without_trailing_zeros(&format!("{value:.4}"))
}

/// Returns the reasons of a verdict in the order in which they are read: reasons that are not met
/// or open, further remarks, and met ones. If errors or findings decide, they come first. Gates are
/// in plain words.
pub(crate) fn reasons(judged: &Judgement) -> Vec<String> {
    let texts: Vec<String> = judged.gates.iter().map(ToString::to_string).collect();
    let others = judged.reasons.iter().filter(|reason| !texts.contains(reason)).cloned();
    let lines = |is_met: bool| {
        let gates = worst_first(judged).into_iter();
        gates.filter(move |gate| (gate.standing() <= Standing::NotChecked) == is_met).map(gate_line)
    };
    match judged.decision {
        Decision::SampleError | Decision::Invalid => others.chain(lines(false)).chain(lines(true)).collect(),
        _ => lines(false).chain(others).chain(lines(true)).collect(),
    }
}

/// Returns true if a reason is what the sentence of the verdict says.
pub(crate) fn is_said(judged: &Judgement, sentence: &str, reason: &str) -> bool {
    let told = sentence.strip_prefix(judged.word()).and_then(|rest| rest.strip_prefix(": "));
    sentence == reason || told == Some(reason)
}

/// The reasons of a verdict without the one that its sentence says.
#[derive(Debug)]
pub(crate) struct Reasons {
    /// Gates that are not met or open, the worst first, and remarks on the whole campaign.
    pub(crate) weighty: Vec<String>,
    /// Gates that are met or not checked, and remarks on one scenario each.
    pub(crate) settled: Vec<String>,
}

impl Reasons {
    /// Returns the reasons below the sentence of a verdict.
    pub(crate) fn below(judged: &Judgement, sentence: &str) -> Self {
        let is_met = |gate: &&GateResult| gate.standing() <= Standing::NotChecked;
        let met: Vec<String> = judged.gates.iter().filter(is_met).map(gate_line).collect();
        let is_settled = |reason: &String| judged.background.contains(reason) || met.contains(reason);
        let below = reasons(judged).into_iter().filter(|reason| !is_said(judged, sentence, reason));
        let (settled, weighty) = below.partition(is_settled);
        Self { weighty, settled }
    }
}

/// Smallest p value that is written without a power of ten.
const LEAST_PLAIN_P: f64 = 0.001;

/// Returns a p value: as a power of ten only if it is tiny.
pub(crate) fn p_text(p: f64) -> String {
    if p < LEAST_PLAIN_P { format!("{p:.2e}") } else { significant(p, DIGITS) }
}

#[cfg(test)]
mod tests {
    use closecall_campaign::gate::OpenReason;
    use closecall_campaign::ledger::{ArmCounts, Inference};
    use closecall_campaign::probability::ProbabilityGate;

    use super::*;

    #[test]
    fn a_p_value_is_a_plain_number_unless_it_is_tiny() {
        let texts = [1.0, 0.625, 0.0421, 0.001, 8.31e-37].map(p_text);
        assert_eq!(texts, ["1", "0.625", "0.0421", "0.001", "8.31e-37"]);
    }

    fn gate(scenario: &str, text: &str, mark: Option<&str>, value: f64, answer: Answer) -> GateResult {
        GateResult {
            scenario: scenario.to_owned(),
            expression: text.parse().unwrap(),
            source: mark.map_or(GateSource::CommandLine, |mark| GateSource::Requirement(mark.to_owned())),
            evaluation: Evaluation {
                value: Some(value),
                interval_95: Some([0.2, 0.4]),
                certainty: None,
                samples: 60,
                hits: 18,
                answer,
                needed: None,
            },
        }
    }

    fn judged(decision: Decision, gates: Vec<GateResult>) -> Judgement {
        Judgement {
            decision,
            reasons: gates.iter().map(ToString::to_string).chain(["a note".to_owned()]).collect(),
            background: Vec::new(),
            gates,
            requirements: Vec::new(),
            expectations: Vec::new(),
            probabilities: Vec::new(),
            coverage: Vec::new(),
            flaky: None,
            shows_no_benefit: false,
        }
    }

    #[test]
    fn the_sentence_names_the_scenarios_that_miss_a_requirement_the_worst_first() {
        let gates = vec![
            gate("a", "lower(prevented | baseline.ego_collided) >= 0.5", Some("MIS-1"), 0.45, Answer::Missed),
            gate("b", "upper(induced) <= 0.03", Some("MIS-2"), 0.02, Answer::Met),
            gate("c", "lower(prevented | baseline.ego_collided) >= 0.5", Some("MIS-1"), 0.05, Answer::Missed),
        ];
        let judgement = judged(Decision::Fail, gates);
        assert_eq!(sentence(&judgement, 14), "FAIL: 2 of 14 scenarios miss a requirement: c (MIS-1), a (MIS-1)");
        let lines = reasons(&judgement);
        assert!(lines[0].starts_with("NOT MET: c: MIS-1: share of the samples in which a collision is prevented, where the ego collides in the baseline: 18 of 60 (30 %), one-sided lower 95 % bound 5"), "{lines:?}");
        assert!(
            lines[0].contains("required: at least 50")
                && lines[0].ends_with("[lower(prevented | baseline.ego_collided) >= 0.5]"),
            "{lines:?}"
        );
        assert_eq!(lines[2], "a note");
        assert!(
            lines[3].starts_with("met: b: MIS-2: share of the samples in which a collision is induced: 18 of 60 (30 %), one-sided upper 95 % bound 2 %; required: at most 3 %"),
            "{lines:?}"
        );
    }

    #[test]
    fn causes_of_errors_come_before_open_gates_and_no_sentence_stands_twice() {
        let open = gate("a", "upper(induced) <= 0.03", None, 0.9, Answer::Open(OpenReason::TooFewSamples));
        let mut judgement = judged(Decision::SampleError, vec![open]);
        let told = ["2 samples ended in an error", "a: 2 × exec (controller), first in sample 0: no such file"];
        judgement.reasons.splice(0..0, told.map(str::to_owned));
        let headline = sentence(&judgement, 1);
        assert_eq!(headline, "ERROR: 2 samples ended in an error");
        assert_eq!(reasons(&judgement)[..2], told);
        let below = Reasons::below(&judgement, &headline).weighty;
        assert_eq!((below[0].as_str(), below[1].as_str()), (told[1], "a note"));
        assert!(below[2].starts_with("open: a: "), "{below:?}");
        judgement.decision = Decision::Overridden;
        judgement.reasons = vec!["OVERRIDDEN: a: a setting".to_owned()];
        let below = Reasons::below(&judgement, &sentence(&judgement, 1));
        assert_eq!((below.weighty.len(), below.settled.len()), (1, 0), "only the gate is left");
    }

    #[test]
    fn what_decides_nothing_about_single_scenarios_is_apart_from_what_a_reader_has_to_know() {
        let gates = vec![
            gate("a", "upper(induced) <= 0.03", Some("MIS-2"), 0.02, Answer::Met),
            gate("b", "count(ego_collided) <= 0", Some("MIS-3"), 2.0, Answer::Missed),
        ];
        let mut judgement = judged(Decision::Fail, gates);
        let expected = "happened as expected: a: lead_braked in 30 of 30 samples".to_owned();
        judgement.reasons.push(expected.clone());
        judgement.background.push(expected.clone());
        let Reasons { weighty, settled } = Reasons::below(&judgement, &sentence(&judgement, 2));
        assert!(weighty[0].starts_with("NOT MET: b: MIS-3: ") && weighty[1..] == ["a note"], "{weighty:?}");
        assert!(settled[0] == expected && settled[1].starts_with("met: a: MIS-2: "), "{settled:?}");
        assert_eq!(settled.len(), 2);
    }

    #[test]
    fn the_sentence_of_many_scenarios_names_a_few() {
        let missed = |index: usize| gate(&format!("s{index}"), "count(ego_collided) <= 0", None, 2.0, Answer::Missed);
        let judgement = judged(Decision::Fail, (0..60).map(missed).collect());
        let text = sentence(&judgement, 104);
        assert_eq!(text, "FAIL: 60 of 104 scenarios miss a gate: s0, s1, s2, s3, and 56 more");
        let four = judged(Decision::Fail, (0..4).map(missed).collect());
        assert!(sentence(&four, 6).ends_with(": s0, s1, s2, s3"), "{}", sentence(&four, 6));
    }

    #[test]
    fn a_gate_on_the_probability_is_a_gate_of_the_sentence() {
        let gate = ProbabilityGate::new(0.01, 0.95).unwrap();
        let counts = |collisions| ArmCounts { outcomes: 300, collisions, ..ArmCounts::default() };
        for (collisions, decision, expected) in [
            (0, Decision::Pass, "PASS: the scenario meets what is required, 1 of 1 gates"),
            (1, Decision::Inconclusive, "INCONCLUSIVE: the scenario does not decide a gate: a"),
            (30, Decision::Fail, "FAIL: the scenario misses a gate: a"),
        ] {
            let mut judgement = judged(decision, Vec::new());
            let finding = gate.judge(&counts(collisions), 1, Inference::FixedSamples);
            judgement.probabilities = vec![("a".to_owned(), finding)];
            assert_eq!(sentence(&judgement, 1), expected);
        }
    }

    #[test]
    fn a_measured_value_has_three_digits_unless_they_hide_that_it_misses_its_bound() {
        let jerk = gate("a", "max(max_jerk_mps3) <= 10", None, 31.0825, Answer::Missed);
        assert!(gate_words(&jerk).contains(": 31.1 m/s³ (largest of 60 samples"), "{}", gate_words(&jerk));
        let texts = [(10.004, 10.0), (9.9996, 10.0), (10.0, 10.0), (0.123_456, 1.0)]
            .map(|(value, bound)| measured(value, bound));
        assert_eq!(texts, ["10.004", "9.9996", "10", "0.123"]);
    }

    #[test]
    fn every_aggregate_says_how_sure_its_value_is() {
        let words = |text: &str, certainty: Option<Certainty>| {
            let mut gate = gate("a", text, None, 18.0, Answer::Met);
            gate.evaluation.certainty = certainty;
            let words = gate_words(&gate);
            let measured = words.split_once(": 18").map_or("", |(_, rest)| rest).split("; required").next();
            measured.unwrap_or_default().to_owned()
        };
        let share = Some(Certainty::ShareBeyond(0.0487));
        for (text, certainty, expected) in [
            (
                "count(ego_collided) <= 20",
                None,
                " (60 samples, share 30 %, two-sided 95 % interval 20 % to 40 %; the count decides)",
            ),
            (
                "share(ego_collided) <= 0.5",
                None,
                " of 60 (30 %, two-sided 95 % interval 20 % to 40 %; the point estimate decides)",
            ),
            (
                "max(max_jerk_mps3) <= 20",
                share,
                " m/s³ (largest of 60 samples; with 95 % confidence, at most 4.87 % of such samples are above it)",
            ),
            (
                "min(min_ttc_rear_s) >= 1",
                share,
                " s (smallest of 60 samples; with 95 % confidence, at most 4.87 % of such samples are below it)",
            ),
            ("max(max_jerk_mps3) <= 20", None, " m/s³ (largest of 60 samples, which says nothing about others)"),
            ("mean(min_ttc_rear_s) >= 1", None, " s (point estimate from 60 samples, without a confidence bound)"),
            ("sum(max_jerk_mps3) <= 20", None, " m/s³ (sum over 60 samples, without a confidence bound)"),
            (
                "p5(min_ttc_rear_s) >= 1",
                Some(Certainty::PercentileBound(12.5)),
                " s (point estimate from 60 samples, one-sided lower 95 % bound 12.5 s; the point estimate decides)",
            ),
            (
                "p95(max_jerk_mps3) <= 20",
                Some(Certainty::PercentileBound(19.5)),
                " m/s³ (point estimate from 60 samples, one-sided upper 95 % bound 19.5 m/s³; the point estimate decides)",
            ),
        ] {
            assert_eq!(words(text, certainty), expected, "{text}");
        }
    }

    #[test]
    fn percentiles_are_ordinal_numbers() {
        let words = [1.0, 2.0, 3.0, 11.0, 22.0, 50.0, 99.0, 99.5].map(ordinal);
        assert_eq!(words, ["1st", "2nd", "3rd", "11th", "22nd", "50th", "99th", "99.5th"]);
    }

    #[test]
    fn what_is_open_or_met_is_said_so() {
        let open = Answer::Open(OpenReason::TooFewSamples);
        let judgement = judged(Decision::Inconclusive, vec![gate("a", "p1(min_ttc_rear_s) >= 1", None, 0.9, open)]);
        assert_eq!(sentence(&judgement, 1), "INCONCLUSIVE: the scenario does not decide a gate: a");
        let words = gate_words(&judgement.gates[0]);
        assert_eq!(
            words,
            "1st percentile of the smallest time to collision of the rear vehicle: 0.9 s (point estimate from 60 samples, without a \
             confidence bound; the point estimate decides) (too few samples to decide, and no number would if they are like these); required: at least 1 s"
        );
        let met = judged(Decision::Pass, vec![gate("a", "count(ego_collided) <= 0", None, 0.0, Answer::Met)]);
        assert_eq!(sentence(&met, 1), "PASS: the scenario meets what is required, 1 of 1 gates");
        let harmless = Judgement { shows_no_benefit: true, ..met };
        assert_eq!(
            sentence(&harmless, 1),
            "PASS: the scenario meets what is required, 1 of 1 gates; a system that does nothing passes as well, so that this shows only \
             that the system does no harm"
        );
    }
}
