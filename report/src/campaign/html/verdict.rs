//! The verdict with its reasons, and the requirements.

use std::cmp::Reverse;

use maud::{Markup, html};

use super::page::{breakable, table, text_heads};
use crate::campaign::findings::Findings;
use crate::campaign::words::{gate_words, is_said, sentence, worst_first};
use closecall_campaign::gate::{GateResult, Standing};
use closecall_campaign::probability::Finding;
use closecall_campaign::verdict::Verdict;
use closecall_scenarios::causal::LETTERS;
use closecall_traffic::words::counted;

const fn verdict_class(verdict: Option<Verdict>) -> &'static str {
    match verdict {
        Some(Verdict::Pass) => "pass",
        Some(Verdict::Fail) => "fail",
        Some(Verdict::Inconclusive | Verdict::NotJudged | Verdict::Overridden) => "inconclusive",
        Some(Verdict::Invalid | Verdict::Error) => "invalid",
        None => "open",
    }
}

/// Largest number of gates that are not met in the head of the page. The table below it has all.
const STATED: usize = 3;
/// Largest number of lines below the sentence in the head of the page. Further remarks are folded.
const REMARKS: usize = 6;
/// Largest numbers of gates of the first table that are not met, and that are undecided beside them
/// or alone. The others are folded. With these, a printed page has the verdict and the first gates.
const MISSED: usize = 24;
const UNDECIDED_BESIDE: usize = 6;
const UNDECIDED_ALONE: usize = 12;

/// Returns the head of the page: the verdict in one sentence, the extent of the campaign, further
/// remarks, and the fields for a signature.
pub(super) fn header(findings: &Findings<'_>) -> Markup {
    let (judged, sampling) = (findings.judged, findings.manifest.sampling);
    let samples = findings.summary.total().samples;
    let gates: Vec<String> = judged.gates.iter().map(ToString::to_string).collect();
    let sentence = sentence(judged, findings.files.len());
    let is_below = |reason: &&String| {
        !gates.contains(reason) && !judged.background.contains(reason) && !is_said(judged, &sentence, reason)
    };
    let remarks: Vec<&String> = judged.reasons.iter().filter(is_below).collect();
    let is_missed = |gate: &&GateResult| gate.standing() == Standing::Fail;
    let missed: Vec<&GateResult> = worst_first(judged).into_iter().filter(is_missed).take(STATED).collect();
    let (shown, more) = remarks.split_at(remarks.len().min(REMARKS - missed.len()));
    html! {
        header.(verdict_class(judged.verdict())) {
            p.verdict { (judged.word()) }
            div {
                h1 { (sentence) }
                @if !missed.is_empty() {
                    ul { @for gate in missed { li.failure { "NOT MET: " (gate.scenario) ": " (gate_words(gate)) } } }
                }
                p.headline { (headline(findings)) }
                p.what {
                    (findings.scenarios_title()) ": " (findings.summary.controllers.join(" against ")) ", "
                    (counted(samples, "sample")) ", "
                    (sampling.design.to_string()) " design, seed " (sampling.seed)
                    @if let Some(part) = findings.manifest.partition { ", part " (part.to_string()) }
                }
                p.what { (LETTERS) "." }
                @if !findings.names_each() {
                    details { summary { "Names of the scenarios" } p.note { (findings.scenario_names()) } }
                }
                @if !shown.is_empty() { ul { @for reason in shown { li { (reason) } } } }
                @if !more.is_empty() {
                    details { summary { (counted(more.len(), "more remark")) } ul { @for reason in more { li { (reason) } } } }
                }
                p.signature { span { "Reviewed by" } span { "Date" } span { "Signature" } }
            }
        }
    }
}

/// Returns the counts in one sentence: the changes by the system under test, or the collisions if
/// the campaign has no baseline.
fn headline(findings: &Findings<'_>) -> String {
    let total = findings.summary.total();
    let outcomes = total.arms.last().map_or(0, |arm| arm.outcomes);
    if outcomes == 0 {
        return "no sample has an outcome".to_owned();
    }
    if !findings.summary.is_paired() {
        let collisions = total.arms.first().map_or(0, |arm| arm.collisions);
        return format!("the ego collides in {collisions} of {}", counted(outcomes, "sample"));
    }
    let pairs = total.pairs;
    let without = pairs.prevented + pairs.both;
    format!(
        "{} of {without} collisions prevented, {} induced; harm prevented {:.3}, induced {:.3}",
        pairs.prevented, pairs.induced, pairs.prevented_harm, pairs.induced_harm
    )
}

const fn standing_class(standing: Standing) -> &'static str {
    match standing {
        Standing::Pass => "pass",
        Standing::NotChecked => "open",
        Standing::Inconclusive => "inconclusive",
        Standing::Fail => "fail",
    }
}

