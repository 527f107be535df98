//! The installed program of the Rerun viewer.

use std::ffi::OsString;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};

use closecall_report::run::rerun::RerunVersion;

/// The command that installs the viewer for the recordings that this version of Closecall writes.
pub(super) const INSTALL: &str = "`pip install rerun-sdk==0.36.3`";
/// The address that the viewer listens on. Unless told, it listens on every network of the machine.
const LOOPBACK: &str = "127.0.0.1";

/// The reason why the viewer shows nothing.
#[derive(Debug, thiserror::Error)]
pub enum ViewerError {
    /// The program is not installed.
    #[error(
        "failed to find the Rerun viewer ({program}): install it with {}, or name its program with --viewer PATH or \
         CLOSECALL_RERUN",
        INSTALL
    )]
    NotInstalled {
        /// The program that was looked for.
        program: PathBuf,
    },
    /// The program cannot be started.
    #[error("failed to start the Rerun viewer ({program}): {source}")]
    Start {
        /// The program.
        program: PathBuf,
        /// The reason.
        source: io::Error,
    },
    /// The viewer has reported an error.
    #[error(
        "the Rerun viewer ({program}) ended with {status}: on a machine without a display use --web, beside another viewer --port, and \
         --no-open to print the files"
    )]
    Failed {
        /// The program.
        program: PathBuf,
        /// The exit status.
        status: ExitStatus,
    },
}

/// The program of the viewer.
#[derive(Debug)]
pub(super) struct Viewer {
    pub(super) program: PathBuf,
    /// `None` if the program does not tell.
    pub(super) version: Option<RerunVersion>,
}

impl Viewer {
    /// Asks the program for its version.
    pub(super) fn find(program: &Path) -> Result<Self, ViewerError> {
        let output = Command::new(program).arg("--version").stdin(Stdio::null()).output();
        let output = output.map_err(|source| no_start(program, source))?;
        let version = RerunVersion::first_in(&String::from_utf8_lossy(&output.stdout));
        Ok(Self { program: program.to_owned(), version })
    }

    /// Opens files, and waits for the end of the viewer.
    pub(super) fn show(&self, files: &[&Path], is_web: bool, port: Option<u16>) -> Result<(), ViewerError> {
        let start = |source| no_start(&self.program, source);
        // The viewer takes a path such as `http:a.rrd` for an address, and `-a.rrd` for an option.
        let files = files.iter().map(std::path::absolute).collect::<io::Result<Vec<PathBuf>>>().map_err(start)?;
        let mut command = Command::new(&self.program);
        command.args(options(is_web, port)).args(files).stdin(Stdio::null());
        let status = command.status().map_err(start)?;
        if status.success() { Ok(()) } else { Err(ViewerError::Failed { program: self.program.clone(), status }) }
    }
}

fn no_start(program: &Path, source: io::Error) -> ViewerError {
    let program = program.to_owned();
    match source.kind() {
        io::ErrorKind::NotFound => ViewerError::NotInstalled { program },
        _ => ViewerError::Start { program, source },
    }
}

/// Returns the options of the viewer.
fn options(is_web: bool, port: Option<u16>) -> Vec<OsString> {
    let mut options = vec!["--bind", LOOPBACK];
    if is_web {
        options.push("--web-viewer");
    }
    let port = port.map(|port| port.to_string());
    match &port {
        // The page gets its data through a second port, which a viewer that already runs may have taken.
        Some(port) if is_web => options.extend(["--web-viewer-port", port, "--port", "auto"]),
        Some(port) => options.extend(["--port", port]),
        None => {}
    }
    options.into_iter().map(OsString::from).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_port_is_that_of_the_window_or_of_the_page() {
        assert_eq!(options(false, None), ["--bind", "127.0.0.1"]);
        assert_eq!(options(true, None), ["--bind", "127.0.0.1", "--web-viewer"]);
        assert_eq!(options(false, Some(9000)), ["--bind", "127.0.0.1", "--port", "9000"]);
        let page = ["--bind", "127.0.0.1", "--web-viewer", "--web-viewer-port", "9000", "--port", "auto"];
        assert_eq!(options(true, Some(9000)), page);
    }
}
