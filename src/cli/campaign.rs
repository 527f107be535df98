//! `closecall campaign`: runs many samples of scenarios, and judges the result.

use std::hash::{BuildHasher, Hasher, RandomState};
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::str::FromStr;
use std::time::{Duration, Instant};

use clap::Args;
use closecall_campaign::arguments::{Jobs, Positive, Retries, parsed, parsed_option};
use closecall_campaign::controller_watch::ControllerWatch;
use closecall_campaign::earlier_failures::{EarlierError, EarlierFailures};
use closecall_campaign::end_rule::{EndMonitor, EndedEarly};
use closecall_campaign::execution::{Campaign, CampaignError, End, NextRecord};
use closecall_campaign::folder::Folder;
use closecall_campaign::gate::{GateSet, Judge};
use closecall_campaign::late_repetition::LateRepetition;
use closecall_campaign::left_out::{leave_out, sentences};
use closecall_campaign::manifest::Manifest;
use closecall_campaign::partition::Partition;
use closecall_campaign::plan::{Plan, check_mis};
use closecall_campaign::rare::Method;
use closecall_campaign::remote::connect;
use closecall_campaign::runner::Sampling;
use closecall_campaign::selection::Selection;
use closecall_campaign::session;
use closecall_campaign::stop::{StopMonitor, StopRule};
use closecall_campaign::summary::Summary;
use closecall_campaign::wall_times::SpentTime;
use closecall_campaign::workers::Workers;
use closecall_report::campaign::{
    CampaignReport, CountsText, CoverageText, FlakyText, Tally, VerdictText, ensemble_text,
};
use closecall_report::heartbeat::{Heartbeat, duration_text, rate_text};
use closecall_report::json;
use closecall_scenarios::{Function, ScenarioFile};
use closecall_simulation::controller::ControllerChoice;
use closecall_studies::fidelity::Fidelity;
use closecall_traffic::words::counted;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use serde::{Deserialize, Deserializer};
use serde_json::Value;

use super::CliError;
use super::actions::command_for;
use super::advice::{after_verdict, known_seed, part_only};
use super::args::{FittedArgs, Format, SensorsChoice, SetArgs};
use super::argument::Argument;
use super::arms::{ComparisonArgs, ControllerArgs, tuned};
use super::backend::{check_backend, check_networks};
use super::check::expand;
use super::ending::{EndArgs, Ending};
use super::ensemble::EnsembleArgs;
use super::fast_samples::{FastSamples, FidelityChoice};
use super::file_sizes::check_file_sizes;
use super::gates::GateArgs;
use super::help::{examples, heading};
use super::keywords::needs;
use super::output::{heartbeat, outln, print_error, print_failure, print_text};
use super::plan::PlanArgs;
use super::rare::{DesignChoice, Rare, RareArgs};
use super::results::{ArtifactArgs, Place, Results, ResultsArgs, print_results, selection};
use super::terminal::error_columns;
use crate::exit_code::ExitCode;

