//! Recordings of selected samples of a campaign, and the page that shows them.

use std::fs;
use std::path::PathBuf;

use closecall_campaign::action::{Action, CommandFor, Replay, SavedSample};
use closecall_campaign::folder::{Folder, RECORDINGS, RECORDINGS_PAGE};
use closecall_campaign::saved::SavedCampaign;
use closecall_campaign::selection::{Chooser, Chosen, KindChooser, Selection};
use closecall_scenarios::ScenarioFile;
use closecall_traffic::atomic::{WriteError, create_folder, write_file};

use super::findings::Recordings;
use super::html::{IndexEntry, write_index};
use super::origins::ORIGINS;
use super::report_error::ReportError;
use crate::run::figure::{card, scrubber, still};
use crate::run::film::{Film, Level, film_arms};
use crate::run::rerun::write_recording_of;

/// A recording of a sample.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordedSample {
    /// The scenario's name.
    pub scenario: String,
    /// The sample's number.
    pub sample: u64,
    /// The reasons for its recording, in words.
    pub reasons: Vec<&'static str>,
    /// The file.
    pub path: PathBuf,
}

/// A picture of a recorded sample at its critical moment.
#[derive(Clone, Debug)]
pub struct Still {
    /// The scenario's name.
    pub scenario: String,
    /// The sample's number.
    pub sample: u64,
    /// The verdict on the pair, or on the only run.
    pub verdict: &'static str,
    /// The event in the arm under test and its cause, in one sentence.
    pub sentence: String,
    /// The picture, as SVG.
    pub svg: String,
}

impl Still {
    fn of(entry: &IndexEntry) -> Self {
        let IndexEntry { scenario, sample, verdict, sentence, still, .. } = entry;
        let (scenario, sentence, svg) = (scenario.clone(), sentence.clone(), still.clone());
        Self { scenario, sample: *sample, verdict, sentence, svg }
    }

    /// Returns whether a vehicle collides in the arm under test.
    pub(super) fn is_failure(&self) -> bool {
        matches!(self.verdict, "INDUCED" | "BOTH COLLIDE" | "COLLISION")
    }
}

/// Returns the path of the incident card beside a recording.
pub(super) fn card_beside(recording: &str) -> String {
    recording.strip_suffix(".rrd").map_or_else(String::new, |stem| format!("{stem}.html"))
}

/// The results of the recording.
#[derive(Default)]
pub(super) struct Recorded {
    /// The paths of the recordings, for the reports.
    pub(super) paths: Recordings,
    /// The recordings in the order of the page.
    pub(super) samples: Vec<RecordedSample>,
    /// Pictures of the recorded samples, in the same order.
    pub(super) stills: Vec<Still>,
    /// The recorded runs that are not the runs of the campaign, in words.
    pub(super) differences: Vec<String>,
    /// The recordings that failed, in words, and the reasons.
    pub(super) failures: Vec<(String, ReportError)>,
}

/// Runs the selected samples again, compares them with the journal, records all arms of each in one
/// file, and writes the page. A sample that cannot be recorded costs no other.
pub(super) fn record(
    folder: &Folder,
    scenarios: &[&ScenarioFile],
    selection: Selection,
    command_for: CommandFor,
) -> Result<Recorded, ReportError> {
    let saved = SavedCampaign::of(folder.clone())?;
    let path = folder.file(RECORDINGS);
    // A previous identical campaign may have recorded other samples.
    if path.try_exists().map_err(|source| WriteError::new(&path, source))? {
        fs::remove_dir_all(&path).map_err(|source| WriteError::new(&path, source))?;
    }
    let (mut recorded, mut entries) = (Recorded::default(), Vec::new());
    for (name, chosen) in choose(&saved, scenarios, selection)? {
        create_folder(&path)?;
        let entry = match record_one(&saved, name, &chosen, command_for) {
            Ok(entry) => entry,
            Err(error) => {
                recorded.failures.push((format!("the recording of sample {} of {name}", chosen.sample), error));
                continue;
            }
        };
        // A report that shows recorded traffic shows the simulated sample beside it.
        if folder.file(ORIGINS).exists() {
            let picture = path.join(format!("{name}-{}.svg", chosen.sample));
            if let Err(error) = write_file(&picture, |file| file.write_all(entry.still.as_bytes())) {
                recorded.failures.push((format!("the picture of sample {} of {name}", chosen.sample), error.into()));
            }
        }
        for outcome in &entry.outcomes {
            let key = (name.to_owned(), chosen.sample, outcome.controller.clone());
            recorded.paths.insert(key, format!("{RECORDINGS}/{}", entry.file));
        }
        recorded.stills.push(Still::of(&entry));
        let (scenario, path) = (name.to_owned(), path.join(&entry.file));
        recorded.samples.push(RecordedSample { scenario, sample: chosen.sample, reasons: chosen.reasons, path });
        entries.push(entry);
    }
    recorded.differences = folder.differences(entries.iter().flat_map(|entry| &entry.outcomes))?;
    if !entries.is_empty()
        && let Err(error) = write_index(&path.join(RECORDINGS_PAGE), &entries, command_for)
    {
        recorded.failures.push((format!("{RECORDINGS}/{RECORDINGS_PAGE}"), error.into()));
    }
    Ok(recorded)
}

