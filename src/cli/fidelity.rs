//! `closecall study fidelity`: rates of the full chain, sharpened by runs with fast sensors.

use std::path::PathBuf;

use clap::Args;
use closecall_campaign::belief::believe;
use closecall_campaign::gate::MAX_FLIP_RATE;
use closecall_report::campaign::FidelityText;
use closecall_report::json::stamped;
use closecall_studies::fidelity::{FidelityReport, fidelity as estimate, time_ratios};
use serde_json::json;

use super::CliError;
use super::args::Format;
use super::help::{examples, heading};
use super::output::{outln, print_text};
use super::saved::SavedArgs;
use crate::exit_code::ExitCode;

/// Arguments of `closecall study fidelity`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall study fidelity full fast",
    "closecall study fidelity closecall-results closecall-results/fidelity",
    "closecall study fidelity full fast --format json",
]))]
pub(super) struct FidelityArgs {
    /// Folder of the campaign with the sensors that matter
    full: PathBuf,
    /// Folder of the same campaign with fast sensors and more samples: the same scenarios, seed and arms
    fast: PathBuf,
    #[command(flatten)]
    saved: SavedArgs,
    /// Output format
    #[arg(long, value_enum, default_value_t, help_heading = heading::OUTPUT)]
    format: Format,
}

pub(super) fn fidelity(args: &FidelityArgs) -> Result<ExitCode, CliError> {
    let (full, fast) = (args.saved.open(&args.full)?, args.saved.open(&args.fast)?);
    for saved in [&full, &fast] {
        believe(saved.folder(), MAX_FLIP_RATE)?;
    }
    let reports = estimate(&full, &fast)?;
    match args.format {
        Format::Json => {
            let seed = Some(full.manifest().sampling.seed);
            outln!("{:#}", stamped(json!({ "scenarios": reports }), seed, None));
        }
        Format::Human => {
            // The times are no result: a folder without them has the same rates.
            let ratios = time_ratios(full.folder(), fast.folder()).unwrap_or_default();
            for report in &reports {
                print_text(FidelityText { report, time_ratio: ratios.get(&report.scenario).copied() });
            }
        }
    }
    let has_estimate = |report: &FidelityReport| report.rates.iter().any(|rate| rate.estimate.is_some());
    Ok(if reports.iter().all(has_estimate) { ExitCode::Pass } else { ExitCode::Inconclusive })
}
