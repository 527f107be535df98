//! `traffic chain` takes recordings to a verdict on each of their most relevant encounters.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use closecall_testing::data;
use serde_json::Value;

use crate::support::{closecall, code, folder, journal, json, message, stderr, stdout};

/// Frames per second of the recording.
const RATE: f64 = 10.0;
/// Frames of a group of vehicles, and frames from one group to the next.
const FRAMES: usize = 140;
const GROUP_FRAMES: usize = 160;
/// Groups on each carriageway.
const GROUPS: usize = 6;
/// Length of the recorded road, and size of a vehicle (m).
const ROAD_M: f64 = 800.0;
const SIZE_M: [f64; 2] = [4.6, 1.8];
/// Time in a group at which the rear vehicle crosses the marking, and duration of its lane change
/// (s).
const CROSSING_S: f64 = 7.0;
const DURATION_S: f64 = 4.0;
/// Width of a lane (m), and the upper marking of each carriageway.
const LANE_M: f64 = 3.75;
const UPPER_M: f64 = 2.0;
const LOWER_M: f64 = 14.0;

/// Writes a recording in the layout of highD: two carriageways with two lanes each. In each group a
/// rear vehicle approaches the ego in the right lane, which follows a lead vehicle, and overtakes
/// it. Tracks 3k + 1, 3k + 2 and 3k + 3 are lead vehicle, ego and rear vehicle. With `overtaking`
/// false, nobody changes lanes.
fn two_carriageways(folder: &Path, overtaking: bool) -> PathBuf {
    let mut tracks = "frame,id,x,y,width,height,xVelocity,yVelocity,xAcceleration,precedingId,laneId\n".to_owned();
    let mut meta = "id,width,height,initialFrame,finalFrame,numFrames,class,drivingDirection\n".to_owned();
    let mut id = 0;
    for group in 0..2 * GROUPS {
        let is_upper = group % 2 == 1;
        let k = (group / 2) as f64;
        let (ego_mps, closing_mps, thw_s) = (24.0 + 1.5 * k, 3.2 + 0.9 * k, 0.25 + 0.09 * k);
        let rear_mps = ego_mps + closing_mps;
        let gap_m = thw_s * rear_mps + closing_mps * CROSSING_S;
        let starts = [150.0 + 0.9 * ego_mps + SIZE_M[0], 150.0, 150.0 - gap_m - SIZE_M[0]];
        for (role, start_m) in starts.into_iter().enumerate() {
            id += 1;
            let speed_mps = if role == 2 { rear_mps } else { ego_mps };
            let first = 1 + group * GROUP_FRAMES;
            for frame in 0..FRAMES {
                let time_s = frame as f64 / RATE;
                let share = ((time_s - CROSSING_S) / DURATION_S + 0.5).clamp(0.0, 1.0);
                let share = if role == 2 && overtaking {
                    share.powi(3) * (10.0 - 15.0 * share + 6.0 * share * share)
                } else {
                    0.0
                };
                // Distance to the left of the middle of the right lane, along the direction of
                // travel.
                let (s_m, left_m) = (start_m + speed_mps * time_s, share * LANE_M);
                let is_left = left_m > 0.5 * LANE_M;
                let (x_m, y_m, lane) = if is_upper {
                    (ROAD_M - s_m, UPPER_M + 0.5 * LANE_M + left_m, if is_left { 3 } else { 2 })
                } else {
                    (s_m, LOWER_M + 1.5 * LANE_M - left_m, if is_left { 5 } else { 6 })
                };
                let velocity = if is_upper { -speed_mps } else { speed_mps };
                let corner = [x_m - 0.5 * SIZE_M[0], y_m - 0.5 * SIZE_M[1]];
                writeln!(
                    tracks,
                    "{},{id},{:.3},{:.3},{},{},{velocity:.3},0,0,0,{lane}",
                    first + frame,
                    corner[0],
                    corner[1],
                    SIZE_M[0],
                    SIZE_M[1]
                )
                .unwrap();
            }
            let direction = if is_upper { 1 } else { 2 };
            let last = first + FRAMES - 1;
            writeln!(meta, "{id},{},{},{first},{last},{FRAMES},Car,{direction}", SIZE_M[0], SIZE_M[1]).unwrap();
        }
    }
    let markings = |first_m: f64| [0.0, 1.0, 2.0].map(|lane| format!("{:.2}", first_m + lane * LANE_M)).join(";");
    let recording = format!(
        "id,frameRate,locationId,speedLimit,duration,upperLaneMarkings,lowerLaneMarkings\n1,{RATE},1,-1,200,{},{}\n",
        markings(UPPER_M),
        markings(LOWER_M)
    );
    fs::write(folder.join("01_recordingMeta.csv"), recording).unwrap();
    fs::write(folder.join("01_tracksMeta.csv"), meta).unwrap();
    let path = folder.join("01_tracks.csv");
    fs::write(&path, tracks).unwrap();
    path
}

