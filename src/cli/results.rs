//! Where a campaign keeps its results: in the folder of `--out`, nowhere with `--no-out`, else in
//! `closecall-results`.
//!
//! Nobody has asked for the default folder. If it cannot be written, because the disk is full or
//! the working folder read-only, the campaign goes on without it, prints its verdict, and ends with
//! the exit code of a file that cannot be written. If something else is at its path, nothing runs.

use std::path::{Path, PathBuf};

use clap::Args;
use closecall_campaign::action::{Action, Resume};
use closecall_campaign::execution::Campaign;
use closecall_campaign::folder::{Folder, FolderError, LockedFolder, REPORT};
use closecall_campaign::manifest::Manifest;
use closecall_campaign::rare::RareManifest;
use closecall_campaign::results::{Moved, RESULTS, Unfinished, check_inputs, resume, take};
use closecall_campaign::saved::SavedCampaign;
use closecall_campaign::selection::Selection;
use closecall_campaign::verdict::Verdict;
use closecall_report::campaign::{RecordedSample, Written};
use closecall_report::run::rerun::is_recording_enabled;
use closecall_traffic::atomic::WriteError;
use serde::Deserialize;

use super::CliError;
use super::actions::{command_for, quoted};
use super::help::heading;
use super::output::{print_error, print_report_files, warn};
use super::protect::{files_of_controller, files_of_scenario};
use crate::exit_code::ExitCode;

/// Largest number of recordings that are named one by one.
const NAMED_RECORDINGS: usize = 3;
/// The program that opens a page in the browser.
const OPEN: &str = if cfg!(target_os = "macos") {
    "open"
} else if cfg!(windows) {
    "start"
} else {
    "xdg-open"
};

/// The place in which a campaign keeps its results.
#[derive(Clone, Debug, Default, Args, Deserialize)]
#[serde(default)]
pub(super) struct ResultsArgs {
    /// Folder for the results: manifest, journal, Parquet tables, JUnit and HTML reports, and
    /// recordings. It must be new or empty [default: closecall-results; the results of the last
    /// campaign become closecall-results.previous, but unfinished ones do not replace finished ones]
    #[arg(short, long, value_name = "DIR", help_heading = heading::OUTPUT)]
    out: Option<PathBuf>,
    /// Keep no results, only print them
    #[arg(long, conflicts_with_all = ["out", "resume"], help_heading = heading::OUTPUT)]
    #[serde(skip)]
    no_out: bool,
    /// Resume the interrupted campaign in the folder of --out, or in closecall-results
    #[arg(long, help_heading = heading::EXECUTION)]
    resume: bool,
}

/// The place of the results.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place<'a> {
    /// The results are not kept.
    Nowhere,
    /// The folder that the command line names.
    Named(&'a Path),
    /// The default folder.
    Default,
}

impl ResultsArgs {
    /// Returns the arguments of a campaign that keeps its results in a folder.
    pub(super) fn named(folder: &Path, resume: bool) -> Self {
        Self { out: Some(folder.to_owned()), no_out: false, resume }
    }

    /// Returns true if an interrupted campaign is to go on.
    pub(super) const fn is_resumed(&self) -> bool {
        self.resume
    }

    /// Returns the folder and the manifest of the campaign that is to be resumed, if there is one.
    pub(super) fn resumed(&self) -> Option<(&Path, Manifest)> {
        let folder = self.folder().filter(|_| self.resume)?;
        let rare = || RareManifest::read(folder).map(|manifest| manifest.campaign);
        let manifest = SavedCampaign::open(folder).ok().map(|saved| saved.manifest().clone()).or_else(rare);
        manifest.map(|manifest| (folder, manifest))
    }

    /// Returns the folder of the results; `None` if they are not kept.
    pub(super) fn folder(&self) -> Option<&Path> {
        match self.place() {
            Place::Named(path) => Some(path),
            Place::Default => Some(Path::new(RESULTS)),
            Place::Nowhere => None,
        }
    }

