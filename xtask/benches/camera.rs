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
use criterion::{Criterion, criterion_group, criterion_main};

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

fn crops(criterion: &mut Criterion) {
    let camera = RearCamera::new(CameraConfig::default().check(&Parameters::default()).expect("defaults are valid"));
    let (road, others) = (Road::straight(3), vehicles());
    let ego = SceneVehicle { state: VehicleState { s_m: 500.0, ..others[0].state }, ..others[0] };
    let vehicle = GroundBox { x_m: -35.0, y_m: 0.0, heading_rad: 0.0, length_m: 4.6, width_m: 1.85, height_m: 1.5 };
    let window = camera.project(&ego, &vehicle).expect("in view");
    // As many pixels as the Mask R-CNN reads, but evenly spread over the image.
    let [columns, rows] = [(320, WIDTH_PX), (144, HEIGHT_PX)]
        .map(|(count, extent)| (0..count).map(|place| place * i32::from(extent) / count).collect::<Vec<i32>>());
    let rain = Environment { rain_mm_per_h: 5.0, water_film_mm: 0.5, ..Environment::CLEAR_DAY };
    let night = Environment { light: Light::Night, ..Environment::CLEAR_DAY };
    for (name, environment) in [("day", Environment::CLEAR_DAY), ("rain", rain), ("night", night)] {
        let scene = Scene { time: Time::ZERO, road: &road, environment: &environment, ego, others: &others };
        let key = ExposureKey(1);
        let prepared = |window| Frame::new(camera.camera(), &scene, key, &[window]);
        criterion.bench_function(&format!("camera/{name}/prepare exposure"), |bencher| {
            bencher.iter(|| prepared(black_box(window)))
        });
        let (mut frame, mut crop) = (prepared(window), Crop::default());
        criterion.bench_function(&format!("camera/{name}/crop"), |bencher| {
            bencher.iter(|| frame.crop(black_box(window), &mut crop))
        });
        let mut frame = prepared(Resolution::USUAL.image());
        criterion.bench_function(&format!("camera/{name}/picture of 320 x 144 px"), |bencher| {
            bencher.iter(|| frame.sampled(black_box(&columns), black_box(&rows)))
        });
    }
}

fn classification(criterion: &mut Criterion) {
    let backend = Backend::choose(None, std::env::var_os("ORT_DYLIB_PATH").map(Into::into));
    let name = if backend == Backend::Tract { "tract" } else { "onnx-runtime" };
    let mut classifier = Classifier::shipped(&backend).expect("the shipped model loads");
    let crop = Crop::default();
    criterion.bench_function(&format!("camera/classify/{name}"), |bencher| {
        bencher.iter(|| classifier.classify(black_box(&crop)).expect("runs"));
    });
}

criterion_group!(benches, crops, classification);
criterion_main!(benches);
