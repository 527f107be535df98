//! `closecall campaign --design subset|importance`: the probability of a rare event, with an
//! interval. `--design search`: the first case of an event, reduced to a scenario.

use std::fmt;
use std::path::Path;
use std::str::FromStr;
use std::sync::Arc;

use clap::Args;
use closecall_campaign::action::{Action, Resume};
use closecall_campaign::arguments::positive;
use closecall_campaign::controller_watch::ControllerWatch;
use closecall_campaign::execution::CampaignError;
use closecall_campaign::folder::Folder;
use closecall_campaign::gate::{GateSet, GateSource, LEAST_SAMPLES, ProbabilitySpec};
use closecall_campaign::interrupt::Signal;
use closecall_campaign::manifest::Manifest;
use closecall_campaign::partition::Partition;
use closecall_campaign::plan::Plan;
use closecall_campaign::probability::ProbabilityGate;
use closecall_campaign::rare::{
    Goal, Method, Nearest, Nearness, RareError, RareFolder, RareManifest, RarePlan, RareReport,
};
use closecall_campaign::remote::connect_points;
use closecall_campaign::runner::Work;
use closecall_campaign::session;
use closecall_report::json::stamped;
use closecall_scenarios::criteria::{EGO_COLLIDED, EventExpression, Guide, PairFlag, Quantity};
use closecall_scenarios::sampling::Design;
use closecall_scenarios::{Setting, WEAKENED_COVERAGE, library};
use closecall_sensors::SensorMode;
use closecall_studies::case::Case;
use closecall_studies::minimize::{MinimizedText, minimize, output_files, with_choice, write_files};
use closecall_traffic::statistics::format::percent;
use closecall_traffic::words::counted;
use serde_json::{Value, json};

use super::CliError;
use super::actions::{command_for, quoted};
use super::advice::known_seed;
use super::args::Format;
use super::backend::{check_backend, check_networks};
use super::campaign::progress_bar;
use super::help::heading;
use super::output::{heartbeat, outln, print_error, print_text, print_written, textln};
use crate::exit_code::ExitCode;

/// Largest number of runs of each scenario, unless another one is named: of an estimate, and of a
/// search.
const BUDGET: u64 = 200_000;
const SEARCH_BUDGET: u64 = 2_000;

/// How the samples of a campaign are drawn: by a design, or by a method for rare events.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum DesignChoice {
    /// A sampling design.
    Plain(Design),
    /// A method for rare events.
    Rare(Method),
}

impl DesignChoice {
    /// Returns the design. A rare event has the design of independent samples, by which none of its
    /// samples is judged.
    pub(super) fn plain(self) -> Design {
        match self {
            Self::Plain(design) => design,
            Self::Rare(_) => Design::Random,
        }
    }
}

impl Default for DesignChoice {
    fn default() -> Self {
        Self::Plain(Design::Random)
    }
}

impl fmt::Display for DesignChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Plain(design) => design.fmt(f),
            Self::Rare(method) => method.fmt(f),
        }
    }
}

impl FromStr for DesignChoice {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        let plain = word.parse().map(Self::Plain);
        plain.or_else(|_| word.parse().map(Self::Rare)).map_err(|_| {
            let names = Design::ALL.map(Design::name).into_iter().chain(Method::ALL.map(Method::name));
            let names: Vec<String> = names.map(|name| format!("`{name}`")).collect();
            format!("`{word}` is not a sampling design: one of {} is needed", names.join(", "))
        })
    }
}

