//! `closecall traffic chain`: from recordings to a verdict on each of their most relevant
//! encounters.
//!
//! ```text
//!  files ─▶ flaws ─▶ lane changes ─▶ metrics ─▶ approaches ─▶ the most relevant ─▶ logical scenarios ─▶ campaign ─▶ report
//! ```
//!
//! The folder is a campaign's folder, and all commands for campaigns work on it. It also holds:
//!
//! | file | content |
//! |---|---|
//! | `scenarios/NAME.toml` | the logical scenario of each encounter |
//! | `encounters/NAME.svg`, `encounters/NAME.rrd` | the recorded lane change, as a picture and for the Rerun viewer |
//! | `origins.json` | the recorded seconds of each scenario, how it was chosen, and why the system does not engage |

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use clap::Args;
use closecall_campaign::arguments::{count, whole};
use closecall_campaign::earlier_failures::EarlierFailures;
use closecall_campaign::folder::Folder;
use closecall_campaign::plan::Plan;
use closecall_campaign::runner::Sampling;
use closecall_campaign::saved::SavedCampaign;
use closecall_campaign::selection::Selection;
use closecall_campaign::summary::Summary;
use closecall_campaign::workers::Workers;
use closecall_recorded::criticality::{Judgement, criticality};
use closecall_recorded::encounter::{Approach, Relevant, Variation, approach, most_relevant};
use closecall_recorded::filters::{SmoothedFile, SmoothedTrajectoryData};
use closecall_recorded::fit::{Quantity, Samples, observe};
use closecall_report::campaign::origins::{Origin, OriginFile, Origins, OriginsText};
use closecall_report::run::figure::still;
use closecall_report::run::film::{Part, film_lane_change};
use closecall_report::run::rerun::{is_recording_enabled, write_recording};
use closecall_scenarios::sampling::Design;
use closecall_scenarios::{Function, ScenarioError, ScenarioFile, Spreads, logical};
use closecall_simulation::controller::ControllerChoice;
use closecall_studies::engagement::engagements;
use closecall_traffic::atomic::{create_folder, write_file};
use closecall_traffic::words::counted;
use serde_json::{Value, json};

use super::CliError;
use super::args::{FilesArgs, Format, SensorsChoice, smooth_noting};
use super::arms::ControllerArgs;
use super::campaign::{Companion, Planned, carry_out};
use super::ending::EndArgs;
use super::gates::GateArgs;
use super::help::{examples, heading};
use super::output::{made_by, print_error, warn};
use super::protect::{files_of_trajectories, must_be_folder, protect};
use super::results::{ArtifactArgs, ResultsArgs};
use crate::exit_code::ExitCode;

/// Folder of the scenarios, in the folder of the campaign.
const SCENARIOS: &str = "scenarios";
/// Folder of the recorded encounters, in the folder of the campaign.
const ENCOUNTERS: &str = "encounters";
/// Number of samples of each encounter that are recorded, the worst ones. The worst sample of each
/// kind is recorded, too.
const RECORDED: u64 = 1;

/// Arguments of `closecall traffic chain`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall traffic chain traffic.csv -o chain",
    "closecall traffic chain one.csv two.csv -o both -n 200 --seed 7",
    "closecall traffic chain traffic.csv -o twenty --encounters 20 --gate 'upper(induced) <= 0.05'",
]))]
pub(super) struct ChainArgs {
    #[command(flatten)]
    data: FilesArgs,
    /// Folder for the results: scenarios, recorded encounters, and all that a campaign keeps. It
    /// must be new or empty
    #[arg(short, long, value_name = "DIR", help_heading = heading::OUTPUT)]
    out: PathBuf,
    /// Resume the interrupted campaign in the folder of --out
    #[arg(long, help_heading = heading::EXECUTION)]
    resume: bool,
    /// Largest number of encounters: the most relevant ones, critical before others, and each as
    /// different as possible from the rest
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = whole::<u16, 1, 1_000>, help_heading = heading::METHOD)]
    encounters: u16,
    /// Number of samples of each encounter
    #[arg(short = 'n', long = "samples", default_value_t = 100, value_parser = count, help_heading = heading::SAMPLES)]
    samples: u64,
    /// Seed of the random numbers
    #[arg(long, default_value_t = 0, value_parser = closecall_campaign::arguments::seed, help_heading = heading::SAMPLES)]
    seed: u64,
    #[command(flatten)]
    controller: ControllerArgs,
    /// Depth of the sensor simulation
    #[arg(long, value_enum, default_value = "full", help_heading = heading::CONTROLLER)]
    sensors: SensorsChoice,
    /// Number of worker threads [default: one per processor]
    #[arg(long, value_parser = whole::<u16, 1, 1024>, help_heading = heading::EXECUTION)]
    jobs: Option<u16>,
    /// Save recordings (Rerun files) of selected samples of each encounter, as `campaign` does
    /// [default: worst:1,each-kind]
    #[arg(long, value_name = "KIND:N,…", help_heading = heading::OUTPUT)]
    record: Option<Selection>,
    #[command(flatten)]
    artifacts: ArtifactArgs,
    #[command(flatten)]
    end: EndArgs,
    #[command(flatten)]
    gates: GateArgs,
    /// Output format
    #[arg(long, value_enum, default_value_t, help_heading = heading::OUTPUT)]
    format: Format,
}

