//! Time of one scan and of its processing, with R at 3, 30 and 100 m behind E and two more vehicles in view.

use std::hint::black_box;

use closecall_sensors::lidar::{Detector, LaneGeometry, Lidar, Scanner};
use closecall_sensors::{Scene, SceneVehicle};
use closecall_traffic::{ActorId, Environment, Road, Stream, Time, Vehicle, VehicleClass, VehicleState, stream};
use criterion::{Criterion, criterion_group, criterion_main};

/// E drives in the middle lane.
const EGO_S_M: f64 = 1_000.0;
const EGO_D_M: f64 = -5.625;
const SPEED_MPS: f64 = 30.0;

fn vehicle(actor: usize, class: VehicleClass, s_m: f64, d_m: f64) -> SceneVehicle {
    let state = VehicleState { s_m, d_m, speed_mps: SPEED_MPS, ..VehicleState::default() };
    SceneVehicle { actor, vehicle: Vehicle::typical(class), state, pitch_rad: 0.0 }
}

/// R in E's lane, a truck to the right 40 m behind E, a car to the left 60 m behind E.
fn others(gap_m: f64) -> [SceneVehicle; 3] {
    let rear_s_m = EGO_S_M - 2.3;
    [
        vehicle(1, VehicleClass::Car, rear_s_m - gap_m - 2.3, EGO_D_M),
        vehicle(2, VehicleClass::Truck, rear_s_m - 40.0 - 8.25, EGO_D_M - 3.75),
        vehicle(3, VehicleClass::Car, rear_s_m - 60.0 - 2.3, EGO_D_M + 3.75),
    ]
}

fn random() -> Stream {
    stream(0, 0, &ActorId::new("ego").expect("a legal name"), "lidar")
}

fn scan_and_detect(criterion: &mut Criterion) {
    let road = Road::straight(3);
    let environment = Environment::CLEAR_DAY;
    for gap_m in [3.0, 30.0, 100.0] {
        let others = others(gap_m);
        let ego = vehicle(0, VehicleClass::Car, EGO_S_M, EGO_D_M);
        let scene = Scene { time: Time::ZERO, road: &road, environment: &environment, ego, others: &others };
        let lane = LaneGeometry::of(&scene);
        let (mut scanner, mut detector, mut rng) = (Scanner::new(Lidar::default()), Detector::default(), random());
        let mut group = criterion.benchmark_group(format!("R at {gap_m} m"));
        group.bench_function("scan", |bencher| {
            bencher.iter(|| black_box(scanner.scan(black_box(&scene), &mut rng).len()));
        });
        let scan = scanner.scan(&scene, &mut random()).clone();
        group.bench_function("clustering", |bencher| {
            bencher.iter(|| detector.cluster(black_box(&scan), &lane).expect("finite points"));
        });
        group.bench_function("clustering and boxes", |bencher| {
            bencher.iter(|| black_box(detector.detect(black_box(&scan), &lane).expect("finite points").len()));
        });
        group.finish();
    }
}

criterion_group!(benches, scan_and_detect);
criterion_main!(benches);