/// The rare event of a campaign.
#[derive(Clone, Debug, Default, Args)]
pub(super) struct RareArgs {
    /// With --design subset, importance or search: the event that is estimated or sought, a flag such as
    /// `collision` or `induced`, a number with a bound such as "min_ttc_rear_s < 0.3", or a
    /// difference such as "prevented - induced". docs/reference/criteria.md lists the measures
    #[arg(long, value_name = "EVENT", help_heading = heading::SAMPLES)]
    event: Option<EventExpression>,
    /// With --event: the number that leads to the event, such as `min_thw_rear_s`. It decides how
    /// many runs a search needs, and no result [default: the number of the event; the smallest gap
    /// of a collision]
    #[arg(long, value_name = "MEASURE", requires = "event", help_heading = heading::SAMPLES)]
    guide: Option<Guide>,
    /// With --event: width of the 95 % interval, relative to the estimate, at which the sampling
    /// ends [default: 0.5]
    #[arg(long, value_name = "W", value_parser = positive, requires = "event", help_heading = heading::SAMPLES)]
    relative_width: Option<f64>,
}

/// Width of the interval, relative to the estimate, unless another one is named.
const RELATIVE_WIDTH: f64 = 0.5;

/// The arguments of the command line for a rare event.
pub(super) struct Rare<'a> {
    pub(super) method: Method,
    pub(super) args: &'a RareArgs,
    /// Largest number of runs of each scenario.
    pub(super) budget: Option<u64>,
    /// The gates of the command line and of the project files.
    pub(super) gates: GateSet,
    /// The cluster that runs the runs, if this machine does not.
    pub(super) ray: Option<&'a str>,
    /// The folder for the results, if they are kept.
    pub(super) folder: Option<&'a Path>,
    pub(super) resume: bool,
    pub(super) format: Format,
    /// Whether the command can draw the seed.
    pub(super) can_draw_seed: bool,
}

impl RareArgs {
    /// Returns the options that name an event and leave the rest to the defaults.
    pub(super) fn of(event: EventExpression) -> Self {
        Self { event: Some(event), ..Self::default() }
    }

    /// Returns true if the options name an event.
    pub(super) const fn is_named(&self) -> bool {
        self.event.is_some()
    }

    /// Returns true if the event compares with a baseline.
    pub(super) fn needs_pairs(&self) -> bool {
        self.event.is_some_and(|event| event.needs_pairs())
    }

    /// Returns the event.
    fn nearness(&self, method: Method) -> Result<Nearness, CliError> {
        let Some(event) = self.event else {
            return Err(CliError::usage(format!(
                "--design {method} needs the event that it looks for: name one with --event, such as --event collision"
            )));
        };
        Nearness::new(event, self.guide)
            .map_err(|error| CliError::usage(format!("--event: {error}, with --guide MEASURE")))
    }
}