/// A recording, with its approaches and further data that the chain needs.
struct Recording {
    path: PathBuf,
    data: SmoothedTrajectoryData,
    origin: OriginFile,
    samples: Samples,
    approaches: Vec<Approach>,
    /// The reasons why lane changes are no approaches, each with the number of lane changes.
    refused: BTreeMap<String, usize>,
}

/// The encounters of a chain with their scenarios.
struct Chain {
    recordings: Vec<Recording>,
    origins: Origins,
    /// For each encounter the index of its recording, its approach and its scenario.
    encounters: Vec<(usize, Approach, ScenarioFile)>,
}

pub(super) fn chain(args: &ChainArgs) -> Result<ExitCode, CliError> {
    let inputs = files_of_trajectories(&args.data.files);
    protect(&inputs, &[("--out", Some(&args.out))])?;
    must_be_folder(Some(&args.out))?;
    let controllers = match args.controller.choice(Function::Mis)? {
        ControllerChoice::ACC => {
            return Err(CliError::usage(
                "every sample also runs with `acc`: name another controller with --controller",
            ));
        }
        tested => vec![ControllerChoice::ACC, tested],
    };
    let gates = args.gates.or_measure()?.gates(true, Design::Random, None)?;
    let smoothed = smooth_noting(&args.data)?;
    let is_in_doubt = smoothed.iter().any(|file| file.is_in_doubt);
    let recordings: Vec<Recording> =
        args.data.files.iter().zip(smoothed).map(|(path, file)| Recording::new(path, file)).collect();
    let mut chain = Chain::new(recordings, usize::from(args.encounters), &args.out)?;
    if chain.encounters.is_empty() {
        print_error(format_args!("{}", chain.nothing_found()));
        return Ok(ExitCode::Inconclusive);
    }
    let files = chain.encounters.iter().map(|(_, _, file)| file.clone()).collect();
    let sampling = Sampling { seed: args.seed, design: Design::Random, samples: args.samples };
    let mut plan = Plan::new(files, sampling, controllers)?;
    plan.use_sensors(Some(args.sensors.mode()))?;
    plan.workers = Workers::with_jobs(args.jobs);
    let recorded = match is_recording_enabled() {
        true => Selection { worst: RECORDED, each_kind: true, ..Selection::default() },
        false => Selection::default(),
    };
    let planned = Planned {
        plan: &plan,
        gates: &gates,
        results: &ResultsArgs::named(&args.out, args.resume),
        artifacts: args.artifacts,
        end: args.end,
        record: Some(args.record.unwrap_or(recorded)),
        ray: None,
        until_certain: false,
        time_budget: None,
        first: EarlierFailures::default(),
        can_draw_seed: false,
    };
    let code = carry_out(&planned, &mut chain, &mut |conclusion| conclusion.print(args.format))?;
    if is_in_doubt && code == ExitCode::Pass {
        warn("a trajectory file is in doubt, so that its encounters may not have happened as the scenarios say");
        return Ok(ExitCode::Inconclusive);
    }
    Ok(code)
}

