//! What each fault does to perception: the same scene with and without it.

mod camera;
mod front_lidar;
mod object;
mod object_kinds;
mod odometry;
mod refused;

use closecall_traffic::{
    ActorId, CONTROL_STEP, Check, ClassScores, Environment, Light, Parameters, Road, RoadConfig, Source, Time, Track,
    TrackStatus, VehicleClass, maths,
};
use serde::Deserialize;

use super::config::{CameraFaultConfig, FaultEntries, LidarFaultConfig};
use super::{Faults, NOTICED_AFTER_SCANS, ObjectFaultConfig, OdometryErrorConfig, RadarFaultConfig};
use crate::camera::{Backend, CropClassifier, ExposureKey, ImageMemory, ImagedScene};
use crate::lidar::PointSource;
use crate::testing::{OWN_LANE_M, scene_vehicle, with_speed};
use crate::{Alterations, Detection, Extent, Health, MountedLidar, NoiseKey, Scene, SceneVehicle, SensorsConfig};

const PERIOD_S: f64 = CONTROL_STEP.s();
const EGO_S_M: f64 = 1_000.0;
const LEFT_LANE_M: f64 = -1.875;

/// The part of a scenario's table `[fault]` that concerns sensors.
#[derive(Default, Deserialize)]
#[serde(rename_all = "kebab-case", default, deny_unknown_fields)]
struct Table {
    rear_lidar: Vec<LidarFaultConfig>,
    front_lidar: Vec<LidarFaultConfig>,
    rear_camera: Vec<CameraFaultConfig>,
    front_radar: Vec<ObjectFaultConfig>,
    surround: Vec<ObjectFaultConfig>,
    rear_object: Vec<ObjectFaultConfig>,
    rear_radar: Vec<RadarFaultConfig>,
    odometry: Option<OdometryErrorConfig>,
}

fn faults(text: &str) -> Result<Faults, String> {
    let table: Table = toml::from_str(text).map_err(|error| error.to_string())?;
    let entries = FaultEntries {
        rear_lidar: &table.rear_lidar,
        front_lidar: &table.front_lidar,
        rear_camera: &table.rear_camera,
        object: [&table.front_radar, &table.surround, &table.rear_object],
        rear_radar: &table.rear_radar,
        odometry: table.odometry.as_ref(),
    };
    entries.check(&Parameters::default()).map_err(|error| error.to_string())
}

/// What one step showed.
struct Step {
    tracks: Vec<Track>,
    health: Health,
    /// The health of the group that is worst.
    worst: Health,
    /// Position and source of each point of the rear LiDAR.
    points: Vec<([f64; 3], PointSource)>,
    widths_m: Vec<f64>,
    /// Heights of the points of the front LiDAR on vehicles (m).
    front_points_z_m: Vec<f64>,
}

impl Step {
    /// Returns the track of a vehicle behind, if it is confirmed.
    fn rear(&self) -> Option<&Track> {
        self.tracks.iter().find(|track| track.source == Source::Rear && track.status != TrackStatus::Tentative)
    }

    fn on_vehicles(&self) -> usize {
        self.points.iter().filter(|(_, source)| matches!(source, PointSource::Actor(_))).count()
    }
}

/// Returns the heights of the points on vehicles (m).
fn on_vehicles_z_m(mounted: &MountedLidar<'_>) -> Vec<f64> {
    let (scan, truth) = (mounted.lidar.latest(), mounted.lidar.truth());
    let is_on_vehicle = |index: &usize| matches!(truth.points[*index].source, PointSource::Actor(_));
    (0..scan.len()).filter(is_on_vehicle).map(|index| f64::from(scan.z_m[index])).collect()
}

/// A drive with sensors and faults.
struct Drive<'a> {
    sensors: &'a str,
    faults: &'a str,
    environment: Environment,
    has_rails: bool,
    others: Vec<SceneVehicle>,
    steps: i64,
}