/// Arguments of a campaign.
#[derive(Debug, Args, Deserialize)]
#[command(after_help = examples([
    "closecall campaign low-thw-overtake -n 1000 --paired",
    "closecall campaign scenarios --preset pr --out results",
    "closecall campaign low-thw-overtake -n 1000 --paired --gate 'upper(induced) <= 0.02'",
]))]
pub(super) struct CampaignArgs {
    /// Scenario files, folders of them, names of scenarios of the library, or `-` for standard
    /// input
    #[arg(required = true)]
    scenarios: Vec<PathBuf>,
    #[command(flatten)]
    #[serde(rename = "..plan")]
    plan: PlanArgs,
    /// Seed of the random numbers [default: 0]
    #[arg(long, value_parser = closecall_campaign::arguments::seed, help_heading = heading::SAMPLES)]
    seed: Option<u64>,
    /// Seed of a campaign that judges: a number, or `secret`, which draws a seed that nobody knew
    /// before. The campaign states it in the end. `--preset pr` without a seed draws one
    #[arg(long, value_name = "SEED|secret", conflicts_with = "seed", help_heading = heading::SAMPLES)]
    #[serde(default, deserialize_with = "parsed_option")]
    judge_seed: Option<JudgeSeed>,
    /// Sampling design: `random`, `sobol` (a low-discrepancy sequence), `grid`, or `coverage` (fills
    /// the holes of the scenario's [coverage]). With --event: `subset` or `importance` estimates the
    /// probability of a rare event, and `search` looks for its first case; -n is then the largest
    /// number of runs [default: 200000, of a search 2000]
    #[arg(long, default_value_t, help_heading = heading::SAMPLES)]
    #[serde(default, deserialize_with = "plain_design")]
    design: DesignChoice,
    #[command(flatten)]
    #[serde(skip)]
    rare: RareArgs,
    /// After the samples, run FACTOR times as many with faster sensors, such as `object:20`. MODE is
    /// `object` or `ground-truth`. The first ones repeat the samples of the campaign. Both together
    /// give narrower intervals of the collision, prevented and induced rates. Gates judge the
    /// samples of the campaign alone
    #[arg(long, value_name = "MODE:FACTOR", help_heading = heading::SAMPLES)]
    #[serde(default, deserialize_with = "parsed_option")]
    fidelity: Option<FidelityChoice>,
    #[command(flatten)]
    #[serde(rename = "..controller")]
    controller: ControllerArgs,
    /// Depth of the sensor simulation [default: as in the scenario]
    #[arg(long, value_enum, help_heading = heading::CONTROLLER)]
    sensors: Option<SensorsChoice>,
    #[command(flatten)]
    #[serde(rename = "..comparison")]
    comparison: ComparisonArgs,
    /// Number of worker threads [default: one per processor]
    #[arg(long, help_heading = heading::EXECUTION)]
    jobs: Option<Jobs>,
    /// Run the samples on a Ray cluster: `auto` (the cluster of this machine), HOST:PORT, or `local`
    /// (start one here). Needs the Python package: pip install "closecall[ray]"
    #[arg(long, value_name = "ADDRESS", conflicts_with = "jobs", help_heading = heading::EXECUTION)]
    ray: Option<String>,
    /// Longest wall time of a sample with one controller; a sample that takes longer ends in an
    /// error [default: 300]
    #[arg(long, value_name = "S", help_heading = heading::EXECUTION)]
    sample_timeout_s: Option<Positive>,
    /// Run a sample up to N times more in a new process if the process of its library, FMU or
    /// Python controller crashes or hangs. A sample that succeeds only after a repetition is flaky;
    /// --max-flaky limits their number [default: 0]
    #[arg(long, value_name = "N", help_heading = heading::EXECUTION)]
    retry_crashed: Option<Retries>,
    #[command(flatten)]
    #[serde(rename = "..results")]
    results: ResultsArgs,
    #[command(flatten)]
    #[serde(rename = "..artifacts")]
    artifacts: ArtifactArgs,
    /// With --out: run only part I of N of the samples; `closecall tool merge` merges the parts
    #[arg(long, value_name = "I/N", help_heading = heading::EXECUTION)]
    partition: Option<Partition>,
    /// Save recordings (Rerun files) of selected samples of each scenario, and a page that shows
    /// them. KIND is `worst`, `failures` or `random`; `each-kind` is the worst prevented, the worst
    /// induced and the worst shared collision of all scenarios [default: each-kind]
    #[arg(long, alias = "recordings", value_name = "KIND:N,…", help_heading = heading::OUTPUT)]
    #[serde(default, deserialize_with = "parsed_option")]
    record: Option<Selection>,
    #[command(flatten)]
    #[serde(rename = "..gates")]
    gates: GateArgs,
    #[command(flatten)]
    #[serde(rename = "..end")]
    end: EndArgs,
    /// Run the samples first that failed in an earlier campaign with the same seed and design: its
    /// folder, or the file of `closecall baseline save`. No result depends on the order
    #[arg(long, value_name = "DIR|FILE", conflicts_with = "time_budget", help_heading = heading::EXECUTION)]
    failures_first: Option<PathBuf>,
    #[command(flatten)]
    #[serde(rename = "..ensemble")]
    ensemble: EnsembleArgs,
    #[command(flatten)]
    #[serde(rename = "..set")]
    set: SetArgs,
    #[command(flatten)]
    #[serde(rename = "..fitted")]
    fitted: FittedArgs,
    /// Output format
    #[arg(long, value_enum, default_value_t, help_heading = heading::OUTPUT)]
    #[serde(skip)]
    format: Format,
}

/// Deserialises a sampling design. The estimates of a rare event have no caller but the command line.
fn plain_design<'de, D: Deserializer<'de>>(deserializer: D) -> Result<DesignChoice, D::Error> {
    parsed(deserializer).map(DesignChoice::Plain)
}

/// Longest wall time of a sample with one controller, unless another is named (s).
pub const SAMPLE_TIMEOUT_S: f64 = 300.0;

/// The seed of a campaign that judges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum JudgeSeed {
    /// The seed is drawn when the campaign starts.
    Secret,
    /// The seed is named.
    Number(u64),
}

impl FromStr for JudgeSeed {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "secret" {
            return Ok(Self::Secret);
        }
        closecall_campaign::arguments::seed(text).map(Self::Number).map_err(|error| format!("{error}, or `secret`"))
    }
}

/// The seed of a campaign, and how it came about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct CampaignSeed {
    seed: u64,
    /// True if the seed was drawn when the campaign began, so that nobody knew it before.
    is_drawn: bool,
}

impl CampaignArgs {
    /// Returns true if the seed is to be drawn. The parts of a campaign need the same one.
    fn draws_seed(&self) -> bool {
        match self.judge_seed {
            Some(JudgeSeed::Secret) => true,
            Some(JudgeSeed::Number(_)) => false,
            None => self.seed.is_none() && self.partition.is_none() && self.plan.judges_pull_requests(),
        }
    }

