//! `closecall explain` and `minimize`, `closecall study map` and `exposure`: from a collision to
//! its cause, and how often it matters.

use std::path::PathBuf;

use clap::Args;
use closecall_campaign::arguments::{count, positive};
use closecall_campaign::saved::SavedCampaign;
use closecall_recorded::filters::smooth;
use closecall_report::campaign::write_causes;
use closecall_report::json::stamped;
use closecall_report::study::write_map;
use closecall_scenarios::causal::LETTERS;
use closecall_simulation::controller::ControllerChoice;
use closecall_studies::CausesError;
use closecall_studies::case::Case;
use closecall_studies::cost::{CostText, cost as cost_of};
use closecall_studies::explain::ExplanationText;
use closecall_studies::exposure::{
    Counted, EventRule, ExposureText, StatedRange, exposure as compute_exposure, observe, shares_of,
};
use closecall_studies::failures::{SampleErrors, explain_failures};
use closecall_studies::map::{MapGrid, MapText, map as compute_map};
use closecall_studies::minimize::{MinimizedText, NearestSearch, minimize_sample, output_files, write_files};
use serde_json::json;

use super::CliError;
use super::actions::command_for;
use super::advice::to_provide;
use super::args::{Format, ReadArgs, ReadFiles, SetArgs, read_noting};
use super::help::{examples, heading};
use super::new::scenario_file;
use super::output::{during, outln, print_error, print_text, print_written, textln, warn};
use super::protect::{files_of_campaign, must_be_folder, must_be_writable, protect};
use super::saved::{SavedArgs, check_record};
use crate::exit_code::ExitCode;

/// Arguments of `closecall explain`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall explain closecall-results",
    "closecall explain closecall-results 34",
    "closecall explain closecall-results --scenario low-thw-overtake --most 10",
]))]
pub(super) struct ExplainArgs {
    /// Folder of the campaign
    dir: PathBuf,
    /// Number of a failing sample [default: all failing samples, up to --most]
    sample: Option<u64>,
    /// Name of the scenario; required if a sample is named and the campaign has several
    #[arg(long, help_heading = heading::SAMPLES)]
    scenario: Option<String>,
    /// Largest number of samples to explain: induced failures first, then the most harmful ones
    #[arg(long, value_name = "N", value_parser = count, default_value = "100", conflicts_with = "sample", help_heading = heading::SAMPLES)]
    most: u64,
    #[command(flatten)]
    saved: SavedArgs,
    /// Output format
    #[arg(long, value_enum, default_value_t, help_heading = heading::OUTPUT)]
    format: Format,
}

pub(super) fn explain(args: &ExplainArgs) -> Result<ExitCode, CliError> {
    let saved = args.saved.open(&args.dir)?;
    saved.check_trust()?;
    match args.sample {
        // All failures are the failures of all samples.
        None => saved.folder().complete_records()?.try_for_each(|record| record.map(drop))?,
        Some(sample) => check_record(saved.folder(), &saved.sample(args.scenario.as_deref(), sample)?.0.name, sample)?,
    }
    let explained = during(format!("explaining {}", args.dir.display()), || {
        explain_failures(&saved, args.scenario.as_deref(), args.sample, args.most)
    });
    let (explanations, failures) = explained?;
    match write_causes(&saved, &failures, command_for) {
        Ok(paths) => paths.iter().for_each(|path| print_written(path)),
        // The explanation does not depend on it.
        Err(error) => print_error(format_args!("warning: the explanation is not kept: {error}\n")),
    }
    let errors = match args.sample {
        Some(_) => None,
        None => SampleErrors::of(&saved, args.scenario.as_deref(), None)?,
    };
    if let Some(errors) = &errors {
        warn(errors);
    }
    match (args.format, args.sample, &explanations[..]) {
        (Format::Json, Some(_), [explanation]) => {
            outln!("{:#}", stamped(json!(explanation), Some(explanation.seed), None))
        }
        (Format::Json, ..) => outln!("{:#}", stamped(json!(explanations), None, None)),
        (Format::Human, _, []) => {
            let with_outcome = if errors.is_some() { " that has an outcome" } else { "" };
            textln!("no sample of {}{with_outcome} fails", args.scenario.as_deref().unwrap_or("the campaign"));
        }
        (Format::Human, ..) => {
            for explanation in &explanations {
                print_text(format_args!("{}\n", ExplanationText { explanation, folder: &args.dir, command_for }));
            }
            textln!("{LETTERS}");
        }
    }
    // That no sample fails is not known.
    Ok(if errors.is_some() && explanations.is_empty() { ExitCode::SampleError } else { ExitCode::Pass })
}