impl Default for Drive<'_> {
    fn default() -> Self {
        Self {
            sensors: "mode = \"full\"\nrear-camera.pipeline = \"off\"\nrear-lidar.false-alarm-rate = 0.0",
            faults: "",
            environment: Environment::CLEAR_DAY,
            has_rails: false,
            others: vec![behind(60.0, OWN_LANE_M, 30.0)],
            steps: 100,
        }
    }
}

/// Returns a car whose front is `gap_m` behind the ego's rear.
fn behind(gap_m: f64, d_m: f64, speed_mps: f64) -> SceneVehicle {
    let car = scene_vehicle(1, VehicleClass::Car, 0.0, d_m);
    let s_m = EGO_S_M - gap_m - car.vehicle.dimensions.length_m;
    with_speed(scene_vehicle(1, VehicleClass::Car, s_m, d_m), speed_mps)
}

impl Drive<'_> {
    fn run(mut self) -> Vec<Step> {
        let config: SensorsConfig = toml::from_str(self.sensors).unwrap();
        let altered = Alterations { faults: faults(self.faults).unwrap(), ..Alterations::default() };
        let sensors = config.check(&Parameters::default()).unwrap().altered(altered);
        let names = ["ego", "rear"].map(|name| ActorId::new(name).unwrap());
        let key = NoiseKey { seed: 3, sample: 1, ego: names[0].clone(), actors: names.into() };
        let mut perception = sensors.build(&key).unwrap();
        let mut config: RoadConfig = toml::from_str("lanes = 3").unwrap();
        config.guard_rails = self.has_rails;
        let road = config.check(&Parameters::default()).unwrap();
        let mut ego = with_speed(scene_vehicle(0, VehicleClass::Car, EGO_S_M, OWN_LANE_M), 30.0);
        let mut steps = Vec::new();
        for step in 0..self.steps {
            let time = CONTROL_STEP * step;
            let scene = Scene { time, road: &road, environment: &self.environment, ego, others: &self.others };
            let tracks = perception.step(&scene).unwrap().to_vec();
            let mut points = Vec::new();
            if let Some(lidar) = perception.rear_lidar().map(|mounted| mounted.lidar) {
                let (scan, truth) = (lidar.latest(), lidar.truth());
                let at = |index: usize| [scan.x_m[index], scan.y_m[index], scan.z_m[index]].map(f64::from);
                points.extend((0..scan.len()).map(|index| (at(index), truth.points[index].source)));
            }
            let health = perception.health();
            let groups = [health.front, health.surround, health.rear];
            let worst = [Health::Failed, Health::Degraded].into_iter().find(|health| groups.contains(health));
            let worst = worst.unwrap_or_default();
            let health = if health.front == Health::Failed { health.front } else { health.rear };
            let boxes = perception.rear_lidar().map_or(&[][..], |mounted| mounted.detections);
            let widths_m = boxes.iter().map(|detection| detection.width_m).collect();
            let lidars = perception.lidars();
            let front_points_z_m =
                lidars.iter().filter(|mounted| mounted.looks_ahead).flat_map(on_vehicles_z_m).collect();
            steps.push(Step { tracks, health, worst, points, widths_m, front_points_z_m });
            for vehicle in self.others.iter_mut().chain([&mut ego]) {
                vehicle.state.s_m += PERIOD_S * vehicle.state.speed_mps;
            }
        }
        steps
    }
}

fn lidar(fault: &str) -> String {
    format!("[[rear-lidar]]\n{fault}\n")
}

fn with(fault: &str) -> Vec<Step> {
    Drive { faults: &lidar(fault), ..Drive::default() }.run()
}

fn first_confirmed(steps: &[Step]) -> Option<usize> {
    steps.iter().position(|step| step.rear().is_some())
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.collect();
    values.iter().sum::<f64>() / values.len() as f64
}

fn points_per_scan(steps: &[Step]) -> f64 {
    mean(steps.iter().map(|step| step.on_vehicles() as f64))
}

