//! `closecall reenact`: a recorded encounter once more, with the controller under test in E's place.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use closecall_scenarios::criticality::{CriticalLaneChange, criticality};
use closecall_scenarios::encounter::{NoEncounter, RecordedEncounter, encounter};
use closecall_scenarios::filters::smooth;
use closecall_scenarios::lane_change::LaneChange;
use closecall_scenarios::recordings::read_with;
use serde_json::json;

use super::args::{ArmArgs, Format, ReadArgs, SetArgs};
use super::output::outln;
use super::recording::refuse_overwriting;
use super::watch::{WatchArgs, by_severity, run_filmed};
use super::{CliError, json};
use crate::exit_code::ExitCode;
use closecall_report::run::film::{Comparison, Film, film_encounter};
use closecall_report::run::rerun::record_films;
use closecall_scenarios::atomic::write_file;
use closecall_simulation::outcome::Outcome;
use closecall_simulation::scenario::{RearDriver, ScenarioFile, reenact as scenario_of};
use closecall_simulation::{CONTROL_STEP, RunKey};

/// E, F and R: whose speeds are plotted.
const PROTAGONISTS: usize = 3;

/// Who drives R.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Rear {
    /// A human driver who reacts to E, follows as closely as was recorded, and pulls out at the recorded headway
    #[default]
    Driver,
    /// The recorded speeds and the recorded lane change, whatever E does
    Recorded,
}

impl From<Rear> for RearDriver {
    fn from(rear: Rear) -> Self {
        match rear {
            Rear::Driver => Self::Driver,
            Rear::Recorded => Self::Recorded,
        }
    }
}

/// Arguments of `closecall reenact`.
#[derive(Debug, Args)]
pub(super) struct ReenactArgs {
    /// Recording
    recording: PathBuf,
    #[command(flatten)]
    read: ReadArgs,
    /// The track that changes lanes, R; the most critical one that can be re-enacted where absent
    #[arg(long, value_name = "ID")]
    track: Option<u64>,
    /// Who drives R
    #[arg(long, value_enum, default_value_t)]
    rear: Rear,
    /// Seed of the random numbers
    #[arg(long, default_value_t = 0)]
    seed: u64,
    #[command(flatten)]
    arm: ArmArgs,
    #[command(flatten)]
    set: SetArgs,
    #[command(flatten)]
    watch: WatchArgs,
    /// Write the scenario, to run and to vary it
    #[arg(short, long, value_name = "FILE.toml")]
    output: Option<PathBuf>,
    /// Output for people or for programs
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

pub(super) fn reenact(args: &ReenactArgs) -> Result<ExitCode, CliError> {
    refuse_overwriting(std::slice::from_ref(&args.recording), args.output.as_deref())?;
    let recording = smooth(&read_with(&args.recording, args.read.options())?);
    let changes = criticality(&recording, None);
    let all: Vec<LaneChange> = changes.iter().map(|change| change.lane_change.clone()).collect();
    let found = choose(args, &changes, |change| encounter(&recording, change, &all, CONTROL_STEP))?;
    let source = format!("{} (track {})", args.recording.display(), found.change.track_id);
    let file = scenario_of(&found, args.rear.into(), (Path::new(&source), &args.set.settings))?;
    let scenario = file.concrete(&file.space().nominal())?;
    let key = RunKey { seed: args.seed, sample: 0 };
    let (outcome, simulated) = run_filmed(&scenario, key, &args.arm.arm()?, &args.watch)?;
    let recorded = film_encounter(&found, args.watch.record_level.into())?;
    let comparison = Comparison::new(&found, &recorded, &simulated);
    let foreword = comparison.markdown(&found, &simulated, args.rear.into());
    let films = [recorded.with_foreword(foreword), simulated].map(|film| film.plotting_first(PROTAGONISTS));
    if let Some(path) = &args.watch.record {
        record_films(path, &films)?;
    }
    if let Some(path) = &args.output {
        write_file(path, |written| written.write_all(text_of(&file, args).as_bytes()))?;
    }
    print(args.format, &found, (&comparison, &films, &outcome));
    Ok(ExitCode::Pass)
}

/// The encounter of the track that is named, or the most critical one.
fn choose(
    args: &ReenactArgs,
    changes: &[CriticalLaneChange],
    encounter_of: impl Fn(&LaneChange) -> Result<RecordedEncounter, NoEncounter>,
) -> Result<RecordedEncounter, CliError> {
    let file = args.recording.display();
    let mut refused = None;
    for change in by_severity(changes, args.track) {
        match encounter_of(&change.lane_change) {
            Ok(found) => return Ok(found),
            Err(source) => refused = refused.or(Some(source)),
        }
    }
    let Some(source) = refused else {
        let whose = args.track.map_or(String::new(), |track| format!(" of track {track}"));
        return Err(CliError::Usage { message: format!("{file} has no lane change{whose}: nothing to re-enact") });
    };
    let possible = args.track.map_or(Vec::new(), |_| {
        let tracks = changes.iter().filter(|change| encounter_of(&change.lane_change).is_ok());
        tracks.map(|change| change.lane_change.track_id).collect()
    });
    Err(CliError::NoEncounter { file: file.to_string(), source, possible })
}

/// The scenario with a heading that says where it comes from.
fn text_of(file: &ScenarioFile, args: &ReenactArgs) -> String {
    let command = std::iter::once("closecall".to_owned()).chain(std::env::args().skip(1)).collect::<Vec<_>>().join(" ");
    format!("# Made by `{command}`\n# from {}\n{}", args.recording.display(), file.text())
}

fn print(format: Format, found: &RecordedEncounter, (comparison, films, outcome): (&Comparison, &[Film; 2], &Outcome)) {
    let [ego, front, rear] = found.protagonists().map(|track| track.track_id);
    match format {
        Format::Json => {
            let object = json!({
                "recording": found.recording,
                "track_id": rear,
                "ego_track_id": ego,
                "front_track_id": front,
                "start_s": found.start.s(),
                "recorded": json::course(&comparison.recorded),
                "simulated": json::course(&comparison.simulated),
                "outcome": json::outcome(outcome),
            });
            outln!("{object:#}");
        }
        Format::Human => {
            outln!("{}: track {rear} (R) changes lanes behind {ego} (E) behind {front} (F)", found.recording);
            outln!("from {:.1} s of the recording on, everyone where and as fast as recorded", found.start.s());
            outln!("  {:<32} {:>16} {:>16}", "", films[0].arm(), films[1].arm());
            for (name, [recorded, simulated]) in comparison.rows() {
                outln!("  {name:<32} {recorded:>16} {simulated:>16}");
            }
            let simulated = &films[1];
            outln!("{}: {}", simulated.arm(), simulated.headline());
            if let Some(verdict) = simulated.verdict_on_mis() {
                outln!("{}: {verdict}", simulated.arm());
            }
        }
    }
}
