//! Tests of the properties that the controllers rely on: timely confirmation, a consistent covariance, and bitwise
//! reproducibility.

use closecall_traffic::{
    ActorId, CONTROL_STEP, Environment, Parameters, Road, Source, Track, TrackStatus, VehicleClass,
};

use super::*;
use crate::SceneVehicle;
use crate::surroundings::transform_scene;
use crate::testing::{OWN_LANE_M, scene_vehicle, with_speed};
use crate::{Perception, Scene};

const PERIOD_S: f64 = CONTROL_STEP.s();

fn key(sample: u64) -> NoiseKey {
    NoiseKey { seed: 1, sample, ego: ActorId::new("ego").unwrap(), actors: [].into() }
}

fn perception(sample: u64) -> ObjectPerception {
    let config = ObjectSensorConfig::default();
    let none = Parameters::default();
    let models = [
        config.check_front_radar(&none).unwrap(),
        config.check_surround(&none).unwrap(),
        config.check_rear_object(&none).unwrap(),
    ];
    ObjectPerception::new(models, &key(sample))
}

/// The ego at 30 m/s, a lead vehicle at the same speed, and a rear vehicle that approaches at 40 m/s.
struct Encounter {
    road: Road,
    ego: SceneVehicle,
    others: Vec<SceneVehicle>,
    scans: i64,
}

impl Encounter {
    fn new() -> Self {
        Self {
            road: Road::straight(3),
            ego: with_speed(scene_vehicle(0, VehicleClass::Car, 1_000.0, OWN_LANE_M), 30.0),
            others: vec![
                with_speed(scene_vehicle(1, VehicleClass::Car, 1_030.0, OWN_LANE_M), 30.0),
                with_speed(scene_vehicle(2, VehicleClass::Car, 870.0, OWN_LANE_M), 40.0),
            ],
            scans: 0,
        }
    }

    fn scene(&self) -> Scene<'_> {
        let time = CONTROL_STEP * self.scans;
        Scene { time, road: &self.road, environment: &Environment::CLEAR_DAY, ego: self.ego, others: &self.others }
    }

    fn advance(&mut self) {
        self.scans += 1;
        for vehicle in std::iter::once(&mut self.ego).chain(&mut self.others) {
            let path_scale = 1.0 - self.road.curvature_per_m() * vehicle.state.d_m;
            vehicle.state.s_m += vehicle.state.speed_mps / path_scale * PERIOD_S;
        }
    }
}

fn confirmed_track(tracks: &[Track], source: Source) -> Option<&Track> {
    tracks.iter().find(|track| track.source == source && track.status != TrackStatus::Tentative)
}

#[test]
fn the_rear_vehicle_is_confirmed_beyond_100_m() {
    for sample in 0..50 {
        let (mut encounter, mut perception) = (Encounter::new(), perception(sample));
        let at_m = loop {
            let tracks = perception.step(&encounter.scene()).unwrap();
            if let Some(track) = confirmed_track(tracks, Source::Rear) {
                break -track.x_m();
            }
            encounter.advance();
        };
        assert!((115.0..140.0).contains(&at_m), "sample {sample}: {at_m} m");
    }
}

/// Returns the normalised error squared of the rear track's position and velocity after 100 scans.
fn rear_error_squared(sample: u64, curvature_per_m: f64) -> f64 {
    let (mut encounter, mut perception) = (Encounter::new(), perception(sample));
    encounter.road = encounter.road.with_curvature(curvature_per_m);
    for _ in 0..100 {
        perception.step(&encounter.scene()).unwrap();
        encounter.advance();
    }
    let scene = encounter.scene();
    let mut others = Vec::new();
    transform_scene(&scene, &mut others).unwrap();
    let truth = others[1];
    let track = confirmed_track(perception.step(&scene).unwrap(), Source::Rear).unwrap();
    let error = track.state
        - nalgebra::Vector4::new(truth.x_m, truth.y_m, truth.speed_mps * truth.cos, truth.speed_mps * truth.sin);
    (error.transpose() * track.covariance.try_inverse().unwrap() * error)[0]
}

