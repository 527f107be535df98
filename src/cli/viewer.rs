//! The installed program of the Rerun viewer.

use std::ffi::OsString;
use std::io;
use std::net::{Ipv4Addr, SocketAddr, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use closecall_report::run::rerun::{LoopedRecording, RerunVersion};

use super::output::print_error;

/// The command that installs the viewer for the recordings that this version of Closecall writes.
pub(super) const INSTALL: &str = "`pip install rerun-sdk==0.36.3`";
/// The address that the viewer listens on. Unless told, it listens on every network of the machine.
const LOOPBACK: &str = "127.0.0.1";
/// The port of a viewer to which none is stated.
const PORT: u16 = 9876;
/// Time within which a connection to a port of this machine is accepted, if a program listens
/// there.
const CONNECT_TIME: Duration = Duration::from_millis(200);
/// Time within which a viewer listens, also on a slow machine.
const LISTEN_TIME: Duration = Duration::from_secs(30);
/// Time after which a viewer counts as started. One without a display ends within it.
const START_TIME: Duration = Duration::from_secs(2);

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
        let mut viewer = self.begin(files, is_web, port)?;
        let status = viewer.wait().map_err(|source| no_start(&self.program, source))?;
        if status.success() { Ok(()) } else { Err(ViewerError::Failed { program: self.program.clone(), status }) }
    }

    /// Starts the viewer. In its window it loops the seconds around the critical moment of each
    /// recording, if it does not run already.
    fn begin(&self, files: &[&Path], is_web: bool, port: Option<u16>) -> Result<Child, ViewerError> {
        let start = |source| no_start(&self.program, source);
        let address = SocketAddr::from((Ipv4Addr::LOCALHOST, port.unwrap_or(PORT)));
        let listens = || TcpStream::connect_timeout(&address, CONNECT_TIME).is_ok();
        let looped = || files.iter().map(|file| LoopedRecording::read(file)).collect::<Option<Vec<_>>>();
        // A viewer that chooses its port does not say which.
        let recordings = if is_web || address.port() == 0 || listens() { None } else { looped() };
        let Some(recordings) = recordings else { return self.command(files, is_web, port)?.spawn().map_err(start) };
        let mut viewer = self.command(&[], is_web, port)?.spawn().map_err(start)?;
        let started = Instant::now();
        while viewer.try_wait().map_err(start)?.is_none() && !listens() && started.elapsed() < LISTEN_TIME {
            thread::sleep(LISTEN_TIME / 300);
        }
        if viewer.try_wait().map_err(start)?.is_none() {
            for recording in recordings {
                if let Err(error) = recording.send(address.port()) {
                    print_error(format_args!("warning: {error}\n"));
                }
            }
        }
        Ok(viewer)
    }

    /// Opens a file, and waits only as long as a viewer that cannot start needs to end. A viewer
    /// that runs already takes the file.
    pub(super) fn start(&self, file: &Path, is_web: bool, port: Option<u16>) -> Result<(), ViewerError> {
        let start = |source| no_start(&self.program, source);
        let mut viewer = self.begin(&[file], is_web, port)?;
        let started = Instant::now();
        while started.elapsed() < START_TIME {
            match viewer.try_wait().map_err(start)? {
                Some(status) if status.success() => return Ok(()),
                Some(status) => return Err(ViewerError::Failed { program: self.program.clone(), status }),
                None => thread::sleep(START_TIME / 50),
            }
        }
        // The process is waited for, so that it does not stay behind as a zombie.
        thread::spawn(move || viewer.wait());
        Ok(())
    }

    fn command(&self, files: &[&Path], is_web: bool, port: Option<u16>) -> Result<Command, ViewerError> {
        let start = |source| no_start(&self.program, source);
        // The viewer takes a path such as `http:a.rrd` for an address, and `-a.rrd` for an option.
        let files = files.iter().map(std::path::absolute).collect::<io::Result<Vec<PathBuf>>>().map_err(start)?;
        let mut command = Command::new(&self.program);
        command.args(options(is_web, port)).args(files).stdin(Stdio::null());
        Ok(command)
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
        // The page gets its data through a second port, which a viewer that already runs may have
        // taken.
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
