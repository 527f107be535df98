//! `closecall baseline`: keeps the results of a campaign in a small file, and compares later campaigns with it.

use std::path::PathBuf;

use clap::{Args, Subcommand};
use closecall_campaign::baseline::{BASELINE_VERSION, Baseline, BaselineComparison, ScenarioBaselineComparison};
use closecall_campaign::folder::{Folder, FolderError};
use closecall_scenarios::atomic::write_file;
use serde_json::{Value, json};

use super::CliError;
use super::args::Format;
use super::gates::share;
use super::json::stamped;
use super::output::{listed, outln};
use crate::exit_code::ExitCode;

/// Arguments of `closecall baseline`.
#[derive(Debug, Args)]
pub(super) struct BaselineArgs {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Write the results of a campaign to a small file, to be committed with the scenarios
    Save {
        /// Folder of the campaign
        dir: PathBuf,
        /// File to write; an existing baseline is replaced
        file: PathBuf,
    },
    /// Name what newly fails, what is fixed, and which margins shrank since the baseline was saved. The exit code of a
    /// regression is 1
    Compare {
        /// Folder of the campaign
        dir: PathBuf,
        /// File that `closecall baseline save` has written
        file: PathBuf,
        /// Share (0 to 1) by which a quantile of a margin may fall
        #[arg(long, value_name = "SHARE", value_parser = share, default_value_t = 0.05)]
        tolerance: f64,
        /// Output format
        #[arg(long, value_enum, default_value_t)]
        format: Format,
    },
}

pub(super) fn baseline(args: &BaselineArgs) -> Result<ExitCode, CliError> {
    match &args.action {
        Action::Save { dir, file } => save(dir, file),
        Action::Compare { dir, file, tolerance, format } => compare(dir, file, *tolerance, *format),
    }
}

fn save(dir: &std::path::Path, file: &std::path::Path) -> Result<ExitCode, CliError> {
    // Only a baseline is replaced: another file may be an input.
    if file.exists() {
        read(file)?;
    }
    let baseline = Baseline::of(&Folder::open(dir))?;
    write_file(file, |out| {
        serde_json::to_writer_pretty(&mut *out, &baseline)?;
        out.write_all(b"\n")
    })?;
    for (name, scenario) in &baseline.scenarios {
        let (samples, collisions, errors) = (scenario.samples, scenario.collisions, scenario.errors);
        outln!("{name}: {samples} samples, {collisions} collisions, {errors} errors");
    }
    outln!("written: {}", file.display());
    Ok(ExitCode::Pass)
}

fn read(file: &std::path::Path) -> Result<Baseline, CliError> {
    let path = || file.to_owned();
    let text = std::fs::read_to_string(file).map_err(|source| FolderError::Read { path: path(), source })?;
    let content = |line, message| FolderError::Content { path: path(), line, message };
    // The version comes first: another layout has other keys.
    let value: Value = serde_json::from_str(&text).map_err(|error| content(error.line(), error.to_string()))?;
    if value["schema_version"] != BASELINE_VERSION {
        let message = format!("the file is not a baseline of version {BASELINE_VERSION}");
        return Err(content(1, message).into());
    }
    let read = serde_json::from_value(value).map_err(|error| content(1, error.to_string()))?;
    Ok(read)
}

fn compare(
    dir: &std::path::Path,
    file: &std::path::Path,
    tolerance: f64,
    format: Format,
) -> Result<ExitCode, CliError> {
    let (before, current) = (read(file)?, Baseline::of(&Folder::open(dir))?);
    let found = before.compare(&current, tolerance)?;
    let code = if found.is_regression() { ExitCode::Fail } else { ExitCode::Pass };
    match format {
        Format::Json => {
            let object = json!({
                "verdict": if code == ExitCode::Pass { "PASS" } else { "FAIL" },
                "tolerance": tolerance,
                "scenarios": found.scenarios,
                "new_scenarios": found.new_scenarios,
            });
            outln!("{:#}", stamped(object, Some(current.seed), None));
        }
        Format::Human => print(&found, file),
    }
    Ok(code)
}

fn print(found: &BaselineComparison, file: &std::path::Path) {
    for ScenarioBaselineComparison { scenario, newly_failing, fixed, margins } in &found.scenarios {
        outln!("{scenario}");
        outln!("  {:>6} newly failing{}", newly_failing.len(), listed(newly_failing));
        outln!("  {:>6} fixed{}", fixed.len(), listed(fixed));
        for regression in margins {
            let (margin, quantile) = (&regression.margin, &regression.quantile);
            outln!("  {margin} {quantile}: {:.3} in the baseline, now {:.3}", regression.baseline, regression.current);
        }
    }
    for scenario in &found.new_scenarios {
        outln!("{scenario}: not in the baseline, and not compared");
    }
    outln!("{}", if found.is_regression() { "REGRESSION" } else { "NO REGRESSION" });
    if !found.is_regression() && (found.has_fixed() || !found.new_scenarios.is_empty()) {
        outln!("`closecall baseline save DIR {}` keeps this result", file.display());
    }
}
