//! `closecall traffic calibrate`, from recorded pairs to a member of an ensemble.

use std::fmt::Write;

use crate::support::{closecall, code, folder, json, message, stderr, stdout};
use closecall_traffic::maths;

/// Returns a table of pairs whose followers keep 1.5 s and 2 m behind a leader that drives in
/// waves.
fn table() -> String {
    let mut text =
        "pair_id,time_s,follower_front_y_m,follower_speed_mps,leader_front_y_m,leader_length_m,leader_speed_mps\n"
            .to_owned();
    for pair in 0..8 {
        let leader_m = |time_s: f64| 10.0 * time_s - 20.0 * maths::cos(0.2 * time_s + f64::from(pair));
        let leader_mps = |time_s: f64| 10.0 + 4.0 * maths::sin(0.2 * time_s + f64::from(pair));
        for step in 0..400 {
            let time_s = 0.1 * f64::from(step);
            // The follower repeats the leader's motion of 1.5 s ago, 2 m behind it (Newell).
            let (front_m, mps) = (leader_m(time_s - 1.5) - 2.0, leader_mps(time_s - 1.5));
            let (leader_front_m, leader) = (leader_m(time_s) + 4.5, leader_mps(time_s));
            writeln!(text, "p{pair},{time_s:.1},{front_m},{mps},{leader_front_m},4.5,{leader}").unwrap();
        }
    }
    text
}

#[test]
fn a_calibration_gives_a_member_that_a_campaign_takes() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name).display().to_string();
    std::fs::write(at("pairs.csv"), table()).unwrap();
    let output = closecall(["traffic", "calibrate", &at("pairs.csv"), "--format=json", "-o", &at("member.toml")]);
    let result = json(&output, 0);
    assert!(stderr(&output).contains(&format!("written: {}\n", at("member.toml"))), "{}", stderr(&output));
    let pairs = result["pairs"].as_array().unwrap().len() + result["held_out"].as_array().unwrap().len();
    assert_eq!(pairs, 8);
    assert!(result["errors"]["pooled_calibration_pairs"]["rmse_m"].as_f64().unwrap() < 2.0, "{}", result["errors"]);
    assert!((1.0..2.0).contains(&result["pooled"]["time-gap-s"].as_f64().unwrap()), "{}", result["pooled"]);
    let member = std::fs::read_to_string(at("member.toml")).unwrap();
    assert!(member.contains("acceleration-mps2") && member.contains("blake3"), "{member}");
    assert!(!member.contains("key = \"time-gap-s\""), "{member}");
    let args = ["campaign", "rear-follower-stays", "-n", "1", "--sensors=ground-truth", "--no-gate", "--format=json"];
    let campaign = json(&closecall(args.iter().copied().chain(["--ensemble", &at("member.toml")])), 0);
    assert!(campaign["scenarios"]["rear-follower-stays@calibrated-idm"].is_object());
    let table = stdout(&closecall(["traffic", "calibrate", &at("pairs.csv")]), 0);
    // Its pairs would count twice.
    std::fs::copy(at("pairs.csv"), at("again.csv")).unwrap();
    let twice = closecall(["traffic", "calibrate", &at("pairs.csv"), &at("again.csv")]);
    assert_eq!(code(&twice), 2);
    assert!(message(&twice).contains("have the same content"), "{}", message(&twice));
    assert!(table.contains("pooled set, calibration pairs") && table.contains("literature:"), "{table}");
}

#[test]
fn a_file_without_a_usable_pair_is_refused() {
    let folder = folder();
    let path = folder.path().join("pairs.csv");
    let short: String = table().lines().take(50).map(|line| format!("{line}\n")).collect();
    std::fs::write(&path, short).unwrap();
    let output = closecall(["traffic".as_ref(), "calibrate".as_ref(), path.as_os_str()]);
    assert_eq!(code(&output), 2, "{}", message(&output));
    assert!(message(&output).contains("p0: it lasts 4.8 s, less than 20 s"), "{}", message(&output));
    std::fs::write(&path, "frame,id\n1,2\n").unwrap();
    let output = closecall(["traffic".as_ref(), "calibrate".as_ref(), path.as_os_str()]);
    assert_eq!(code(&output), 3, "{}", message(&output));
    assert!(message(&output).contains("begins no known layout"), "{}", message(&output));
}
