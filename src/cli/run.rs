//! `closecall run`: runs one sample of a scenario.

use std::path::PathBuf;

use clap::Args;
use closecall_campaign::runner::{Sampling, concrete};
use closecall_scenarios::sampling::Design;
use closecall_simulation::RunKey;
use closecall_simulation::outcome::Outcome;
use closecall_simulation::scenario::Setting;

use super::args::{ArmArgs, Format, SetArgs};
use super::output::{out, outln};
use super::protect::{of_scenario, protect};
use super::watch::{WatchArgs, run_watched};
use super::{CliError, json};
use crate::exit_code::ExitCode;

/// Arguments of `closecall run`.
#[derive(Debug, Args)]
pub(super) struct RunArgs {
    /// Scenario file, name of a scenario of the library, or `-` for standard input
    scenario: PathBuf,
    /// Seed of the random numbers
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Number of the sample
    #[arg(long, default_value_t = 0)]
    sample: u64,
    #[command(flatten)]
    arm: ArmArgs,
    /// Also run the sample with the baseline controller `acc`, on the same random numbers; --record saves both runs in
    /// one file
    #[arg(long)]
    paired: bool,
    #[command(flatten)]
    set: SetArgs,
    #[command(flatten)]
    watch: WatchArgs,
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

pub(super) fn run(args: &RunArgs) -> Result<ExitCode, CliError> {
    let file = args.set.load(&args.scenario)?;
    protect(&[of_scenario(&file), args.arm.files()].concat(), &args.watch.outputs())?;
    let sampling = Sampling { seed: args.seed, design: Design::Random, samples: args.sample.saturating_add(1) };
    let fail = |source| CliError::Sample { sample: args.sample, source };
    let scenario = concrete(&file, sampling, args.sample).map_err(fail)?;
    let key = RunKey { seed: args.seed, sample: args.sample };
    let outcomes = run_watched(&scenario, key, &args.arm.arms(args.paired)?, &args.watch)?;
    print(&outcomes, args.format, Some(&args.set.settings));
    Ok(ExitCode::Pass)
}

/// Prints the outcome of a run, or a list of the outcomes of a pair, the baseline first. `settings` are those of the
/// command line, if it can have any.
pub(super) fn print(outcomes: &[Outcome], format: Format, settings: Option<&[Setting]>) {
    match (format, outcomes) {
        (Format::Json, [outcome]) => outln!("{:#}", json::stamped(json::outcome(outcome), None, settings)),
        (Format::Json, outcomes) => {
            let both: Vec<_> = outcomes.iter().map(json::outcome).collect();
            outln!("{:#}", json::stamped(serde_json::Value::Array(both), None, settings));
        }
        (Format::Human, outcomes) => {
            for outcome in outcomes {
                out!("{}", Human(outcome));
            }
        }
    }
}

/// Prints an outcome as text for human readers.
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
        for at in &outcome.moments {
            writeln!(f, "  {} at {:.2} s", at.moment.label(), at.time.s())?;
        }
        for collision in &outcome.collisions {
            let [first, second] = &collision.between;
            writeln!(
                f,
                "  COLLISION of {first} and {second} at {:.2} s, relative speed {:.1} m/s, ΔV {:.1} and {:.1} m/s",
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
                f.write_str(&line("  front time headway at the critical moment", mis.thw_front_at_critical_s, "s"))?;
                writeln!(f, "  MIS: {}", mis.reason)
            }
            Err(absent) => writeln!(f, "  MIS: {absent}"),
        }
    }
}
