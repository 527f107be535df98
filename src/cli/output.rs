//! Prints results and messages. Writing to a pipe whose reader has closed it is not an error.

use std::fmt::Arguments;
use std::io::{ErrorKind, IsTerminal, Write, stderr, stdout};
use std::path::{Path, PathBuf};

use closecall_campaign::folder::{Folder, REPORT_FILES};
use closecall_campaign::interrupt::Signal;
use closecall_campaign::session;
use closecall_report::heartbeat::Heartbeat;
use closecall_scenarios::ScenarioFile;
use closecall_traffic::atomic::{WriteError, write_texts};
use indicatif::ProgressBar;

use crate::exit_code::ExitCode;

/// Prints to standard output. A reader that has closed the pipe (`closecall … | head`) does not change the exit code.
/// Any other failure ends the program with [`ExitCode::Io`].
pub(super) fn print(text: Arguments<'_>) {
    if session::keep_output(text) {
        return;
    }
    let mut out = stdout().lock();
    if let Err(error) = out.write_fmt(text).and_then(|()| out.flush())
        && error.kind() != ErrorKind::BrokenPipe
    {
        print_error(format_args!("failed to write to standard output: {error}\n"));
        std::process::exit(ExitCode::Io as i32);
    }
}

/// Prints to standard error. A failure is ignored, since there is nowhere left to report it.
pub(super) fn print_error(text: Arguments<'_>) {
    if session::keep_message(text) {
        return;
    }
    drop(stderr().lock().write_fmt(text));
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

/// Writes charts (SVG) into a folder, which is created if it does not exist, and prints their paths to standard error.
pub(super) fn write_charts(folder: &Path, paths: &[PathBuf], charts: &[String]) -> Result<(), WriteError> {
    write_texts(folder, (paths, charts), print_written)
}

/// Starts to print the progress of `bar` as lines. A terminal shows the bar itself instead.
pub(super) fn heartbeat(bar: &ProgressBar) -> Option<Heartbeat> {
    let bar = bar.clone();
    let progress = move || [bar.position(), bar.length().unwrap_or_default()];
    (!session::is_active() && !stderr().is_terminal())
        .then(|| Heartbeat::start(progress, |line| print_error(format_args!("{line}\n"))))
}

/// Returns the command line of this program, as it was called.
pub(super) fn command_line() -> String {
    std::iter::once("closecall".to_owned())
        .chain(session::arguments().into_iter().skip(1))
        .collect::<Vec<_>>()
        .join(" ")
}

/// Returns the text of a scenario that was made from the trajectory file `source`, with a heading that states its origin.
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

pub(super) use {out, outln};
