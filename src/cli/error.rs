//! The errors of the commands, and the exit code of each.

use closecall_campaign::baseline::BaselineError;
use closecall_campaign::boundary::BoundaryError;
use closecall_campaign::compare::CompareError;
use closecall_campaign::execution::CampaignError;
use closecall_campaign::failure::FailureKind;
use closecall_campaign::folder::FolderError;
use closecall_campaign::gate::{AssemblyError, ProjectError};
use closecall_campaign::merge::MergeError;
use closecall_campaign::plan::PlanError;
use closecall_campaign::saved::SavedError;
use closecall_campaign::sensitivity::PlanFailure;
use closecall_recorded::aerial::AerialError;
use closecall_recorded::encounter::{Lead, NoEncounter};
use closecall_recorded::following::FollowingError;
use closecall_recorded::lane_change::ReferenceError;
use closecall_recorded::openlabel::LabelError;
use closecall_recorded::scans::{ScanFileError, ScanFileProblem};
use closecall_recorded::trajectory_data::{
    TrajectoryFileError, TrajectoryFileProblem, WriteError as TrajectoryWriteError,
};
use closecall_report::campaign::ReportError;
use closecall_report::run::figure::PictureError;
use closecall_report::run::film::TrafficFilmError;
use closecall_report::run::rerun::RecordingError;
use closecall_report::traffic::reproduction::StepZeroError;
use closecall_report::traffic::trajectory_charts::ChartError;
use closecall_scenarios::ScenarioError;
use closecall_scenarios::library::UnknownScenario;
use closecall_scenarios::member::{ApplyError, MemberError};
use closecall_scenarios::openscenario::ImportFailure;
use closecall_scenarios::source::SourceError;
use closecall_sensors::camera::ClassifierError;
use closecall_sensors::datasets::DatasetError;
use closecall_sensors::lidar::PointError;
use closecall_simulation::SampleError;
use closecall_simulation::controller::ArmsError;
use closecall_simulation::controller::native::NativeError;
use closecall_studies::CausesError;
use closecall_studies::fidelity::FidelityError;
use closecall_studies::perception::StudyError;
use closecall_studies::perception::recorded::RecordedStudyError;
use closecall_traffic::atomic::WriteError;
use closecall_traffic::input::is_of_content;

use super::argument::Argument;
use super::view_error::ViewError;
use crate::exit_code::ExitCode;

