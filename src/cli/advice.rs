//! Advice for the user after an error, a result without a verdict, or a verdict on a known seed.
//! The libraries state the problem, and only this program has the options that help.

use std::fmt::Display;

use closecall_campaign::boundary::BoundaryError;
use closecall_campaign::execution::CampaignError;
use closecall_campaign::folder::FolderError;
use closecall_campaign::gate::AssemblyError;
use closecall_campaign::manifest::Manifest;
use closecall_campaign::merge::MergeError;
use closecall_campaign::rare::RareError;
use closecall_campaign::saved::SavedError;
use closecall_campaign::session;
use closecall_campaign::verdict::{Decision, Judgement};
use closecall_report::campaign::ReportError;
use closecall_scenarios::ScenarioError;
use closecall_scenarios::openscenario::ImportFailure;
use closecall_sensors::camera::ClassifierError;
use closecall_simulation::controller::ArmsError;
use closecall_studies::CausesError;
use closecall_studies::exposure::Missing;
use closecall_studies::map::MapError;
use closecall_traffic::Problem;
use miette::Diagnostic;

use super::CliError;

const ALL_OPTIONS: &str = "the same command with --help lists its options";
const OTHER_FOLDER: &str = "name a folder with --out DIR, or keep no results with --no-out";
const RESUME: &str = "the same command with --resume goes on with the campaign";
const COMPLETE: &str =
    "the command of the campaign with --resume completes it: `closecall check DIR` prints that command";

impl Diagnostic for CliError {
    fn help<'a>(&'a self) -> Option<Box<dyn Display + 'a>> {
        Some(Box::new(advice(self)?))
    }
}

/// Returns the advice for the user, if an option helps.
fn advice(error: &CliError) -> Option<&'static str> {
    match error {
        CliError::Results(_) | CliError::ResultsCut(_) => Some(OTHER_FOLDER),
        CliError::Scenario(ScenarioError::Value { source, .. })
            if matches!(source.problem, Problem::Contradiction { other: "sensors.mode", .. }) =>
        {
            Some(
                "--set sensors.mode=MODE changes the mode of the scenario, and --sensors MODE runs it in another one: its faults \
                 must be able to act in both",
            )
        }
        CliError::Folder(error) => of_folder(error),
        CliError::Campaign(error) | CliError::Merge(MergeError::Campaign(error)) => of_campaign(error),
        CliError::Merge(MergeError::NotAPart { .. }) => Some("`closecall campaign … --partition K/N` runs a part"),
        CliError::Merge(MergeError::OtherCampaign { differences, .. }) => {
            let has_grown = differences.len() == 1 && differences[0].starts_with("sampling.samples:");
            has_grown.then_some(
                "run every part to the same number of samples: the command of the shorter one with -n and --resume",
            )
        }
        CliError::Merge(MergeError::Incomplete { .. } | MergeError::Rare(RareError::MissingRun { .. })) => {
            Some(COMPLETE)
        }
        CliError::Saved(error) | CliError::Causes(CausesError::Saved(error)) => of_saved(error),
        CliError::Report(ReportError::Folder(error)) => of_folder(error),
        CliError::Report(ReportError::Saved(error)) => of_saved(error),
        CliError::Causes(CausesError::NoFailure { .. }) => {
            Some("`closecall campaign … --design search` looks for a first case")
        }
        CliError::Causes(CausesError::Foreign { .. }) => Some("--out FILE names the file"),
        CliError::Causes(CausesError::Map(MapError::OfGrid { parameter, .. } | MapError::Value { parameter, .. })) => {
            Some(match *parameter {
                "speed-mps" => "--speed-mps sets it",
                "closing-mps" => "--closing-kmh sets it",
                "detection-m" => "--detection-m sets it",
                "front-thw-s" => "--front-thw-s sets it",
                _ => "it follows from --detection-m and --closing-kmh",
            })
        }
        CliError::Classifier(ClassifierError::NeedsOnnxRuntime) => {
            Some("--onnxruntime PATH names its libonnxruntime.so")
        }
        CliError::Gates(AssemblyError::NoBaseline { .. }) => Some("--paired runs the baseline, too"),
        CliError::Gates(AssemblyError::DependentSamples { .. }) => Some("--design random draws independent samples"),
        CliError::Arms(ArmsError::One { .. }) => Some("--controller names a single controller"),
        CliError::Import(error) if !matches!(error, ImportFailure::Read { .. }) => {
            Some("--ego NAME names the ego, --parameter NAME=VALUE gives a value, --value-set N chooses values")
        }
        CliError::Sensitivity(_) => Some("see `closecall study sensitivity --help`"),
        CliError::Boundary(BoundaryError::Count { .. }) => Some("--along A B names both"),
        CliError::Boundary(BoundaryError::NoBaseline { .. }) => Some("--controller NAME names the controller"),
        CliError::Boundary(_) => Some("see `closecall study boundary --help`"),
        // Another message is about a file or a result: no option helps.
        CliError::Usage { .. } | CliError::Gates(_) | CliError::Arms(_) | CliError::Plan(_) => {
            error.to_string().contains("--").then_some(ALL_OPTIONS)
        }
        _ => None,
    }
}