    /// Returns the place of the results.
    pub(super) fn place(&self) -> Place<'_> {
        match &self.out {
            Some(path) => Place::Named(path),
            None if self.no_out => Place::Nowhere,
            None => Place::Default,
        }
    }
}

/// The consequence of a missing report.
#[derive(Clone, Copy, Debug, Default, Args, Deserialize)]
#[serde(default)]
pub(super) struct ArtifactArgs {
    /// End with the exit code of the failure if a report or a recording cannot be written. Without
    /// it, that is a warning, and the verdict decides
    #[arg(long, help_heading = heading::OUTPUT)]
    strict_artifacts: bool,
}

impl ArtifactArgs {
    /// Returns true if the option is named.
    pub(super) const fn is_named(self) -> bool {
        self.strict_artifacts
    }

    /// Prints a warning for each report or recording that could not be written, and each recorded run
    /// that is not the run of the campaign. Returns the exit code. `verdict` is the code of the
    /// verdict.
    pub(super) fn code(self, verdict: ExitCode, written: &Written) -> ExitCode {
        for difference in &written.differences {
            print_error(format_args!("{}: {difference}\n", Verdict::Invalid));
        }
        let verdict = ExitCode::first_of(written.differences.iter().map(|_| ExitCode::Invalid).chain([verdict]));
        for failure in &written.failures {
            warn(failure);
        }
        if !written.failures.is_empty() {
            print_error(format_args!(
                "the verdict stands; the same command with --resume writes what is missing, --out DIR names another folder, --no-out keeps \
                 no results\n"
            ));
        }
        let codes = written.failures.iter().map(|failure| ExitCode::from(failure.source.kind()));
        match self.strict_artifacts {
            true => ExitCode::first_of(codes.chain([verdict])),
            false => verdict,
        }
    }
}

/// The folder of a running campaign.
#[derive(Debug)]
pub(super) struct Results {
    pub(super) locked: Option<LockedFolder>,
    /// The reason for which the results are not kept completely, if they should be.
    lost: Option<CliError>,
}

impl Results {
    /// Locks the folder of a campaign. Tells the campaign whether it may go on without the folder.
    pub(super) fn start(args: &ResultsArgs, campaign: &mut Campaign, manifest: &Manifest) -> Result<Self, CliError> {
        let (locked, lost) = match args.place() {
            Place::Nowhere => (None, None),
            Place::Named(path) => (Some(Folder::lock(path, manifest, args.resume)?), None),
            Place::Default => {
                campaign.goes_on_without_folder = true;
                match in_default_folder(args.resume, campaign, manifest) {
                    Ok(locked) => (Some(locked), None),
                    Err(error) if may_go_on(&error) && !args.resume => {
                        warn(format_args!(
                            "{error}: the results will not be kept; name a folder with --out DIR, or keep none with --no-out"
                        ));
                        (None, Some(CliError::Results(error)))
                    }
                    Err(error) => return Err(CliError::Results(error)),
                }
            }
        };
        if let Some(locked) = &locked {
            remember_here(&locked.folder, manifest);
        }
        Ok(Self { locked, lost })
    }

    /// Returns the folder if it holds every result so far.
    pub(super) fn complete(&self) -> Option<&Folder> {
        self.locked.as_ref().map(|locked| &locked.folder).filter(|_| self.lost.is_none())
    }

    /// Notes that the last results could not be written.
    pub(super) fn lose(&mut self, error: Option<WriteError>) {
        if let Some(error) = error {
            self.lost = Some(CliError::ResultsCut(error));
        }
    }

    /// Returns the reason for which the results are not kept completely, if they should be.
    pub(super) fn into_lost(self) -> Option<CliError> {
        self.lost
    }
}

/// Remembers that the folder of a running campaign is the user's own, if its commands run in this
/// working folder.
pub(super) fn remember_here(folder: &Folder, manifest: &Manifest) {
    if folder.manifest().is_ok_and(|saved| saved.working_folder == manifest.working_folder) {
        remember(folder);
    }
}

