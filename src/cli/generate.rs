//! `closecall completions` and `closecall man`: files for shells and for the manual, made from the command line itself.

use std::path::PathBuf;

use clap::{Args, Command};
use clap_complete::Shell;
use closecall_scenarios::atomic::WriteError;

use super::CliError;
use super::output::{out, outln};
use crate::exit_code::ExitCode;

/// The name of the program.
const PROGRAM: &str = "closecall";

/// Arguments of `closecall completions`.
#[derive(Debug, Args)]
pub(super) struct CompletionsArgs {
    /// The shell that reads the script
    #[arg(value_enum)]
    shell: Shell,
}

/// Arguments of `closecall man`.
#[derive(Debug, Args)]
pub(super) struct ManArgs {
    /// Folder for one page per command; without it, the page of the program is printed
    #[arg(long, value_name = "DIR")]
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
            let fail = |source| WriteError::new(folder, source);
            std::fs::create_dir_all(folder).map_err(fail)?;
            clap_mangen::generate_to(command, folder).map_err(fail)?;
            outln!("written: {}", folder.display());
        }
    }
    Ok(ExitCode::Pass)
}