#[test]
fn a_fault_holds_from_its_start_to_its_end_and_changes_nothing_else() {
    let usual = with("dropout = 0.0");
    let faulty = with("dropout = 0.9\nfrom-s = 1.0\nuntil-s = 2.0");
    for (step, (usual, faulty)) in usual.iter().zip(&faulty).enumerate() {
        let is_faulty = (25..50).contains(&step);
        assert_eq!(usual.points == faulty.points, !is_faulty, "step {step}");
    }
}

#[test]
fn dropout_loses_the_stated_share_of_the_points() {
    let share = points_per_scan(&with("dropout = 0.6")) / points_per_scan(&with("dropout = 0.0"));
    assert!((0.33..0.47).contains(&share), "{share}");
}

#[test]
fn a_blocked_sector_hides_what_lies_in_it_only() {
    let others = vec![behind(60.0, OWN_LANE_M, 30.0), {
        let mut left = behind(40.0, LEFT_LANE_M, 30.0);
        left.actor = 2;
        left
    }];
    let fault = lidar("blocked-from-deg = -1.5\nblocked-to-deg = 1.5");
    let last = Drive { faults: &fault, others, ..Drive::default() }.run().pop().unwrap();
    assert!(last.points.iter().all(|([_, y_m, _], _)| y_m.abs() > 0.3), "nothing straight behind");
    let rear: Vec<_> = last.tracks.iter().filter(|track| track.source == Source::Rear).collect();
    assert!(rear.iter().any(|track| track.y_m() > 3.0) && rear.iter().all(|track| track.y_m() > 2.0), "{rear:?}");
}

#[test]
fn dirt_hides_a_distant_dark_car_and_costs_points() {
    let far = |fault: &str| {
        let mut car = behind(70.0, OWN_LANE_M, 30.0);
        car.vehicle.appearance.paint_reflectivity = 0.2;
        let sensors = "mode = \"full\"\nrear-camera.pipeline = \"off\"\nrear-lidar.plates = \"none\"";
        Drive { sensors, faults: &lidar(fault), others: vec![car], ..Drive::default() }.run()
    };
    let (clean, dirty) = (far("window-transmission = 1.0"), far("window-transmission = 0.15"));
    assert!(first_confirmed(&clean).is_some() && first_confirmed(&dirty).is_none());
    assert!(points_per_scan(&dirty) < 0.3 * points_per_scan(&clean));
    assert_eq!((clean[99].health, dirty[99].health), (Health::Ok, Health::Degraded));
}

#[test]
fn latency_and_jitter_confirm_later_and_keep_the_order() {
    let confirmed = |fault: &str| first_confirmed(&with(fault)).unwrap();
    let usual = confirmed("delay-s = 0.0");
    assert_eq!(confirmed("delay-s = 0.2"), usual + 5);
    let jittered = confirmed("jitter-s = 0.4");
    assert!((usual..=usual + 10).contains(&jittered), "{jittered}");
    // A delay that ends: the late scans arrive together, none is lost.
    let ending = with("delay-s = 0.4\nuntil-s = 2.0");
    let usual = with("delay-s = 0.0");
    let error_m = (ending[99].rear().unwrap().x_m() - usual[99].rear().unwrap().x_m()).abs();
    assert!(error_m < 0.05, "{error_m} m");
}

#[test]
fn a_frozen_lidar_leaves_the_track_behind_and_is_noticed_after_a_second() {
    let run = |fault: &str| {
        let others = vec![behind(80.0, OWN_LANE_M, 40.0)];
        Drive { faults: &lidar(fault), others, ..Drive::default() }.run()
    };
    let (usual, frozen) = (run("frozen = true\nfrom-s = 3.9"), run("frozen = true\nfrom-s = 2.0"));
    let noticed = frozen.iter().position(|step| step.health == Health::Failed).unwrap();
    assert_eq!(noticed as u32, 50 + NOTICED_AFTER_SCANS - 1);
    let [usual_m, frozen_m] = [&usual, &frozen].map(|steps| steps[90].rear().unwrap().x_m());
    assert!(frozen_m < usual_m - 3.0, "{frozen_m} {usual_m}");
}

