//! Measures the time of one LiDAR scan and of its processing, and the share of each part in a
//! perception step without the camera. A rear vehicle is 3, 30 or 100 m behind the ego, and two
//! more vehicles are in view.
//!
//! Command: `cargo bench -p closecall-xtask --bench lidar`.
#![expect(clippy::print_stdout, reason = "a benchmark prints its figures")]

use std::hint::black_box;
use std::time::Instant;

use closecall_sensors::lidar::{Detector, LaneGeometry, Lidar, Scanner};
use closecall_sensors::tracking::{RearView, TrackList, Tracker, TrackerScan};
use closecall_sensors::{Detection, FullPerception, NoiseKey, Perception, Scene, SceneVehicle, Sensors, SensorsConfig};
use closecall_traffic::{
    ActorId, CONTROL_STEP, Check, Environment, Parameters, Road, Stream, Time, Vehicle, VehicleClass, VehicleState,
    stream,
};
use criterion::{Criterion, criterion_group, criterion_main};

/// Position of the ego along the road (m).
const EGO_S_M: f64 = 1_000.0;
/// Lateral position of the ego (m), in the middle one of three lanes.
const EGO_D_M: f64 = -5.625;
/// Position of the ego's rear bumper along the road (m).
const REAR_S_M: f64 = EGO_S_M - 2.3;
/// Speed of all vehicles (m/s).
const SPEED_MPS: f64 = 30.0;
/// Gaps between the ego and the rear vehicle (m).
const GAPS_M: [f64; 3] = [3.0, 30.0, 100.0];
/// Number of steps over which the shares are measured.
const STEPS: u32 = 2_000;

fn vehicle(actor: usize, class: VehicleClass, s_m: f64, d_m: f64) -> SceneVehicle {
    let state = VehicleState { s_m, d_m, speed_mps: SPEED_MPS, ..VehicleState::default() };
    SceneVehicle { actor, vehicle: Vehicle::typical(class), state, pitch_rad: 0.0 }
}

/// Returns the rear vehicle in the ego's lane, a truck in the right lane 40 m behind the ego, and a
/// car in the left lane 60 m behind it.
fn others(gap_m: f64) -> [SceneVehicle; 3] {
    [
        vehicle(1, VehicleClass::Car, REAR_S_M - gap_m - 2.3, EGO_D_M),
        vehicle(2, VehicleClass::Truck, REAR_S_M - 40.0 - 8.25, EGO_D_M - 3.75),
        vehicle(3, VehicleClass::Car, REAR_S_M - 60.0 - 2.3, EGO_D_M + 3.75),
    ]
}

/// Returns a scene with the ego and these other vehicles on a clear day.
fn scene<'a>(road: &'a Road, others: &'a [SceneVehicle]) -> Scene<'a> {
    let ego = vehicle(0, VehicleClass::Car, EGO_S_M, EGO_D_M);
    Scene { time: Time::ZERO, road, environment: &Environment::CLEAR_DAY, ego, others }
}

fn random() -> Stream {
    stream(0, 0, &ActorId::new("ego").expect("a legal name"), "lidar")
}

fn sensors() -> Sensors {
    SensorsConfig::default().check(&Parameters::default()).expect("the defaults are valid")
}

/// Creates the full perception chain without the camera.
fn full() -> FullPerception {
    let key = NoiseKey { seed: 0, sample: 0, ego: ActorId::new("ego").expect("a legal name"), actors: [].into() };
    FullPerception::new(&sensors().full_model(), &key)
}

/// The rear LiDAR's tracker, which receives the same detections in each scan while the ego drives
/// on.
struct TrackerLoop {
    tracker: Tracker,
    list: TrackList,
    view: RearView,
    road: Road,
    time: Time,
}

impl TrackerLoop {
    fn new(road: Road) -> Self {
        let tracker = Tracker::new(sensors().full_model().tracker);
        let field = full().rear_fields().pop().expect("a rear sensor has one");
        let view = RearView {
            half_angle_tan: field.half_angle_tan,
            range_m: field.range_m,
            sensor_x_m: REAR_S_M - EGO_S_M,
            ..RearView::default()
        };
        Self { tracker, list: TrackList::default(), view, road, time: Time::ZERO }
    }

