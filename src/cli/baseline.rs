//! `closecall baseline`: keeps the results of a campaign in a small file, and compares later
//! campaigns with it.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use closecall_campaign::arguments::share;
use closecall_campaign::baseline::Baseline;
use closecall_campaign::folder::Folder;
use closecall_campaign::gate::MAX_FLIP_RATE;
use closecall_report::campaign::BaselineText;
use closecall_report::json::stamped;
use closecall_traffic::atomic::WriteError;
use closecall_traffic::words::counted;
use serde_json::json;

use super::CliError;
use super::args::Format;
use super::help::{examples, heading};
use super::output::{outln, print_text, print_written, textln};
use crate::exit_code::ExitCode;

/// Arguments of `closecall baseline`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall baseline save closecall-results baseline.json",
    "closecall baseline compare closecall-results baseline.json",
    "closecall baseline compare closecall-results baseline.json --format json",
]))]
pub(super) struct BaselineArgs {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Write the results of a campaign to a small file, to be committed with the scenarios
    #[command(after_help = examples([
        "closecall baseline save closecall-results baseline.json",
        "closecall baseline save results/nightly scenarios/baseline.json",
        "closecall baseline save /tmp/merged merged.json",
    ]))]
    Save {
        /// Folder of the campaign
        dir: PathBuf,
        /// File to write; an existing baseline is replaced
        file: PathBuf,
        /// Share (0 to 1) of the checked verdicts of a campaign that may flip at half the time step. With
        /// more, the campaign is INVALID
        #[arg(long, value_name = "SHARE", value_parser = share, default_value_t = MAX_FLIP_RATE, help_heading = heading::GATES)]
        max_flip_rate: f64,
    },
    /// Name what newly fails, what is fixed, and which margins shrank since the baseline was saved.
    /// The exit code of a regression is 1
    #[command(after_help = examples([
        "closecall baseline compare closecall-results baseline.json",
        "closecall baseline compare closecall-results baseline.json --tolerance 0.1",
        "closecall baseline compare closecall-results baseline.json --format json",
    ]))]
    Compare {
        /// Folder of the campaign
        dir: PathBuf,
        /// File that `closecall baseline save` has written
        file: PathBuf,
        /// Share (0 to 1) by which a quantile of a margin may fall
        #[arg(long, value_name = "SHARE", value_parser = share, default_value_t = 0.05, help_heading = heading::GATES)]
        tolerance: f64,
        /// Share (0 to 1) of the checked verdicts of a campaign that may flip at half the time step. With
        /// more, the campaign is INVALID
        #[arg(long, value_name = "SHARE", value_parser = share, default_value_t = MAX_FLIP_RATE, help_heading = heading::GATES)]
        max_flip_rate: f64,
        /// Output format
        #[arg(long, value_enum, default_value_t, help_heading = heading::OUTPUT)]
        format: Format,
    },
}

pub(super) fn baseline(args: &BaselineArgs) -> Result<ExitCode, CliError> {
    match &args.action {
        Action::Save { dir, file, max_flip_rate } => save(dir, file, *max_flip_rate),
        Action::Compare { dir, file, tolerance, max_flip_rate, format } => {
            let compared = [Baseline::read(file)?, Baseline::of(&Folder::open(dir), *max_flip_rate)?];
            compare(&compared, *tolerance, file, *format)
        }
    }
}

fn save(dir: &Path, file: &Path, max_flip_rate: f64) -> Result<ExitCode, CliError> {
    // Only a baseline is replaced: another file may be an input.
    if file.try_exists().map_err(|source| WriteError::new(file, source))? {
        Baseline::read(file)?;
    }
    let baseline = Baseline::of(&Folder::open(dir), max_flip_rate)?;
    baseline.write(file)?;
    for (name, scenario) in &baseline.scenarios {
        let samples = counted(scenario.samples, "sample");
        let (collisions, errors) = (counted(scenario.collisions, "collision"), counted(scenario.errors, "error"));
        textln!("{name}: {samples}, {collisions}, {errors}");
    }
    print_written(file);
    Ok(ExitCode::Pass)
}

fn compare(
    [before, current]: &[Baseline; 2],
    tolerance: f64,
    file: &Path,
    format: Format,
) -> Result<ExitCode, CliError> {
    let comparison = before.compare(current, tolerance)?;
    let regression = comparison.regression();
    let code = ExitCode::from(regression);
    match format {
        Format::Json => {
            let object = json!({
                "verdict": regression.verdict(),
                "tolerance": tolerance,
                "scenarios": comparison.scenarios,
                "new_scenarios": comparison.new_scenarios,
                "not_compared": comparison.not_compared,
            });
            outln!("{:#}", stamped(object, Some(current.seed), None));
        }
        Format::Human => {
            print_text(BaselineText(&comparison));
            if code == ExitCode::Pass && (comparison.has_fixed() || !comparison.new_scenarios.is_empty()) {
                outln!("`closecall baseline save DIR {}` keeps this result", file.display());
            }
        }
    }
    Ok(code)
}
