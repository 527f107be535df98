//! The files that a campaign writes into its folder at the end, all of them made from its journal.
//!
//! ```text
//!  journal ─▶ verdict on the console ─▶ junit.xml ─▶ summary of the CI server ─▶ tables ─▶ report ─▶ recordings ─▶ links to them
//! ```
//!
//! The most important files are written first. A file that cannot be written costs no other file,
//! and never the verdict: it is an [`ArtifactError`], which the caller shows. A recorded run that is
//! not the run of the campaign makes it INVALID.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use closecall_campaign::action::CommandFor;
use closecall_campaign::folder::{Folder, FolderError, RECORDINGS, RECORDINGS_PAGE, REPORT};
use closecall_campaign::integrity::Integrity;
use closecall_campaign::manifest::{Manifest, version};
use closecall_campaign::record::{ArmRecord, Record};
use closecall_campaign::runner::Work;
use closecall_campaign::saved::SavedCampaign;
use closecall_campaign::selection::Selection;
use closecall_campaign::verdict::Judgement;
use closecall_scenarios::ScenarioFile;
use closecall_traffic::atomic::WriteError;
use closecall_traffic::input;

use super::arm_pairs::write_arm_pairs;
use super::findings::{Findings, Recordings};
use super::html::write_html;
use super::junit::write_junit;
use super::markdown::{markdown, recorded, write_markdown};
use super::outcomes::{OutcomeRow, parameter_columns, write_outcomes};
use super::overview::ScenarioOverview;
use super::recordings::{Recorded, RecordedSample, Still, record};
use super::report_error::ReportError;
use super::samples_xml::{SuiteTotals, write_samples};
use super::tally::Tally;
use super::timings::{Timing, write_timings};

/// Number of samples that are listed as the slowest.
const SLOWEST: usize = 10;
/// The environment variable with the path of the file that GitHub's runners show as the summary of
/// a step.
const STEP_SUMMARY: &str = "GITHUB_STEP_SUMMARY";

/// A file that a campaign could not write. The verdict stands, and so do all other files.
#[derive(Debug, thiserror::Error)]
#[error("{artifact} is missing: {source}")]
pub struct ArtifactError {
    /// The missing file: its name, or the recording.
    pub artifact: String,
    /// Why.
    pub source: ReportError,
}

/// The files that a campaign has written at its end.
#[derive(Debug, Default)]
pub struct Written {
    /// The recordings.
    pub recorded: Vec<RecordedSample>,
    /// The recorded runs that are not the runs of the campaign, in words. The campaign is INVALID:
    /// the files that are written after the recordings say so.
    pub differences: Vec<String>,
    /// The files that could not be written.
    pub failures: Vec<ArtifactError>,
}

impl Written {
    /// Notes the failure of an artifact, if it is one.
    fn note<T, E: Into<ReportError>>(&mut self, artifact: &str, result: Result<T, E>) -> Option<T> {
        let fail = |error: E| ArtifactError { artifact: artifact.to_owned(), source: error.into() };
        result.map_err(|error| self.failures.push(fail(error))).ok()
    }
}

/// A finished campaign with its verdict.
#[derive(Clone, Copy, Debug)]
pub struct CampaignReport<'a> {
    /// How the campaign was made.
    pub manifest: &'a Manifest,
    /// The scenarios with their arms.
    pub works: &'a [Arc<Work>],
    /// The counts, and the further data of the reports.
    pub tally: &'a Tally,
    /// The verdict.
    pub judged: &'a Judgement,
    /// The commands for readers to copy.
    pub command_for: CommandFor,
}

/// The data of single samples in reports.
#[derive(Clone, Copy)]
struct Looks<'a> {
    /// The recordings.
    recordings: &'a Recordings,
    /// Pictures of recorded samples.
    stills: &'a [Still],
    /// The samples with the longest wall times.
    slowest: &'a [Timing],
}