/// Remembers that the folder is the user's own. If that fails, a later command neither runs the code
/// that the folder names nor repeats its command line.
pub(super) fn remember(folder: &Folder) {
    let has_code = !folder.manifest().is_ok_and(|manifest| manifest.foreign_code().is_empty());
    if let Err(error) = folder.remember()
        && has_code
    {
        warn(format_args!("{error}: commands that run samples of the folder again need --trust-folder"));
    }
}

/// Locks the default folder, and reports the place of earlier results.
fn in_default_folder(is_resumed: bool, campaign: &Campaign, manifest: &Manifest) -> Result<LockedFolder, FolderError> {
    let scenarios = campaign.works.iter().flat_map(|work| files_of_scenario(&work.file));
    let inputs: Vec<PathBuf> = scenarios.chain(manifest.arms.iter().flat_map(files_of_controller)).collect();
    let working_folder = Path::new("");
    check_inputs(working_folder, &inputs)?;
    if is_resumed {
        return resume(working_folder, manifest);
    }
    let taken = take(working_folder, manifest, |Unfinished { path, previous }| {
        print_error(format_args!(
            "the campaign in {} is unfinished: it is replaced, and {} keeps the last finished results\n",
            path.display(),
            previous.display()
        ));
    })?;
    if let Some(Moved { to, interrupted, has_removed }) = taken.moved {
        let removed = if has_removed { ", in place of older ones" } else { "" };
        print_error(format_args!("the last results are now in {}{removed}\n", to.display()));
        if let Some(command) = interrupted {
            let folder = to.display().to_string();
            let resumed =
                Resume { command: &command, retries_errors: false, moved_to: Some(&folder), working_folder: None };
            let resume = command_for(&Action::Resume(resumed));
            print_error(format_args!("their campaign is unfinished; it is resumed by: {resume}\n"));
        }
    }
    Ok(taken.locked)
}

/// Returns the samples to record: the samples of the command line, else the worst of each kind. The
/// environment can switch off recordings that the command line does not ask for.
pub(super) fn selection(named: Option<Selection>) -> Selection {
    named.unwrap_or_else(|| Selection { each_kind: is_recording_enabled(), ..Selection::default() })
}

/// Returns true if a campaign may go on without its default folder, because the folder cannot be
/// written. After any other error, nothing runs.
fn may_go_on(error: &FolderError) -> bool {
    matches!(error, FolderError::Write(_))
}

/// Prints to standard error which files a campaign has written, and the commands that open its
/// report and its recordings.
pub(super) fn print_results(folder: &Folder, recorded: &[RecordedSample]) {
    print_report_files(folder);
    let word = |path: &Path| quoted(&path.display().to_string());
    if folder.file(REPORT).is_file() {
        print_error(format_args!("look: {OPEN} {}\n", word(&folder.file(REPORT))));
    }
    for RecordedSample { scenario, sample, reasons, path } in recorded.iter().take(NAMED_RECORDINGS) {
        let why = reasons.join(", ");
        print_error(format_args!("look: closecall view {}  # {why}: sample {sample} of {scenario}\n", word(path)));
    }
    if let Some(more) = recorded.len().checked_sub(NAMED_RECORDINGS).filter(|more| *more > 0) {
        print_error(format_args!("look: closecall view {}  # {more} more recordings\n", word(folder.path())));
    }
}

/// Returns the folder of the last results in the working folder.
pub(super) fn last_results() -> Result<Folder, CliError> {
    let path = Path::new(RESULTS);
    if !path.is_dir() {
        return Err(CliError::usage(format!(
            "there are no results here: `closecall campaign SCENARIO` writes them to {RESULTS}; or name a recording or a folder"
        )));
    }
    let folder = Folder::open(path);
    if !folder.file(REPORT).is_file() {
        return Err(CliError::usage(format!(
            "{RESULTS} has no report: its campaign is unfinished; the same command with --resume continues it"
        )));
    }
    Ok(folder)
}
