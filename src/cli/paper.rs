//! `closecall traffic paper`: the figures of the published method on any set of trajectory files.

use std::path::PathBuf;

use clap::Args;
use closecall_campaign::arguments::{positive, whole};
use closecall_campaign::robustness::robustness;
use closecall_recorded::criticality::{Judgement, criticality};
use closecall_recorded::robustness::Setup;
use closecall_report::traffic::paper::Paper;
use closecall_report::traffic::statistics::RecordedChanges;
use closecall_traffic::atomic::write_file;

use super::CliError;
use super::args::{FilesArgs, smooth_noting, warn_without_lane_changes};
use super::help::{examples, heading};
use super::output::{during, print_written, write_charts};
use super::protect::{files_of_trajectories, must_be_folder, protect};
use super::robustness::refused;
use crate::exit_code::ExitCode;

/// Arguments of `closecall traffic paper`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall traffic paper traffic.csv -o figures",
    "closecall traffic paper one.csv two.csv -o figures --repetitions 0",
    "closecall traffic paper traffic.csv -o figures --speed-limit-mps 27.8",
]))]
pub(super) struct PaperArgs {
    #[command(flatten)]
    data: FilesArgs,
    /// Speed limit in m/s [default: 120 km/h]
    #[arg(long, value_name = "M/S", value_parser = positive, help_heading = heading::METHOD)]
    speed_limit_mps: Option<f64>,
    /// Seed of the noise of figure 3
    #[arg(long, default_value_t = 0, value_parser = closecall_campaign::arguments::seed, help_heading = heading::METHOD)]
    seed: u64,
    /// Number of draws of the noise at each level; 0 leaves figure 3 out
    #[arg(long, default_value_t = Setup::default().repetitions, value_parser = whole::<u64, 0, 10_000>, help_heading = heading::METHOD)]
    repetitions: u64,
    /// Folder for the pictures and `index.html`
    #[arg(short, long = "out", alias = "output", value_name = "DIR", help_heading = heading::OUTPUT)]
    output: PathBuf,
}

pub(super) fn paper(args: &PaperArgs) -> Result<ExitCode, CliError> {
    let index = args.output.join("index.html");
    protect(&files_of_trajectories(&args.data.files), &[("--out", Some(&index))])?;
    must_be_folder(Some(&args.output))?;
    let files = smooth_noting(&args.data)?;
    let is_in_doubt = files.iter().any(|file| file.is_in_doubt);
    let judgement = Judgement { speed_limit_mps: args.speed_limit_mps, ..Judgement::default() };
    let recorded = files
        .into_iter()
        .map(|file| RecordedChanges { changes: criticality(&file.data, &judgement), name: file.data.name });
    let recorded: Vec<RecordedChanges> = recorded.collect();
    let lane_changes = recorded.iter().map(|recording| recording.changes.len()).sum();
    let is_in_doubt = is_in_doubt || warn_without_lane_changes(&args.data.files, lane_changes);
    let setup = Setup { seed: args.seed, repetitions: args.repetitions, ..Setup::default() };
    let studied = match args.repetitions {
        0 => None,
        _ => during("studying the robustness".to_owned(), || {
            robustness(&args.data.files, args.data.read.options(), &setup, |_, _| {})
        })
        .map_err(refused)?,
    };
    let paper = Paper::new(&recorded, studied.as_ref(), args.speed_limit_mps)?;
    let paths: Vec<PathBuf> = paper.pictures.iter().map(|picture| args.output.join(&picture.name)).collect();
    let charts: Vec<String> = paper.pictures.into_iter().map(|picture| picture.svg).collect();
    write_charts(&args.output, &paths, &charts)?;
    write_file(&index, |file| file.write_all(paper.page.as_bytes()))?;
    print_written(&index);
    Ok(if is_in_doubt { ExitCode::Inconclusive } else { ExitCode::Pass })
}