    /// Returns the seed. A campaign that is resumed has the seed of its folder. The folder says how
    /// the seed came about: a named one was known, and one that was drawn was unknown.
    fn seed(&self) -> Result<CampaignSeed, CliError> {
        let resumed = self.results.resumed();
        if !self.draws_seed() {
            let judging = match self.judge_seed {
                Some(JudgeSeed::Number(seed)) => Some(seed),
                _ => self.seed,
            };
            let seed = judging.unwrap_or(0);
            let was_drawn = |there: &Manifest| there.has_drawn_seed && there.sampling.seed == seed;
            return Ok(CampaignSeed { seed, is_drawn: resumed.is_some_and(|(_, there)| was_drawn(&there)) });
        }
        if self.partition.is_some() {
            return Err(CliError::usage(format!(
                "{} secret: the parts of a campaign need the same seed, so name it",
                Argument("judge-seed")
            )));
        }
        let Some((folder, there)) = resumed else {
            return Ok(CampaignSeed { seed: RandomState::new().build_hasher().finish(), is_drawn: true });
        };
        let (seed, is_drawn, folder) = (there.sampling.seed, there.has_drawn_seed, folder.display());
        match (is_drawn, self.judge_seed) {
            (true, _) => {}
            (false, Some(_)) => {
                return Err(CliError::usage(format!(
                    "{} secret: the campaign in {folder} began with the seed {seed}, which was known beforehand: resume it with {} {seed}, or draw a seed for another folder",
                    Argument("judge-seed"),
                    Argument("seed")
                )));
            }
            (false, None) => print_error(format_args!(
                "{folder}: its campaign began with the seed {seed}, which was known beforehand, and goes on with it\n"
            )),
        }
        Ok(CampaignSeed { seed, is_drawn })
    }

    fn workers(&self) -> Result<Workers, CliError> {
        let timeout_s = self.sample_timeout_s.map_or(SAMPLE_TIMEOUT_S, |time| time.0);
        let usage = || {
            let (option, least_s, most_s) = (Argument("sample-timeout-s"), 1e-9, Duration::MAX.as_secs_f64());
            CliError::usage(format!("{option} {timeout_s:?} is not a number from {least_s:?} to {most_s:e}"))
        };
        let sample_timeout = Duration::try_from_secs_f64(timeout_s).map_err(|_| usage())?;
        if sample_timeout.is_zero() {
            return Err(usage());
        }
        Ok(Workers { sample_timeout, ..Workers::with_jobs(self.jobs.map(|jobs| jobs.0)) })
    }

    /// Reads every scenario, and returns them with the controllers of their arms. Scenarios of a
    /// folder that judge another function than the rest are left out, and named.
    fn scenarios(&self, wants_pairs: bool) -> Result<(Vec<ScenarioFile>, Vec<ControllerChoice>), CliError> {
        let (set, of_arms) = self.set.by_arm();
        let mut files = Vec::new();
        for path in expand(&self.scenarios)? {
            files.push((self.fitted.load(&path, &set)?, self.scenarios.contains(&path)));
        }
        let functions = || files.iter().map(|(file, _)| file.config().function);
        let function = functions().find(|function| *function == Function::Mis).or(functions().next());
        let function = function.unwrap_or_default();
        let controllers = self.comparison.controllers(&self.controller, function, wants_pairs)?;
        let controllers = tuned(controllers, &of_arms)?;
        let is_default = !self.controller.is_named() && self.comparison.arms.is_empty();
        let fits = |file: &ScenarioFile| match is_default {
            true => file.config().function == function,
            false => check_mis(file, &controllers).is_ok(),
        };
        for (other, is_named) in files.iter().filter(|(file, _)| !fits(file)) {
            let (name, judged) = (&other.config().name, other.config().function.name());
            if is_default && *is_named {
                return Err(CliError::usage(format!(
                    "{name} judges `{judged}`, and other scenarios judge `{}`: run them apart, or name the arms with {}",
                    function.name(),
                    Argument("arms")
                )));
            }
            if !is_named {
                print_error(format_args!("{name}: not run, because it judges `{judged}`: name it, or its folder\n"));
            }
        }
        let run = files.into_iter().filter(|(file, is_named)| *is_named || fits(file)).map(|(file, _)| file);
        Ok((run.collect(), controllers))
    }

    /// Returns the samples that failed in an earlier campaign and are to run first, and says how
    /// many there are.
    fn failures_first(&self, plan: &Plan) -> Result<EarlierFailures, CliError> {
        let Some(path) = &self.failures_first else { return Ok(EarlierFailures::default()) };
        let refused = |error| match error {
            EarlierError::Folder(error) => CliError::Folder(error),
            other => CliError::usage(format!("{}: {other}", Argument("failures-first"))),
        };
        let failures = EarlierFailures::read(path)?;
        failures.check(plan.sampling(), plan.names()).map_err(refused)?;
        let number: usize = plan.names().map(|name| failures.of(name).len()).sum();
        let samples = counted(number as u64, "sample");
        let run = if number == 1 { "runs" } else { "run" };
        print_error(format_args!("{samples} that failed in {} {run} first\n", path.display()));
        Ok(failures)
    }

