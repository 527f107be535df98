//! Prints results and messages. Writing to a pipe whose reader has closed it is not an error.

use std::fmt::{self, Arguments, Display};
use std::io::{ErrorKind, IsTerminal, Write, stderr, stdout};
use std::path::{Path, PathBuf};
use std::time::Duration;

use closecall_campaign::folder::{Folder, REPORT_FILES};
use closecall_campaign::interrupt::Signal;
use closecall_campaign::session;
use closecall_report::heartbeat::Heartbeat;
use closecall_scenarios::ScenarioFile;
use closecall_traffic::atomic::{WriteError, write_texts};
use closecall_traffic::shown::shown;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::CliError;
use super::terminal::{for_error_terminal, for_terminal};
use crate::exit_code::ExitCode;

/// Prints to standard output, without control characters of others (see [`shown`]).
pub(super) fn print(text: Arguments<'_>) {
    write(&shown(&text.to_string()));
}

/// Prints a text for people to standard output. Control characters of others are replaced before a
/// terminal gets its colours.
pub(super) fn print_text(text: impl Display) {
    write(&for_terminal(&shown(&text.to_string())));
}

/// Writes to standard output. A reader that has closed the pipe (`closecall … | head`) does not
/// change the exit code. Any other failure ends the program with [`ExitCode::Io`].
fn write(text: &str) {
    let mut out = stdout().lock();
    if let Err(error) = out.write_all(text.as_bytes()).and_then(|()| out.flush())
        && error.kind() != ErrorKind::BrokenPipe
    {
        print_error(format_args!("failed to write to standard output: {error}\n"));
        std::process::exit(ExitCode::Io as i32);
    }
}

/// Prints to standard error, without control characters of others (see [`shown`]). A failure is
/// ignored, since there is nowhere left to report it. A program that calls the command has no reader
/// of such texts.
pub(super) fn print_error(text: Arguments<'_>) {
    if !session::is_active() {
        drop(stderr().lock().write_all(for_error_terminal(&shown(&text.to_string())).as_bytes()));
    }
}

/// Warns the user, or the program that calls the command.
pub(super) fn warn(text: impl Display) {
    let text = text.to_string();
    if !session::keep_warning(&shown(&text)) {
        print_error(format_args!("warning: {text}\n"));
    }
}

/// Prints why a command has no result. On a terminal, the frame of the message has colours.
pub(super) fn print_failure(error: CliError) {
    if !session::keep_warning(&shown(&error.to_string())) {
        let text = format!("{:?}\n", miette::Report::new(Shown(error)));
        drop(stderr().lock().write_all(text.as_bytes()));
    }
}

/// An error whose message has no control characters of others.
#[derive(Debug)]
struct Shown(CliError);

impl fmt::Display for Shown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&shown(&self.0.to_string()))
    }
}

impl std::error::Error for Shown {}

impl miette::Diagnostic for Shown {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.0.help().map(|help| Box::new(shown(&help.to_string()).into_owned()) as Box<dyn fmt::Display>)
    }
}

/// Prints which signal stops the running campaign.
pub(super) fn announce(signal: Signal) {
    let name = signal.name();
    print_error(format_args!("\n{name}: running samples are completed; a second signal ends at once\n"));
}

/// Prints to standard error which file was written. Standard output may be read by a program.
pub(super) fn print_written(path: &Path) {
    print_error(format_args!("written: {}\n", path.display()));
}

/// Writes charts (SVG) into a folder, which is created if it does not exist, and prints their paths
/// to standard error.
pub(super) fn write_charts(folder: &Path, paths: &[PathBuf], charts: &[String]) -> Result<(), WriteError> {
    write_texts(folder, paths, charts, print_written)
}

/// Starts to print the progress of `bar` as lines. A terminal shows the bar itself instead.
pub(super) fn heartbeat(bar: &ProgressBar) -> Option<Heartbeat> {
    let bar = bar.clone();
    let progress = move || [bar.position(), bar.length().unwrap_or_default()];
    (!session::is_active() && !stderr().is_terminal())
        .then(|| Heartbeat::start(progress, |line| print_error(format_args!("{line}\n"))))
}

/// Time between two turns of the sign that work goes on.
const TURN: Duration = Duration::from_millis(200);

/// Starts to print lines about a command whose parts may say nothing. A terminal has none.
pub(super) fn command_heartbeat() -> Option<Heartbeat> {
    (!session::is_active() && !stderr().is_terminal())
        .then(|| Heartbeat::of_command(command_line(), |line| print_error(format_args!("{line}\n"))))
}

/// Does `work` on a file. A terminal shows the name of the file and the time since the begin.
pub(super) fn reading<T>(path: &Path, work: impl FnOnce() -> T) -> T {
    during(format!("reading {}", path.display()), work)
}

/// Does `work` whose length is not known. A terminal shows its name and the time since the begin;
/// elsewhere a line does so every 30 s.
pub(super) fn during<T>(name: String, work: impl FnOnce() -> T) -> T {
    let spinner = ProgressBar::new_spinner();
    if session::is_active() {
        spinner.set_draw_target(ProgressDrawTarget::hidden());
    }
    if let Ok(style) = ProgressStyle::with_template("{spinner} {msg}, {elapsed}") {
        spinner.set_style(style);
    }
    spinner.set_message(shown(&name).into_owned());
    spinner.enable_steady_tick(TURN);
    let _heartbeat = (!session::is_active() && !stderr().is_terminal())
        .then(|| Heartbeat::during(name, |line| print_error(format_args!("{line}\n"))));
    let done = work();
    spinner.finish_and_clear();
    done
}

/// Returns the command line of this program, as it was called, or the call of another program.
pub(super) fn command_line() -> String {
    match &session::arguments()[..] {
        [call] => call.clone(),
        words => words.iter().skip(1).fold("closecall".to_owned(), |line, word| format!("{line} {word}")),
    }
}

/// Returns the text of a scenario that was made from the trajectory file `source`, with a heading
/// that states its origin.
pub(super) fn made_by(source: &Path, file: &ScenarioFile) -> String {
    format!("# Made by `{}`\n# from {}\n{}", command_line(), source.display(), file.text())
}

/// Prints to standard error which reports a campaign's folder holds.
pub(super) fn print_report_files(folder: &Folder) {
    REPORT_FILES.map(|name| folder.file(name)).iter().filter(|path| path.exists()).for_each(|path| print_written(path));
}

/// Prints like [`std::print`], but does not panic.
macro_rules! out {
    ($($part:tt)*) => { $crate::cli::output::print(format_args!($($part)*)) };
}

/// Prints like [`std::println`], but does not panic.
macro_rules! outln {
    () => { $crate::cli::output::print(format_args!("\n")) };
    ($($part:tt)*) => { $crate::cli::output::print(format_args!("{}\n", format_args!($($part)*))) };
}

/// Prints a line for people: wrapped at words on a terminal, as it is into a pipe.
macro_rules! textln {
    ($($part:tt)*) => { $crate::cli::output::print_text(format_args!("{}\n", format_args!($($part)*))) };
}

pub(super) use {out, outln, textln};
