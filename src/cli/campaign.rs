//! `closecall campaign`: many samples of scenarios, judged.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use clap::Args;
use closecall_scenarios::sampling::Design;
use indicatif::{ProgressBar, ProgressStyle};
use rayon::ThreadPool;

use super::args::{Format, Sensing, SetArgs, arm};
use super::output::{complain, out, outln};
use super::{CliError, json, leave};
use crate::campaign::folder::{Folder, Journal};
use crate::campaign::manifest::{MANIFEST_VERSION, Manifest, ManifestScenario};
use crate::campaign::runner::{Finished, Sampling, run_samples};
use crate::campaign::summary::{Counts, Summary};
use crate::campaign::verdict::{Gates, Judgement};
use crate::controller::BuiltIn;
use crate::exit_code::ExitCode;
use crate::report::timings::Timing;
use crate::scenario::ScenarioFile;
use crate::simulation::Arm;

/// Arguments of `closecall campaign`.
#[derive(Debug, Args)]
pub(super) struct CampaignArgs {
    /// Scenario files
    #[arg(required = true)]
    scenarios: Vec<PathBuf>,
    /// Samples of each scenario
    #[arg(short = 'n', long = "samples", default_value_t = 200, value_parser = clap::value_parser!(u64).range(1..))]
    samples: u64,
    /// Seed of the random numbers
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// How the sampled values are laid out: random, sobol or grid
    #[arg(long, default_value_t = Design::Random)]
    design: Design,
    /// Controller under test
    #[arg(long, value_enum, default_value_t = BuiltIn::Mis)]
    controller: BuiltIn,
    /// Depth of the sensor simulation; the scenario's own where absent
    #[arg(long, value_enum)]
    sensors: Option<Sensing>,
    /// Run every sample without the margin increase system too, on the same random numbers
    #[arg(long)]
    paired: bool,
    /// Worker threads; one per processor where absent
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Write manifest, journal, Parquet, JUnit and recordings into this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// With --out: record this many failing samples as Rerun files
    #[arg(long, default_value_t = 3, value_name = "N")]
    recordings: u64,
    /// Fail where E collides in more samples than this
    #[arg(long, value_name = "K")]
    max_collisions: Option<u64>,
    /// With --paired: fail where more collisions than this happen only with the controller under test
    #[arg(long, value_name = "K", requires = "paired")]
    max_induced: Option<u64>,
    /// Fail where E falls by more than this below the speed of the vehicle ahead, in any sample
    #[arg(long, value_name = "M/S", value_parser = super::args::positive)]
    max_speed_deficit_mps: Option<f64>,
    #[command(flatten)]
    set: SetArgs,
    /// Output for people or for programs
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

impl CampaignArgs {
    /// The controllers, the baseline first.
    fn controllers(&self) -> Result<Vec<BuiltIn>, CliError> {
        match (self.paired, self.controller) {
            (false, tested) => Ok(vec![tested]),
            (true, BuiltIn::Acc) => Err(CliError::Usage {
                message: "--paired compares a controller with `acc`: name another with --controller".to_owned(),
            }),
            (true, tested) => Ok(vec![BuiltIn::Acc, tested]),
        }
    }

    fn sampling(&self) -> Sampling {
        Sampling { seed: self.seed, design: self.design, samples: self.samples }
    }

