//! Measures the time of one LiDAR scan, of each part of its processing, and of a whole perception
//! step without the camera. A rear vehicle is 3, 30 or 100 m behind the ego, and two more vehicles
//! are in view.
//!
//! Command: `cargo bench -p closecall-xtask --bench lidar`.

use std::hint::black_box;

use closecall_sensors::lidar::{Detector, LaneGeometry, Lidar, LidarScan, Scanner};
use closecall_sensors::tracking::{RearView, TrackList, Tracker, TrackerScan};
use closecall_sensors::{Detection, FullPerception, NoiseKey, Perception, Scene, SceneVehicle, Sensors, SensorsConfig};
use closecall_traffic::{
    ActorId, CONTROL_STEP, Check, Environment, Parameters, Road, Stream, Time, Vehicle, VehicleClass, VehicleState,
    stream,
};
use divan::Bencher;

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

/// A road on a clear day, with the ego and other vehicles.
struct View {
    road: Road,
    ego: SceneVehicle,
    others: [SceneVehicle; 3],
}

impl View {
    /// Returns the view with a rear vehicle at this distance (m).
    fn new(gap_m: f64) -> Self {
        let ego = vehicle(0, VehicleClass::Car, EGO_S_M, EGO_D_M);
        Self { road: Road::straight(3), ego, others: others(gap_m) }
    }

    fn scene(&self, time: Time) -> Scene<'_> {
        let Self { road, ego, others } = self;
        Scene { time, road, environment: &Environment::CLEAR_DAY, ego: *ego, others }
    }

    /// Returns a scan, and where its lanes are.
    fn scan(&self) -> (LidarScan, LaneGeometry) {
        let scene = self.scene(Time::ZERO);
        (Scanner::new(Lidar::default()).scan(&scene, &mut random()).clone(), LaneGeometry::from_scene(&scene))
    }

    /// All vehicles drive on for a control step.
    fn drive(&mut self) {
        let vehicles = self.others.iter_mut().chain([&mut self.ego]);
        vehicles.for_each(|vehicle| vehicle.state.s_m += SPEED_MPS * CONTROL_STEP.s());
    }
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

fn main() {
    divan::main();
}

#[divan::bench(args = GAPS_M)]
fn scan(bencher: Bencher<'_, '_>, gap_m: f64) {
    let view = View::new(gap_m);
    let (scene, mut scanner, mut rng) = (view.scene(Time::ZERO), Scanner::new(Lidar::default()), random());
    bencher.bench_local(|| scanner.scan(black_box(&scene), &mut rng).len());
}

#[divan::bench(args = GAPS_M)]
fn clustering(bencher: Bencher<'_, '_>, gap_m: f64) {
    let ((scan, lane), mut detector) = (View::new(gap_m).scan(), Detector::default());
    bencher.bench_local(|| detector.cluster(black_box(&scan), &lane).expect("finite points"));
}

#[divan::bench(args = GAPS_M)]
fn clustering_and_boxes(bencher: Bencher<'_, '_>, gap_m: f64) {
    let ((scan, lane), mut detector) = (View::new(gap_m).scan(), Detector::default());
    bencher.bench_local(|| detector.detect(black_box(&scan), &lane).expect("finite points").len());
}

#[divan::bench(args = GAPS_M)]
fn tracking(bencher: Bencher<'_, '_>, gap_m: f64) {
    let view = View::new(gap_m);
    let (scan, lane) = view.scan();
    let detections = Detector::default().detect(&scan, &lane).expect("finite points").to_vec();
    let mut tracker_loop = TrackerLoop::new(view.road);
    bencher.bench_local(|| tracker_loop.step(black_box(&detections)));
}

/// The step includes the radars.
#[divan::bench(args = GAPS_M)]
fn whole_step(bencher: Bencher<'_, '_>, gap_m: f64) {
    let (mut view, mut whole, mut time) = (View::new(gap_m), full(), Time::ZERO);
    bencher.bench_local(|| {
        time += CONTROL_STEP;
        view.drive();
        whole.step(&view.scene(time)).expect("finite").len()
    });
}