/// Returns the arguments of a chain over a recording.
fn arguments<'a>(recording: &'a Path, out: &'a Path, more: &[&'a str]) -> Vec<&'a str> {
    let words = ["traffic", "chain", recording.to_str().unwrap(), "--out", out.to_str().unwrap()];
    words.into_iter().chain(more.iter().copied()).collect()
}

/// Returns the sum of a count over the encounters of a chain.
fn sum(report: &Value, key: &str) -> u64 {
    let scenarios = report["scenarios"].as_object().unwrap();
    scenarios.values().map(|scenario| scenario["arm_pairs"][0][key].as_u64().unwrap()).sum()
}

#[test]
fn two_carriageways_become_a_report_that_links_each_verdict_with_its_recorded_seconds() {
    let folder = folder();
    let recording = two_carriageways(folder.path(), true);
    let out = folder.path().join("chain");
    let report =
        json(&closecall(arguments(&recording, &out, &["-n", "20", "--encounters", "6", "--format", "json"])), 0);
    let origins = report["origins"]["encounters"].as_array().unwrap();
    assert_eq!(origins.len(), 6);
    assert!(sum(&report, "prevented") >= 1, "{report:#}");
    let names: BTreeSet<&str> = origins.iter().map(|origin| origin["scenario"].as_str().unwrap()).collect();
    assert_eq!(names.len(), 6, "names are distinct: {names:?}");
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    let (mut engaged, mut samples, mut pink, mut carriageways) = (0, 0, 0, BTreeSet::new());
    for origin in origins {
        let [lead, ego, rear] = ["lead_track", "ego_track", "rear_track"].map(|key| origin[key].as_u64().unwrap());
        assert_eq!((ego, rear), (lead + 1, lead + 2), "the vehicles of one group on one carriageway: {origin}");
        assert!(
            page.contains(&format!(
                "Recorded: track {rear}, the rear vehicle, is pink; track {ego}, the ego, is blue. "
            )),
            "{rear}"
        );
        carriageways.insert((lead / 3) % 2);
        let [from_s, to_s] = ["from_s", "to_s"].map(|key| origin[key].as_f64().unwrap());
        assert!(from_s < to_s && page.contains(&format!("{from_s:.1} to {to_s:.1} s")), "{origin}");
        let name = origin["scenario"].as_str().unwrap();
        for file in
            [format!("scenarios/{name}.toml"), format!("encounters/{name}.svg"), format!("encounters/{name}.rrd")]
        {
            assert!(out.join(&file).is_file(), "{file}");
            assert!(file.ends_with("svg") || page.contains(&file), "{file} is linked");
        }
        // The picture has the colours of every other picture.
        let picture = fs::read_to_string(out.join(format!("encounters/{name}.svg"))).unwrap();
        let label = |track: u64| picture.lines().find(|line| line.contains(&format!(">track-{track} ")));
        pink += u64::from(label(rear).is_some_and(|label| label.contains("#c2246c")));
        assert!(label(rear).is_none_or(|label| label.contains("#c2246c")), "{rear}: {:?}", label(rear));
        assert!(label(ego).is_none_or(|label| label.contains("#1a62bb")), "{ego}: {:?}", label(ego));
        assert!(label(lead).is_none_or(|label| label.contains("#9c5700")), "{lead}: {:?}", label(lead));
        let engagement = &origin["engagement"];
        let missing: u64 =
            engagement["missing"].as_object().unwrap().values().map(|count| count.as_u64().unwrap()).sum();
        engaged += engagement["engaged"].as_u64().unwrap();
        samples += engagement["engaged"].as_u64().unwrap() + missing;
    }
    assert_eq!((samples, carriageways.len()), (120, 2));
    assert!(pink > 0, "no rear vehicle has a label");
    assert!(engaged > 0 && page.contains(&format!("the system engages in {engaged} of 120 samples")), "{engaged}");
    // The choice is also in the summary.
    let summary = fs::read_to_string(out.join("summary.md")).unwrap();
    let chosen = format!("{} overtake a vehicle, and 6 became scenarios", report["origins"]["approaches"]);
    assert!(summary.contains(&chosen), "{summary}");
    // The folder is a campaign's folder.
    stdout(&closecall(["check", out.to_str().unwrap()]), 0);
    stdout(&closecall(["check", out.join("scenarios").to_str().unwrap()]), 0);
}

