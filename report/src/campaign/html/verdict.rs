//! The verdict, and the requirements.

use super::text::{Html, cell, element, escape, number};
use crate::campaign::findings::Findings;
use crate::campaign::requirements::Standing;
use closecall_campaign::verdict::Verdict;

fn class_of(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Pass => "pass",
        Verdict::Fail => "fail",
        Verdict::Inconclusive => "inconclusive",
        Verdict::Invalid => "invalid",
    }
}

pub(super) fn write(html: &mut Html, findings: &Findings<'_>) {
    let (judged, manifest) = (findings.judged, findings.manifest);
    let controllers = findings.summary.controllers.join(" against ");
    html.raw(&format!("<header class=\"{}\">", class_of(judged.verdict)));
    html.classed("p", "verdict", judged.verdict);
    html.raw("<div>");
    let names: Vec<&str> = findings.files.iter().map(|file| file.config().name.as_str()).collect();
    html.element("h1", names.join(", "));
    let sampling = manifest.sampling;
    let part = manifest.partition.map(|part| format!(", part {part}")).unwrap_or_default();
    let samples = findings.summary.total().samples;
    html.classed(
        "p",
        "what",
        format!(
            "{controllers}: {samples} {}, {} design, seed {}{part}",
            if samples == 1 { "sample" } else { "samples" },
            sampling.design,
            sampling.seed,
        ),
    );
    html.raw("<ul>");
    for reason in &judged.reasons {
        html.element("li", reason);
    }
    html.raw("</ul></div></header>");
}

fn standing_class(standing: Standing) -> &'static str {
    match standing {
        Standing::Pass => "pass",
        Standing::NotJudged => "open",
        Standing::Inconclusive => "inconclusive",
        Standing::Invalid => "invalid",
        Standing::Fail => "fail",
    }
}

pub(super) fn requirements(html: &mut Html, findings: &Findings<'_>) {
    if findings.requirements.is_empty() {
        return;
    }
    html.element("h2", "Requirements");
    html.table(&["requirement", "scenario", "#samples", "#collisions", "scenario's result", "result"]);
    for requirement in findings.requirements {
        let rows = requirement.evidence.len();
        for (place, evidence) in requirement.evidence.iter().enumerate() {
            let badge = |standing: Standing| {
                format!("<td>{}</td>", element("span", &format!("badge {}", standing_class(standing)), standing.word()))
            };
            let spanning = |cell: String| cell.replacen("<td", &format!("<td rowspan=\"{rows}\""), 1);
            let mut cells = Vec::new();
            if place == 0 {
                cells.push(spanning(format!("<td><strong>{}</strong></td>", escape(&requirement.mark))));
            }
            cells.push(cell(&evidence.scenario));
            cells.push(number(evidence.samples));
            cells.push(number(evidence.collisions));
            cells.push(badge(evidence.standing));
            if place == 0 {
                cells.push(spanning(badge(requirement.standing())));
            }
            html.row("", &cells);
        }
    }
    html.end_table();
}