    fn manifest(&self, files: &[ScenarioFile], controllers: &[BuiltIn]) -> Manifest {
        let scenario = |file: &ScenarioFile| ManifestScenario {
            name: file.config().name.clone(),
            path: file.path().display().to_string(),
            blake3: blake3::hash(file.text().as_bytes()).to_string(),
            text: file.text().to_owned(),
        };
        Manifest {
            manifest_version: MANIFEST_VERSION,
            closecall_version: version(),
            scenarios: files.iter().map(scenario).collect(),
            sampling: self.sampling(),
            arms: controllers.to_vec(),
            sensors: self.sensors.map(|sensing| sensing.name().to_owned()),
            command: std::env::args().collect(),
        }
    }
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
    let files = load(args)?;
    let controllers = args.controllers()?;
    let folder = match &args.out {
        Some(path) => Some(Folder::create(path, &args.manifest(&files, &controllers))?),
        None => None,
    };
    let pool = pool(args.jobs)?;
    let started = Instant::now();
    let arms: Vec<Arm> = controllers.iter().map(|controller| arm(*controller, args.sensors)).collect();
    let journal = folder.as_ref().map(Folder::new_journal).transpose()?;
    let (summary, timings) = run_all(args, &files, &arms, &pool, journal)?;
    let wall_s = started.elapsed().as_secs_f64();
    if let Some(folder) = &folder {
        leave::reports(folder, &files, &timings, args.recordings)?;
    }
    let judged = summary.judge(Gates {
        max_collisions: args.max_collisions,
        max_induced: args.max_induced,
        max_speed_deficit_mps: args.max_speed_deficit_mps,
    });
    match args.format {
        Format::Json => outln!("{:#}", json::campaign(&summary, &judged, wall_s)),
        Format::Human => print_human(&summary, &judged, wall_s, &pool),
    }
    Ok(judged.exit_code)
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

fn pool(jobs: Option<u16>) -> Result<ThreadPool, CliError> {
    let jobs = jobs.map_or(0, usize::from);
    rayon::ThreadPoolBuilder::new()
        .num_threads(jobs)
        .build()
        .map_err(|error| CliError::Threads { jobs, message: error.to_string() })
}

/// Hexadecimal digits of the executable's hash in a version.
const HASH_DIGITS: usize = 16;

fn run_all(
    args: &CampaignArgs,
    files: &[ScenarioFile],
    arms: &[Arm],
    pool: &ThreadPool,
    mut journal: Option<Journal>,
) -> Result<(Summary, Vec<Timing>), CliError> {
    let names = arms.iter().map(|arm| arm.controller.name().to_owned()).collect();
    let mut summary = Summary::new(names);
    let mut timings = Vec::new();
    let sampling = args.sampling();
    let counts: Vec<u64> = files.iter().map(|file| file.space().samples(args.design, args.samples)).collect();
    for (file, count) in files.iter().zip(&counts).filter(|(_, count)| **count != args.samples) {
        complain(format_args!(
            "{}: the grid has {count} of the {} samples asked for\n",
            file.config().name,
            args.samples
        ));
    }
    let bar = progress(counts.iter().sum());
    let controllers: Vec<Arc<str>> = arms.iter().map(|arm| arm.controller.name().into()).collect();
    for (file, count) in files.iter().zip(counts) {
        summary.begin(&file.config().name);
        let scenario: Arc<str> = file.config().name.as_str().into();
        let Some(ego) = file.ego_id() else { continue };
        run_samples(pool, file, sampling, arms, 0..count, |finished: Finished| {
            if let Some(journal) = &mut journal {
                journal.append(&finished.record)?;
                let sample = finished.record.sample;
                timings.extend(finished.wall_s.iter().zip(&controllers).map(|(wall_s, controller)| Timing {
                    scenario: scenario.clone(),
                    sample,
                    controller: controller.clone(),
                    wall_s: *wall_s,
                }));
            }
            summary.take(&finished, ego);
            bar.inc(1);
            Ok::<(), CliError>(())
        })?;
    }
    bar.finish_and_clear();
    if let Some(journal) = &mut journal {
        journal.sync()?;
    }
    Ok((summary, timings))
}

/// A progress bar on standard error, where that is a terminal.
fn progress(samples: u64) -> ProgressBar {
    let bar = ProgressBar::new(samples);
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {pos}/{len} samples, {per_sec}, {eta} left") {
        bar.set_style(style);
    }
    bar
}

fn print_human(summary: &Summary, judged: &Judgement, wall_s: f64, pool: &ThreadPool) {
    for (name, counts) in &summary.scenarios {
        outln!("{name}: {} samples", counts.samples);
        print_counts(summary, counts);
    }
    if summary.scenarios.len() > 1 {
        outln!("all scenarios");
        print_counts(summary, &summary.total());
    }
    outln!("Rates are conditional on the sampled scenario: they are not the risk of a road.");
    let total = summary.total();
    outln!("{:.0} simulated seconds in {wall_s:.1} s on {} threads", total.simulated_s, pool.current_num_threads(),);
    outln!("{}", judged.verdict);
    for reason in &judged.reasons {
        outln!("  {reason}");
    }
}

fn print_counts(summary: &Summary, counts: &Counts) {
    for (name, arm) in summary.controllers.iter().zip(&counts.arms) {
        let [low, high] = arm.interval_95().map(|bound| 100.0 * bound);
        let rate = arm.collision_rate().map_or("-".to_owned(), |rate| format!("{:.1} %", 100.0 * rate));
        out!("  {name:<5} {:>6} collisions  {rate:>7}  (95 %: {low:.1} to {high:.1} %)", arm.collisions);
        if arm.engagements > 0 {
            out!("  {} engaged, goal in reach in {}", arm.engagements, arm.goals_in_reach);
        }
        out!("  up to {:.1} m/s slower than ahead", arm.max_speed_deficit_mps);
        if arm.errors > 0 {
            out!("  {} ERRORS", arm.errors);
        }
        outln!();
    }
    if summary.is_paired() {
        let pairs = counts.pairs;
        outln!(
            "  pairs: {} prevented, {} induced, {} both, {} neither",
            pairs.prevented,
            pairs.induced,
            pairs.both,
            pairs.neither,
        );
    }
}