    /// Returns the plan of what runs.
    fn plan(&self, files: Vec<ScenarioFile>, controllers: Vec<ControllerChoice>) -> Result<Plan, CliError> {
        let ensemble = self.ensemble.apply(files)?;
        let CampaignSeed { seed, is_drawn } = self.seed()?;
        let sampling = Sampling { seed, design: self.design.plain(), samples: self.plan.samples() };
        let mut plan = Plan::new(ensemble.entries, sampling, controllers)?;
        plan.has_drawn_seed = is_drawn;
        plan.without_effect = ensemble.without_effect;
        plan.use_sensors(self.sensors.map(SensorsChoice::mode))?;
        plan.partition = self.partition;
        plan.checks = self.plan.checks()?;
        plan.inference = self.plan.inference(self.design.plain())?;
        plan.workers = self.workers()?;
        plan.retry_crashed = self.retry_crashed.map_or(0, |retries| retries.0);
        Ok(plan)
    }
}

/// A campaign that is ready to run, with the settings for its results.
pub(super) struct Planned<'a> {
    pub(super) plan: &'a Plan,
    pub(super) gates: &'a GateSet,
    pub(super) results: &'a ResultsArgs,
    pub(super) artifacts: ArtifactArgs,
    pub(super) end: EndArgs,
    pub(super) record: Option<Selection>,
    /// The cluster that runs the samples, if this machine does not.
    pub(super) ray: Option<&'a str>,
    /// Whether the samples stop as soon as they are certain.
    pub(super) until_certain: bool,
    /// The wall time after which they stop.
    pub(super) time_budget: Option<Duration>,
    /// The samples that run before the others.
    pub(super) first: EarlierFailures,
    /// Whether the command can draw the seed.
    pub(super) can_draw_seed: bool,
}

/// The files of a command in the folder of a campaign beside the results.
pub(super) trait Companion {
    /// Called when the folder is ready, before the first sample runs.
    fn begin(&mut self, folder: &Folder) -> Result<(), CliError>;
    /// Called after the last sample, before the reports are written.
    fn end(&mut self, folder: &Folder) -> Result<(), CliError>;
    /// Returns how many samples the command runs beside the campaign: those that are done, and all.
    fn samples(&self) -> [u64; 2] {
        [0, 0]
    }
    /// Returns the text to print.
    fn text(&self, summary: &Summary) -> String;
    /// Returns the same for programs, with its key.
    fn json(&self) -> Option<(&'static str, Value)>;
    /// Returns the exit code. `code` is the code of the verdict.
    fn code(&self, code: ExitCode) -> ExitCode;
}

/// A campaign that keeps nothing beside its results.
struct Alone;

impl Companion for Alone {
    fn begin(&mut self, _: &Folder) -> Result<(), CliError> {
        Ok(())
    }

    fn end(&mut self, _: &Folder) -> Result<(), CliError> {
        Ok(())
    }

    fn text(&self, _: &Summary) -> String {
        String::new()
    }

    fn json(&self) -> Option<(&'static str, Value)> {
        None
    }

