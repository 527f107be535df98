//! Rerun files pass the viewer's own verification.

use std::path::{Path, PathBuf};
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

/// Has the viewer check a file, and look for what the blueprint needs of its timelines.
fn verify(rerun: &Path, file: &Path) {
    let size = std::fs::metadata(file).unwrap().len();
    assert!(size > 10_000 && size < 25_000_000, "{}: {size} bytes", file.display());
    let verified = Command::new(rerun).args(["rrd", "verify"]).arg(file).output().unwrap();
    assert!(verified.status.success(), "{}: {}", file.display(), stderr(&verified));
    let printed = Command::new(rerun).args(["rrd", "print", "-vv"]).arg(file).output().unwrap();
    let printed = String::from_utf8_lossy(&printed.stdout).into_owned();
    for named in ["until_critical", "time", "step", "/summary", "plots/speed/"] {
        assert!(printed.contains(named), "{}: no `{named}`", file.display());
    }
}

#[test]
fn every_library_scenario_is_recorded_into_a_file_that_verifies() {
    let Some(rerun) = rerun() else { return };
    let folder = folder();
    let library = library("any");
    let scenarios = std::fs::read_dir(library.parent().unwrap()).unwrap().map(|entry| entry.unwrap().path());
    let mut count = 0;
    for scenario in scenarios.filter(|path| path.extension().is_some_and(|extension| extension == "toml")) {
        let file = folder.path().join(scenario.file_stem().unwrap()).with_extension("rrd");
        stdout(&closecall(["run", scenario.to_str().unwrap(), "--record", file.to_str().unwrap()]), 0);
        verify(&rerun, &file);
        count += 1;
    }
    assert!(count >= 8, "{count} scenarios");
}

#[test]
fn a_pair_a_full_run_and_recorded_traffic_verify_too() {
    let Some(rerun) = rerun() else { return };
    let folder = folder();
    let file = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (figure, headline) = (library("paper-figure"), library("low-thw-overtake"));
    let [pair, full, traffic, beside] = ["pair.rrd", "full.rrd", "traffic.rrd", "beside.rrd"].map(file);
    stdout(&closecall(["run", figure.to_str().unwrap(), "--paired", "--record", &pair]), 0);
    stdout(&closecall(["run", headline.to_str().unwrap(), "--sensors", "full", "--record", &full]), 0);
    let own = file("own.csv");
    stdout(&closecall(["record", headline.to_str().unwrap(), "-n", "2", "-o", &own]), 0);
    stdout(&closecall(["criticality", &own, "--record", &traffic]), 0);
    stdout(&closecall(["reenact", &own, "--record", &beside]), 0);
    for file in [pair, full, traffic, beside] {
        verify(&rerun, Path::new(&file));
    }
    let none = closecall(["criticality", &own, "--record", &file("none.rrd"), "--track", "99999"]);
    assert_eq!(code(&none), 2, "{}", stderr(&none));
    assert!(stderr(&none).contains("no lane change of track 99999"), "{}", stderr(&none));
}

#[test]
fn less_detail_makes_smaller_files() {
    let folder = folder();
    let scenario = library("low-thw-overtake");
    let size = |level: &str| {
        let file = folder.path().join(format!("{level}.rrd"));
        let path = file.to_str().unwrap();
        let arguments = ["run", scenario.to_str().unwrap(), "--sensors", "full", "--record", path, "--record-level"];
        stdout(&closecall(arguments.iter().chain(&[level])), 0);
        std::fs::metadata(&file).unwrap().len()
    };
    let [events, objects, full] = ["events", "objects", "full"].map(size);
    assert!(events < objects && objects < full, "{events} {objects} {full}");
}

#[test]
fn a_campaign_records_what_is_selected_and_shows_it_on_a_page() {
    let folder = folder();
    let out = folder.path().join("campaign");
    let scenario = library("low-thw-overtake");
    let arguments = ["campaign", scenario.to_str().unwrap(), "-n", "12", "--seed", "1", "--paired"];
    let selection = ["--record", "worst:2,failures:1,random:2", "--out", out.to_str().unwrap()];
    stdout(&closecall(arguments.iter().chain(&selection)), 0);
    let page = std::fs::read_to_string(out.join("recordings/index.html")).unwrap();
    let files: Vec<String> = std::fs::read_dir(out.join("recordings"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name.ends_with(".rrd"))
        .collect();
    assert!(files.len() >= 2 && files.len() <= 5, "{files:?}");
    for file in &files {
        assert!(page.contains(&format!("rerun {file}")), "{file} is not on the page");
    }
    assert_eq!(page.matches("<svg").count(), files.len());
    assert!(page.contains("--paired") && page.contains("Recorded as worst"));
    let wrong = closecall(["campaign", scenario.to_str().unwrap(), "-n", "1", "--record", "best:3"]);
    assert_eq!(code(&wrong), 2);
    assert!(stderr(&wrong).contains("worst:N"), "{}", stderr(&wrong));
}

#[test]
fn an_encounter_is_plotted_from_a_scenario_and_from_a_campaign() {
    let folder = folder();
    let scenario = library("paper-figure");
    let file = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (svg, png, out) = (file("figure.svg"), file("figure.png"), file("campaign"));
    stdout(&closecall(["plot", scenario.to_str().unwrap(), "--paired", "-o", &svg]), 0);
    stdout(&closecall(["campaign", scenario.to_str().unwrap(), "-n", "1", "--paired", "--out", &out]), 0);
    stdout(&closecall(["plot", &out, "0", "-o", &png]), 0);
    assert!(std::fs::read_to_string(&svg).unwrap().starts_with("<svg"));
    assert_eq!(&std::fs::read(&png).unwrap()[1..4], b"PNG");
    let again = file("again.svg");
    stdout(&closecall(["plot", &out, "0", "-o", &again]), 0);
    assert_eq!(std::fs::read(&svg).unwrap(), std::fs::read(&again).unwrap());
    for wrong in [["plot", &out, "-o", &png].to_vec(), ["plot", &out, "7", "-o", &png].to_vec()] {
        assert_eq!(code(&closecall(wrong)), 2);
    }
    assert_eq!(code(&closecall(["plot", scenario.to_str().unwrap(), "-o", "figure.jpg"])), 2);
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
