//! The commands of the program.

use std::path::PathBuf;

use clap::{CommandFactory, Parser, Subcommand};
use closecall_campaign::host;
use closecall_campaign::interrupt::watch;
use closecall_campaign::session::{Printed, Session, set_arguments};
use closecall_simulation::controller::exec::{adopt_orphans, end_all};

use super::backend::choose_backend;
use super::output::{announce, print_error};
use super::{
    CliError, baseline, calibrate, campaign, causes, check, compare, drift, generate, inspect, library, merge, new,
    paper, plot, record, reenact, render, replay, robustness, run, sample, schema, sensors, statistics, study,
    trajectories, view, watching,
};
use crate::exit_code::ExitCode;

/// A closed-loop software-in-the-loop testbed for highway ADAS.
///
/// Closecall finds critical encounters in recorded traffic, samples variations of them, runs each in a closed loop of
/// sensors, controller and world, and reports with numbers, pictures and an exit code whether the margin increase
/// system (MIS) prevents collisions or causes them.
#[derive(Debug, Parser)]
#[command(name = "closecall", version, after_help = EXIT_CODES)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Shared library of ONNX Runtime (1.24 or later), to run the rear camera's network on it instead of the built-in
    /// backend tract. It is loaded only if the network is used
    #[arg(long, global = true, value_name = "PATH", env = "ORT_DYLIB_PATH")]
    onnxruntime: Option<PathBuf>,
}

const EXIT_CODES: &str = "\
Exit codes:
  0  pass
  1  fail: a gate is not met, for example more collisions than allowed
  2  the command line is wrong
  3  a scenario, trajectory file or network cannot be used; nothing was run
  4  inconclusive: there are too few samples for the requested bound
  5  at least one sample ended in an error
  6  a file or folder cannot be read or written
  7  invalid: a validity check of the simulator failed
  130  ended by Ctrl-C (SIGINT)
  143  ended by SIGTERM";

#[derive(Debug, Subcommand)]
#[expect(clippy::large_enum_variant, reason = "there is one command, for as long as the program runs")]
enum Command {
    /// Write a commented scenario to start from
    New(new::NewArgs),
    /// Write the files of a repository of scenarios, with CI jobs for GitHub and GitLab. No file is overwritten
    Init(new::InitArgs),
    /// List the scenarios of the library with their questions, requirements and gates
    List(library::ListArgs),
    /// Check a scenario at every change of its file, and run a few samples of it
    Watch(watching::WatchingArgs),
    /// Run one sample of a scenario
    Run(run::RunArgs),
    /// Run many samples of one or more scenarios, and judge the result by gates
    Campaign(campaign::CampaignArgs),
    /// Find the assumption that moves the result of a scenario most
    Sensitivity(study::SensitivityArgs),
    /// Compare settings of a system: what each prevents, induces, and costs in speed
    Frontier(study::FrontierArgs),
    /// Merge the parts of a campaign that ran on several machines, and judge the result
    Merge(merge::MergeArgs),
    /// Compare a campaign with an earlier one, sample by sample
    Compare(compare::CompareArgs),
    /// Keep the results of a campaign in a small file, and compare later campaigns with it
    Baseline(baseline::BaselineArgs),
    /// Run one sample of a campaign again, and check that it gives the same bits
    Replay(replay::ReplayArgs),
    /// Find the stage of the chain whose perfection prevents a failure of a campaign, and what the system did
    Explain(causes::ExplainArgs),
    /// Find the smallest failing case near a failing sample of a campaign, and the nearest case that passes
    Minimize(causes::MinimizeArgs),
    /// Map the margin that the system reaches, over approach speed, detection distance and front time headway
    Map(causes::MapArgs),
    /// Count how often the encounter happens in trajectory files, and state the net effect of the system per 10^6 km
    Exposure(causes::ExposureArgs),
    /// Study the rear sensors without a controller: detection, errors, classes and consistency over distance and conditions
    Sensors(sensors::SensorsArgs),
    /// Check scenario files without running them
    Check(check::CheckArgs),
    /// Print the JSON Schema of scenario files
    Schema,
    /// Report the flaws of a trajectory file: gaps, jumps, overlaps, and rows that cannot be used
    Inspect(inspect::InspectArgs),
    /// Find the lane changes in a trajectory file
    LaneChanges(trajectories::LaneChangesArgs),
    /// Compute how critical each lane change of a trajectory file is
    Criticality(trajectories::CriticalityArgs),
    /// Simulate an encounter of recorded traffic with the controller under test in the ego vehicle, and compare the two
    Reenact(reenact::ReenactArgs),
    /// Sample a recorded lane change: the other vehicles drive as recorded, a parameter of a driver varies
    Sample(sample::SampleArgs),
    /// Fit the distributions of a logical scenario to trajectory files
    Fit(trajectories::FitArgs),
    /// Check whether new trajectory files still match the distributions that a scenario was fitted to
    Drift(drift::DriftArgs),
    /// Compute durations, speeds, counts and correlations of recorded lane changes
    Statistics(statistics::StatisticsArgs),
    /// Calibrate a car-following model on recorded pairs, and judge it on pairs that were held out
    Calibrate(calibrate::CalibrateArgs),
    /// Study how much noise and offset the criteria for lane changes tolerate
    Robustness(robustness::RobustnessArgs),
    /// Draw the figures of the published method on any set of trajectory files, with one page of all
    Paper(paper::PaperArgs),
    /// Simulate samples of a scenario, and write their traffic as a trajectory file
    Record(record::RecordArgs),
    /// Draw an encounter as a static figure, SVG or PNG
    Plot(plot::PlotArgs),
    /// Show recordings in the browser, with the web build of an installed Rerun viewer
    View(view::ViewArgs),
    /// Render labelled images of the rear camera, or of an aerial one
    Render(render::RenderArgs),
    /// Run samples with a library or an FMU, for another process of this program
    #[command(hide = true)]
    Host { arguments: Vec<String> },
    /// Print a script that completes commands and options in a shell
    Completions(generate::CompletionsArgs),
    /// Print the manual page, or write one for each command
    Man(generate::ManArgs),
}

