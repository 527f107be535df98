//! `closecall traffic sample`: samples a recorded lane change by a parameter of a driver.

use std::path::{Path, PathBuf};

use clap::Args;
use closecall_recorded::encounter::{Lead, RecordedEncounter, Wanted};
use closecall_report::json::stamped;
use closecall_report::run::rerun::write_recording;
use closecall_report::traffic::reproduction::{StepZeroError, step_zero};
use closecall_report::traffic::sampling::{Sampled, StepError, run_step};
use closecall_scenarios::{ScenarioError, ScenarioFile, StepValue, Variation, sampled};
use closecall_simulation::calibration::value_of;
use closecall_traffic::atomic::write_file;

use super::CliError;
use super::args::{Format, ReadArgs, SetArgs};
use super::help::{examples, heading};
use super::output::{during, made_by, outln, print_text, print_written, write_charts};
use super::protect::{files_of_trajectories, must_be_folder, protect};
use super::reenact::chosen_by;
use crate::exit_code::ExitCode;

/// Arguments of `closecall traffic sample`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall traffic sample traffic.csv --vary cc1 --to 0.3",
    "closecall traffic sample traffic.csv --lane-change 3 --vary cc1 --from 1.5 --to 0.3 -o sampled",
    "closecall traffic sample traffic.csv --vary cc1 --from 1.5 --to 0.3 --transfer -o sampled",
]))]
pub(super) struct SampleArgs {
    /// Trajectory file
    #[arg(value_name = "TRAJECTORY_FILE")]
    file: PathBuf,
    #[command(flatten)]
    read: ReadArgs,
    /// Track whose lane change is sampled [default: the track of the most critical lane change that
    /// can be re-enacted]
    #[arg(long, value_name = "TRACK", help_heading = heading::DATA)]
    lane_change: Option<u64>,
    /// Number of the lane change among the track's lane changes, in order of time, from 1 on [default: the most critical one]
    #[arg(long, value_name = "NUMBER", requires = "lane_change", help_heading = heading::DATA)]
    number: Option<usize>,
    /// Parameter that varies: one of the Wiedemann 99 driver that changes lanes (`cc1`), or a path of keys in the scenario
    #[arg(long, value_name = "PARAMETER", help_heading = heading::METHOD)]
    vary: String,
    /// First value of the parameter [default: the calibrated value of step 0]
    #[arg(long, value_name = "NUMBER", allow_negative_numbers = true, help_heading = heading::METHOD)]
    from: Option<f64>,
    /// Last value of the parameter
    #[arg(long, value_name = "NUMBER", allow_negative_numbers = true, help_heading = heading::METHOD)]
    to: f64,
    /// Number of values, in equal steps: 2 to 100
    #[arg(long, default_value_t = 5, help_heading = heading::METHOD)]
    steps: usize,
    /// Seed of the random numbers
    #[arg(long, default_value_t = 0, value_parser = closecall_campaign::arguments::seed, help_heading = heading::METHOD)]
    seed: u64,
    #[command(flatten)]
    set: SetArgs,
    /// Folder for `sample.svg`, `sample.rrd` (a Rerun file) and the scenario of each step,
    /// `step-0.toml` and so on
    #[arg(short, long = "out", alias = "output", value_name = "DIR", help_heading = heading::OUTPUT)]
    output: Option<PathBuf>,
    /// Also write each step as an encounter with the margin increase system, `transferred-0.toml`
    /// and so on: the vehicle that changes lanes becomes the rear vehicle, the vehicle that it
    /// overtakes the ego, and the next one the lead vehicle
    #[arg(long, requires = "output", help_heading = heading::OUTPUT)]
    transfer: bool,
    /// Output format
    #[arg(long, value_enum, default_value_t, help_heading = heading::OUTPUT)]
    format: Format,
}