/// The reason for which a command has no result.
#[derive(Debug, thiserror::Error)]
pub enum CliError {
    /// The project file cannot be used.
    #[error(transparent)]
    Project(#[from] ProjectError),
    /// A scenario cannot be used.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// A scenario of another tool cannot be imported.
    #[error(transparent)]
    Import(#[from] ImportFailure),
    /// A member of a driver ensemble cannot be used.
    #[error(transparent)]
    Member(#[from] MemberError),
    /// A member of a driver ensemble does not fit a scenario.
    #[error(transparent)]
    Apply(#[from] ApplyError),
    /// A file of recorded pairs cannot be used.
    #[error(transparent)]
    Following(#[from] FollowingError),
    /// A trajectory file cannot be used.
    #[error("{_0}{}", remedy(&_0.problem))]
    TrajectoryData(#[from] TrajectoryFileError),
    /// A list of known lane changes cannot be used.
    #[error("failed to use the list of lane changes {0}")]
    Reference(#[from] ReferenceError),
    /// A trajectory file cannot be written.
    #[error(transparent)]
    WriteRecording(#[from] TrajectoryWriteError),
    /// A campaign's folder cannot be used.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// The default folder of a campaign's results cannot be used.
    #[error(transparent)]
    Results(FolderError),
    /// The default folder of a campaign's results holds only the first of them.
    #[error(
        "{0}\nthe campaign went on without its folder: the verdict counts every sample, and --resume runs the samples again that are not kept"
    )]
    ResultsCut(WriteError),
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// A chart cannot be drawn.
    #[error(transparent)]
    Chart(#[from] ChartError),
    /// A recording (Rerun file) cannot be written.
    #[error(transparent)]
    Record(#[from] RecordingError),
    /// Recordings cannot be shown.
    #[error(transparent)]
    View(#[from] ViewError),
    /// A figure cannot be drawn.
    #[error(transparent)]
    Figure(#[from] PictureError),
    /// A recorded lane change cannot be shown.
    #[error(transparent)]
    TrafficFilm(#[from] TrafficFilmError),
    /// A recorded lane change is not an encounter that can be re-enacted or sampled.
    #[error("failed to {} an encounter of {file}: {source}{}", purpose(*lead), track_suggestion(*lead, possible))]
    NoEncounter {
        /// Whether a lead vehicle is required: for a re-enactment, not for a sample.
        lead: Lead,
        /// The trajectory file.
        file: String,
        /// The condition that is not met.
        source: NoEncounter,
        /// The tracks of the file that can be re-enacted.
        possible: Vec<u64>,
    },
    /// No driver reproduces a recorded lane change.
    #[error("failed to sample an encounter of {file}: {source}")]
    NotReproduced {
        /// The trajectory file.
        file: String,
        /// How far the closest driver is from the recording.
        source: Box<StepZeroError>,
    },
    /// A parameter that a sample varies cannot have one of its values.
    #[error("{} {parameter} cannot be {value}: {reason}", Argument("vary"))]
    VariedValue {
        /// The parameter, as it was named.
        parameter: String,
        /// The value.
        value: f64,
        /// The key of the scenario that refuses it, and what is allowed.
        reason: String,
    },
    /// A trajectory file has nothing that the command needs.
    #[error("{message}")]
    NothingFound {
        /// What is missing.
        message: String,
    },
    /// A set of rendered images cannot be written.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// The aerial acquisition fails.
    #[error(transparent)]
    Aerial(#[from] AerialError),
    /// A library or an FMU cannot be used as a controller.
    #[error(transparent)]
    Controller(#[from] NativeError),
    /// The requested inference backend cannot be used.
    #[error(transparent)]
    Classifier(#[from] ClassifierError),
    /// A sample has no outcome.
    #[error("failed to run sample {sample}: {source}")]
    Sample {
        /// The sample.
        sample: u64,
        /// The reason.
        source: SampleError,
    },
    /// The arguments are wrong in a way that clap does not detect.
    #[error("{message}")]
    Usage {
        /// What is wrong, and what is allowed.
        message: String,
    },
    /// The gates do not fit the campaign.
    #[error(transparent)]
    Gates(AssemblyError),
    /// The controllers cannot be compared.
    #[error(transparent)]
    Arms(#[from] ArmsError),
    /// A campaign has ended early.
    #[error(transparent)]
    Campaign(#[from] CampaignError),
    /// The parts of a campaign cannot be merged.
    #[error(transparent)]
    Merge(#[from] MergeError),
    /// The scenarios cannot form a campaign.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// A sensitivity study cannot be planned.
    #[error(transparent)]
    Sensitivity(#[from] PlanFailure),
    /// A boundary cannot be planned.
    #[error(transparent)]
    Boundary(#[from] BoundaryError),
    /// A saved campaign cannot fulfil a request.
    #[error(transparent)]
    Saved(#[from] SavedError),
    /// The reports of a campaign cannot be written.
    #[error(transparent)]
    Report(#[from] ReportError),
    /// A cause cannot be found.
    #[error(transparent)]
    Causes(#[from] CausesError),
    /// Two campaigns are not two fidelities of the same samples.
    #[error(transparent)]
    Fidelity(#[from] FidelityError),
    /// The sensors cannot be studied.
    #[error(transparent)]
    Sensors(#[from] StudyError),
    /// Recorded scans cannot be used.
    #[error("{_0}{}", point_remedy(&_0.problem))]
    Scans(ScanFileError),
    /// A recorded scan cannot be processed.
    #[error(transparent)]
    Perceive(RecordedStudyError),
    /// A campaign cannot be compared with a baseline.
    #[error(transparent)]
    Baseline(#[from] BaselineError),
    /// Two campaigns cannot be compared.
    #[error(transparent)]
    Compare(#[from] CompareError),
}

impl CliError {
    /// Returns the error of arguments that clap does not refuse.
    pub(super) fn usage(message: impl Into<String>) -> Self {
        Self::Usage { message: message.into() }
    }
}

impl From<ScanFileError> for CliError {
    fn from(error: ScanFileError) -> Self {
        Self::Scans(error)
    }
}

impl From<RecordedStudyError> for CliError {
    fn from(error: RecordedStudyError) -> Self {
        match error {
            RecordedStudyError::File(error) => Self::Scans(error),
            error @ RecordedStudyError::Sensor(_) => Self::Perceive(error),
        }
    }
}

/// Returns the option that reads recorded points in spite of the problem, if there is one.
fn point_remedy(problem: &ScanFileProblem) -> &'static str {
    match problem {
        ScanFileProblem::Point(PointError::NotFinite { quantity: "x" | "y" | "z", .. }) => {
            "; --drop-invalid leaves out points without a position"
        }
        ScanFileProblem::Point(PointError::Frame { .. }) => "; --frame names the frame",
        ScanFileProblem::Intensity { .. } => "; --intensity-scale converts them",
        _ => "",
    }
}

impl From<SourceError> for CliError {
    fn from(error: SourceError) -> Self {
        match error {
            SourceError::Scenario(error) => Self::Scenario(error),
            SourceError::StandardInputTwice => Self::usage(error.to_string()),
            SourceError::NoScenario { .. } => Self::usage(format!("{error}: `closecall new NAME` writes one")),
        }
    }
}

impl From<LabelError> for CliError {
    fn from(error: LabelError) -> Self {
        match error {
            LabelError::Read(error) => Self::TrajectoryData(error),
            LabelError::Write(error) => Self::WriteRecording(error),
        }
    }
}

/// Returns the option that reads a trajectory file in spite of the problem, if there is one.
fn remedy(problem: &TrajectoryFileProblem) -> String {
    let [mirror_d, from_right] = ["mirror-d", "lanes-from-right"].map(Argument);
    match problem {
        TrajectoryFileProblem::LanesAgainstPosition { is_mirrored: true, .. } => {
            format!("; {mirror_d} turns the position, {from_right} the lanes")
        }
        TrajectoryFileProblem::LanesAgainstPosition { .. } => format!(
            "; {from_right} turns the lanes, {mirror_d} the position: with the wrong one of them, left is called right"
        ),
        TrajectoryFileProblem::LanesBesideMarkings { .. } => {
            format!("; {} `none` takes no lane as recorded, {mirror_d} turns the position", Argument("lanes"))
        }
        TrajectoryFileProblem::IndexAgainstPosition { .. } => format!(
            "; {mirror_d} and {from_right} together turn a mirrored file, {} `none` reads traffic on the left and takes no lane as \
             recorded",
            Argument("lanes")
        ),
        TrajectoryFileProblem::LaneSpacing { .. } | TrajectoryFileProblem::LanesOutOfOrder { .. } => {
            format!("; {} `none` takes no lane as recorded", Argument("lanes"))
        }
        TrajectoryFileProblem::NoLanes { .. } => format!("; {} `none` estimates them", Argument("lanes")),
        TrajectoryFileProblem::SidesContradict { .. } => format!(
            "; {mirror_d} turns the position (with {from_right}, if the lanes are counted from the right, too), or leave these \
             columns out"
        ),
        TrajectoryFileProblem::AgainstTheRoad { .. } => {
            format!("; {} turns the position along the road of all vehicles", Argument("reverse-s"))
        }
        TrajectoryFileProblem::MostRows { first, .. }
            if matches!(**first, TrajectoryFileProblem::NegativeSpeed { .. }) =>
        {
            format!("; {} turns the position along the road and the speeds of all vehicles", Argument("reverse-s"))
        }
        TrajectoryFileProblem::SeveralRecordings { .. } | TrajectoryFileProblem::NoSuchLocation { .. } => {
            format!("; {} names the data set of NGSIM's export to read", Argument("location"))
        }
        // All rows have this problem: they would all be left out.
        TrajectoryFileProblem::HeadingUnit { .. } | TrajectoryFileProblem::NoMarkings { .. } => String::new(),
        problem if problem.affects_one_row() => {
            format!("; {} skips such rows, and counts them", Argument("drop-bad-rows"))
        }
        _ => String::new(),
    }
}

/// Largest number of tracks that a message suggests.
pub(super) const MAX_SUGGESTED: usize = 10;

/// Returns what an encounter is for.
const fn purpose(lead: Lead) -> &'static str {
    match lead {
        Lead::Required => "re-enact",
        Lead::LeftOut => "sample",
    }
}

/// Returns the tracks that the option of a command can name, as the end of a message.
fn track_suggestion(lead: Lead, possible: &[u64]) -> String {
    let option = match lead {
        Lead::Required => "--track",
        Lead::LeftOut => "--lane-change",
    };
    let named: Vec<String> = possible.iter().take(MAX_SUGGESTED).map(u64::to_string).collect();
    match possible.len() {
        0 => String::new(),
        count if count > MAX_SUGGESTED => {
            format!("; {option} can name {count} other tracks, such as {}", named.join(", "))
        }
        _ => format!("; {option} can name {}", named.join(", ")),
    }
}

impl From<AssemblyError> for CliError {
    fn from(error: AssemblyError) -> Self {
        match error {
            AssemblyError::Project(error) => Self::Project(error),
            error => Self::Gates(error),
        }
    }
}

impl From<UnknownScenario> for CliError {
    fn from(error: UnknownScenario) -> Self {
        Self::Usage { message: error.to_string() }
    }
}

impl From<&CliError> for ExitCode {
    fn from(error: &CliError) -> Self {
        match error {
            CliError::Scenario(error) => Self::from(error),
            CliError::Import(ImportFailure::Read { .. }) => Self::Io,
            CliError::Import(_) => Self::InvalidInput,
            CliError::Classifier(ClassifierError::Read { .. }) => Self::Io,
            CliError::TrajectoryData(error) if error.is_io() => Self::Io,
            CliError::Reference(error) if error.is_io() => Self::Io,
            CliError::TrajectoryData(_)
            | CliError::Reference(_)
            | CliError::TrafficFilm(_)
            | CliError::NoEncounter { .. }
            | CliError::NotReproduced { .. }
            | CliError::VariedValue { .. }
            | CliError::Project(ProjectError { is_io: false, .. })
            | CliError::View(ViewError::Nothing { .. } | ViewError::Foreign { .. })
            | CliError::Aerial(AerialError::Traffic { .. } | AerialError::Network(_) | AerialError::Output { .. })
            | CliError::Classifier(_) => Self::InvalidInput,
            CliError::Controller(error) => FailureKind::from(error).into(),
            CliError::Folder(error) | CliError::Results(error) => FailureKind::from(error).into(),
            CliError::Campaign(error) => FailureKind::from(error).into(),
            CliError::Saved(error) => FailureKind::from(error).into(),
            CliError::Sensitivity(PlanFailure::Workers(_)) => Self::Io,
            CliError::Sensitivity(PlanFailure::Fault(error)) => Self::from(&**error),
            CliError::Sensitivity(_) => Self::Usage,
            CliError::Boundary(BoundaryError::Workers(_)) => Self::Io,
            CliError::Boundary(BoundaryError::Fault(error)) => Self::from(&**error),
            CliError::Boundary(_) => Self::Usage,
            CliError::Report(error) => error.kind().into(),
            CliError::Merge(error) => FailureKind::from(error).into(),
            CliError::Compare(error) => FailureKind::from(error).into(),
            CliError::Causes(error) => error.kind().into(),
            CliError::Fidelity(FidelityError::Folder(error)) => FailureKind::from(error).into(),
            CliError::Fidelity(_) => ExitCode::Usage,
            CliError::Sensors(error) => error.kind().into(),
            CliError::Scans(error) if error.is_io() => Self::Io,
            CliError::Scans(_) => Self::InvalidInput,
            CliError::Perceive(_) => Self::SampleError,
            CliError::Write(_)
            | CliError::Project(ProjectError { is_io: true, .. })
            | CliError::ResultsCut(_)
            | CliError::Chart(_)
            | CliError::Record(_)
            | CliError::View(
                ViewError::Read { .. } | ViewError::Viewer(_) | ViewError::Browser { .. } | ViewError::Serve { .. },
            )
            | CliError::Figure(_)
            | CliError::WriteRecording(_)
            | CliError::Dataset(_)
            | CliError::Aerial(
                AerialError::Folder { .. }
                | AerialError::Write(_)
                | AerialError::Encode { .. }
                | AerialError::Pose(_)
                | AerialError::Stream(_),
            ) => Self::Io,
            CliError::Member(MemberError::Read { source, .. }) if is_of_content(source) => Self::InvalidInput,
            CliError::Member(MemberError::Read { .. }) | CliError::Following(FollowingError::Read { .. }) => Self::Io,
            CliError::Member(MemberError::Unknown { .. } | MemberError::SameName { .. }) => Self::Usage,
            CliError::Member(_) | CliError::Apply(_) | CliError::Following(_) => Self::InvalidInput,
            CliError::Sample { .. } => Self::SampleError,
            CliError::NothingFound { .. } => Self::Inconclusive,
            CliError::Plan(PlanError::Controller { source, .. }) => FailureKind::from(source).into(),
            CliError::Plan(PlanError::WithoutMis { .. } | PlanError::WithoutHuman { .. }) => Self::InvalidInput,
            CliError::Usage { .. }
            | CliError::Aerial(AerialError::Option { .. })
            | CliError::Gates(_)
            | CliError::Arms(_)
            | CliError::Plan(_)
            | CliError::Baseline(_) => Self::Usage,
        }
    }
}

impl From<FailureKind> for ExitCode {
    fn from(kind: FailureKind) -> Self {
        match kind {
            FailureKind::Usage => Self::Usage,
            FailureKind::InvalidInput => Self::InvalidInput,
            FailureKind::Sample => Self::SampleError,
            FailureKind::Validity => Self::Invalid,
            FailureKind::Io => Self::Io,
        }
    }
}
