//! Printing results: what is written to a pipe that nobody reads any more is no error.

use std::fmt::Arguments;
use std::io::{ErrorKind, Write, stderr, stdout};

use crate::exit_code::ExitCode;

/// Prints to standard output. A reader that has gone (`closecall … | head`) does not change what the program ends
/// with; anything else that keeps a result from being printed ends it.
pub(super) fn print(text: Arguments<'_>) {
    let mut out = stdout().lock();
    if let Err(error) = out.write_fmt(text).and_then(|()| out.flush())
        && error.kind() != ErrorKind::BrokenPipe
    {
        complain(format_args!("failed to write to standard output: {error}\n"));
        std::process::exit(ExitCode::Io as i32);
    }
}

/// Prints to standard error, where nobody is left to tell of a failure.
pub(super) fn complain(text: Arguments<'_>) {
    drop(stderr().lock().write_fmt(text));
}

/// As [`std::print`], without its panic.
macro_rules! out {
    ($($part:tt)*) => { $crate::cli::output::print(format_args!($($part)*)) };
}

/// As [`std::println`], without its panic.
macro_rules! outln {
    () => { $crate::cli::output::print(format_args!("\n")) };
    ($($part:tt)*) => { $crate::cli::output::print(format_args!("{}\n", format_args!($($part)*))) };
}

pub(super) use {out, outln};
