//! The verdict with its reasons, and the requirements.

use maud::{Markup, html};

use super::page::{number, number_heads, table, text_heads};
use crate::campaign::findings::Findings;
use closecall_campaign::gate::{Evaluation, Standing};
use closecall_campaign::verdict::Verdict;
use closecall_traffic::statistics::format::percent;

const fn verdict_class(verdict: Option<Verdict>) -> &'static str {
    match verdict {
        Some(Verdict::Pass) => "pass",
        Some(Verdict::Fail) => "fail",
        Some(Verdict::Inconclusive | Verdict::NotJudged | Verdict::Overridden) => "inconclusive",
        Some(Verdict::Invalid | Verdict::Error) => "invalid",
        None => "open",
    }
}

/// Returns the head of the page: the verdict, what was run, and the reasons.
pub(super) fn header(findings: &Findings<'_>) -> Markup {
    let (judged, sampling) = (findings.judged, findings.manifest.sampling);
    let samples = findings.summary.total().samples;
    html! {
        header.(verdict_class(judged.verdict())) {
            p.verdict { (judged.word()) }
            div {
                h1 { (findings.scenario_names()) }
                @if let Some(line) = headline(findings) { p.headline { (line) } }
                p.what {
                    (findings.summary.controllers.join(" against ")) ": "
                    (samples) @if samples == 1 { " sample, " } @else { " samples, " }
                    (sampling.design.to_string()) " design, seed " (sampling.seed)
                    @if let Some(part) = findings.manifest.partition { ", part " (part.to_string()) }
                }
                ul { @for reason in &judged.reasons { li { (reason) } } }
            }
        }
    }
}

/// Returns what the system under test changed, in one sentence. `None` if the campaign has no baseline.
fn headline(findings: &Findings<'_>) -> Option<String> {
    if !findings.summary.is_paired() {
        return None;
    }
    let pairs = findings.summary.total().pairs;
    let without = pairs.prevented + pairs.both;
    Some(format!(
        "{} of {without} collisions prevented, {} induced; harm prevented {:.3}, induced {:.3}",
        pairs.prevented, pairs.induced, pairs.prevented_harm, pairs.induced_harm
    ))
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

/// Returns the table of gates and requirement checks; empty if there is none.
pub(super) fn gates(findings: &Findings<'_>) -> Markup {
    let gates = &findings.judged.gates;
    if gates.is_empty() {
        return Markup::default();
    }
    let head = html! {
        (text_heads(&["scenario", "gate", "result"]))
        (number_heads(&["value", "share, 95 %", "samples"]))
        (text_heads(&["from"]))
    };
    let rows = html! {
        @for gate in gates {
            @let Evaluation { value, interval_95, samples, .. } = gate.evaluation;
            tr {
                td { (gate.scenario) }
                td { code { (gate.expression.to_string()) } }
                td { (badge(gate.standing())) }
                (number(value.map_or_else(|| "-".to_owned(), |value| format!("{value:.4}"))))
                (number(interval_95.map_or_else(String::new, |[low, high]| format!("{} to {}", percent(low), percent(high)))))
                (number(samples))
                td { (gate.source.to_string()) }
            }
        }
    };
    html! { h2 { "Gates" } (table(&head, &rows)) }
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
    html! { h2 { "Requirements" } (table(&head, &rows)) }
}
