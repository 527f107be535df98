//! Measures the time of one control step of perception, in a scene with three other vehicles.

use std::hint::black_box;

use closecall_sensors::{NoiseKey, Scene, SceneVehicle, SensorMode, SensorsConfig};
use closecall_traffic::{
    ActorId, CONTROL_STEP, Check, Environment, Parameters, Road, Vehicle, VehicleClass, VehicleState,
};
use criterion::{Criterion, criterion_group, criterion_main};

fn vehicle(actor: usize, s_m: f64, d_m: f64) -> SceneVehicle {
    let state = VehicleState { s_m, d_m, speed_mps: 30.0, ..VehicleState::default() };
    SceneVehicle { actor, vehicle: Vehicle::typical(VehicleClass::Car), state, pitch_rad: 0.0 }
}

fn perception(criterion: &mut Criterion) {
    let road = Road::straight(3);
    let others = [vehicle(1, 1_025.0, -5.6), vehicle(2, 970.0, -5.6), vehicle(3, 1_005.0, -1.9)];
    let sensors = SensorsConfig::default().check(&Parameters::default()).expect("the defaults are valid");
    let key = NoiseKey { seed: 0, sample: 0, ego: ActorId::new("ego").expect("a legal name"), actors: [].into() };
    let modes = [
        ("ground truth", SensorMode::GroundTruth),
        ("object level", SensorMode::Object),
        ("full, follower at 30 m", SensorMode::Full),
    ];
    for (name, mode) in modes {
        let mut perception = sensors.with_mode(mode).build(&key).expect("no model to load");
        let mut scans = 0;
        criterion.bench_function(&format!("perception step, three vehicles, {name}"), |bench| {
            bench.iter(|| {
                scans += 1;
                let scene = Scene {
                    time: CONTROL_STEP * scans,
                    road: &road,
                    environment: &Environment::CLEAR_DAY,
                    ego: vehicle(0, 1_000.0, -5.6),
                    others: &others,
                };
                black_box(perception.step(black_box(&scene)).expect("finite").len())
            });
        });
    }
}

criterion_group!(benches, perception);
criterion_main!(benches);
