//! Single samples: the worst, those in error, and the slowest.

use closecall_traffic::{Measured, Value};

use super::text::{Html, cell, element, escape, markup, number};
use crate::campaign::findings::Findings;
use crate::campaign::overview::{Axis, ScenarioOverview, WorstSample};
use crate::units::labelled;
use closecall_simulation::outcome::Phase;

/// The worst samples of a scenario.
pub(super) fn worst(html: &mut Html, findings: &Findings<'_>, scenario: &ScenarioOverview) {
    html.element("h3", "Worst samples");
    html.classed(
        "p",
        "note",
        "Induced collisions first, then the other ones, each by E's change of velocity; then the narrowest escapes, by the \
         smallest time to collision with the vehicle behind. To run one again, within this folder:",
    );
    if let Some(first) = scenario.worst.first() {
        html.raw(&format!("<pre>{}</pre>", escape(&findings.replay(&scenario.name, first.sample))));
    }
    let told: Vec<&Axis> =
        scenario.map().map_or_else(Vec::new, |pair| pair.axes.map(|place| &scenario.axes[place]).to_vec());
    let mut columns: Vec<String> =
        ["#sample", "what became of it", "#E's ΔV [m/s]", "with", "phase", "#rear TTC [s]", "#rear gap [m]"]
            .map(str::to_owned)
            .to_vec();
    columns.push("#front headway [s]".to_owned());
    columns.extend(told.iter().map(|axis| format!("#{}", labelled(axis.name()))));
    columns.push("recording".to_owned());
    html.table(&columns.iter().map(String::as_str).collect::<Vec<_>>());
    for sample in &scenario.worst {
        html.row(if sample.delta_v_mps.is_some() { "collided" } else { "" }, &row(findings, scenario, sample, &told));
    }
    html.end_table();
    if let Some(gallery) = findings.gallery {
        let link = escape(gallery);
        html.raw(&format!("<p><a href=\"{link}\">All recordings with pictures of their critical moments</a></p>"));
    }
}

fn row(findings: &Findings<'_>, scenario: &ScenarioOverview, sample: &WorstSample, told: &[&Axis]) -> Vec<String> {
    let margins = &sample.outcome.margins;
    let mut cells = vec![
        number(sample.sample),
        cell(sample.fate.word(scenario.is_paired())),
        number(sample.delta_v_mps.map_or_else(String::new, |mps| format!("{mps:.2}"))),
        cell(sample.collision.as_ref().map(|(other, _)| other.to_string()).unwrap_or_default()),
        cell(phase(sample)),
        measured(margins.min_ttc_rear_s),
        measured(margins.min_gap_rear_m),
        measured(margins.min_thw_front_s),
    ];
    for axis in told {
        let value = sample.outcome.parameters.iter().find(|(name, _)| name.as_str() == axis.name());
        cells.push(number(match value {
            Some((_, Value::Number(value))) => format!("{value:.2}"),
            Some((_, Value::Label(label))) => label.clone(),
            None => String::new(),
        }));
    }
    cells.push(recording(findings, &scenario.name, sample.sample));
    cells
}

fn phase(sample: &WorstSample) -> &'static str {
    match sample.collision.as_ref().map(|(_, phase)| phase) {
        None => "",
        Some(Phase::Approach) => "approach",
        Some(Phase::Critical) => "critical",
        Some(Phase::Overtaking) => "overtaking",
        Some(Phase::After) => "after",
    }
}

/// A value, or a dash that says on hovering why there is none.
fn measured(value: Measured) -> String {
    match value {
        Ok(value) => number(format!("{value:.2}")),
        Err(absent) => format!("<td class=\"number\" title=\"{}\">-</td>", escape(&absent.to_string())),
    }
}

fn recording(findings: &Findings<'_>, scenario: &str, sample: u64) -> String {
    match findings.recording(scenario, sample) {
        Some(path) => {
            let name = path.rsplit('/').next().unwrap_or(path);
            markup(&format!("<a href=\"{}\">{}</a>", escape(path), escape(name)))
        }
        None => cell(""),
    }
}

/// The errors of a scenario, by arm and kind.
pub(super) fn errors(html: &mut Html, scenario: &ScenarioOverview) {
    if scenario.errors.is_empty() {
        return;
    }
    html.element("h3", "Errors");
    html.table(&["controller", "kind", "#samples", "#first", "what the first one said"]);
    for ((arm, kind), error) in &scenario.errors {
        let message = markup(&element("code", "", &error.message));
        html.row("collided", &[cell(arm), cell(kind), number(error.count), number(error.first_sample), message]);
    }
    html.end_table();
}

/// The samples that cost most.
pub(super) fn slowest(html: &mut Html, findings: &Findings<'_>) {
    if findings.slowest.is_empty() {
        return;
    }
    html.element("h2", "Slowest samples");
    html.table(&["scenario", "#sample", "controller", "#wall time [s]"]);
    for timing in findings.slowest {
        let wall_s = number(format!("{:.3}", timing.wall_s));
        html.row("", &[cell(&timing.scenario), number(timing.sample), cell(&timing.controller), wall_s]);
    }
    html.end_table();
}
