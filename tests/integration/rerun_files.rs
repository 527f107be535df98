//! Recordings of runs pass the verification of the Rerun viewer.

use std::path::{Path, PathBuf};
use std::process::Command;

use closecall_testing::viewer;

use crate::support::{all_of_library, closecall, code, folder, library, program, stderr, stdout};

/// Fails if the viewer does not verify a recording, or if the recording lacks a timeline or an
/// entity that its blueprint shows.
fn verify(viewer: &Path, files: &[PathBuf]) {
    let verified = Command::new(viewer).args(["rrd", "verify"]).args(files).output().unwrap();
    assert!(verified.status.success(), "{}", stderr(&verified));
    for file in files {
        let size = std::fs::metadata(file).unwrap().len();
        assert!(size > 10_000 && size < 25_000_000, "{}: {size} bytes", file.display());
        let printed = Command::new(viewer).args(["rrd", "print", "-vv"]).arg(file).output().unwrap();
        let printed = String::from_utf8_lossy(&printed.stdout).into_owned();
        for named in ["opening", "time", "step", "/verdict", "/summary", "plots/speed/"] {
            assert!(printed.contains(named), "{}: no `{named}`", file.display());
        }
    }
}

#[test]
fn the_recording_of_every_library_scenario_verifies() {
    let Some(viewer) = viewer() else { return };
    let folder = folder();
    let recorded = all_of_library().into_iter().map(|scenario| {
        let file = folder.path().join(scenario.file_stem().unwrap()).with_extension("rrd");
        stdout(&closecall(["run", scenario.to_str().unwrap(), "--record", file.to_str().unwrap()]), 0);
        file
    });
    verify(&viewer, &recorded.collect::<Vec<_>>());
}

#[test]
fn recordings_of_a_pair_a_full_run_and_recorded_traffic_verify() {
    let Some(viewer) = viewer() else { return };
    let folder = folder();
    let file = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (figure, headline) = (library("paper-figure"), library("low-thw-overtake"));
    let [pair, full, traffic, beside] = ["pair.rrd", "full.rrd", "traffic.rrd", "beside.rrd"].map(file);
    stdout(&closecall(["run", figure.to_str().unwrap(), "--paired", "--record", &pair]), 0);
    stdout(&closecall(["run", headline.to_str().unwrap(), "--sensors", "full", "--record", &full]), 0);
    let trajectories = file("own.csv");
    stdout(&closecall(["traffic", "record", headline.to_str().unwrap(), "-n", "2", "-o", &trajectories]), 0);
    stdout(&closecall(["traffic", "criticality", &trajectories, "--record", &traffic]), 0);
    stdout(&closecall(["traffic", "reenact", &trajectories, "--record", &beside]), 0);
    verify(&viewer, &[pair, full, traffic, beside].map(PathBuf::from));
    let none = closecall(["traffic", "criticality", &trajectories, "--record", &file("none.rrd"), "--track", "99999"]);
    assert_eq!(code(&none), 2, "{}", stderr(&none));
    assert!(stderr(&none).contains("no lane change of track 99999"), "{}", stderr(&none));
}

#[test]
fn the_same_run_gives_the_same_rows() {
    let Some(viewer) = viewer() else { return };
    let folder = folder();
    let written = |name: &str, scenario: &str, more: &[&str]| {
        let file = folder.path().join(name).to_str().unwrap().to_owned();
        stdout(&closecall(["run", library(scenario).to_str().unwrap(), "--record", &file].iter().chain(more)), 0);
        file
    };
    let compared = |first: &str, second: &str| {
        Command::new(&viewer).args(["rrd", "compare", "--unordered", first, second]).output().unwrap()
    };
    for more in [["--paired"].as_slice(), ["--sensors", "full"].as_slice()] {
        let [first, second] = ["one.rrd", "two.rrd"].map(|name| written(name, "low-thw-overtake", more));
        let same = compared(&first, &second);
        assert!(same.status.success(), "{more:?}: {}", stderr(&same));
        let other = written("other.rrd", "paper-figure", more);
        assert!(!compared(&first, &other).status.success(), "{more:?}: another run has the same rows");
    }
}

