//! `closecall traffic sample`: samples a recorded lane change by a parameter of a driver.

use std::path::{Path, PathBuf};

use clap::Args;
use closecall_recorded::encounter::{Lead, Wanted};
use closecall_report::json::stamped;
use closecall_report::run::rerun::write_recording;
use closecall_report::traffic::sampling::{Sampled, SampledRun, StepError, run_step};
use closecall_scenarios::{ScenarioFile, Variation, sampled};
use closecall_traffic::atomic::write_file;

use super::CliError;
use super::args::{Format, ReadArgs, SetArgs};
use super::help::{examples, heading};
use super::output::{made_by, out, outln, print_written, write_charts};
use super::protect::{of_trajectories, protect};
use super::reenact::chosen;
use crate::exit_code::ExitCode;

/// Arguments of `closecall traffic sample`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall traffic sample traffic.csv --vary cc1 --from 1.5 --to 0.3",
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
    /// Number of the lane change among those of the track, in order of time, from 1 on [default: the most critical one]
    #[arg(long, value_name = "NUMBER", requires = "lane_change", help_heading = heading::DATA)]
    number: Option<usize>,
    /// Parameter that varies: one of the Wiedemann 99 driver that changes lanes (`cc1`), or a path of keys in the scenario
    #[arg(long, value_name = "PARAMETER", help_heading = heading::METHOD)]
    vary: String,
    /// Its first value
    #[arg(long, value_name = "NUMBER", allow_negative_numbers = true, help_heading = heading::METHOD)]
    from: f64,
    /// Its last value
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
    /// `step-1.toml` and so on
    #[arg(short, long = "out", alias = "output", value_name = "DIR", help_heading = heading::OUTPUT)]
    output: Option<PathBuf>,
    /// Also write each step as an encounter with the margin increase system, `transferred-1.toml`
    /// and so on: the vehicle that changes lanes becomes the rear vehicle, the vehicle that it
    /// overtakes the ego, and the next one the lead vehicle
    #[arg(long, requires = "output", help_heading = heading::OUTPUT)]
    transfer: bool,
    /// Output format
    #[arg(long, value_enum, default_value_t, help_heading = heading::OUTPUT)]
    format: Format,
}

pub(super) fn sample(args: &SampleArgs) -> Result<ExitCode, CliError> {
    let variation = Variation::new(&args.vary, [args.from, args.to], args.steps);
    let variation = variation.map_err(|message| CliError::Usage { message })?;
    let path = |name: &str| args.output.as_ref().map(|folder| folder.join(name));
    let (svg, rrd) = (path("sample.svg"), path("sample.rrd"));
    let inputs = of_trajectories(std::slice::from_ref(&args.file));
    protect(&inputs, &[("--out", svg.as_deref()), ("--out", rrd.as_deref())])?;
    // The margin increase system needs a lead vehicle; a driver that is sampled does not.
    let lead = if args.transfer { Lead::Required } else { Lead::LeftOut };
    let wanted = Wanted { track: args.lane_change, number: args.number, lead };
    let found = chosen(&args.file, &args.read, wanted)?;
    let source = format!("{} (track {})", args.file.display(), found.change.track_id);
    let mut all = Sampled::new(&found);
    let (mut films, mut files): (Vec<_>, Vec<(String, ScenarioFile)>) = (Vec::new(), Vec::new());
    for (number, value) in variation.steps().enumerate() {
        let step = sampled(&found, value, (Path::new(&source), &args.set.settings))?;
        if number == 0 {
            all.runs.push(SampledRun::recorded(&found, &step));
        }
        let done = run_step(&found, value, &step, args.seed).map_err(|error| match error {
            StepError::Scenario(source) => CliError::Scenario(source),
            StepError::Film(source) => CliError::TrafficFilm(source),
            StepError::Run(source) => CliError::Sample { sample: number as u64, source },
        })?;
        films.extend(done.film);
        if let Some(cut_out_thw_s) = done.run.thw_opp1_at_crossing_s.filter(|_| args.transfer) {
            let transferred = step.transferred(&found, cut_out_thw_s, Path::new(&source))?;
            files.push((format!("transferred-{}.toml", number + 1), transferred));
        }
        files.push((format!("step-{}.toml", number + 1), step.file));
        all.runs.push(done.run);
    }
    if let (Some(folder), Some(svg), Some(rrd)) = (&args.output, svg, rrd) {
        write_charts(folder, &[svg], &[all.figure()?])?;
        write_recording(&rrd, &films)?;
        print_written(&rrd);
        for (name, file) in &files {
            write_file(&folder.join(name), |written| written.write_all(made_by(&args.file, file).as_bytes()))?;
        }
    }
    match args.format {
        Format::Json => outln!("{:#}", stamped(all.json(), Some(args.seed), None)),
        Format::Human => out!("{all}"),
    }
    Ok(ExitCode::Pass)
}
