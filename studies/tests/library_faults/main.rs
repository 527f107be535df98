//! Every scenario of `scenarios/library/faults`, at its shipped magnitude: the effect of its fault
//! on perception.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod effects;
mod noticed;
mod watch;

use std::collections::BTreeSet;
use std::path::Path;

use effects::Effect::{self, *};
use watch::Of;

/// The effect of each fault. [`Effect::check`] defines the drives.
const TABLE: [(&str, Of, Effect); 82] = [
    ("camera-dead", Of::RearCamera, Dead { from_step: 125 }),
    ("camera-dirty", Of::RearCamera, Unclassified { loss: 0.2 }),
    ("camera-frozen", Of::RearCamera, FrozenImage { from_step: 125 }),
    // The effect of glare at this magnitude is small: see docs/evidence/faults.md.
    ("camera-low-sun", Of::RearCamera, Unclassified { loss: 0.0 }),
    ("camera-main-beam", Of::RearCamera, Unclassified { loss: 0.0 }),
    ("camera-out-of-focus", Of::RearCamera, Unclassified { loss: 0.2 }),
    ("front-lidar-blocked", Of::FrontLidar, Hidden { left_m: 0.0 }),
    ("front-lidar-blooming", Of::FrontLidar, FalsePoints { at_least: 3.0 }),
    ("front-lidar-clock-offset", Of::FrontLidar, Nearer { by_m: 0.5 }),
    ("front-lidar-crosstalk", Of::FrontLidar, FalsePoints { at_least: 60.0 }),
    ("front-lidar-dead", Of::FrontLidar, Dead { from_step: 125 }),
    ("front-lidar-dirty", Of::FrontLidar, Range { share: [0.5, 0.85] }),
    ("front-lidar-dropout", Of::FrontLidar, Points { share: [0.33, 0.47] }),
    ("front-lidar-frozen", Of::FrontLidar, Frozen { from_step: 125 }),
    ("front-lidar-height", Of::FrontLidar, OtherPoints { higher_m: [0.0, 0.2] }),
    ("front-lidar-jitter", Of::FrontLidar, Late { steps: [1, 5] }),
    ("front-lidar-late", Of::FrontLidar, Late { steps: [5, 5] }),
    ("front-lidar-lost-frames", Of::FrontLidar, Coasts { share: [0.25, 0.55] }),
    ("front-lidar-noisy", Of::FrontLidar, ScattersAlong { times: 3.0 }),
    ("front-lidar-pitch", Of::FrontLidar, OtherPoints { higher_m: [0.1, 0.4] }),
    ("front-lidar-rail-ghosts", Of::FrontLidar, GhostPointsOnly { at_least: 10.0 }),
    ("front-lidar-yaw", Of::FrontLidar, ToLeft { by_deg: -0.5 }),
    ("front-radar-blocked", Of::FrontRadar, Hidden { left_m: 0.0 }),
    ("front-radar-clock-offset", Of::FrontRadar, Nearer { by_m: 0.5 }),
    ("front-radar-dead", Of::FrontRadar, Dead { from_step: 125 }),
    ("front-radar-dirty", Of::FrontRadar, Range { share: [0.45, 0.55] }),
    ("front-radar-dropout", Of::FrontRadar, Coasts { share: [0.45, 0.75] }),
    ("front-radar-frozen", Of::FrontRadar, Frozen { from_step: 125 }),
    ("front-radar-ghost", Of::FrontRadar, Ghost),
    ("front-radar-jitter", Of::FrontRadar, Late { steps: [1, 5] }),
    ("front-radar-late", Of::FrontRadar, Late { steps: [5, 5] }),
    ("front-radar-lost-frames", Of::FrontRadar, Coasts { share: [0.25, 0.55] }),
    ("front-radar-noisy", Of::FrontRadar, ScattersAlong { times: 1.3 }),
    ("front-radar-yaw", Of::FrontRadar, ToLeft { by_deg: -0.5 }),
    ("lidar-blocked", Of::RearLidar, Hidden { left_m: 0.0 }),
    ("lidar-blooming", Of::RearLidar, FalsePoints { at_least: 3.0 }),
    ("lidar-clock-offset", Of::RearLidar, Nearer { by_m: 0.5 }),
    ("lidar-crosstalk", Of::RearLidar, FalsePoints { at_least: 60.0 }),
    ("lidar-dead", Of::RearLidar, Dead { from_step: 125 }),
    ("lidar-dirty", Of::RearLidar, Range { share: [0.5, 0.8] }),
    ("lidar-dropout", Of::RearLidar, Points { share: [0.33, 0.47] }),
    ("lidar-frozen", Of::RearLidar, Frozen { from_step: 125 }),
    ("lidar-height", Of::RearLidar, OtherPoints { higher_m: [0.0, 0.2] }),
    ("lidar-jitter", Of::RearLidar, Late { steps: [1, 5] }),
    ("lidar-late", Of::RearLidar, Late { steps: [5, 5] }),
    ("lidar-lost-frames", Of::RearLidar, Coasts { share: [0.25, 0.55] }),
    ("lidar-misaligned", Of::RearLidar, ToLeft { by_deg: 0.5 }),
    ("lidar-noisy", Of::RearLidar, ScattersAlong { times: 3.0 }),
    ("lidar-pitch", Of::RearLidar, OtherPoints { higher_m: [0.1, 0.4] }),
    ("lidar-rail-ghosts", Of::RearLidar, GhostPointsOnly { at_least: 10.0 }),
    ("lidar-yaw", Of::RearLidar, ToLeft { by_deg: 0.5 }),
    ("map-curvature", Of::RearLidar, OtherLane { left_m: -1.4, lane: 2 }),
    ("map-lane-width", Of::RearLidar, OtherLane { left_m: 1.81, lane: 0 }),
    ("map-without-rails", Of::RearLidar, BesideTheRoad),
    ("object-blocked", Of::RearObject, Hidden { left_m: 0.0 }),
    ("object-clock-offset", Of::RearObject, Nearer { by_m: 0.5 }),
    ("object-dead", Of::RearObject, Dead { from_step: 125 }),
    // A range share of 0.64. A usual car may have its first track at up to 1.15 times its range.
    ("object-dirty", Of::RearObject, Range { share: [0.64 / 1.16, 0.7] }),
    ("object-dropout", Of::RearObject, Coasts { share: [0.65, 0.95] }),
    ("object-frozen", Of::RearObject, Frozen { from_step: 125 }),
    ("object-ghost", Of::RearObject, Ghost),
    ("object-jitter", Of::RearObject, Late { steps: [1, 5] }),
    ("object-late", Of::RearObject, Late { steps: [8, 8] }),
    ("object-lost-frames", Of::RearObject, Coasts { share: [0.25, 0.55] }),
    ("object-noisy", Of::RearObject, ScattersAlong { times: 1.3 }),
    ("object-yaw", Of::RearObject, ToLeft { by_deg: 0.5 }),
    ("odometry-heading", Of::RearLidar, OtherLane { left_m: -1.2, lane: 2 }),
    ("odometry-lateral", Of::RearLidar, OtherLane { left_m: 1.77, lane: 0 }),
    ("odometry-speed", Of::RearLidar, Faster { by_mps: 0.3 }),
    ("odometry-wrong", Of::RearObject, Faster { by_mps: 0.3 }),
    ("surround-blocked", Of::Surround, Hidden { left_m: 3.75 }),
    ("surround-clock-offset", Of::Surround, Nearer { by_m: 0.05 }),
    ("surround-dead", Of::Surround, Dead { from_step: 125 }),
    ("surround-dirty", Of::Surround, Range { share: [0.4, 0.6] }),
    ("surround-dropout", Of::Surround, Coasts { share: [0.45, 0.75] }),
    ("surround-frozen", Of::Surround, Frozen { from_step: 125 }),
    ("surround-ghost", Of::Surround, Ghost),
    ("surround-jitter", Of::Surround, Late { steps: [1, 5] }),
    ("surround-late", Of::Surround, Late { steps: [5, 5] }),
    ("surround-lost-frames", Of::Surround, Coasts { share: [0.25, 0.55] }),
    ("surround-noisy", Of::Surround, ScattersAlong { times: 1.2 }),
    ("surround-yaw", Of::Surround, ToLeft { by_deg: 3.0 }),
];