impl Rare<'_> {
    /// Samples the event in every scenario of a plan, and prints the estimates.
    pub(super) fn run(&self, plan: &Plan) -> Result<ExitCode, CliError> {
        let nearness = self.args.nearness(self.method)?;
        let has_gate = self.gates.probability.as_ref().is_some_and(|spec| spec.source == GateSource::CommandLine);
        if self.method == Method::Search && (has_gate || self.args.relative_width.is_some()) {
            return Err(CliError::usage(
                "--design search states no probability: --max-probability and --relative-width belong to --design importance or subset",
            ));
        }
        let campaign = plan.campaign();
        if let Some(work) = campaign.works.first() {
            check_event(nearness.expression(), work, has_gate)?;
        }
        check_backend(plan.uses_classifier())?;
        check_networks(plan.crop_networks(), plan.mask_rcnn_cameras())?;
        let goal = Goal {
            relative_width: self.args.relative_width.unwrap_or(RELATIVE_WIDTH),
            budget: self.budget.unwrap_or(if self.method == Method::Search { SEARCH_BUDGET } else { BUDGET }),
            value: nearness.value(),
        };
        let manifest = RareManifest {
            method: self.method,
            event: nearness.expression().to_string(),
            guide: nearness.guide().map(|guide| guide.0.name.to_owned()),
            relative_width: goal.relative_width,
            budget: goal.budget,
            campaign: plan.manifest(session::arguments())?,
        };
        let remote = connect_points(self.ray, &manifest.campaign).map_err(CampaignError::from)?;
        let (method, workers, part) = (self.method, campaign.workers, plan.partition);
        let rare = RarePlan { method, nearness, goal, workers, remote, part };
        let folder = self.folder.map(|path| RareFolder::lock(path, &manifest, self.resume)).transpose()?;
        // Other machines run the files that were shipped at the start.
        let watched = self.ray.is_none().then_some(&manifest.campaign);
        let mut watch = ControllerWatch::start(watched, self.folder.map(Folder::open).as_ref())?;
        let mut journal = folder.as_ref().map(RareFolder::journal).transpose()?;
        let mut stop = campaign.stop.clone();
        session::stop_on_request(&mut stop);
        let bar = progress_bar(goal.budget.saturating_mul(campaign.works.len() as u64));
        let _heartbeat = heartbeat(&bar);
        let (mut reports, mut runs_of_part) = (Vec::new(), Vec::new());
        for work in campaign.works.iter().enumerate() {
            let mut on_run = || {
                bar.inc(1);
                watch.look();
            };
            match rare.run(work, journal.as_mut(), &stop, &mut on_run) {
                Ok(report) => {
                    watch.add(report.difference.iter().cloned().collect());
                    reports.push(report);
                }
                Err(RareError::PartEnds { runs }) => runs_of_part.push((work.1.file.config().name.clone(), runs)),
                Err(RareError::Stopped) => {
                    watch.finish()?;
                    return Ok(self.stopped(&bar));
                }
                Err(RareError::Campaign(error)) => return Err(error.into()),
                Err(error @ (RareError::NothingVaries { .. } | RareError::MissingRun { .. })) => {
                    return Err(CliError::usage(error.to_string()));
                }
            }
        }
        bar.finish_and_clear();
        let changes = watch.finish()?;
        if let Some(part) = part {
            self.print_part(part, &runs_of_part, manifest.campaign.sampling.seed);
            changes.iter().for_each(|change| print_error(format_args!("{change}\n")));
            return Ok(if changes.is_empty() { ExitCode::Pass } else { ExitCode::Invalid });
        }
        let event = nearness.expression();
        let results = Results { event, reports: &reports, works: &campaign.works, changes: &changes };
        let code = self.conclude(results, &manifest.campaign, folder.as_ref())?;
        if self.method == Method::Search {
            for (report, work) in reports.iter().zip(&campaign.works) {
                self.minimize(report, work, &manifest.campaign, nearness.expression())?;
            }
        }
        Ok(code)
    }

    /// Prints the estimates, and writes them into the folder.
    pub(super) fn conclude(
        &self,
        results: Results<'_>,
        manifest: &Manifest,
        folder: Option<&RareFolder>,
    ) -> Result<ExitCode, CliError> {
        let Results { event, reports, works, changes } = results;
        let judged = |(report, work): (&RareReport, &Arc<Work>)| {
            let gate = self.gate_of(event, work);
            Judged {
                report: if gate.is_some() { self.with_weakened(event, report, work) } else { report.clone() },
                gate,
                has_changed: !changes.is_empty(),
            }
        };
        let judged: Vec<Judged> = reports.iter().zip(works).map(judged).collect();
        // A search has no gate, and judges by its exit code.
        let judges = judged.iter().any(|judged| judged.gate.is_some()) || self.method == Method::Search;
        let known = known_seed(judges, manifest, self.can_draw_seed);
        let remarks = changes.iter().cloned().chain(known).chain(self.not_judged(event, works));
        let remarks: Vec<String> = remarks.collect();
        let seed = works.first().map(|work| work.sampling.seed);
        let result = json_of(&judged, seed, &remarks);
        if let Some(folder) = folder {
            print_written(&folder.write(&result)?);
        }
        match self.format {
            Format::Json => outln!("{result:#}"),
            Format::Human => {
                print(&judged, works, manifest.sensors);
                remarks.iter().for_each(|remark| textln!("  {remark}"));
                if manifest.has_drawn_seed {
                    textln!("  drawn for this campaign: --seed {}", manifest.sampling.seed);
                }
            }
        }
        Ok(ExitCode::first_of(judged.iter().map(Judged::code)))
    }

    /// Returns the gate by which the event is judged in a scenario. The gate of a project file or of
    /// the scenario file bounds the probability of a collision of the ego, and of no other event.
    fn gate_of(&self, event: EventExpression, work: &Work) -> Option<ProbabilityGate> {
        if self.method == Method::Search {
            return None;
        }
        let of_command_line = |spec: &ProbabilitySpec| spec.source == GateSource::CommandLine;
        let spec = match is_collision(event) {
            true => self.gates.probability_of(&work.file),
            false => self.gates.probability.clone().filter(of_command_line),
        };
        spec.map(|spec| spec.gate)
    }

    /// Returns the gates of the project files and of the scenario files, and the checks of these,
    /// that the event does not judge, in words.
    fn not_judged(&self, event: EventExpression, works: &[Arc<Work>]) -> Option<String> {
        if self.gates.is_measurement {
            return None;
        }
        let mut unjudged: Vec<String> = Vec::new();
        for work in works {
            for spec in self.gates.of_scenario(&work.file) {
                let text = format!("{} ({})", spec.expression, spec.source);
                unjudged.extend((!unjudged.contains(&text)).then_some(text));
            }
            let spec = self.gates.probability_of(&work.file);
            let spec = spec.filter(|spec| spec.source != GateSource::CommandLine);
            if let Some(spec) = spec.filter(|_| self.gate_of(event, work).is_none()) {
                let text = format!("max-probability {} of a collision ({})", spec.gate.max(), spec.source);
                unjudged.extend((!unjudged.contains(&text)).then_some(text));
            }
        }
        (!unjudged.is_empty()).then(|| format!("not judged by --design {}: {}", self.method, unjudged.join("; ")))
    }

    /// Returns a report that says what settings or the gate of the command line demand less than the
    /// file of the scenario or a project file: a low probability then does not pass.
    fn with_weakened(&self, event: EventExpression, report: &RareReport, work: &Work) -> RareReport {
        let mut report = report.clone();
        let of_settings = work.file.config().overridden.iter().filter(|weakening| *weakening != WEAKENED_COVERAGE);
        let of_gates = if is_collision(event) { self.gates.weakened_in(&work.file) } else { Vec::new() };
        let weakened: Vec<String> = of_settings.cloned().chain(of_gates).collect();
        if !weakened.is_empty() {
            let weakened = weakened.join("; ");
            report.not_judged.push(format!("a setting weakened what the scenario is judged by: {weakened}"));
        }
        report
    }

    /// Says what a part of the campaign holds, which has no estimate of its own.
    fn print_part(&self, part: Partition, runs: &[(String, u64)], seed: u64) {
        match self.format {
            Format::Json => {
                let scenarios = runs.iter().map(|(scenario, runs)| json!({ "scenario": scenario, "runs": runs }));
                let scenarios: Vec<Value> = scenarios.collect();
                outln!("{:#}", stamped(json!({ "partition": part, "scenarios": scenarios }), Some(seed), None));
            }
            Format::Human => {
                for (scenario, runs) in runs {
                    textln!("{scenario}: part {part} of a campaign by {}, {}", self.method, counted(*runs, "run"));
                }
                textln!("  no estimate: `closecall tool merge` makes it of all parts");
            }
        }
    }

    /// Says that a signal has ended the runs.
    fn stopped(&self, bar: &indicatif::ProgressBar) -> ExitCode {
        let runs = bar.position();
        bar.finish_and_clear();
        let command = session::arguments();
        let resume = || {
            command_for(&Action::Resume(Resume {
                command: &command,
                retries_errors: false,
                moved_to: None,
                working_folder: None,
            }))
        };
        let resume = self.folder.map(|_| resume());
        let signal = session::received().map_or("stopped", Signal::name);
        match (self.format, resume) {
            (Format::Json, resume) => {
                let ended = json!({ "ended_early": signal, "runs": runs, "resume": resume });
                outln!("{:#}", stamped(ended, None, None));
            }
            (Format::Human, resume) => {
                textln!("ENDED EARLY, without a result: {signal}; runs that are done: {runs}");
                match resume {
                    Some(command) => outln!("resume: {command}"),
                    None => textln!("nothing was kept: only a campaign with a folder (--out DIR) can be resumed"),
                }
            }
        }
        session::received().map_or(ExitCode::Interrupted, ExitCode::from)
    }

    /// Reduces the case that a search has found to the smallest one, and writes it as a scenario into
    /// the folder. An event without a collision is not reduced.
    fn minimize(
        &self,
        report: &RareReport,
        work: &Work,
        manifest: &Manifest,
        event: EventExpression,
    ) -> Result<(), CliError> {
        let Some(nearest) = report.nearest.first() else { return Ok(()) };
        let Some(case) = case(work, nearest, event) else { return Ok(()) };
        let Some(minimized) = minimize(&case)? else { return Ok(()) };
        let minimized = with_choice(manifest, minimized);
        let Some(folder) = self.folder else {
            if self.format == Format::Human {
                textln!("  smallest case: {}", minimized.sentence);
                textln!("  --out DIR keeps it as a scenario file");
            }
            return Ok(());
        };
        let file = folder.join(format!("{}-found.toml", work.file.config().name));
        let paths = output_files(&case, Some(&file))?;
        let files = write_files(&case, &minimized, &paths, command_for)?;
        match self.format {
            Format::Human => {
                let text = MinimizedText { minimized: &minimized, files: &files, command_for };
                print_text(format_args!("{text}\n"));
            }
            Format::Json => {}
        }
        [Some(&files.failing), files.twin.as_ref()].into_iter().flatten().for_each(|path| print_written(path));
        Ok(())
    }
}