    fn code(&self, code: ExitCode) -> ExitCode {
        code
    }
}

/// Checks everything that would fail only after the samples have run.
fn check_arguments(args: &CampaignArgs) -> Result<(), CliError> {
    let out = match args.results.place() {
        Place::Named(path) => Some(path),
        Place::Default | Place::Nowhere => None,
    };
    let has_gate = args.gates.max_probability.is_some();
    needs(("until-certain", args.plan.until_certain), ("max-probability", has_gate))?;
    needs(("partition", args.partition.is_some()), ("out", out.is_some()))?;
    if args.plan.switches_checks_off() && args.gates.max_flip_rate.is_some() {
        return Err(CliError::usage(format!(
            "{} limits what the validity checks find, and {} switches them off",
            Argument("max-flip-rate"),
            Argument("no-validity-checks")
        )));
    }
    if let Some(fidelity) = args.fidelity {
        fidelity.check(args.design.plain(), args.plan.is_sequential(), args.results.place())?;
    }
    if args.failures_first.is_some() && args.draws_seed() && !args.results.is_resumed() {
        return Err(CliError::usage(format!(
            "{} needs the seed of the earlier campaign, and this one draws its own: name it with {}",
            Argument("failures-first"),
            Argument("seed")
        )));
    }
    if args.record.is_some_and(|selection| !selection.is_empty()) && args.results.place() == Place::Nowhere {
        return Err(CliError::usage(format!(
            "{}: the recordings are kept in a folder of results: name one with {}",
            Argument("record"),
            Argument("out")
        )));
    }
    // The manifest names them, and it is text.
    let folder = std::env::current_dir().ok();
    let named = args.scenarios.iter().map(PathBuf::as_path).chain(out).chain(folder.as_deref());
    match named.into_iter().find(|path| path.to_str().is_none()) {
        Some(path) => Err(CliError::usage(format!(
            "{}: the name is not text (UTF-8), so that the campaign cannot be resumed or replayed: use another name",
            path.display()
        ))),
        None => Ok(()),
    }
}

/// Refuses parts of a rare event whose runs depend on each other, and a gate on one part.
fn check_parts(method: Method, has_gate: bool) -> Result<(), CliError> {
    let why = match method {
        Method::Importance if has_gate => {
            "a part has no estimate: --max-probability belongs to `closecall tool merge`, which makes it of all parts"
        }
        Method::Importance => return Ok(()),
        Method::Subset => {
            "--partition: --design subset has no parts, because the number of its repetitions follows from the first of them, \
             which are most of its runs: --design importance has parts, and --ray runs both on several machines"
        }
        Method::Search => {
            "--partition: --design search has no parts, because each round depends on the rounds before, and the first event ends \
             it: --ray runs the runs of a round on several machines"
        }
    };
    Err(CliError::usage(why))
}

/// Estimates the probability of a rare event.
fn rare_campaign(args: &CampaignArgs, method: Method) -> Result<ExitCode, CliError> {
    let is_named = [
        (args.plan.names_preset(), "--preset"),
        (args.plan.until_certain, "--until-certain"),
        (args.plan.time_budget().is_some(), "--time-budget"),
        (args.plan.names_checks(), "--check-share, --check-at-most and --no-validity-checks"),
        (args.record.is_some(), "--record"),
        (args.retry_crashed.is_some(), "--retry-crashed"),
        (args.end.is_named(), "--fail-fast, --max-errors and --retry-errors"),
        (args.failures_first.is_some(), "--failures-first"),
        (args.fidelity.is_some(), "--fidelity"),
        (args.gates.names_criterion()?, "a gate other than --max-probability"),
        (args.artifacts.is_named(), "--strict-artifacts"),
    ];
    if let Some((_, option)) = is_named.into_iter().find(|(is_named, _)| *is_named) {
        return Err(CliError::usage(format!(
            "the runs of --design {method} are not independent samples of the scenario: it cannot be combined with {option}"
        )));
    }
    if args.partition.is_some() {
        check_parts(method, args.gates.max_probability.is_some())?;
    }
    let folder = match args.results.place() {
        Place::Named(path) => Some(path),
        Place::Default | Place::Nowhere if args.results.is_resumed() => {
            return Err(CliError::usage("--resume: name the folder of the campaign with --out"));
        }
        Place::Default | Place::Nowhere => None,
    };
    let (files, controllers) = args.scenarios(args.rare.needs_pairs())?;
    let rare = Rare {
        method,
        args: &args.rare,
        budget: args.plan.named_samples(),
        gates: args.gates.gates(controllers.len() > 1, args.design.plain(), None)?,
        ray: args.ray.as_deref(),
        folder,
        resume: args.results.is_resumed(),
        format: args.format,
        can_draw_seed: args.partition.is_none(),
    };
    rare.run(&args.plan(files, controllers)?)
}

pub(super) fn campaign(args: &CampaignArgs) -> Result<ExitCode, CliError> {
    run_campaign(args, &mut |conclusion| conclusion.print(args.format))
}

/// Runs a campaign. `tell` is told what it comes to.
pub(super) fn run_campaign(args: &CampaignArgs, tell: &mut dyn FnMut(&Conclusion<'_>)) -> Result<ExitCode, CliError> {
    check_arguments(args)?;
    match args.design {
        DesignChoice::Rare(method) => return rare_campaign(args, method),
        DesignChoice::Plain(design) if args.rare.is_named() => {
            return Err(CliError::usage(format!(
                "--event is the rare event of --design subset, importance or search, and not of {design}: a gate such as --gate \"upper(induced) <= 0.01\" judges the samples of a plain campaign"
            )));
        }
        DesignChoice::Plain(_) => {}
    }
    let (files, controllers) = args.scenarios(args.plan.wants_pairs())?;
    let is_paired = controllers.len() > 1;
    let mut gates = args.gates.gates(is_paired, args.design.plain(), args.plan.preset_gates(is_paired))?;
    gates.max_flaky = gates.max_flaky.or(args.plan.preset_max_flaky());
    let (files, left_out) = leave_out(files, args.sensors.map(SensorsChoice::mode))?;
    sentences(&left_out).iter().for_each(|sentence| print_error(format_args!("{sentence}\n")));
    let mut plan = args.plan(files, controllers)?;
    plan.left_out = left_out;
    let planned = Planned {
        plan: &plan,
        gates: &gates,
        results: &args.results,
        artifacts: args.artifacts,
        end: args.end,
        record: args.record,
        ray: args.ray.as_deref(),
        until_certain: args.plan.until_certain,
        time_budget: args.plan.time_budget(),
        first: args.failures_first(&plan)?,
        can_draw_seed: args.partition.is_none(),
    };
    match args.fidelity {
        Some(choice) => carry_out(&planned, &mut FastSamples::new(choice, &planned)?, tell),
        None => carry_out(&planned, &mut Alone, tell),
    }
}

/// What a campaign comes to.
pub(super) enum Conclusion<'a> {
    /// It has ended early, without a verdict.
    Early(EndedEarly<'a>),
    /// It is judged.
    Judged(Judged<'a>),
    /// A recorded run is not the run of the campaign, so that the judgement is another one: the same
    /// for programs. The console has it in a line of its own.
    Corrected(Value),
}

/// A campaign that is judged.
pub(super) struct Judged<'a> {
    report: &'a CampaignReport<'a>,
    companion: &'a dyn Companion,
    wall_s: f64,
    /// The simulated time of the samples that have just been run (s).
    simulated_s: f64,
    /// Number of samples that were there before.
    resumed: u64,
    /// Where it ran, and the share of the checks in the time.
    place: String,
}

impl Conclusion<'_> {
    /// Returns it for programs.
    pub(super) fn json(&self) -> Value {
        match self {
            Self::Early(ended) => json::stamped(ended.json(), None, None),
            Self::Judged(judged) => report_json(judged.report, judged.companion, judged.wall_s),
            Self::Corrected(value) => value.clone(),
        }
    }

    /// Prints it.
    pub(super) fn print(&self, format: Format) {
        match (format, self) {
            (_, Self::Corrected(_)) => {}
            (Format::Json, conclusion) => outln!("{:#}", conclusion.json()),
            (Format::Human, Self::Early(ended)) => print_text(format_args!("{}{ended}", CountsText(ended.summary))),
            (Format::Human, Self::Judged(judged)) => judged.print(),
        }
    }
}

/// Returns the report of a campaign for programs, with what the command keeps beside it.
fn report_json(report: &CampaignReport<'_>, companion: &dyn Companion, wall_s: f64) -> Value {
    let mut value = json::campaign_report(report, Some(wall_s));
    if let (Some((key, more)), Some(object)) = (companion.json(), value.as_object_mut()) {
        object.insert(key.to_owned(), more);
    }
    value
}

/// Returns the simulated time and the wall time of the samples that have just been run (s), where
/// they ran, and how many samples were there before.
fn speed_text(simulated_s: f64, wall_s: f64, resumed: u64, place: &str) -> String {
    let resumed = match resumed {
        0 => String::new(),
        resumed => format!("; not run again: {}", counted(resumed, "sample")),
    };
    format!("{simulated_s:.0} simulated seconds in {wall_s:.1} s on {place}{resumed}")
}

impl Judged<'_> {
    fn print(&self) {
        let CampaignReport { manifest, works, tally, judged, .. } = self.report;
        print_text(CountsText(&tally.summary));
        print_text(format_args!("{}\n", speed_text(self.simulated_s, self.wall_s, self.resumed, &self.place)));
        print_text(self.companion.text(&tally.summary));
        print_text(ensemble_text(&tally.summary, manifest));
        print_text(CoverageText(judged));
        print_text(FlakyText(&tally.overview));
        print_text(VerdictText { judged, scenarios: works.len() });
        print_text(after_verdict(judged));
        if manifest.has_drawn_seed {
            outln!("  drawn for this campaign: --seed {}", manifest.sampling.seed);
        }
    }
}

