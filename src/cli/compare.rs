//! `closecall compare`: compares a campaign with an earlier one.

use std::path::PathBuf;

use clap::Args;
use closecall_campaign::compare::{ScenarioComparison, compare as compare_folders};
use closecall_campaign::folder::Folder;
use closecall_report::campaign::ComparisonText;
use closecall_report::json::{self, stamped};

use super::CliError;
use super::args::Format;
use super::gates::share;
use super::output::{out, outln};
use crate::exit_code::ExitCode;

/// Arguments of `closecall compare`.
#[derive(Debug, Args)]
pub(super) struct CompareArgs {
    /// Folder of the earlier campaign
    baseline: PathBuf,
    /// Folder of the campaign to be judged; it must have the same samples
    dir: PathBuf,
    /// Largest number of newly failing samples that does not count as a regression
    #[arg(long, default_value_t = 0, value_name = "K")]
    max_newly_failing: u64,
    /// Share (0 to 1) by which a quantile of a margin may fall
    #[arg(long, value_name = "SHARE", value_parser = share, default_value_t = 0.05)]
    tolerance: f64,
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

pub(super) fn compare(args: &CompareArgs) -> Result<ExitCode, CliError> {
    let (baseline, current) = (Folder::open(&args.baseline), Folder::open(&args.dir));
    let (baseline_manifest, current_manifest) = (baseline.manifest()?, current.manifest()?);
    let differences = baseline_manifest.differences(&current_manifest);
    let found = compare_folders(&baseline, &current)?;
    let code = judge(&found, args.max_newly_failing, args.tolerance);
    match args.format {
        Format::Json => {
            outln!(
                "{:#}",
                stamped(
                    json::comparison(&found, &differences, args.tolerance, code == ExitCode::Pass),
                    Some(current_manifest.sampling.seed),
                    None
                )
            )
        }
        Format::Human => {
            let (scenarios, differences) = (&found[..], &differences[..]);
            out!("{}", ComparisonText { scenarios, differences, tolerance: args.tolerance });
            outln!("{}", verdict(code));
        }
    }
    Ok(code)
}

fn judge(found: &[ScenarioComparison], max_newly_failing: u64, tolerance: f64) -> ExitCode {
    let newly_failing: usize = found.iter().map(|scenario| scenario.newly_failing.len()).sum();
    let has_lost_margin = found.iter().any(|scenario| !scenario.margin_regressions(tolerance).is_empty());
    let is_regression = newly_failing as u64 > max_newly_failing || has_lost_margin;
    let has_new_errors = found.iter().any(|scenario| !scenario.newly_in_error.is_empty());
    let codes = [(is_regression, ExitCode::Fail), (has_new_errors, ExitCode::SampleError)];
    ExitCode::first_of(codes.into_iter().filter(|(holds, _)| *holds).map(|(_, code)| code))
}

fn verdict(code: ExitCode) -> &'static str {
    match code {
        ExitCode::Pass => "NO REGRESSION",
        ExitCode::SampleError => "NEW ERRORS",
        _ => "REGRESSION",
    }
}
