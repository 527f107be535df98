//! `closecall study sensitivity`, `closecall study frontier`, `closecall study boundary` and `closecall study anchor`: studies that
//! vary the assumptions, or the system, of a scenario.

use std::path::{Path, PathBuf};

use clap::Args;
use closecall_campaign::arguments::{count, whole};
use closecall_campaign::boundary::{Axis, BoundaryPlan, LARGEST_BUDGET, SMALLEST_BUDGET};
use closecall_campaign::execution::CampaignError;
use closecall_campaign::frontier::{FrontierPlan, Grid};
use closecall_campaign::runner::Sampling;
use closecall_campaign::sensitivity::{FactorRange, Method, SensitivityPlan};
use closecall_campaign::session;
use closecall_campaign::stop::StopFlag;
use closecall_campaign::workers::Workers;
use closecall_report::study::{Study, write_study};
use closecall_scenarios::ScenarioFile;
use closecall_scenarios::criteria::EventExpression;
use closecall_scenarios::member::members;
use closecall_scenarios::sampling::Design;
use closecall_sensors::SensorMode;
use closecall_sensors::camera::Pipeline;
use closecall_simulation::controller::ControllerChoice;
use closecall_studies::anchor::{self, AnchorError, AnchorPlan};

use super::CliError;
use super::args::{Format, SensorsChoice, SetArgs};
use super::arms::ControllerArgs;
use super::backend::{check_backend, check_cameras};
use super::campaign::progress_bar;
use super::help::{examples, heading};
use super::output::{heartbeat, outln, print_text, print_written};
use super::protect::must_be_folder;
use crate::exit_code::ExitCode;

/// Arguments that the studies of a scenario share.
#[derive(Debug, Args)]
pub(super) struct StudyArgs {
    /// Scenario file, or name of a scenario of the library
    scenario: PathBuf,
    /// Seed of the random numbers
    #[arg(long, default_value_t = 0, value_parser = closecall_campaign::arguments::seed, help_heading = heading::SAMPLES)]
    seed: u64,
    #[command(flatten)]
    controller: ControllerArgs,
    /// Depth of the sensor simulation [default: the scenario's]
    #[arg(long, value_enum, help_heading = heading::CONTROLLER)]
    sensors: Option<SensorsChoice>,
    /// Number of worker threads [default: one per processor]
    #[arg(long, value_parser = whole::<u16, 1, 1024>, help_heading = heading::EXECUTION)]
    jobs: Option<u16>,
    /// Folder for the page, the charts (SVG) and the figures (JSON)
    #[arg(short, long, value_name = "DIR", help_heading = heading::OUTPUT)]
    out: Option<PathBuf>,
    #[command(flatten)]
    set: SetArgs,
    /// Output format
    #[arg(long, value_enum, default_value_t, help_heading = heading::OUTPUT)]
    format: Format,
}

/// Arguments of `closecall study sensitivity`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall study sensitivity low-thw-overtake",
    "closecall study sensitivity low-thw-overtake --seed 1 --sensors object --out study",
    "closecall study sensitivity low-thw-overtake --factor environment.friction=0.5..0.9",
]))]
pub(super) struct SensitivityArgs {
    #[command(flatten)]
    study: StudyArgs,
    /// Vary a value of the scenario uniformly, named as for --set; can be given more than once
    #[arg(long = "factor", value_name = "KEY=LOW..HIGH", help_heading = heading::METHOD)]
    factors: Vec<FactorRange>,
    /// Vary only the sampled parameters and the factors of --factor, not the list for driver, sensor and controller
    #[arg(long, help_heading = heading::METHOD)]
    no_default_factors: bool,
    /// `morris`: screening only; `sobol`: decomposition by all factors; `both`: screening, then decomposition by the factors that matter
    #[arg(long, value_name = "morris|sobol|both", default_value = "both", help_heading = heading::METHOD)]
    method: Method,
    /// Number of trajectories of the screening, each with a run for every factor
    #[arg(long, value_name = "N", default_value = "40", value_parser = whole::<u64, 1, 10_000>, help_heading = heading::METHOD)]
    trajectories: u64,
    /// Number of rows of the decomposition, each with a run for every factor
    #[arg(short = 'n', long = "rows", value_name = "N", default_value = "512", value_parser = whole::<u64, 1, { 1 << 21 }>, help_heading = heading::METHOD)]
    rows: u64,
    /// Number of factors that the decomposition keeps apart after the screening
    #[arg(long, value_name = "N", default_value = "8", value_parser = whole::<u64, 1, 128>, help_heading = heading::METHOD)]
    top: u64,
}