/// Runs a campaign, tells what it comes to, and writes its results.
pub(super) fn carry_out(
    planned: &Planned<'_>,
    companion: &mut dyn Companion,
    tell: &mut dyn FnMut(&Conclusion<'_>),
) -> Result<ExitCode, CliError> {
    let Planned { plan, gates, .. } = planned;
    planned.end.check(planned.results.is_resumed())?;
    check_backend(plan.uses_classifier())?;
    check_networks(plan.crop_networks(), plan.mask_rcnn_cameras())?;
    let replaceable = planned.results.place() == Place::Default;
    let (mut campaign, manifest) = (plan.campaign(), Manifest { replaceable, ..plan.manifest(session::arguments())? });
    if let Some(folder) = planned.results.folder() {
        check_file_sizes(&campaign, folder, planned.until_certain || planned.time_budget.is_some())?;
    }
    campaign.remote = connect(planned.ray, &manifest).map_err(CampaignError::from)?;
    let mut results = Results::start(planned.results, &mut campaign, &manifest)?;
    // Other machines run the files that were shipped at the start.
    let watched = planned.ray.is_none().then_some(&manifest);
    let mut watch = ControllerWatch::start(watched, results.locked.as_ref().map(|locked| &locked.folder))?;
    if let Some(folder) = results.complete() {
        companion.begin(folder)?;
    }
    campaign.retry_errors = planned.end.retry_errors;
    session::stop_on_request(&mut campaign.stop);
    let started = Instant::now();
    let stop = StopRule {
        until_certain: gates.probability.as_ref().map(|spec| spec.gate).filter(|_| planned.until_certain),
        time_budget: planned.time_budget,
        scenarios: campaign.works.len(),
    };
    let mut progress = Progress::new(&campaign, gates, StopMonitor::start(stop), EndMonitor::new(planned.end.rule()));
    let mut repetition = LateRepetition::new(&campaign);
    let locked = results.locked.as_ref();
    let mut ahead = campaign.run_first(locked, &planned.first, |next| {
        watch.look();
        progress.push_first(next)
    })?;
    let resumption = campaign.run_after(locked, &mut ahead, |next| {
        watch.look();
        repetition.observe(next);
        progress.push(next)
    })?;
    progress.bar.finish_and_clear();
    resumption.messages().iter().for_each(|message| print_error(format_args!("{message}\n")));
    results.lose(resumption.lost);
    let wall_s = started.elapsed().as_secs_f64();
    let mut ending = session::received().map(Ending::Signal).or_else(|| progress.end.into_ending().map(Ending::Rule));
    if let Some(folder) = results.complete().filter(|_| progress.new > 0) {
        // Rates of the samples before, which the companion estimates anew if it is to.
        Fidelity::remove(folder)?;
    }
    if let Some(folder) = results.complete().filter(|_| ending.is_none()) {
        companion.end(folder)?;
        // A signal also stops the samples that the command runs beside the campaign.
        ending = session::received().map(Ending::Signal);
    }
    if let Some(ending) = ending {
        watch.finish()?;
        let kept = results.locked.as_ref().map(|locked| locked.folder.path());
        // Samples that still wait for their turn are done, too.
        ahead.waiting().for_each(|record| progress.tally.summary.push(record));
        let ([done, all], ended) = (companion.samples(), ending.ended(&campaign, &progress.tally.summary, kept));
        tell(&Conclusion::Early(EndedEarly { done: ended.done + done, all: ended.all + all, ..ended }));
        let code = ending.exit_code();
        return Ok(results.into_lost().map_or(code, |error| {
            print_failure(error);
            ExitCode::first_of([code, ExitCode::Io])
        }));
    }
    watch.add(repetition.run(&campaign)?);
    let tally = &progress.tally;
    let mut judged = tally.judgement();
    judged.add_left_out(&manifest.left_out);
    judged.add_invalid(watch.finish()?);
    let remarks =
        [known_seed(judged.has_gates(), &manifest, planned.can_draw_seed), part_only(judged.has_gates(), &manifest)];
    remarks.into_iter().flatten().for_each(|remark| judged.add_remark(remark));
    let report = CampaignReport { manifest: &manifest, works: &campaign.works, tally, judged: &judged, command_for };
    tell(&Conclusion::Judged(Judged {
        report: &report,
        companion,
        wall_s,
        simulated_s: progress.simulated_s,
        resumed: progress.resumed,
        place: format!("{}{}", campaign.place(), progress.spent.check_share()),
    }));
    // A report that cannot be written does not cost the verdict.
    let written = match results.complete() {
        Some(folder) => report.write(folder, selection(planned.record)),
        None => report.write_without_folder(),
    };
    let code = planned.artifacts.code(companion.code((&judged).into()), &written);
    if !written.differences.is_empty() {
        judged.add_invalid(written.differences.clone());
        let report =
            CampaignReport { manifest: &manifest, works: &campaign.works, tally, judged: &judged, command_for };
        tell(&Conclusion::Corrected(report_json(&report, companion, wall_s)));
    }
    if let Some(folder) = results.complete() {
        print_results(folder, &written.recorded);
    }
    results.into_lost().map_or(Ok(code), Err)
}

/// Counts the records of a running campaign, shows the progress, and applies the stop rule.
struct Progress {
    names: Vec<String>,
    /// The number of samples of each scenario; `None` of a part, which is judged with the others
    /// only.
    counts: Option<Vec<u64>>,
    tally: Tally,
    /// The evidence of all samples that are done; `None` if none has run before its turn, so that
    /// the tally has it.
    early: Option<Judge>,
    /// Number of samples of each scenario that are done.
    done: Vec<u64>,
    stop: StopMonitor,
    end: EndMonitor,
    bar: ProgressBar,
    /// The wall times of all samples that have just been run.
    spent: SpentTime,
    /// The simulated time of these samples in all arms (s).
    simulated_s: f64,
    /// Number of samples that were read from the journal.
    resumed: u64,
    /// Number of samples that have just been run.
    new: u64,
    _heartbeat: Option<Heartbeat>,
}

impl Progress {
    fn new(campaign: &Campaign, gates: &GateSet, stop: StopMonitor, end: EndMonitor) -> Self {
        for work in &campaign.works {
            let (name, count, requested) = (&work.file.config().name, work.count(), work.sampling.samples);
            if count != requested {
                print_error(format_args!("{name}: {count} of the {requested} requested samples differ, and are run\n"));
            }
        }
        let names: Vec<String> = campaign.works.iter().map(|work| work.file.config().name.clone()).collect();
        let bar = progress_bar(campaign.len());
        let tally = Tally::new(campaign, gates);
        let counts = campaign.partition.is_none().then(|| campaign.works.iter().map(|work| work.count()).collect());
        Self {
            done: vec![0; names.len()],
            names,
            counts,
            tally,
            early: None,
            stop,
            end,
            spent: SpentTime::default(),
            simulated_s: 0.0,
            resumed: 0,
            new: 0,
            _heartbeat: heartbeat(&bar),
            bar,
        }
    }

    /// Counts a sample that has run before its turn. The tally gets it when its turn has come.
    fn push_first(&mut self, next: NextRecord<'_>) -> ControlFlow<End> {
        let judge = &self.tally.judge;
        // No sample has had its turn yet, so the judge of the tally has no evidence.
        self.early.get_or_insert_with(|| judge.clone());
        self.advance(next);
        self.watch(next)
    }

    fn push(&mut self, next: NextRecord<'_>) -> ControlFlow<End> {
        self.tally.push(next.record);
        if !next.is_early {
            self.advance(next);
            self.watch(next)?;
        }
        let tested = self.tally.summary.tested(&self.names[next.work]);
        tested.map_or(ControlFlow::Continue(()), |tested| self.stop.observe(next.work, tested))
    }

    /// Shows that a sample is done.
    fn advance(&mut self, next: NextRecord<'_>) {
        self.bar.inc(1);
        session::report(self.bar.position(), self.bar.length().unwrap_or_default());
        self.spent += next.spent;
        if next.is_new {
            self.new += 1;
            let outcomes = next.record.arms.iter().filter_map(|arm| arm.result.as_ref().ok());
            self.simulated_s += outcomes.map(|outcome| outcome.duration.s()).sum::<f64>();
        } else {
            self.resumed += 1;
            // Records read from a file say nothing about how long the rest will take.
            self.bar.reset_eta();
        }
    }

    /// Applies the rule by which the campaign ends early to a sample that is done.
    fn watch(&mut self, next: NextRecord<'_>) -> ControlFlow<End> {
        self.done[next.work] += 1;
        if let Some(early) = &mut self.early {
            early.push(next.record);
        }
        if !next.is_new {
            // The campaign went on after it.
            self.end.count(next.record);
            return ControlFlow::Continue(());
        }
        self.end.observe(next.record)?;
        let (name, judge) = (&self.names[next.work], self.early.as_ref().unwrap_or(&self.tally.judge));
        let rest = self.counts.as_ref().map(|counts| counts[next.work].saturating_sub(self.done[next.work]));
        self.end.observe_gate(|| Some((name.clone(), judge.lost(name, rest?)?)))
    }
}

/// Returns the parts of a progress bar that fit into a terminal of this width (columns); `None` if it
/// is not known. A bar that is wider than the terminal leaves a line behind at each change.
const fn bar_template(columns: Option<usize>) -> &'static str {
    /// Width of the bar with all its texts, and of the texts alone, for a million samples.
    const WHOLE: usize = 100;
    const TEXTS: usize = 60;
    match columns {
        Some(..TEXTS) => "{wide_bar} {pos}/{len}, {time} left",
        Some(TEXTS..WHOLE) => "{wide_bar} {pos}/{len} samples, {rate} samples/s, {time} left",
        Some(WHOLE..) | None => "{bar:40} {pos}/{len} samples, {rate} samples/s, {time} left",
    }
}

