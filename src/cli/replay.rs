//! `closecall replay`: runs one sample of a campaign again, and compares the outcome bit for bit
//! unless settings change it.

use clap::Args;
use closecall_campaign::manifest::{Manifest, version};
use closecall_campaign::record::Agreement;

use super::CliError;
use super::args::{Format, SavedSampleArgs, SetArgs};
use super::help::{examples, heading};
use super::output::print_error;
use super::protect::{files_of_campaign, files_of_controller, protect};
use super::run::print;
use super::watch::{WatchArgs, run_watched};
use crate::exit_code::ExitCode;

/// Arguments of `closecall replay`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall replay closecall-results 34",
    "closecall replay closecall-results 34 --paired --record pair.rrd",
    "closecall replay closecall-results 34 --scenario low-thw-overtake --set environment.friction=0.5",
]))]
pub(super) struct ReplayArgs {
    #[command(flatten)]
    saved_sample: SavedSampleArgs,
    /// Run every arm of the campaign again; --record saves all of them in one file
    #[arg(long, conflicts_with = "controller", help_heading = heading::CONTROLLER)]
    paired: bool,
    #[command(flatten)]
    set: SetArgs,
    #[command(flatten)]
    watch: WatchArgs,
    /// Output format
    #[arg(long, value_enum, default_value_t, help_heading = heading::OUTPUT)]
    format: Format,
}

pub(super) fn replay(args: &ReplayArgs) -> Result<ExitCode, CliError> {
    let saved = args.saved_sample.saved.open(&args.saved_sample.dir)?;
    saved.folder().check_journal()?;
    let controllers = saved.manifest().arms.iter().flat_map(files_of_controller);
    protect(
        &files_of_campaign(&args.saved_sample.dir).into_iter().chain(controllers).collect::<Vec<_>>(),
        &args.watch.outputs(),
    )?;
    // Whether the folder is trusted is said before what is wrong in it.
    let arms = match args.paired {
        true => saved.arms()?,
        false => vec![saved.arm(args.saved_sample.controller.as_deref())?],
    };
    let (scenario, key) =
        saved.sample_with(args.saved_sample.scenario.as_deref(), args.saved_sample.sample, &args.set.settings)?;
    for arm in &arms {
        announce_process(saved.manifest(), arm.controller.name());
    }
    let names: Vec<&str> = arms.iter().map(|arm| arm.controller.name()).collect();
    // Asking a controller for its version starts it in the folder that the manifest names.
    let changes = match saved.not_trusted().is_empty() {
        true => saved.manifest().changed_controllers(&scenario, &names),
        false => Vec::new(),
    };
    for change in &changes {
        print_error(format_args!("{change}\n"));
    }
    let settings = [saved.manifest().settings(), args.set.settings.clone()].concat();
    let outcomes = run_watched(&scenario, key, &arms, &args.watch, &settings)?;
    print(&scenario, &arms, &outcomes, args.format, &settings);
    if !args.set.settings.is_empty() {
        return Ok(ExitCode::Pass);
    }
    let agreements = outcomes.iter().map(|outcome| saved.folder().agreement(outcome)).collect::<Result<Vec<_>, _>>()?;
    if !agreements.contains(&Agreement::Differs) {
        let missing = agreements.iter().filter(|agreement| **agreement == Agreement::NotCompared).count();
        if missing == 0 {
            return Ok(ExitCode::Pass);
        }
        print_error(format_args!(
            "not compared: the campaign's journal has no result of {missing} of the {} runs; its campaign may not have come to its end\n",
            outcomes.len()
        ));
        return Ok(ExitCode::Inconclusive);
    }
    let (there, here) = (&saved.manifest().closecall_version, version());
    let cause = match &changes[..] {
        [] if *there == here => unchanged(saved.manifest()).to_owned(),
        [] => format!("closecall {there} ran the campaign, this is {here}"),
        changes => changes.join("; "),
    };
    print_error(format_args!("the replay differs from the campaign's journal: {cause}\n"));
    Ok(ExitCode::Invalid)
}

/// Returns what has not changed since the campaign, in words. A file that only a controller knows may have changed.
fn unchanged(manifest: &Manifest) -> &'static str {
    if manifest.foreign_code().is_empty() {
        return "the program has not changed";
    }
    "the program has not changed, nor have the files that the commands name; files that a controller imports are not \
     checked"
}

/// Prints the command of an external controller before it starts. The folder may have another
/// author, whose command must not run unnoticed.
fn announce_process(manifest: &Manifest, name: &str) {
    for (arm, arm_name) in manifest.arms.iter().zip(manifest.arm_names()) {
        if arm.has_limits() && arm_name == name {
            let shown = arm.exec().map_or_else(|| arm.to_string(), |exec| exec.command.clone());
            print_error(format_args!("running the controller that the campaign names: {shown}\n"));
        }
    }
}
