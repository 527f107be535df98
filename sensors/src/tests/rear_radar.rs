//! The rear corner radars beside the rear LiDAR.

use closecall_traffic::{
    ActorId, CONTROL_STEP, Check, Environment, Parameters, Road, Source, Track, TrackStatus, VehicleClass,
};

use crate::faults::{FaultEntries, RadarFaultConfig};
use crate::testing::{OWN_LANE_M, scene_vehicle, with_speed};
use crate::{Alterations, Health, NoiseKey, Perception, Scene, SensorsConfig};

const EGO_S_M: f64 = 1_000.0;
const EGO_MPS: f64 = 30.0;
const CAR_MPS: f64 = 40.0;
/// Radars that see as far as the LiDAR.
const RADAR: &str = "rear-radar = { range-m = 200 }\n";

/// The results of an approach of 3 s, from 130 m behind the ego.
struct Approach {
    /// The rear tracks of each step.
    tracks: Vec<Vec<Track>>,
    /// The health of the rear sensors after the last step.
    health: Health,
}

fn approach(sensors: &str, fault: &str, sample: u64, road: &Road) -> Approach {
    let text = format!("mode = \"full\"\nrear-camera.pipeline = \"off\"\n{sensors}");
    let sensors = toml::from_str::<SensorsConfig>(&text).unwrap().check(&Parameters::default()).unwrap();
    let entries: Vec<RadarFaultConfig> =
        if fault.is_empty() { Vec::new() } else { vec![toml::from_str(fault).unwrap()] };
    let entries = FaultEntries { rear_radar: &entries, ..FaultEntries::default() };
    let faults = entries.check(&Parameters::default()).unwrap();
    let sensors = sensors.altered(Alterations { faults, ..Alterations::default() });
    let key = NoiseKey { seed: 2, sample, ego: ActorId::new("ego").unwrap(), actors: [].into() };
    let mut perception: Box<dyn Perception> = sensors.build(&key).unwrap();
    let environment = Environment::CLEAR_DAY;
    let mut ego = with_speed(scene_vehicle(0, VehicleClass::Car, EGO_S_M, OWN_LANE_M), EGO_MPS);
    let mut car = with_speed(scene_vehicle(1, VehicleClass::Car, EGO_S_M - 130.0, OWN_LANE_M), CAR_MPS);
    let mut tracks = Vec::new();
    for step in 0..75 {
        let time = CONTROL_STEP * step;
        let scene = Scene { time, road, environment: &environment, ego, others: &[car] };
        let of_step = perception.step(&scene).unwrap().iter().filter(|track| track.source == Source::Rear);
        tracks.push(of_step.cloned().collect());
        for vehicle in [&mut ego, &mut car] {
            vehicle.state.s_m += CONTROL_STEP.s() * vehicle.state.speed_mps;
        }
    }
    Approach { tracks, health: perception.health().rear }
}

/// Returns the steps in which both approaches have one track, with the two tracks.
fn both<'a>(a: &'a Approach, b: &'a Approach) -> Vec<[&'a Track; 2]> {
    let one = |tracks: &'a [Track]| if let [track] = tracks { Some(track) } else { None };
    a.tracks.iter().zip(&b.tracks).filter_map(|(a, b)| Some([one(a)?, one(b)?])).collect()
}

/// Variance of the speed along the road (m²/s²).
fn variance_m2ps2(track: &Track) -> f64 {
    track.covariance[(2, 2)]
}

#[test]
fn the_radar_makes_the_speed_of_a_new_track_surer_and_nearer_to_the_truth() {
    let (mut errors, mut normalised, mut count) = ([0.0; 2], 0.0, 0.0);
    for sample in 0..20 {
        let alone = approach("", "", sample, &Road::straight(3));
        let fused = approach(RADAR, "", sample, &Road::straight(3));
        let pairs = both(&alone, &fused);
        assert!(pairs.len() > 25, "{} steps", pairs.len());
        // The first 0.6 s of the track.
        let young = &pairs[..15];
        let mean = |index: usize| young.iter().map(|pair| variance_m2ps2(pair[index])).sum::<f64>() / 15.0;
        assert!(mean(1) < mean(0), "sample {sample}: {} with the radar, {} without", mean(1), mean(0));
        for pair in young {
            let [alone_mps, fused_mps] = pair.map(|track| track.vx_mps() - CAR_MPS);
            errors = [errors[0] + alone_mps * alone_mps, errors[1] + fused_mps * fused_mps];
            normalised += fused_mps * fused_mps / variance_m2ps2(pair[1]);
            count += 1.0;
        }
    }
    assert!(errors[1] < errors[0], "mean squares: {:?}", errors.map(|sum| sum / count));
    // A consistent filter has 1.
    assert!(normalised / count < 3.0, "{}", normalised / count);
}

#[test]
fn a_dead_radar_leaves_the_tracks_as_they_are_without_one_to_the_bit() {
    let alone = approach("", "", 1, &Road::straight(3));
    let dead = approach(RADAR, "dead = true", 1, &Road::straight(3));
    assert!(alone.tracks == dead.tracks);
    assert_eq!((alone.health, dead.health), (Health::Ok, Health::Degraded));
    let working = approach(RADAR, "", 1, &Road::straight(3));
    assert!(alone.tracks != working.tracks && working.health == Health::Ok);
}

#[test]
fn a_late_radar_corrects_nothing_and_is_noticed() {
    let alone = approach("", "", 1, &Road::straight(3));
    let late = approach(RADAR, "delay-s = 0.2", 1, &Road::straight(3));
    assert!(alone.tracks == late.tracks, "a scan that is older than the tracks is not used");
    assert_eq!(late.health, Health::Degraded);
}

#[test]
fn a_ghost_starts_no_track_and_a_wrong_mounting_and_a_ghost_remain_unnoticed() {
    let ghost = "ghost-gap-m = 40.0\nghost-closing-mps = 5.0";
    let road = Road::straight(3);
    // The car is out of the LiDAR's view: only the radars detect something.
    let blind = approach(&format!("rear-lidar.azimuth-deg = 80\n{RADAR}"), ghost, 0, &road);
    assert!(blind.tracks.iter().all(Vec::is_empty));
    assert_eq!(blind.health, Health::Ok);
    let counts = |fault: &str| approach(RADAR, fault, 0, &road).tracks.iter().map(Vec::len).collect::<Vec<_>>();
    assert_eq!(counts(ghost), counts(""), "the ghost is no track of its own");
    assert_eq!(approach(RADAR, "yaw-deg = 3.0", 0, &road).health, Health::Ok);
}

#[test]
fn the_radar_starts_no_track_and_ghosts_leave_the_speed_right() {
    let road = Road::straight(3).with_guard_rails();
    let ghosts = "rear-radar = { range-m = 200, ghost-probability = 1.0 }\n";
    for sample in 0..5 {
        let fused = approach(ghosts, "", sample, &road);
        let last = fused.tracks.last().unwrap();
        let [track] = &last[..] else { panic!("{} tracks", last.len()) };
        assert_ne!(track.status, TrackStatus::Tentative);
        assert!((track.vx_mps() - CAR_MPS).abs() < 0.5, "{} m/s", track.vx_mps());
    }
    // The car is out of the LiDAR's view: it has no track.
    let blind = approach(&format!("rear-lidar.azimuth-deg = 80\n{RADAR}"), "", 0, &road);
    assert!(blind.tracks.iter().all(Vec::is_empty));
}
