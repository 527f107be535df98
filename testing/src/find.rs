//! The search for what a test needs. Each function says that the test is skipped if it finds nothing.

use std::path::PathBuf;
use std::process::Command;

use crate::Need;
use crate::require::{required, skip};

/// Programs that can show a web page without a window.
const BROWSERS: [&str; 3] = ["chromium", "chromium-browser", "google-chrome"];

/// Returns the program of the Rerun viewer.
///
/// # Panics
/// As [`skip`].
pub fn viewer() -> Option<PathBuf> {
    named_by("CLOSECALL_RERUN", Need::Viewer, "CLOSECALL_RERUN does not name the Rerun viewer")
}

/// Returns the shared library of ONNX Runtime.
///
/// # Panics
/// As [`skip`].
pub fn onnxruntime() -> Option<PathBuf> {
    let reason = "CLOSECALL_ONNXRUNTIME does not name ONNX Runtime's shared library";
    named_by("CLOSECALL_ONNXRUNTIME", Need::OnnxRuntime, reason)
}

/// Returns the folder of trajectory data.
///
/// # Panics
/// As [`skip`].
pub fn data() -> Option<PathBuf> {
    named_by("CLOSECALL_DATA", Need::Data, "CLOSECALL_DATA does not name the folder of trajectory data")
}

/// Returns true if programs with windows can run on a virtual display.
///
/// # Panics
/// As [`skip`].
pub fn has_display() -> bool {
    found(runs("xvfb-run", "--help"), Need::Display, "xvfb-run is not installed").is_some()
}

/// Returns true if `python3` can be run.
///
/// # Panics
/// As [`skip`].
pub fn has_python() -> bool {
    found(runs("python3", "--version"), Need::Python, "python3 is not installed").is_some()
}

/// Returns a Python interpreter that has the packages `onnxruntime` and `numpy`: that of the environment in which the shared library of
/// ONNX Runtime lies.
///
/// # Panics
/// As [`skip`].
pub fn python_with_onnxruntime() -> Option<PathBuf> {
    let library = onnxruntime()?;
    let mut programs = library.ancestors().map(|folder| folder.join("bin/python")).filter(|path| path.is_file());
    let has_packages = |python: &PathBuf| {
        let output = Command::new(python).args(["-c", "import numpy, onnxruntime"]).output();
        output.is_ok_and(|output| output.status.success())
    };
    let reason = "CLOSECALL_ONNXRUNTIME does not lie in a Python environment with onnxruntime and numpy";
    found(programs.find(has_packages), Need::Python, reason)
}

/// Returns the program of a web browser.
///
/// # Panics
/// As [`skip`].
pub fn browser() -> Option<&'static str> {
    let browser = BROWSERS.into_iter().find(|name| runs(name, "--version").is_some());
    found(browser, Need::Browser, "neither Chromium nor Google Chrome is installed")
}

/// Returns the path that an environment variable names. An empty variable counts as none.
fn named_by(variable: &str, need: Need, reason: &str) -> Option<PathBuf> {
    let path = std::env::var_os(variable).filter(|path| !path.is_empty()).map(PathBuf::from);
    found(path, need, reason)
}

/// Returns `something`, and says that the test is skipped if there is none.
fn found<T>(something: Option<T>, need: Need, reason: &str) -> Option<T> {
    // A misspelt variable fails a test also on a machine that has everything.
    required();
    if something.is_none() {
        skip(need, reason);
    }
    something
}

/// Returns `Some` if a program can be run with `argument`.
fn runs(program: &str, argument: &str) -> Option<()> {
    Command::new(program).arg(argument).output().is_ok_and(|output| output.status.success()).then_some(())
}
