//! A regression test. The ego brakes behind the lead vehicle, and the rear vehicle passes close by.
//! For half a second the ego once took the rear vehicle for its lead vehicle, released the brake,
//! and ran into the lead vehicle. Samples 36, 176 and 189 of `low-thw-overtake` with object-level
//! sensors showed it.

use crate::support::{closecall, json, library};

#[test]
fn a_passing_vehicle_does_not_hide_the_lead_vehicle() {
    let scenario = library("low-thw-overtake");
    for sample in ["36", "176", "189"] {
        let args = ["run", scenario.to_str().unwrap(), "--seed", "1", "--controller", "acc", "--sample", sample];
        let run = json(&closecall(args.into_iter().chain(["--sensors", "object", "--format", "json"])), 0);
        for collision in run["collisions"].as_array().unwrap() {
            let between = collision["between"].as_array().unwrap();
            let rear_was_first = run["collisions"][0]["between"].as_array().unwrap().contains(&"rear".into());
            assert!(!between.contains(&"front".into()) || rear_was_first, "sample {sample}: {collision}");
        }
    }
}
