//! `closecall campaign`: many samples of scenarios, judged.

use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use clap::Args;
use closecall_scenarios::sampling::Design;
use closecall_sensors::camera::{Backend, SHIPPED_MODEL};
use closecall_sensors::inference_backend;
use closecall_traffic::ActorId;
use indicatif::{ProgressBar, ProgressStyle};

use super::args::{ControllerArgs, Format, Sensing, SetArgs, arm, controllers};
use super::gates::GateArgs;
use super::leave::Over;
use super::output::{complain, outln};
use super::plan::PlanArgs;
use super::stop::{Stop, StopWatch};
use super::summary::{print_counts, print_verdict};
use super::{CliError, json};
use crate::campaign::execution::{Campaign, End, Turn};
use crate::campaign::folder::{Folder, FolderError};
use crate::campaign::ledger::Inference;
use crate::campaign::manifest::{MANIFEST_VERSION, Manifest, ManifestModel, ManifestScenario};
use crate::campaign::partition::Partition;
use crate::campaign::runner::{Sampling, Work};
use crate::campaign::selection::Selection;
use crate::campaign::summary::Summary;
use crate::campaign::workers::Workers;
use crate::controller::ControllerChoice;
use crate::exit_code::ExitCode;
use crate::report::overview::Overview;
use crate::scenario::ScenarioFile;
use crate::simulation::Arm;

/// Arguments of `closecall campaign`.
#[derive(Debug, Args)]
pub(super) struct CampaignArgs {
    /// Scenario files
    #[arg(required = true)]
    scenarios: Vec<PathBuf>,
    #[command(flatten)]
    plan: PlanArgs,
    /// Seed of the random numbers
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// How the sampled values are laid out: random, sobol or grid
    #[arg(long, default_value_t = Design::Random)]
    design: Design,
    #[command(flatten)]
    controller: ControllerArgs,
    /// Depth of the sensor simulation; the scenario's own where absent
    #[arg(long, value_enum)]
    sensors: Option<Sensing>,
    /// Run every sample without the margin increase system too, on the same random numbers
    #[arg(long)]
    paired: bool,
    /// Worker threads; one per processor where absent
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Longest wall time of a sample in one arm; one that takes longer is an error of that sample
    #[arg(long, value_name = "S", default_value_t = 300.0, value_parser = super::args::positive)]
    sample_timeout_s: f64,
    /// Write manifest, journal, Parquet, JUnit, HTML and recordings into this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// With --out: go on with the campaign that the folder holds, where it was stopped
    #[arg(long, requires = "out")]
    resume: bool,
    /// With --out: run only this part of the samples, to be put together by `closecall merge`
    #[arg(long, value_name = "I/N", requires = "out")]
    partition: Option<Partition>,
    /// With --out: record chosen samples of each scenario as Rerun files, with a page that shows them; `worst:N`,
    /// `failures:N` and `random:N`, with commas between
    #[arg(long, alias = "recordings", default_value = "failures:3", value_name = "KIND:N,…")]
    record: Selection,
    #[command(flatten)]
    gates: GateArgs,
    #[command(flatten)]
    set: SetArgs,
    /// Output for people or for programs
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

impl CampaignArgs {
    /// True where a baseline is run beside the controller under test: where it is asked for, or a preset can have it.
    fn is_paired(&self, tested: &ControllerChoice) -> bool {
        self.paired || (self.plan.wants_pairs() && *tested != ControllerChoice::Acc)
    }

    fn sampling(&self) -> Sampling {
        Sampling { seed: self.seed, design: self.design, samples: self.plan.samples() }
    }

    fn manifest(&self, campaign: &Campaign, controllers: &[ControllerChoice]) -> Result<Manifest, CliError> {
        let scenario = |file: &ScenarioFile| ManifestScenario {
            name: file.config().name.clone(),
            path: file.path().display().to_string(),
            blake3: blake3::hash(file.text().as_bytes()).to_string(),
            text: file.text().to_owned(),
        };
        Ok(Manifest {
            manifest_version: MANIFEST_VERSION,
            closecall_version: version(),
            scenarios: campaign.works.iter().map(|work| scenario(&work.file)).collect(),
            sampling: self.sampling(),
            partition: self.partition,
            arms: controllers.to_vec(),
            sensors: self.sensors.map(|sensing| sensing.name().to_owned()),
            checks: self.plan.checks()?,
            inference: self.plan.inference(),
            models: vec![rear_classifier()?],
            sample_timeout_s: self.sample_timeout_s,
            command: std::env::args().collect(),
        })
    }

