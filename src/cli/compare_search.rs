//! `closecall compare --search`: looks beyond the samples of two campaigns for one in which the
//! controller of the later campaign fails and the controller of the earlier one does not.
//!
//! ```text
//!  two folders ─▶ their scenarios, their two controllers ─▶ search for an induced collision ─▶ smallest case
//! ```
//!
//! It is a search for the first case of an event, as of `campaign --design search`. The arms are the
//! two controllers, and the event is a collision that the later one induces.

use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::Args;
use closecall_campaign::arguments::{Jobs, count};
use closecall_campaign::gate::GateSet;
use closecall_campaign::plan::Plan;
use closecall_campaign::rare::Method;
use closecall_campaign::runner::Sampling;
use closecall_campaign::saved::SavedCampaign;
use closecall_campaign::workers::Workers;
use closecall_scenarios::ScenarioFile;
use closecall_scenarios::criteria::EventExpression;
use closecall_scenarios::sampling::Design;
use closecall_simulation::controller::ControllerChoice;

use super::CliError;
use super::args::Format;
use super::help::heading;
use super::keywords::needs;
use super::output::print_error;
use super::rare::{Rare, RareArgs};
use super::saved::TrustArgs;
use crate::exit_code::ExitCode;

/// The event: the later controller collides where the earlier one does not.
const EVENT: &str = "induced";

/// A search beyond the samples of two campaigns.
#[derive(Debug, Args)]
pub(super) struct SearchArgs {
    /// Look beyond the samples of both campaigns for one in which the ego collides with the
    /// controller of the later campaign, and not with the controller of the earlier one. The first
    /// is reduced to the smallest case. The exit code is 1 if there is one
    #[arg(long, conflicts_with_all = ["max_newly_failing", "tolerance", "max_flip_rate"], help_heading = heading::METHOD)]
    search: bool,
    /// With --search: largest number of runs of each scenario [default: 2000]
    #[arg(short = 'n', long, value_name = "N", value_parser = count, requires = "search", help_heading = heading::SAMPLES)]
    samples: Option<u64>,
    /// With --search: seed of the random numbers [default: the seed of the later campaign]
    #[arg(long, value_parser = closecall_campaign::arguments::seed, requires = "search", help_heading = heading::SAMPLES)]
    seed: Option<u64>,
    /// With --search: number of worker threads [default: one per processor]
    #[arg(long, requires = "search", help_heading = heading::EXECUTION)]
    jobs: Option<Jobs>,
    /// With --search: folder for the result, its journal, and the smallest case as a scenario file.
    /// It must be new or empty
    #[arg(short, long, value_name = "DIR", requires = "search", help_heading = heading::OUTPUT)]
    out: Option<PathBuf>,
    /// With --search: resume the interrupted search in the folder of --out
    #[arg(long, requires = "out", help_heading = heading::EXECUTION)]
    resume: bool,
    #[command(flatten)]
    trust: TrustArgs,
}

/// The folders of two campaigns.
#[derive(Clone, Copy, Debug)]
pub(super) struct Folders<'a> {
    pub(super) earlier: &'a Path,
    pub(super) later: &'a Path,
}

impl SearchArgs {
    /// Returns true if a search is asked for.
    ///
    /// # Errors
    /// [`CliError`] if an option belongs to a search, and there is none.
    pub(super) fn is_asked(&self) -> Result<bool, CliError> {
        needs(("trust-folder", self.trust.is_named()), ("search", self.search))?;
        Ok(self.search)
    }

    /// Searches in every scenario that both campaigns have, and prints the result.
    pub(super) fn run(&self, folders: Folders<'_>, format: Format) -> Result<ExitCode, CliError> {
        let (earlier, later) = (self.trust.open(folders.earlier)?, self.trust.open(folders.later)?);
        let controllers = vec![controller(&earlier)?, controller(&later)?];
        if controllers[0] == controllers[1] {
            return Err(CliError::usage(format!(
                "both campaigns tested `{}`: a search runs both versions of a controller, so keep the earlier one under another name",
                controllers[0]
            )));
        }
        let manifest = later.manifest();
        if earlier.manifest().sensors != manifest.sensors {
            return Err(CliError::usage(
                "the campaigns had different --sensors: a search compares two controllers with the same sensors",
            ));
        }
        let files = common_scenarios(&earlier, &later)?;
        say_changes(&earlier, &files);
        say_changes(&later, &files);
        let seed = self.seed.unwrap_or(manifest.sampling.seed);
        let sampling = Sampling { seed, design: Design::Random, samples: manifest.sampling.samples };
        let mut plan = Plan::new(files, sampling, controllers)?;
        plan.use_sensors(manifest.sensors)?;
        plan.workers = Workers::with_jobs(self.jobs.map(|jobs| jobs.0));
        if let Ok(timeout) = Duration::try_from_secs_f64(manifest.sample_timeout_s) {
            plan.workers.sample_timeout = timeout;
        }
        let event = EVENT.parse::<EventExpression>().map_err(|error| CliError::usage(error.to_string()))?;
        let rare = Rare {
            method: Method::Search,
            args: &RareArgs::of(event),
            budget: self.samples,
            // The event judges by itself, whatever gates the campaigns had.
            gates: GateSet { is_measurement: true, ..GateSet::default() },
            ray: None,
            folder: self.out.as_deref(),
            resume: self.resume,
            format,
            can_draw_seed: false,
        };
        rare.run(&plan)
    }
}

/// Returns the controller under test of a campaign, which may run here.
fn controller(saved: &SavedCampaign) -> Result<ControllerChoice, CliError> {
    saved.check_trust()?;
    let manifest = saved.manifest();
    let Some(controller) = manifest.arms.last() else {
        return Err(CliError::usage(format!("{} has no controller", saved.folder().path().display())));
    };
    // A relative path of a process leads to its file from this folder only.
    let here = std::env::current_dir().ok();
    match manifest.controller_folder() {
        Some(folder) if controller.has_limits() && here.as_deref() != Some(folder) => Err(CliError::usage(format!(
            "`{controller}` of {} ran in {}: run the search in this folder",
            saved.folder().path().display(),
            folder.display()
        ))),
        _ => Ok(controller.clone()),
    }
}

/// Returns the scenarios that both campaigns have with the same text, and names the others.
fn common_scenarios(earlier: &SavedCampaign, later: &SavedCampaign) -> Result<Vec<ScenarioFile>, CliError> {
    let mut files = Vec::new();
    for scenario in &later.manifest().scenarios {
        let there = &earlier.manifest().scenarios;
        let name = &scenario.name;
        if there.iter().any(|other| other.name == *name && other.blake3 == scenario.blake3) {
            files.push(later.file(Some(name.as_str()))?);
        } else {
            print_error(format_args!("{name}: not searched, because the earlier campaign has not the same text\n"));
        }
    }
    match files.is_empty() {
        true => Err(CliError::usage("the campaigns have no scenario with the same text")),
        false => Ok(files),
    }
}

/// Says what has changed in the controller of a campaign since it ran: the search runs what is
/// there now.
fn say_changes(saved: &SavedCampaign, files: &[ScenarioFile]) {
    let nominal = files.first().and_then(|file| file.concrete(&file.space().nominal()).ok());
    let (Some(nominal), Some(name)) = (nominal, saved.manifest().arm_names().pop()) else { return };
    for change in saved.manifest().changed_controllers(&nominal, &[name.as_str()]) {
        print_error(format_args!("{}: {change}\n", saved.folder().path().display()));
    }
}
