//! `closecall tool completions` and `closecall tool man`: files for shells and for the manual, made
//! from the command line itself.

use std::path::PathBuf;

use clap::{Args, Command};
use clap_complete::Shell;
use closecall_traffic::atomic::{WriteError, create_folder};

use super::CliError;
use super::help::{examples, heading};
use super::output::{out, print_written};
use crate::exit_code::ExitCode;

/// The name of the program.
const PROGRAM: &str = "closecall";

/// Arguments of `closecall tool completions`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall tool completions bash > ~/.local/share/bash-completion/completions/closecall",
    "closecall tool completions zsh > _closecall",
    "closecall tool completions fish > ~/.config/fish/completions/closecall.fish",
]))]
pub(super) struct CompletionsArgs {
    /// The shell that reads the script
    #[arg(value_enum)]
    shell: Shell,
}

/// Arguments of `closecall tool man`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall tool man",
    "closecall tool man > closecall.1",
    "closecall tool man --out man1",
]))]
pub(super) struct ManArgs {
    /// Folder for one page per command; without it, the page of the program is printed
    #[arg(short, long, value_name = "DIR", help_heading = heading::OUTPUT)]
    out: Option<PathBuf>,
}

pub(super) fn completions(args: &CompletionsArgs, mut command: Command) -> Result<ExitCode, CliError> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command, PROGRAM, &mut script);
    out!("{}", String::from_utf8_lossy(&script));
    Ok(ExitCode::Pass)
}

pub(super) fn man(args: &ManArgs, command: Command) -> Result<ExitCode, CliError> {
    match &args.out {
        None => {
            let mut page = Vec::new();
            let written = clap_mangen::Man::new(command).render(&mut page);
            written.map_err(|source| WriteError::new(PROGRAM.as_ref(), source))?;
            out!("{}", String::from_utf8_lossy(&page));
        }
        Some(folder) => {
            create_folder(folder)?;
            clap_mangen::generate_to(command, folder).map_err(|source| WriteError::new(folder, source))?;
            print_written(folder);
        }
    }
    Ok(ExitCode::Pass)
}
