//! What a campaign leaves in its folder once it is over, all made from its journal.

use std::fs::OpenOptions;
use std::io::Write;
use std::path::PathBuf;
use std::sync::Arc;

use closecall_traffic::ActorId;

use super::CliError;
use super::recordings::{INDEX, RECORDINGS, record};
use crate::campaign::folder::{Folder, FolderError};
use crate::campaign::manifest::Manifest;
use crate::campaign::record::Record;
use crate::campaign::runner::Work;
use crate::campaign::selection::Selection;
use crate::campaign::summary::Summary;
use crate::campaign::verdict::{Gates, Judgement};
use crate::report::WriteError;
use crate::report::findings::{Findings, Recordings};
use crate::report::html::write_html;
use crate::report::junit::{SuiteTotals, write_junit};
use crate::report::markdown::{markdown, write_markdown};
use crate::report::outcomes::{OutcomeRow, parameter_columns, write_outcomes};
use crate::report::overview::Overview;
use crate::report::requirements::requirements;
use crate::report::timings::{Timing, write_timings};
use crate::scenario::ScenarioFile;

/// Samples that are listed as the slowest.
const SLOWEST: usize = 10;
/// Where GitHub's runners show what a step has to say.
const STEP_SUMMARY: &str = "GITHUB_STEP_SUMMARY";

/// A campaign that is over.
pub(super) struct Over<'a> {
    /// How it was made.
    pub(super) manifest: &'a Manifest,
    /// The scenarios.
    pub(super) works: &'a [Arc<Work>],
    /// The counts.
    pub(super) summary: &'a Summary,
    /// What the page shows.
    pub(super) overview: &'a Overview,
    /// What it was judged by.
    pub(super) gates: Gates,
    /// The verdict.
    pub(super) judged: &'a Judgement,
}

impl Over<'_> {
    /// Writes every report into the folder, with recordings of the selected samples.
    pub(super) fn leave(&self, folder: &Folder, selection: Selection) -> Result<(), CliError> {
        let files: Vec<&ScenarioFile> = self.works.iter().map(|work| &work.file).collect();
        let nominal: Vec<_> = files.iter().map(|file| file.space().nominal()).collect();
        let rows = || rows(folder, &files, self.manifest);
        write_outcomes(&folder.file("outcomes.parquet"), &parameter_columns(&nominal), rows()?)?;
        let mut slowest = Vec::with_capacity(SLOWEST + 1);
        let timings = timings(folder, self.manifest)?.inspect(|timing| keep_slowest(&mut slowest, timing));
        write_timings(&folder.file("timings.parquet"), timings)?;
        let recorded = record(folder, self.manifest, &files, selection)?;
        let with_recordings = rows()?.map(|row| {
            row.map(|row| {
                let recording = recorded.get(&(row.scenario.clone(), row.sample, row.controller.clone())).cloned();
                (row, recording)
            })
        });
        write_junit(&folder.file("junit.xml"), &self.suites(), with_recordings)?;
        self.with_findings(&files, Some(folder), &recorded, &slowest, |findings| {
            write_html(&folder.file("report.html"), findings)?;
            write_markdown(&folder.file("summary.md"), findings)
        })?;
        self.tell_runner(&files, Some(folder), &recorded)
    }

    /// Leaves what can be left without a folder.
    pub(super) fn leave_no_folder(&self) -> Result<(), CliError> {
        let files: Vec<&ScenarioFile> = self.works.iter().map(|work| &work.file).collect();
        self.tell_runner(&files, None, &Recordings::new())
    }

    fn suites(&self) -> Vec<SuiteTotals> {
        let suite = |scenario: &crate::report::overview::ScenarioOverview| SuiteTotals {
            scenario: scenario.name.clone(),
            tests: scenario.totals.iter().map(|arm| arm.samples).sum(),
            failures: scenario.totals.iter().map(|arm| arm.failures).sum(),
            errors: scenario.totals.iter().map(|arm| arm.errors).sum(),
        };
        self.overview.scenarios.iter().map(suite).collect()
    }

    fn with_findings<T>(
        &self,
        files: &[&ScenarioFile],
        folder: Option<&Folder>,
        recordings: &Recordings,
        slowest: &[Timing],
        write: impl FnOnce(&Findings<'_>) -> T,
    ) -> T {
        let requirements = requirements(files.iter().copied(), self.summary, self.gates);
        let gallery = format!("{RECORDINGS}/{INDEX}");
        let has_gallery = folder.is_some_and(|folder| folder.file(&gallery).exists());
        write(&Findings {
            manifest: self.manifest,
            files,
            summary: self.summary,
            judged: self.judged,
            requirements: &requirements,
            overview: self.overview,
            recordings,
            gallery: has_gallery.then_some(gallery.as_str()),
            slowest,
        })
    }

    /// Adds the summary to what a CI server shows of this step, where one asks for it.
    fn tell_runner(
        &self,
        files: &[&ScenarioFile],
        folder: Option<&Folder>,
        recordings: &Recordings,
    ) -> Result<(), CliError> {
        let Some(path) = std::env::var_os(STEP_SUMMARY).filter(|path| !path.is_empty()).map(PathBuf::from) else {
            return Ok(());
        };
        let text = self.with_findings(files, folder, recordings, &[], markdown);
        let opened = OpenOptions::new().create(true).append(true).open(&path);
        let written = opened.and_then(|mut file| file.write_all(text.as_bytes()));
        Ok(written.map_err(|source| WriteError::new(&path, source))?)
    }
}

fn keep_slowest(slowest: &mut Vec<Timing>, timing: &Timing) {
    let place = slowest.partition_point(|slower| slower.wall_s >= timing.wall_s);
    if place < SLOWEST {
        slowest.insert(place, timing.clone());
        slowest.truncate(SLOWEST);
    }
}

/// The wall times, one row for each arm.
fn timings(folder: &Folder, manifest: &Manifest) -> Result<impl Iterator<Item = Timing> + use<>, CliError> {
    let controllers: Vec<String> = manifest.arms.iter().map(|arm| arm.name().to_owned()).collect();
    Ok(folder.wall_times()?.flat_map(move |time| {
        let of_arm = |(controller, wall_s): (&String, f64)| Timing {
            scenario: time.scenario.clone(),
            sample: time.sample,
            controller: controller.clone(),
            wall_s,
        };
        controllers.iter().zip(time.wall_s).map(of_arm).collect::<Vec<_>>()
    }))
}

/// The journal's records, one row for each arm.
fn rows<'a>(
    folder: &Folder,
    files: &'a [&'a ScenarioFile],
    manifest: &'a Manifest,
) -> Result<impl Iterator<Item = Result<OutcomeRow, CliError>> + use<'a>, CliError> {
    let of_record = move |record: Result<Record, FolderError>| -> Vec<Result<OutcomeRow, CliError>> {
        let record = match record {
            Ok(record) => record,
            Err(error) => return vec![Err(error.into())],
        };
        let Some(ego) = ego(files, &record.scenario) else { return Vec::new() };
        let row = |arm: crate::campaign::record::ArmRecord| {
            Ok(OutcomeRow {
                scenario: record.scenario.clone(),
                ego: ego.clone(),
                seed: manifest.sampling.seed,
                sample: record.sample,
                controller: arm.controller,
                result: arm.result,
            })
        };
        record.arms.into_iter().map(row).collect()
    };
    Ok(folder.records()?.flat_map(of_record))
}

fn ego<'a>(files: &[&'a ScenarioFile], scenario: &str) -> Option<&'a ActorId> {
    files.iter().find(|file| file.config().name == scenario)?.ego_id()
}
