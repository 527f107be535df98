//! Tests the pipeline `mask-rcnn` in the chain of the rear sensors: latency, faults of the camera,
//! and vehicles that only one sensor sees.
//!
//! Needs the shared library of the `onnxruntime` wheel.

use closecall_sensors::camera::{Backend, ExposureKey, WholeImageDetector};
use closecall_sensors::faults::{CameraFaultConfig, FaultEntries, Faults, LidarFaultConfig};
use closecall_sensors::{
    Detection, Health, NoiseKey, Perception, Scene, SceneVehicle, SensorsConfig, set_inference_backend,
};
use closecall_traffic::{
    ActorId, CONTROL_STEP, Check, Environment, Parameters, Road, Time, Vehicle, VehicleClass, VehicleState,
};

/// A network whose result arrives five control steps after the exposure.
const SENSORS: &str = "mode = 'full'\nrear-camera = { pipeline = 'mask-rcnn', mask-rcnn = { latency-s = 0.2 } }\n";

fn has_backend() -> bool {
    let library = closecall_testing::onnxruntime();
    library.map(|library| set_inference_backend(Backend::OnnxRuntime(library))).is_some()
}

fn faults(camera: &str, lidar: &str) -> Faults {
    let camera: Vec<CameraFaultConfig> =
        (!camera.is_empty()).then(|| toml::from_str(camera).expect("a camera fault")).into_iter().collect();
    let lidar: Vec<LidarFaultConfig> =
        (!lidar.is_empty()).then(|| toml::from_str(lidar).expect("a LiDAR fault")).into_iter().collect();
    let entries = FaultEntries {
        rear_lidar: &lidar,
        front_lidar: &[],
        rear_camera: &camera,
        object: [&[], &[], &[]],
        rear_radar: &[],
        odometry: None,
    };
    entries.check(&Parameters::default()).expect("valid settings and scenes")
}

fn perception(sensors: &str, faults: Faults) -> Box<dyn Perception> {
    let config: SensorsConfig = toml::from_str(sensors).expect("valid settings and scenes");
    let key = NoiseKey {
        seed: 1,
        sample: 2,
        ego: ActorId::new("ego").expect("valid settings and scenes"),
        actors: [].into(),
    };
    config
        .check(&Parameters::default())
        .expect("valid settings and scenes")
        .with_faults(faults)
        .build(&key)
        .expect("valid settings and scenes")
}

fn vehicle(actor: usize, class: VehicleClass, s_m: f64) -> SceneVehicle {
    let state = VehicleState { s_m, d_m: -5.625, speed_mps: 30.0, ..VehicleState::default() };
    SceneVehicle { actor, vehicle: Vehicle::typical(class), state, pitch_rad: 0.0 }
}

/// Runs a second and a half with a truck whose front is 30 m behind the ego's middle. Returns the
/// detections of each step, and the health.
fn follow(mut perception: Box<dyn Perception>) -> (Vec<Vec<Detection>>, Health) {
    let (road, environment) = (Road::straight(3), Environment::CLEAR_DAY);
    let mut detections = Vec::new();
    for step in 0..38 {
        let time = CONTROL_STEP * step;
        let ego = vehicle(0, VehicleClass::Car, 500.0 + 30.0 * time.s());
        let truck = vehicle(1, VehicleClass::Truck, ego.state.s_m - 30.0);
        let mut truck = truck;
        truck.state.s_m -= 0.5 * truck.vehicle.dimensions.length_m;
        perception
            .step(&Scene { time, road: &road, environment: &environment, ego, others: &[truck] })
            .expect("valid settings and scenes");
        detections.push(perception.rear_lidar().map(|lidar| lidar.detections.to_vec()).unwrap_or_default());
    }
    (detections, perception.health().rear)
}

