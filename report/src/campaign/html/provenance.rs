//! Everything that a repetition of the campaign needs, and the sources of the sampled values.

use closecall_campaign::action::Action;
use closecall_scenarios::parameters::Provenance;
use closecall_traffic::words::counted;
use maud::{Markup, html};

use super::page::{table, text_heads};
use crate::campaign::findings::Findings;
use crate::date::today;
use crate::units::labelled;

/// Returns the versions, the command, the files and the sampling, then the sources of each
/// scenario's parameters.
pub(super) fn provenance(findings: &Findings<'_>) -> Markup {
    let rows = html! {
        @for (name, value) in entries(findings) { tr { td { (name) } td { code { (value) } } } }
    };
    html! {
        h2 { "How it was made" }
        (table(&text_heads(&["", ""]), &rows))
        @if findings.has_many() {
            details {
                summary { "Files of the scenarios" }
                @let rows = html! { @for (name, value) in files(findings) { tr { td { (name) } td { code { (value) } } } } };
                (table(&text_heads(&["", ""]), &rows))
            }
        }
        details { summary { "Where the sampled values come from" }
        @for file in findings.files {
            @if file.space().iter().len() > 0 {
                h3 { "Where the values of " (file.config().name) " come from" }
                @let rows = html! {
                    @for (name, entry) in file.space().iter() {
                        @let (kind, source) = source_of(&entry.provenance);
                        tr { td { (labelled(name.as_str())) } td { (kind) } td { (source) } }
                    }
                };
                (table(&text_heads(&["parameter", "", "from"]), &rows))
            }
        } }
    }
}

fn entries(findings: &Findings<'_>) -> Vec<(&'static str, String)> {
    let manifest = findings.manifest;
    let command = (findings.command_for)(&Action::Repeat(&manifest.command));
    let mut entries = vec![("closecall", manifest.closecall_version.clone()), ("command", command)];
    // Everything that determines the outcomes: two pages with the same hash show the same campaign.
    if let Some(json) = manifest.determining_json() {
        entries.push(("configuration", format!("BLAKE3 {}", blake3::hash(json.as_bytes()).to_hex())));
    }
    entries.push(("page written on", format!("{} (UTC)", today())));
    if findings.has_many() {
        entries.push(("scenarios", format!("{}, whose files are in the configuration", manifest.scenarios.len())));
    } else {
        entries.extend(files(findings));
    }
    let sampling = manifest.sampling;
    let sensors = manifest.sensors.map_or_else(|| "the scenario's".to_owned(), |mode| mode.name().to_owned());
    entries.push(("seed", sampling.seed.to_string()));
    entries.push(("design", format!("{}, {} asked for", sampling.design, counted(sampling.samples, "sample"))));
    entries.push(("sensors", sensors));
    let is_object = manifest.sensors.is_none_or(|mode| mode == closecall_sensors::SensorMode::Object);
    if let (true, Ok(fit)) = (is_object, closecall_sensors::RearFit::shipped()) {
        entries.push(("object-level sensors", fit.origin_text()));
    }
    for setting in manifest.settings() {
        entries.push(("setting", setting.to_string()));
    }
    for model in &manifest.models {
        entries.push(("network", format!("{} on {}, BLAKE3 {}", model.name, model.backend, model.blake3)));
    }
    entries
}

/// Returns the files of the scenarios with their hashes.
fn files(findings: &Findings<'_>) -> Vec<(&'static str, String)> {
    let scenarios = findings.manifest.scenarios.iter();
    scenarios
        .map(|scenario| ("scenario", format!("{} ({}), BLAKE3 {}", scenario.name, scenario.path, scenario.blake3)))
        .collect()
}

fn source_of(provenance: &Provenance) -> (&'static str, String) {
    match provenance {
        Provenance::Fitted(fitted) => ("fitted", format!("{} cases of {}", fitted.n, fitted.source)),
        Provenance::Assumed(why) => ("assumed", why.clone()),
        Provenance::Unstated => ("not stated", String::new()),
    }
}
