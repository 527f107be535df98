//! Measures the time that the camera needs for one track: preparing an exposure, rendering a crop,
//! and classifying it.
//!
//! Command: `cargo bench -p closecall-xtask --bench camera`. The classifier runs on ONNX Runtime
//! instead of tract if `ORT_DYLIB_PATH` gives the path of its library.

use std::hint::black_box;

use closecall_sensors::camera::{
    Backend, CameraConfig, Classifier, Crop, ExposureKey, Frame, GroundBox, HEIGHT_PX, RearCamera, Resolution, WIDTH_PX,
};
use closecall_sensors::{Scene, SceneVehicle};
use closecall_traffic::{Check, Environment, Light, Parameters, Road, Time, Vehicle, VehicleClass, VehicleState};
use divan::Bencher;

const CONDITIONS: [&str; 3] = ["day", "rain", "night"];

fn environment(condition: &str) -> Environment {
    match condition {
        "rain" => Environment { rain_mm_per_h: 5.0, water_film_mm: 0.5, ..Environment::CLEAR_DAY },
        "night" => Environment { light: Light::Night, ..Environment::CLEAR_DAY },
        _ => Environment::CLEAR_DAY,
    }
}

/// Returns a rear vehicle in the ego's lane, and one vehicle in each neighbouring lane.
fn vehicles() -> [SceneVehicle; 3] {
    [(VehicleClass::Car, 465.0, -5.6), (VehicleClass::Truck, 430.0, -9.4), (VehicleClass::Motorcycle, 475.0, -1.9)].map(
        |(class, s_m, d_m)| SceneVehicle {
            actor: 1,
            vehicle: Vehicle::typical(class),
            state: VehicleState { s_m, d_m, speed_mps: 32.0, ..VehicleState::default() },
            pitch_rad: 0.0,
        },
    )
}

fn main() {
    divan::main();
}

/// What a camera on the ego sees under a condition of light and weather.
struct View {
    camera: RearCamera,
    road: Road,
    environment: Environment,
    others: [SceneVehicle; 3],
}

impl View {
    fn new(condition: &str) -> Self {
        let camera = CameraConfig::default().check(&Parameters::default()).expect("defaults are valid");
        Self {
            camera: RearCamera::new(camera),
            road: Road::straight(3),
            environment: environment(condition),
            others: vehicles(),
        }
    }

    fn scene(&self) -> Scene<'_> {
        let [vehicle, ..] = self.others;
        let ego = SceneVehicle { state: VehicleState { s_m: 500.0, ..vehicle.state }, ..vehicle };
        Scene { time: Time::ZERO, road: &self.road, environment: &self.environment, ego, others: &self.others }
    }
}

/// The rear vehicle, as a track has it.
const TRACK: GroundBox =
    GroundBox { x_m: -35.0, y_m: 0.0, heading_rad: 0.0, length_m: 4.6, width_m: 1.85, height_m: 1.5 };

#[divan::bench(args = CONDITIONS)]
fn prepare_exposure(bencher: Bencher<'_, '_>, condition: &str) {
    let view = View::new(condition);
    let scene = view.scene();
    let window = view.camera.project(&scene.ego, &TRACK).expect("in view");
    bencher.bench_local(|| Frame::new(view.camera.camera(), &scene, ExposureKey(1), &[black_box(window)]));
}

#[divan::bench(args = CONDITIONS)]
fn crop(bencher: Bencher<'_, '_>, condition: &str) {
    let view = View::new(condition);
    let scene = view.scene();
    let window = view.camera.project(&scene.ego, &TRACK).expect("in view");
    let mut frame = Frame::new(view.camera.camera(), &scene, ExposureKey(1), &[window]);
    let mut crop = Crop::default();
    bencher.bench_local(|| frame.crop(black_box(window), &mut crop));
}

/// As many pixels as the Mask R-CNN reads, but evenly spread over the image.
#[divan::bench(args = CONDITIONS)]
fn picture_of_320_x_144_px(bencher: Bencher<'_, '_>, condition: &str) {
    let view = View::new(condition);
    let scene = view.scene();
    let [columns, rows] = [(320, WIDTH_PX), (144, HEIGHT_PX)]
        .map(|(count, extent)| (0..count).map(|place| place * i32::from(extent) / count).collect::<Vec<i32>>());
    let mut frame = Frame::new(view.camera.camera(), &scene, ExposureKey(1), &[Resolution::USUAL.image()]);
    bencher.bench_local(|| frame.sampled(black_box(&columns), black_box(&rows)));
}

#[divan::bench]
fn classify(bencher: Bencher<'_, '_>) {
    let backend = Backend::choose(None, std::env::var_os("ORT_DYLIB_PATH").map(Into::into));
    let mut classifier = Classifier::shipped(&backend).expect("the shipped model loads");
    let crop = Crop::default();
    bencher.bench_local(|| classifier.classify(black_box(&crop)).expect("runs"));
}