fn of_campaign(error: &CampaignError) -> Option<&'static str> {
    match error {
        CampaignError::Write(_) => Some(RESUME),
        CampaignError::Folder(error) => of_folder(error),
        _ => None,
    }
}

fn of_folder(error: &FolderError) -> Option<&'static str> {
    match error {
        FolderError::AlreadyThere { .. } => Some(RESUME),
        FolderError::Incomplete { .. } => Some(COMPLETE),
        _ => None,
    }
}

fn of_saved(error: &SavedError) -> Option<&'static str> {
    match error {
        SavedError::Folder(error) => of_folder(error),
        SavedError::ScenarioNotNamed { .. } => Some("--scenario NAME names it"),
        SavedError::NotTrusted { .. } => Some("--trust-folder lets them run"),
        _ => None,
    }
}

/// Returns the lines after a verdict that say how a campaign is judged, or becomes a measurement.
pub(super) fn after_verdict(judged: &Judgement) -> &'static str {
    if judged.decision == Decision::NotJudged && judged.gates.is_empty() {
        "  --gate CRITERION sets a gate, --no-gate measures without a verdict\n"
    } else {
        ""
    }
}

/// Returns the remark of a verdict on a controller from outside whose samples were known before
/// the run: the controller may have been tuned on them. `None` for a controller of this program,
/// for a seed that was drawn when the campaign began, and for a campaign that does not judge.
/// `can_draw` says whether the command could have drawn a seed: the parts of a campaign need the
/// same one.
pub(super) fn known_seed(judges: bool, manifest: &Manifest, can_draw: bool) -> Option<String> {
    let is_from_outside = manifest.arms.last().is_some_and(|tested| tested.built_in().is_none());
    let remedy = match (can_draw, session::is_active()) {
        (false, _) => "",
        (true, false) => "; `--judge-seed secret` draws one",
        (true, true) => "; `judge_seed=\"secret\"` draws one",
    };
    (is_from_outside && judges && !manifest.has_drawn_seed)
        .then(|| format!("the seed was known before the run: a controller could recognise its samples{remedy}"))
}

/// Returns the remark of a verdict on a part of a campaign: its samples are not all. `None` for a
/// whole campaign, and for one that does not judge.
pub(super) fn part_only(judges: bool, manifest: &Manifest) -> Option<String> {
    let part = manifest.partition.filter(|_| judges)?;
    Some(format!("this is the verdict on part {part} alone: `closecall tool merge` judges the samples of all parts"))
}

/// Returns the option that gives the missing input of a net effect.
pub(super) const fn to_provide(missing: Missing) -> &'static str {
    match missing {
        Missing::Rate => "--per-million-km LOW..HIGH states a range of the rate",
        Missing::Campaign => "--campaign DIR names a paired campaign",
    }
}
