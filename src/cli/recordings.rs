//! Recording chosen samples of a campaign, with a page that shows them.

use std::fs;

use super::CliError;
use super::past::arms;
use super::replay::sample_of;
use super::watch::{films, record_films};
use crate::campaign::folder::Folder;
use crate::campaign::manifest::Manifest;
use crate::campaign::selection::{Chooser, Chosen, Selection};
use crate::report::WriteError;
use crate::report::figure::still;
use crate::report::film::Level;
use crate::report::findings::Recordings;
use crate::report::recordings_index::{IndexEntry, write_index};
use crate::scenario::ScenarioFile;

/// Where recordings lie in a campaign's folder.
pub(super) const RECORDINGS: &str = "recordings";
/// The page that shows them.
pub(super) const INDEX: &str = "index.html";

/// Runs the chosen samples again, all arms of each into one file, and writes the page.
pub(super) fn record(
    folder: &Folder,
    manifest: &Manifest,
    scenarios: &[&ScenarioFile],
    selection: Selection,
) -> Result<Recordings, CliError> {
    let path = folder.file(RECORDINGS);
    // The recordings of an earlier, identical campaign may have been others.
    if path.exists() {
        fs::remove_dir_all(&path).map_err(|source| WriteError::new(&path, source))?;
    }
    let mut recorded = Recordings::new();
    let mut entries = Vec::new();
    for scenario in scenarios {
        for chosen in choose(folder, manifest, scenario, selection)? {
            fs::create_dir_all(&path).map_err(|source| WriteError::new(&path, source))?;
            let name = &scenario.config().name;
            let entry = record_one(folder, manifest, name, &chosen)?;
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

fn choose(
    folder: &Folder,
    manifest: &Manifest,
    scenario: &ScenarioFile,
    selection: Selection,
) -> Result<Vec<Chosen>, CliError> {
    let Some(ego) = scenario.ego_id() else { return Ok(Vec::new()) };
    let mut chooser = Chooser::new(selection, ego.clone());
    for record in folder.records()? {
        let record = record?;
        if record.scenario == scenario.config().name {
            chooser.take(&record);
        }
    }
    Ok(chooser.choose(manifest.sampling.seed))
}

fn record_one(folder: &Folder, manifest: &Manifest, scenario: &str, chosen: &Chosen) -> Result<IndexEntry, CliError> {
    let (concrete, key) = sample_of(folder, manifest, Some(scenario), chosen.sample)?;
    let films = films(&concrete, key, &arms(manifest)?, Level::Full)?;
    let file = format!("{scenario}-{}.rrd", chosen.sample);
    record_films(&folder.file(&format!("{RECORDINGS}/{file}")), &films)?;
    let paired = if films.len() > 1 { " --paired" } else { "" };
    let replay = format!(
        "closecall replay {} {} --scenario {scenario}{paired} --record {file}",
        folder.path().display(),
        chosen.sample
    );
    let story = films.iter().flat_map(|film| {
        let arm = film.arm();
        [Some(film.headline()), film.verdict_on_mis()].into_iter().flatten().map(move |line| format!("{arm}: {line}"))
    });
    Ok(IndexEntry {
        scenario: scenario.to_owned(),
        sample: chosen.sample,
        reasons: chosen.reasons.clone(),
        file,
        replay,
        story: story.collect(),
        still: films.last().map_or(String::new(), still),
        outcomes: films.iter().filter_map(|film| film.outcome().cloned()).collect(),
    })
}