#[test]
#[cfg(unix)]
fn a_full_disk_is_an_error_and_leaves_no_part_of_a_recording() {
    let folder = folder();
    let file = folder.path().join("run.rrd");
    // The shell limits files to 200 blocks of 512 or 1,024 bytes. With the signal for the limit
    // ignored, the write fails as on a full disk.
    let script = "ulimit -f 200; trap '' XFSZ; exec \"$@\"";
    let limited = Command::new("sh")
        .args(["-c", script, "sh", env!("CARGO_BIN_EXE_closecall"), "run"])
        .args([library("low-thw-overtake").to_str().unwrap(), "--record", file.to_str().unwrap()])
        .output()
        .unwrap();
    assert_eq!(code(&limited), 6, "{}", stderr(&limited));
    let message = stderr(&limited);
    assert!(message.contains("run.rrd") && message.to_lowercase().contains("file too large"), "{message}");
    assert!(!message.contains("at path"), "the temporary file is no concern of the user: {message}");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn recordings_stay_small() {
    let folder = folder();
    let scenario = library("paper-figure");
    let size = |sensors: &str| {
        let file = folder.path().join(format!("{sensors}.rrd"));
        let arguments = ["run", scenario.to_str().unwrap(), "--sensors", sensors, "--record", file.to_str().unwrap()];
        stdout(&closecall(arguments), 0);
        std::fs::metadata(&file).unwrap().len()
    };
    let [objects, full] = ["object", "full"].map(size);
    assert!(objects < 3_000_000 && full < 5_000_000, "{objects} {full}");
}

#[test]
fn a_recording_with_less_detail_is_smaller() {
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
fn a_campaign_records_the_selected_samples_and_lists_them_on_a_page() {
    let folder = folder();
    let out = folder.path().join("campaign");
    let scenario = library("low-thw-overtake");
    let arguments = ["campaign", scenario.to_str().unwrap(), "-n", "12", "--seed", "1", "--paired", "--no-gate"];
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
        assert!(page.contains(&format!("rerun {file}")), "the page does not list {file}");
    }
    // Each entry has a picture, and both arms in the view that the slider moves.
    assert_eq!(page.matches("<svg").count(), 3 * files.len());
    assert_eq!(page.matches("class=\"scrubber\"").count(), files.len());
    assert!(page.contains("<select name=\"verdict\"><option value=\"\">all</option>"));
    assert!(page.contains("--paired") && page.contains("Recorded as worst"));
    let wrong = closecall(["campaign", scenario.to_str().unwrap(), "-n", "1", "--record", "best:3"]);
    assert_eq!(code(&wrong), 2);
    assert!(stderr(&wrong).contains("worst:N"), "{}", stderr(&wrong));
}

#[test]
fn a_scenario_and_a_sample_of_a_campaign_give_the_same_figure() {
    let folder = folder();
    let scenario = library("paper-figure");
    let file = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (svg, png, out) = (file("figure.svg"), file("figure.png"), file("campaign"));
    stdout(&closecall(["plot", scenario.to_str().unwrap(), "--paired", "-o", &svg]), 0);
    stdout(&closecall(["campaign", scenario.to_str().unwrap(), "-n", "1", "--paired", "--no-gate", "--out", &out]), 0);
    stdout(&closecall(["plot", &out, "0", "-o", &png]), 0);
    assert!(std::fs::read_to_string(&svg).unwrap().starts_with("<svg"));
    assert_eq!(&std::fs::read(&png).unwrap()[1..4], b"PNG");
    let again = file("again.svg");
    stdout(&closecall(["plot", &out, "0", "-o", &again]), 0);
    assert_eq!(std::fs::read(&svg).unwrap(), std::fs::read(&again).unwrap());
    for wrong in [
        &["-o", &png][..],
        &["7", "-o", &png],
        &["0", "-o", &png, "--controller", "acc"],
        &["0", "-o", &png, "--sensors", "full"],
    ] {
        assert_eq!(code(&closecall(["plot", &out].iter().chain(wrong))), 2, "{wrong:?}");
    }
    let pdf = file("figure.pdf");
    stdout(&closecall(["plot", scenario.to_str().unwrap(), "--paired", "--width-mm", "180", "-o", &pdf]), 0);
    let page = std::fs::read(&pdf).unwrap();
    assert!(page.starts_with(b"%PDF-") && String::from_utf8_lossy(&page).contains("/MediaBox [0 0 510.2"));
    for wrong in [["-o", "figure.jpg"].as_slice(), &["-o", &pdf, "--width-mm", "nan"]] {
        let output = closecall(["plot", scenario.to_str().unwrap()].iter().chain(wrong));
        assert_eq!(code(&output), 2, "{wrong:?}");
        assert!(stderr(&output).contains("must end with") || stderr(&output).contains("from 50 to 1200"), "{wrong:?}");
    }
}

#[test]
fn a_recording_that_cannot_be_written_is_an_error() {
    let scenario = library("low-thw-overtake");
    let output = closecall(["run", scenario.to_str().unwrap(), "--record", "/nowhere/at/all.rrd"]);
    assert_eq!(code(&output), 6, "{}", stderr(&output));
}

#[test]
fn a_setting_of_the_rerun_sdk_that_suppresses_the_recording_is_an_error() {
    let folder = folder();
    let file = folder.path().join("run.rrd");
    let scenario = library("low-thw-overtake");
    let output = program()
        .args(["run", scenario.to_str().unwrap(), "--record", file.to_str().unwrap()])
        .env("RERUN", "off")
        .output()
        .unwrap();
    assert_eq!(code(&output), 6, "{}", stderr(&output));
    assert!(stderr(&output).contains("RERUN"), "{}", stderr(&output));
    assert!(!file.exists());
}
