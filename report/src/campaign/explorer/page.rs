//! The page of the explorer.

use std::collections::BTreeMap;
use std::io::Write;

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use closecall_campaign::action::{Action, CommandFor, Replay, SavedSample};
use closecall_campaign::folder::{FolderError, RECORDINGS, RECORDINGS_PAGE, REPORT};
use closecall_campaign::saved::SavedCampaign;
use closecall_scenarios::ScenarioFile;
use closecall_traffic::input::read_text;
use closecall_traffic::shown::shown;
use closecall_traffic::words::counted;
use flate2::Compression;
use flate2::write::GzEncoder;
use maud::{DOCTYPE, Markup, PreEscaped, html};
use serde::Serialize;

use super::columns::Samples;
use super::plotly;
use crate::campaign::ReportError;
use crate::campaign::html::page::STYLE;
use crate::campaign::overview::{Fate, Overview};
use crate::campaign::recordings::card_beside;
use crate::charts::style::{css, fate_colour};
use crate::escape::from_markdown;

/// The page's own style and script. The script filters, counts and links; Plotly draws.
const OWN_STYLE: &str = include_str!("explorer.css");
const SCRIPT: &str = include_str!("explorer.js");
/// Largest number of scenarios whose names are in the title.
const NAMED: usize = 3;
/// Number of histograms.
const HISTOGRAMS: usize = 4;
/// The sample number in a command. The page replaces it by the number of the chosen sample.
const PLACE: u64 = 9_876_543_210;

/// The data of the script.
#[derive(Serialize)]
struct Data<'a> {
    is_served: bool,
    scenarios: &'a [Samples],
    fates: Vec<FateStyle>,
    /// For each scenario the command that runs a sample again, with [`PLACE`] as its number.
    commands: Vec<String>,
    place: String,
    /// For each scenario the recordings by the number of the sample, with their incident cards.
    recordings: Vec<BTreeMap<u64, [String; 2]>>,
}

#[derive(Serialize)]
struct FateStyle {
    pair: &'static str,
    single: &'static str,
    colour: String,
}

/// Where the page lies.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PagePlace {
    /// A program serves it, and is asked for the samples that are chosen.
    Served,
    /// In a file. The path leads from there to the campaign's folder, and is empty or ends with
    /// `/`; without it the page links no file of the folder.
    File(Option<String>),
}

impl PagePlace {
    /// Returns the path to the campaign's folder.
    fn folder(&self) -> Option<&str> {
        match self {
            Self::Served => Some(""),
            Self::File(path) => path.as_deref(),
        }
    }
}

/// How many samples of a campaign have run, if some are missing.
struct Unfinished {
    has: u64,
    of: u64,
}

/// Returns the page of a campaign.
///
/// # Errors
/// [`ReportError`] if the folder cannot be read.
pub fn explorer_page(saved: &SavedCampaign, place: &PagePlace, command_for: CommandFor) -> Result<String, ReportError> {
    let manifest = saved.manifest();
    let names = manifest.scenarios.iter().map(|scenario| scenario.name.as_str());
    let files = names.map(|name| saved.file(Some(name))).collect::<Result<Vec<ScenarioFile>, _>>()?;
    let arms: Vec<String> = manifest.arm_names().into_iter().collect();
    let mut overview = Overview::new(&files, &arms);
    let mut scenarios: Vec<Samples> = files.iter().map(|file| Samples::new(file, &arms)).collect();
    let mut unfinished = None;
    for record in saved.folder().complete_records()? {
        let record = match record {
            Err(FolderError::Incomplete { has, planned, .. }) => {
                unfinished = Some(Unfinished { has, of: planned });
                break;
            }
            record => record?,
        };
        overview.push(&record);
        if let Some(index) = files.iter().position(|file| file.config().name == record.scenario) {
            scenarios[index].push(record, manifest.sampling.seed);
        }
    }
    for (samples, overview) in scenarios.iter_mut().zip(&overview.scenarios) {
        samples.finish(overview);
    }
    let command = |file: &ScenarioFile| {
        let scenario = (files.len() > 1).then_some(file.config().name.as_str());
        let saved_sample = SavedSample { folder: ".", sample: PLACE, scenario };
        command_for(&Action::Replay(Replay { is_paired: arms.len() > 1, ..Replay::new(saved_sample) }))
    };
    let style =
        |fate: Fate| FateStyle { pair: fate.word(true), single: fate.word(false), colour: css(fate_colour(fate)) };
    let data = Data {
        is_served: *place == PagePlace::Served,
        scenarios: &scenarios,
        fates: Fate::ALL.map(style).into(),
        commands: files.iter().map(command).collect(),
        place: PLACE.to_string(),
        recordings: files.iter().map(|file| recordings(saved, place, &file.config().name)).collect(),
    };
    let json = serde_json::to_vec(&data).map_err(|error| written(saved, error.into()))?;
    let [data, script] = [json, plotly::script().into_bytes()].map(|bytes| packed(&bytes));
    let packed = Packed {
        data: data.map_err(|error| written(saved, error))?,
        plotly: script.map_err(|error| written(saved, error))?,
    };
    let names: Vec<&str> = files.iter().map(|file| file.config().name.as_str()).collect();
    let title = if names.len() > NAMED { counted(names.len(), "scenario") } else { names.join(", ") };
    Ok(shown(&page(&title, saved, place, unfinished.as_ref(), &packed).0).into_owned())
}

