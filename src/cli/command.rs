//! The commands of the program.

use std::borrow::Cow;
use std::error::Error;
use std::num::{IntErrorKind, ParseFloatError, ParseIntError};
use std::path::PathBuf;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::parser::ValueSource;
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use closecall_campaign::host;
use closecall_campaign::interrupt::watch;
use closecall_campaign::session::set_arguments;
use closecall_controllers::external::remove_unpacked;
use closecall_simulation::controller::exec::{adopt_orphans, end_all, take_bad_ends};
use closecall_traffic::shown::shown;
use textwrap::{WordSeparator, WordSplitter};

use super::backend::choose_backend;
use super::groups::{Study, Tool, Traffic};
use super::help::heading;
use super::output::{announce, command_heartbeat, print_error, print_failure, warn};
use super::terminal::error_columns;
use super::version::{BUILD, name_commit};
use super::{CliError, baseline, campaign, causes, check, compare, library, new, plot, replay, run, view};
use crate::exit_code::ExitCode;

/// A closed-loop software-in-the-loop testbed for highway ADAS.
///
/// Closecall finds critical encounters in recorded traffic, samples variations of them, runs each
/// in a closed loop of sensors, controller and world, and reports with numbers, pictures and an
/// exit code whether the margin increase system (MIS) prevents collisions or causes them.
#[derive(Debug, Parser)]
#[command(name = "closecall", version, long_version = BUILD, after_help = AFTER_HELP)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

/// The commands that may run the network of a camera, each as the words that name it.
const WITH_NETWORK: [&[&str]; 20] = [
    &["run"],
    &["campaign"],
    &["compare"],
    &["replay"],
    &["explain"],
    &["minimize"],
    &["plot"],
    &["view"],
    &["check"],
    &["traffic", "aerial"],
    &["traffic", "chain"],
    &["traffic", "reenact"],
    &["traffic", "record"],
    &["study", "anchor"],
    &["study", "boundary"],
    &["study", "frontier"],
    &["study", "sensitivity"],
    &["study", "sensors"],
    &["tool", "export"],
    &["tool", "merge"],
];

/// The commands that run a network only with another option, each with this option.
const NETWORK_NEEDS: [(&str, &str); 2] = [("check", "watch"), ("compare", "search")];

/// The option for the shared library of ONNX Runtime.
const ONNXRUNTIME: &str = "onnxruntime";
/// The environment variable that names the same library.
pub(super) const ONNXRUNTIME_VARIABLE: &str = "ORT_DYLIB_PATH";