#[test]
fn the_covariance_covers_the_errors() {
    for curvature_per_m in [0.0, 0.001] {
        let samples = 200;
        let mean = (0..samples).map(|sample| rear_error_squared(sample, curvature_per_m)).sum::<f64>() / samples as f64;
        // The vehicle does not manoeuvre, so its errors are smaller than the process noise allows for: about 4, the
        // number of dimensions, at most, but not much less.
        assert!((1.0..4.4).contains(&mean), "mean normalised error squared {mean} at curvature {curvature_per_m}");
    }
}

#[test]
fn the_radar_follows_a_braking_lead_vehicle() {
    let (mut encounter, mut perception) = (Encounter::new(), perception(3));
    for _ in 0..75 {
        perception.step(&encounter.scene()).unwrap();
        encounter.advance();
    }
    for _ in 0..50 {
        encounter.others[0].state.speed_mps -= 6.0 * PERIOD_S;
        encounter.advance();
        perception.step(&encounter.scene()).unwrap();
    }
    let truth_mps = encounter.others[0].state.speed_mps;
    let track = confirmed_track(perception.step(&encounter.scene()).unwrap(), Source::Front).unwrap().clone();
    // A latency of two scans at 6 m/s² makes an error of 0.48 m/s; the filter may add as much again.
    assert!((track.vx_mps() - truth_mps).abs() < 1.2, "{} {truth_mps}", track.vx_mps());
    assert_eq!(track.lane, [0.0, 1.0, 0.0]);
}

#[test]
fn the_same_key_gives_the_same_bits_and_another_key_other_bits() {
    let run = |sample| {
        let (mut encounter, mut perception) = (Encounter::new(), perception(sample));
        let mut bits = Vec::new();
        for _ in 0..100 {
            for track in perception.step(&encounter.scene()).unwrap() {
                bits.extend(track.state.iter().chain(track.covariance.iter()).map(|value| value.to_bits()));
            }
            encounter.advance();
        }
        bits
    };
    assert_eq!(run(5), run(5));
    assert_ne!(run(5), run(6));
}

#[test]
fn another_vehicle_does_not_change_the_errors_of_the_first() {
    let rear = |with_third: bool| {
        let (mut encounter, mut perception) = (Encounter::new(), perception(9));
        if with_third {
            encounter.others.push(with_speed(scene_vehicle(3, VehicleClass::Truck, 960.0, -9.375), 30.0));
        }
        for _ in 0..50 {
            perception.step(&encounter.scene()).unwrap();
            encounter.advance();
        }
        let tracks = perception.step(&encounter.scene()).unwrap();
        let track = tracks.iter().find(|track| track.source == Source::Rear && track.lane[1] > 0.5).unwrap();
        track.state.map(f64::to_bits)
    };
    assert_eq!(rear(false), rear(true));
}

#[test]
fn the_track_of_a_hidden_vehicle_coasts_and_is_then_deleted() {
    let (mut encounter, mut perception) = (Encounter::new(), perception(2));
    encounter.others[1].state.speed_mps = 30.0;
    encounter.others[1].state.s_m = 940.0;
    for _ in 0..25 {
        perception.step(&encounter.scene()).unwrap();
        encounter.advance();
    }
    // The ego is at 1,030 m, the rear vehicle at 970 m. A truck appears between them.
    encounter.others.push(with_speed(scene_vehicle(3, VehicleClass::Truck, 1_005.0, OWN_LANE_M), 30.0));
    let mut coasted = 0;
    for _ in 0..60 {
        let tracks = perception.step(&encounter.scene()).unwrap();
        coasted += tracks.iter().filter(|track| track.status == TrackStatus::Coasting && track.x_m() < -40.0).count();
        encounter.advance();
    }
    assert!((20..=30).contains(&coasted), "{coasted} scans");
    let tracks = perception.step(&encounter.scene()).unwrap();
    assert!(tracks.iter().all(|track| track.x_m() > -40.0), "{tracks:?}");
}