/// Arguments of `closecall minimize`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall minimize closecall-results 34",
    "closecall minimize closecall-results 34 --scenario low-thw-overtake --controller mis -o case.toml",
    "closecall minimize closecall-results --nearest --runs 1000 --format json",
]))]
pub(super) struct MinimizeArgs {
    /// Folder of the campaign
    dir: PathBuf,
    /// Number of the sample [default: with --nearest, the failing samples that are nearest to the
    /// nominal case]
    #[arg(required_unless_present = "nearest")]
    sample: Option<u64>,
    /// Search the failing case that is nearest to the nominal case, in standard deviations, from one
    /// sample or from all failing samples
    #[arg(long, help_heading = heading::METHOD)]
    nearest: bool,
    /// With --nearest: largest number of runs of the search [default: 2000]
    #[arg(short = 'n', long, value_name = "N", value_parser = count, requires = "nearest", help_heading = heading::METHOD)]
    runs: Option<u64>,
    /// Name of the scenario; required if the campaign has several
    #[arg(long, help_heading = heading::SAMPLES)]
    scenario: Option<String>,
    /// Controller of the arm to run again [default: the controller under test]
    #[arg(long, value_name = "NAME", help_heading = heading::CONTROLLER)]
    controller: Option<String>,
    #[command(flatten)]
    saved: SavedArgs,
    /// Scenario file to write [default: SCENARIO-SAMPLE.toml, with --nearest SCENARIO-nearest.toml].
    /// The nearest case that passes is written beside it, with `-passes` at the end of its name
    #[arg(short, long = "out", alias = "output", value_name = "FILE.toml", value_parser = scenario_file, help_heading = heading::OUTPUT)]
    output: Option<PathBuf>,
    /// Output format
    #[arg(long, value_enum, default_value_t, help_heading = heading::OUTPUT)]
    format: Format,
}

/// Largest number of runs of a search for the nearest failure, unless another one is named.
const NEAREST_RUNS: u64 = 2_000;

pub(super) fn minimize(args: &MinimizeArgs) -> Result<ExitCode, CliError> {
    let MinimizeArgs { sample, scenario, controller, .. } = args;
    let (scenario, controller) = (scenario.as_deref(), controller.as_deref());
    let saved = args.saved.open(&args.dir)?;
    let case_of = |sample: u64| Case::of(&saved, scenario, sample, controller).map_err(CausesError::from);
    // Without --nearest, the command line has a sample.
    let (case, search) = match *sample {
        Some(sample) if !args.nearest => (case_of(sample)?, None),
        sample => {
            let search = NearestSearch::of(&saved, scenario, sample, controller)?;
            (search.case().clone(), Some(search))
        }
    };
    match (*sample, &search) {
        (Some(sample), None) => check_record(saved.folder(), &case.file.config().name, sample)?,
        _ => saved.folder().check_journal()?,
    }
    let of_nearest = search.as_ref().map(|_| PathBuf::from(format!("{}-nearest.toml", case.file.config().name)));
    let paths = output_files(&case, args.output.as_deref().or(of_nearest.as_deref()))?;
    protect(&files_of_campaign(&args.dir), &paths.each_ref().map(|path| ("--out", Some(path.as_path()))))?;
    paths.iter().try_for_each(|path| must_be_writable(Some(path)))?;
    let minimized = during(format!("minimizing a failure of {}", args.dir.display()), || match search {
        Some(search) => search.run(&saved, args.runs.unwrap_or(NEAREST_RUNS)),
        None => minimize_sample(&saved, &case),
    })?;
    let files = write_files(&case, &minimized, &paths, command_for)?;
    [Some(&files.failing), files.twin.as_ref()].into_iter().flatten().for_each(|path| print_written(path));
    match args.format {
        Format::Json => {
            outln!("{:#}", stamped(json!({ "minimized": minimized, "files": files }), Some(minimized.seed), None))
        }
        Format::Human => {
            let text = MinimizedText { minimized: &minimized, files: &files, command_for };
            print_text(format_args!("{text}\n"));
        }
    }
    Ok(ExitCode::Pass)
}

/// Arguments of `closecall study map`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall study map",
    "closecall study map --controller mis-extended --out map",
    "closecall study map --closing-kmh 10,20,30 --detection-m 80,120 --front-thw-s 0.7,0.9",
]))]
pub(super) struct MapArgs {
    /// Speed of the ego and of the lead vehicle
    #[arg(long, value_name = "M/S", value_parser = positive, default_value = "30", help_heading = heading::METHOD)]
    speed_mps: f64,
    /// Speed differences of the rear vehicle
    #[arg(long, value_name = "KM/H,…", value_delimiter = ',', value_parser = positive, default_value = "10,15,20,22.5,25,27.5,30,40,50", help_heading = heading::METHOD)]
    closing_kmh: Vec<f64>,
    /// Gaps at which the system may engage
    #[arg(long, value_name = "M,…", value_delimiter = ',', value_parser = positive, default_value = "60,80,100,120,150", help_heading = heading::METHOD)]
    detection_m: Vec<f64>,
    /// Front time headways at the start
    #[arg(long, value_name = "S,…", value_delimiter = ',', value_parser = positive, default_value = "0.5,0.7,0.9,1.2", help_heading = heading::METHOD)]
    front_thw_s: Vec<f64>,
    /// System whose engagement gaps and braking the map shows: `mis` or `mis-extended`
    #[arg(long, default_value = "mis", help_heading = heading::CONTROLLER)]
    controller: ControllerChoice,
    /// Folder for the page, the pictures (SVG) and the points (CSV, JSON)
    #[arg(short, long, value_name = "DIR", help_heading = heading::OUTPUT)]
    out: Option<PathBuf>,
    #[command(flatten)]
    set: SetArgs,
    /// Output format
    #[arg(long, value_enum, default_value_t, help_heading = heading::OUTPUT)]
    format: Format,
}

