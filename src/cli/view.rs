//! `closecall view`: shows recordings in the browser.

use std::path::PathBuf;

use clap::Args;
use closecall_campaign::folder::{RECORDINGS, REPORT};
use closecall_viewer::{Server, WebViewer, open_in_browser};

use super::CliError;
use super::help::{examples, heading};
use super::output::{outln, print_error};
use super::results::last_results;
use crate::exit_code::ExitCode;

/// Arguments of `closecall view`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall view",
    "closecall view pair.rrd",
    "closecall view closecall-results --no-open --port 8080",
]))]
pub(super) struct ViewArgs {
    /// Recording (.rrd), a folder that has some, or the folder of a campaign [default: the report and the recordings of the last
    /// campaign, in closecall-results]
    path: Option<PathBuf>,
    /// Port on 127.0.0.1; 0 for a free one
    #[arg(long, default_value_t = 0, help_heading = heading::VIEWER)]
    port: u16,
    /// Only print the address, and the path of the report
    #[arg(long, help_heading = heading::VIEWER)]
    no_open: bool,
    /// Program of the Rerun viewer, which brings its web build, or a folder with that build
    #[arg(long, value_name = "PATH", env = "CLOSECALL_RERUN", hide_env_values = true, default_value = "rerun", help_heading = heading::VIEWER)]
    viewer: PathBuf,
}

pub(super) fn view(args: &ViewArgs) -> Result<ExitCode, CliError> {
    let path = match &args.path {
        Some(path) => path.clone(),
        None => {
            let results = last_results()?;
            let report = results.file(REPORT);
            outln!("{}", report.display());
            if !args.no_open {
                open_in_browser(&report.display().to_string());
            }
            if !results.file(RECORDINGS).is_dir() {
                return Ok(ExitCode::Pass);
            }
            results.path().to_owned()
        }
    };
    Server::check(&path)?;
    let server = Server::new(&path, args.port, WebViewer::find(&args.viewer)?)?;
    outln!("{}", server.address());
    print_error(format_args!("Ctrl-C ends it\n"));
    if !args.no_open {
        open_in_browser(&server.address());
    }
    server.run();
    Ok(ExitCode::Pass)
}