impl Recording {
    fn new(path: &Path, file: SmoothedFile) -> Self {
        let SmoothedFile { data: smoothed, flaws: counts, hash, .. } = file;
        let changes = criticality(&smoothed, &Judgement::default());
        let (mut approaches, mut refused) = (Vec::new(), BTreeMap::new());
        for change in &changes {
            match approach(&smoothed, change) {
                Ok(approach) => approaches.push(approach),
                Err(reason) => *refused.entry(reason.to_string()).or_default() += 1,
            }
        }
        let is_critical = |change: &&closecall_recorded::criticality::CriticalLaneChange| {
            change.metrics.named().iter().any(|(_, metric)| metric.is_critical())
        };
        let flaws = [
            ("gaps", counts.gaps),
            ("jumps", counts.jumps),
            ("overlaps", counts.overlaps),
            ("impossible accelerations", counts.accelerations),
            ("reused numbers", counts.reused_numbers),
        ];
        let flaws = flaws.into_iter().filter(|(_, count)| *count > 0);
        let origin = OriginFile {
            path: path.display().to_string(),
            blake3: hash,
            tracks: counts.tracks,
            flaws: flaws.map(|(name, count)| (name.to_owned(), count)).collect(),
            lane_changes: changes.len(),
            critical: changes.iter().filter(is_critical).count(),
        };
        let samples = observe(&smoothed);
        Self { path: path.to_owned(), data: smoothed, origin, samples, approaches, refused }
    }
}

impl Chain {
    /// Chooses at most `count` encounters, and makes the scenario of each.
    fn new(recordings: Vec<Recording>, count: usize, out: &Path) -> Result<Self, CliError> {
        let all: Vec<(usize, &Approach)> = recordings
            .iter()
            .enumerate()
            .flat_map(|(index, recording)| recording.approaches.iter().map(move |approach| (index, approach)))
            .collect();
        let approaches: Vec<Approach> = all.iter().map(|(_, approach)| (*approach).clone()).collect();
        let spreads = spreads(&recordings, &approaches);
        let mut origins = Origins {
            files: recordings.iter().map(|recording| recording.origin.clone()).collect(),
            approaches: approaches.len(),
            choice: CHOICE.to_owned(),
            ..Origins::default()
        };
        for (reason, number) in recordings.iter().flat_map(|recording| &recording.refused) {
            *origins.refused.entry(reason.clone()).or_default() += number;
        }
        let mut encounters = Vec::new();
        for chosen in most_relevant(&approaches, approaches.len()) {
            if encounters.len() == count {
                break;
            }
            let (index, approach) = (all[chosen.index].0, approaches[chosen.index].clone());
            let names = encounters.iter().map(|(_, _, file): &(usize, Approach, ScenarioFile)| &file.config().name);
            let name = distinct(name_of(&approach), names);
            let path = out.join(SCENARIOS).join(format!("{name}.toml"));
            let file = match logical(&approach, &spreads, &name, &path) {
                Ok(file) => file,
                // A vehicle or a road that no scenario can have: the next encounter takes its
                // place.
                Err(ScenarioError::Value { source, .. }) => {
                    *origins.refused.entry(format!("no scenario can have its values: {source}")).or_default() += 1;
                    continue;
                }
                Err(error) => return Err(error.into()),
            };
            origins.encounters.push(origin(&name, &recordings[index].path, &approach, chosen));
            encounters.push((index, approach, file));
        }
        Ok(Self { recordings, origins, encounters })
    }

    /// Returns why there is no encounter.
    fn nothing_found(&self) -> String {
        let files: Vec<String> = self
            .origins
            .files
            .iter()
            .map(|file| {
                format!(
                    "{}: {}, {}",
                    file.path,
                    counted(file.tracks, "track"),
                    counted(file.lane_changes, "lane change")
                )
            })
            .collect();
        let refused: Vec<String> =
            self.origins.refused.iter().map(|(reason, number)| format!("  {number}: {reason}\n")).collect();
        format!("no lane change overtakes a vehicle: nothing was run\n{}\n{}", files.join("\n"), refused.concat())
    }
}

/// How the encounters are chosen, for the report.
const CHOICE: &str = "Encounters that are critical by at least one metric of the published method precede the others. The first is the most \
                      critical one; each further one is the one that differs most from those before it in speed, closing speed, headway at the \
                      crossing and front headway.";

/// Returns the spread of all approaches.
fn spreads(recordings: &[Recording], approaches: &[Approach]) -> Spreads {
    let all =
        |quantity| recordings.iter().flat_map(|recording| recording.samples.values(quantity).iter().copied()).collect();
    let variation = |value: fn(&Approach) -> f64| Variation::of(&approaches.iter().map(value).collect::<Vec<f64>>());
    Spreads {
        source: recordings.iter().map(|recording| recording.data.name.as_str()).collect::<Vec<_>>().join(", "),
        ego_mps: variation(|approach| approach.values.ego_mps),
        closing_mps: variation(|approach| approach.values.closing_mps),
        front_headways_s: all(Quantity::FrontThw),
        durations_s: all(Quantity::LaneChangeDuration),
    }
}