/// Arguments of `closecall study frontier`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall study frontier low-thw-overtake",
    "closecall study frontier low-thw-overtake -n 500 --sensors object --out frontier",
    "closecall study frontier low-thw-overtake --vary actor.ego.driver.ego-stack.mis.hold-s=1,2",
]))]
pub(super) struct FrontierArgs {
    #[command(flatten)]
    study: StudyArgs,
    /// Values of a key, named as for --set. All combinations are run. Can be given more than once [default:
    /// braking, engagement distance, goal and critical gap of the margin increase system]
    #[arg(long = "vary", value_name = "KEY=a,b,…", help_heading = heading::METHOD)]
    vary: Vec<Grid>,
    /// Number of samples, the same for every combination
    #[arg(short = 'n', long = "samples", default_value = "200", value_parser = count, help_heading = heading::SAMPLES)]
    samples: u64,
}

/// Arguments of `closecall study boundary`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall study boundary slow-approach --along closing-mps cut-out-thw-s -e \"min_thw_rear_s<0.3\"",
    "closecall study boundary slow-approach --along closing-mps rear-cc1-s -e \"min_ttc_rear_s<5\" -o out",
    "closecall study boundary slow-approach --along closing-mps=2..2.5 rear-cc1-s -e \"min_ttc_rear_s<5\"",
]))]
pub(super) struct BoundaryArgs {
    #[command(flatten)]
    study: StudyArgs,
    /// The two parameters of the boundary: numbers that the scenario samples, over all their values, or keys named as for --set,
    /// with a range
    #[arg(long = "along", value_name = "NAME|KEY=LOW..HIGH", num_args = 1.., required = true, help_heading = heading::METHOD)]
    along: Vec<Axis>,
    /// The event that happens on one side of the boundary: a number with a bound, such as "min_thw_rear_s < 0.3".
    /// docs/reference/criteria.md lists the numbers
    #[arg(short, long, value_name = "EVENT", help_heading = heading::METHOD)]
    event: EventExpression,
    /// Number of runs: 20 fill the rectangle of both parameters, the others are added near the boundary
    #[arg(short = 'n', long = "runs", value_name = "N", default_value = "60", value_parser = whole::<u64, SMALLEST_BUDGET, LARGEST_BUDGET>, help_heading = heading::METHOD)]
    runs: u64,
    /// Sample whose random numbers all runs share
    #[arg(long, value_name = "N", default_value = "0", help_heading = heading::SAMPLES)]
    sample: u64,
}

