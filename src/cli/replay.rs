//! `closecall replay`: one sample of a campaign again, bit for bit.

use std::path::PathBuf;

use clap::Args;

use super::CliError;
use super::args::Format;
use super::output::complain;
use super::past::{arms, scenario_file};
use super::run::print;
use super::watch::{WatchArgs, run_watched};
use crate::campaign::folder::Folder;
use crate::campaign::manifest::{Manifest, ManifestScenario};
use crate::campaign::runner::concrete;
use crate::controller::ControllerChoice;
use crate::exit_code::ExitCode;
use crate::outcome::Outcome;
use crate::scenario::Scenario;
use crate::simulation::{Arm, RunKey};

/// Arguments of `closecall replay`.
#[derive(Debug, Args)]
pub(super) struct ReplayArgs {
    /// Folder of the campaign
    dir: PathBuf,
    /// Number of the sample
    sample: u64,
    /// Name of the scenario, where the campaign has more than one
    #[arg(long)]
    scenario: Option<String>,
    /// The arm to run again; the controller under test where absent
    #[arg(long, value_name = "NAME")]
    controller: Option<String>,
    /// Run every arm of the campaign again; with --record all in one file
    #[arg(long, conflicts_with = "controller")]
    paired: bool,
    #[command(flatten)]
    watch: WatchArgs,
    /// Output for people or for programs
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

pub(super) fn replay(args: &ReplayArgs) -> Result<ExitCode, CliError> {
    let folder = Folder::open(&args.dir);
    let manifest = folder.manifest()?;
    let (scenario, key) = sample_of(&folder, &manifest, args.scenario.as_deref(), args.sample)?;
    let arms = match args.paired {
        true => arms(&manifest)?,
        false => vec![chosen_arm(&manifest, args.controller.as_deref())?],
    };
    for arm in &arms {
        say_what_is_started(&manifest, arm.controller.name());
    }
    let outcomes = run_watched(&scenario, key, &arms, &args.watch)?;
    print(&outcomes, args.format);
    let mut agrees = true;
    for outcome in &outcomes {
        agrees &= agrees_with_journal(&folder, outcome)?;
    }
    if agrees {
        return Ok(ExitCode::Pass);
    }
    complain(format_args!(
        "the replay differs from the campaign's journal: the campaign was made by closecall {}, this is {}\n",
        manifest.closecall_version,
        super::campaign::version(),
    ));
    Ok(ExitCode::Invalid)
}

/// A folder may come from somebody else: that it starts a process is not to go unseen.
fn say_what_is_started(manifest: &Manifest, name: &str) {
    for arm in &manifest.arms {
        if let ControllerChoice::Exec(exec) = arm
            && arm.name() == name
        {
            complain(format_args!("running the controller that the campaign names: {}\n", exec.command));
        }
    }
}

/// True unless the campaign's journal has another result of this sample, by a single bit.
fn agrees_with_journal(folder: &Folder, outcome: &Outcome) -> Result<bool, CliError> {
    let Ok(records) = folder.records() else { return Ok(true) };
    for record in records {
        let record = record?;
        if record.scenario == outcome.scenario && record.sample == outcome.sample {
            let same_arm = record.arms.iter().find(|arm| arm.controller == outcome.controller);
            return Ok(same_arm.is_none_or(|arm| arm.result.as_ref().is_ok_and(|kept| kept.has_same_bits(outcome))));
        }
    }
    Ok(true)
}

/// The scenario of a campaign with this name, or its only one.
fn choose<'a>(manifest: &'a Manifest, name: Option<&str>) -> Result<&'a ManifestScenario, CliError> {
    let known = || manifest.scenarios.iter().map(|scenario| scenario.name.as_str()).collect::<Vec<_>>().join(", ");
    match (name, &manifest.scenarios[..]) {
        (None, [only]) => Ok(only),
        (None, _) => Err(CliError::Usage {
            message: format!("the campaign has several scenarios; name one with --scenario: {}", known()),
        }),
        (Some(name), scenarios) => scenarios.iter().find(|scenario| scenario.name == name).ok_or_else(|| {
            CliError::Usage { message: format!("the campaign has no scenario `{name}`, only {}", known()) }
        }),
    }
}

/// The concrete scenario of one sample of a campaign.
pub(super) fn sample_of(
    folder: &Folder,
    manifest: &Manifest,
    scenario: Option<&str>,
    sample: u64,
) -> Result<(Scenario, RunKey), CliError> {
    let file = scenario_file(folder.path(), choose(manifest, scenario)?)?;
    let samples = file.space().samples(manifest.sampling.design, manifest.sampling.samples);
    if sample >= samples {
        let message = format!("there is no sample {sample}: the campaign has samples 0 to {}", samples - 1);
        return Err(CliError::Usage { message });
    }
    let scenario = concrete(&file, manifest.sampling, sample).map_err(|source| CliError::Sample { sample, source })?;
    Ok((scenario, RunKey { seed: manifest.sampling.seed, sample }))
}

/// An arm of the campaign: the named one, or the one under test.
fn chosen_arm(manifest: &Manifest, name: Option<&str>) -> Result<Arm, CliError> {
    let is_meant = |arm: &ControllerChoice| name.is_none_or(|name| arm.name() == name || arm.to_string() == name);
    let Some(place) = manifest.arms.iter().rposition(is_meant) else {
        let known = manifest.arms.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
        let message = format!("the campaign was not run with `{}`, only with {known}", name.unwrap_or_default());
        return Err(CliError::Usage { message });
    };
    Ok(arms(manifest)?.swap_remove(place))
}
