//! The search for the requirements of a test. Each function says that the test is skipped if it
//! finds nothing.

use std::path::{Path, PathBuf};
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
    or_skip(runs("xvfb-run", "--help"), Need::Display, "xvfb-run is not installed").is_some()
}

/// Returns true if `python3` can be run.
///
/// # Panics
/// As [`skip`].
pub fn has_python() -> bool {
    or_skip(runs("python3", "--version"), Need::Python, "python3 is not installed").is_some()
}

/// Returns a Python interpreter with the packages `onnxruntime` and `numpy`, from the environment
/// of the shared library of ONNX Runtime.
///
/// # Panics
/// As [`skip`].
pub fn python_with_onnxruntime() -> Option<PathBuf> {
    let reason = "CLOSECALL_ONNXRUNTIME does not lie in a Python environment with onnxruntime and numpy";
    or_skip(python_around(&onnxruntime()?, "numpy, onnxruntime"), Need::Python, reason)
}

/// Returns a Python interpreter with the packages `rerun`, `datafusion`, `pandas` and `matplotlib`,
/// from the environment of the Rerun viewer.
///
/// # Panics
/// As [`skip`].
pub fn python_with_rerun() -> Option<PathBuf> {
    let reason = "CLOSECALL_RERUN does not lie in a Python environment with datafusion, pandas and matplotlib";
    or_skip(python_around(&viewer()?, "rerun, datafusion, pandas, matplotlib"), Need::Python, reason)
}

/// Returns a Python interpreter that has these packages, separated by commas: the interpreter of the environment in which the Rerun viewer lies.
///
/// # Panics
/// As [`skip`].
pub fn python_with(packages: &str) -> Option<PathBuf> {
    let reason = format!("CLOSECALL_RERUN does not lie in a Python environment with {packages}");
    or_skip(python_around(&viewer()?, packages), Need::Python, &reason)
}

/// Returns the interpreter of the Python environment in which a file lies, if it has these packages.
fn python_around(file: &Path, packages: &str) -> Option<PathBuf> {
    let mut programs = file.ancestors().map(|folder| folder.join("bin/python")).filter(|path| path.is_file());
    programs.find(|python| {
        let output = Command::new(python).args(["-c", &format!("import {packages}")]).output();
        output.is_ok_and(|output| output.status.success())
    })
}

/// Returns the program of a web browser.
///
/// # Panics
/// As [`skip`].
pub fn browser() -> Option<&'static str> {
    let browser = BROWSERS.into_iter().find(|name| runs(name, "--version").is_some());
    or_skip(browser, Need::Browser, "neither Chromium nor Google Chrome is installed")
}

/// Returns a Python interpreter with the checkers and readers of exchange formats.
///
/// # Panics
/// As [`skip`].
pub fn python_with_exchange() -> Option<PathBuf> {
    let reason = "CLOSECALL_EXCHANGE does not name a Python interpreter with asam-qc-openscenarioxml, asam-qc-opendrive, betterosi and mcap";
    named_by("CLOSECALL_EXCHANGE", Need::Exchange, reason)
}

/// Returns the path that an environment variable names. An empty variable counts as none.
fn named_by(variable: &str, need: Need, reason: &str) -> Option<PathBuf> {
    let path = std::env::var_os(variable).filter(|path| !path.is_empty()).map(PathBuf::from);
    or_skip(path, need, reason)
}

/// Returns `something`, and says that the test is skipped if there is none.
fn or_skip<T>(something: Option<T>, need: Need, reason: &str) -> Option<T> {
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