/// Arguments of `closecall study anchor`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall study anchor",
    "closecall study anchor -n 500 --seed 7 --out anchor",
    "closecall study anchor --ensemble glances distracted --set brake-mps2=6",
]))]
pub(super) struct AnchorArgs {
    /// Number of samples of each row: of each member of the ensemble, and of each variation
    #[arg(short = 'n', long = "samples", default_value = "400", value_parser = count, help_heading = heading::SAMPLES)]
    samples: u64,
    /// Seed of the random numbers
    #[arg(long, default_value_t = 0, value_parser = closecall_campaign::arguments::seed, help_heading = heading::SAMPLES)]
    seed: u64,
    /// Members of the driver ensemble, beside the scenario's own drivers: files, folders of them, or names [default: all members
    /// of the program]
    #[arg(long, value_name = "DIR|FILE|NAME", num_args = 1.., help_heading = heading::SCENARIO)]
    ensemble: Vec<PathBuf>,
    /// Number of worker threads [default: one per processor]
    #[arg(long, value_parser = whole::<u16, 1, 1024>, help_heading = heading::EXECUTION)]
    jobs: Option<u16>,
    /// Folder for the page, the chart (SVG) and the figures (JSON)
    #[arg(short, long, value_name = "DIR", help_heading = heading::OUTPUT)]
    out: Option<PathBuf>,
    #[command(flatten)]
    set: SetArgs,
    /// Output format
    #[arg(long, value_enum, default_value_t, help_heading = heading::OUTPUT)]
    format: Format,
}

impl StudyArgs {
    fn file(&self) -> Result<ScenarioFile, CliError> {
        let file = self.set.load(&self.scenario)?;
        let is_full = file.may_have_mode(SensorMode::Full, self.sensors.map(SensorsChoice::mode));
        check_backend(is_full)?;
        if is_full {
            check_cameras(file.cameras_with(Pipeline::MaskRcnn))?;
        }
        Ok(file)
    }

    /// Returns the baseline, unless the controller under test is the baseline itself, and the controller under test.
    fn controllers(&self, file: &ScenarioFile) -> Result<Vec<ControllerChoice>, CliError> {
        let function = file.config().function;
        let ([baseline, _], tested) = (ControllerChoice::of_function(function), self.controller.choice(function)?);
        Ok(if tested == baseline { vec![baseline] } else { vec![baseline, tested] })
    }

    fn print(&self, study: Option<Study>) -> Result<ExitCode, CliError> {
        print(study, self.format, self.out.as_deref())
    }
}

/// Refuses keys that an option varies and `--set` fixes: the study would undo the setting.
fn refuse_set<'a>(file: &ScenarioFile, option: &str, mut keys: impl Iterator<Item = &'a str>) -> Result<(), CliError> {
    match keys.find_map(|key| Some((key, file.undone_by(key)?))) {
        Some((key, set)) => Err(CliError::usage(format!(
            "{option} {key} gives values to a key that --set {set} fixes: leave one of them out"
        ))),
        None => Ok(()),
    }
}

/// Runs a study of this many steps with a progress bar; `None` if a signal has ended it.
fn run<T, E>(
    steps: u64,
    study: impl FnOnce(&StopFlag, &mut dyn FnMut()) -> Result<Option<T>, E>,
) -> Result<Option<T>, E> {
    let (mut stop, bar) = (StopFlag::default(), progress_bar(steps));
    session::stop_on_request(&mut stop);
    let _heartbeat = heartbeat(&bar);
    let result = study(&stop, &mut || bar.inc(1));
    bar.finish_and_clear();
    result
}

/// Prints a study, and writes its files. Without a result, a signal has ended it, and nothing is kept.
fn print(study: Option<Study>, format: Format, folder: Option<&Path>) -> Result<ExitCode, CliError> {
    let signal = session::received();
    let Some(study) = study else {
        outln!("ENDED EARLY, without a result: nothing was kept");
        return Ok(signal.map_or(ExitCode::Interrupted, ExitCode::from));
    };
    match format {
        Format::Json => outln!("{:#}", study.json()),
        Format::Human => print_text(&study),
    }
    if let Some(folder) = folder {
        write_study(folder, &study)?.iter().for_each(|path| print_written(path));
    }
    Ok(if study.errors() > 0 {
        ExitCode::SampleError
    } else if study.is_conclusive() {
        ExitCode::Pass
    } else {
        ExitCode::Inconclusive
    })
}

