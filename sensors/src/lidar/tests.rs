//! Tests of the rear LiDAR as a whole, with vehicles at known positions.

mod alongside;
mod bare_road;
mod boxes;
mod cast;
mod counts;
mod echoes;
mod motion;
mod parts;
mod surroundings;
mod table;

use super::*;
use crate::testing::{scene_vehicle, with_speed};
use crate::{Detection, Scene, SceneVehicle};
use closecall_traffic::{ActorId, CONTROL_STEP, Environment, Road, Stream, Time, VehicleClass, VehicleState, stream};

/// Lateral position of the ego (m), in the middle one of three lanes.
const LANE_D_M: f64 = -5.625;
/// Speed of the ego and of the other vehicles (m/s).
const SPEED_MPS: f64 = 30.0;
/// Distance of the rear bumper from the ego's origin (m).
const REAR_BUMPER_M: f64 = 2.3;

/// A scene for the tests, with the ego and other vehicles on a straight road by default.
#[derive(Debug)]
struct TestScene {
    time: Time,
    road: Road,
    environment: Environment,
    ego: SceneVehicle,
    others: Vec<SceneVehicle>,
}

impl TestScene {
    fn new() -> Self {
        let ego = with_speed(scene_vehicle(0, VehicleClass::Car, 1_000.0, LANE_D_M), SPEED_MPS);
        Self { time: Time::ZERO, road: Road::straight(3), environment: Environment::CLEAR_DAY, ego, others: Vec::new() }
    }

    /// Adds a vehicle whose front is `gap_m` behind the ego's rear and `left_m` to its left, at the
    /// ego's speed.
    fn with(mut self, class: VehicleClass, gap_m: f64, left_m: f64) -> Self {
        let half = 0.5 * class.typical_dimensions().length_m;
        let s_m = self.ego.state.s_m - REAR_BUMPER_M - gap_m - half;
        let vehicle = scene_vehicle(self.others.len() + 1, class, s_m, LANE_D_M + left_m);
        self.others.push(with_speed(vehicle, SPEED_MPS));
        self
    }

    fn scene(&self) -> Scene<'_> {
        Scene { time: self.time, road: &self.road, environment: &self.environment, ego: self.ego, others: &self.others }
    }

    /// Scans once and returns the detections. `scan_index` determines the side of the mirror and
    /// the noise.
    fn detect(&mut self, lidar: &mut RearLidar, scan_index: i64) -> Vec<Detection> {
        self.time = CONTROL_STEP * scan_index;
        lidar.scan(&self.scene(), &mut random(scan_index.unsigned_abs()));
        lidar.detect().unwrap().to_vec()
    }

    /// Returns the mean number of points on the first of the other vehicles over 20 scans.
    fn mean_points(&mut self) -> f64 {
        let mut lidar = RearLidar::new(Lidar::default());
        let mut points = 0;
        for scan_index in 0..20 {
            self.detect(&mut lidar, scan_index);
            points += count(lidar.truth(), PointSource::Actor(1));
        }
        points as f64 / 20.0
    }
}

fn random(sample: u64) -> Stream {
    stream(0, sample, &ActorId::new("ego").unwrap(), "lidar")
}

fn count(truth: &ScanTruth, source: PointSource) -> usize {
    truth.points.iter().filter(|point| point.source == source).count()
}

fn road_with_guard_rails(curvature_per_m: f64) -> Road {
    let text = format!("lanes = 3\nguard-rails = true\ncurvature-per-m = {curvature_per_m:.6}");
    let config: closecall_traffic::RoadConfig = toml::from_str(&text).unwrap();
    closecall_traffic::Check::check(&config, &closecall_traffic::Parameters::default()).unwrap()
}

/// Returns the detection of the first of the other vehicles, and the longitudinal and lateral error
/// of its front face (m).
fn first_vehicle_error(setup: &TestScene, detections: &[Detection]) -> Option<(Detection, f64, f64)> {
    let state: &VehicleState = &setup.others[0].state;
    let half = 0.5 * setup.others[0].vehicle.dimensions.length_m;
    let near = |detection: &&Detection| {
        let since_s = (setup.time - detection.time).s();
        let x = state.s_m + half - SPEED_MPS * since_s - setup.ego.state.s_m;
        (detection.face_x_m - x).abs() < 2.5 && (detection.face_y_m - (state.d_m - LANE_D_M)).abs() < 1.5
    };
    let detection = detections.iter().find(near)?;
    let since_s = (setup.time - detection.time).s();
    let x = state.s_m + half - SPEED_MPS * since_s - setup.ego.state.s_m;
    Some((detection.clone(), detection.face_x_m - x, detection.face_y_m - (state.d_m - LANE_D_M)))
}
