//! `closecall compare`: compares a campaign with an earlier one.

use std::path::PathBuf;

use clap::Args;
use closecall_campaign::arguments::share;
use closecall_campaign::compare::{Regression, compare as compare_folders};
use closecall_campaign::folder::Folder;
use closecall_campaign::gate::MAX_FLIP_RATE;
use closecall_report::campaign::ComparisonText;
use closecall_report::json::{self, stamped};

use super::CliError;
use super::args::Format;
use super::compare_search::{Folders, SearchArgs};
use super::help::{examples, heading};
use super::output::{outln, print_text};
use crate::exit_code::ExitCode;

/// Arguments of `closecall compare`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall compare before after",
    "closecall compare before after --max-newly-failing 2 --tolerance 0.1",
    "closecall compare before after --search --out regression",
]))]
pub(super) struct CompareArgs {
    /// Folder of the earlier campaign
    baseline: PathBuf,
    /// Folder of the campaign to be judged; it must have the same samples, except with --search
    dir: PathBuf,
    /// Largest number of newly failing samples that does not count as a regression
    #[arg(long, default_value_t = 0, value_name = "K", help_heading = heading::GATES)]
    max_newly_failing: u64,
    /// Share (0 to 1) by which a quantile of a margin may fall
    #[arg(long, value_name = "SHARE", value_parser = share, default_value_t = 0.05, help_heading = heading::GATES)]
    tolerance: f64,
    /// Share (0 to 1) of the checked verdicts of a campaign that may flip at half the time step. With
    /// more, the campaign is INVALID
    #[arg(long, value_name = "SHARE", value_parser = share, default_value_t = MAX_FLIP_RATE, help_heading = heading::GATES)]
    max_flip_rate: f64,
    #[command(flatten)]
    search: SearchArgs,
    /// Output format
    #[arg(long, value_enum, default_value_t, help_heading = heading::OUTPUT)]
    format: Format,
}

pub(super) fn compare(args: &CompareArgs) -> Result<ExitCode, CliError> {
    if args.search.is_asked()? {
        return args.search.run(Folders { earlier: &args.baseline, later: &args.dir }, args.format);
    }
    let (baseline, current) = (Folder::open(&args.baseline), Folder::open(&args.dir));
    let (baseline_manifest, current_manifest) = (baseline.manifest()?, current.manifest()?);
    let differences = baseline_manifest.differences(&current_manifest);
    let scenarios = compare_folders(&baseline, &current, args.max_flip_rate)?;
    let regression = Regression::of(&scenarios, args.max_newly_failing, args.tolerance);
    let code = ExitCode::from(regression);
    match args.format {
        Format::Json => {
            outln!(
                "{:#}",
                stamped(
                    json::comparison(&scenarios, &differences, args.tolerance, regression.verdict()),
                    Some(current_manifest.sampling.seed),
                    None
                )
            )
        }
        Format::Human => {
            let (scenarios, differences) = (&scenarios[..], &differences[..]);
            print_text(ComparisonText { scenarios, differences, tolerance: args.tolerance });
            outln!("{regression}");
        }
    }
    Ok(code)
}
