//! Recordings with the blemishes that public bug reports describe: the lane changes of the clean
//! file, or a refusal that names the cause. A wrong number never leaves with exit code 0.

use std::fs;
use std::path::{Path, PathBuf};

use closecall_testing::data;
use serde_json::Value;

use crate::support::{closecall, code, folder, json, library, message, stderr, stdout};

/// Exit code of wrong input.
const WRONG_INPUT: i32 = 3;
/// Exit code of a result that cannot be told.
const INCONCLUSIVE: i32 = 4;

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
    message(&output)
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
    for phase in [0, 1] {
        let second = thinned(&clean, &folder.path().join("second"), |frame, _| frame % 2 == phase);
        let changes = lane_changes(&second, &[]).0.len();
        assert!(changes.abs_diff(whole) <= 1, "phase {phase}: {changes} instead of {whole}");
    }
    // Every fourth frame misses up to three lane changes, which depends on the first frame.
    let fourth = thinned(&clean, &folder.path().join("fourth"), |frame, _| frame % 4 == 3);
    for command in ["lane-changes", "criticality"] {
        let output = closecall(["traffic", command, fourth.to_str().unwrap()]);
        stdout(&output, INCONCLUSIVE);
        assert!(stderr(&output).contains("only every 0.40 s"), "{command}: {}", stderr(&output));
    }
    let lost = lane_changes(&thinned(&clean, &folder.path().join("lost"), |_, line| line % 50 != 7), &[]).0.len();
    assert!(lost.abs_diff(whole) <= 1, "{lost} instead of {whole}");
}