#[test]
fn lost_frames_let_a_track_coast() {
    let coasting = |fault: &str| {
        let steps = with(fault);
        steps.iter().filter_map(Step::rear).filter(|track| track.status == TrackStatus::Coasting).count()
    };
    let (usual, lossy) = (coasting("lost-frames = 0.0"), coasting("lost-frames = 0.5"));
    assert!(usual < 10 && (30..70).contains(&lossy), "{usual} {lossy}");
}

#[test]
fn a_dead_lidar_loses_its_tracks_and_is_noticed_after_a_second() {
    let steps = with("dead = true\nfrom-s = 2.0");
    assert!(steps[49].rear().is_some() && steps[99].rear().is_none());
    let noticed = steps.iter().position(|step| step.health == Health::Failed).unwrap();
    assert_eq!(noticed as u32, 50 + NOTICED_AFTER_SCANS - 1);
    let back = with("dead = true\nfrom-s = 1.0\nuntil-s = 2.5");
    assert_eq!(back[99].health, Health::Ok);
    assert!(back[99].rear().is_some());
}

#[test]
fn a_wrong_mounting_moves_points_and_tracks_by_its_angle_and_height() {
    let lateral_m = |fault: &str| with(fault).iter().filter_map(Step::rear).map(Track::y_m).next_back().unwrap();
    // The sensor is turned to the left, so that it looks to the right, and a vehicle straight
    // behind appears to its left of centre: at 60 m by 60 · tan 0.5°.
    let shift_m = lateral_m("yaw-deg = 0.5") - lateral_m("yaw-deg = 0.0");
    assert!((shift_m - 60.0 * maths::tan(0.5_f64.to_radians())).abs() < 0.08, "{shift_m}");
    let shift_m = lateral_m("yaw-deg = -0.5") - lateral_m("yaw-deg = 0.0");
    assert!((shift_m + 60.0 * maths::tan(0.5_f64.to_radians())).abs() < 0.08, "{shift_m}");
    let height_m = |fault: &str| {
        let steps = with(fault);
        let points = steps.iter().flat_map(|step| &step.points);
        mean(points.filter(|(_, source)| *source == PointSource::Actor(1)).map(|([_, _, z_m], _)| *z_m))
    };
    assert!(height_m("pitch-deg = -1.0") > height_m("pitch-deg = 0.0") + 0.3);
    assert!(height_m("height-m = -0.2") > height_m("height-m = 0.0") + 0.05);
}

#[test]
fn range_noise_scatters_the_points_along_the_line_of_sight() {
    let spread_m = |fault: &str| {
        let steps = with(fault);
        let ahead = |step: &Step| step.points.iter().map(|([x_m, _, _], _)| *x_m).fold(f64::NEG_INFINITY, f64::max);
        let nearest: Vec<f64> = steps.iter().map(ahead).filter(|x_m| x_m.is_finite()).collect();
        let centre = mean(nearest.iter().copied());
        mean(nearest.iter().map(|x_m| (x_m - centre).powi(2))).sqrt()
    };
    assert!(spread_m("range-noise-m = 0.5") > 3.0 * spread_m("range-noise-m = 0.0"));
}

