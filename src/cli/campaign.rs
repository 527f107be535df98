//! `closecall campaign`: many samples of scenarios, judged.

use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use clap::Args;
use closecall_campaign::execution::{Campaign, End, Turn};
use closecall_campaign::folder::Folder;
use closecall_campaign::partition::Partition;
use closecall_campaign::plan::Plan;
use closecall_campaign::runner::Sampling;
use closecall_campaign::selection::Selection;
use closecall_campaign::stop::{Stop, StopWatch};
use closecall_campaign::workers::Workers;
use closecall_report::campaign::{CampaignReport, Tally};
use closecall_scenarios::sampling::Design;
use closecall_simulation::controller::ControllerChoice;
use indicatif::{ProgressBar, ProgressStyle};

use super::args::{ControllerArgs, Format, Sensing, SetArgs, controllers};
use super::gates::GateArgs;
use super::output::{complain, outln};
use super::plan::PlanArgs;
use super::summary::{print_counts, print_verdict};
use super::{CliError, json};
use crate::exit_code::ExitCode;

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

    fn workers(&self) -> Result<Workers, CliError> {
        let jobs = self.jobs.and_then(|jobs| NonZeroUsize::new(jobs.into())).unwrap_or(Workers::default().jobs);
        let sample_timeout = Duration::try_from_secs_f64(self.sample_timeout_s).map_err(|_| CliError::Usage {
            message: format!("--sample-timeout-s {}: that is longer than can be waited for", self.sample_timeout_s),
        })?;
        Ok(Workers { jobs, sample_timeout })
    }

    /// Reads every scenario before anything is run.
    fn plan(&self, controllers: Vec<ControllerChoice>) -> Result<Plan, CliError> {
        let files = self.scenarios.iter().map(|path| self.set.load(path)).collect::<Result<Vec<_>, _>>()?;
        let mut plan = Plan::new(files, self.sampling(), controllers)?;
        plan.sensors = self.sensors.map(Sensing::mode);
        plan.partition = self.partition;
        plan.checks = self.plan.checks()?;
        plan.inference = self.plan.inference();
        plan.workers = self.workers()?;
        Ok(plan)
    }
}

pub(super) fn campaign(args: &CampaignArgs) -> Result<ExitCode, CliError> {
    let tested = args.controller.choice()?;
    let is_paired = args.is_paired(&tested);
    let gates = args.gates.gates(is_paired, args.design)?;
    let plan = args.plan(controllers(tested, is_paired)?)?;
    let (campaign, manifest) = (plan.campaign(), plan.manifest(std::env::args().collect())?);
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
    let mut progress = Progress::new(&campaign, StopWatch::start(stop));
    let torn = campaign.run(held.as_ref(), |turn| progress.push(turn))?;
    progress.bar.finish_and_clear();
    if let Some((line, reason)) = torn {
        complain(format_args!("the journal was torn at line {line} ({reason}): what followed was run again\n"));
    }
    let wall_s = started.elapsed().as_secs_f64();
    let tally = &progress.tally;
    let judged = tally.summary.judge(gates);
    let report = CampaignReport { manifest: &manifest, works: &campaign.works, tally, gates, judged: &judged };
    match &held {
        Some(held) => report.write(&held.folder, args.record)?,
        None => report.write_without_folder()?,
    }
    match args.format {
        Format::Json => outln!("{:#}", json::campaign(&tally.summary, &judged, Some(wall_s))),
        Format::Human => {
            print_counts(&tally.summary);
            let (simulated_s, jobs) = (tally.summary.total().simulated_s, campaign.workers.jobs);
            outln!("{simulated_s:.0} simulated seconds in {wall_s:.1} s on {jobs} threads");
            print_verdict(&judged);
        }
    }
    Ok(ExitCode::from(&judged))
}

/// Counts records as they come, shows how many are done, and says when to stop.
struct Progress {
    names: Vec<String>,
    tally: Tally,
    stop: StopWatch,
    bar: ProgressBar,
}

impl Progress {
    fn new(campaign: &Campaign, stop: StopWatch) -> Self {
        for work in &campaign.works {
            let (name, count, asked) = (&work.file.config().name, work.count(), work.sampling.samples);
            if count != asked {
                complain(format_args!("{name}: the grid has {count} of the {asked} samples asked for\n"));
            }
        }
        let names = campaign.works.iter().map(|work| work.file.config().name.clone()).collect();
        Self { names, tally: Tally::new(campaign), stop, bar: progress_bar(campaign.len()) }
    }

    fn push(&mut self, turn: Turn<'_>) -> ControlFlow<End> {
        self.tally.push(turn.record);
        self.bar.inc(1);
        if !turn.is_new {
            // Records read from the journal say nothing about how long the rest will take.
            self.bar.reset_eta();
        }
        let tested = self.tally.summary.tested(&self.names[turn.work]);
        tested.map_or(ControlFlow::Continue(()), |tested| self.stop.observe(turn.work, tested))
    }
}

/// A progress bar on standard error, where that is a terminal.
fn progress_bar(samples: u64) -> ProgressBar {
    let bar = ProgressBar::new(samples);
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {pos}/{len} samples, {per_sec}, {eta} left") {
        bar.set_style(style);
    }
    bar
}