pub(super) fn map(args: &MapArgs) -> Result<ExitCode, CliError> {
    must_be_folder(args.out.as_deref())?;
    let MapArgs { speed_mps, closing_kmh, detection_m, front_thw_s, .. } = args;
    let (closing_kmh, detection_m, front_thw_s) = (closing_kmh.clone(), detection_m.clone(), front_thw_s.clone());
    let grid = MapGrid { speed_mps: *speed_mps, closing_kmh, detection_m, front_thw_s };
    let points = during("computing the map".to_owned(), || compute_map(&grid, &args.controller, &args.set.settings));
    let points = points.map_err(CausesError::from)?;
    if let Some(out) = &args.out {
        write_map(out, &points)?.iter().for_each(|path| print_written(path));
    }
    match args.format {
        Format::Json => outln!("{:#}", stamped(json!(points), None, None)),
        Format::Human => print_text(format_args!("{}\n", MapText(&points))),
    }
    Ok(ExitCode::Pass)
}

/// Arguments of `closecall study exposure`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall study exposure traffic.csv --campaign closecall-results",
    "closecall study exposure --counted 20/5000 --campaign closecall-results",
    "closecall study exposure --per-million-km 100..10000 --campaign closecall-results",
]))]
pub(super) struct ExposureArgs {
    /// Trajectory files, in which the encounters are counted
    #[arg(value_name = "TRAJECTORY_FILE")]
    files: Vec<PathBuf>,
    #[command(flatten)]
    read: ReadArgs,
    /// Deceleration in m/s² from which the lead vehicle counts as braking
    #[arg(long, value_name = "M/S²", value_parser = positive, default_value = "4", help_heading = heading::METHOD)]
    braking_mps2: f64,
    /// Range of the encounters per 10^6 km, if no file shows the rate
    #[arg(long, value_name = "LOW..HIGH", conflicts_with = "counted", help_heading = heading::METHOD)]
    per_million_km: Option<StatedRange>,
    /// Encounters that were counted elsewhere, and the distance in km
    #[arg(long, value_name = "EVENTS/KM", conflicts_with = "files", help_heading = heading::METHOD)]
    counted: Option<Counted>,
    /// Folder of a paired campaign, which shows what the system prevents and induces, given an
    /// encounter
    #[arg(long, value_name = "DIR", help_heading = heading::METHOD)]
    campaign: Option<PathBuf>,
    /// Name of the scenario, in which the lead vehicle brakes; required if the campaign has several
    #[arg(long, value_name = "NAME", requires = "campaign", help_heading = heading::METHOD)]
    scenario: Option<String>,
    /// Output format
    #[arg(long, value_enum, default_value_t, help_heading = heading::OUTPUT)]
    format: Format,
}

pub(super) fn exposure(args: &ExposureArgs) -> Result<ExitCode, CliError> {
    let rule = EventRule { braking_mps2: args.braking_mps2 };
    let mut observed = args.counted.map(Counted::observed);
    let mut files = ReadFiles::default();
    for path in &args.files {
        let data = read_noting(path, args.read.options())?;
        files.note(path, &data.hash)?;
        observe(&smooth(&data), rule, observed.get_or_insert_default());
    }
    let saved = args.campaign.as_deref().map(SavedCampaign::open).transpose()?;
    let shares = saved.as_ref().map(|saved| shares_of(saved, args.scenario.as_deref())).transpose()?;
    let cost = saved.as_ref().map(cost_of).transpose()?;
    let exposure = compute_exposure(rule, observed, args.per_million_km.map(|range| range.0), shares);
    match args.format {
        Format::Json => outln!("{:#}", stamped(json!({ "exposure": exposure, "cost": cost }), None, None)),
        Format::Human => {
            print_text(format_args!("{}\n", ExposureText(&exposure)));
            exposure.missing.iter().for_each(|missing| print_text(format_args!("  {}\n", to_provide(*missing))));
            cost.iter().for_each(|cost| print_text(format_args!("{}\n", CostText(cost))));
        }
    }
    Ok(if exposure.effect.is_some() { ExitCode::Pass } else { ExitCode::Inconclusive })
}
