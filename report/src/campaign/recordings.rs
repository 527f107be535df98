//! Recordings of selected samples of a campaign, and the page that shows them.

use std::fs;

use closecall_campaign::folder::Folder;
use closecall_campaign::saved::SavedCampaign;
use closecall_campaign::selection::{Chooser, Chosen, Selection};
use closecall_scenarios::atomic::WriteError;
use closecall_simulation::scenario::ScenarioFile;

use super::files::ReportError;
use super::findings::Recordings;
use super::html::{IndexEntry, write_index};
use crate::memory::return_free_memory;
use crate::run::figure::{scrubber, still};
use crate::run::film::{Film, Level, film_arms};
use crate::run::rerun::write_recording_of;

/// The folder of the recordings within a campaign's folder.
pub(super) const RECORDINGS: &str = "recordings";
/// The page of the recordings, in their folder.
pub(super) const INDEX: &str = "index.html";

/// Runs the selected samples again, records all arms of each in one file, and writes the page.
pub(super) fn record(
    folder: &Folder,
    scenarios: &[&ScenarioFile],
    selection: Selection,
) -> Result<Recordings, ReportError> {
    let saved = SavedCampaign::of(folder.clone())?;
    let path = folder.file(RECORDINGS);
    // An earlier, identical campaign may have recorded other samples.
    if path.exists() {
        fs::remove_dir_all(&path).map_err(|source| WriteError::new(&path, source))?;
    }
    let mut recorded = Recordings::new();
    let mut entries = Vec::new();
    for scenario in scenarios {
        for chosen in choose(&saved, scenario, selection)? {
            fs::create_dir_all(&path).map_err(|source| WriteError::new(&path, source))?;
            let name = &scenario.config().name;
            let entry = record_one(&saved, name, &chosen)?;
            for outcome in &entry.outcomes {
                let key = (name.clone(), chosen.sample, outcome.controller.clone());
                recorded.insert(key, format!("{RECORDINGS}/{}", entry.file));
            }
            entries.push(entry);
        }
    }
    if !entries.is_empty() {
        write_index(&path.join(INDEX), &entries)?;
    }
    Ok(recorded)
}

fn choose(saved: &SavedCampaign, scenario: &ScenarioFile, selection: Selection) -> Result<Vec<Chosen>, ReportError> {
    let Some(ego) = scenario.ego_id() else { return Ok(Vec::new()) };
    let mut chooser = Chooser::new(selection);
    for record in saved.folder().records()? {
        let record = record?;
        if record.scenario == scenario.config().name {
            chooser.push(&record);
        }
    }
    Ok(chooser.choose(saved.manifest().sampling.seed, ego))
}

fn record_one(saved: &SavedCampaign, scenario: &str, chosen: &Chosen) -> Result<IndexEntry, ReportError> {
    let sample = chosen.sample;
    // Of the samples of the campaign, and of the recording before.
    return_free_memory();
    let (concrete, key) = saved.sample(Some(scenario), sample)?;
    let films = film_arms(&concrete, key, &saved.manifest().arms(), Level::Full)
        .map_err(|source| ReportError::Sample { sample, source })?;
    // Of the sensors of this sample.
    return_free_memory();
    let settings = saved.manifest().settings();
    let named = |film: Film| film.with_settings(settings.iter().map(ToString::to_string));
    let films: Vec<Film> = films.into_iter().map(named).collect();
    let file = format!("{scenario}-{sample}.rrd");
    let paired = if films.len() > 1 { " --paired" } else { "" };
    let replay = format!(
        "closecall replay {} {sample} --scenario {scenario}{paired} --record {file}",
        quoted(&saved.folder().path().display().to_string()),
    );
    let story = films.iter().flat_map(|film| {
        let arm = film.arm_label();
        [Some(film.headline()), film.mis_summary()].into_iter().flatten().map(move |line| format!("{arm}: {line}"))
    });
    let entry = IndexEntry {
        scenario: scenario.to_owned(),
        sample,
        reasons: chosen.reasons.clone(),
        file: file.clone(),
        replay,
        story: story.collect(),
        still: films.last().map_or(String::new(), still),
        scrubber: scrubber(&films),
        verdict: Film::verdict_word(&films),
        outcomes: films.iter().filter_map(|film| film.outcome().cloned()).collect(),
    };
    write_recording_of(&saved.folder().file(&format!("{RECORDINGS}/{file}")), films)?;
    Ok(entry)
}

/// Returns a path as one word of a command.
fn quoted(path: &str) -> String {
    let is_plain = |letter: char| letter.is_alphanumeric() || "/._-+:@".contains(letter);
    if path.chars().all(is_plain) { path.to_owned() } else { format!("'{}'", path.replace('\'', "'\\''")) }
}
