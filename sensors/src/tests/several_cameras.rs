//! Several rear cameras, each with a mounting and a network of its own.

use closecall_traffic::{ActorId, CONTROL_STEP, Check, ClassScores, Environment, Parameters, Road, Time, VehicleClass};

use crate::camera::{Camera, RearCamera, best_camera};
use crate::detection_classifier::DetectionClassifier;
use crate::faults::{CameraFaultConfig, FaultEntries, FaultList, Faults};
use crate::several_cameras::{CameraMember, SeveralCameras};
use crate::testing::{OWN_LANE_M, scene_vehicle, with_speed};
use crate::{
    Alterations, Detection, Extent, Health, NoiseKey, Scene, SceneVehicle, SeenBy, SeenPart, SensorError, SensorsConfig,
};

const EGO_S_M: f64 = 1_000.0;
const LEFT_LANE_M: f64 = -1.875;
const OFF: &str = "rear-camera.pipeline = \"off\"";
/// A camera that looks to the right, and another that looks to the left.
const SIDES: &str =
    "rear-camera.yaw-deg = -40\nadditional-rear-cameras = [{ name = \"left\", yaw-deg = 40, left-m = 0.7 }]";
const TWINS: &str = "additional-rear-cameras = [{ name = \"twin\" }]";

/// Returns a car whose front is `gap_m` behind the ego's rear.
fn behind(gap_m: f64, d_m: f64) -> SceneVehicle {
    let car = scene_vehicle(1, VehicleClass::Car, 0.0, d_m);
    let s_m = EGO_S_M - gap_m - car.vehicle.dimensions.length_m;
    with_speed(scene_vehicle(1, VehicleClass::Car, s_m, d_m), 30.0)
}

/// Returns the detection of a car whose front is at this place behind the ego's middle.
fn detection(back_m: f64, left_m: f64) -> Detection {
    Detection {
        time: Time::ZERO,
        face_x_m: -back_m,
        face_y_m: left_m,
        range_sd_m: 0.1,
        lateral_sd_m: 0.1,
        heading_rad: 0.0,
        length_m: 4.5,
        length: Extent::Assumed,
        width_m: 1.8,
        width: Extent::Seen,
        top_m: 1.5,
        seen_by: SeenBy::Lidar,
        points: 50,
        is_centred: false,
        seen: SeenPart::FACE,
        class: ClassScores::UNKNOWN,
    }
}

fn config(sensors: &str) -> SensorsConfig {
    toml::from_str(&format!("mode = \"full\"\nrear-lidar.false-alarm-rate = 0.0\n{sensors}")).unwrap()
}

fn cameras(text: &str) -> Vec<RearCamera> {
    let sensors = config(text).check(&Parameters::default()).unwrap();
    sensors.rear_cameras().map(|camera: &Camera| RearCamera::new(*camera)).collect()
}

fn faults(text: &str) -> Faults {
    let camera: Vec<CameraFaultConfig> =
        (!text.is_empty()).then(|| toml::from_str(text).unwrap()).into_iter().collect();
    FaultEntries { rear_camera: &camera, ..FaultEntries::default() }.check(&Parameters::default()).unwrap()
}

/// The results of a drive of 1.6 s behind which a car drives.
struct Drive {
    /// The class scores of the car's box in each step.
    classes: Vec<ClassScores>,
    health: Health,
    /// The cameras that do not classify at the end.
    failed: Vec<&'static str>,
    faults: Vec<String>,
}

