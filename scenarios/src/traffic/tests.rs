use std::path::Path;

use crate::sampling::Design;
use closecall_traffic::metrics::bumper_gap_m;

use super::super::{Scenario, ScenarioFile};
use super::*;

/// A scenario with three vehicles and a block of traffic.
fn text(traffic: &str) -> String {
    format!(
        "schema-version = 1\nname = 'busy'\nduration-s = 5.0\nroad = {{ lanes = 3 }}\n\
         [parameters]\nday = {{ uniform = {{ min = 0.0, max = 1.0 }}, assumed = 'any traffic' }}\n\
         [[actor]]\nid = 'ego'\nvehicle = {{ class = 'car' }}\n\
         start = {{ absolute = {{ lane = 2, s-m = 500.0, speed-mps = 30.0 }} }}\n\
         driver = {{ ego-stack = {{ acc = {{ time-gap-s = 0.7 }} }} }}\n\
         [[actor]]\nid = 'front'\nvehicle = {{ class = 'car' }}\n\
         start = {{ ahead = {{ of = 'ego', thw-s = 0.7, speed-mps = 30.0 }} }}\n\
         driver = {{ prescribed = {{ profile = [[0.0, 30.0]] }} }}\n\
         [[traffic]]\n{traffic}\n"
    )
}

const BLOCK: &str = "id = 'other'\ndraw = '$day'\nlanes = [1, 2, 3]\nvehicles = 30\nfrom-m = -300.0\nmean-thw-s = 2.0\n\
                     speed-mps = 30.0\nspeed-sd-mps = 1.0\nclasses = { car = 0.8, truck = 0.2 }\ndriver = { wiedemann99 = {} }";

fn sampled(text: &str, seed: u64, sample: u64) -> Scenario {
    let file = ScenarioFile::parse(Path::new("busy.toml"), text, &[]).unwrap();
    file.check().unwrap();
    file.concrete(&file.space().sample(Design::Random, seed, sample, 10)).unwrap()
}

fn starts(scenario: &Scenario) -> Vec<(String, VehicleState)> {
    scenario.actors.iter().map(|actor| (actor.id.to_string(), actor.start)).collect()
}

#[test]
fn five_lines_are_thirty_vehicles_that_keep_the_least_headway() {
    for sample in 0..20 {
        let scenario = sampled(&text(BLOCK), 7, sample);
        assert_eq!(scenario.actors.len(), 32);
        for behind in &scenario.actors {
            for ahead in &scenario.actors {
                let is_pair = behind.start.s_m < ahead.start.s_m && behind.start.d_m == ahead.start.d_m;
                let is_of_file = !behind.id.as_str().starts_with("other") && !ahead.id.as_str().starts_with("other");
                if !is_pair || is_of_file {
                    continue;
                }
                let [behind_m, ahead_m] = [behind, ahead].map(|actor| actor.vehicle.dimensions.length_m);
                let gap_m = bumper_gap_m(ahead.start.s_m - behind.start.s_m, behind_m, ahead_m);
                assert!(gap_m >= behind.start.speed_mps - 1e-3, "{} behind {}: {gap_m} m", behind.id, ahead.id);
            }
        }
        assert!(scenario.actors[2..].iter().all(|actor| (28.0..=32.0).contains(&actor.start.speed_mps)));
    }
}

#[test]
fn the_traffic_follows_from_the_sample_alone() {
    let text = text(BLOCK);
    assert_eq!(starts(&sampled(&text, 7, 3)), starts(&sampled(&text, 7, 3)));
    assert_ne!(starts(&sampled(&text, 7, 3)), starts(&sampled(&text, 7, 4)));
    assert_ne!(starts(&sampled(&text, 7, 3)), starts(&sampled(&text, 8, 3)));
    let fixed = text.replace("'$day'", "0.25");
    assert_eq!(starts(&sampled(&fixed, 7, 3)), starts(&sampled(&fixed, 8, 4)));
    // A further vehicle does not move the others.
    let more = sampled(&text.replace("vehicles = 30", "vehicles = 31"), 7, 3);
    assert_eq!(starts(&more)[..32], starts(&sampled(&text, 7, 3))[..]);
}