#[test]
fn the_table_has_every_scenario_of_the_folder_once() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/library/faults");
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let names: BTreeSet<String> = files.map(|path| path.file_stem().unwrap().to_str().unwrap().to_owned()).collect();
    let listed: BTreeSet<String> = TABLE.iter().map(|(name, ..)| (*name).to_owned()).collect();
    assert_eq!(names, listed);
    assert_eq!(listed.len(), TABLE.len());
}

#[test]
fn each_fault_is_noticed_in_time_with_its_reason_or_listed_as_one_that_no_monitor_notices() {
    let mut wrong = Vec::new();
    let mut kinds = BTreeSet::new();
    for (name, sensor, _) in &TABLE {
        match noticed::check(name, *sensor) {
            Ok(true) => _ = kinds.insert(noticed::kind(name)),
            Ok(false) => {}
            Err(difference) => wrong.push(format!("{name}: {difference}")),
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let expected = [
        "blocked",
        "clock-offset",
        "dead",
        "dirty",
        "dropout",
        "frozen",
        "height",
        "jitter",
        "late",
        "lost-frames",
        "misaligned",
        "noisy",
        "pitch",
    ];
    assert_eq!(kinds.into_iter().collect::<Vec<_>>(), expected);
}

#[test]
fn each_fault_has_its_effect_on_perception() {
    let mut wrong = Vec::new();
    for (name, sensor, effect) in &TABLE {
        if let Err(difference) = effect.check(name, *sensor) {
            wrong.push(format!("{name}: {effect:?}: {difference}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
