//! The folder of a campaign whose samples run again: its owner, and the limits of its controllers.

use std::path::Path;

use clap::Args;
use closecall_campaign::arguments::{MemoryMib, TimeoutMs};
use closecall_campaign::folder::Folder;
use closecall_campaign::rare::RareManifest;
use closecall_campaign::saved::SavedCampaign;
use closecall_scenarios::outcome::Outcome;
use serde::Deserialize;

use super::CliError;
use super::help::heading;
use super::output::print_error;

/// Whether the code that a folder names may run.
#[derive(Clone, Copy, Debug, Args)]
pub(super) struct TrustArgs {
    /// Run the commands, libraries and FMUs that the folder names, although another machine or
    /// another user has written it, as with the artifact of a CI job. The names are printed first
    #[arg(long, help_heading = heading::CONTROLLER)]
    trust_folder: bool,
}

impl TrustArgs {
    /// Returns true if the option is named.
    pub(super) const fn is_named(self) -> bool {
        self.trust_folder
    }

    /// Opens the folder of a campaign.
    pub(super) fn open(self, dir: &Path) -> Result<SavedCampaign, CliError> {
        let mut saved = SavedCampaign::open(dir)?;
        let foreign = saved.not_trusted();
        if self.trust_folder && !foreign.is_empty() {
            print_error(format_args!("trusting {}, which names:\n  {}\n", dir.display(), foreign.join("\n  ")));
            saved.trust();
        }
        Ok(saved)
    }
}

/// Refuses a folder with the weighted runs of a rare event. Any other path is none of its business.
pub(super) fn refuse_rare(path: &Path) -> Result<(), CliError> {
    if RareManifest::read(path).is_some() {
        SavedCampaign::open(path)?;
    }
    Ok(())
}

/// Returns a message if one of these runs of a sample is not the run of the campaign, to the last
/// bit.
pub(super) fn difference_from_journal<'a>(
    saved: &SavedCampaign,
    outcomes: impl IntoIterator<Item = &'a Outcome>,
) -> Result<Option<String>, CliError> {
    Ok(saved.folder().differences(outcomes)?.into_iter().next())
}

/// Checks the journal of a folder, and says so if it has no result of a sample that runs again.
pub(super) fn check_record(folder: &Folder, scenario: &str, sample: u64) -> Result<(), CliError> {
    if !folder.has_record(scenario, sample)? {
        print_error(format_args!(
            "not compared: the campaign's journal has no result of sample {sample}; its campaign may not have come to its end\n"
        ));
    }
    Ok(())
}

/// The limits of the processes of controllers.
#[derive(Clone, Copy, Debug, Default, Args, Deserialize)]
#[serde(default)]
pub(super) struct LimitArgs {
    /// Time limit for each answer of an `exec`, `lib` or `fmu` controller [default: 1000]. The
    /// first answer may take 10 s
    #[arg(long, value_name = "MS", help_heading = heading::CONTROLLER)]
    controller_timeout_ms: Option<TimeoutMs>,
    /// Memory limit of the processes of an `exec`, `lib` or `fmu` controller [default: 1024]
    #[arg(long, value_name = "MIB", help_heading = heading::CONTROLLER)]
    controller_memory_mib: Option<MemoryMib>,
}

impl LimitArgs {
    /// Returns the time (ms) and the memory (MiB), if they are stated.
    pub(super) fn stated(self) -> (Option<u64>, Option<u64>) {
        (self.controller_timeout_ms.map(|time| time.0), self.controller_memory_mib.map(|memory| memory.0))
    }
}

/// How a folder is opened whose samples run again.
#[derive(Clone, Copy, Debug, Args)]
pub(super) struct SavedArgs {
    #[command(flatten)]
    trust: TrustArgs,
    #[command(flatten)]
    limits: LimitArgs,
}

impl SavedArgs {
    /// Opens the folder of a campaign, with other limits than it had if the command line states
    /// some.
    pub(super) fn open(self, dir: &Path) -> Result<SavedCampaign, CliError> {
        let mut saved = self.trust.open(dir)?;
        let (timeout_ms, memory_mib) = self.limits.stated();
        saved.limit(timeout_ms, memory_mib);
        Ok(saved)
    }
}