impl CampaignReport<'_> {
    /// Writes every file into the folder, with recordings of the selected samples. A file that
    /// cannot be written costs no other.
    pub fn write(&self, folder: &Folder, selection: Selection) -> Written {
        let mut written = Written::default();
        let files = self.scenario_files();
        let (slowest, wall_s) = written.note("the wall times", self.wall_times(folder, &files)).unwrap_or_default();
        let none = Recordings::new();
        let without = Looks { recordings: &none, stills: &[], slowest: &slowest };
        let junit = self
            .with_findings(Some(folder), without, |findings| write_junit(&folder.file("junit.xml"), findings, &wall_s));
        written.note("junit.xml", junit);
        let summarised = written.note(&step_summary_name(), self.append_step_summary(Some(folder), without, markdown));
        let nominal: Vec<_> = files.iter().map(|file| file.space().nominal()).collect();
        let path = folder.file("outcomes.parquet");
        let outcomes = rows(folder, self.manifest)
            .map_err(ReportError::from)
            .and_then(|rows| write_outcomes(&path, Some(self.manifest), &parameter_columns(&nominal), rows));
        written.note("outcomes.parquet", outcomes);
        let timings = timings(folder, self.manifest)
            .map_err(ReportError::from)
            .and_then(|timings| Ok(write_timings(&folder.file("timings.parquet"), timings)?));
        written.note("timings.parquet", timings);
        if self.tally.summary.is_paired() {
            written.note("arm_pairs.parquet", write_arm_pairs(&folder.file("arm_pairs.parquet"), &self.tally.summary));
        }
        self.write_pages(folder, without, &mut written);
        let Recorded { paths, samples, stills, differences, failures } =
            match record(folder, &files, selection, self.command_for) {
                Ok(recorded) => recorded,
                Err(error) => {
                    written.note::<(), _>("the recordings", Err(error));
                    Recorded::default()
                }
            };
        written.recorded = samples;
        for (artifact, error) in failures {
            written.note::<(), _>(&artifact, Err(error));
        }
        if !paths.is_empty() {
            // Once more, with links to the recordings.
            let with = Looks { recordings: &paths, stills: &stills, slowest: &slowest };
            let mut judged = self.judged.clone();
            judged.add_invalid(differences.clone());
            let report = CampaignReport { judged: &judged, ..*self };
            report.write_pages(folder, with, &mut written);
            let junit = report.with_findings(Some(folder), with, |findings| {
                write_junit(&folder.file("junit.xml"), findings, &wall_s)
            });
            written.note("junit.xml", junit);
            if summarised.is_some() {
                let more = |findings: &Findings<'_>| recorded(findings, &differences);
                written.note(&step_summary_name(), report.append_step_summary(Some(folder), with, more));
            }
        }
        written.differences = differences;
        written.note("samples.xml", self.write_samples(folder, &paths));
        written
    }

    /// Writes the reports for human readers, with links to the recordings.
    fn write_pages(&self, folder: &Folder, looks: Looks<'_>, written: &mut Written) {
        self.with_findings(Some(folder), looks, |findings| {
            written.note(REPORT, write_html(&folder.file(REPORT), findings));
            written.note("summary.md", write_markdown(&folder.file("summary.md"), findings));
        });
    }

    fn write_samples(&self, folder: &Folder, recordings: &Recordings) -> Result<(), ReportError> {
        let with_recordings = rows(folder, self.manifest)?.map(|row| {
            row.map(|row| {
                let recording = recordings.get(&(row.scenario.clone(), row.sample, row.controller.clone())).cloned();
                (row, recording)
            })
        });
        let tested = self.tally.summary.controllers.last().map_or("", String::as_str);
        write_samples(&folder.file("samples.xml"), &self.suites(), tested, with_recordings)
    }

    /// Returns the slowest samples, and the wall time of each scenario (s), by name.
    fn wall_times(&self, folder: &Folder, files: &[&ScenarioFile]) -> Result<(Vec<Timing>, WallTimes), FolderError> {
        let mut slowest = Vec::with_capacity(SLOWEST + 1);
        let mut wall_s: WallTimes = files.iter().map(|file| (file.config().name.clone(), 0.0)).collect();
        for timing in timings(folder, self.manifest)? {
            keep_slowest(&mut slowest, &timing);
            if let Some((_, sum_s)) = wall_s.iter_mut().find(|(name, _)| *name == timing.scenario) {
                *sum_s += timing.wall_s;
            }
        }
        Ok((slowest, wall_s))
    }

    /// Appends the summary of a campaign without a folder to the file of the CI server.
    pub fn write_without_folder(&self) -> Written {
        let mut written = Written::default();
        let without = Looks { recordings: &Recordings::new(), stills: &[], slowest: &[] };
        written.note(&step_summary_name(), self.append_step_summary(None, without, markdown));
        written
    }

    fn scenario_files(&self) -> Vec<&ScenarioFile> {
        self.works.iter().map(|work| &work.file).collect()
    }

    fn suites(&self) -> Vec<SuiteTotals> {
        let suite = |scenario: &ScenarioOverview| SuiteTotals {
            scenario: scenario.name.clone(),
            tests: scenario.totals.iter().map(|arm| arm.samples).sum(),
            failures: scenario.totals.last().map_or(0, |tested| tested.failures),
            errors: scenario.totals.iter().map(|arm| arm.errors).sum(),
        };
        self.tally.overview.scenarios.iter().map(suite).collect()
    }

    fn with_findings<T>(
        &self,
        folder: Option<&Folder>,
        Looks { recordings, stills, slowest }: Looks<'_>,
        write: impl FnOnce(&Findings<'_>) -> T,
    ) -> T {
        let summary = &self.tally.summary;
        let gallery = format!("{RECORDINGS}/{RECORDINGS_PAGE}");
        let has_gallery = folder.is_some_and(|folder| folder.file(&gallery).exists());
        write(&Findings {
            manifest: self.manifest,
            files: &self.scenario_files(),
            summary,
            judged: self.judged,
            overview: &self.tally.overview,
            recordings,
            stills,
            gallery: has_gallery.then_some(gallery.as_str()),
            folder,
            slowest,
            command_for: self.command_for,
        })
    }

    /// Appends a text to the file that a CI server shows for this step, if there is one.
    fn append_step_summary(
        &self,
        folder: Option<&Folder>,
        looks: Looks<'_>,
        text: impl FnOnce(&Findings<'_>) -> String,
    ) -> Result<(), ReportError> {
        let Some(path) = std::env::var_os(STEP_SUMMARY).filter(|path| !path.is_empty()).map(PathBuf::from) else {
            return Ok(());
        };
        let text = self.with_findings(folder, looks, text);
        let written = input::append(&path).and_then(|mut file| file.write_all(text.as_bytes()));
        Ok(written.map_err(|source| WriteError::new(&path, source))?)
    }
}

/// Looks at a campaign's folder: its manifest, its journal, and whether the table of outcomes is
/// the one that the journal makes.
pub fn check_folder(folder: &Folder, command_for: CommandFor) -> Integrity {
    const TABLE: &str = "outcomes.parquet";
    let mut integrity = Integrity::of(folder, command_for);
    if !integrity.is_sound() || folder.campaign_of_fast_samples().is_some() {
        return integrity;
    }
    match is_table_of_journal(folder, TABLE) {
        Ok(true) => {}
        Ok(false) => {
            let message = "it is not the table of this journal".to_owned();
            integrity.add_resumable(TABLE, None, message);
        }
        Err(error) => integrity.add_resumable(TABLE, None, error.to_string()),
    }
    integrity
}

/// Returns true if the table has the bytes that the journal makes. Another release may write other
/// bytes.
fn is_table_of_journal(folder: &Folder, table: &str) -> Result<bool, ReportError> {
    let saved = SavedCampaign::of(folder.clone())?;
    let release = |version: &str| version.split('+').next().unwrap_or_default().to_owned();
    if release(&saved.manifest().closecall_version) != release(&version()) {
        return Ok(true);
    }
    let path = folder.file(table);
    let fail = |path: &Path, source| FolderError::Read { path: path.to_owned(), source };
    let length = |path: &Path| path.metadata().map(|file| file.len()).map_err(|source| fail(path, source));
    let read = |path: &Path| std::fs::read(path).map_err(|source| fail(path, source));
    let temporary = tempfile::tempdir().map_err(|source| WriteError::new(&path, source))?;
    let again = temporary.path().join(table);
    let works = saved.works()?;
    let nominal: Vec<_> = works.iter().map(|work| work.file.space().nominal()).collect();
    let rows = rows(folder, saved.manifest())?;
    write_outcomes(&again, Some(saved.manifest()), &parameter_columns(&nominal), rows)?;
    // A table of another length is not read: it may be of any size.
    Ok(length(&path)? == length(&again)? && read(&path)? == read(&again)?)
}

/// The wall time of each scenario (s), by name.
type WallTimes = Vec<(String, f64)>;

/// Returns the name of the CI server's file in messages.
fn step_summary_name() -> String {
    format!("the summary for the CI server ({STEP_SUMMARY})")
}

fn keep_slowest(slowest: &mut Vec<Timing>, timing: &Timing) {
    let index = slowest.partition_point(|slower| slower.wall_s >= timing.wall_s);
    if index < SLOWEST {
        slowest.insert(index, timing.clone());
        slowest.truncate(SLOWEST);
    }
}

/// Returns the wall times of all samples, one for each arm.
fn timings(folder: &Folder, manifest: &Manifest) -> Result<impl Iterator<Item = Timing> + use<>, FolderError> {
    let controllers = manifest.arm_names();
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

/// Returns the rows of all journal records, one for each arm.
fn rows(
    folder: &Folder,
    manifest: &Manifest,
) -> Result<impl Iterator<Item = Result<OutcomeRow, ReportError>> + use<>, FolderError> {
    let seed = manifest.sampling.seed;
    let of_record = move |record: Result<Record, FolderError>| -> Vec<Result<OutcomeRow, ReportError>> {
        let record = match record {
            Ok(record) => record,
            Err(error) => return vec![Err(error.into())],
        };
        let (scenario, sample) = (record.scenario, record.sample);
        let row = |arm: ArmRecord| OutcomeRow {
            scenario: scenario.clone(),
            seed,
            sample,
            controller: arm.controller,
            result: arm.result,
        };
        record.arms.into_iter().map(row).map(Ok).collect()
    };
    Ok(folder.records()?.flat_map(of_record))
}