    fn workers(&self) -> Result<Workers, CliError> {
        let jobs = match self.jobs {
            Some(jobs) => NonZeroUsize::new(jobs.into()),
            None => std::thread::available_parallelism().ok(),
        };
        let sample_timeout = Duration::try_from_secs_f64(self.sample_timeout_s).map_err(|_| CliError::Usage {
            message: format!("--sample-timeout-s {}: that is longer than can be waited for", self.sample_timeout_s),
        })?;
        Ok(Workers { jobs: jobs.unwrap_or(NonZeroUsize::MIN), sample_timeout })
    }
}

/// The network of the rear camera, and what runs it.
fn rear_classifier() -> Result<ManifestModel, CliError> {
    let backend = match inference_backend() {
        Backend::Tract => "tract".to_owned(),
        Backend::OnnxRuntime(library) => {
            let bytes = std::fs::read(library).map_err(|source| FolderError::Read { path: library.clone(), source })?;
            format!("onnxruntime, blake3 {}", blake3::hash(&bytes))
        }
    };
    let blake3 = blake3::hash(SHIPPED_MODEL).to_string();
    Ok(ManifestModel { name: "rear-classifier".to_owned(), blake3, backend })
}

/// The version of this very program: two builds of one release may differ, so the executable's own hash is part of it.
pub(super) fn version() -> String {
    let release = env!("CARGO_PKG_VERSION");
    match std::env::current_exe().and_then(std::fs::read) {
        Ok(bytes) => format!("{release}+{}", &blake3::hash(&bytes).to_hex()[..HASH_DIGITS]),
        Err(_) => release.to_owned(),
    }
}

pub(super) fn campaign(args: &CampaignArgs) -> Result<ExitCode, CliError> {
    let tested = args.controller.choice()?;
    let is_paired = args.is_paired(&tested);
    let controllers = controllers(tested, is_paired)?;
    let (gates, checks) = (args.gates.gates(is_paired, args.design)?, args.plan.checks()?);
    let arms: Vec<Arm> = controllers.iter().map(|controller| arm(controller, args.sensors)).collect();
    let work = |file| Arc::new(Work { file, sampling: args.sampling(), arms: arms.clone(), checks });
    let works = load(args)?.into_iter().map(work).collect();
    let campaign = Campaign { works, partition: args.partition, workers: args.workers()? };
    let manifest = args.manifest(&campaign, &controllers)?;
    let held = match &args.out {
        Some(path) => Some(Folder::hold(path, &manifest, args.resume)?),
        None => None,
    };
    let started = Instant::now();
    let stop = Stop {
        certain: gates.probability.filter(|_| args.plan.ends_when_certain()),
        budget: args.plan.time_budget(),
        scenarios: campaign.works.len(),
    };
    let mut watch = Watch::new(&campaign, &arms, StopWatch::start(stop), args.plan.inference());
    let torn = campaign.run(held.as_ref(), |turn| watch.take(turn))?;
    watch.bar.finish_and_clear();
    if let Some((line, reason)) = torn {
        complain(format_args!("the journal was torn at line {line} ({reason}): what followed was run again\n"));
    }
    let wall_s = started.elapsed().as_secs_f64();
    let Watch { summary, overview, .. } = watch;
    let judged = summary.judge(gates);
    let over = Over {
        manifest: &manifest,
        works: &campaign.works,
        summary: &summary,
        overview: &overview,
        gates,
        judged: &judged,
    };
    match &held {
        Some(held) => over.leave(&held.folder, args.record)?,
        None => over.leave_no_folder()?,
    }
    match args.format {
        Format::Json => outln!("{:#}", json::campaign(&summary, &judged, Some(wall_s))),
        Format::Human => {
            print_counts(&summary);
            let (simulated_s, jobs) = (summary.total().simulated_s, campaign.workers.jobs);
            outln!("{simulated_s:.0} simulated seconds in {wall_s:.1} s on {jobs} threads");
            print_verdict(&judged);
        }
    }
    Ok(judged.exit_code)
}

/// Counts what comes, and shows how far it is.
struct Watch {
    summary: Summary,
    overview: Overview,
    egos: Vec<(String, Option<ActorId>)>,
    stop: StopWatch,
    bar: ProgressBar,
}

impl Watch {
    fn new(campaign: &Campaign, arms: &[Arm], stop: StopWatch, inference: Inference) -> Self {
        let controllers = arms.iter().map(|arm| arm.controller.name().to_owned()).collect();
        let mut summary = Summary::new(controllers).with_inference(inference);
        let egos: Vec<_> =
            campaign.works.iter().map(|work| (work.file.config().name.clone(), work.file.ego_id().cloned())).collect();
        if let Some((first, _)) = egos.first() {
            summary.begin(first);
        }
        for work in &campaign.works {
            let (name, count, asked) = (&work.file.config().name, work.count(), work.sampling.samples);
            if count != asked {
                complain(format_args!("{name}: the grid has {count} of the {asked} samples asked for\n"));
            }
        }
        let overview = Overview::new(campaign.works.iter().map(|work| &work.file), &summary.controllers);
        Self { summary, overview, egos, stop, bar: progress(campaign.len()) }
    }

    fn take(&mut self, turn: Turn<'_>) -> ControlFlow<End> {
        while let Some((next, _)) = self.egos.get(self.summary.scenarios.len())
            && self.summary.scenarios.len() <= turn.work
        {
            self.summary.begin(next);
        }
        if let Some(ego) = &self.egos[turn.work].1 {
            self.summary.take(turn.record, ego);
        }
        self.overview.take(turn.record);
        self.bar.inc(1);
        if !turn.is_new {
            // What is found in the journal says nothing about how long the rest will take.
            self.bar.reset_eta();
        }
        let tested = self.summary.scenarios.last().and_then(|(_, counts)| counts.arms.last());
        tested.map_or(ControlFlow::Continue(()), |tested| self.stop.look(turn.work, tested))
    }
}

/// Reads every scenario before anything is run; names must differ, because results are filed by them.
fn load(args: &CampaignArgs) -> Result<Vec<ScenarioFile>, CliError> {
    let mut files: Vec<ScenarioFile> = Vec::with_capacity(args.scenarios.len());
    for path in &args.scenarios {
        let file = args.set.load(path)?;
        if let Some(same) = files.iter().find(|earlier| earlier.config().name == file.config().name) {
            let (one, other) = (same.path().display(), path.display());
            let message = format!("{one} and {other} have the same name `{}`", file.config().name);
            return Err(CliError::Usage { message });
        }
        files.push(file);
    }
    Ok(files)
}

/// Hexadecimal digits of the executable's hash in a version.
const HASH_DIGITS: usize = 16;

/// A progress bar on standard error, where that is a terminal.
fn progress(samples: u64) -> ProgressBar {
    let bar = ProgressBar::new(samples);
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {pos}/{len} samples, {per_sec}, {eta} left") {
        bar.set_style(style);
    }
    bar
}
