//! Prints results and messages. Writing to a pipe whose reader has closed it is not an error.

use std::fmt::Arguments;
use std::io::{ErrorKind, Write, stderr, stdout};

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
