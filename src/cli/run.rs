//! `closecall run`: runs one sample of a scenario.

use std::path::PathBuf;

use clap::Args;
use closecall_campaign::runner::{Sampling, concrete};
use closecall_report::json;
use closecall_report::run::text::OutcomeText;
use closecall_scenarios::causal::{LETTERS, VehicleLetters, causal_sentence};
use closecall_scenarios::outcome::Outcome;
use closecall_scenarios::sampling::Design;
use closecall_scenarios::{Scenario, Setting};
use closecall_simulation::perception::try_program;
use closecall_simulation::{Arm, RunKey};

use super::CliError;
use super::args::{FittedArgs, Format, SimulationArgs};
use super::arms::ComparisonArgs;
use super::help::{examples, heading};
use super::output::{outln, print_text, textln};
use super::protect::{files_of_scenario, protect};
use super::watch::{WatchArgs, run_watched};
use crate::exit_code::ExitCode;

/// Arguments of `closecall run`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall run low-thw-overtake",
    "closecall run low-thw-overtake --sample 7 --paired --record pair.rrd",
    "closecall run late-braking.toml --sensors object --set brake-mps2=6 --trace run.csv",
]))]
pub(super) struct RunArgs {
    /// Scenario file, name of a scenario of the library, or `-` for standard input
    scenario: PathBuf,
    /// Number of the sample
    #[arg(long, default_value_t = 0, help_heading = heading::SAMPLES)]
    sample: u64,
    #[command(flatten)]
    sim: SimulationArgs,
    #[command(flatten)]
    fitted: FittedArgs,
    #[command(flatten)]
    comparison: ComparisonArgs,
    #[command(flatten)]
    watch: WatchArgs,
    /// Output format
    #[arg(long, value_enum, default_value_t, help_heading = heading::OUTPUT)]
    format: Format,
}

pub(super) fn run(args: &RunArgs) -> Result<ExitCode, CliError> {
    let (set, of_arms) = args.sim.set.by_arm();
    let file = args.fitted.load(&args.scenario, &set)?;
    let fitted = args.fitted.fitted.iter().cloned().collect();
    protect(&[files_of_scenario(&file), args.comparison.files(&args.sim.arm), fitted].concat(), &args.watch.outputs())?;
    let sampling = Sampling { seed: args.sim.seed, design: Design::Random, samples: args.sample.saturating_add(1) };
    let fail = |source| CliError::Sample { sample: args.sample, source };
    let scenario = concrete(&file, sampling, args.sample).map_err(fail)?;
    let key = RunKey { seed: args.sim.seed, sample: args.sample };
    let arms = args.comparison.arms(&args.sim.arm, &file, &of_arms)?;
    for isolated in arms.iter().filter_map(|arm| arm.controller.isolated()) {
        isolated.check_variables(&scenario, None)?;
    }
    arms.iter().filter_map(|arm| arm.sensors).try_for_each(|mode| file.check_faults_in(mode))?;
    scenario.sensors.program().as_ref().map_or(Ok(()), try_program)?;
    let outcomes = run_watched(&scenario, key, &arms, &args.watch, file.settings())?;
    print(&scenario, &arms, &outcomes, args.format, file.settings());
    Ok(ExitCode::Pass)
}

/// Prints the outcome of a run, or a list of the outcomes of a pair, the baseline first. `settings`
/// are the settings of the command line.
pub(super) fn print(scenario: &Scenario, arms: &[Arm], outcomes: &[Outcome], format: Format, settings: &[Setting]) {
    let settings = Some(settings);
    match (format, outcomes) {
        (Format::Json, [outcome]) => outln!("{:#}", json::stamped(json::outcome(outcome), None, settings)),
        (Format::Json, outcomes) => {
            let both: Vec<_> = outcomes.iter().map(json::outcome).collect();
            outln!("{:#}", json::stamped(serde_json::Value::Array(both), None, settings));
        }
        (Format::Human, outcomes) => {
            let letters = VehicleLetters::of(scenario);
            for (outcome, arm) in outcomes.iter().zip(arms) {
                let sentence = causal_sentence(scenario, arm.sensors, arm.goal_s(scenario), outcome);
                print_text(OutcomeText { outcome, sentence: &sentence, letters: &letters });
            }
            textln!("{LETTERS}");
        }
    }
}
