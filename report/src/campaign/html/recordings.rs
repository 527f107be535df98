//! The page of a campaign's recordings: a picture of each critical moment beside its numbers, and
//! the commands that open the recording and run the sample again.

use std::collections::BTreeSet;
use std::path::Path;

use closecall_campaign::action::{Action, CommandFor};
use closecall_traffic::Measured;
use maud::{Markup, PreEscaped, html};

use super::page::{document, table};
use crate::campaign::recordings::card_beside;
use closecall_scenarios::causal::LETTERS;
use closecall_scenarios::outcome::Outcome;
use closecall_traffic::atomic::{WriteError, write_file};

/// One recorded sample.
#[derive(Clone, Debug)]
pub(in crate::campaign) struct IndexEntry {
    /// The scenario's name.
    pub(in crate::campaign) scenario: String,
    /// The sample's number.
    pub(in crate::campaign) sample: u64,
    /// The reasons for its recording, in words.
    pub(in crate::campaign) reasons: Vec<&'static str>,
    /// The recording's file, relative to the page.
    pub(in crate::campaign) file: String,
    /// The command that runs the sample again.
    pub(in crate::campaign) replay: String,
    /// For each arm: the end of the run in one sentence, and the actions of the system under test.
    pub(in crate::campaign) story: Vec<String>,
    /// The critical moment, as SVG.
    pub(in crate::campaign) still: String,
    /// The view from above with a slider.
    pub(in crate::campaign) scrubber: Markup,
    /// The verdict on the pair, or on the only run.
    pub(in crate::campaign) verdict: &'static str,
    /// The event in the arm under test and its cause, in one sentence.
    pub(in crate::campaign) sentence: String,
    /// The outcome of each arm, the baseline first.
    pub(in crate::campaign) outcomes: Vec<Outcome>,
}

/// Writes the page.
///
/// # Errors
/// [`WriteError`] if the page cannot be written.
pub(in crate::campaign) fn write_index(
    path: &Path,
    entries: &[IndexEntry],
    command_for: CommandFor,
) -> Result<(), WriteError> {
    let page = page(entries, command_for).into_string();
    write_file(path, |file| file.write_all(page.as_bytes()))
}

fn page(entries: &[IndexEntry], command_for: CommandFor) -> Markup {
    let view = |is_in_browser| command_for(&Action::View { folder: "DIR", is_in_browser });
    let body = html! {
        h1 { "Recordings" }
        p {
            (entries.len()) @if entries.len() == 1 { " recorded sample. " } @else { " recorded samples. " }
            "Each picture shows the critical moment from above: the vehicles drive to "
            "the right, and the road is drawn wider than it is. " (LETTERS) ". The recordings open in the Rerun viewer 0.36:"
        }
        pre.command tabindex="0" { "pip install rerun-sdk==0.36.3" }
        p {
            "All of them: " code { (view(false)) } ", with the campaign's folder. "
            code { (view(true)) } " opens them in the browser."
        }
        (filters(entries))
        @for entry in entries { (section(entry)) }
        script { (PreEscaped(SCRIPT)) }
    };
    document("Recordings", &body)
}

/// Filters the entries, and moves the vehicles.
const SCRIPT: &str = include_str!("recordings.js");

/// Returns the choices by which the entries can be filtered: verdict, scenario, and the arm whose
/// ego collides.
fn filters(entries: &[IndexEntry]) -> Markup {
    let arms = entries.iter().flat_map(|entry| &entry.outcomes).map(|outcome| outcome.controller.clone());
    let choices: [(&str, &str, BTreeSet<String>); 3] = [
        ("verdict", "Verdict", entries.iter().map(|entry| entry.verdict.to_owned()).collect()),
        ("collided", "The ego collides with", arms.collect()),
        ("scenario", "Scenario", entries.iter().map(|entry| entry.scenario.clone()).collect()),
    ];
    html! {
        form.filters hidden {
            @for (name, title, values) in &choices {
                label {
                    (title) " "
                    select name=(name) {
                        option value="" { "all" }
                        @for value in values { option { (value) } }
                    }
                }
            }
            output {}
        }
    }
}

fn section(entry: &IndexEntry) -> Markup {
    let outcomes = entry.outcomes.iter().filter(|outcome| outcome.ego_collided());
    let collided: Vec<&str> = outcomes.map(|outcome| outcome.controller.as_str()).collect();
    html! {
        section.recording id={ (entry.scenario) "-" (entry.sample) } data-verdict=(entry.verdict)
            data-scenario=(entry.scenario) data-collided=(collided.join(" ")) {
            figure { (PreEscaped(&entry.still)) (entry.scrubber) }
            div {
                h2 { (entry.scenario) " · sample " (entry.sample) " · " (entry.verdict) }
                p { "Recorded as " (entry.reasons.join(", ")) "." }
                @for line in &entry.story { p.failure[line.contains("COLLISION")] { (line) } }
                (numbers(&entry.outcomes))
                p { a href=(card_beside(&entry.file)) { "Incident card" } ", one page for a ticket." }
                p { "Open it, from this page's folder:" }
                pre.command tabindex="0" { "rerun " (entry.file) }
                p { "Run it again, from this page's folder:" }
                pre.command tabindex="0" { (entry.replay) }
            }
        }
    }
}

type Number = (&'static str, fn(&Outcome) -> String);

/// The row of the margin increase system, which only its arms have.
const ENGAGED: &str = "MIS engaged at [s]";

const NUMBERS: [Number; 7] = [
    ("collisions", |outcome| outcome.collisions.len().to_string()),
    ("touches", |outcome| outcome.touches.len().to_string()),
    ("hardest impact [m/s]", |outcome| {
        let speeds = outcome.collisions.iter().map(|collision| collision.relative_speed_mps);
        speeds.max_by(f64::total_cmp).map_or("-".to_owned(), |speed_mps| format!("{speed_mps:.1}"))
    }),
    ("smallest front headway [s]", |outcome| measured(outcome.margins.min_thw_front_s)),
    ("smallest rear headway [s]", |outcome| measured(outcome.margins.min_thw_rear_s)),
    ("hardest braking [m/s²]", |outcome| format!("{:.1}", outcome.margins.max_deceleration_mps2)),
    (ENGAGED, |outcome| outcome.mis.as_ref().map_or("-".to_owned(), |mis| measured(mis.engaged_at_s))),
];

fn measured(value: Measured) -> String {
    value.map_or_else(|absent| absent.to_string(), |value| format!("{value:.2}"))
}

fn numbers(outcomes: &[Outcome]) -> Markup {
    let head = html! {
        td {}
        @for outcome in outcomes { th { (outcome.controller) } }
    };
    let rows = html! {
        @for (name, value) in NUMBERS.into_iter().filter(|(name, _)| *name != ENGAGED || outcomes.iter().any(|outcome| outcome.mis.is_ok())) {
            tr { td { (name) } @for outcome in outcomes { td { (value(outcome)) } } }
        }
    };
    table(&head, &rows)
}
