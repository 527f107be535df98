//! `closecall study fidelity`: rates of the full chain, sharpened by runs with fast sensors.

use std::fmt;
use std::path::PathBuf;

use clap::Args;
use closecall_report::json::stamped;
use closecall_studies::fidelity::{FidelityReport, fidelity as estimate};
use closecall_traffic::statistics::format::percent;
use closecall_traffic::words::counted;
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
    "closecall study fidelity closecall-results results/object",
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
    let reports = estimate(&full, &fast)?;
    match args.format {
        Format::Json => {
            let seed = Some(full.manifest().sampling.seed);
            outln!("{:#}", stamped(json!({ "scenarios": reports }), seed, None));
        }
        Format::Human => reports.iter().for_each(|report| print_text(Text(report))),
    }
    let has_estimate = |report: &FidelityReport| report.rates.iter().any(|rate| rate.estimate.is_some());
    Ok(if reports.iter().all(has_estimate) { ExitCode::Pass } else { ExitCode::Inconclusive })
}

/// A report for people.
struct Text<'a>(&'a FidelityReport);

impl fmt::Display for Text<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let FidelityReport { scenario, samples, more_samples, left_out, rates } = self.0;
        let both = counted(*samples, "sample");
        writeln!(f, "{scenario}: {both} in both modes, {more_samples} in the fast mode alone")?;
        if *left_out > 0 {
            writeln!(f, "  left out, because a run ended in an error: {}", counted(*left_out, "sample"))?;
        }
        for rate in rates {
            let [low, high] = rate.plain_interval_95.map(percent);
            writeln!(f, "  {}: {} (95 %: {low} to {high}) by the full chain alone", rate.of, percent(rate.plain))?;
            let correlation = rate.correlation.map_or_else(
                || "one of the modes does not vary".to_owned(),
                |correlation| format!("correlation {correlation:.2}"),
            );
            match rate.estimate {
                Some(estimate) => {
                    let [low, high] = estimate.interval_95.map(percent);
                    let (value, worth) = (percent(estimate.value), estimate.worth_samples);
                    writeln!(
                        f,
                        "    with the fast runs: {value} (95 %: {low} to {high}), worth {worth:.0} samples of the full chain; {correlation}"
                    )?;
                }
                None => writeln!(
                    f,
                    "    with the fast runs: no interval, because {} events are too few or too many; {correlation}",
                    rate.events
                )?,
            }
        }
        Ok(())
    }
}