pub(super) fn sample(args: &SampleArgs) -> Result<ExitCode, CliError> {
    let usage = |message| CliError::Usage { message };
    let key = Variation::key_of(&args.vary).map_err(usage)?;
    let variation = |from| Variation::new(&args.vary, [from, args.to], args.steps).map_err(usage);
    // A wrong value is refused before the file is read.
    args.from.map(variation).transpose()?;
    let path = |name: &str| args.output.as_ref().map(|folder| folder.join(name));
    let (svg, rrd) = (path("sample.svg"), path("sample.rrd"));
    let files = files_of_trajectories(std::slice::from_ref(&args.file));
    protect(&files, &[("--out", svg.as_deref()), ("--out", rrd.as_deref())])?;
    must_be_folder(args.output.as_deref())?;
    // The margin increase system needs a lead vehicle; a driver that is sampled does not.
    let lead = if args.transfer { Lead::Required } else { Lead::LeftOut };
    let wanted = Wanted { track: args.lane_change, number: args.number, lead };
    let zero_of = |encounter: RecordedEncounter| {
        let source = format!("{} (track {})", args.file.display(), encounter.change.track_id);
        let zero = step_zero(&encounter, (Path::new(&source), &args.set.settings), args.seed);
        let zero = zero.map_err(|error| match error {
            StepZeroError::Step(error) => step_error(error, 0),
            not_reproduced @ StepZeroError::NotReproduced(_) => {
                CliError::NotReproduced { file: args.file.display().to_string(), source: Box::new(not_reproduced) }
            }
        })?;
        Ok((source, zero))
    };
    let chosen = chosen_by(&args.file, &args.read, wanted, zero_of)??;
    let code = chosen.code();
    let (source, zero) = chosen.value;
    let encounter = zero.encounter.clone();
    let inputs = (Path::new(&source), &args.set.settings[..]);
    let last_key = key.rsplit('.').next().unwrap_or_default();
    // Only a parameter of the vehicle that changes lanes is calibrated.
    let is_calibrated = Variation::key_of(last_key).is_ok_and(|own| own == key);
    let from = args.from.or_else(|| value_of(&zero.driver, last_key).filter(|_| is_calibrated));
    let variation = variation(from.ok_or_else(|| {
        usage(format!("--from is missing: `{}` has no calibrated value from which the steps start", args.vary))
    })?)?;
    let mut all = Sampled::new(&encounter, zero.recorded, zero.run.run, zero.reproduction, zero.step.lane_change_s[1]);
    let mut films: Vec<_> = zero.run.film.into_iter().collect();
    let mut files: Vec<(String, ScenarioFile)> = Vec::new();
    let mut steps = vec![zero.step];
    let scenario_of = |value: StepValue<'_>| {
        let made = sampled(&encounter, (&zero.driver, Some(value)), inputs);
        made.map_err(|error| value_error(&args.vary, value, error))
    };
    // The last value is checked first: the message names it as the user wrote it, not one between.
    variation.steps().last().map(scenario_of).transpose()?;
    for (number, value) in (1..).zip(variation.steps()) {
        let step = scenario_of(value)?;
        let work = format!("running step {number} of {}", args.steps);
        let done = during(work, || run_step(&encounter, value.label(), Some(value.value), &step, args.seed));
        let done = done.map_err(|error| step_error(error, number))?;
        films.extend(done.film);
        all.runs.push(done.run);
        steps.push(step);
    }
    for (number, (step, run)) in steps.into_iter().zip(&all.runs[1..]).enumerate() {
        if let Some(cut_out_thw_s) = run.thw_opp1_at_crossing_s.filter(|_| args.transfer) {
            let transferred = step.transferred(&encounter, cut_out_thw_s, Path::new(&source))?;
            files.push((format!("transferred-{number}.toml"), transferred));
        }
        files.push((format!("step-{number}.toml"), step.file));
    }
    if let (Some(folder), Some(svg), Some(rrd)) = (&args.output, svg, rrd) {
        write_charts(folder, &[svg], &[all.figure()?])?;
        write_recording(&rrd, &films)?;
        print_written(&rrd);
        for (name, file) in &files {
            let path = folder.join(name);
            write_file(&path, |written| written.write_all(made_by(&args.file, file).as_bytes()))?;
            print_written(&path);
        }
    }
    match args.format {
        Format::Json => outln!("{:#}", stamped(all.json(), Some(args.seed), None)),
        Format::Human => print_text(&all),
    }
    Ok(code)
}

/// Returns the error of a value that the parameter cannot have. The user has written no file that the
/// message could name.
fn value_error(parameter: &str, StepValue { value, .. }: StepValue<'_>, error: ScenarioError) -> CliError {
    match error {
        ScenarioError::Value { source, .. } => {
            CliError::VariedValue { parameter: parameter.to_owned(), value, reason: source.to_string() }
        }
        other => other.into(),
    }
}

/// Returns the error of a step.
fn step_error(error: StepError, number: u64) -> CliError {
    match error {
        StepError::Scenario(source) => CliError::Scenario(source),
        StepError::Film(source) => CliError::TrafficFilm(source),
        StepError::Run(source) => CliError::Sample { sample: number, source },
    }
}