/// Returns true for the event that a collision gate bounds.
fn is_collision(event: EventExpression) -> bool {
    matches!(event.first.quantity, Quantity::Tested(measure) if measure.name == EGO_COLLIDED) && event.second.is_none()
}

/// What the runs of a rare event come to.
#[derive(Clone, Copy)]
pub(super) struct Results<'a> {
    /// The event.
    pub(super) event: EventExpression,
    /// The report on each scenario.
    pub(super) reports: &'a [RareReport],
    /// The scenarios.
    pub(super) works: &'a [Arc<Work>],
    /// What changed of the controllers while they ran, in words.
    pub(super) changes: &'a [String],
}

/// A report with the gate that judges it.
struct Judged {
    report: RareReport,
    gate: Option<ProbabilityGate>,
    /// Whether a controller changed while it ran.
    has_changed: bool,
}

impl Judged {
    /// Returns the exit code.
    fn code(&self) -> ExitCode {
        let report = &self.report;
        if report.errors > 0 {
            return ExitCode::SampleError;
        }
        if self.has_changed {
            return ExitCode::Invalid;
        }
        if let Some(search) = report.search {
            return match search.has_event {
                true => ExitCode::Fail,
                // An event that cannot happen, or that hardly any run looked for, is not found either.
                false if !report.not_judged.is_empty() || report.runs < LEAST_SAMPLES => ExitCode::Inconclusive,
                false => ExitCode::Pass,
            };
        }
        match (&self.gate, report.main()) {
            (Some(_), _) => match self.is_low() {
                Some(true) if report.not_judged.is_empty() => ExitCode::Pass,
                Some(false) => ExitCode::Fail,
                Some(true) | None => ExitCode::Inconclusive,
            },
            (None, Some(_)) => ExitCode::Pass,
            (None, None) => ExitCode::Inconclusive,
        }
    }