#[test]
fn each_sample_of_an_encounter_differs_and_an_interrupted_chain_resumes() {
    let folder = folder();
    let recording = two_carriageways(folder.path(), true);
    let [whole, half] = ["whole", "half"].map(|name| folder.path().join(name));
    let more = ["-n", "200", "--encounters", "1", "--sensors", "object", "--seed", "7"];
    stdout(&closecall(arguments(&recording, &whole, &more)), 0);
    let parameters: BTreeSet<String> =
        journal(&whole).iter().map(|record| record["arms"][0]["result"]["Ok"]["parameters"].to_string()).collect();
    assert_eq!(parameters.len(), 200, "{:?}", parameters.first());
    stdout(&closecall(arguments(&recording, &half, &more)), 0);
    // As a killed program leaves it: part of the journal with an unfinished line, and no report.
    let journal = fs::read_to_string(whole.join("journal.jsonl")).unwrap();
    let cut: usize = journal.len() / 2;
    fs::write(half.join("journal.jsonl"), &journal[..cut]).unwrap();
    for file in ["report.html", "outcomes.parquet", "origins.json"] {
        fs::remove_file(half.join(file)).unwrap();
    }
    let refused = closecall(arguments(&recording, &half, &more));
    assert_eq!(code(&refused), 2, "{}", message(&refused));
    stdout(&closecall(arguments(&recording, &half, &more).into_iter().chain(["--resume"])), 0);
    for file in ["journal.jsonl", "outcomes.parquet", "origins.json"] {
        assert!(fs::read(whole.join(file)).unwrap() == fs::read(half.join(file)).unwrap(), "{file}");
    }
    // Another seed is another campaign.
    let other: Vec<&str> = more[..6].iter().copied().chain(["--seed", "8", "--resume"]).collect();
    assert_ne!(code(&closecall(arguments(&recording, &half, &other))), 0);
}

#[test]
fn a_recording_without_an_encounter_is_no_pass() {
    let folder = folder();
    let recording = two_carriageways(folder.path(), false);
    let out = folder.path().join("chain");
    let output = closecall(arguments(&recording, &out, &[]));
    stdout(&output, 4);
    let said = stderr(&output);
    assert!(said.contains("no lane change overtakes a vehicle") && said.contains("0 lane changes"), "{said}");
    assert!(!out.exists(), "nothing is written");
}

#[test]
fn a_window_of_us_101_gives_encounters_of_which_the_system_prevents_some() {
    let Some(data) = data() else { return };
    let folder = folder();
    let out = folder.path().join("chain");
    let recording = data.join("ngsim_us101/trajectories/us101_a.csv");
    let more = ["-n", "20", "--encounters", "6", "--sensors", "object", "--format", "json"];
    let report = json(&closecall(arguments(&recording, &out, &more)), 0);
    let origins = report["origins"]["encounters"].as_array().unwrap();
    assert!(origins.len() >= 5, "{}", origins.len());
    assert!(sum(&report, "prevented") >= 1, "{report:#}");
    let mut engaged = 0;
    for origin in origins {
        let count = origin["engagement"]["engaged"].as_u64().unwrap();
        engaged += count;
        let has_reason = !origin["engagement"]["missing"].as_object().unwrap().is_empty();
        assert!(count == 20 || has_reason, "the rest has a reason: {origin}");
    }
    assert!(engaged > 0);
}