/// Returns a progress bar. It is shown on standard error if that is a terminal.
pub(super) fn progress_bar(samples: u64) -> ProgressBar {
    let bar = ProgressBar::new(samples);
    if session::is_active() {
        bar.set_draw_target(ProgressDrawTarget::hidden());
    }
    if let Ok(style) = ProgressStyle::with_template(bar_template(error_columns())) {
        let rate = |state: &ProgressState, text: &mut dyn std::fmt::Write| {
            // A bar that cannot be written has no reader.
            let _ = text.write_str(&rate_text(state.per_sec()));
        };
        let time = |state: &ProgressState, text: &mut dyn std::fmt::Write| {
            let _ = text.write_str(&duration_text(state.eta().as_secs_f64()));
        };
        bar.set_style(style.with_key("rate", rate).with_key("time", time));
    }
    bar
}

#[cfg(test)]
mod tests {
    use closecall_campaign::gate::MAX_FLIP_RATE;
    use closecall_campaign::probability::ProbabilityGate;
    use closecall_campaign::validity::CheckPlan;
    use closecall_simulation::controller::exec::{DEFAULT_MEMORY_MIB, DEFAULT_TIMEOUT_MS};

    use super::*;

    #[test]
    fn the_speed_is_of_the_samples_that_have_just_been_run() {
        let whole = "969 simulated seconds in 3.2 s on 1 thread";
        assert_eq!(speed_text(969.4, 3.21, 0, "1 thread"), whole);
        let nothing = "0 simulated seconds in 0.0 s on 2 threads; not run again: 20 samples";
        assert_eq!(speed_text(0.0, 0.01, 20, "2 threads"), nothing);
    }

