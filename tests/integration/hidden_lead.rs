//! E braked behind F, R passed close by, and for half a second E took R for the vehicle ahead: it let the brake go and
//! ran into F. Samples 36, 176 and 189 of the headline showed it with object-level sensors.

use crate::support::{closecall, json, library};

#[test]
fn a_passing_vehicle_does_not_make_ego_forget_the_one_ahead() {
    let scenario = library("low-thw-overtake");
    for sample in ["36", "176", "189"] {
        let args = ["run", scenario.to_str().unwrap(), "--seed", "1", "--controller", "acc", "--sample", sample];
        let run = json(&closecall(args.into_iter().chain(["--sensors", "object", "--format", "json"])), 0);
        for collision in run["collisions"].as_array().unwrap() {
            let between = collision["between"].as_array().unwrap();
            let after_rear = run["collisions"][0]["between"].as_array().unwrap().contains(&"rear".into());
            assert!(!between.contains(&"front".into()) || after_rear, "sample {sample}: {collision}");
        }
    }
}