fn written(saved: &SavedCampaign, source: std::io::Error) -> ReportError {
    closecall_traffic::atomic::WriteError::new(saved.folder().path(), source).into()
}

/// The compressed content of the page.
struct Packed {
    data: String,
    plotly: String,
}

/// Returns bytes in gzip, as base64.
fn packed(bytes: &[u8]) -> std::io::Result<String> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes)?;
    Ok(BASE64_STANDARD.encode(encoder.finish()?))
}

/// Returns the recordings of a scenario in the campaign's folder, with their incident cards.
fn recordings(saved: &SavedCampaign, place: &PagePlace, scenario: &str) -> BTreeMap<u64, [String; 2]> {
    let Some(prefix) = place.folder() else { return BTreeMap::new() };
    let folder = saved.folder();
    let entries = std::fs::read_dir(folder.file(RECORDINGS)).into_iter().flatten().flatten();
    let number = |name: &str| name.strip_prefix(scenario)?.strip_prefix('-')?.strip_suffix(".rrd")?.parse().ok();
    let recording = |entry: std::fs::DirEntry| {
        let name = entry.file_name().into_string().ok()?;
        let path = format!("{prefix}{RECORDINGS}/{name}");
        Some((number(&name)?, [path.clone(), card_beside(&path)]))
    };
    entries.filter_map(recording).collect()
}

/// Returns the verdict that the campaign's summary states.
fn verdict(saved: &SavedCampaign) -> Option<String> {
    let text = read_text(&saved.folder().file("summary.md")).ok()?;
    Some(from_markdown(text.lines().next()?.strip_prefix("## Closecall: ")?))
}

/// Returns the class of a verdict, which colours it as in the report.
fn class(verdict: Option<&str>) -> &'static str {
    match verdict.and_then(|text| text.split(':').next()) {
        Some("PASS") => "pass",
        Some("FAIL") => "fail",
        Some("INVALID" | "ERROR") => "invalid",
        Some(_) => "inconclusive",
        None => "open",
    }
}