#[test]
fn a_wrong_clock_moves_an_approaching_vehicle_by_its_closing_speed() {
    let run = |fault: &str| {
        let others = vec![behind(80.0, OWN_LANE_M, 40.0)];
        Drive { faults: &lidar(fault), others, ..Drive::default() }.run()
    };
    let x_m = |offset: &str| run(&format!("clock-offset-s = {offset}"))[95].rear().unwrap().x_m();
    let right_m = x_m("0.0");
    for (offset, expected_m) in [("-0.1", 1.0), ("-0.2", 2.0), ("0.1", -1.0), ("0.2", -2.0)] {
        let shift_m = x_m(offset) - right_m;
        assert!((shift_m - expected_m).abs() < 0.3, "{offset}: {shift_m}");
    }
    for offset in ["-0.2", "0.2"] {
        let steps = run(&format!("clock-offset-s = {offset}\nfrom-s = 1.5\nuntil-s = 3.0"));
        for (step, track) in
            steps.iter().enumerate().flat_map(|(step, output)| output.tracks.iter().map(move |track| (step, track)))
        {
            let is_right = track.state.iter().all(|value| value.is_finite()) && track.covariance.cholesky().is_some();
            assert!(is_right, "{offset}: step {step}: {track:?}");
        }
        let error_m = steps[99].rear().unwrap().x_m() - run("clock-offset-s = 0.0")[99].rear().unwrap().x_m();
        assert!(error_m.abs() < 0.3, "{offset}: {error_m}");
    }
}

#[test]
fn rails_mirror_vehicles_and_only_where_there_are_rails() {
    let run = |fault: &str, has_rails: bool| {
        let others = vec![behind(25.0, LEFT_LANE_M, 30.0)];
        Drive { faults: &lidar(fault), others, has_rails, ..Drive::default() }.run()
    };
    let ghosts = |steps: &[Step]| {
        let points = steps.iter().flat_map(|step| &step.points);
        points.filter(|(_, source)| *source == PointSource::False).map(|(at_m, _)| at_m[1]).collect::<Vec<f64>>()
    };
    let mirrored = run("rail-ghosts = 0.5", true);
    let left: Vec<f64> = ghosts(&mirrored).into_iter().filter(|y_m| *y_m > 0.0).collect();
    // The rail stands 0.75 m beyond the edge, 5.625 m to the left of the ego: the mirror image of
    // 3.75 m is 9 m.
    let y_m = mean(left.iter().copied());
    assert!(left.len() > 1_000 && (y_m - 9.0).abs() < 0.3, "{} {y_m}", left.len());
    let usual = run("rail-ghosts = 0.0", true);
    assert!(ghosts(&usual).is_empty() && ghosts(&run("rail-ghosts = 0.5", false)).is_empty());
    // The map says where the road ends: no box and no track comes of an image behind the rail.
    for (step, (mirrored, usual)) in mirrored.iter().zip(&usual).enumerate() {
        assert_eq!(mirrored.widths_m, usual.widths_m, "step {step}");
        assert_eq!(mirrored.tracks, usual.tracks, "step {step}");
    }
    assert!(usual[99].rear().is_some_and(|track| (track.y_m() - 3.75).abs() < 0.5));
}

#[test]
fn crosstalk_adds_bursts_of_false_points_at_its_rate() {
    let steps = with("crosstalk = 3.0");
    let false_points =
        steps.iter().flat_map(|step| &step.points).filter(|(_, source)| *source == PointSource::False).count();
    // Three bursts of 3 to 10 columns and four layers in each of the 100 scans.
    let expected = 100.0 * 3.0 * 6.5 * 4.0;
    assert!((false_points as f64 / expected - 1.0).abs() < 0.15, "{false_points}");
    let detections = |steps: &[Step]| steps.iter().map(|step| step.widths_m.len()).sum::<usize>();
    assert!(detections(&steps) > detections(&with("crosstalk = 0.0")) + 20);
}

#[test]
fn blooming_widens_the_box() {
    let width_m = |fault: &str| {
        let others = vec![behind(30.0, OWN_LANE_M, 30.0)];
        let steps = Drive { faults: &lidar(fault), others, ..Drive::default() }.run();
        mean(steps.iter().flat_map(|step| step.widths_m.iter().copied()))
    };
    // A halo of 3° at 30 m reaches 1.6 m to either side of the plate.
    let (usual_m, wide_m) = (width_m("blooming-deg = 0.0"), width_m("blooming-deg = 3.0"));
    assert!(wide_m > usual_m + 0.5, "{usual_m} {wide_m}");
}
