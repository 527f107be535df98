//! Long vehicles beside the ego: the whole chain follows each as one vehicle, whatever part of it
//! the sensor sees.
//!
//! Beside the ego, the beams pass below the load of a truck. They show a cab, the guards and the
//! wheels on both sides as separate clusters, and the field of view cuts off the front.

use std::collections::BTreeSet;

use closecall_traffic::{
    ActorId, BodyShape, CONTROL_STEP, Check, Dimensions, Environment, Parameters, Road, Source, Track, TrackId,
    TrackStatus, VehicleClass,
};

use super::tracking::PERIOD_S;
use crate::testing::{OWN_LANE_M, scene_vehicle, with_speed};
use crate::{NoiseKey, Scene, SceneVehicle, SensorMode, SensorsConfig};

/// Speed of the ego (m/s).
const EGO_MPS: f64 = 30.0;
/// Number of steps with a confirmed track after which its errors count: 1 s.
const SETTLED_STEPS: usize = 25;
/// Greatest error of the speed (m/s).
const SPEED_MPS: f64 = 1.0;

/// A long vehicle in a neighbouring lane, at a constant speed.
#[derive(Clone, Copy, Debug)]
struct Passing {
    shape: BodyShape,
    length_m: f64,
    /// Lateral distance from the ego (m), positive to the left.
    left_m: f64,
    /// Speed beyond the ego's (m/s).
    faster_mps: f64,
    /// Position of its front ahead of the ego's rear at the start (m).
    front_m: f64,
    seconds: f64,
}

/// The rear tracks of a passing.
#[derive(Debug, Default)]
struct Observed {
    /// Numbers of the confirmed tracks.
    ids: BTreeSet<u32>,
    steps: usize,
    confirmed_steps: usize,
    /// Number of steps with several confirmed tracks.
    several: usize,
    /// Largest error of a track's speed (m/s).
    speed_mps: f64,
    /// Number of steps in which a track has another class.
    misclassified: usize,
    /// Number of steps in which a track is not in the lane of the vehicle, so that the lane would
    /// count as free.
    in_other_lane: usize,
}

/// Returns the ego at the start, and the position of its rear end (m).
fn ego_at_start() -> (SceneVehicle, f64) {
    let ego = with_speed(scene_vehicle(0, VehicleClass::Car, 1_000.0, OWN_LANE_M), EGO_MPS);
    (ego, ego.state.s_m - 0.5 * ego.vehicle.dimensions.length_m)
}

/// Drives the ego and the others at constant speeds, with the random numbers of this seed and
/// sample. Calls `see` in each step with its number, the confirmed rear tracks, the ego and the
/// others.
fn drive<const N: usize>(
    [seed, sample]: [u64; 2],
    mut others: [SceneVehicle; N],
    steps: usize,
    mut see: impl FnMut(usize, &[Track], &SceneVehicle, &[SceneVehicle; N]),
) {
    let sensors = SensorsConfig::default().check(&Parameters::default()).unwrap().with_mode(SensorMode::Full);
    let key = NoiseKey { seed, sample, ego: ActorId::new("ego").unwrap(), actors: [].into() };
    let mut perception = sensors.build(&key).unwrap();
    let road = Road::straight(3);
    let (mut ego, _) = ego_at_start();
    for (step, index) in (0..steps).zip(0..) {
        let environment = &Environment::CLEAR_DAY;
        let scene = Scene { time: CONTROL_STEP * index, road: &road, environment, ego, others: &others };
        let tracks = perception.step(&scene).unwrap().iter();
        let is_confirmed = |track: &&Track| track.source == Source::Rear && track.status != TrackStatus::Tentative;
        let confirmed: Vec<Track> = tracks.filter(is_confirmed).cloned().collect();
        see(step, &confirmed, &ego, &others);
        for vehicle in others.iter_mut().chain([&mut ego]) {
            vehicle.state.s_m += PERIOD_S * vehicle.state.speed_mps;
        }
    }
}

