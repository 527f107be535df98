//! How the campaign was made: what anyone needs to repeat it.

use closecall_scenarios::parameters::Provenance;

use super::text::{Html, cell, element, markup};
use crate::campaign::findings::Findings;
use crate::units::labelled;

pub(super) fn write(html: &mut Html, findings: &Findings<'_>) {
    let manifest = findings.manifest;
    html.element("h2", "How it was made");
    html.table(&["", ""]);
    let mut row = |what: &str, value: String| html.row("", &[cell(what), markup(&element("code", "", value))]);
    row("closecall", manifest.closecall_version.clone());
    row("command", manifest.command.join(" "));
    for scenario in &manifest.scenarios {
        row("scenario", format!("{} ({}), BLAKE3 {}", scenario.name, scenario.path, scenario.blake3));
    }
    row("seed", manifest.sampling.seed.to_string());
    row("design", format!("{}, {} samples asked for", manifest.sampling.design, manifest.sampling.samples));
    row("sensors", manifest.sensors.map_or_else(|| "those of the scenario".to_owned(), |mode| mode.name().to_owned()));
    for model in &manifest.models {
        row("network", format!("{} on {}, BLAKE3 {}", model.name, model.backend, model.blake3));
    }
    html.end_table();
    for file in findings.files {
        if file.space().iter().len() == 0 {
            continue;
        }
        html.element("h3", format!("Where the values of {} come from", file.config().name));
        html.table(&["parameter", "", "from"]);
        for (name, entry) in file.space().iter() {
            let (kind, from) = match &entry.provenance {
                Provenance::Fitted(fitted) => ("fitted", format!("{} cases of {}", fitted.n, fitted.source)),
                Provenance::Assumed(why) => ("assumed", why.clone()),
                Provenance::Unstated => ("not stated", String::new()),
            };
            html.row("", &[cell(labelled(name.as_str())), cell(kind), cell(from)]);
        }
        html.end_table();
    }
}