/// Returns the selected samples with their scenarios: first the worst of each kind, then the
/// samples of each scenario.
fn choose<'a>(
    saved: &SavedCampaign,
    scenarios: &[&'a ScenarioFile],
    selection: Selection,
) -> Result<Vec<(&'a str, Chosen)>, ReportError> {
    let mut choosers: Vec<_> = scenarios.iter().map(|file| (*file, Chooser::new(selection))).collect();
    let mut kinds = KindChooser::default();
    for record in saved.folder().records()? {
        let record = record?;
        if selection.each_kind {
            kinds.push(&record);
        }
        if let Some((_, chooser)) = choosers.iter_mut().find(|(file, _)| file.config().name == record.scenario) {
            chooser.push(&record);
        }
    }
    let mut all: Vec<(&str, Chosen)> = Vec::new();
    for (kind, name, sample) in kinds.choose() {
        if let Some(file) = scenarios.iter().find(|file| file.config().name == name) {
            all.push((&file.config().name, Chosen { sample, reasons: vec![kind.reason()] }));
        }
    }
    for (file, chooser) in &choosers {
        let (name, Some(ego)) = (&file.config().name, file.ego_id()) else { continue };
        for chosen in chooser.choose(saved.manifest().sampling.seed, ego) {
            match all.iter_mut().find(|(scenario, recorded)| scenario == name && recorded.sample == chosen.sample) {
                Some((_, recorded)) => recorded.reasons.extend(chosen.reasons),
                None => all.push((name, chosen)),
            }
        }
    }
    Ok(all)
}

fn record_one(
    saved: &SavedCampaign,
    scenario: &str,
    chosen: &Chosen,
    command_for: CommandFor,
) -> Result<IndexEntry, ReportError> {
    let sample = chosen.sample;
    let (concrete, key) = saved.sample(Some(scenario), sample)?;
    let films = film_arms(&concrete, key, &saved.manifest().arms(), Level::Full)
        .map_err(|source| ReportError::Sample { sample, source })?;
    let settings = saved.manifest().settings();
    let named = |film: Film| film.with_settings(settings.iter().map(ToString::to_string));
    let films: Vec<Film> = films.into_iter().map(named).collect();
    let file = format!("{scenario}-{sample}.rrd");
    let is_paired = films.len() > 1;
    // The folder may be moved, so the command names it relative to the folder of the page.
    let replay_from = |folder| {
        let saved_sample = SavedSample { folder, sample, scenario: Some(scenario) };
        command_for(&Action::Replay(Replay { is_paired, recording: Some(&file), ..Replay::new(saved_sample) }))
    };
    let replay = replay_from("..");
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
        sentence: films.last().and_then(Film::sentence_text).unwrap_or_default(),
        outcomes: films.iter().filter_map(|film| film.outcome().cloned()).collect(),
    };
    let in_folder = replay_from(".");
    let card_path = saved.folder().file(&card_beside(&format!("{RECORDINGS}/{file}")));
    write_file(&card_path, |card_file| card_file.write_all(card(&films, &in_folder).as_bytes()))?;
    write_recording_of(&saved.folder().file(&format!("{RECORDINGS}/{file}")), films)?;
    Ok(entry)
}