pub(super) fn sensitivity(args: &SensitivityArgs) -> Result<ExitCode, CliError> {
    let (study, number) = (&args.study, |count: u64| usize::try_from(count).unwrap_or(usize::MAX));
    must_be_folder(study.out.as_deref())?;
    let (file, sensors, named) = (study.file()?, study.sensors.map(SensorsChoice::mode), args.factors.clone());
    refuse_set(&file, "--factor", named.iter().map(|range| range.key.as_str()))?;
    let mut plan = SensitivityPlan::new(&file, &study.controllers(&file)?, sensors, named, !args.no_default_factors)?;
    plan.method = args.method;
    (plan.trajectories, plan.rows, plan.top) = (number(args.trajectories), number(args.rows), number(args.top));
    (plan.seed, plan.workers) = (study.seed, Workers::with_jobs(study.jobs));
    let result = run(plan.points() as u64, |stop, step| plan.run(stop, step))?;
    study.print(result.map(Study::Sensitivity))
}

pub(super) fn frontier(args: &FrontierArgs) -> Result<ExitCode, CliError> {
    let study = &args.study;
    must_be_folder(study.out.as_deref())?;
    let file = study.file()?;
    for (index, Grid { key, .. }) in args.vary.iter().enumerate() {
        if args.vary[..index].iter().any(|earlier| earlier.key == *key) {
            return Err(CliError::usage(format!(
                "--vary {key} is given twice: name all values in one list, {key}=a,b"
            )));
        }
    }
    let grid = if args.vary.is_empty() { FrontierPlan::default_grid(&file) } else { args.vary.clone() };
    refuse_set(&file, "--vary", grid.iter().map(|grid| grid.key.as_str()))?;
    let sampling = Sampling { seed: study.seed, design: Design::Random, samples: args.samples };
    let (sensors, workers) = (study.sensors.map(SensorsChoice::mode), Workers::with_jobs(study.jobs));
    let controllers = study.controllers(&file)?;
    if controllers.len() < 2 {
        return Err(CliError::usage("a frontier compares a controller with `acc`: name another with --controller"));
    }
    let plan = FrontierPlan { file, grid, sampling, controllers, sensors, workers };
    let prepared = plan.prepare()?;
    let result = run(prepared.runs(), |stop, step| prepared.run(stop, step)).map_err(CampaignError::from)?;
    study.print(result.map(Study::Frontier))
}

pub(super) fn boundary(args: &BoundaryArgs) -> Result<ExitCode, CliError> {
    let study = &args.study;
    must_be_folder(study.out.as_deref())?;
    let (file, sensors) = (study.file()?, study.sensors.map(SensorsChoice::mode));
    refuse_set(&file, "--along", args.along.iter().map(|axis| axis.key.as_str()))?;
    let mut plan = BoundaryPlan::new(&file, &args.along, args.event, &study.controllers(&file)?, sensors)?;
    plan.budget = usize::try_from(args.runs).unwrap_or(usize::MAX);
    (plan.seed, plan.sample, plan.workers) = (study.seed, args.sample, Workers::with_jobs(study.jobs));
    let result = run(args.runs, |stop, step| plan.run(stop, step))?;
    study.print(result.map(Study::Boundary))
}

pub(super) fn anchor(args: &AnchorArgs) -> Result<ExitCode, CliError> {
    must_be_folder(args.out.as_deref())?;
    let sampling = Sampling { seed: args.seed, design: Design::Random, samples: args.samples };
    let (file, members) = (args.set.load(anchor::path())?, members(&args.ensemble)?);
    let is_full = file.may_have_mode(SensorMode::Full, None);
    check_backend(is_full)?;
    let plan =
        AnchorPlan::new(file, &members, sampling, Workers::with_jobs(args.jobs)).map_err(|error| match error {
            AnchorError::Apply(error) => CliError::from(error),
            AnchorError::Scenario(error) => CliError::from(error),
        })?;
    let result = run(plan.samples(), |stop, step| plan.run(stop, step)).map_err(CampaignError::from)?;
    print(result.map(Study::Anchor), args.format, args.out.as_deref())
}
