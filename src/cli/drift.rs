//! `closecall traffic drift`: whether new traffic still matches fitted distributions.

use std::path::PathBuf;

use clap::Args;
use closecall_campaign::drift::{Fitted, drift as compare};
use closecall_report::json::stamped;
use closecall_report::traffic::drift::DriftText;

use super::CliError;
use super::args::{FilesArgs, Format, smooth_noting};
use super::help::{examples, heading};
use super::output::{during, outln, print_text, warn};
use crate::exit_code::ExitCode;

/// Arguments of `closecall traffic drift`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall traffic drift fitted.toml new.csv",
    "closecall traffic drift low-thw-overtake new-1.csv new-2.csv",
    "closecall traffic drift fitted.toml new.csv --seed 1 --format json",
]))]
pub(super) struct DriftArgs {
    /// File that `closecall traffic fit` wrote, or a scenario with parameters from one: its file, or
    /// its name in the library
    #[arg(value_name = "FITTED.toml|SCENARIO")]
    fitted: PathBuf,
    #[command(flatten)]
    data: FilesArgs,
    /// Seed of the simulated distances
    #[arg(long, default_value_t = 0, value_parser = closecall_campaign::arguments::seed, help_heading = heading::METHOD)]
    seed: u64,
    /// Output format
    #[arg(long, value_enum, default_value_t, help_heading = heading::OUTPUT)]
    format: Format,
}

pub(super) fn drift(args: &DriftArgs) -> Result<ExitCode, CliError> {
    let fitted = Fitted::read(&args.fitted)?;
    let files = smooth_noting(&args.data)?;
    let are_lanes_in_doubt = files.iter().any(|file| file.doubts_lanes);
    let drift = during("comparing distributions".to_owned(), || compare(&fitted, &files, args.seed));
    match args.format {
        Format::Json => outln!("{:#}", stamped(serde_json::json!(drift), None, None)),
        Format::Human => print_text(DriftText(&drift)),
    }
    if are_lanes_in_doubt {
        warn("the recorded lanes are in doubt, so that the comparison says nothing");
        return Ok(ExitCode::Inconclusive);
    }
    let is_in_doubt = files.iter().any(|file| file.is_in_doubt);
    Ok(match (drift.is_tested, drift.has_drifted) {
        (_, true) => ExitCode::Fail,
        (true, false) if !is_in_doubt => ExitCode::Pass,
        (true, false) => {
            warn("a trajectory file is in doubt, so that a drift may be missed");
            ExitCode::Inconclusive
        }
        (false, false) => ExitCode::Inconclusive,
    })
}
