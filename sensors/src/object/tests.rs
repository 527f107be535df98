//! Tests of the properties that the controllers rely on: timely confirmation, a consistent
//! covariance, and bitwise reproducibility.

use std::collections::BTreeMap;

use closecall_traffic::{
    ActorId, Alignment, AlignmentPoint, CONTROL_STEP, Environment, Parameters, Road, Source, Track, TrackStatus,
    VehicleClass,
};

use super::*;
use crate::SceneVehicle;
use crate::surroundings::transform_scene;
use crate::testing::{OWN_LANE_M, scene_vehicle, with_speed};
use crate::{Alterations, Perception, Scene};

const PERIOD_S: f64 = CONTROL_STEP.s();

fn key(sample: u64) -> NoiseKey {
    NoiseKey { seed: 1, sample, ego: ActorId::new("ego").unwrap(), actors: [].into() }
}

fn perception(sample: u64) -> ObjectPerception {
    altered_perception(sample, &Alterations::default())
}

fn altered_perception(sample: u64, altered: &Alterations) -> ObjectPerception {
    let config = ObjectSensorConfig::default();
    let none = Parameters::default();
    let models = [
        config.check_front_radar(&none).unwrap(),
        config.check_surround(&none).unwrap(),
        config.check_rear_object(&none).unwrap().altered(altered, true),
    ];
    ObjectPerception::new(models, &key(sample))
}