fn badge(standing: Standing) -> Markup {
    html! { span.badge.(standing_class(standing)) { (standing.word()) } }
}

/// A row of the table of gates.
struct GateRow<'a> {
    standing: Standing,
    scenario: &'a str,
    source: String,
    words: String,
    criterion: String,
}

/// Returns a row for each gate, each check of a requirement, and each gate on the probability of a
/// collision, the worst first.
fn gate_rows<'a>(findings: &Findings<'a>) -> Vec<GateRow<'a>> {
    let of_gate = |gate: &'a GateResult| GateRow {
        standing: gate.standing(),
        scenario: &gate.scenario,
        source: gate.source.to_string(),
        words: gate_words(gate),
        criterion: gate.expression.to_string(),
    };
    let of_probability = |(scenario, finding): &'a (String, Finding)| GateRow {
        standing: finding.standing(),
        scenario,
        source: "-".to_owned(),
        words: findings.summary.tested(scenario).map_or_else(String::new, |counts| finding.words(counts)),
        criterion: finding.criterion(),
    };
    let gates = worst_first(findings.judged).into_iter().map(of_gate);
    let mut rows: Vec<GateRow<'a>> = gates.chain(findings.judged.probabilities.iter().map(of_probability)).collect();
    rows.sort_by_key(|row| Reverse(row.standing));
    rows
}

/// Returns the gates and requirement checks in plain words, the worst first. Met ones are folded.
/// Empty if there is none.
pub(super) fn gates(findings: &Findings<'_>) -> Markup {
    let gates = gate_rows(findings);
    if gates.is_empty() {
        return Markup::default();
    }
    let with = |standing: Standing| gates.iter().filter(move |gate| gate.standing == standing);
    let (missed, undecided) = (with(Standing::Fail).count(), with(Standing::Inconclusive).count());
    let most_undecided = if missed == 0 { UNDECIDED_ALONE } else { UNDECIDED_BESIDE };
    let first: Vec<&GateRow<'_>> =
        with(Standing::Fail).take(MISSED).chain(with(Standing::Inconclusive).take(most_undecided)).collect();
    let others: Vec<&GateRow<'_>> =
        with(Standing::Fail).skip(MISSED).chain(with(Standing::Inconclusive).skip(most_undecided)).collect();
    let met: Vec<&GateRow<'_>> = gates.iter().filter(|gate| gate.standing <= Standing::NotChecked).collect();
    let of_others = format!(
        "further gates: {} not met, {} undecided",
        missed.saturating_sub(MISSED),
        undecided.saturating_sub(most_undecided)
    );
    let unchecked = met.iter().filter(|gate| gate.standing == Standing::NotChecked).count();
    let counted = match unchecked {
        0 => format!("{} of {} gates are met", met.len(), gates.len()),
        _ => format!("{} of {} gates are met, {unchecked} not checked", met.len() - unchecked, gates.len()),
    };
    html! {
        h2 { "Gates" }
        @if !first.is_empty() { (gate_table(&first)) }
        @if !others.is_empty() {
            p.paper { (of_others) "; report.html has them on the screen." }
            details { summary { (of_others) } (gate_table(&others)) }
        }
        @if met.is_empty() { p { (counted) } } @else {
            p.paper { (counted) "." }
            details { summary { (counted) } (gate_table(&met)) }
        }
    }
}

fn gate_table(gates: &[&GateRow<'_>]) -> Markup {
    let head = text_heads(&["result", "scenario", "from", "found and required", "criterion"]);
    let rows = html! {
        @for gate in gates {
            tr {
                td { (badge(gate.standing)) }
                td { (gate.scenario) }
                td { (gate.source) }
                td { (gate.words) }
                td { code { (breakable(&gate.criterion)) } }
            }
        }
    };
    html! { div.gates { (table(&head, &rows)) } }
}

/// Returns the remarks on single scenarios, folded. Empty if there is none.
pub(super) fn background(findings: &Findings<'_>) -> Markup {
    let remarks = &findings.judged.background;
    if remarks.is_empty() {
        return Markup::default();
    }
    html! {
        details {
            summary { (counted(remarks.len(), "remark")) " on single scenarios: what happened as expected, what extrapolates" }
            ul { @for remark in remarks { li { (remark) } } }
        }
    }
}

/// Returns the table of requirements; empty if the scenarios name none.
pub(super) fn requirements(findings: &Findings<'_>) -> Markup {
    let requirements = &findings.judged.requirements;
    if requirements.is_empty() {
        return Markup::default();
    }
    let head = text_heads(&["requirement", "scenario", "result"]);
    let rows = html! {
        @for requirement in requirements {
            tr {
                td { strong { (requirement.mark) } }
                td { (requirement.scenario) }
                td { (badge(requirement.standing)) }
            }
        }
    };
    html! { details { summary { "Requirements" } h2 { "Requirements" } (table(&head, &rows)) } }
}