/// Returns the name of an encounter: its recording, its track and the second of its crossing.
fn name_of(approach: &Approach) -> String {
    let is_kept = |letter: char| letter.is_ascii_lowercase() || letter.is_ascii_digit();
    let kept: String =
        approach.data_name.to_lowercase().chars().map(|letter| if is_kept(letter) { letter } else { '-' }).collect();
    let mut words: Vec<&str> = kept.split('-').filter(|word| !word.is_empty()).collect();
    // A name begins with a letter; highD's recordings are numbers.
    if !words.first().is_some_and(|word| word.starts_with(|first: char| first.is_ascii_lowercase())) {
        words.insert(0, "recording");
    }
    format!("{}-track-{}-at-{:.0}-s", words.join("-"), approach.rear.track_id, approach.to_s.max(0.0))
}

/// Returns the name, or the name with a number if it is taken.
fn distinct<'a>(name: String, taken: impl Iterator<Item = &'a String> + Clone) -> String {
    let is_taken = |name: &String| taken.clone().any(|other| other == name);
    let numbered = (2..).map(|number| format!("{name}-{number}"));
    std::iter::once(name.clone()).chain(numbered).find(|name| !is_taken(name)).unwrap_or_default()
}

/// Returns the recorded seconds and values of an encounter.
fn origin(name: &str, path: &Path, approach: &Approach, chosen: Relevant) -> Origin {
    let values = &approach.values;
    Origin {
        scenario: name.to_owned(),
        file: path.display().to_string(),
        rear_track: approach.rear.track_id,
        ego_track: approach.ego.track_id,
        lead_track: approach.lead.map(|lead| lead.track_id),
        from_s: approach.from_s,
        to_s: approach.to_s,
        ego_mps: values.ego_mps,
        closing_mps: values.closing_mps,
        crossing_thw_s: values.crossing_thw_s,
        front_thw_s: values.front_thw_s,
        critical: approach.critical_metrics().into_iter().map(str::to_owned).collect(),
        distance_sd: chosen.distance_sd,
        picture: None,
        recording: None,
        engagement: None,
    }
}

impl Companion for Chain {
    fn begin(&mut self, folder: &Folder) -> Result<(), CliError> {
        for path in [SCENARIOS, ENCOUNTERS].map(|name| folder.file(name)) {
            create_folder(&path)?;
        }
        for ((index, approach, file), origin) in self.encounters.iter().zip(&mut self.origins.encounters) {
            let (recording, name) = (&self.recordings[*index], &file.config().name);
            let text = made_by(&recording.path, file);
            write_file(&folder.file(&format!("{SCENARIOS}/{name}.toml")), |written| {
                written.write_all(text.as_bytes())
            })?;
            let film = [film_lane_change(&recording.data, &approach.change)?];
            if is_recording_enabled() {
                let path = format!("{ENCOUNTERS}/{name}.rrd");
                write_recording(&folder.file(&path), &film)?;
                origin.recording = Some(path);
            }
            let [film] = film;
            let lead = approach.lead.as_ref().map(|lead| (Part::Lead, lead.track_id));
            let others = [(Part::Ego, approach.ego.track_id), (Part::Rear, approach.rear.track_id)];
            let parts: Vec<_> = others.into_iter().chain(lead).collect();
            let drawn = still(&film.with_parts_of_tracks(&parts));
            let picture = format!("{ENCOUNTERS}/{name}.svg");
            write_file(&folder.file(&picture), |written| written.write_all(drawn.as_bytes()))?;
            origin.picture = Some(picture);
        }
        Ok(self.origins.write(folder)?)
    }

    fn end(&mut self, folder: &Folder) -> Result<(), CliError> {
        let mut engagements = engagements(&SavedCampaign::of(folder.clone())?)?;
        for origin in &mut self.origins.encounters {
            origin.engagement = engagements.remove(&origin.scenario);
        }
        Ok(self.origins.write(folder)?)
    }

    fn text(&self, summary: &Summary) -> String {
        OriginsText { origins: &self.origins, summary }.to_string()
    }

    fn json(&self) -> Option<(&'static str, Value)> {
        Some(("origins", json!(self.origins)))
    }

    /// A system that engages nowhere was not tested.
    fn code(&self, code: ExitCode) -> ExitCode {
        match self.origins.engagement() {
            Some(all) if all.engaged == 0 => ExitCode::first_of([code, ExitCode::Inconclusive]),
            _ => code,
        }
    }
}
