//! Single samples: the worst samples, the samples that ended in an error, and the slowest samples.

use closecall_traffic::{Measured, Value};
use maud::{Markup, html};

use super::page::{number, number_heads, table, text_heads};
use crate::campaign::findings::Findings;
use crate::campaign::overview::{Axis, ScenarioOverview, WorstSample};
use crate::units::labelled;
use closecall_campaign::action::{Action, Replay, SavedSample};
use closecall_campaign::failures::FailureKindCount;
use closecall_scenarios::outcome::Phase;

/// Returns the worst samples of a scenario, with the command that runs the first of them again.
pub(super) fn worst(findings: &Findings<'_>, scenario: &ScenarioOverview) -> Markup {
    let shown: Vec<&Axis> =
        scenario.map().map_or_else(Vec::new, |pair| pair.axes.map(|index| &scenario.axes[index]).to_vec());
    let head = html! {
        th.number { "sample" }
        th { "result" }
        th.number { "ego's ΔV [m/s]" }
        (text_heads(&["with", "phase"]))
        (number_heads(&["rear TTC [s]", "rear gap [m]", "front headway [s]"]))
        @for axis in &shown { th.number { (labelled(axis.name())) } }
        th { "recording" }
    };
    let rows = html! { @for sample in &scenario.worst { (row(findings, scenario, sample, &shown)) } };
    html! {
        h3 { "Worst samples" }
        p.note {
            "Induced collisions first, then the other collisions, each by the ego's change of velocity; then the narrowest "
            "escapes, by the smallest time to collision with the vehicle behind. To run one again, within this folder:"
        }
        @if let Some(first) = scenario.worst.first() { pre.command tabindex="0" { (findings.replay(&scenario.name, first.sample)) } }
        (table(&head, &rows))
        @if let Some(gallery) = findings.gallery {
            p { a href=(gallery) { "All recordings with pictures of their critical moments" } }
        }
    }
}

fn row(findings: &Findings<'_>, scenario: &ScenarioOverview, sample: &WorstSample, shown: &[&Axis]) -> Markup {
    let margins = &sample.outcome.margins;
    html! {
        tr.collided[sample.delta_v_mps.is_some()] {
            (number(sample.sample))
            td { (sample.fate.word(scenario.is_paired())) }
            (number(sample.delta_v_mps.map_or_else(String::new, |mps| format!("{mps:.2}"))))
            td { @if let Some((other, _)) = &sample.collision { (other.to_string()) } }
            td { (phase(sample)) }
            (measured(margins.min_ttc_rear_s))
            (measured(margins.min_gap_rear_m))
            (measured(margins.min_thw_front_s))
            @for axis in shown { (number(parameter(sample, axis))) }
            td {
                @if let Some(path) = findings.recording(&scenario.name, sample.sample) {
                    a href=(path) { (path.rsplit('/').next().unwrap_or(path)) }
                }
            }
        }
    }
}

fn parameter(sample: &WorstSample, axis: &Axis) -> String {
    match sample.outcome.parameters.iter().find(|(name, _)| name.as_str() == axis.name()) {
        Some((_, Value::Number(value))) => format!("{value:.2}"),
        Some((_, Value::Label(label))) => label.clone(),
        None => String::new(),
    }
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

/// Returns a cell with the value, or with a dash and the reason for its absence as a tooltip.
fn measured(value: Measured) -> Markup {
    match value {
        Ok(value) => number(format!("{value:.2}")),
        Err(absent) => html! { td.number title=(absent.to_string()) { "-" } },
    }
}

/// Returns the command that runs a failed sample again, from within the campaign's folder.
fn replay_failure(findings: &Findings<'_>, scenario: &str, failure: &FailureKindCount) -> String {
    let saved_sample = SavedSample { folder: ".", sample: failure.first_sample, scenario: Some(scenario) };
    let replay = Replay { controller: Some(&failure.controller), ..Replay::new(saved_sample) };
    (findings.command_for)(&Action::Replay(replay))
}

/// Returns why samples of a scenario have no outcome; empty if all have one.
pub(super) fn errors(findings: &Findings<'_>, scenario: &ScenarioOverview) -> Markup {
    let counts = findings.summary.scenarios.iter().find(|(name, _)| *name == scenario.name);
    let Some((_, counts)) = counts.filter(|(_, counts)| !counts.failures.is_empty()) else {
        return Markup::default();
    };
    let head = html! {
        (text_heads(&["controller", "kind"]))
        (number_heads(&["samples", "first"]))
        th { "message of the first" }
        th { "to run it again" }
    };
    let rows = html! {
        @for failure in counts.failures.iter() {
            tr.collided {
                td { (failure.controller) }
                td { (failure.kind) }
                (number(failure.samples))
                (number(failure.first_sample))
                td { code { (failure.first_message) } @if failure.others { " and other messages" } }
                td { code { (replay_failure(findings, &scenario.name, failure)) } }
            }
        }
    };
    html! { h3 { "Errors" } (table(&head, &rows)) }
}

/// Returns the flaky samples of a scenario, by arm; empty if there are none.
pub(super) fn flaky(scenario: &ScenarioOverview) -> Markup {
    if scenario.flaky.is_empty() {
        return Markup::default();
    }
    let head = html! {
        (text_heads(&["controller"]))
        (number_heads(&["samples", "first"]))
        th { "message of the first failure" }
    };
    let rows = html! {
        @for (arm, flaky) in &scenario.flaky {
            tr.collided {
                td { (arm) }
                (number(flaky.count))
                (number(flaky.first_sample))
                td { code { (flaky.message) } }
            }
        }
    };
    html! {
        h3 { "Flaky" }
        p { "These samples failed, and have an outcome only because they were run again." }
        (table(&head, &rows))
    }
}

/// Returns the samples with the longest wall times; empty if no wall time is known.
pub(super) fn slowest(findings: &Findings<'_>) -> Markup {
    if findings.slowest.is_empty() {
        return Markup::default();
    }
    let head = html! { th { "scenario" } th.number { "sample" } th { "controller" } th.number { "wall time [s]" } };
    let rows = html! {
        @for timing in findings.slowest {
            tr {
                td { (timing.scenario) }
                (number(timing.sample))
                td { (timing.controller) }
                (number(format!("{:.3}", timing.wall_s)))
            }
        }
    };
    html! { h2 { "Slowest samples" } (table(&head, &rows)) }
}
