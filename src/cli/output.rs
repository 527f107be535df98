//! Prints results and messages. Writing to a pipe whose reader has closed it is not an error.

use std::fmt::Arguments;
use std::io::{ErrorKind, Write, stderr, stdout};
use std::path::Path;

use closecall_campaign::folder::Folder;

use crate::exit_code::ExitCode;

/// Prints to standard output. A reader that has closed the pipe (`closecall … | head`) does not change the exit code.
/// Any other failure ends the program with [`ExitCode::Io`].
pub(super) fn print(text: Arguments<'_>) {
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
    drop(stderr().lock().write_fmt(text));
}

/// Prints to standard error which file was written. Standard output may be read by a program.
pub(super) fn print_written(path: &Path) {
    print_error(format_args!("written: {}\n", path.display()));
}

/// The files of a campaign's folder that a reader opens first.
const REPORT_FILES: [&str; 5] = ["report.html", "summary.md", "junit.xml", "outcomes.parquet", "recordings/index.html"];

/// Prints to standard error which reports a campaign's folder holds.
pub(super) fn print_report_files(folder: &Folder) {
    for path in REPORT_FILES.map(|name| folder.file(name)) {
        if path.exists() {
            print_written(&path);
        }
    }
}

/// Largest number of samples that a list in a text names.
const MAX_LISTED: usize = 12;

/// Returns the samples as the end of a line, `: 3, 7, 12`; an empty text if there are none.
pub(super) fn listed(samples: &[u64]) -> String {
    let mut text: Vec<String> = samples.iter().take(MAX_LISTED).map(u64::to_string).collect();
    if samples.len() > MAX_LISTED {
        text.push(format!("… {} more", samples.len() - MAX_LISTED));
    }
    if text.is_empty() { String::new() } else { format!(": {}", text.join(", ")) }
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