/// The ego at 30 m/s, a lead vehicle at the same speed, and a rear vehicle that approaches at 40
/// m/s.
struct Encounter {
    road: Road,
    ego: SceneVehicle,
    others: Vec<SceneVehicle>,
    environment: Environment,
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
            environment: Environment::CLEAR_DAY,
            scans: 0,
        }
    }

    fn scene(&self) -> Scene<'_> {
        let time = CONTROL_STEP * self.scans;
        Scene { time, road: &self.road, environment: &self.environment, ego: self.ego, others: &self.others }
    }

    fn advance(&mut self) {
        self.scans += 1;
        for vehicle in std::iter::once(&mut self.ego).chain(&mut self.others) {
            let path_scale = self.road.path_scale(vehicle.state.s_m, vehicle.state.d_m);
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
fn rear_error_squared(sample: u64, road: &Road) -> f64 {
    let (mut encounter, mut perception) = (Encounter::new(), perception(sample));
    encounter.road = road.clone();
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
    // The ego passes the inflection of an S-curve, and the rear vehicle follows it.
    let points = [[850.0, 0.0], [950.0, 0.001], [1_050.0, 0.001], [1_200.0, -0.001]];
    let points = points.map(|[s_m, curvature_per_m]| AlignmentPoint { s_m, curvature_per_m });
    let straight = Road::straight(3);
    let course = straight.with_alignment(Alignment::new(&points).unwrap());
    for road in [straight.clone(), straight.with_curvature(0.001), course] {
        let samples = 200;
        let mean = (0..samples).map(|sample| rear_error_squared(sample, &road)).sum::<f64>() / samples as f64;
        // The vehicle does not manoeuvre, so its errors are smaller than the process noise allows
        // for: about 4, the number of dimensions, at most, but not much less.
        assert!((1.0..4.4).contains(&mean), "mean normalised error squared {mean} on {road:?}");
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
    // A latency of two scans at 6 m/s² makes an error of 0.48 m/s; the filter may add as much
    // again.
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

#[test]
fn beyond_its_range_a_vehicle_is_seen_at_a_share_of_the_distances() {
    let fit = |share: f64| {
        let mut fit = RearFit::shipped().unwrap().clone();
        fit.range_spread = 0.0;
        fit.range.iter_mut().flat_map(|grid| [&mut grid.range_m, &mut grid.class_range_m]).for_each(|grid| {
            grid.iter_mut().flatten().for_each(|range_m| *range_m = 40.0);
        });
        let grid = |value: f64| vec![vec![value; fit.shapes.extinctions_per_m.len()]; fit.shapes.paints.len()];
        let [ratios, shares] = [grid(2.5), grid(share)];
        fit.shapes.intermittent.insert("saloon".to_owned(), ratios);
        fit.shapes.intermittent_share.insert("saloon".to_owned(), shares);
        &*Box::leak(Box::new(fit))
    };
    // The steps with a classified track that exists, within the range, up to 2.5 times the range,
    // and beyond; and the numbers of all steps.
    let counts = |share: f64, samples: u64| {
        let (fit, none) = (fit(share), Parameters::default());
        let mut counts = [[0_u32; 2]; 3];
        for sample in 0..samples {
            let config = ObjectSensorConfig::default();
            let rear = config.check_rear_object(&none).unwrap().with_fit(fit);
            let models = [config.check_front_radar(&none).unwrap(), config.check_surround(&none).unwrap(), rear];
            let (mut encounter, mut perception) = (Encounter::new(), ObjectPerception::new(models, &key(sample)));
            while encounter.others[1].state.s_m < encounter.ego.state.s_m - 15.0 {
                let gap_m = encounter.ego.state.s_m - encounter.others[1].state.s_m - 4.6;
                let track = confirmed_track(perception.step(&encounter.scene()).unwrap(), Source::Rear);
                // A track that is about to end at the range needs some measurements to exist again.
                let zone = match gap_m {
                    ..36.0 => Some(0),
                    38.0..100.0 => Some(1),
                    100.0.. => Some(2),
                    _ => None,
                };
                if let Some(zone) = zone {
                    counts[zone][0] +=
                        u32::from(track.is_some_and(|track| track.existence >= 0.5 && track.class.is_vehicle()));
                    counts[zone][1] += 1;
                }
                encounter.advance();
            }
        }
        counts.map(|[seen, all]| f64::from(seen) / f64::from(all))
    };
    assert_eq!(counts(0.0, 2), [1.0, 0.0, 0.0]);
    let [near, between, beyond] = counts(0.4, 40);
    assert!(near > 0.99 && (0.25..0.5).contains(&between) && beyond == 0.0, "{near} {between} {beyond}");
}

#[test]
fn a_pitching_ego_sees_the_vehicle_at_another_distance() {
    let mut fit = RearFit::shipped().unwrap().clone();
    let ratios = |ratio: f64| BTreeMap::from([("saloon".to_owned(), vec![vec![ratio; 2]; 2])]);
    let shapes = |(pitch_rad, ratio): (f64, f64)| PitchedShapes {
        pitch_rad,
        paints: vec![0.1, 0.5],
        extinctions_per_m: vec![0.0, 0.1],
        range: ratios(ratio),
        class_range: ratios(ratio),
        spread: BTreeMap::new(),
    };
    fit.pitched = [(0.0, 1.0), (1e-3, 0.6)].map(shapes).to_vec();
    let fit = &*Box::leak(Box::new(fit));
    let confirmed_m = |pitch_rad: f64| {
        let (config, none) = (ObjectSensorConfig::default(), Parameters::default());
        let rear = config.check_rear_object(&none).unwrap().with_fit(fit);
        let models = [config.check_front_radar(&none).unwrap(), config.check_surround(&none).unwrap(), rear];
        let (mut encounter, mut perception) = (Encounter::new(), ObjectPerception::new(models, &key(3)));
        encounter.ego.pitch_rad = pitch_rad;
        loop {
            let tracks = perception.step(&encounter.scene()).unwrap();
            if let Some(track) = confirmed_track(tracks, Source::Rear) {
                break -track.x_m();
            }
            encounter.advance();
        }
    };
    let [level_m, half_m, pitched_m] = [0.0, 5e-4, 1e-3].map(confirmed_m);
    assert!((pitched_m / level_m - 0.6).abs() < 0.05, "{level_m} {pitched_m}");
    assert!((half_m / level_m - 0.8).abs() < 0.05, "{level_m} {half_m}");
}

/// Returns the gaps behind the ego at which the rear vehicle, of a class and in fog of a
/// visibility, is confirmed and classified (m).
fn confirmed_and_classified_m(class: VehicleClass, visibility_m: f64, altered: &Alterations) -> [f64; 2] {
    let mut encounter = Encounter::new();
    encounter.environment.visibility_m = visibility_m;
    encounter.others[1] = with_speed(scene_vehicle(2, class, 870.0, OWN_LANE_M), 40.0);
    let half_m = 0.5 * (encounter.others[1].vehicle.dimensions.length_m + encounter.ego.vehicle.dimensions.length_m);
    let mut perception = altered_perception(4, altered);
    let mut found_m = [0.0_f64; 2];
    while encounter.others[1].state.s_m < encounter.ego.state.s_m - half_m - 5.0 {
        let gap_m = encounter.ego.state.s_m - encounter.others[1].state.s_m - half_m;
        let tracks = perception.step(&encounter.scene()).unwrap();
        let track = confirmed_track(tracks, Source::Rear);
        let lead = confirmed_track(tracks, Source::Front);
        assert!(lead.is_none_or(|lead| lead.class.is_vehicle()), "a radar needs no camera");
        for (found_m, is_found) in found_m.iter_mut().zip([true, track.is_some_and(|track| track.class.is_vehicle())]) {
            *found_m = if track.is_some() && is_found { found_m.max(gap_m) } else { *found_m };
        }
        encounter.advance();
    }
    found_m
}

#[test]
fn in_fog_a_truck_is_confirmed_by_its_plate_long_before_it_is_recognised() {
    let fitted = Alterations::default();
    let [confirmed_m, classified_m] = confirmed_and_classified_m(VehicleClass::Truck, 100.0, &fitted);
    assert!(
        (60.0..70.0).contains(&confirmed_m) && (25.0..45.0).contains(&classified_m),
        "{confirmed_m} {classified_m}"
    );
    // Denser fog, nearer.
    let [_, denser_m] = confirmed_and_classified_m(VehicleClass::Truck, 60.0, &fitted);
    assert!(denser_m < classified_m - 5.0, "{denser_m}");
    let [confirmed_m, classified_m] = confirmed_and_classified_m(VehicleClass::Truck, 10_000.0, &fitted);
    // The drive begins at a gap of some 120 m, within the range of a truck.
    assert!(classified_m == confirmed_m && confirmed_m > 110.0, "in clear air at once: {confirmed_m} {classified_m}");
    let with_true_class = Alterations { has_true_class: true, ..Alterations::default() };
    let [confirmed_m, classified_m] = confirmed_and_classified_m(VehicleClass::Truck, 100.0, &with_true_class);
    assert_eq!(classified_m, confirmed_m, "a class that is given is known at once");
}
