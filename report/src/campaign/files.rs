//! The files that a campaign writes into its folder at the end, all of them made from its journal.

use std::fs::OpenOptions;
use std::io::Write;
use std::path::PathBuf;
use std::sync::Arc;

use closecall_campaign::failure::FailureKind;
use closecall_campaign::folder::{Folder, FolderError, RECORDINGS, RECORDINGS_PAGE, REPORT};
use closecall_campaign::manifest::Manifest;
use closecall_campaign::record::{ArmRecord, Record};
use closecall_campaign::runner::Work;
use closecall_campaign::saved::SavedError;
use closecall_campaign::selection::Selection;
use closecall_campaign::verdict::Judgement;
use closecall_scenarios::ScenarioFile;
use closecall_simulation::SampleError;
use closecall_traffic::atomic::WriteError;

use super::arm_pairs::write_arm_pairs;
use super::findings::{Findings, Recordings};
use super::html::write_html;
use super::junit::write_junit;
use super::markdown::{markdown, write_markdown};
use super::outcomes::{OutcomeRow, parameter_columns, write_outcomes};
use super::overview::ScenarioOverview;
use super::recordings::{RecordedSample, record};
use super::samples_xml::{SuiteTotals, write_samples};
use super::tally::Tally;
use super::timings::{Timing, write_timings};
use crate::run::rerun::RecordingError;

/// Number of samples that are listed as the slowest.
const SLOWEST: usize = 10;
/// The environment variable with the path of the file that GitHub's runners show as the summary of a step.
const STEP_SUMMARY: &str = "GITHUB_STEP_SUMMARY";

/// A report that cannot be made. The journal stays as it is.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The folder cannot be read.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// The saved campaign cannot be read back.
    #[error(transparent)]
    Saved(#[from] SavedError),
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// A recording cannot be written.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A sample that had an outcome has none when it is run again for its recording.
    #[error("failed to run sample {sample}: {source}")]
    Sample {
        /// The sample's number.
        sample: u64,
        /// Why it has no outcome.
        source: SampleError,
    },
}

impl ReportError {
    /// Returns the kind of the error.
    pub fn kind(&self) -> FailureKind {
        match self {
            Self::Folder(error) => FailureKind::from(error),
            Self::Saved(error) => FailureKind::from(error),
            Self::Write(_) | Self::Recording(_) => FailureKind::Io,
            Self::Sample { .. } => FailureKind::Sample,
        }
    }
}

/// A finished campaign with its verdict.
#[derive(Clone, Copy, Debug)]
pub struct CampaignReport<'a> {
    /// How the campaign was made.
    pub manifest: &'a Manifest,
    /// The scenarios with their arms.
    pub works: &'a [Arc<Work>],
    /// The counts, and what the reports show beside them.
    pub tally: &'a Tally,
    /// The verdict.
    pub judged: &'a Judgement,
}

impl CampaignReport<'_> {
    /// Writes every file into the folder, with recordings of the selected samples, which are returned.
    ///
    /// # Errors
    /// [`ReportError`] if the journal cannot be read or a file cannot be written; the files that exist are complete.
    pub fn write(&self, folder: &Folder, selection: Selection) -> Result<Vec<RecordedSample>, ReportError> {
        let files = self.scenario_files();
        let nominal: Vec<_> = files.iter().map(|file| file.space().nominal()).collect();
        let rows = || rows(folder, self.manifest);
        write_outcomes(&folder.file("outcomes.parquet"), Some(self.manifest), &parameter_columns(&nominal), rows()?)?;
        let mut slowest = Vec::with_capacity(SLOWEST + 1);
        let mut wall_s: Vec<(String, f64)> = files.iter().map(|file| (file.config().name.clone(), 0.0)).collect();
        let timings = timings(folder, self.manifest)?.inspect(|timing| {
            keep_slowest(&mut slowest, timing);
            if let Some((_, sum_s)) = wall_s.iter_mut().find(|(name, _)| *name == timing.scenario) {
                *sum_s += timing.wall_s;
            }
        });
        write_timings(&folder.file("timings.parquet"), timings)?;
        let (recorded, samples) = record(folder, &files, selection)?;
        let with_recordings = rows()?.map(|row| {
            row.map(|row| {
                let recording = recorded.get(&(row.scenario.clone(), row.sample, row.controller.clone())).cloned();
                (row, recording)
            })
        });
        let tested = self.tally.summary.controllers.last().map_or("", String::as_str);
        write_samples(&folder.file("samples.xml"), &self.suites(), tested, with_recordings)?;
        if self.tally.summary.is_paired() {
            write_arm_pairs(&folder.file("arm_pairs.parquet"), &self.tally.summary)?;
        }
        self.with_findings(&files, Some(folder), &recorded, &slowest, |findings| {
            write_junit(&folder.file("junit.xml"), findings, &wall_s)?;
            write_html(&folder.file(REPORT), findings)?;
            write_markdown(&folder.file("summary.md"), findings)
        })?;
        self.append_step_summary(Some(folder), &recorded)?;
        Ok(samples)
    }

    /// Appends the summary of a campaign without a folder to the file of the CI server.
    ///
    /// # Errors
    /// [`ReportError::Write`] if the CI server's file cannot be written.
    pub fn write_without_folder(&self) -> Result<(), ReportError> {
        self.append_step_summary(None, &Recordings::new())
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
        files: &[&ScenarioFile],
        folder: Option<&Folder>,
        recordings: &Recordings,
        slowest: &[Timing],
        write: impl FnOnce(&Findings<'_>) -> T,
    ) -> T {
        let summary = &self.tally.summary;
        let gallery = format!("{RECORDINGS}/{RECORDINGS_PAGE}");
        let has_gallery = folder.is_some_and(|folder| folder.file(&gallery).exists());
        write(&Findings {
            manifest: self.manifest,
            files,
            summary,
            judged: self.judged,
            overview: &self.tally.overview,
            recordings,
            gallery: has_gallery.then_some(gallery.as_str()),
            folder,
            slowest,
        })
    }

    /// Appends the summary to the file that a CI server shows for this step, if there is one.
    fn append_step_summary(&self, folder: Option<&Folder>, recordings: &Recordings) -> Result<(), ReportError> {
        let Some(path) = std::env::var_os(STEP_SUMMARY).filter(|path| !path.is_empty()).map(PathBuf::from) else {
            return Ok(());
        };
        let text = self.with_findings(&self.scenario_files(), folder, recordings, &[], markdown);
        let opened = OpenOptions::new().create(true).append(true).open(&path);
        let written = opened.and_then(|mut file| file.write_all(text.as_bytes()));
        Ok(written.map_err(|source| WriteError::new(&path, source))?)
    }
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
