//! `traffic aerial`: from a trajectory file over pictures to tracks, and what they lose.

use std::fs;

use serde_json::Value;

use crate::support::{closecall, code, folder, json, library, message, stdout};

/// The header of the plain CSV layout.
const HEADER: &str = "recording_id,track_id,vehicle_id,frame,time_s,s_m,d_m,lane_id,speed_mps,accel_mps2,heading_rel_rad,\
    x_m,y_m,length_m,width_m,vehicle_class,source_scenario";

#[test]
fn a_flight_writes_tracks_that_other_commands_read_and_states_what_they_lose() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (traffic, flown) = (at("traffic.csv"), at("flown"));
    let scenario = library("overtake-without-brake");
    let record = ["traffic", "record", scenario.to_str().unwrap(), "-n", "1", "--controller", "acc", "-o", &traffic];
    stdout(&closecall(record), 0);
    let fly = ["traffic", "aerial", &traffic, "-o", &flown, "--around-s", "4", "--georeferencing-m", "0"];
    let answer = json(&closecall(fly.into_iter().chain(["--format", "json"])), 0);
    let file = &answer["files"][0];
    // Four seconds before and after one lane change at 12.5 Hz.
    assert!((50..=202).contains(&file["pictures"].as_u64().unwrap()), "{file}");
    assert_eq!(file["pictures"], answer["losses"]["frames"]);
    let rows = answer["losses"]["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 4);
    let cars = &rows[1];
    assert_eq!((&cars["class"], &cars["is_corrected"]), (&"car".into(), &true.into()));
    assert!(cars["followed"].as_f64().unwrap() > 0.8, "{cars}");
    assert!(cars["bias_across_m"].as_f64().unwrap().abs() < 0.4, "{cars}");
    for name in ["truth", "raw", "corrected"] {
        let tracks = format!("{flown}/traffic/{name}.csv");
        let output = closecall(["traffic", "lane-changes", &tracks, "--format", "json"]);
        assert!([0, 4].contains(&code(&output)), "{name}: {}", message(&output));
        let changes: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert!(name == "raw" || !changes.as_array().unwrap().is_empty(), "{name}: {changes}");
    }
    let picture = fs::read(format!("{flown}/traffic/picture.png")).unwrap();
    assert!(picture.starts_with(b"\x89PNG"));
}

#[test]
fn wrong_options_and_files_are_refused_before_a_picture_is_rendered() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    fs::create_dir_all(folder.path().join("other")).unwrap();
    fs::create_dir_all(folder.path().join("flown/truth")).unwrap();
    let straight = |offset: u32| {
        let row = |frame: u32| {
            let (time_s, s_m) = (f64::from(frame) * 0.1, 500.0 + 3.0 * f64::from(frame));
            format!("m,1,1,{frame},{time_s:.1},{s_m:.1},{offset}.75,1,30,0,0,{s_m:.1},-1.75,4.5,1.8,car,x")
        };
        format!("{HEADER}\n{}\n", (0..60).map(row).collect::<Vec<_>>().join("\n"))
    };
    for (name, offset) in [("one.csv", 1), ("other/one.csv", 2), ("flown/truth/truth.csv", 1)] {
        fs::write(folder.path().join(name), straight(offset)).unwrap();
    }
    let (one, other, truth, flown) = (at("one.csv"), at("other/one.csv"), at("flown/truth/truth.csv"), at("flown"));
    let (one, other, truth) = (one.as_str(), other.as_str(), truth.as_str());
    let fly = |words: &[&str]| closecall(["traffic", "aerial", "-o", &flown].iter().chain(words));
    for (words, exit, expected) in [
        (&[one, "--altitude-m", "5"][..], 2, "from 40 to 400 m"),
        (&[one, "--off-nadir-deg", "60"][..], 2, "from 0 to 40 degrees"),
        (&[one, "--georeferencing-m", "nan"][..], 2, "from 0 to 5 m"),
        (&[one, "--around-s", "1"][..], 2, "from 2 to 1000 s"),
        (&[one, other][..], 2, "two files are named `one`"),
        (&[truth][..], 2, "--out"),
        (&[one][..], 3, "no vehicle changes lanes"),
    ] {
        let output = fly(words);
        assert_eq!(code(&output), exit, "{words:?}: {}", message(&output));
        assert!(message(&output).contains(expected), "{words:?}: {}", message(&output));
    }
    assert!(!folder.path().join("flown/one").exists());
    assert_eq!(fs::read_to_string(truth).unwrap(), straight(1));
}