    #[test]
    fn a_progress_bar_is_no_wider_than_the_terminal() {
        for columns in [24, 40, 59, 60, 80, 99, 100, 200] {
            let template = bar_template(Some(columns));
            let texts =
                [("{bar:40}", " ".repeat(40).as_str()), ("{wide_bar}", ""), ("{pos}", "1000000"), ("{len}", "1000000")]
                    .into_iter()
                    .fold(template.to_owned(), |text, (name, value)| text.replace(name, value));
            let line = texts.replace("{rate}", "1234.5").replace("{time}", "59 min");
            let needed = line.chars().count();
            // The shortest form needs 29 columns for a million samples.
            assert!(needed <= columns.max(29), "{columns}: {line}");
        }
        assert_eq!(bar_template(None), bar_template(Some(200)));
    }

    #[test]
    fn the_help_states_the_defaults() {
        let command = CampaignArgs::augment_args(clap::Command::new("campaign"));
        for (name, default) in [
            ("check-share", CheckPlan::SHARE),
            ("check-at-most", CheckPlan::AT_MOST as f64),
            ("confidence", ProbabilityGate::CONFIDENCE),
            ("max-flip-rate", MAX_FLIP_RATE),
            ("sample-timeout-s", SAMPLE_TIMEOUT_S),
            ("controller-timeout-ms", DEFAULT_TIMEOUT_MS as f64),
            ("controller-memory-mib", DEFAULT_MEMORY_MIB as f64),
        ] {
            let argument = command.get_arguments().find(|argument| argument.get_long() == Some(name)).unwrap();
            let help = argument.get_long_help().or(argument.get_help()).unwrap().to_string();
            assert!(help.contains(&format!("[default: {default}]")), "{name}: {help}");
        }
    }
}