fn drive(sensors: &str, fault: &str, (gap_m, d_m): (f64, f64)) -> Drive {
    let altered = Alterations { faults: faults(fault), ..Alterations::default() };
    let sensors = config(sensors).check(&Parameters::default()).unwrap().altered(altered);
    let key = NoiseKey { seed: 4, sample: 1, ego: ActorId::new("ego").unwrap(), actors: [].into() };
    let mut perception = sensors.build(&key).unwrap();
    let (road, environment) = (Road::straight(3), Environment::CLEAR_DAY);
    let mut ego = with_speed(scene_vehicle(0, VehicleClass::Car, EGO_S_M, OWN_LANE_M), 30.0);
    let mut others = [behind(gap_m, d_m)];
    let mut classes = Vec::new();
    for step in 0..40 {
        let scene = Scene { time: CONTROL_STEP * step, road: &road, environment: &environment, ego, others: &others };
        perception.step(&scene).unwrap();
        let lidar = perception.rear_lidar().unwrap();
        let is_car = |seen: &&Detection| (seen.face_y_m - (d_m - OWN_LANE_M)).abs() < 1.0 && seen.top_m > 0.3;
        classes.extend(lidar.detections.iter().find(is_car).map(|seen| seen.class));
        for vehicle in others.iter_mut().chain([&mut ego]) {
            vehicle.state.s_m += CONTROL_STEP.s() * vehicle.state.speed_mps;
        }
    }
    let faults = sensors.stated_faults().iter().map(ToString::to_string).collect();
    Drive { classes, health: perception.health().rear, failed: perception.failed_cameras().to_vec(), faults }
}

fn classes(sensors: &str, fault: &str, place: (f64, f64)) -> Vec<ClassScores> {
    let classes = drive(sensors, fault, place).classes;
    assert!(classes.len() > 30, "{} boxes", classes.len());
    classes
}

fn is_car(classes: &[ClassScores]) -> bool {
    let sum: f64 = classes.iter().map(|class| class.0[VehicleClass::Car as usize]).sum();
    sum > 0.9 * classes.len() as f64
}

#[test]
fn a_vehicle_that_only_the_second_camera_sees_is_classified() {
    let place = (9.0, LEFT_LANE_M);
    let shape = classes(OFF, "", place);
    assert_eq!(classes("rear-camera.yaw-deg = -40", "", place), shape, "the first camera looks past it");
    let seen = classes(SIDES, "", place);
    assert!(seen != shape && is_car(&seen), "{:?}", seen.last());
    let only_second = format!("{OFF}\nadditional-rear-cameras = [{{ name = \"left\", yaw-deg = 40, left-m = 0.7 }}]");
    assert_eq!(classes(&only_second, "", place), seen, "the first camera may be off");
}

#[test]
fn a_vehicle_that_two_cameras_see_is_classified_once() {
    let place = (40.0, OWN_LANE_M);
    let alone = classes("", "", place);
    assert!(is_car(&alone));
    assert_eq!(classes(TWINS, "", place), alone, "the first of two equal cameras");
    // The second sees it better, so that the first does not look.
    let tele = "additional-rear-cameras = [{ name = \"tele\", field-of-view-deg = 20 }]";
    let only_tele = format!("{OFF}\n{tele}");
    let by_tele = classes(tele, "", place);
    assert!(by_tele != alone && by_tele == classes(&only_tele, "", place));
}

#[test]
fn a_dead_camera_leaves_its_vehicles_to_the_other() {
    let place = (40.0, OWN_LANE_M);
    let (shape, dead) = (classes(OFF, "", place), "dead = true");
    let first = format!("{dead}\nsensor = \"rear-camera\"");
    assert_eq!(classes(TWINS, dead, place), shape, "without a name, each camera has the fault");
    let by_twin = classes(TWINS, &first, place);
    assert!(by_twin != shape && is_car(&by_twin));
    let second = format!("{dead}\nsensor = \"twin\"");
    assert_eq!(classes(TWINS, &second, place), classes("", "", place));
    let without_twin = drive(TWINS, &second, place);
    assert_eq!(without_twin.faults, ["rear camera `twin` dead"]);
    assert_eq!(without_twin.failed, ["twin"], "a recording shows no window in its image");
    assert!(drive(TWINS, "", place).failed.is_empty());
    // The health of a camera whose places another sees, and of one whose places none sees.
    let health = |sensors: &str, fault: &str| drive(sensors, fault, place).health;
    assert_eq!(
        [health(TWINS, ""), health(TWINS, &first), health(TWINS, dead)],
        [Health::Ok, Health::Degraded, Health::Failed]
    );
    assert_eq!(health(SIDES, &first), Health::Failed);
}

