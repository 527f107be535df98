//! `closecall run`: one sample of a scenario.

use std::path::PathBuf;

use clap::Args;
use closecall_scenarios::sampling::Design;
use closecall_traffic::Time;

use super::args::{ArmArgs, Format, SetArgs};
use super::output::{out, outln};
use super::{CliError, json};
use crate::campaign::runner::{Sampling, concrete, run_guarded};
use crate::exit_code::ExitCode;
use crate::outcome::Outcome;
use crate::report::rerun::RunRecorder;
use crate::report::trace::TraceWriter;
use crate::scenario::Scenario;
use crate::simulation::{Arm, Happening, Observer, RunKey, StepView};

/// Arguments of `closecall run`.
#[derive(Debug, Args)]
pub(super) struct RunArgs {
    /// Scenario file
    scenario: PathBuf,
    /// Seed of the random numbers
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Number of the sample
    #[arg(long, default_value_t = 0)]
    sample: u64,
    #[command(flatten)]
    arm: ArmArgs,
    #[command(flatten)]
    set: SetArgs,
    #[command(flatten)]
    watch: WatchArgs,
    /// Output for people or for programs
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

/// What to write of a run.
#[derive(Clone, Debug, Default, Args)]
pub(super) struct WatchArgs {
    /// Write a Rerun file to look at
    #[arg(long, value_name = "FILE.rrd")]
    pub(super) record: Option<PathBuf>,
    /// Write one row per control step and actor
    #[arg(long, value_name = "FILE.csv|FILE.parquet", value_parser = table)]
    pub(super) trace: Option<PathBuf>,
}

/// A path whose ending says how a table is written.
fn table(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("csv" | "parquet") => Ok(path),
        _ => Err(format!("`{text}` ends neither with .csv nor with .parquet")),
    }
}

pub(super) fn run(args: &RunArgs) -> Result<ExitCode, CliError> {
    let file = args.set.load(&args.scenario)?;
    let sampling = Sampling { seed: args.seed, design: Design::Random, samples: args.sample.saturating_add(1) };
    let fail = |source| CliError::Sample { sample: args.sample, source };
    let scenario = concrete(&file, sampling, args.sample).map_err(fail)?;
    let key = RunKey { seed: args.seed, sample: args.sample };
    let outcome = run_watched(&scenario, key, &args.arm.arm()?, &args.watch)?;
    print(&outcome, args.format);
    Ok(ExitCode::Pass)
}

/// Runs a sample and writes what is asked for.
pub(super) fn run_watched(scenario: &Scenario, key: RunKey, arm: &Arm, watch: &WatchArgs) -> Result<Outcome, CliError> {
    let mut watchers = Watchers::new(scenario, key, arm, watch)?;
    let outcome = run_guarded(scenario, key, arm, &mut watchers)
        .map_err(|source| CliError::Sample { sample: key.sample, source })?;
    watchers.finish(&outcome)?;
    Ok(outcome)
}

/// Everyone who watches a run from the command line.
struct Watchers {
    recorder: Option<RunRecorder>,
    trace: Option<TraceWriter>,
}

impl Watchers {
    fn new(scenario: &Scenario, key: RunKey, arm: &Arm, watch: &WatchArgs) -> Result<Self, CliError> {
        if watch.record.is_some() && watch.record == watch.trace {
            return Err(CliError::Usage { message: "--record and --trace name the same file".to_owned() });
        }
        let title =
            format!("{} · {} · seed {} · sample {}", scenario.name, arm.controller.name(), key.seed, key.sample);
        let recorder = |path: &PathBuf| RunRecorder::new(path, scenario, &title);
        let trace = |path: &PathBuf| TraceWriter::new(path);
        Ok(Self {
            recorder: watch.record.as_ref().map(recorder).transpose()?,
            trace: watch.trace.as_ref().map(trace).transpose()?,
        })
    }

    fn finish(self, outcome: &Outcome) -> Result<(), CliError> {
        if let Some(recorder) = self.recorder {
            recorder.finish(outcome)?;
        }
        if let Some(trace) = self.trace {
            trace.finish()?;
        }
        Ok(())
    }
}

impl Observer for Watchers {
    fn step(&mut self, view: &StepView<'_>) {
        if let Some(recorder) = &mut self.recorder {
            recorder.step(view);
        }
        if let Some(trace) = &mut self.trace {
            trace.step(view);
        }
    }

    fn happening(&mut self, time: Time, what: &Happening) {
        if let Some(recorder) = &mut self.recorder {
            recorder.happening(time, what);
        }
        if let Some(trace) = &mut self.trace {
            trace.happening(time, what);
        }
    }
}

/// Prints an outcome.
pub(super) fn print(outcome: &Outcome, format: Format) {
    match format {
        Format::Json => outln!("{:#}", json::outcome(outcome)),
        Format::Human => out!("{}", Human(outcome)),
    }
}

/// An outcome for people.
struct Human<'a>(&'a Outcome);

impl std::fmt::Display for Human<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let outcome = self.0;
        writeln!(
            f,
            "{} · {} · seed {} · sample {} · ended at {} ({})",
            outcome.scenario,
            outcome.controller,
            outcome.seed,
            outcome.sample,
            outcome.duration,
            serde_json::to_string(&outcome.end).unwrap_or_default().trim_matches('"'),
        )?;
        for (name, value) in outcome.parameters.iter() {
            writeln!(f, "  {name} = {value}")?;
        }
        for noted in &outcome.moments {
            writeln!(f, "  ({}) {} at {:.2} s", noted.moment.letter(), noted.moment.text(), noted.time.s())?;
        }
        for collision in &outcome.collisions {
            let [first, second] = &collision.between;
            writeln!(
                f,
                "  COLLISION at {:.2} s of {first} and {second} at {:.1} m/s, ΔV {:.1} and {:.1} m/s",
                collision.time.s(),
                collision.relative_speed_mps,
                collision.delta_v_mps[0],
                collision.delta_v_mps[1],
            )?;
        }
        if outcome.collisions.is_empty() {
            writeln!(f, "  no collision")?;
        }
        let line = |name: &str, value: closecall_traffic::Measured, unit: &str| match value {
            Ok(value) => format!("  {name}: {value:.2} {unit}\n"),
            Err(absent) => format!("  {name}: none, {absent}\n"),
        };
        f.write_str(&line("smallest front time headway", outcome.margins.min_thw_front_s, "s"))?;
        f.write_str(&line("smallest rear time headway", outcome.margins.min_thw_rear_s, "s"))?;
        f.write_str(&line("largest deceleration", Ok(outcome.margins.max_deceleration_mps2), "m/s²"))?;
        match &outcome.mis {
            Ok(mis) => {
                f.write_str(&line("MIS engaged at", mis.engaged_at_s, "s"))?;
                f.write_str(&line("  front time headway then", mis.thw_front_at_engagement_s, "s"))?;
                f.write_str(&line("  front time headway in the critical moment", mis.thw_front_at_critical_s, "s"))?;
                writeln!(f, "  MIS: {}", mis.reason)
            }
            Err(absent) => writeln!(f, "  MIS: {absent}"),
        }
    }
}
