//! The table of causes as a part of a campaign's report.

use std::collections::BTreeMap;

use closecall_campaign::action::{Action, CommandFor, Replay, SavedSample};
use maud::{Markup, PreEscaped, html};

use super::{FailureRow, Failures};
use crate::attribution::{braking_words, phase_word, state_word};
use crate::explain::Cause;

/// The comments around the section, which mark it for replacement.
const BEGIN: &str = "<!-- causes -->";
const END: &str = "<!-- end of causes -->";
/// Largest number of failures that the page lists.
const MOST_LISTED: usize = 100;

/// Returns the section of the report. `is_named` says whether a command must name the scenario.
/// Without failures there is none.
pub fn section(failures: &Failures, is_named: bool, command_for: CommandFor) -> Markup {
    let body = if failures.rows.is_empty() { Markup::default() } else { body(failures, is_named, command_for) };
    html! { (PreEscaped(BEGIN)) (body) (PreEscaped(END)) }
}

/// Returns the part of a page before the section, the section, and the part after it; `None` if the
/// page has none.
pub fn without_section(page: &str) -> Option<[&str; 3]> {
    let (before, rest) = page.split_once(BEGIN)?;
    let (section, after) = rest.split_once(END)?;
    Some([before, section, after])
}

fn body(failures: &Failures, is_named: bool, command_for: CommandFor) -> Markup {
    let rows = &failures.rows;
    html! {
        h2 { "Causes" }
        p.note {
            "All failures of the arm under test: induced failures first, then failures that no perfect stage prevents, then the most "
            "harmful. Avoidable: whether the competent and careful driver of UN Regulation 157 in the place of the striking vehicle or of the "
            "ego, or full braking of the striking vehicle, would have avoided the first collision. The braking of "
            "the striking vehicle decides only in a rear-end collision. Due to: the stage of the chain whose "
            "perfection prevents the failure, once " code { "closecall explain" } " has found it."
        }
        (counts(rows))
        @if failures.without_attribution > 0 {
            p.note {
                (failures.without_attribution) " of " (rows.len()) " failures are not attributed yet: they are many, or their sensors are "
                "slow. " code { (command_for(&Action::ExplainAll("."))) } " attributes them."
            }
        }
        div.wide tabindex="0" {
            table {
                thead { tr {
                    th.number { "sample" } th { "strikes" } th { "phase" } th { "induced" } th.number { "harm" } th { "avoidable by" }
                    th { "due to" } th { "commands" }
                } }
                tbody { @for row in rows.iter().take(MOST_LISTED) { (line(row, is_named, command_for)) } }
            }
        }
        @if rows.len() > MOST_LISTED { p.note { "The first " (MOST_LISTED) " of " (rows.len()) " failures." } }
    }
}

/// Returns the counts by striking vehicle, phase and avoidability.
fn counts(rows: &[FailureRow]) -> Markup {
    let mut counted: BTreeMap<(String, &str, &str), usize> = BTreeMap::new();
    for row in rows {
        let avoidable = row.attribution.as_ref().map_or("not known", |attribution| attribution.avoidable.words());
        let who = format!("{} strikes {}", row.vehicles[0], row.vehicles[1]);
        *counted.entry((who, phase_word(row.phase), avoidable)).or_default() += 1;
    }
    html! {
        div.wide tabindex="0" { table {
            thead { tr { th { "vehicles" } th { "phase" } th { "avoidable by" } th.number { "failures" } } }
            tbody { @for ((who, phase, avoidable), count) in &counted {
                tr { td { (who) } td { (phase) } td { (avoidable) } td.number { (count) } }
            } }
        } }
    }
}

fn line(row: &FailureRow, is_named: bool, command_for: CommandFor) -> Markup {
    let saved_sample = SavedSample { folder: ".", sample: row.sample, scenario: is_named.then_some(&row.scenario) };
    let commands =
        [Action::Replay(Replay::new(saved_sample)), Action::Explain(saved_sample), Action::Minimize(saved_sample)];
    let phase = match (&row.attribution, row.is_after_lead_braking) {
        (Some(attribution), _) => attribution.phase_words(),
        (None, is_after) => braking_words(row.phase, is_after),
    };
    let state = row.attribution.as_ref().map_or("", |attribution| state_word(attribution.ego_state));
    html! {
        tr.collided {
            td.number { (row.sample) }
            td title=(row.scenario) { (row.vehicles[0]) " → " (row.vehicles[1]) }
            td title=(state) { (phase) }
            td { (match row.is_induced { Some(true) => "induced", Some(false) => "no", None => "" }) }
            td.number { (format!("{:.3}", row.harm)) }
            td { (row.attribution.as_ref().map_or("", |attribution| attribution.avoidable.words())) }
            td title=(row.sentence.clone().unwrap_or_default()) { (due_to(row)) }
            td { @for action in &commands { code { (command_for(action)) } br; } }
        }
    }
}

/// Returns the cause of the failure.
fn due_to(row: &FailureRow) -> String {
    match &row.cause {
        None => String::new(),
        Some(Cause::Stage { stage }) => stage.name().to_owned(),
        Some(Cause::Pair { stages: [first, second] }) => format!("{} and {}", first.name(), second.name()),
        Some(Cause::None) => "no stage".to_owned(),
    }
}