#[test]
fn the_camera_that_shows_a_vehicle_whole_sees_it_best_and_else_the_one_with_more_pixels() {
    let best = |text: &str, [back_m, left_m]: [f64; 2]| {
        let ego = scene_vehicle(0, VehicleClass::Car, EGO_S_M, OWN_LANE_M);
        let seen = detection(back_m, left_m);
        best_camera(cameras(text).iter().enumerate(), &ego, &seen)
    };
    let tele = "additional-rear-cameras = [{ name = \"tele\", field-of-view-deg = 20 }]";
    assert_eq!(best(tele, [80.0, 0.0]), Some(1), "more pixels");
    assert_eq!(best(tele, [20.0, 3.0]), Some(0), "whole: the narrow image ends 10° from its axis");
    assert_eq!(best(TWINS, [40.0, 0.0]), Some(0), "the first of equal ones");
    assert_eq!([best(SIDES, [9.0, 3.75]), best(SIDES, [9.0, -3.75])], [Some(1), Some(0)]);
    assert_eq!(best(SIDES, [40.0, 0.0]), None);
    assert_eq!(best(tele, [-10.0, 0.0]), None);
    let fine = "additional-rear-cameras = [{ name = \"fine\", resolution = { width-px = 2560, height-px = 1600 } }]";
    assert_eq!(best(fine, [40.0, 0.0]), Some(1));
}

/// A camera that finds these vehicles, to which no cluster belongs.
struct Finds(Vec<Detection>, Health);

impl DetectionClassifier for Finds {
    fn classify(&mut self, _: &Scene<'_>, _: &mut [Detection]) -> Result<(), SensorError> {
        Ok(())
    }

    fn seen_alone(&self) -> &[Detection] {
        &self.0
    }

    fn health(&self) -> Health {
        self.1
    }
}

#[test]
fn a_vehicle_that_only_one_of_two_cameras_finds_without_a_cluster_is_kept() {
    let tele = "additional-rear-cameras = [{ name = \"tele\", field-of-view-deg = 20 }]";
    let found_with = |sensors: &str, healths: [Health; 2], finds: [&[[f64; 2]]; 2]| {
        let of = |((camera, finds), health): ((RearCamera, &[[f64; 2]]), Health)| {
            let finds = finds.iter().map(|[back_m, left_m]| detection(*back_m, *left_m)).collect();
            CameraMember { camera, faults: FaultList::default(), classifier: Box::new(Finds(finds, health)) }
        };
        let mut several = SeveralCameras::new(cameras(sensors).into_iter().zip(finds).zip(healths).map(of).collect());
        let (road, environment) = (Road::straight(3), Environment::CLEAR_DAY);
        let ego = scene_vehicle(0, VehicleClass::Car, EGO_S_M, OWN_LANE_M);
        let scene = Scene { time: Time::ZERO, road: &road, environment: &environment, ego, others: &[] };
        several.classify(&scene, &mut []).unwrap();
        several.seen_alone().iter().map(|seen| [-seen.face_x_m, seen.face_y_m]).collect::<Vec<_>>()
    };
    let found = |finds: [&[[f64; 2]]; 2]| found_with(tele, [Health::Ok; 2], finds);
    assert_eq!(found([&[[50.0, 0.0]], &[]]), [[50.0, 0.0]], "the second camera sees it better, and misses it");
    assert_eq!(found([&[], &[[50.0, 0.0]]]), [[50.0, 0.0]]);
    assert_eq!(found([&[[50.0, 0.1]], &[[55.0, 0.0]]]), [[55.0, 0.0]], "both find it, the second sees it better");
    assert_eq!(found([&[[20.0, 3.0]], &[[21.0, 3.0]]]), [[20.0, 3.0]], "the first shows it whole");
    assert_eq!(found([&[[40.0, 3.75]], &[[40.0, 0.0]]]), [[40.0, 3.75], [40.0, 0.0]], "two vehicles");
    let beside = [[8.0, -3.9]];
    assert_eq!(found_with(TWINS, [Health::Ok; 2], [&beside, &beside]), beside, "cut off by the edge of the image");
    assert!(found_with(tele, [Health::Failed, Health::Ok], [&[[50.0, 0.0]], &[]]).is_empty(), "a failed camera");
}