/// Runs `steps` control steps. `others` returns the vehicles of each, from the time (s). Returns
/// the LiDAR's detections of each step, including the camera-only detections.
fn run(sensors: &str, lidar: &str, steps: i64, others: impl Fn(f64) -> Vec<SceneVehicle>) -> Vec<Vec<Detection>> {
    let (road, environment) = (Road::straight(3), Environment::CLEAR_DAY);
    let mut perception = perception(sensors, faults("", lidar));
    let step = |step: i64| {
        let time = CONTROL_STEP * step;
        let (ego, others) = (vehicle(0, VehicleClass::Car, 500.0 + 30.0 * time.s()), others(time.s()));
        let scene = Scene { time, road: &road, environment: &environment, ego, others: &others };
        perception.step(&scene).expect("valid settings and scenes");
        perception.rear_lidar().map(|lidar| lidar.detections.to_vec()).unwrap_or_default()
    };
    (0..steps).map(step).collect()
}

/// Returns a vehicle whose front is `gap_m` behind the middle of the ego after `time_s`, at a
/// lateral position of `y_m` from the ego.
fn behind(class: VehicleClass, time_s: f64, [gap_m, y_m]: [f64; 2], closing_mps: f64) -> SceneVehicle {
    let mut other = vehicle(class as usize + 1, class, 500.0 + 30.0 * time_s - gap_m);
    other.state.s_m -= 0.5 * other.vehicle.dimensions.length_m;
    (other.state.d_m, other.state.speed_mps) = (other.state.d_m + y_m, 30.0 + closing_mps);
    other
}

/// Returns the detection nearest to a lateral position (m), which is one metre away at most.
fn at_side(detections: &[Detection], y_m: f64) -> &Detection {
    let off_m = |seen: &&Detection| (seen.face_y_m - y_m).abs();
    let nearest = detections.iter().min_by(|a, b| off_m(a).total_cmp(&off_m(b)));
    nearest.filter(|seen| off_m(seen) < 1.0).expect("a detection there")
}

#[test]
fn a_second_equal_camera_adds_no_evidence_and_no_vehicle() {
    if !has_backend() {
        return;
    }
    let twin = "additional-rear-cameras = [{ name = 'twin', pipeline = 'mask-rcnn', mask-rcnn = { latency-s = 0.2 } }]";
    let several = format!("{SENSORS}{twin}");
    let others = |time_s| {
        vec![
            behind(VehicleClass::Truck, time_s, [30.0, 0.0], 0.0),
            behind(VehicleClass::Car, time_s, [18.0, 3.75], 0.0),
        ]
    };
    // A LiDAR that is blocked on the left leaves the car to the cameras.
    for lidar in ["", "blocked-from-deg = 2.0\nblocked-to-deg = 40.0"] {
        let [one, two] = [SENSORS, &several].map(|sensors| run(sensors, lidar, 20, others));
        assert!(one == two, "{lidar}");
        let is_alone = |seen: &Detection| seen.seen_by == closecall_sensors::SeenBy::CameraAlone;
        assert_eq!(one.iter().flatten().any(is_alone), !lidar.is_empty());
    }
    let shown = perception(&several, faults("", "")).rear_images().len();
    assert_eq!(shown, 0, "no image before the first step");
}