/// Lets the vehicle pass, with the random numbers of this sample.
fn pass(passing: &Passing, sample: u64) -> Observed {
    let (_, rear_s_m) = ego_at_start();
    let s_m = rear_s_m + passing.front_m - 0.5 * passing.length_m;
    let mut truck = scene_vehicle(1, VehicleClass::Truck, s_m, OWN_LANE_M + passing.left_m);
    truck.vehicle.dimensions = Dimensions { length_m: passing.length_m, ..passing.shape.usual_dimensions() };
    truck.vehicle.appearance.body_shape = passing.shape;
    truck.state.speed_mps = EGO_MPS + passing.faster_mps;
    let mut observed = Observed::default();
    let mut confirmed_at: Vec<(TrackId, usize)> = Vec::new();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few seconds")]
    let steps = (passing.seconds / PERIOD_S) as usize;
    drive([9, sample], [truck], steps, |step, confirmed, _, [truck]| {
        observed.steps += 1;
        observed.several += usize::from(confirmed.len() > 1);
        observed.confirmed_steps += usize::from(!confirmed.is_empty());
        for track in confirmed {
            observed.ids.insert(track.id.0);
            if !confirmed_at.iter().any(|(id, _)| *id == track.id) {
                confirmed_at.push((track.id, step));
            }
            let since = confirmed_at.iter().find(|(id, _)| *id == track.id).unwrap().1;
            if step >= since + SETTLED_STEPS {
                observed.speed_mps = observed.speed_mps.max((track.vx_mps() - truck.state.speed_mps).abs());
                observed.misclassified += usize::from(track.class.best_vehicle_class() != VehicleClass::Truck);
                let lane = if passing.left_m > 0.0 { 0 } else { 2 };
                observed.in_other_lane += usize::from(!(track.lane[lane] >= 0.5));
            }
        }
    });
    observed
}

/// Returns passings of a vehicle of this length: it overtakes slowly and fast, the ego passes it
/// slowly and fast, and it is beside the ego from the start.
fn passings(shape: BodyShape, length_m: f64, left_m: f64) -> Vec<Passing> {
    let passing =
        |faster_mps: f64, front_m: f64, seconds: f64| Passing { shape, length_m, left_m, faster_mps, front_m, seconds };
    vec![
        passing(2.0, -30.0, 19.0 + 0.5 * length_m),
        passing(6.0, -60.0, 13.0 + length_m / 6.0),
        passing(-2.0, length_m + 8.0, 20.0 + 0.5 * length_m),
        passing(-6.0, length_m + 8.0, 10.0 + length_m / 6.0),
        passing(0.0, 3.0, 8.0),
        passing(0.5, 0.0, 16.0),
        passing(-0.5, 10.0, 16.0),
    ]
}

fn assert_one_track(cases: &[Passing]) {
    let mut wrong = Vec::new();
    for (passing, sample) in cases.iter().zip(0..) {
        let observed = pass(passing, sample);
        let is_one = observed.ids.len() == 1 && observed.several == 0;
        let is_followed = 4 * observed.confirmed_steps > observed.steps;
        let is_right = observed.speed_mps <= SPEED_MPS && observed.misclassified == 0 && observed.in_other_lane == 0;
        if !(is_one && is_followed && is_right) {
            wrong.push(format!("{passing:?}: {observed:?}"));
        }
    }
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), cases.len(), wrong.join("\n"));
}

/// Returns passings of vehicles of these shapes and lengths in either neighbouring lane.
fn in_both_lanes(vehicles: impl IntoIterator<Item = (BodyShape, f64)>) -> Vec<Passing> {
    let of_lane = |(shape, length_m): (BodyShape, f64)| [3.75, -3.75].map(|left_m| passings(shape, length_m, left_m));
    vehicles.into_iter().flat_map(of_lane).flatten().collect()
}

#[test]
fn a_truck_that_passes_or_is_passed_is_one_track_with_its_speed_and_class() {
    assert_one_track(&in_both_lanes([12.0, 16.5, 18.0, 25.0].map(|length_m| (BodyShape::TarpaulinTrailer, length_m))));
}