/// Adds the option for the shared library of ONNX Runtime to a command.
fn with_network(command: clap::Command, path: &[&'static str]) -> clap::Command {
    match path {
        [] => command.arg(
            clap::Arg::new(ONNXRUNTIME)
                .long(ONNXRUNTIME)
                .value_name("PATH")
                .value_parser(clap::value_parser!(PathBuf))
                .env(ONNXRUNTIME_VARIABLE)
                .help_heading(heading::EXECUTION)
                .help(
                    "Shared library of ONNX Runtime (1.24 or later), to run the camera's network on it instead of the \
                     built-in backend tract. It is loaded only if the network is used",
                ),
        ),
        [name, below @ ..] => command.mut_subcommand(name, |command| with_network(command, below)),
    }
}

/// Returns the shared library of ONNX Runtime that the arguments of a command name.
fn onnxruntime(matches: &clap::ArgMatches) -> Option<PathBuf> {
    match matches.subcommand() {
        Some((_, below)) => onnxruntime(below),
        None => matches.try_get_one::<PathBuf>(ONNXRUNTIME).ok().flatten().cloned(),
    }
}

/// Returns a message if the command line names the shared library of ONNX Runtime, but the command
/// runs no network. The environment variable applies to all commands, so it gets no message.
fn runs_no_network(matches: &clap::ArgMatches) -> Option<String> {
    let (command, below) = matches.subcommand()?;
    let (_, needed) = NETWORK_NEEDS.into_iter().find(|(name, _)| *name == command)?;
    let is_named = below.value_source(ONNXRUNTIME) == Some(ValueSource::CommandLine);
    (is_named && !below.get_flag(needed))
        .then(|| format!("--{ONNXRUNTIME} needs --{needed}: `closecall {command}` runs no network without it"))
}

/// The end of the program's help.
const AFTER_HELP: &str = "\
Exit codes:
  0  pass
  1  fail: a gate is not met, for example more collisions than allowed
  2  the command line is wrong
  3  a scenario, trajectory file or network cannot be used; nothing was run
  4  inconclusive: there are too few samples for the requested bound, or nothing was judged
  5  at least one sample ended in an error
  6  a file or folder cannot be read or written
  7  invalid: a validity check of the simulator failed
  130  ended by Ctrl-C (SIGINT)
  143  ended by SIGTERM

Terms such as ego, headway, prevented, induced: docs/reference/glossary.md

Examples:
  closecall run low-thw-overtake
  closecall campaign low-thw-overtake -n 1000 --paired
  closecall traffic lane-changes traffic.csv";

#[derive(Debug, Subcommand)]
#[expect(clippy::large_enum_variant, reason = "there is one command, for as long as the program runs")]
enum Command {
    /// Run one sample of a scenario
    Run(run::RunArgs),
    /// Run many samples of one or more scenarios, and judge the result by gates
    Campaign(campaign::CampaignArgs),
    /// Compare a campaign with an earlier one, sample by sample
    Compare(compare::CompareArgs),
    /// Keep the results of a campaign in a small file, and compare later campaigns with it
    Baseline(baseline::BaselineArgs),
    /// Run one sample of a campaign again, and check that it gives the same bits
    Replay(replay::ReplayArgs),
    /// Find the stage of the chain whose perfection would prevent a failure of a campaign, and say
    /// what the system did
    Explain(causes::ExplainArgs),
    /// Find the smallest failing case near a failing sample of a campaign, and the nearest case
    /// that passes; with --nearest, the failing case nearest to the nominal one
    Minimize(causes::MinimizeArgs),
    /// Explore the samples of a campaign in the browser, and open recordings in the installed Rerun
    /// viewer
    View(view::ViewArgs),
    /// Draw an encounter as a static figure: SVG, PNG or PDF
    Plot(plot::PlotArgs),
    /// Write a commented scenario to start from
    New(new::NewArgs),
    /// Write the files of a repository of scenarios, with CI jobs for GitHub and GitLab. No file is
    /// overwritten
    Init(new::InitArgs),
    /// List the scenarios of the library with their questions, requirements and gates
    List(library::ListArgs),
    /// Check scenario files without running them; with --watch, check a file at every change and
    /// run a few samples of it
    Check(check::CheckArgs),
    /// Turn recorded traffic into scenarios: quality, lane changes, criticality, distributions,
    /// encounters
    #[command(subcommand)]
    Traffic(Traffic),
    /// Compute from many runs, without a verdict: influences on a result, margins of a system,
    /// range of perception
    #[command(subcommand)]
    Study(Study),
    /// Write what other programs read: schema, completions, manual pages, labelled images,
    /// OpenSCENARIO, merged campaigns
    #[command(subcommand)]
    Tool(Tool),
    /// Run samples with a library or an FMU, for another process of this program
    #[command(hide = true)]
    Host { arguments: Vec<String> },
}

/// The commands that belong to a group or to another command, each with its whole name. A user may
/// type the name without the group.
const GROUPED: [(&str, &str); 31] = [
    ("aerial", "traffic aerial"),
    ("anchor", "study anchor"),
    ("boundary", "study boundary"),
    ("calibrate", "traffic calibrate"),
    ("chain", "traffic chain"),
    ("completions", "tool completions"),
    ("criticality", "traffic criticality"),
    ("drift", "traffic drift"),
    ("export", "tool export"),
    ("exposure", "study exposure"),
    ("fidelity", "study fidelity"),
    ("fit", "traffic fit"),
    ("frontier", "study frontier"),
    ("import", "tool import"),
    ("inspect", "traffic inspect"),
    ("lane-changes", "traffic lane-changes"),
    ("man", "tool man"),
    ("map", "study map"),
    ("merge", "tool merge"),
    ("paper", "traffic paper"),
    ("perceive", "study perceive"),
    ("record", "traffic record"),
    ("reenact", "traffic reenact"),
    ("render", "tool render"),
    ("robustness", "traffic robustness"),
    ("sample", "traffic sample"),
    ("schema", "tool schema"),
    ("sensitivity", "study sensitivity"),
    ("sensors", "study sensors"),
    ("statistics", "traffic statistics"),
    ("watch", "check --watch"),
];

/// Returns the commands and options of the program, from which help, manual pages and completions
/// are made.
pub fn command() -> clap::Command {
    WITH_NETWORK.into_iter().fold(Cli::command(), with_network)
}

/// Parses the arguments, and returns the command and the shared library of ONNX Runtime.
fn parse(arguments: &[std::ffi::OsString]) -> Result<(Command, Option<PathBuf>), clap::Error> {
    let mut command = command();
    let matches = command.try_get_matches_from_mut(arguments).map_err(|error| plain_words(error, arguments))?;
    let onnxruntime = onnxruntime(&matches);
    if let Some(message) = runs_no_network(&matches) {
        return Err(command.error(ErrorKind::MissingRequiredArgument, message));
    }
    let cli = Cli::from_arg_matches(&matches).map_err(|error| plain_words(error.format(&mut command), arguments))?;
    Ok((cli.command, onnxruntime))
}

/// Explains an argument error in plain words: the whole name of a command that belongs to a group,
/// and the allowed numbers.
fn plain_words(error: clap::Error, arguments: &[std::ffi::OsString]) -> clap::Error {
    let text = |kind| match error.get(kind) {
        Some(ContextValue::String(text)) => Some(text.as_str()),
        _ => None,
    };
    let (kind, message) = match error.kind() {
        kind @ ErrorKind::InvalidSubcommand => {
            let grouped = GROUPED.iter().find(|(alone, _)| text(ContextKind::InvalidSubcommand) == Some(*alone));
            let Some((_, whole)) = grouped else { return error };
            (kind, format!("the command is `closecall {whole}`"))
        }
        kind @ ErrorKind::ValueValidation => {
            let (Some(value), Some(option)) = (text(ContextKind::InvalidValue), text(ContextKind::InvalidArg)) else {
                return error;
            };
            let Some(allowed) = error.source().and_then(allowed_number) else { return error };
            (kind, format!("invalid value '{value}' for '{option}': expected {allowed}"))
        }
        kind @ ErrorKind::UnknownArgument => {
            let Some(argument) = text(ContextKind::InvalidArg) else { return error };
            let Some(message) = negative_number(argument, arguments) else { return error };
            (kind, message)
        }
        _ => return error,
    };
    clap::Error::raw(kind, format!("{message}\n\nFor more information, try '--help'.\n"))
}

/// Returns the message for a number below 0 where none is allowed. clap takes `-25` for several
/// options of one letter, and names the first, `-2`.
fn negative_number(named: &str, arguments: &[std::ffi::OsString]) -> Option<String> {
    let words: Vec<Cow<'_, str>> = arguments.iter().map(|argument| argument.to_string_lossy()).collect();
    let is_number = |word: &str| {
        word.strip_prefix('-')
            .is_some_and(|rest| rest.starts_with(|first: char| first.is_ascii_digit() || first == '.'))
    };
    let index = words.iter().position(|word| word.starts_with(named) && is_number(word))?;
    let before = words.get(index.checked_sub(1)?)?;
    // An option that already has its value, such as `--seed=1`, takes no second one.
    let is_option = before.starts_with('-') && before.len() > 1 && !before.contains('=') && !is_number(before);
    let expected = if is_option { format!("'{before}' takes") } else { "this command takes".to_owned() };
    Some(format!("unexpected argument '{}': {expected} no number below 0", words[index]))
}

/// Returns the allowed numbers, if another number is the reason for the error.
fn allowed_number(error: &(dyn Error + 'static)) -> Option<String> {
    if let Some(error) = error.downcast_ref::<ParseIntError>() {
        return Some(match error.kind() {
            IntErrorKind::PosOverflow => format!("a whole number from 0 to {}", u64::MAX),
            _ => "a whole number, 0 or more".to_owned(),
        });
    }
    error.is::<ParseFloatError>().then(|| "a number, such as 0.5".to_owned())
}

/// Runs the program with these arguments. The first is the program's name.
pub fn main(arguments: &[std::ffi::OsString]) -> ExitCode {
    name_commit();
    set_arguments(arguments);
    // Messages name their causes themselves. A terminal receives lines that are wrapped between
    // words, so that paths can be copied.
    let handler = |_: &_| -> Box<dyn miette::ReportHandler> {
        let options = miette::MietteHandlerOpts::new().without_cause_chain();
        let options = match error_columns() {
            Some(columns) => options
                .width(columns)
                .break_words(false)
                .word_separator(WordSeparator::AsciiSpace)
                .word_splitter(WordSplitter::NoHyphenation),
            None => options.wrap_lines(false),
        };
        Box::new(options.build())
    };
    // A hook that is already set stays: the program that uses this crate as a library has set it.
    drop(miette::set_hook(Box::new(handler)));
    let (command, onnxruntime) = match parse(arguments) {
        Ok(parsed) => parsed,
        Err(error) => {
            // Help and version are not errors: clap prints them to standard output.
            let code = if error.use_stderr() { ExitCode::Usage } else { ExitCode::Pass };
            let is_odd = |text: &std::ffi::OsString| matches!(shown(&text.to_string_lossy()), Cow::Owned(_));
            if arguments.iter().any(is_odd) {
                // The message may quote an argument with control characters.
                print_error(format_args!("{}", error.render()));
                return code;
            }
            return match error.print() {
                // As in all messages, a reader that has gone does not change the exit code.
                Err(failure) if code == ExitCode::Pass && failure.kind() != std::io::ErrorKind::BrokenPipe => {
                    ExitCode::Io
                }
                _ => code,
            };
        }
    };
    // The browser that `view` opens outlives it.
    if !matches!(command, Command::View(_)) {
        adopt_orphans();
    }
    watch(announce, |signal| {
        remove_unpacked();
        std::process::exit(ExitCode::from(signal) as i32)
    });
    if let Some(message) = wrong_stack() {
        print_failure(CliError::usage(message));
        return ExitCode::Usage;
    }
    // A worker process gets its backend from its task.
    if !matches!(command, Command::Host { .. }) {
        choose_backend(onnxruntime.as_deref());
    }
    let heartbeat = has_end(&command).then(command_heartbeat).flatten();
    let result = dispatch(command);
    drop(heartbeat);
    end_all();
    remove_unpacked();
    take_bad_ends().iter().for_each(warn);
    match result {
        Ok(code) => code,
        Err(error) => {
            let code = ExitCode::from(&error);
            print_failure(error);
            code
        }
    }
}

/// Stack sizes of threads that the environment variable `RUST_MIN_STACK` may name (bytes). The default
/// of Rust is 2 MiB. A run needs less than 1 MiB. The upper limit assumes that the address space holds
/// one thread for each processor.
const STACK_BYTES: std::ops::RangeInclusive<u64> = 1 << 20..=1 << 30;

/// Returns a message if the environment asks for a stack size outside [`STACK_BYTES`]: samples would
/// overflow a smaller stack, and no thread could start with a larger one.
fn wrong_stack() -> Option<String> {
    let stated = std::env::var("RUST_MIN_STACK").ok()?;
    let bytes: u64 = stated.parse().ok()?;
    let (least, most) = (STACK_BYTES.start(), STACK_BYTES.end());
    (!STACK_BYTES.contains(&bytes))
        .then(|| format!("RUST_MIN_STACK={stated}: expected {least} to {most} bytes, or no such variable"))
}

/// Returns true if a command ends by itself. `view`, `check --watch` and a worker process go on until
/// they are stopped.
const fn has_end(command: &Command) -> bool {
    match command {
        Command::View(_) | Command::Host { .. } => false,
        Command::Check(args) => !args.is_watching(),
        _ => true,
    }
}

fn dispatch(command: Command) -> Result<ExitCode, CliError> {
    match command {
        Command::Run(args) => run::run(&args),
        Command::Campaign(args) => campaign::campaign(&args),
        Command::Compare(args) => compare::compare(&args),
        Command::Baseline(args) => baseline::baseline(&args),
        Command::Replay(args) => replay::replay(&args),
        Command::Explain(args) => causes::explain(&args),
        Command::Minimize(args) => causes::minimize(&args),
        Command::View(args) => view::view(&args),
        Command::Plot(args) => plot::plot(&args),
        Command::New(args) => new::new(&args),
        Command::Init(args) => new::init(&args),
        Command::List(args) => library::list(&args),
        Command::Check(args) => check::check(&args),
        Command::Traffic(command) => command.run(),
        Command::Study(command) => command.run(),
        Command::Tool(command) => command.run(),
        Command::Host { arguments } => Ok(host::serve(&arguments).map_or_else(
            |message| {
                print_error(format_args!("{message}\n"));
                ExitCode::SampleError
            },
            |()| ExitCode::Pass,
        )),
    }
}