#[test]
fn the_shown_image_has_the_instances_that_the_detector_finds_in_the_scene() {
    let Some(library) = closecall_testing::onnxruntime() else { return };
    set_inference_backend(Backend::OnnxRuntime(library.clone()));
    let config: SensorsConfig = toml::from_str(SENSORS).expect("valid settings and scenes");
    let camera = *config.check(&Parameters::default()).expect("valid settings and scenes").camera();
    let mut detector = WholeImageDetector::new(camera, &Backend::OnnxRuntime(library)).expect("the shipped network");
    let (road, environment) = (Road::straight(3), Environment::CLEAR_DAY);
    let ego = vehicle(0, VehicleClass::Car, 500.0);
    let others =
        [behind(VehicleClass::Truck, 0.0, [30.0, 0.0], 0.0), behind(VehicleClass::Car, 0.0, [18.0, 3.75], 0.0)];
    let scene = Scene { time: CONTROL_STEP, road: &road, environment: &environment, ego, others: &others };
    let mut perception = perception(SENSORS, faults("", ""));
    perception.step(&Scene { time: Time::ZERO, ..scene }).expect("valid settings and scenes");
    let images = perception.rear_images();
    let shown = *images.first().expect("an image at the first step");
    assert_eq!((shown.time, shown.shown_time), (Time::ZERO, Time::ZERO));
    // The noise is another, so that boxes differ by little.
    let scene = Scene { time: Time::ZERO, ..scene };
    let instances = detector.detect(&scene, ExposureKey(7), None).expect("an image that can be evaluated");
    let sure = instances.iter().filter(|instance| instance.score > 0.9);
    let mut compared = 0;
    for instance in sure {
        let off_px = |other: &closecall_sensors::camera::Instance| {
            instance.box_px.iter().zip(other.box_px).map(|(side, other)| (side - other).abs()).fold(0.0, f64::max)
        };
        let same = |other: &&closecall_sensors::camera::Instance| other.class == instance.class && off_px(other) < 4.0;
        assert!(shown.instances.iter().any(|other| same(&other)), "{instance:?} is not among {:?}", shown.instances);
        compared += 1;
    }
    assert!(compared >= 2, "{instances:?}");
}

#[test]
fn a_late_result_applies_to_the_vehicles_and_not_to_their_places() {
    if !has_backend() {
        return;
    }
    // A truck takes the place that a car had at the exposure, while both change lanes and close in.
    // The result arrives after 0.6 s.
    let arrives = 15;
    let changed_m = |time_s: f64| 3.75 * (time_s / 0.6).min(1.0);
    let others = |time_s: f64| {
        let gap_m = 28.0 - 8.0 * time_s;
        let at = |class, y_m: f64| behind(class, time_s, [gap_m, y_m - changed_m(time_s)], 8.0);
        vec![at(VehicleClass::Truck, 3.75), at(VehicleClass::Car, 0.0)]
    };
    let off = "mode = 'full'\nrear-camera = { pipeline = 'off' }\n";
    let slow =
        "mode = 'full'\nrear-camera = { pipeline = 'mask-rcnn', mask-rcnn = { rate-hz = 1.0, latency-s = 0.6 } }\n";
    let [without, with] = [off, slow].map(|sensors| run(sensors, "", 20, others));
    assert_eq!(with[..arrives], without[..arrives], "no result has arrived");
    for step in arrives..20 {
        for (class, y_m) in [(VehicleClass::Truck, 0.0), (VehicleClass::Car, -3.75)] {
            let [shape, fused] = [&without, &with].map(|run| at_side(&run[step], y_m).class);
            let (shape, fused) = (shape.0[class as usize], fused.0[class as usize]);
            assert!(
                fused > 0.9 && fused > shape,
                "step {step}, {class:?}: {shape} by the shape, {fused} with the image"
            );
        }
    }
}

#[test]
fn without_lidar_a_closing_vehicle_is_where_it_was_at_the_exposure() {
    if !has_backend() {
        return;
    }
    let (rate_steps, latency_steps) = (5, 5);
    let gap_m = |step: usize| 34.0 - 14.0 * CONTROL_STEP.s() * step as f64;
    let others = |time_s: f64| vec![behind(VehicleClass::Truck, time_s, [34.0 - 14.0 * time_s, 0.0], 14.0)];
    // Nearer than 20 m, the lowest cell of a truck's mask is coarser than the tolerance.
    let seen = run(SENSORS, "dead = true", 33, others);
    let mut images = 0;
    for step in (latency_steps..seen.len()).step_by(rate_steps) {
        let [alone] = &seen[step][..] else { panic!("step {step}: {:?}", seen[step]) };
        let exposed = step - latency_steps;
        assert_eq!(alone.time, CONTROL_STEP * exposed as i64);
        // The ego has driven on by 6 m since then. An image of the arrival would show the vehicle
        // 2.8 m nearer, and its place without the ego's motion would be 6 m off.
        let expected_m = -(gap_m(exposed) + 30.0 * CONTROL_STEP.s() * latency_steps as f64);
        let off_m = alone.face_x_m - expected_m;
        assert!(off_m.abs() < 3.0, "step {step}: {off_m} m off: {alone:?}");
        images += 1;
    }
    assert_eq!(images, 6);
}