#[test]
fn mean_headway_density_and_shares_of_classes_are_those_of_the_file() {
    let alone = BLOCK.replace("lanes = [1, 2, 3]", "lanes = [1]").replace("vehicles = 30", "vehicles = 150");
    let mean_thw_s = |text: &str| {
        let actors = sampled(text, 3, 0).actors;
        let lane = &actors[2..];
        let (first, last) = (&lane[0], &lane[lane.len() - 1]);
        let lengths_m: f64 = lane[1..].iter().map(|actor| actor.vehicle.dimensions.length_m).sum();
        (last.start.s_m - first.start.s_m - lengths_m) / 30.0 / (lane.len() - 1) as f64
    };
    // The mean of 149 values with a standard deviation of 1 s has one of 0.08 s.
    let by_headway_s = mean_thw_s(&text(&alone));
    assert!((by_headway_s - 2.0).abs() < 0.25, "{by_headway_s}");
    let by_density_s = mean_thw_s(&text(&alone.replace("mean-thw-s = 2.0", "density-per-km = 10.0")));
    assert!((by_density_s - 3.1).abs() < 0.5, "{by_density_s}");
    let trucks = |text: &str| {
        sampled(text, 3, 0).actors.iter().filter(|actor| actor.vehicle.class == VehicleClass::Truck).count()
    };
    assert!((18..=45).contains(&trucks(&text(&alone))), "{}", trucks(&text(&alone)));
    assert_eq!(trucks(&text(&alone.replace("classes = { car = 0.8, truck = 0.2 }\n", ""))), 0);
}

#[test]
fn what_is_wrong_is_named_with_what_is_allowed() {
    let message = |from: &str, to: &str| {
        let text = text(&BLOCK.replace(from, to));
        let file = ScenarioFile::parse(Path::new("busy.toml"), &text, &[]);
        file.and_then(|file| file.check()).unwrap_err().to_string()
    };
    for (from, to, expected) in [
        ("vehicles = 30", "vehicels = 30", "did you mean `vehicles`?"),
        (
            "vehicles = 30",
            "vehicles = 0",
            "`traffic[0].vehicles` is 0, but a number of vehicles from 1 to 200 is needed",
        ),
        (
            "lanes = [1, 2, 3]",
            "lanes = [1, 4]",
            "`traffic[0].lanes[1]` is 4, but a lane of this road, from 1 (leftmost) to 3, is needed",
        ),
        ("lanes = [1, 2, 3]", "lanes = []", "`traffic[0].lanes` is missing: at least one lane"),
        ("mean-thw-s = 2.0", "mean-thw-s = 0.5", "`traffic[0].mean-thw-s` contradicts `min-thw-s`"),
        ("mean-thw-s = 2.0", "", "is missing: one of `mean-thw-s` and `density-per-km`"),
        ("mean-thw-s = 2.0", "mean-thw-s = 2.0\ndensity-per-km = 9.0", "contradicts `density-per-km`"),
        (
            "wiedemann99 = {}",
            "ego-stack = { acc = { time-gap-s = 1.0 } }",
            "the drivers of the surrounding traffic are human",
        ),
        ("id = 'other'", "id = 'an other'", "busy.toml:"),
        ("'$day'", "'$dya'", "names the parameter `$dya`"),
        ("truck = 0.2", "lorry = 0.2", "`truck`"),
        ("car = 0.8, truck = 0.2", "car = 0.0", "`traffic[0].classes.car` is missing: one class with a weight above 0"),
    ] {
        let message = message(from, to);
        assert!(message.contains(expected), "{to}: {message}");
    }
}
