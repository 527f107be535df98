//! Rerun files pass the viewer's own verification.

use std::path::PathBuf;
use std::process::Command;

use crate::support::{closecall, code, folder, library, skipped, stderr, stdout};

/// The viewer's command line, where this machine has it.
fn rerun() -> Option<PathBuf> {
    let program = std::env::var_os("CLOSECALL_RERUN").map(PathBuf::from);
    if program.is_none() {
        skipped("CLOSECALL_RERUN does not name the Rerun viewer");
    }
    program
}

#[test]
fn every_library_scenario_is_recorded_into_a_file_that_verifies() {
    let Some(rerun) = rerun() else { return };
    let folder = folder();
    for name in ["low-thw-overtake", "left-lane-blocked", "empty-wet-road"] {
        let file = folder.path().join(format!("{name}.rrd"));
        let scenario = library(name);
        stdout(&closecall(["run", scenario.to_str().unwrap(), "--record", file.to_str().unwrap()]), 0);
        let size = std::fs::metadata(&file).unwrap().len();
        assert!(size > 10_000 && size < 25_000_000, "{name}: {size} bytes");
        let verified = Command::new(&rerun).args(["rrd", "verify"]).arg(&file).output().unwrap();
        assert!(verified.status.success(), "{name}: {}", stderr(&verified));
    }
}

#[test]
fn a_recording_that_cannot_be_written_is_an_error() {
    let scenario = library("low-thw-overtake");
    let output = closecall(["run", scenario.to_str().unwrap(), "--record", "/nowhere/at/all.rrd"]);
    assert_eq!(code(&output), 6, "{}", stderr(&output));
}

#[test]
fn a_viewer_s_switch_that_would_lose_the_recording_is_an_error() {
    let folder = folder();
    let file = folder.path().join("run.rrd");
    let scenario = library("low-thw-overtake");
    let output = Command::new(env!("CARGO_BIN_EXE_closecall"))
        .args(["run", scenario.to_str().unwrap(), "--record", file.to_str().unwrap()])
        .env("RERUN", "off")
        .output()
        .unwrap();
    assert_eq!(code(&output), 6, "{}", stderr(&output));
    assert!(stderr(&output).contains("RERUN"), "{}", stderr(&output));
    assert!(!file.exists());
}
