//! The LiDAR that looks ahead.

use closecall_traffic::{
    ActorId, Alignment, AlignmentPoint, CONTROL_STEP, Check, Environment, Parameters, Road, Source, Time, Track,
    TrackStatus, VehicleClass, maths,
};

use crate::testing::{OWN_LANE_M, scene_vehicle, with_speed};
use crate::{NoiseKey, Perception, Scene, SceneVehicle, SensorsConfig};

/// Returns the perception of these sensors.
fn perception(sensors: &str) -> Box<dyn Perception> {
    let text = format!("mode = \"full\"\nrear-camera.pipeline = \"off\"\n{sensors}");
    let sensors = toml::from_str::<SensorsConfig>(&text).unwrap().check(&Parameters::default()).unwrap();
    let key = NoiseKey { seed: 1, sample: 2, ego: ActorId::new("ego").unwrap(), actors: [].into() };
    sensors.build(&key).unwrap()
}

/// Lets the ego drive at 30 m/s behind a vehicle, and returns the confirmed front tracks of the
/// last step with the true gap.
fn follow(sensors: &str, road: &Road, class: VehicleClass, [gap_m, speed_mps]: [f64; 2]) -> (Vec<Track>, f64) {
    let mut perception = perception(sensors);
    let environment = Environment::CLEAR_DAY;
    let (mut tracks, mut true_gap_m) = (Vec::new(), 0.0);
    for step in 0..75 {
        let time = Time::from_ns(step * CONTROL_STEP.ns());
        let ego = with_speed(scene_vehicle(0, VehicleClass::Car, 500.0 + 30.0 * time.s(), OWN_LANE_M), 30.0);
        let mut lead = with_speed(scene_vehicle(1, class, 0.0, OWN_LANE_M + 0.3), speed_mps);
        let half_m = |vehicle: &SceneVehicle| 0.5 * vehicle.vehicle.dimensions.length_m;
        lead.state.s_m = 500.0 + half_m(&ego) + gap_m + half_m(&lead) + speed_mps * time.s();
        true_gap_m = lead.state.s_m - ego.state.s_m - half_m(&ego) - half_m(&lead);
        let scene = Scene { time, road, environment: &environment, ego, others: &[lead] };
        tracks = perception.step(&scene).unwrap().to_vec();
    }
    tracks.retain(|track| track.source == Source::Front && track.status == TrackStatus::Confirmed);
    (tracks, true_gap_m)
}

/// Asserts that the only front track lies where the vehicle is.
fn assert_follows(sensors: &str, road: &Road, class: VehicleClass, motion: [f64; 2]) {
    let (tracks, true_gap_m) = follow(sensors, road, class, motion);
    let [track] = tracks.as_slice() else { panic!("{} tracks of {class:?} for {sensors}", tracks.len()) };
    let gap_m = track.x_m() - 0.5 * track.length_m - 2.3;
    assert!((gap_m - true_gap_m).abs() < 0.5, "{class:?}, {sensors}: {gap_m} instead of {true_gap_m}");
    assert!((track.vx_mps() - motion[1]).abs() < 0.8, "{class:?}, {sensors}: {} m/s", track.vx_mps());
    assert!(track.lane[1] > 0.9 && track.heading_rad.abs() < 0.1, "{:?} {}", track.lane, track.heading_rad);
}

#[test]
fn a_vehicle_ahead_gives_one_track_with_gap_speed_and_lane() {
    for class in VehicleClass::ALL {
        assert_follows("front-lidar = {}", &Road::straight(3).with_guard_rails(), class, [45.0, 28.0]);
        assert_follows("front-lidar = {}", &Road::straight(3), class, [30.0, 33.0]);
    }
    // On a bend the gap along the path of the ego differs from that along the reference line by
    // less than the tolerance.
    let bend = Road::straight(3).with_curvature(0.000_5).with_guard_rails();
    assert_follows("front-lidar = {}", &bend, VehicleClass::Car, [40.0, 29.0]);
    // The vehicle is on the clothoid behind the arc on which the ego drives.
    let points = [[400.0, 0.0], [480.0, 0.000_5], [570.0, 0.000_5], [650.0, -0.000_5]];
    let points = points.map(|[s_m, curvature_per_m]| AlignmentPoint { s_m, curvature_per_m });
    let course = Road::straight(3).with_alignment(Alignment::new(&points).unwrap()).with_guard_rails();
    assert_follows("front-lidar = {}", &course, VehicleClass::Car, [40.0, 29.0]);
}