/// Writes a copy of a plain file, with `change` applied to each row, by the names of its columns, and
/// returns the file.
fn changed(clean: &Path, to: &Path, change: impl Fn(&dyn Fn(&str) -> f64) -> Vec<(&'static str, f64)>) -> PathBuf {
    let text = fs::read_to_string(clean).unwrap();
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let column = |name: &str| header.iter().position(|other| *other == name).unwrap();
    let mut written = header.join(",") + "\n";
    for line in lines {
        let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
        let values = change(&|name| fields[column(name)].parse().unwrap());
        for (name, value) in values {
            fields[column(name)] = value.to_string();
        }
        written += &(fields.join(",") + "\n");
    }
    fs::write(to, written).unwrap();
    to.to_owned()
}

#[test]
fn traffic_against_the_axis_of_the_road_is_refused_by_the_direction() {
    let folder = folder();
    let clean = recorded(folder.path());
    let whole = lane_changes(&clean, &[]).0.len();
    let reversed = changed(&clean, &folder.path().join("reversed.csv"), |row| vec![("s_m", 1_000.0 - row("s_m"))]);
    let message = refusal(&reversed, &[]);
    assert!(message.contains("falls in the direction of travel") && message.contains("--reverse-s"), "{message}");
    assert_eq!(lane_changes(&reversed, &["--reverse-s"]).0.len(), whole);
    let negative = changed(&clean, &folder.path().join("negative.csv"), |row| {
        vec![("s_m", 1_000.0 - row("s_m")), ("speed_mps", -row("speed_mps"))]
    });
    let message = refusal(&negative, &[]);
    assert!(message.contains("--reverse-s") && !message.contains("--drop-bad-rows"), "{message}");
    assert_eq!(lane_changes(&negative, &["--reverse-s"]).0.len(), whole);
    let both = changed(&clean, &folder.path().join("both.csv"), |row| {
        let s_m = row("s_m");
        vec![("s_m", if row("track_id") % 2.0 == 0.0 { 1_000.0 - s_m } else { s_m })]
    });
    for options in [&[][..], &["--reverse-s"]] {
        assert!(refusal(&both, options).contains("each direction needs a file of its own"));
    }
}

#[test]
fn times_that_jitter_are_read_and_mixed_steps_are_refused_without_advice_to_drop_rows() {
    let folder = folder();
    let clean = recorded(folder.path());
    let whole = lane_changes(&clean, &[]).0.len();
    let moved = |name: &str, late_s: &dyn Fn(f64) -> f64| {
        changed(&clean, &folder.path().join(name), |row| {
            let time_s = row("time_s") + 1.0 + late_s(row("frame"));
            vec![("time_s", (time_s * 1_000.0).round() / 1_000.0)]
        })
    };
    let jitter = moved("jitter.csv", &|frame| 0.003 * closecall_traffic::maths::sin(12.9898 * frame));
    assert_eq!(lane_changes(&jitter, &[]).0.len(), whole);
    // Steps of 65 and of 15 ms take turns.
    let mixed = moved("mixed.csv", &|frame| 0.05 * (frame / 2.0).fract());
    let message = refusal(&mixed, &[]);
    assert!(message.contains("follow no clock") && !message.contains("--drop-bad-rows"), "{message}");
    // After half of the frames, one is missing, but the numbers go on.
    let missing = moved("missing.csv", &|frame| if frame >= 60.0 { 1.0 } else { 0.0 });
    assert!(refusal(&missing, &[]).contains("goes on by"));
}

#[test]
fn a_heading_or_a_position_in_the_plane_against_the_lateral_position_is_refused() {
    let folder = folder();
    let clean = recorded(folder.path());
    let left = |file: &Path, options: &[&str]| {
        let changes = lane_changes(file, options).0;
        (changes.iter().filter(|change| change["direction"] == "left").count(), changes.len())
    };
    let whole = left(&clean, &[]);
    // Both axes are turned, so that lanes and positions agree, and left would be called right.
    let turned = changed(&clean, &folder.path().join("turned.csv"), |row| {
        vec![("d_m", -row("d_m")), ("lane_id", 3.0 - row("lane_id"))]
    });
    let message = refusal(&turned, &[]);
    assert!(message.contains("`heading_rel_rad` contradict") && message.contains("--mirror-d"), "{message}");
    assert_eq!(left(&turned, &["--mirror-d", "--lanes-from-right"]), whole);
    let plane = changed(&clean, &folder.path().join("plane.csv"), |row| vec![("y_m", -row("y_m"))]);
    assert!(refusal(&plane, &[]).contains("`x_m, y_m` contradict"));
}

#[test]
fn lateral_positions_in_feet_are_refused_by_that_reason() {
    let folder = folder();
    let clean = recorded(folder.path());
    let in_feet = changed(&clean, &folder.path().join("feet.csv"), |row| vec![("d_m", row("d_m") / 0.3048)]);
    for command in ["inspect", "lane-changes", "criticality", "fit"] {
        let fitted = folder.path().join("fitted.toml");
        let more = if command == "fit" { vec!["-o", fitted.to_str().unwrap()] } else { Vec::new() };
        let output = closecall(["traffic", command, in_feet.to_str().unwrap()].into_iter().chain(more));
        stdout(&output, WRONG_INPUT);
        let message = message(&output);
        let said = ["lanes 1 and 2", "`d_m` in feet", "feet.csv", "--lanes `none`"];
        assert!(said.iter().all(|said| message.contains(said)), "{command}: {message}");
    }
    let mended = changed(&in_feet, &folder.path().join("mended.csv"), |row| vec![("d_m", row("d_m") * 0.3048)]);
    assert_eq!(lane_changes(&mended, &[]).0.len(), lane_changes(&clean, &[]).0.len());
}

/// Returns the plain file of a window of US-101.
fn window(name: &str) -> Option<PathBuf> {
    Some(data()?.join("ngsim_us101/trajectories").join(name))
}

#[test]
fn half_lateral_positions_are_refused_by_the_lane_width() {
    let Some(clean) = window("us101_a.csv") else { return };
    let folder = folder();
    for (name, factor, width) in [("half.csv", 0.5, "1.8 m apart"), ("feet.csv", 1.0 / 0.3048, "`d_m` in feet")] {
        let scaled = changed(&clean, &folder.path().join(name), |row| vec![("d_m", row("d_m") * factor)]);
        let message = refusal(&scaled, &[]);
        assert!(message.contains(width) && message.contains("--lanes `none`"), "{name}: {message}");
    }
    assert_eq!(lane_changes(&changed(&clean, &folder.path().join("same.csv"), |_| Vec::new()), &[]).0.len(), 21);
}

#[test]
fn ngsim_with_positions_in_metres_and_sizes_in_feet_is_refused() {
    let Some(data) = data() else { return };
    let folder = folder();
    let clean = data.join("ngsim_us101/us101_a_ngsim18col_feet.csv");
    let in_metres = changed(&clean, &folder.path().join("metres.csv"), |row| {
        ["Local_X", "Local_Y", "v_Vel", "v_Acc"].map(|name| (name, 0.3048 * row(name))).to_vec()
    });
    let message = refusal(&in_metres, &[]);
    assert!(message.contains("`Local_X` in metres instead of feet"), "{message}");
    assert_eq!(lane_changes(&clean, &[]).0.len(), 21);
}

#[test]
fn lanes_whose_numbers_follow_no_order_are_refused_by_that_reason() {
    let Some(clean) = window("us101_a.csv") else { return };
    let folder = folder();
    let orders =
        [("permuted.csv", [3.0, 6.0, 7.0, 5.0, 1.0, 4.0, 2.0]), ("two.csv", [1.0, 3.0, 2.0, 4.0, 5.0, 6.0, 7.0])];
    for (name, numbers) in orders {
        let number = |lane: f64| numbers[lane as usize - 1];
        let permuted = changed(&clean, &folder.path().join(name), |row| vec![("lane_id", number(row("lane_id")))]);
        let message = refusal(&permuted, &[]);
        let said = ["not in the order of the lanes", "--lanes `none`"];
        assert!(said.iter().all(|said| message.contains(said)), "{name}: {message}");
        assert!(!message.contains("from the right"), "{name}: {message}");
    }
}

#[test]
fn one_lane_number_for_all_vehicles_is_no_success_of_any_command() {
    let Some(clean) = window("us101_a.csv") else { return };
    let folder = folder();
    let of_clean = folder.path().join("clean.toml");
    stdout(&closecall(["traffic", "fit", clean.to_str().unwrap(), "-o", of_clean.to_str().unwrap()]), 0);
    let one = changed(&clean, &folder.path().join("one.csv"), |_| vec![("lane_id", 1.0)]);
    let (one, of_clean) = (one.to_str().unwrap(), of_clean.to_str().unwrap());
    let drift = ["drift", of_clean, one];
    let others = ["lane-changes", "criticality", "fit", "statistics", "inspect"].map(|command| [command, one]);
    for words in others.iter().map(|words| &words[..]).chain([&drift[..]]) {
        let output = closecall(["traffic"].iter().chain(words));
        assert_eq!(code(&output), INCONCLUSIVE, "{words:?}: {}", stderr(&output));
        assert!(stderr(&output).contains("`--lanes none`"), "{words:?}: {}", stderr(&output));
    }
    for [command, _] in others {
        let output = closecall(["traffic", command, clean.to_str().unwrap()]);
        assert!(!stderr(&output).contains("are spread over"), "{command}: {}", stderr(&output));
        stdout(&output, 0);
    }
}

/// The file states its positions in the lane and on the road only, which agree with each other.
#[test]
fn a_mirrored_recording_is_no_success_of_any_command_and_the_named_options_turn_it() {
    let folder = folder();
    let clean = recorded(folder.path());
    let mirrored = changed(&clean, &folder.path().join("mirrored.csv"), |value| {
        let unknown = ["heading_rel_rad", "x_m", "y_m"].map(|name| (name, 0.0));
        unknown.into_iter().chain([("d_m", -value("d_m")), ("lane_id", 3.0 - value("lane_id"))]).collect()
    });
    let file = mirrored.to_str().unwrap();
    let study = ["robustness", file, "--repetitions", "1"];
    let others = ["lane-changes", "criticality", "fit", "statistics"].map(|command| [command, file]);
    for words in others.iter().map(|words| &words[..]).chain([&study[..]]) {
        let output = closecall(["traffic"].iter().chain(words));
        assert_eq!(code(&output), INCONCLUSIVE, "{words:?}: {}", stderr(&output));
        assert!(stderr(&output).contains("the positions are mirrored"), "{words:?}: {}", stderr(&output));
    }
    let output = closecall(["traffic", "lane-changes", file]);
    assert!(stderr(&output).contains("`--mirror-d --lanes-from-right`"), "{}", stderr(&output));
    let options = ["--mirror-d", "--lanes-from-right"];
    assert_eq!(lane_changes(&mirrored, &options).0, lane_changes(&clean, &[]).0);
}

/// Writes three vehicles at 30 m/s. The first one moves to the left by 3.75 m within
/// `duration_s`, if that is given.
fn three_vehicles(to: &Path, duration_s: Option<f64>) -> PathBuf {
    let mut text =
        "track_id,frame,time_s,s_m,d_m,lane_id,speed_mps,accel_mps2,length_m,width_m,vehicle_class\n".to_owned();
    for frame in 0..200 {
        let time_s = 0.1 * f64::from(frame);
        let tau = duration_s.map_or(0.0, |duration_s| ((time_s - 10.0) / duration_s).clamp(0.0, 1.0));
        let left_m = 3.75 * tau.powi(3) * (10.0 - 15.0 * tau + 6.0 * tau * tau);
        for (track, s_m, d_m) in [(1, 0.0, 5.625 - left_m), (2, 60.0, 5.625), (3, -80.0, 1.875)] {
            let (s_m, lane) = (s_m + 30.0 * time_s, if d_m < 3.75 { 1 } else { 2 });
            text += &format!("{track},{frame},{time_s:.1},{s_m:.3},{d_m:.3},{lane},30,0,4.5,1.8,car\n");
        }
    }
    fs::write(to, text).unwrap();
    to.to_owned()
}

#[test]
fn a_file_without_lane_changes_is_no_wrong_command_line_and_no_success() {
    let folder = folder();
    let straight = three_vehicles(&folder.path().join("straight.csv"), None);
    let fitted = folder.path().join("fitted.toml");
    let straight = straight.to_str().unwrap();
    let sample = ["sample", straight, "--vary", "cc1", "--from", "1.5", "--to", "0.3"];
    for words in [&["reenact", straight][..], &["reenact", straight, "--track", "1"], &sample] {
        let output = closecall(["traffic"].iter().chain(words));
        stdout(&output, INCONCLUSIVE);
        assert!(stderr(&output).contains("has no lane change"), "{words:?}: {}", stderr(&output));
        assert!(!stderr(&output).contains("--help"), "{}", stderr(&output));
    }
    let output = closecall(["traffic", "fit", straight, "-o", fitted.to_str().unwrap()]);
    stdout(&output, INCONCLUSIVE);
    assert!(stderr(&output).contains("enough values") && !fitted.exists(), "{}", stderr(&output));
    let pictures = folder.path().join("paper");
    let paper = ["paper", straight, "--repetitions", "0", "-o", pictures.to_str().unwrap()];
    let none = ["lane-changes", straight, "--lanes", "none"];
    let commands = ["lane-changes", "criticality", "statistics"].map(|command| [command, straight]);
    for words in commands.iter().map(|words| &words[..]).chain([&paper[..], &none]) {
        let output = closecall(["traffic"].iter().chain(words));
        stdout(&output, INCONCLUSIVE);
        assert!(stderr(&output).contains("straight.csv: no lane change is found"), "{words:?}: {}", stderr(&output));
    }
    // Another track does change lanes: the command line is wrong.
    let changing = three_vehicles(&folder.path().join("changing.csv"), Some(5.0));
    stdout(&closecall(["traffic", "reenact", changing.to_str().unwrap(), "--track", "2"]), 2);
}

#[test]
fn a_value_beyond_what_a_vehicle_can_do_is_named_in_the_text() {
    let folder = folder();
    for (duration_s, implausible) in [(0.6, true), (5.0, false)] {
        let file = three_vehicles(&folder.path().join(format!("{duration_s}.csv")), Some(duration_s));
        let text = stdout(&closecall(["traffic", "criticality", file.to_str().unwrap(), "--all"]), 0);
        assert_eq!(text.contains("implausible: beyond what a vehicle can do"), implausible, "{text}");
        assert_eq!(text.contains("1 of them implausible"), implausible, "{text}");
    }
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

/// Writes ten pairs of vehicles side by side, in lanes of `lane_m`. None of them changes lanes. At
/// 10 s, `missing` frames of `step_s` are lost, and the two numbers of each pair are swapped.
fn swapped_pairs(to: &Path, lane_m: f64, step_s: f64, missing: u32) -> PathBuf {
    let mut text =
        "track_id,frame,time_s,s_m,d_m,lane_id,speed_mps,accel_mps2,length_m,width_m,vehicle_class\n".to_owned();
    let (swap, last) = ((10.0 / step_s).round() as u32, (30.0 / step_s).round() as u32);
    for frame in (0..last).filter(|frame| !(swap..swap + missing).contains(frame)) {
        let time_s = step_s * f64::from(frame);
        for vehicle in 0..20_u32 {
            let track = if frame < swap { vehicle } else { vehicle ^ 1 };
            let lane = 1 + vehicle % 2;
            let s_m = 60.0 * f64::from(vehicle / 2) + 8.0 * f64::from(vehicle % 2) + 28.0 * time_s;
            let d_m = lane_m * (f64::from(lane) - 0.5);
            text += &format!("{track},{frame},{time_s:.2},{s_m:.3},{d_m:.3},{lane},28,0,4.5,1.8,car\n");
        }
    }
    fs::write(to, text).unwrap();
    to.to_owned()
}

#[test]
fn numbers_swapped_across_a_gap_make_no_lane_change() {
    let folder = folder();
    for (lane_m, step_s, missing) in
        [(3.5, 0.1, 4), (3.75, 0.1, 4), (3.0, 0.1, 2), (3.0, 0.04, 10), (3.0, 0.4, 0), (3.5, 0.4, 1), (3.0, 0.2, 2)]
    {
        let file = swapped_pairs(&folder.path().join("swapped.csv"), lane_m, step_s, missing);
        let case = format!("lanes of {lane_m} m, {missing} frames of {step_s} s missing");
        let output = closecall(["traffic", "lane-changes", file.to_str().unwrap(), "--format", "json"]);
        assert_eq!(serde_json::from_slice::<Value>(&output.stdout).unwrap(), Value::Array(Vec::new()), "{case}");
        assert!(stderr(&output).contains("20 jumps"), "{case}: {}", stderr(&output));
    }
}

#[test]
fn lane_changes_in_gaps_are_counted_and_no_success() {
    let folder = folder();
    let clean = three_vehicles(&folder.path().join("clean.csv"), Some(5.0));
    assert_eq!(lane_changes(&clean, &[]).0.len(), 1);
    // Of the three vehicles, the first one crosses the marking at 12.5 s, in frame 125.
    let is_lost = |frame: u64, line: usize| line.is_multiple_of(3) && (119..131).contains(&frame);
    let missing = thinned(&clean, &folder.path().join("missing.csv"), |frame, line| !is_lost(frame, line));
    let text = fs::read_to_string(&clean).unwrap();
    let (header, rows) = text.split_once('\n').unwrap();
    let spoilt = |(line, row): (usize, &str)| {
        if is_lost(line as u64 / 3, line) { row.replace(",car", ",car,1") } else { row.to_owned() }
    };
    let rows: Vec<String> = rows.lines().enumerate().map(spoilt).collect();
    let bad = folder.path().join("bad.csv");
    fs::write(&bad, format!("{header}\n{}\n", rows.join("\n"))).unwrap();
    for command in ["lane-changes", "criticality", "statistics", "fit"] {
        for (file, options) in [(&missing, &[][..]), (&bad, &["--drop-bad-rows"][..])] {
            let words = ["traffic", command, file.to_str().unwrap()];
            let output = closecall(words.iter().chain(options));
            assert_eq!(code(&output), INCONCLUSIVE, "{command}: {}", stderr(&output));
            let warning = "1 of 1 changes of the recorded lane lie in gaps";
            assert!(stderr(&output).contains(warning), "{command}: {}", stderr(&output));
            assert!(!stderr(&output).contains("no vehicle changes its recorded lane"), "{}", stderr(&output));
        }
    }
    // A gap beside the lane change hides nothing.
    let beside =
        thinned(&clean, &folder.path().join("beside.csv"), |frame, line| line % 3 != 0 || !(20..31).contains(&frame));
    assert_eq!(lane_changes(&beside, &[]).0.len(), 1);
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
        let message = refusal(&from_right, options);
        assert!(
            ["from the right", "--lanes-from-right", "--mirror-d"].iter().all(|word| message.contains(word)),
            "{message}"
        );
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
fn decimal_commas_without_semicolons_are_refused_by_that_reason() {
    let folder = folder();
    let text = fs::read_to_string(recorded(folder.path())).unwrap();
    let with_commas = |line: &str, separator: &str, quote: &str| {
        let fields: Vec<String> =
            line.split(',').map(|field| format!("{quote}{}{quote}", field.replace('.', ","))).collect();
        fields.join(separator)
    };
    let file = folder.path().join("commas.csv");
    for (separator, quote) in [("\t", ""), (",", "\"")] {
        let lines: Vec<String> = text.lines().map(|line| with_commas(line, separator, quote)).collect();
        fs::write(&file, lines.join("\n") + "\n").unwrap();
        for options in [&[][..], &["--drop-bad-rows"][..]] {
            let message = refusal(&file, options);
            assert!(message.contains("decimal comma") && !message.contains("drop-bad-rows"), "{message}");
        }
    }
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
        ("a.xosc", "<?xml version=\"1.0\"?>\n<OpenSCENARIO>\n</OpenSCENARIO>\n", "an OpenSCENARIO scenario"),
        ("a.xodr", "<?xml version=\"1.0\"?>\n<OpenDRIVE>\n</OpenDRIVE>\n", "an OpenDRIVE road network"),
        ("a.osi", "\u{10}\0\0\0\u{1}\u{2}", "the file is cut after 2 of its 16 bytes"),
        ("u.csv", "t\0r\0a\0c\0k\0_\0i\0d\0", "UTF-16"),
        ("a.xml", "<?xml version=\"1.0\"?>\n<!-- generated -->\n<fcd-export>\n</fcd-export>\n", "there are no rows"),
    ];
    for (name, text, reason) in files {
        let file = folder.path().join(name);
        fs::write(&file, text).unwrap();
        let message = refusal(&file, &[]);
        assert!(message.contains(reason) && message.contains(name), "{message}");
    }
}
