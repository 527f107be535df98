//! Whatever keeps a command from its result, and what the program then ends with.

use closecall_scenarios::encounter::NoEncounter;
use closecall_scenarios::lane_change::ReferenceError;
use closecall_scenarios::recordings::{RecordingError, WriteError as RecordingWriteError};
use closecall_sensors::camera::ClassifierError;
use closecall_sensors::camera::dataset::DatasetError;
use miette::Diagnostic;

use crate::exit_code::ExitCode;
use closecall_campaign::compare::CompareError;
use closecall_campaign::execution::CampaignError;
use closecall_campaign::folder::FolderError;
use closecall_campaign::merge::MergeError;
use closecall_campaign::plan::PlanError;
use closecall_campaign::saved::SavedError;
use closecall_report::campaign::ReportError;
use closecall_report::run::figure::PngError;
use closecall_report::run::film::TrafficFilmError;
use closecall_report::run::rerun::RecordError;
use closecall_report::traffic::recording_charts::ChartError;
use closecall_scenarios::atomic::WriteError;
use closecall_simulation::SampleError;
use closecall_simulation::scenario::ScenarioError;

/// Of the tracks that could be asked for, so many are named.
const MOST_NAMED: usize = 10;

/// A command that has no result.
#[derive(Debug, thiserror::Error, Diagnostic)]
pub enum CliError {
    /// A scenario cannot be used.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// A recording cannot be used.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A list of known lane changes cannot be used.
    #[error("failed to use the list of lane changes {0}")]
    Reference(#[from] ReferenceError),
    /// A recording cannot be written.
    #[error(transparent)]
    WriteRecording(#[from] RecordingWriteError),
    /// A campaign's folder cannot be used.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// A chart cannot be drawn.
    #[error(transparent)]
    Chart(#[from] ChartError),
    /// A Rerun file cannot be written.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A figure cannot be drawn.
    #[error(transparent)]
    Figure(#[from] PngError),
    /// A recorded lane change cannot be shown.
    #[error(transparent)]
    TrafficFilm(#[from] TrafficFilmError),
    /// A recorded lane change is no encounter.
    #[error("failed to re-enact an encounter of {file}: {source}{}", others(possible))]
    NoEncounter {
        /// The recording's file.
        file: String,
        /// Why.
        source: NoEncounter,
        /// The tracks of the recording that can be re-enacted.
        possible: Vec<u64>,
    },
    /// A set of pictures cannot be written.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// The inference backend that was asked for cannot be used.
    #[error(transparent)]
    Classifier(#[from] ClassifierError),
    /// A run has no outcome.
    #[error("failed to run sample {sample}: {source}")]
    Sample {
        /// The sample.
        sample: u64,
        /// Why.
        source: SampleError,
    },
    /// The command line asks for something that does not exist.
    #[error("{message}")]
    #[diagnostic(help("see `closecall --help`"))]
    Usage {
        /// What is wrong, and what is allowed.
        message: String,
    },
    /// A campaign could not be carried on.
    #[error(transparent)]
    Campaign(#[from] CampaignError),
    /// Parts do not make a campaign.
    #[error(transparent)]
    Merge(#[from] MergeError),
    /// The scenarios cannot stand in one campaign.
    #[error(transparent)]
    #[diagnostic(help("see `closecall --help`"))]
    Plan(#[from] PlanError),
    /// A saved campaign does not have what is asked for.
    #[error(transparent)]
    #[diagnostic(help("see `closecall --help`"))]
    Saved(#[from] SavedError),
    /// The reports of a campaign cannot be made.
    #[error(transparent)]
    Report(#[from] ReportError),
    /// Two campaigns cannot be compared.
    #[error(transparent)]
    Compare(#[from] CompareError),
}

/// What else could be asked for with `--track`.
fn others(possible: &[u64]) -> String {
    let named: Vec<String> = possible.iter().take(MOST_NAMED).map(u64::to_string).collect();
    match possible.len() {
        0 => String::new(),
        count if count > MOST_NAMED => format!("; --track can name {count} others, such as {}", named.join(", ")),
        _ => format!("; --track can name {}", named.join(", ")),
    }
}

impl From<&CliError> for ExitCode {
    fn from(error: &CliError) -> Self {
        match error {
            CliError::Scenario(error) => Self::from(error),
            CliError::Recording(error) if error.is_io() => Self::Io,
            CliError::Reference(error) if error.is_io() => Self::Io,
            CliError::Recording(_)
            | CliError::Reference(_)
            | CliError::TrafficFilm(_)
            | CliError::NoEncounter { .. }
            | CliError::Classifier(_) => Self::InvalidInput,
            CliError::Folder(error) => Self::from(error),
            CliError::Campaign(error) => Self::from(error),
            CliError::Saved(error) => Self::from(error),
            CliError::Report(error) => match error {
                ReportError::Folder(error) => Self::from(error),
                ReportError::Saved(error) => Self::from(error),
                ReportError::Write(_) | ReportError::Recording(_) => Self::Io,
                ReportError::Sample { .. } => Self::SampleError,
            },
            CliError::Merge(error) => match error {
                MergeError::Campaign(error) => Self::from(error),
                MergeError::OutOfPlace { .. } => Self::InvalidInput,
                MergeError::NotAPart { .. }
                | MergeError::Foreign { .. }
                | MergeError::Twice { .. }
                | MergeError::Missing { .. }
                | MergeError::Incomplete { .. } => Self::Usage,
            },
            CliError::Compare(error) => match error {
                CompareError::Folder(error) => Self::from(error),
                CompareError::Different { .. } | CompareError::OtherSample { .. } => Self::Usage,
            },
            CliError::Write(_)
            | CliError::Chart(_)
            | CliError::Record(_)
            | CliError::Figure(_)
            | CliError::WriteRecording(_)
            | CliError::Dataset(_) => Self::Io,
            CliError::Sample { .. } => Self::SampleError,
            CliError::Usage { .. } | CliError::Plan(_) => Self::Usage,
        }
    }
}

impl From<&FolderError> for ExitCode {
    fn from(error: &FolderError) -> Self {
        match error {
            FolderError::Write(_) | FolderError::Read { .. } | FolderError::Busy { .. } => Self::Io,
            FolderError::AlreadyThere { .. } | FolderError::OtherCampaign { .. } | FolderError::NotACampaign { .. } => {
                Self::Usage
            }
            FolderError::Content { .. } => Self::InvalidInput,
        }
    }
}

impl From<&SavedError> for ExitCode {
    fn from(error: &SavedError) -> Self {
        match error {
            SavedError::Folder(error) => Self::from(error),
            SavedError::Scenario(error) => Self::from(error),
            SavedError::Sample { .. } => Self::SampleError,
            SavedError::ScenarioNotNamed { .. }
            | SavedError::UnknownScenario { .. }
            | SavedError::UnknownSample { .. }
            | SavedError::UnknownArm { .. } => Self::Usage,
        }
    }
}

impl From<&CampaignError> for ExitCode {
    fn from(error: &CampaignError) -> Self {
        match error {
            CampaignError::Folder(error) => Self::from(error),
            CampaignError::Write(_) | CampaignError::Workers(_) => Self::Io,
        }
    }
}