fn truck_score(detections: &[Detection]) -> f64 {
    detections.iter().map(|seen| seen.class.0[VehicleClass::Truck as usize]).fold(0.0, f64::max)
}

#[test]
fn the_result_arrives_with_its_latency_and_applies_to_the_objects_in_its_image() {
    if !has_backend() {
        return;
    }
    let off = "mode = 'full'\nrear-camera = { pipeline = 'off' }\n";
    let (without, _) = follow(perception(off, Faults::default()));
    let (with, health) = follow(perception(SENSORS, Faults::default()));
    assert_eq!(health, Health::Ok);
    for step in 0..5 {
        assert_eq!(with[step], without[step], "step {step}: no image has arrived");
    }
    assert!(truck_score(&with[5]) > 0.9 && truck_score(&with[5]) > truck_score(&without[5]), "{:?}", with[5]);
    // Until the next image, the evidence remains.
    assert!((5..38).all(|step| truck_score(&with[step]) > 0.9));
}

#[test]
fn a_dead_or_frozen_camera_is_noticed_and_a_dead_one_says_nothing() {
    if !has_backend() {
        return;
    }
    let off = "mode = 'full'\nrear-camera = { pipeline = 'off' }\n";
    let (without, _) = follow(perception(off, Faults::default()));
    let (dead, health) = follow(perception(SENSORS, faults("dead = true", "")));
    assert_eq!((health, dead == without), (Health::Failed, true));
    assert_eq!(follow(perception(SENSORS, faults("frozen = true", ""))).1, Health::Failed);
}

#[test]
fn dirt_before_the_lens_hides_the_vehicle() {
    if !has_backend() {
        return;
    }
    let off = "mode = 'full'\nrear-camera = { pipeline = 'off' }\n";
    let [off, clean] = [off, SENSORS].map(|sensors| truck_score(&follow(perception(sensors, Faults::default())).0[30]));
    let (dirty, health) = follow(perception(SENSORS, faults("dirt = 1.0", "")));
    let dirty = truck_score(&dirty[30]);
    assert_eq!(health, Health::Ok, "no monitor notices dirt");
    // The image speaks against the vehicle, and for it when it is clean; the shape alone stands
    // between both.
    assert!(dirty < off && off < clean, "{dirty}, {off}, {clean}");
}

#[test]
fn without_lidar_the_camera_sees_the_vehicle_alone_and_five_times_per_second() {
    if !has_backend() {
        return;
    }
    let (seen, health) = follow(perception(SENSORS, faults("", "dead = true")));
    assert_eq!(health, Health::Failed);
    let steps: Vec<usize> = (0..seen.len()).filter(|step| !seen[*step].is_empty()).collect();
    assert_eq!(steps, [5, 10, 15, 20, 25, 30, 35]);
    for step in steps {
        let [alone] = &seen[step][..] else { panic!("{:?}", seen[step]) };
        // The ego has moved on by 6 m since the exposure, and the spot on the road has not.
        assert!((alone.face_x_m + 36.0).abs() < 3.0, "{alone:?}");
        assert!(alone.face_y_m.abs() < 1.0 && alone.class.0[VehicleClass::Truck as usize] > 0.5, "{alone:?}");
    }
}
