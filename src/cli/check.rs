//! `closecall check`: checks scenario files without running them, or one of them at every change;
//! and folders of campaigns.

use std::path::{Path, PathBuf};

use clap::{Arg, Args};
use closecall_campaign::folder::{FAST_SAMPLES, Folder};
use closecall_campaign::integrity::Problem;
use closecall_report::campaign::check_folder;
use closecall_report::json::stamped;
use closecall_scenarios::source::{self, KEYS_OF_SCENARIO};
use closecall_scenarios::{ScenarioError, ScenarioFile};
use closecall_traffic::words::counted;
use serde_json::{Value, json};

use super::CliError;
use super::actions::command_for;
use super::args::{FittedArgs, Format, SetArgs};
use super::help::{examples, heading};
use super::output::{outln, print_error, print_failure, textln};
use super::saved::refuse_rare;
use super::watching::{WatchingArgs, watch};
use crate::exit_code::ExitCode;

/// Largest number of skipped files that a note names.
const MOST_NAMED: usize = 5;

/// Arguments of `closecall check`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall check scenarios",
    "closecall check late-braking.toml --set brake-mps2=6 --format json",
    "closecall check closecall-results",
]))]
#[command(mut_args(only_with_watch))]
pub(super) struct CheckArgs {
    /// Scenario files, folders of them, names of scenarios of the library, or `-` for standard
    /// input; or folders of campaigns
    #[arg(required = true)]
    scenarios: Vec<PathBuf>,
    #[command(flatten)]
    set: SetArgs,
    #[command(flatten)]
    fitted: FittedArgs,
    #[command(flatten)]
    watching: WatchingArgs,
    /// Output format
    #[arg(long, value_enum, default_value_t, help_heading = heading::OUTPUT)]
    format: Format,
}

impl CheckArgs {
    /// Returns true if the command waits for changes of a file.
    pub(super) const fn is_watching(&self) -> bool {
        self.watching.watch
    }
}

/// Refuses the options about samples unless a file is watched: a check runs none.
fn only_with_watch(arg: Arg) -> Arg {
    match arg.get_id().as_str() {
        "scenarios" | "settings" | "fitted" | "format" | "watch" => arg,
        _ => arg.requires("watch"),
    }
}

pub(super) fn check(args: &CheckArgs) -> Result<ExitCode, CliError> {
    if args.watching.watch {
        let [scenario] = &args.scenarios[..] else {
            return Err(CliError::usage("--watch is for one scenario file"));
        };
        return watch(scenario, (&args.set, &args.fitted), &args.watching);
    }
    args.scenarios.iter().try_for_each(|path| refuse_rare(path))?;
    let is_campaign = |path: &&PathBuf| path.join("manifest.json").is_file() || path.join("journal.jsonl").is_file();
    let campaigns: Vec<&PathBuf> = args.scenarios.iter().filter(is_campaign).collect();
    if !campaigns.is_empty() {
        if campaigns.len() < args.scenarios.len() {
            return Err(CliError::usage("a check takes scenarios or folders of campaigns, not both"));
        }
        return Ok(check_campaigns(&campaigns, args.format));
    }
    let checked: Vec<_> =
        expand(&args.scenarios)?.into_iter().map(|path| (args.fitted.load(&path, &args.set), path)).collect();
    let codes: Vec<ExitCode> =
        checked.iter().filter_map(|(file, _)| Some(ExitCode::from(file.as_ref().err()?))).collect();
    match args.format {
        Format::Json => {
            let scenarios: Vec<Value> = checked.iter().map(|(file, path)| to_json(file, path)).collect();
            let object = json!({ "valid": codes.is_empty(), "scenarios": scenarios });
            outln!("{:#}", stamped(object, None, Some(&args.set.settings)));
        }
        Format::Human => checked.into_iter().for_each(|(file, path)| print(file, &path)),
    }
    Ok(ExitCode::first_of(codes))
}

/// Returns the scenarios that the arguments of a command name, and says which files of a folder are
/// skipped.
pub(super) fn expand(paths: &[PathBuf]) -> Result<Vec<PathBuf>, CliError> {
    let skipped = source::skipped(paths);
    if !skipped.is_empty() {
        let keys = KEYS_OF_SCENARIO.map(|key| format!("`{key}`")).join(", ");
        let named =
            skipped.iter().take(MOST_NAMED).map(|path| path.display().to_string()).collect::<Vec<_>>().join(", ");
        let more = skipped.len().saturating_sub(MOST_NAMED);
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        let files = counted(skipped.len(), "file");
        print_error(format_args!(
            "note: skipped as no scenarios, with none of the keys {keys}: {files}: {named}{more}\n"
        ));
    }
    Ok(source::expand(paths)?)
}

/// Checks whether folders of campaigns are whole, each with its fast samples.
fn check_campaigns(paths: &[&PathBuf], format: Format) -> ExitCode {
    let fast = |path: &Path| Some(path.join(FAST_SAMPLES)).filter(|fast| fast.is_dir() && !paths.contains(&fast));
    let paths = paths.iter().flat_map(|&path| [Some(path.clone()), fast(path)]).flatten();
    let checked: Vec<_> = paths
        .map(|path| {
            let integrity = check_folder(&Folder::open(&path), command_for);
            (path, integrity)
        })
        .collect();
    let is_sound = checked.iter().all(|(_, integrity)| integrity.is_sound());
    match format {
        Format::Json => {
            let campaigns: Vec<Value> = checked
                .iter()
                .map(|(path, integrity)| {
                    let (records, missing, problems) = (integrity.records, integrity.missing, &integrity.problems);
                    json!({ "path": path, "sound": integrity.is_sound(), "records": records, "missing": missing, "problems": problems })
                })
                .collect();
            outln!("{:#}", stamped(json!({ "valid": is_sound, "campaigns": campaigns }), None, None));
        }
        Format::Human => {
            for (path, integrity) in checked {
                for Problem { file, line, message, repair } in &integrity.problems {
                    let line = line.map_or_else(String::new, |line| format!(":{line}"));
                    outln!("{}{line}: {message}\n  repair: {repair}", path.join(file).display());
                }
                if integrity.is_sound() {
                    textln!("{}: sound, {}", path.display(), counted(integrity.records, "sample"));
                }
            }
        }
    }
    if is_sound { ExitCode::Pass } else { ExitCode::InvalidInput }
}

fn print(file: Result<ScenarioFile, ScenarioError>, path: &Path) {
    match file {
        Ok(file) => {
            let parameters = counted(file.space().iter().len(), "parameter");
            textln!("{}: valid, {} with {parameters}", path.display(), file.config().name);
        }
        Err(error) => print_failure(error.into()),
    }
}

fn to_json(file: &Result<ScenarioFile, ScenarioError>, path: &Path) -> Value {
    match file {
        Ok(file) => json!({
            "path": path,
            "valid": true,
            "name": file.config().name,
            "requirements": file.config().requirements,
            "parameters": file.config().parameters.0.keys().map(ToString::to_string).collect::<Vec<_>>(),
        }),
        Err(error) => json!({
            "path": path,
            "valid": false,
            "line": error.line(),
            "message": error.to_string(),
        }),
    }
}