/// Runs the program with these arguments, of which the first is the program's name.
pub fn main(arguments: &[std::ffi::OsString]) -> ExitCode {
    set_arguments(arguments);
    // Messages name their causes themselves. Lines are not wrapped, so that paths can be copied.
    let handler = |_: &_| -> Box<dyn miette::ReportHandler> {
        Box::new(miette::MietteHandlerOpts::new().without_cause_chain().wrap_lines(false).build())
    };
    // If a hook is already set, the program that uses this crate as a library has set it: it stays.
    drop(miette::set_hook(Box::new(handler)));
    let cli = match Cli::try_parse_from(arguments) {
        Ok(cli) => cli,
        Err(error) => {
            // Help and version are not errors: clap prints them to standard output.
            let code = if error.use_stderr() { ExitCode::Usage } else { ExitCode::Pass };
            return if error.print().is_ok() { code } else { ExitCode::Io };
        }
    };
    adopt_orphans();
    watch(announce, |signal| std::process::exit(ExitCode::from(signal) as i32));
    choose_backend(cli.onnxruntime.as_deref());
    let result = dispatch(cli.command);
    end_all();
    match result {
        Ok(code) => code,
        Err(error) => {
            let code = ExitCode::from(&error);
            print_error(format_args!("{:?}\n", miette::Report::new(error)));
            code
        }
    }
}

/// Runs a command that another program calls, and returns the exit code of the command line and what it has printed. The first
/// of the arguments is the program's name.
pub fn call(session: &Session, arguments: &[std::ffi::OsString]) -> (Result<ExitCode, CliError>, Printed) {
    session.run(arguments, || {
        let cli = Cli::try_parse_from(arguments).map_err(|error| CliError::refused(&error.to_string()))?;
        choose_backend(cli.onnxruntime.as_deref());
        dispatch(cli.command)
    })
}

fn dispatch(command: Command) -> Result<ExitCode, CliError> {
    match command {
        Command::New(args) => new::new(&args),
        Command::Init(args) => new::init(&args),
        Command::List(args) => library::list(&args),
        Command::Watch(args) => watching::watch(&args),
        Command::Run(args) => run::run(&args),
        Command::Campaign(args) => campaign::campaign(&args),
        Command::Sensitivity(args) => study::sensitivity(&args),
        Command::Frontier(args) => study::frontier(&args),
        Command::Merge(args) => merge::merge(&args),
        Command::Compare(args) => compare::compare(&args),
        Command::Baseline(args) => baseline::baseline(&args),
        Command::Replay(args) => replay::replay(&args),
        Command::Explain(args) => causes::explain(&args),
        Command::Minimize(args) => causes::minimize(&args),
        Command::Map(args) => causes::map(&args),
        Command::Exposure(args) => causes::exposure(&args),
        Command::Sensors(args) => sensors::sensors(&args),
        Command::Check(args) => check::check(&args),
        Command::Schema => Ok(schema::schema()),
        Command::Inspect(args) => inspect::inspect(&args),
        Command::LaneChanges(args) => trajectories::lane_changes(&args),
        Command::Criticality(args) => trajectories::criticality(&args),
        Command::Reenact(args) => reenact::reenact(&args),
        Command::Sample(args) => sample::sample(&args),
        Command::Fit(args) => trajectories::fit(&args),
        Command::Drift(args) => drift::drift(&args),
        Command::Statistics(args) => statistics::statistics(&args),
        Command::Calibrate(args) => calibrate::calibrate(&args),
        Command::Robustness(args) => robustness::robustness(&args),
        Command::Paper(args) => paper::paper(&args),
        Command::Record(args) => record::record(&args),
        Command::Plot(args) => plot::plot(&args),
        Command::View(args) => view::view(&args),
        Command::Render(args) => render::render(&args),
        Command::Host { arguments } => Ok(host::serve(&arguments).map_or_else(
            |message| {
                print_error(format_args!("{message}\n"));
                ExitCode::SampleError
            },
            |()| ExitCode::Pass,
        )),
        Command::Completions(args) => generate::completions(&args, Cli::command()),
        Command::Man(args) => generate::man(&args, Cli::command()),
    }
}