    fn step(&mut self, detections: &[Detection]) {
        self.time += CONTROL_STEP;
        let s_m = EGO_S_M + SPEED_MPS * self.time.s();
        let ego = VehicleState { s_m, d_m: EGO_D_M, speed_mps: SPEED_MPS, ..VehicleState::default() };
        let scan = TrackerScan {
            sensor: 0,
            time: self.time,
            road: &self.road,
            ego,
            view: self.view,
            rear_x_m: REAR_S_M - EGO_S_M,
            detections,
        };
        self.tracker.update(&scan, &mut self.list);
    }
}

fn scan_and_detect(criterion: &mut Criterion) {
    let road = Road::straight(3);
    for gap_m in GAPS_M {
        let others = others(gap_m);
        let scene = self::scene(&road, &others);
        let lane = LaneGeometry::from_scene(&scene);
        let (mut scanner, mut detector, mut rng) = (Scanner::new(Lidar::default()), Detector::default(), random());
        let mut group = criterion.benchmark_group(format!("rear vehicle at {gap_m} m"));
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
        let detections = detector.detect(&scan, &lane).expect("finite points").to_vec();
        let mut tracker_loop = TrackerLoop::new(road);
        group.bench_function("tracking", |bencher| bencher.iter(|| tracker_loop.step(black_box(&detections))));
        group.finish();
    }
}

/// Returns the mean time of a call over [`STEPS`] calls (µs).
fn mean_us(mut part: impl FnMut()) -> f64 {
    let start = Instant::now();
    (0..STEPS).for_each(|_| part());
    start.elapsed().as_secs_f64() * 1e6 / f64::from(STEPS)
}

/// Prints the mean time of each part, and its share in a perception step without the camera. The
/// step includes the radars.
fn shares(_: &mut Criterion) {
    let road = Road::straight(3);
    println!("\n{STEPS} steps each: time [us] and share of a whole perception step");
    println!("gap      scan          clustering      boxes           tracking        whole step");
    for gap_m in GAPS_M {
        let others = others(gap_m);
        let scene = self::scene(&road, &others);
        let lane = LaneGeometry::from_scene(&scene);
        let (mut scanner, mut detector, mut rng) = (Scanner::new(Lidar::default()), Detector::default(), random());
        let scan_us = mean_us(|| _ = black_box(scanner.scan(&scene, &mut rng).len()));
        let scan = scanner.scan(&scene, &mut random()).clone();
        let cluster_us = mean_us(|| detector.cluster(black_box(&scan), &lane).expect("finite points"));
        let detect_us = mean_us(|| _ = black_box(detector.detect(&scan, &lane).expect("finite points").len()));
        let detections = detector.detect(&scan, &lane).expect("finite points").to_vec();
        let mut tracker_loop = TrackerLoop::new(road);
        let track_us = mean_us(|| tracker_loop.step(black_box(&detections)));
        let (mut whole, mut time, mut ego, mut others) = (full(), Time::ZERO, scene.ego, others);
        let whole_us = mean_us(|| {
            time += CONTROL_STEP;
            others.iter_mut().chain([&mut ego]).for_each(|vehicle| vehicle.state.s_m += SPEED_MPS * CONTROL_STEP.s());
            let scene = Scene { time, ego, ..self::scene(&road, &others) };
            black_box(whole.step(&scene).expect("finite").len());
        });
        let share = |part_us: f64| format!("{part_us:>6.1} ({:>2.0} %)", 100.0 * part_us / whole_us);
        let parts = [scan_us, cluster_us, detect_us - cluster_us, track_us].map(share);
        println!("{gap_m:>3} m  {}  {whole_us:>6.1}", parts.join("   "));
    }
}

criterion_group!(benches, scan_and_detect, shares);
criterion_main!(benches);