    /// Returns whether the probability is as low as allowed; `None` if the interval does not say
    /// it, or there is no gate.
    fn is_low(&self) -> Option<bool> {
        let report = &self.report;
        let gate = self.gate.filter(|_| report.errors == 0)?;
        let Some(estimate) = report.main() else {
            // The bound without an event has 95 % confidence.
            let bound = report.upper_bound_without_event.filter(|_| gate.confidence() <= 0.95)?;
            return (bound <= gate.max()).then_some(true);
        };
        let (low, high) = (estimate.mean.lower_bound(gate.confidence())?, report.upper_bound(gate.confidence())?);
        if high <= gate.max() { Some(true) } else { (low >= gate.max()).then_some(false) }
    }

    /// Returns the verdict; `None` without a gate.
    fn word(&self) -> Option<&'static str> {
        self.gate?;
        Some(match self.is_low() {
            _ if self.report.errors > 0 => "ERROR",
            _ if self.has_changed => "INVALID",
            Some(true) if !self.report.not_judged.is_empty() => "NOT JUDGED",
            Some(true) => "PASS",
            Some(false) => "FAIL",
            None => "INCONCLUSIVE",
        })
    }
}

/// Returns the results for programs.
fn json_of(judged: &[Judged], seed: Option<u64>, remarks: &[String]) -> Value {
    let reports: Vec<&RareReport> = judged.iter().map(|judged| &judged.report).collect();
    let mut gates = judged.iter().filter_map(|judged| judged.gate);
    let verdicts = gates.next().map(|first| {
        // The gates of scenario files may differ.
        let common = Some(first).filter(|first| gates.all(|gate| gate == *first));
        let words: Vec<Option<&str>> = judged.iter().map(Judged::word).collect();
        let (max, confidence) = (common.map(|gate| gate.max()), common.map(|gate| gate.confidence()));
        json!({ "max_probability": max, "confidence": confidence, "verdicts": words })
    });
    stamped(json!({ "scenarios": reports, "gate": verdicts, "remarks": remarks }), seed, None)
}

