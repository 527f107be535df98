//! The web build of the Rerun viewer, from the installed program or from a folder.

use std::fs;
use std::io;
use std::net::{Ipv4Addr, TcpListener};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::Duration;

use crate::fetch::get;

/// The files of the web build. The page loads the two others.
const FILES: [&str; 3] = ["index.html", "re_viewer.js", "re_viewer_bg.wasm"];
/// Number of attempts to reach the viewer's server, and the pause between two.
const ATTEMPTS: u32 = 100;
const PAUSE: Duration = Duration::from_millis(200);

/// The reason why there is no web build of the viewer.
#[derive(Debug, thiserror::Error)]
pub enum ViewerError {
    /// The program is not installed.
    #[error(
        "failed to find the Rerun viewer ({program}): install it with `pip install rerun-sdk==0.36.3`, or name its program or a \
         folder with its web build with --viewer PATH"
    )]
    NotInstalled {
        /// The program that was looked for.
        program: String,
    },
    /// The program does not serve its web build.
    #[error("failed to get the web viewer from `{program}`: {source}")]
    Program {
        /// The program.
        program: String,
        /// The reason.
        source: io::Error,
    },
    /// A file of the folder cannot be read.
    #[error("failed to read the web viewer's file {path}: {source}; the folder must hold {}", FILES.join(", "))]
    Folder {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
}

/// The files of the web build of the viewer.
#[derive(Debug)]
pub struct WebViewer(Vec<(&'static str, Vec<u8>)>);

impl WebViewer {
    /// Returns the web build from a folder that has it, or from the viewer's program.
    ///
    /// # Errors
    /// [`ViewerError`] if there is none.
    pub fn find(program_or_folder: &Path) -> Result<Self, ViewerError> {
        if program_or_folder.is_dir() {
            return Self::from_folder(program_or_folder);
        }
        Self::from_program(program_or_folder)
    }

    fn from_folder(folder: &Path) -> Result<Self, ViewerError> {
        let read = |name: &'static str| {
            let path = folder.join(name);
            let bytes = fs::read(&path).map_err(|source| ViewerError::Folder { path, source })?;
            Ok((name, bytes))
        };
        FILES.into_iter().map(read).collect::<Result<_, _>>().map(Self)
    }

    /// Lets the program serve its web build for a moment, and keeps the files.
    fn from_program(program: &Path) -> Result<Self, ViewerError> {
        let name = program.display().to_string();
        let fail = |source| ViewerError::Program { program: name.clone(), source };
        let [web_port, data_port] = [free_port().map_err(fail)?, free_port().map_err(fail)?];
        let child = Command::new(program)
            .args(["--serve-web", "--bind", "127.0.0.1"])
            .args(["--port", &data_port.to_string(), "--web-viewer-port", &web_port.to_string()])
            .env("RERUN_ANALYTICS", "false")
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn();
        let child = match child {
            Ok(child) => child,
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                return Err(ViewerError::NotInstalled { program: name });
            }
            Err(error) => return Err(fail(error)),
        };
        let mut program = Ended(child);
        let read = |file: &'static str| Ok((file, get(web_port, &format!("/{file}"))?));
        program.wait_for(web_port).map_err(fail)?;
        FILES.into_iter().map(read).collect::<io::Result<_>>().map(Self).map_err(fail)
    }

    /// Returns the file of this name.
    pub(super) fn file(&self, name: &str) -> Option<&[u8]> {
        let name = if name.is_empty() { FILES[0] } else { name };
        self.0.iter().find(|(file, _)| *file == name).map(|(_, bytes)| bytes.as_slice())
    }
}

/// A process that is ended when the value is dropped.
struct Ended(Child);

impl Ended {
    /// Waits until the process answers at `port`.
    fn wait_for(&mut self, port: u16) -> io::Result<()> {
        let mut failure = io::Error::other("it does not answer");
        for _ in 0..ATTEMPTS {
            if let Some(status) = self.0.try_wait()? {
                return Err(io::Error::other(format!("it ended early ({status})")));
            }
            match get(port, "/") {
                Ok(_) => return Ok(()),
                Err(error) => failure = error,
            }
            thread::sleep(PAUSE);
        }
        Err(failure)
    }
}

impl Drop for Ended {
    fn drop(&mut self) {
        drop(self.0.kill());
        drop(self.0.wait());
    }
}

/// Returns a port that is free at this moment.
fn free_port() -> io::Result<u16> {
    Ok(TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?.local_addr()?.port())
}