#[test]
fn a_vehicle_in_the_left_lane_that_moves_to_the_left_is_not_mirrored() {
    let (road, environment) = (Road::straight(3), Environment::CLEAR_DAY);
    let mut perception = perception("front-lidar = {}");
    let (mut tracks, mut true_y_m) = (Vec::new(), 0.0);
    for step in 0..75 {
        let time = Time::from_ns(step * CONTROL_STEP.ns());
        let ego = with_speed(scene_vehicle(0, VehicleClass::Car, 500.0 + 29.0 * time.s(), OWN_LANE_M), 29.0);
        true_y_m = 3.0 + 0.4 * time.s();
        let (s_m, d_m) = (540.0 + 29.0 * time.s(), OWN_LANE_M + true_y_m);
        let mut lead = with_speed(scene_vehicle(1, VehicleClass::Car, s_m, d_m), 29.0);
        lead.state.heading_rad = maths::atan(0.4_f64 / 29.0);
        let scene = Scene { time, road: &road, environment: &environment, ego, others: &[lead] };
        tracks = perception.step(&scene).unwrap().to_vec();
    }
    tracks.retain(|track| track.source == Source::Front && track.status == TrackStatus::Confirmed);
    let [track] = tracks.as_slice() else { panic!("{} tracks", tracks.len()) };
    assert!((track.y_m() - true_y_m).abs() < 0.3, "{} instead of {true_y_m}", track.y_m());
    assert!((track.vy_mps() - 0.4).abs() < 0.3, "{} m/s", track.vy_mps());
    assert!(track.lane[0] > 0.9, "{:?}", track.lane);
}

#[test]
fn other_kinds_of_lidar_look_ahead_at_their_own_rate() {
    for model in ["os1-64", "pandar-xt-16"] {
        let sensors = format!("front-lidar.model = \"{model}\"");
        assert_follows(&sensors, &Road::straight(3), VehicleClass::Car, [20.0, 29.0]);
    }
}

#[test]
fn a_front_lidar_leaves_the_tracks_of_the_other_sensors_as_they_are() {
    let road = Road::straight(3);
    let environment = Environment::CLEAR_DAY;
    let run = |sensors: &str| {
        let mut perception = perception(sensors);
        let mut rear = Vec::new();
        for step in 0..40 {
            let time = Time::from_ns(step * CONTROL_STEP.ns());
            let ego = with_speed(scene_vehicle(0, VehicleClass::Car, 500.0 + 30.0 * time.s(), OWN_LANE_M), 30.0);
            let other = with_speed(scene_vehicle(1, VehicleClass::Car, 450.0 + 32.0 * time.s(), OWN_LANE_M), 32.0);
            let scene = Scene { time, road: &road, environment: &environment, ego, others: &[other] };
            let tracks = perception.step(&scene).unwrap().to_vec();
            rear.extend(tracks.into_iter().filter(|track| track.source == Source::Rear).map(|track| track.state));
        }
        rear
    };
    let with_radar = run("");
    assert!(!with_radar.is_empty());
    assert_eq!(with_radar, run("front-lidar = {}"));
}

#[test]
fn the_front_lidar_measures_the_vehicle_at_points() {
    let mut perception = perception("front-lidar = {}");
    let (road, environment) = (Road::straight(3), Environment::CLEAR_DAY);
    let ego = with_speed(scene_vehicle(0, VehicleClass::Car, 500.0, OWN_LANE_M), 30.0);
    let lead = with_speed(scene_vehicle(1, VehicleClass::Car, 530.0, OWN_LANE_M), 30.0);
    let scene = Scene { time: Time::ZERO, road: &road, environment: &environment, ego, others: &[lead] };
    perception.step(&scene).unwrap();
    let lidars = perception.lidars();
    let [front, rear] = lidars[..] else { panic!("{} LiDARs", lidars.len()) };
    assert_eq!(
        [(front.name, front.looks_ahead), (rear.name, rear.looks_ahead)],
        [("front-lidar", true), ("rear-lidar", false)]
    );
    assert!(front.lidar.latest().len() > 100);
    // In the turned frame, the rear of the vehicle ahead is 30 m less two half lengths behind the
    // sensor.
    let [detection] = front.detections else { panic!("{:?}", front.detections) };
    assert!((detection.face_x_m + 30.0 - 2.3).abs() < 0.3, "{}", detection.face_x_m);
}