fn print(judged: &[Judged], works: &[Arc<Work>], sensors: Option<SensorMode>) {
    for (judged, work) in judged.iter().zip(works) {
        let report = &judged.report;
        print_text(report);
        if let (Some(gate), Some(verdict)) = (judged.gate, judged.word()) {
            let (max, confidence) = (gate.max(), percent(gate.confidence()));
            if let Some(bound) = report.upper_bound(gate.confidence()).filter(|_| report.is_doubtful()) {
                textln!(
                    "  judged by an upper bound that holds for any weights, because the estimate is doubtful: {bound:.3e}"
                );
            }
            textln!("  {verdict}: {max:.3e} allowed, {confidence} confidence");
        }
        // No command line repeats a run of a controller from outside, of standard input, or of a
        // member of an ensemble.
        let is_named = work.file.path().is_file() || work.file.path() == library::path(&work.file.config().name);
        let can_repeat = is_named && work.arms.iter().all(|arm| arm.controller.is_built_in());
        for nearest in report.nearest.iter().filter(|_| can_repeat) {
            let distance_sd = nearest.distance_sd;
            let command = replay(work, nearest, sensors);
            print_error(format_args!(
                "look: {command}  # {distance_sd:.2} standard deviations from the nominal case\n"
            ));
        }
    }
}

