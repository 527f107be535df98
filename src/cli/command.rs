//! The commands, and what each of them calls.

use std::path::PathBuf;

use clap::{Parser, Subcommand};
use closecall_sensors::camera::{Backend, Classifier};
use closecall_sensors::use_inference_backend;

use super::output::complain;
use super::{
    CliError, campaign, check, compare, inspect, merge, plot, record, recording, reenact, render, replay, robustness,
    run, statistics,
};
use crate::exit_code::ExitCode;

/// A closed-loop software-in-the-loop testbed for highway ADAS.
///
/// Closecall finds critical encounters in recorded traffic, samples variations of them, runs each in a closed loop of
/// sensors, controller and world, and says with numbers, pictures and an exit code whether the margin increase system
/// prevents collisions, or causes them.
#[derive(Debug, Parser)]
#[command(name = "closecall", version, after_help = EXIT_CODES)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Run the rear camera's network on ONNX Runtime (1.24 or later) from this shared library; on the built-in tract
    /// where absent
    #[arg(long, global = true, value_name = "PATH", env = "ORT_DYLIB_PATH")]
    onnxruntime: Option<PathBuf>,
}

const EXIT_CODES: &str = "\
Exit codes:
  0  pass
  1  fail: more collisions than allowed
  2  the command line is wrong
  3  a scenario or a recording cannot be used; nothing was run
  4  inconclusive: too few samples for the bound asked for
  5  some sample ended in an error
  6  a file or folder cannot be read or written
  7  invalid: a validity check of the simulator failed";

#[derive(Debug, Subcommand)]
enum Command {
    /// Run one sample of a scenario
    Run(run::RunArgs),
    /// Run many samples of scenarios, and judge them
    Campaign(campaign::CampaignArgs),
    /// Put the parts of a campaign together, and judge it
    Merge(merge::MergeArgs),
    /// Compare a campaign with an earlier one, sample by sample
    Compare(compare::CompareArgs),
    /// Run one sample of a campaign again, bit for bit
    Replay(replay::ReplayArgs),
    /// Check scenario files without running them
    Check(check::CheckArgs),
    /// Print the JSON Schema of scenario files
    Schema,
    /// Tell how far a recording can be trusted: gaps, jumps, overlaps, and rows that cannot be used
    Inspect(inspect::InspectArgs),
    /// Find lane changes in a recording
    LaneChanges(recording::LaneChangesArgs),
    /// Work out how critical each lane change of a recording was
    Criticality(recording::CriticalityArgs),
    /// Run a recorded encounter once more, with the controller under test in E's place, and compare the two
    Reenact(reenact::ReenactArgs),
    /// Fit the distributions of a logical scenario to recordings
    Fit(recording::FitArgs),
    /// Durations, speeds and counts of lane changes, and what they correlate with
    Statistics(statistics::StatisticsArgs),
    /// Study how much noise and offset the criteria for lane changes bear
    Robustness(robustness::RobustnessArgs),
    /// Record traffic of the testbed's own simulation
    Record(record::RecordArgs),
    /// Draw an encounter as a static figure, SVG or PNG
    Plot(plot::PlotArgs),
    /// Draw labelled pictures of the rear camera
    Render(render::RenderArgs),
}

/// Runs the program with the process's own arguments.
pub fn main() -> ExitCode {
    // Messages name their causes themselves; and a path is to be copied, not to be broken over two lines.
    let handler = |_: &_| -> Box<dyn miette::ReportHandler> {
        Box::new(miette::MietteHandlerOpts::new().without_cause_chain().wrap_lines(false).build())
    };
    // A hook that is set already belongs to whoever runs this as a library.
    drop(miette::set_hook(Box::new(handler)));
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => {
            // Help and version are no errors, and go where they are expected.
            let code = if error.use_stderr() { ExitCode::Usage } else { ExitCode::Pass };
            return if error.print().is_ok() { code } else { ExitCode::Io };
        }
    };
    match choose_backend(cli.onnxruntime).and_then(|()| dispatch(cli.command)) {
        Ok(code) => code,
        Err(error) => {
            let code = ExitCode::from(&error);
            complain(format_args!("{:?}\n", miette::Report::new(error)));
            code
        }
    }
}

/// Takes a named ONNX Runtime for the rear camera's network, and tries it before any work is done.
fn choose_backend(onnxruntime: Option<PathBuf>) -> Result<(), CliError> {
    let backend = Backend::choose(onnxruntime.as_deref(), None);
    if backend != Backend::Tract {
        Classifier::shipped(&backend)?;
    }
    use_inference_backend(backend);
    Ok(())
}

fn dispatch(command: Command) -> Result<ExitCode, CliError> {
    match command {
        Command::Run(args) => run::run(&args),
        Command::Campaign(args) => campaign::campaign(&args),
        Command::Merge(args) => merge::merge(&args),
        Command::Compare(args) => compare::compare(&args),
        Command::Replay(args) => replay::replay(&args),
        Command::Check(args) => check::check(&args),
        Command::Schema => check::schema(),
        Command::Inspect(args) => inspect::inspect(&args),
        Command::LaneChanges(args) => recording::lane_changes(&args),
        Command::Criticality(args) => recording::criticality(&args),
        Command::Reenact(args) => reenact::reenact(&args),
        Command::Fit(args) => recording::fit(&args),
        Command::Statistics(args) => statistics::statistics(&args),
        Command::Robustness(args) => robustness::robustness(&args),
        Command::Record(args) => record::record(&args),
        Command::Plot(args) => plot::plot(&args),
        Command::Render(args) => render::render(&args),
    }
}
