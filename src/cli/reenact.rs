//! `closecall traffic reenact`: simulates a recorded encounter with the controller under test in
//! the ego vehicle.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use closecall_recorded::encounter::{ChoiceError, Lead, RecordedEncounter, Wanted, choose_first};
use closecall_recorded::filters::smooth;
use closecall_report::json::stamped;
use closecall_report::run::film::{EncounterComparison, film_encounter};
use closecall_report::run::rerun::write_recording;
use closecall_report::traffic::reenactment::Reenactment;
use closecall_scenarios::causal::LETTERS;
use closecall_scenarios::{RearDriver, reenact as scenario_of};
use closecall_simulation::{CONTROL_STEP, RunKey};
use closecall_traffic::atomic::write_file;
use closecall_traffic::words::counted;

use super::CliError;
use super::args::{Format, ReadArgs, SimulationArgs, read_noting};
use super::error::MAX_SUGGESTED;
use super::help::{examples, heading};
use super::output::{made_by, outln, print_text, print_written, textln};
use super::protect::{files_of_trajectories, must_be_writable, protect};
use super::watch::{WatchArgs, run_filmed};
use crate::exit_code::ExitCode;

/// Number of vehicles whose speeds are plotted: the ego, the lead vehicle and the rear vehicle.
const PROTAGONISTS: usize = 3;

/// The driver of the rear vehicle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum RearChoice {
    /// A model of a human driver: it reacts to the ego, follows as closely as recorded, and pulls
    /// out at the recorded headway
    #[default]
    Driver,
    /// The recorded speeds and the recorded lane change, whatever the ego does
    Recorded,
}

impl From<RearChoice> for RearDriver {
    fn from(rear: RearChoice) -> Self {
        match rear {
            RearChoice::Driver => Self::Model,
            RearChoice::Recorded => Self::Recorded,
        }
    }
}

/// Arguments of `closecall traffic reenact`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall traffic reenact traffic.csv",
    "closecall traffic reenact traffic.csv --track 3 --record beside.rrd",
    "closecall traffic reenact traffic.csv --rear recorded --controller acc -o encounter.toml",
]))]
pub(super) struct ReenactArgs {
    /// Trajectory file
    #[arg(value_name = "TRAJECTORY_FILE")]
    file: PathBuf,
    #[command(flatten)]
    read: ReadArgs,
    /// Track of the rear vehicle, which changes lanes [default: the most critical lane change that
    /// can be re-enacted]
    #[arg(long, value_name = "ID", help_heading = heading::DATA)]
    track: Option<u64>,
    /// The driver of the rear vehicle
    #[arg(long, value_enum, default_value_t, help_heading = heading::METHOD)]
    rear: RearChoice,
    #[command(flatten)]
    sim: SimulationArgs,
    #[command(flatten)]
    watch: WatchArgs,
    /// Save the scenario of the encounter, for further runs and variations
    #[arg(short, long = "out", alias = "output", value_name = "FILE.toml", help_heading = heading::OUTPUT)]
    output: Option<PathBuf>,
    /// Output format
    #[arg(long, value_enum, default_value_t, help_heading = heading::OUTPUT)]
    format: Format,
}

