//! Running the program, and reading what it leaves.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

/// The scenario library.
pub(crate) fn library(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/library").join(format!("{name}.toml"))
}

/// Runs the program in the repository's root.
pub(crate) fn closecall<S: AsRef<std::ffi::OsStr>>(args: impl IntoIterator<Item = S>) -> Output {
    Command::new(env!("CARGO_BIN_EXE_closecall"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(args)
        .output()
        .expect("the program starts")
}

/// The exit code of a run of the program.
pub(crate) fn code(output: &Output) -> i32 {
    output.status.code().expect("not killed by a signal")
}

/// What the program printed, after a check that it ended as expected.
pub(crate) fn stdout(output: &Output, expected: i32) -> String {
    assert_eq!(code(output), expected, "{}", stderr(output));
    String::from_utf8(output.stdout.clone()).expect("text")
}

/// What the program complained of.
pub(crate) fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The JSON that the program printed.
pub(crate) fn json(output: &Output, expected: i32) -> Value {
    serde_json::from_str(&stdout(output, expected)).expect("JSON")
}

/// A folder that is removed with the test.
pub(crate) fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

/// The headline's text with something replaced.
pub(crate) fn headline_with(from: &str, to: &str) -> String {
    let text = std::fs::read_to_string(library("low-thw-overtake")).expect("the headline");
    assert!(text.contains(from), "the headline has no `{from}`");
    text.replacen(from, to, 1)
}

/// Recorded traffic, where this machine has it.
pub(crate) fn data() -> Option<PathBuf> {
    let folder = std::env::var_os("CLOSECALL_DATA").map(PathBuf::from);
    if folder.is_none() {
        skipped("CLOSECALL_DATA is not set");
    }
    folder
}

/// Says that a test is skipped. Written past the test runner's capture, so that it is seen although the test passes.
pub(crate) fn skipped(why: &str) {
    writeln!(std::io::stderr(), "skipped: {why}").expect("standard error");
}