#[test]
fn trucks_of_every_shape_are_one_track() {
    // The ends of a tank or a platform seem to move: the wheels tell how the vehicle moves. Of a
    // shorter truck beside the ego, too little is seen.
    let lengths = |shape: &BodyShape| (*shape, shape.usual_dimensions().length_m.max(12.0));
    let usual = BodyShape::of_class(VehicleClass::Truck).iter().map(lengths);
    assert_one_track(&in_both_lanes(usual.filter(|(shape, _)| *shape != BodyShape::TarpaulinTrailer)));
    let long = [(BodyShape::Tanker, 18.0), (BodyShape::Tanker, 25.0), (BodyShape::PlatformTruck, 25.0)];
    assert_one_track(&in_both_lanes(long));
}

#[test]
fn trucks_of_other_lengths_speeds_and_offsets_are_one_track_too() {
    let mut cases = Vec::new();
    for (shape, length_m, left_m, faster_mps, front_m, seconds) in [
        (BodyShape::TarpaulinTrailer, 10.0, 3.5, 3.0, -40.0, 22.0),
        (BodyShape::Tanker, 13.6, -3.9, 1.2, -15.0, 25.0),
        (BodyShape::BoxTrailer, 15.0, 4.1, 9.0, -80.0, 14.0),
        (BodyShape::PlatformTruck, 17.3, -3.4, 4.0, -70.0, 25.0),
        (BodyShape::TarpaulinTrailer, 19.0, 3.6, 1.5, -12.0, 25.0),
        (BodyShape::Tanker, 22.0, -3.75, 2.5, -25.0, 22.0),
        (BodyShape::BoxTruck, 10.5, 3.6, -3.0, 14.0, 18.0),
        (BodyShape::TarpaulinTrailer, 13.6, 3.9, -1.2, 15.0, 30.0),
        (BodyShape::Coach, 14.2, -3.5, -9.0, 40.0, 12.0),
        (BodyShape::PlatformTruck, 17.3, 3.4, -4.0, 30.0, 20.0),
        (BodyShape::BonnetedTractor, 19.0, -4.0, -1.5, 20.0, 30.0),
        (BodyShape::Tanker, 22.0, 3.75, -2.5, 25.0, 25.0),
    ] {
        cases.push(Passing { shape, length_m, left_m, faster_mps, front_m, seconds });
    }
    assert_one_track(&cases);
}

/// Returns two counts of faults over the last 25 steps, with a follower of this class behind the
/// ego and a truck beside the ego, `aside_m` to its left. Either the follower has no confirmed track
/// of its own or several, or a confirmed track is where neither vehicle is.
fn beside_a_truck(follower: VehicleClass, aside_m: f64, offset_m: f64, sample: u64) -> [usize; 2] {
    let own_m = OWN_LANE_M;
    let (_, rear_m) = ego_at_start();
    let mut truck = scene_vehicle(1, VehicleClass::Truck, rear_m + 3.0 - 9.0, own_m + aside_m);
    truck.vehicle.dimensions.length_m = 18.0;
    let mut behind = scene_vehicle(2, follower, rear_m - 10.0, own_m + offset_m);
    for vehicle in [&mut truck, &mut behind] {
        vehicle.state.speed_mps = EGO_MPS;
    }
    let mut wrong = [0; 2];
    drive([11, sample], [truck, behind], 75, |step, confirmed, _, _| {
        if step >= 50 {
            let y_m: Vec<f64> = confirmed.iter().map(|track| track.state[1]).collect();
            wrong[0] += y_m.iter().filter(|y_m| (*y_m - offset_m).abs() <= 0.3).count().abs_diff(1);
            wrong[1] += y_m.iter().filter(|y_m| (*y_m - offset_m).abs() > 0.3 && (*y_m - aside_m).abs() > 0.3).count();
        }
    });
    wrong
}

#[test]
fn a_follower_beside_a_truck_whose_front_is_out_of_view_keeps_its_own_track() {
    for (follower, aside_m, offset_m) in [
        (VehicleClass::Truck, 3.75, 0.35),
        (VehicleClass::Car, 3.5, 0.4),
        (VehicleClass::Motorcycle, 3.5, 1.2),
        (VehicleClass::Truck, 3.25, 0.1),
    ] {
        assert_eq!(beside_a_truck(follower, aside_m, offset_m, 0), [0, 0], "{follower:?} {aside_m} {offset_m}");
    }
}