/// Returns the case in which vehicles collide in one arm, and for an event of both arms in the other
/// one not. `None` of an event that is no collision.
fn case(work: &Work, nearest: &Nearest, event: EventExpression) -> Option<Case> {
    let happened = event.events().zip(nearest.events).find(|(_, happened)| *happened)?.0;
    let (first, last) = (work.arms.first()?, work.arms.last()?);
    let (arm, reference) = match happened.quantity {
        Quantity::Pair(PairFlag::Induced) => (last, Some(first)),
        Quantity::Pair(PairFlag::Prevented) => (first, Some(last)),
        Quantity::Tested(measure) if measure.name == EGO_COLLIDED => (last, None),
        Quantity::Baseline(measure) if measure.name == EGO_COLLIDED => (first, None),
        _ => return None,
    };
    Some(Case {
        file: work.file.clone(),
        sampling: work.sampling,
        sample: nearest.noise,
        arm: arm.clone(),
        parameters: Some(nearest.parameters.clone()),
        reference: reference.cloned(),
    })
}

/// Returns the command that runs an event again.
fn replay(work: &Work, nearest: &Nearest, sensors: Option<SensorMode>) -> String {
    let arms: Vec<&str> = work.arms.iter().map(|arm| arm.controller.name()).collect();
    let arms = match &arms[..] {
        [arm] => format!("--controller {}", quoted(arm)),
        several => format!("--arms {}", quoted(&several.join(","))),
    };
    let sensors = sensors.map_or_else(String::new, |mode| format!(" --sensors {}", mode.name()));
    // What a setting has replaced, such as a fitted distribution, is not named.
    let all = work.file.settings();
    let is_left = |(index, set): &(usize, &Setting)| !all[index + 1..].iter().any(|later| later.undoes(set));
    let left = all.iter().enumerate().filter(is_left);
    let settings: String = left.map(|(_, set)| format!(" --set {}", quoted(&set.to_string()))).collect();
    let varying = work.file.space().varying().filter_map(|(name, _)| {
        let value = nearest.parameters.get(name)?;
        Some(format!(" --set {}", quoted(&format!("{name}={value}"))))
    });
    let name = &work.file.config().name;
    let is_of_library = work.file.path() == library::path(name);
    let path = if is_of_library { name.clone() } else { work.file.path().display().to_string() };
    let (seed, noise) = (work.sampling.seed, nearest.noise);
    let varying: String = varying.collect();
    format!("closecall run {} {arms}{sensors} --seed {seed} --sample {noise}{settings}{varying}", quoted(&path))
}

/// Refuses an event that no sample of these arms can show.
fn check_event(event: EventExpression, work: &Work, has_gate: bool) -> Result<(), CliError> {
    if event.needs_pairs() && work.arms.len() < 2 {
        return Err(CliError::usage(format!(
            "--event `{event}` compares with a baseline: it needs --paired or --arms"
        )));
    }
    if event.second.is_some() && has_gate {
        return Err(CliError::usage(format!(
            "--max-probability bounds the probability of one event, and `{event}` is a difference of two"
        )));
    }
    if has_gate && event.first.quantity.is_of_baseline() {
        return Err(CliError::usage(format!(
            "--max-probability judges the controller under test, and `{event}` is an event of the baseline alone"
        )));
    }
    for quantity in event.events().map(|event| event.quantity) {
        let Some((measure, in_baseline)) = quantity.measure() else { continue };
        let arm = if in_baseline { work.arms.first() } else { work.arms.last() };
        if measure.is_reported() && arm.is_some_and(|arm| !arm.controller.is_built_in()) {
            return Err(CliError::usage(format!(
                "--event `{quantity}`: a controller from outside reports it of itself: name a measured value, such as slowed_for_rear"
            )));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_design_is_named_as_on_the_command_line() {
        for word in ["random", "sobol", "grid", "coverage", "subset", "importance", "search"] {
            assert_eq!(word.parse::<DesignChoice>().unwrap().to_string(), word);
        }
        let error = "halton".parse::<DesignChoice>().unwrap_err();
        assert_eq!(
            error,
            "`halton` is not a sampling design: one of `random`, `sobol`, `grid`, `coverage`, `subset`, `importance`, `search` is needed"
        );
    }
}