fn page(
    title: &str,
    saved: &SavedCampaign,
    place: &PagePlace,
    unfinished: Option<&Unfinished>,
    packed: &Packed,
) -> Markup {
    let nonce: String = blake3::hash(SCRIPT.as_bytes()).to_hex().chars().take(32).collect();
    let policy = format!(
        "default-src 'none'; script-src 'nonce-{nonce}'; style-src 'unsafe-inline'; img-src data: blob:; connect-src 'self'; \
         form-action 'none'; base-uri 'none'"
    );
    let verdict = match unfinished {
        // The summary is of another end, or there is none.
        Some(Unfinished { has, of }) => {
            Some(format!("UNFINISHED: {has} of {of} samples have run, and there is no verdict"))
        }
        None => verdict(saved),
    };
    let links = [(REPORT.to_owned(), "Report"), (format!("{RECORDINGS}/{RECORDINGS_PAGE}"), "Recordings")];
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta http-equiv="Content-Security-Policy" content=(policy);
                meta name="referrer" content="no-referrer";
                title { "Explorer: " (title) }
                style { (PreEscaped(STYLE)) (PreEscaped(OWN_STYLE)) }
            }
            body {
                main.explorer {
                    header.(class(verdict.as_deref())) {
                        div {
                            h1 { (verdict.as_deref().map_or_else(|| format!("Samples of {title}"), str::to_owned)) }
                            p.what id="counts" role="status" { "Loading the samples." }
                            nav aria-label="Files of the campaign" {
                                @if let Some(prefix) = place.folder() {
                                    @for (path, name) in links.iter().filter(|(path, _)| saved.folder().file(path).is_file()) {
                                        a href={ (prefix) (path) } target="_blank" rel="noopener" { (name) }
                                    }
                                }
                            }
                        }
                    }
                    (filters(saved, verdict.as_deref()))
                    div.views {
                        div.charts-side {
                            (plane("map", "Outcome map: share of samples with a collision, and samples"))
                            (plane("scatter", "Two columns: number of samples, and samples"))
                            div.histograms { @for index in 0..HISTOGRAMS { (histogram(index)) } }
                        }
                        aside id="sample" aria-label="Sample" aria-live="polite" tabindex="-1" {
                            h2 { "Sample" }
                            p { "Choose a point, a row of the list, or a number." }
                        }
                    }
                    section aria-labelledby="list-title" {
                        h2 id="list-title" { "Samples, the gravest first" }
                        div id="list" {}
                    }
                }
                script type="text/plain" id="plotly" { (PreEscaped(&packed.plotly)) }
                script type="text/plain" id="data" { (PreEscaped(&packed.data)) }
                script nonce=(nonce) { (PreEscaped(SCRIPT)) }
                noscript { p { "The explorer needs a script. The report does not." } }
            }
        }
    }
}

/// Returns the scenario that a verdict names first: the worst one.
fn first_named<'a>(names: impl Iterator<Item = &'a str>, verdict: &str) -> Option<&'a str> {
    let names: Vec<&str> = names.collect();
    let mut words = verdict.split([' ', ',']);
    words.find_map(|word| names.iter().copied().find(|name| *name == word))
}

/// Returns the filters. The page opens with the scenario that the verdict names first.
fn filters(saved: &SavedCampaign, verdict: Option<&str>) -> Markup {
    let manifest = saved.manifest();
    let names = || manifest.scenarios.iter().map(|scenario| scenario.name.as_str());
    let first = verdict.and_then(|verdict| first_named(names(), verdict));
    html! {
        form.filters id="filters" aria-label="Filters" {
            label {
                "Scenario "
                select name="scenario" { @for name in names() { option selected[Some(name) == first] { (name) } } }
            }
            label {
                "Arm " select name="arm" {
                    @for (index, name) in manifest.arm_names().iter().enumerate() {
                        option value=(index) selected[index + 1 == manifest.arms.len()] { (name) }
                    }
                }
            }
            fieldset id="fates" { legend { "Outcome" } }
            label { "Reason of the MIS " select name="reason" {} }
            label { "Cause of the collision " select name="cause" {} }
            label { "Sample " input name="number" type="number" min="0" step="1" size="8"; }
            button type="submit" { "Show" }
            button type="button" id="reset" { "Clear filters and brushes" }
        }
    }
}

fn plane(id: &str, title: &str) -> Markup {
    html! {
        section.view id=(id) aria-label=(title) {
            h2 { (title) }
            p.axes {
                label { "Across " select name="x" {} }
                label { "Up " select name="y" {} }
                button type="button" name="clear" hidden { "Clear brush" }
            }
            div.chart role="img" aria-label=(title) {}
        }
    }
}

fn histogram(index: usize) -> Markup {
    html! {
        section.view.histogram id={ "histogram-" (index) } aria-label={ "Histogram " (index + 1) } {
            p.axes {
                label { "Column " select name="x" {} }
                label { "from " input name="from" type="number" step="any"; }
                label { "to " input name="to" type="number" step="any"; }
                button type="button" name="clear" hidden { "Clear brush" }
            }
            div.chart role="img" aria-label={ "Histogram " (index + 1) } {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_opens_with_the_scenario_that_the_verdict_names_first() {
        let names = ["overtake", "overtake-fast", "lead"];
        let first = |verdict| first_named(names.into_iter(), verdict);
        let fail = "FAIL: 2 of 3 scenarios miss a requirement: overtake-fast (MIS-3), lead (MIS-1)";
        assert_eq!(first(fail), Some("overtake-fast"), "not the one whose name is a part of it");
        assert_eq!(first("PASS: all requirements of 3 scenarios are met"), None);
    }
}
