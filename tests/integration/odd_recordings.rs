//! Recordings with the blemishes that public bug reports describe: the lane changes of the clean
//! file, or a refusal that names the cause. A wrong number never leaves with exit code 0.

use std::fs;
use std::path::{Path, PathBuf};

use closecall_testing::data;
use serde_json::Value;

use crate::support::{closecall, folder, json, library, stderr, stdout};

/// Exit code of wrong input.
const WRONG_INPUT: i32 = 3;

/// Returns the file of this name among the odd recordings.
fn odd(name: &str) -> Option<PathBuf> {
    Some(data()?.join("odd_recordings").join(name))
}

/// Returns the lane changes that are found, and the warnings.
fn lane_changes(file: &Path, options: &[&str]) -> (Vec<Value>, String) {
    let words = ["traffic", "lane-changes", file.to_str().unwrap(), "--format", "json"];
    let output = closecall(words.iter().chain(options));
    (json(&output, 0).as_array().unwrap().clone(), stderr(&output))
}

/// Returns the message of a refusal.
fn refusal(file: &Path, options: &[&str]) -> String {
    let output = closecall(["traffic", "lane-changes", file.to_str().unwrap()].iter().chain(options));
    stdout(&output, WRONG_INPUT);
    stderr(&output)
}

/// Writes the rows for which `keep` returns true, given their column `frame` and their line, and
/// returns the file.
fn thinned(clean: &Path, to: &Path, keep: impl Fn(u64, usize) -> bool) -> PathBuf {
    let text = fs::read_to_string(clean).unwrap();
    let mut lines = text.lines();
    let header = lines.next().unwrap();
    let column = header.split(',').position(|name| name == "frame").unwrap();
    let frame = |line: &str| line.split(',').nth(column).unwrap().parse().unwrap();
    let kept = lines.enumerate().filter(|(index, line)| keep(frame(line), *index)).map(|(_, line)| line);
    let text: Vec<&str> = std::iter::once(header).chain(kept).collect();
    fs::write(to, text.join("\n") + "\n").unwrap();
    to.to_owned()
}

/// Returns a recording of 40 overtaking vehicles.
fn recorded(folder: &Path) -> PathBuf {
    let csv = folder.join("clean.csv");
    let scenario = library("overtake-without-brake");
    let arguments = ["-n", "40", "--controller", "acc", "-o", csv.to_str().unwrap()];
    stdout(&closecall(["traffic", "record", scenario.to_str().unwrap()].iter().chain(&arguments)), 0);
    csv
}

#[test]
fn a_file_with_fewer_frames_has_the_lane_changes_of_the_whole_file() {
    let folder = folder();
    let clean = recorded(folder.path());
    let whole = lane_changes(&clean, &[]).0.len();
    assert!(whole >= 35, "{whole}");
    let thin = |name: &str, keep: &dyn Fn(u64, usize) -> bool| {
        let (changes, warnings) = lane_changes(&thinned(&clean, &folder.path().join(name), keep), &[]);
        assert!(changes.len().abs_diff(whole) <= 1, "{name}: {} instead of {whole}", changes.len());
        warnings
    };
    assert_eq!(thin("second", &|frame, _| frame % 2 == 0), "");
    assert_eq!(thin("fourth", &|frame, _| frame % 4 == 0), "");
    let warnings = thin("one in fifty lost", &|_, line| line % 50 != 7);
    assert!(warnings.contains("were bridged"), "{warnings}");
    let warnings = thin("one in seven lost", &|_, line| (line * line) % 7 != 2);
    assert!(warnings.contains("were bridged"), "{warnings}");
}

#[test]
fn recorded_traffic_with_fewer_frames_keeps_its_lane_changes() {
    let Some(data) = data() else { return };
    let clean = data.join("ngsim_us101/trajectories/us101_a.csv");
    let folder = folder();
    let whole = lane_changes(&clean, &[]).0.len();
    for (name, step) in [("second", 2), ("fourth", 4)] {
        let changes =
            lane_changes(&thinned(&clean, &folder.path().join(name), |frame, _| frame % step == 0), &[]).0.len();
        assert!(changes.abs_diff(whole) <= 1, "{name}: {changes} instead of {whole}");
    }
    let lost = lane_changes(&thinned(&clean, &folder.path().join("lost"), |_, line| line % 50 != 7), &[]).0.len();
    assert!(lost.abs_diff(whole) <= 1, "{lost} instead of {whole}");
}

