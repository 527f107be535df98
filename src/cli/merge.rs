//! `closecall tool merge`: merges the parts of a campaign, and judges the result.

use std::path::PathBuf;

use clap::Args;
use closecall_campaign::controller_watch::{keep_changes, kept_changes};
use closecall_campaign::folder::{Folder, FolderError};
use closecall_campaign::merge::Parts;
use closecall_campaign::rare::RareParts;
use closecall_campaign::saved::{SavedCampaign, works};
use closecall_campaign::selection::Selection;
use closecall_campaign::session;
use closecall_report::campaign::{
    CampaignReport, CountsText, CoverageText, FlakyText, Tally, VerdictText, ensemble_text,
};
use closecall_report::json;
use closecall_scenarios::criteria::EventError;
use closecall_studies::fidelity::Fidelity;
use serde_json::json;

use super::CliError;
use super::actions::command_for;
use super::advice::{after_verdict, known_seed};
use super::args::Format;
use super::fast_samples::FastParts;
use super::gates::GateArgs;
use super::help::{examples, heading};
use super::output::{during, outln, print_error, print_text};
use super::rare::{Rare, RareArgs, Results};
use super::results::{ArtifactArgs, print_results, remember, selection};
use super::saved::TrustArgs;
use crate::exit_code::ExitCode;

/// Arguments of `closecall tool merge`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall tool merge part-1 part-2 --out merged",
    "closecall tool merge part-* --out gated --gate 'upper(induced) <= 0.01'",
    "closecall tool merge part-1 part-2 --out recorded --record worst:3 --format json",
]))]
pub(super) struct MergeArgs {
    /// Folders of all parts of one campaign, each made with `campaign --partition I/N`
    #[arg(required = true, value_name = "DIR")]
    parts: Vec<PathBuf>,
    /// Folder for the whole campaign; it must be new or empty
    #[arg(short, long, value_name = "DIR", help_heading = heading::OUTPUT)]
    out: PathBuf,
    /// Write the whole campaign anew into the folder of an earlier merge, finished or interrupted
    #[arg(long, help_heading = heading::OUTPUT)]
    resume: bool,
    /// Save recordings (Rerun files) of selected samples of each scenario, and a page that shows
    /// them. KIND is `worst`, `failures` or `random`; `each-kind` is the worst prevented, the worst
    /// induced and the worst shared collision of all scenarios [default: each-kind]
    #[arg(long, alias = "recordings", value_name = "KIND:N,…", help_heading = heading::OUTPUT)]
    record: Option<Selection>,
    #[command(flatten)]
    trust: TrustArgs,
    #[command(flatten)]
    artifacts: ArtifactArgs,
    #[command(flatten)]
    gates: GateArgs,
    /// Output format
    #[arg(long, value_enum, default_value_t, help_heading = heading::OUTPUT)]
    format: Format,
}

/// Returns what changed of the controllers while the parts ran, in words.
fn changes_of(parts: &[PathBuf]) -> Result<Vec<String>, FolderError> {
    let changes = parts.iter().map(|part| kept_changes(&Folder::open(part)));
    Ok(changes.collect::<Result<Vec<_>, _>>()?.concat())
}

