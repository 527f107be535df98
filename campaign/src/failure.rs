//! The kind of an error: what a caller can do about it, and so the exit code of a program.

use closecall_scenarios::ScenarioError;
use closecall_simulation::controller::native::NativeError;
use closecall_traffic::input::is_of_content;

use super::campaign_error::CampaignError;
use super::compare::CompareError;
use super::folder::FolderError;
use super::merge::MergeError;
use super::saved_error::SavedError;

/// The kind of an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FailureKind {
    /// A requested thing does not exist or contradicts itself.
    Usage,
    /// A file cannot be used as it is.
    InvalidInput,
    /// A sample has no outcome.
    Sample,
    /// The program, a file or a controller differs from the start of the campaign, or its results
    /// cannot be believed.
    Validity,
    /// A file or folder cannot be read or written.
    Io,
}

impl From<&ScenarioError> for FailureKind {
    fn from(error: &ScenarioError) -> Self {
        match error {
            ScenarioError::Set { .. } if !error.is_setting() => Self::InvalidInput,
            ScenarioError::Set { .. } | ScenarioError::Unknown { .. } => Self::Usage,
            ScenarioError::Read { .. } if error.is_io() => Self::Io,
            ScenarioError::Read { .. }
            | ScenarioError::NotText { .. }
            | ScenarioError::TooLarge { .. }
            | ScenarioError::Empty { .. }
            | ScenarioError::Syntax { .. }
            | ScenarioError::Value { .. }
            | ScenarioError::UnusedParameter { .. } => Self::InvalidInput,
        }
    }
}

impl From<&NativeError> for FailureKind {
    fn from(error: &NativeError) -> Self {
        match error {
            NativeError::Refused { is_io: true, .. } | NativeError::RefusedProgram { is_io: true, .. } => Self::Io,
            NativeError::Refused { .. }
            | NativeError::RefusedProgram { .. }
            | NativeError::Crash { .. }
            | NativeError::Start { .. }
            | NativeError::StartProgram { .. } => Self::InvalidInput,
        }
    }
}

impl From<&FolderError> for FailureKind {
    fn from(error: &FolderError) -> Self {
        match error {
            FolderError::Read { source, .. } if is_of_content(source) => Self::InvalidInput,
            FolderError::Write(_) | FolderError::Read { .. } | FolderError::Busy { .. } => Self::Io,
            FolderError::AlreadyThere { .. }
            | FolderError::OtherCampaign { .. }
            | FolderError::NotACampaign { .. }
            | FolderError::RareEvent { .. }
            | FolderError::Part { .. }
            | FolderError::Foreign { .. } => Self::Usage,
            FolderError::Content { .. } | FolderError::Incomplete { .. } => Self::InvalidInput,
            FolderError::Invalid { .. } => Self::Validity,
        }
    }
}

impl From<&SavedError> for FailureKind {
    fn from(error: &SavedError) -> Self {
        match error {
            SavedError::Folder(error) => Self::from(error),
            SavedError::Scenario(error) if error.is_setting() => Self::Usage,
            SavedError::Scenario(error) if error.is_io() => Self::Io,
            SavedError::Scenario(_) => Self::InvalidInput,
            SavedError::Sample { .. } => Self::Sample,
            SavedError::ScenarioNotNamed { .. }
            | SavedError::UnknownScenario { .. }
            | SavedError::UnknownSample { .. }
            | SavedError::UnknownArm { .. }
            | SavedError::NotTrusted { .. } => Self::Usage,
        }
    }
}

impl From<&CampaignError> for FailureKind {
    fn from(error: &CampaignError) -> Self {
        match error {
            CampaignError::Folder(error) => Self::from(error),
            CampaignError::Refused { has_changed: true, .. } => Self::Validity,
            CampaignError::Refused { has_changed: false, .. } => Self::InvalidInput,
            CampaignError::Remote(error) if error.is_input() => Self::InvalidInput,
            CampaignError::Write(_) | CampaignError::Workers(_) | CampaignError::Remote(_) => Self::Io,
        }
    }
}

impl From<&MergeError> for FailureKind {
    fn from(error: &MergeError) -> Self {
        match error {
            MergeError::Campaign(error) => Self::from(error),
            MergeError::OutOfOrder { .. } | MergeError::OtherRun { .. } => Self::InvalidInput,
            MergeError::NotAPart { .. }
            | MergeError::OtherCampaign { .. }
            | MergeError::Duplicate { .. }
            | MergeError::Missing { .. }
            | MergeError::Rare(_)
            | MergeError::Incomplete { .. } => Self::Usage,
        }
    }
}

impl From<&CompareError> for FailureKind {
    fn from(error: &CompareError) -> Self {
        match error {
            CompareError::Folder(error) => Self::from(error),
            CompareError::Different { .. } | CompareError::OtherSample { .. } => Self::Usage,
        }
    }
}