/// A motorcycle that follows a truck of 14 m. The truck overtakes the ego in a neighbouring lane.
#[derive(Clone, Copy, Debug)]
struct Following {
    shape: BodyShape,
    /// Gap between truck and motorcycle (m).
    gap_m: f64,
    /// Distance of the motorcycle from the middle of its lane, towards the ego (m).
    towards_ego_m: f64,
    /// Lateral distance of the truck from the ego (m), positive to the left.
    left_m: f64,
    /// Distance of the truck's front behind the ego at the start (m).
    from_m: f64,
    /// Speed beyond the ego's (m/s).
    faster_mps: f64,
}

/// Returns the share of the steps in which the motorcycle has a confirmed track, and the number of
/// confirmed tracks that are neither the only one of the truck nor of the motorcycle.
fn behind_a_truck(following: &Following) -> (f64, usize) {
    const TRUCK_M: f64 = 14.0;
    let Following { shape, gap_m, towards_ego_m, left_m, from_m, faster_mps } = *following;
    let (_, rear_m) = ego_at_start();
    let front_m = rear_m - from_m;
    let mut truck = scene_vehicle(1, VehicleClass::Truck, front_m - 0.5 * TRUCK_M, OWN_LANE_M + left_m);
    truck.vehicle.dimensions.length_m = TRUCK_M;
    let d_m = truck.state.d_m - towards_ego_m.copysign(left_m);
    let mut behind = scene_vehicle(2, VehicleClass::Motorcycle, front_m - TRUCK_M - gap_m - 1.1, d_m);
    behind.vehicle.appearance.body_shape = shape;
    behind.vehicle.dimensions.height_m = shape.usual_dimensions().height_m;
    for vehicle in [&mut truck, &mut behind] {
        vehicle.state.speed_mps = EGO_MPS + faster_mps;
    }
    let (mut tracked, mut more) = (0, 0);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few seconds")]
    let steps = ((from_m - 7.0) / faster_mps / PERIOD_S) as usize;
    drive([11, 3], [truck, behind], steps, |_, confirmed, ego, [truck, behind]| {
        // Confirmed tracks within these distances of a vehicle.
        let count = |vehicle: &SceneVehicle, along_m: f64, across_m: f64| {
            let [x_m, y_m] = [vehicle.state.s_m - ego.state.s_m, vehicle.state.d_m - ego.state.d_m];
            let is_there =
                |track: &&Track| (track.state[0] - x_m).abs() <= along_m && (track.state[1] - y_m).abs() <= across_m;
            confirmed.iter().filter(is_there).count()
        };
        let of_motorcycle = count(behind, 2.0, 1.3).min(1);
        tracked += of_motorcycle;
        more += confirmed.len() - of_motorcycle - count(truck, 8.0, 1.9).min(1);
    });
    #[expect(clippy::cast_precision_loss, reason = "a few hundred")]
    let share = tracked as f64 / steps as f64;
    (share, more)
}

#[test]
fn a_motorcycle_behind_a_truck_is_no_part_of_the_truck() {
    // It rides on the side of the lane from which the ego sees it past the truck. From far away it
    // looks as narrow as a wheel. Of the longest way, it is in range in two thirds.
    for (from_m, faster_mps, least) in [(30.0, 2.0, 0.9), (55.0, 5.0, 0.85), (90.0, 6.0, 0.5)] {
        for (gap_m, towards_ego_m, left_m) in [(9.0, 1.1, 3.75), (6.0, 0.9, -3.75)] {
            for shape in [BodyShape::Scooter, BodyShape::SportBike, BodyShape::Tourer] {
                let following = Following { shape, gap_m, towards_ego_m, left_m, from_m, faster_mps };
                let (share, more) = behind_a_truck(&following);
                assert!(share >= least && more <= 3, "{following:?}: {share:.3}, {more} more");
            }
        }
    }
}