pub(super) fn reenact(args: &ReenactArgs) -> Result<ExitCode, CliError> {
    let inputs = [files_of_trajectories(std::slice::from_ref(&args.file)), args.sim.arm.files()].concat();
    let outputs = [&[("--out", args.output.as_deref())], args.watch.outputs().as_slice()].concat();
    protect(&inputs, &outputs)?;
    must_be_writable(args.output.as_deref())?;
    let wanted = Wanted { track: args.track, number: None, lead: Lead::Required };
    let chosen = chosen_by(&args.file, &args.read, wanted, Ok)??;
    let (code, encounter) = (chosen.code(), chosen.value);
    let source = format!("{} (track {})", args.file.display(), encounter.change.track_id);
    let file = scenario_of(&encounter, args.rear.into(), Path::new(&source), &args.sim.set.settings)?;
    let scenario = file.concrete(&file.space().nominal())?;
    let key = RunKey { seed: args.sim.seed, sample: 0 };
    let (outcome, simulated) = run_filmed(&scenario, key, &args.sim.arm.arm(file.config().function)?, &args.watch)?;
    let recorded = film_encounter(&encounter, args.watch.record_level.into())?;
    let comparison = EncounterComparison::new(&encounter, &recorded, &simulated);
    let foreword = comparison.markdown(&encounter, &simulated, args.rear.into());
    let films = [recorded.with_foreword(foreword), simulated].map(|film| film.with_plots_of_first(PROTAGONISTS));
    if let Some(path) = &args.watch.record {
        write_recording(path, &films)?;
    }
    args.watch.print_files();
    if let Some(path) = &args.output {
        write_file(path, |written| written.write_all(made_by(&args.file, &file).as_bytes()))?;
        print_written(path);
    }
    let reenactment = Reenactment { encounter: &encounter, comparison: &comparison, films: &films, outcome: &outcome };
    match args.format {
        Format::Json => outln!("{:#}", stamped(reenactment.json(), Some(outcome.seed), None)),
        Format::Human => {
            print_text(reenactment);
            textln!("{LETTERS}");
        }
    }
    Ok(code)
}

/// Returns the message for a track without a lane change, or for a file without one. `track` holds whether the file has the
/// track at all.
fn no_lane_change(file: &str, track: Option<(u64, bool)>, others: &[u64]) -> String {
    let Some((track, is_recorded)) = track else { return format!("{file} has no lane change") };
    let unknown = if is_recorded { "" } else { ", which it does not hold" };
    let named: Vec<String> = others.iter().take(MAX_SUGGESTED).map(u64::to_string).collect();
    let which = match others.len() {
        0 => "no track changes lanes".to_owned(),
        count if count > MAX_SUGGESTED => format!("{count} tracks change lanes, such as {}", named.join(", ")),
        _ => format!("the tracks that change lanes are {}", named.join(", ")),
    };
    format!("{file} has no lane change of track {track}{unknown}; {which}")
}

/// Returns the error for a track without a lane change, or for a file without one: the command line is
/// wrong only if it could name another track.
pub(super) fn lacks_lane_change(file: &str, track: Option<(u64, bool)>, others: &[u64]) -> CliError {
    let message = no_lane_change(file, track, others);
    if track.is_some() && !others.is_empty() { CliError::usage(message) } else { CliError::NothingFound { message } }
}

/// What is made of an encounter of a trajectory file.
pub(super) struct Chosen<T> {
    pub(super) value: T,
    /// Whether a warning says why lane changes of the file may be wrong.
    is_in_doubt: bool,
}

impl<T> Chosen<T> {
    /// Returns the exit code.
    pub(super) fn code(&self) -> ExitCode {
        if self.is_in_doubt { ExitCode::Inconclusive } else { ExitCode::Pass }
    }
}

/// Returns what `accept` makes of the encounter of the named track of a trajectory file, or of the
/// most critical one that it accepts.
pub(super) fn chosen_by<T>(
    path: &Path,
    read: &ReadArgs,
    wanted: Wanted,
    accept: impl Fn(RecordedEncounter) -> Result<T, CliError>,
) -> Result<Result<Chosen<T>, CliError>, CliError> {
    let data = read_noting(path, read.options())?;
    let is_in_doubt = data.is_in_doubt;
    let accept = |encounter| accept(encounter).map(|value| Chosen { value, is_in_doubt });
    let encounter = choose_first(&smooth(&data), wanted, CONTROL_STEP, accept);
    let track = wanted.track;
    let file = path.display();
    encounter.map_err(|error| match error {
        ChoiceError::NoLaneChange { is_recorded, others } => {
            lacks_lane_change(&file.to_string(), track.map(|track| (track, is_recorded)), &others)
        }
        ChoiceError::NoSuchNumber { count } => {
            let of_track = track.map_or(String::new(), |track| format!(" of track {track}"));
            CliError::usage(format!(
                "{file} has {}{of_track}: --number can be 1 to {count}",
                counted(count, "lane change")
            ))
        }
        ChoiceError::NoEncounter { source, possible } => {
            CliError::NoEncounter { lead: wanted.lead, file: file.to_string(), source, possible }
        }
    })
}