#[test]
fn a_file_of_shreds_is_refused() {
    let folder = folder();
    let clean = recorded(folder.path());
    // Five frames of twenty-five: a fifth of a second, and nearly a second without.
    let shreds = thinned(&clean, &folder.path().join("shreds.csv"), |frame, _| frame % 25 < 5);
    let message = refusal(&shreds, &[]);
    assert!(message.contains("pieces") && message.contains("shreds.csv"), "{message}");
}

#[test]
fn swapped_and_reused_numbers_make_no_lane_change() {
    let Some(swapped) = odd("id_switch.csv") else { return };
    let (changes, warnings) = lane_changes(&swapped, &[]);
    // Two vehicles of four change lanes. The other two swap their numbers.
    let tracks: Vec<u64> = changes.iter().filter_map(|change| change["track_id"].as_u64()).collect();
    assert_eq!(tracks, [4, 5], "{changes:?}");
    assert!(warnings.contains("jumps"), "{warnings}");
    let reused = odd("reuse_nogap.csv").unwrap();
    let words = ["traffic", "criticality", reused.to_str().unwrap(), "--format", "json"];
    let changes = json(&closecall(words), 0);
    for change in changes.as_array().unwrap() {
        assert_ne!(change["metrics"]["a_lat_mps2"]["critical"], Value::Bool(true), "{change}");
    }
}

#[test]
fn lanes_against_the_lateral_position_are_refused_by_the_axis() {
    let Some(from_right) = odd("lanes_from_right.csv") else { return };
    let mirrored = odd("flip_d.csv").unwrap();
    let left = |file: &Path, option: &str| {
        let changes = lane_changes(file, &[option]).0;
        let left = changes.iter().filter(|change| change["direction"] == "left").count();
        assert_eq!((left, changes.len()), (2, 2), "{changes:?}");
    };
    for options in [&[][..], &["--lanes", "none"]] {
        assert!(refusal(&from_right, options).contains("from the right"));
        assert!(refusal(&mirrored, options).contains("points to the left"));
    }
    left(&from_right, "--lanes-from-right");
    left(&mirrored, "--mirror-d");
}

#[test]
fn spreadsheets_of_other_countries_and_whole_numbers_as_floats_are_read() {
    let Some(first) = odd("semicolon_comma.csv") else { return };
    for file in
        [first, odd("float_ids.csv").unwrap(), odd("float_lanes.csv").unwrap(), odd("every_second_frame.csv").unwrap()]
    {
        let changes = lane_changes(&file, &[]).0;
        assert_eq!(changes.len(), 2, "{}: {changes:?}", file.display());
    }
    let cut = odd("cut_in_row.csv").unwrap();
    let message = refusal(&cut, &[]);
    assert!(message.contains("--drop-bad-rows"), "{message}");
    let (changes, _) = lane_changes(&cut, &["--drop-bad-rows"]);
    assert!(!changes.is_empty());
}

#[test]
fn a_whole_file_without_a_last_line_end_is_read_and_a_cut_one_is_not() {
    let folder = folder();
    let clean = recorded(folder.path());
    let text = fs::read_to_string(&clean).unwrap();
    let unended = folder.path().join("unended.csv");
    fs::write(&unended, text.trim_end()).unwrap();
    assert_eq!(lane_changes(&unended, &[]).0, lane_changes(&clean, &[]).0);
    fs::write(&unended, &text[..text.len() - 4]).unwrap();
    assert!(refusal(&unended, &[]).contains("the last line does not end"));
}

#[test]
fn files_of_other_programs_that_lack_something_are_refused_by_that_reason() {
    let folder = folder();
    let files = [
        ("a.parquet", "PAR1\u{15}\u{4}", "no Parquet file that can be read"),
        ("a.fzp", "$VISION\n* File: a.inpx\n$VEHICLE:SIMSEC;NO;LANE\\LINK\\NO\n", "which the Vissim layout needs"),
        ("a.json", "[{\"timestamp\": [1.0], \"x_position\": [2.0]}]", "missing field `y_position`"),
        ("a.xml", "<?xml version=\"1.0\"?>\n<!-- generated -->\n<fcd-export>\n</fcd-export>\n", "there are no rows"),
    ];
    for (name, text, reason) in files {
        let file = folder.path().join(name);
        fs::write(&file, text).unwrap();
        let message = refusal(&file, &[]);
        assert!(message.contains(reason) && message.contains(name), "{message}");
    }
}