/// Merges the parts of a campaign that samples a rare event. Nothing runs.
fn merge_rare(args: &MergeArgs, parts: &RareParts) -> Result<ExitCode, CliError> {
    let is_named = [
        (args.record.is_some(), "--record"),
        (args.gates.names_criterion()?, "a gate other than --max-probability"),
        (args.artifacts.is_named(), "--strict-artifacts"),
    ];
    if let Some((_, option)) = is_named.into_iter().find(|(is_named, _)| *is_named) {
        return Err(CliError::usage(format!(
            "the runs of a rare event are not independent samples of the scenario: their parts cannot be merged with {option}"
        )));
    }
    let manifest = parts.manifest();
    let works = works(&args.parts[0], &manifest.campaign)?;
    let is_paired = works.iter().all(|work| work.arms.len() > 1);
    let gates = args.gates.gates(is_paired, manifest.campaign.sampling.design, None)?;
    let event = manifest.event.parse().map_err(|error: EventError| CliError::usage(error.to_string()))?;
    let reports = parts.estimate(&works)?;
    let changes = changes_of(&args.parts)?;
    let folder = parts.write(&args.out, session::arguments(), args.resume)?;
    let rare = Rare {
        method: manifest.method,
        args: &RareArgs::default(),
        budget: Some(manifest.budget),
        gates,
        ray: None,
        folder: Some(&args.out),
        resume: args.resume,
        format: args.format,
        can_draw_seed: false,
    };
    keep_changes(&Folder::open(&args.out), &changes)?;
    let results = Results { event, reports: &reports, works: &works, changes: &changes };
    rare.conclude(results, &manifest.campaign, Some(&folder))
}

pub(super) fn merge(args: &MergeArgs) -> Result<ExitCode, CliError> {
    if let Some(parts) = RareParts::open(&args.parts)? {
        return merge_rare(args, &parts);
    }
    let parts = Parts::open(&args.parts)?;
    let mut is_trusted = true;
    for part in &args.parts {
        let saved = args.trust.open(part)?;
        if args.record.is_some() {
            saved.check_trust()?;
        }
        is_trusted &= saved.not_trusted().is_empty();
    }
    let works = works(&args.parts[0], parts.manifest())?;
    parts.check(&works)?;
    let fast_parts = FastParts::open(&args.parts)?;
    let is_paired = works.iter().all(|work| work.arms.len() > 1);
    let gates = args.gates.gates(is_paired, parts.manifest().sampling.design, None)?;
    let merged = during("merging".to_owned(), || parts.merge(&works, &args.out, session::arguments(), args.resume))?;
    // Samples are run again to record them. The merged folder is trusted as its parts are.
    let selection = if is_trusted { selection(args.record) } else { Selection::default() };
    if is_trusted {
        remember(&merged.folder);
    } else {
        print_error(format_args!(
            "no sample is recorded: parts were written by another user or on another machine, and their controllers run only with \
             --trust-folder\n"
        ));
    }
    let saved = SavedCampaign::of(merged.folder.clone())?;
    // Rates that an earlier merge has left are none of these parts.
    Fidelity::remove(saved.folder())?;
    let rates = fast_parts.map(|fast| fast.merge(saved.folder(), args.resume, is_trusted)).transpose()?;
    let changes = changes_of(&args.parts)?;
    keep_changes(saved.folder(), &changes)?;
    let tally = Tally::of(&saved, &works, &gates)?;
    let mut judged = tally.judgement();
    judged.add_invalid(changes);
    judged.add_left_out(&saved.manifest().left_out);
    if let Some(remark) = known_seed(judged.has_gates(), saved.manifest(), false) {
        judged.add_remark(remark);
    }
    let report =
        CampaignReport { manifest: saved.manifest(), works: &works, tally: &tally, judged: &judged, command_for };
    match args.format {
        Format::Json => {
            let mut value = json::campaign_report(&report, None);
            if let Some((fidelity, _)) = &rates {
                value["fidelity"] = json!(fidelity);
            }
            outln!("{value:#}");
        }
        Format::Human => {
            print_text(CountsText(&tally.summary));
            rates.iter().for_each(|(_, text)| print_text(text));
            print_text(ensemble_text(&tally.summary, saved.manifest()));
            print_text(CoverageText(&judged));
            print_text(FlakyText(&tally.overview));
            print_text(VerdictText { judged: &judged, scenarios: works.len() });
            print_text(after_verdict(&judged));
        }
    }
    let written = report.write(saved.folder(), selection);
    let code = args.artifacts.code((&judged).into(), &written);
    print_results(saved.folder(), &written.recorded);
    Ok(code)
}
