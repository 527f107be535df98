//! The verdict with its reasons, and the requirements.

use maud::{Markup, html};

use super::page::{number, number_heads, table, text_heads};
use crate::campaign::findings::Findings;
use crate::campaign::requirements::Status;
use closecall_campaign::verdict::Verdict;

const fn verdict_class(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Pass => "pass",
        Verdict::Fail => "fail",
        Verdict::Inconclusive => "inconclusive",
        Verdict::Invalid => "invalid",
    }
}

/// Returns the head of the page: the verdict, what was run, and the reasons.
pub(super) fn header(findings: &Findings<'_>) -> Markup {
    let (judged, sampling) = (findings.judged, findings.manifest.sampling);
    let samples = findings.summary.total().samples;
    html! {
        header.(verdict_class(judged.verdict)) {
            p.verdict { (judged.verdict.to_string()) }
            div {
                h1 { (findings.scenario_names()) }
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

const fn status_class(status: Status) -> &'static str {
    match status {
        Status::Pass => "pass",
        Status::NotJudged => "open",
        Status::Inconclusive => "inconclusive",
        Status::Invalid => "invalid",
        Status::Fail => "fail",
    }
}

fn badge(status: Status) -> Markup {
    html! { span.badge.(status_class(status)) { (status.word()) } }
}

/// Returns the table of requirements; empty if the scenarios name none.
pub(super) fn requirements(findings: &Findings<'_>) -> Markup {
    if findings.requirements.is_empty() {
        return Markup::default();
    }
    let head = html! {
        (text_heads(&["requirement", "scenario"]))
        (number_heads(&["samples", "collisions"]))
        (text_heads(&["scenario's result", "result"]))
    };
    let rows = html! {
        @for requirement in findings.requirements {
            @let evidence_count = requirement.evidence.len();
            @for (index, evidence) in requirement.evidence.iter().enumerate() {
                tr {
                    @if index == 0 { td rowspan=(evidence_count) { strong { (requirement.id) } } }
                    td { (evidence.scenario) }
                    (number(evidence.samples))
                    (number(evidence.collisions))
                    td { (badge(evidence.status)) }
                    @if index == 0 { td rowspan=(evidence_count) { (badge(requirement.status())) } }
                }
            }
        }
    };
    html! { h2 { "Requirements" } (table(&head, &rows)) }
}
