//! Several rear LiDARs, each with a mounting of its own.

use closecall_traffic::statistics::consistency::Consistency;
use closecall_traffic::{
    ActorId, CONTROL_STEP, Check, Environment, Parameters, Road, Source, Time, Track, TrackStatus, VehicleClass, maths,
    stream,
};

use crate::faults::{FaultEntries, Faults, LidarFaultConfig};
use crate::lidar::{Lidar, LidarConfig, PointSource, RearLidar};
use crate::testing::{OWN_LANE_M, scene_vehicle, with_speed};
use crate::{Alterations, Health, NoiseKey, Perception, Scene, SceneVehicle, SensorsConfig, TrackAudit};

const EGO_S_M: f64 = 1_000.0;
const LEFT_LANE_M: f64 = -1.875;
/// Two LiDARs at the corners of the rear bumper.
const CORNERS: &str = "rear-lidar = { name = \"left\", left-m = 0.8, azimuth-deg = 40 }\n\
                       additional-rear-lidars = [{ name = \"right\", left-m = -0.8, azimuth-deg = -40 }]\n";

/// Returns a car whose front is `gap_m` behind the ego's rear.
fn behind(actor: usize, gap_m: f64, d_m: f64, speed_mps: f64) -> SceneVehicle {
    let car = scene_vehicle(actor, VehicleClass::Car, 0.0, d_m);
    let s_m = EGO_S_M - gap_m - car.vehicle.dimensions.length_m;
    with_speed(scene_vehicle(actor, VehicleClass::Car, s_m, d_m), speed_mps)
}

fn faults(text: &str) -> Faults {
    let rear: Vec<LidarFaultConfig> = match text {
        "" => Vec::new(),
        _ => text.split("---\n").map(|entry| toml::from_str(entry).unwrap()).collect(),
    };
    FaultEntries { rear_lidar: &rear, ..FaultEntries::default() }.check(&Parameters::default()).unwrap()
}

/// The results of a drive of 4 s.
#[derive(Default)]
struct Drive {
    /// The confirmed rear tracks of each step.
    tracks: Vec<Vec<Track>>,
    health: Vec<Health>,
    /// Positions of the points of each LiDAR, in the order of the scenario, and of the steps.
    points: Vec<Vec<[f32; 3]>>,
    audit: TrackAudit,
}

fn drive(sensors: &str, fault: &str, others: &[SceneVehicle]) -> Drive {
    let text = format!("mode = \"full\"\nrear-camera.pipeline = \"off\"\n{sensors}");
    let sensors = toml::from_str::<SensorsConfig>(&text).unwrap().check(&Parameters::default()).unwrap();
    let sensors = sensors.altered(Alterations { faults: faults(fault), ..Alterations::default() });
    let key = NoiseKey { seed: 4, sample: 1, ego: ActorId::new("ego").unwrap(), actors: [].into() };
    let mut perception: Box<dyn Perception> = sensors.build(&key).unwrap();
    let (road, environment) = (Road::straight(3), Environment::CLEAR_DAY);
    let mut ego = with_speed(scene_vehicle(0, VehicleClass::Car, EGO_S_M, OWN_LANE_M), 30.0);
    let mut others = others.to_vec();
    let mut outcome = Drive::default();
    for step in 0..100 {
        let scene = Scene { time: CONTROL_STEP * step, road: &road, environment: &environment, ego, others: &others };
        let tracks = perception.step(&scene).unwrap().to_vec();
        outcome.audit.observe(&tracks, &scene).unwrap();
        let is_shown = |track: &Track| track.source == Source::Rear && track.status != TrackStatus::Tentative;
        outcome.tracks.push(tracks.into_iter().filter(is_shown).collect());
        outcome.health.push(perception.health().rear);
        let lidars = perception.lidars();
        outcome.points.resize(lidars.len(), Vec::new());
        for (points, lidar) in outcome.points.iter_mut().zip(lidars) {
            let scan = lidar.lidar.latest();
            points.extend((0..scan.len()).map(|at| [scan.x_m[at], scan.y_m[at], scan.z_m[at]]));
        }
        for vehicle in others.iter_mut().chain([&mut ego]) {
            vehicle.state.s_m += CONTROL_STEP.s() * vehicle.state.speed_mps;
        }
    }
    outcome
}

#[test]
fn the_points_of_a_turned_sensor_lie_on_the_vehicle_that_it_sees() {
    let (road, environment) = (Road::straight(3), Environment::CLEAR_DAY);
    for (inset_m, left_m, azimuth_deg, roll_deg, tilt_rad, pitch_rad) in [
        (0.0, 0.8, 45.0, 0.0, 0.0, 0.0),
        (0.4, -0.7, -30.0, 4.0, 0.02, 0.015),
        (0.0, 0.0, 0.0, -8.0, 0.0, -0.02),
        (1.5, 0.3, 70.0, 2.0, -0.03, 0.02),
    ] {
        let config = LidarConfig { levelling_sd_rad: closecall_traffic::Num::Fixed(0.0), ..LidarConfig::default() };
        let text = format!(
            "inset-m = {inset_m}\nleft-m = {left_m}\nazimuth-deg = {azimuth_deg}\nroll-deg = {roll_deg}\nfalse-alarm-rate = 0.0"
        );
        let mounted: LidarConfig = toml::from_str(&text).unwrap();
        let mounted = LidarConfig { tilt_rad: closecall_traffic::Num::Fixed(tilt_rad), ..mounted };
        let mounted = LidarConfig { levelling_sd_rad: config.levelling_sd_rad, ..mounted };
        let model: Lidar = mounted.check(&Parameters::default()).unwrap();
        let mut lidar = RearLidar::new(model);
        let mut ego = with_speed(scene_vehicle(0, VehicleClass::Car, EGO_S_M, OWN_LANE_M), 30.0);
        ego.pitch_rad = pitch_rad;
        let side_m = if azimuth_deg >= 0.0 { 3.0 } else { -3.0 };
        let car = behind(1, 14.0, OWN_LANE_M + side_m, 30.0);
        let scene = Scene { time: Time::ZERO, road: &road, environment: &environment, ego, others: &[car] };
        lidar.scan(&scene, &mut stream(1, 2, &ActorId::new("ego").unwrap(), "several"));
        let lidar = lidar.completed().unwrap();
        let (scan, truth) = (lidar.latest(), lidar.truth());
        let size = car.vehicle.dimensions;
        let front_m = -0.5 * ego.vehicle.dimensions.length_m - 14.0;
        let mut on_car = 0;
        for at in 0..scan.len() {
            let [x_m, y_m, z_m] = [scan.x_m[at], scan.y_m[at], scan.z_m[at]].map(f64::from);
            if truth.points[at].source == PointSource::Ground {
                assert!(z_m.abs() < 0.15, "{text}: the road at {z_m} m");
                continue;
            }
            on_car += 1;
            let is_along = x_m < front_m + 0.25 && x_m > front_m - size.length_m - 0.25;
            let is_across = (y_m - side_m).abs() < 0.5 * size.width_m + 0.25;
            assert!(is_along && is_across && (-0.1..size.height_m + 0.1).contains(&z_m), "{text}: {x_m} {y_m} {z_m}");
            // The measured range is the distance from the sensor.
            let sensor_m = [-0.5 * ego.vehicle.dimensions.length_m + inset_m, left_m];
            let level_m = maths::hypot(x_m - sensor_m[0], y_m - sensor_m[1]);
            let range_m = f64::from(lidar.point_beam(at).range_m);
            assert!((maths::hypot(level_m, z_m - 0.6) - range_m).abs() < 0.5, "{text}: {range_m}");
        }
        assert!(on_car > 100, "{text}: {on_car} points");
    }
}

#[test]
fn a_vehicle_that_both_sensors_see_has_one_consistent_track() {
    for (gap_m, d_m) in [(40.0, OWN_LANE_M), (25.0, LEFT_LANE_M), (60.0, OWN_LANE_M - 3.75)] {
        let mut runs = Vec::new();
        for closing_mps in [0.0, 2.0, 4.0] {
            let outcome = drive(CORNERS, "", &[behind(1, gap_m, d_m, 30.0 + closing_mps)]);
            let [track] = &outcome.tracks[99][..] else { panic!("{} tracks", outcome.tracks[99].len()) };
            assert!((track.y_m() - (d_m - OWN_LANE_M)).abs() < 0.1, "{gap_m} m: {}", track.y_m());
            assert!((track.vx_mps() - 30.0 - closing_mps).abs() < 0.3, "{gap_m} m: {}", track.vx_mps());
            assert_eq!((outcome.audit.id_switches, outcome.audit.false_tracks()), (0, 0));
            runs.push(outcome.audit.nees);
        }
        let consistency = Consistency::of(&runs).unwrap();
        assert!(consistency.mean < 4.0, "{gap_m} m, {d_m} m: {consistency:?}");
    }
}

#[test]
fn a_vehicle_that_only_the_slower_of_two_sensors_sees_is_confirmed_and_kept() {
    // The fast sensor looks to the right, the slow one to the left, where the car is.
    let sensors = "rear-lidar.azimuth-deg = -80\n\
                   additional-rear-lidars = [{ name = \"slow\", model = \"os1-64\", azimuth-deg = 20 }]\n";
    let outcome = drive(sensors, "", &[behind(1, 20.0, LEFT_LANE_M, 30.0)]);
    let first = outcome.tracks.iter().position(|tracks| !tracks.is_empty()).unwrap();
    assert!(first < 25, "{first}");
    assert!(outcome.tracks[first..].iter().all(|tracks| tracks.len() == 1));
    let alone = drive("rear-lidar.azimuth-deg = -80\n", "", &[behind(1, 20.0, LEFT_LANE_M, 30.0)]);
    assert!(alone.tracks.iter().all(Vec::is_empty), "the fast sensor does not see it");
}

#[test]
fn a_further_sensor_leaves_the_points_of_the_first_as_they_are() {
    let others = [behind(1, 40.0, OWN_LANE_M, 32.0)];
    let further = "additional-rear-lidars = [{ name = \"left\", left-m = 0.8, azimuth-deg = 40 }]\n";
    let (alone, with_further) = (drive("", "", &others), drive(further, "", &others));
    assert_eq!((alone.points.len(), with_further.points.len()), (1, 2));
    assert!(alone.points[0] == with_further.points[0] && alone.points[0] != with_further.points[1]);
}

#[test]
fn a_fault_hits_the_sensor_that_it_names_or_all() {
    let others = [behind(1, 40.0, OWN_LANE_M, 30.0)];
    let usual = drive(CORNERS, "", &others);
    let outcome = drive(CORNERS, "dead = true\nfrom-s = 1.0\nsensor = \"left\"", &others);
    assert!(outcome.points[0].len() < usual.points[0].len() / 2);
    assert!(outcome.points[1] == usual.points[1], "the other sensor does not notice");
    assert_eq!(outcome.tracks[99].len(), 1, "the other sensor sees the vehicle");
    let both = drive(CORNERS, "dead = true\nfrom-s = 1.0", &others);
    assert!(both.points[1].len() < usual.points[1].len() / 2 && both.tracks[99].is_empty());
    assert_eq!((usual.health[99], both.health[99]), (Health::Ok, Health::Failed));
    // 40° to the left and 66.5° to each side: only the right sensor sees the right lane near the
    // ego, and only the left sensor sees the left lane there.
    assert_eq!(outcome.health[99], Health::Failed);
    // Two sensors that look straight back replace each other.
    let twins = "additional-rear-lidars = [{ name = \"twin\", left-m = 0.5 }]\n";
    let outcome = drive(twins, "dead = true\nfrom-s = 1.0\nsensor = \"rear-lidar\"", &others);
    assert_eq!((outcome.health[99], outcome.tracks[99].len()), (Health::Degraded, 1));
}

/// A car 40 m straight behind, which two sensors that look straight back follow. Returns the
/// confirmed tracks of each step.
fn followed(sensors: &str, faults: &[String]) -> Vec<Vec<Track>> {
    let faults = faults.join("\n---\n");
    drive(sensors, &faults, &[behind(1, 40.0, OWN_LANE_M, 30.0)]).tracks
}

const TWINS: &str = "additional-rear-lidars = [{ name = \"twin\", left-m = 0.5 }]\n";

#[test]
fn a_small_mounting_error_of_one_of_two_sensors_pulls_the_track_half_as_far() {
    let y_m = |fault: String| followed(TWINS, &[fault])[99][0].y_m();
    let usual_m = y_m("yaw-deg = 0.0".into());
    for yaw_deg in [0.03, 0.05] {
        let [of_both, of_one] =
            ["", "sensor = \"twin\""].map(|sensor| y_m(format!("yaw-deg = {yaw_deg}\n{sensor}")) - usual_m);
        assert!(of_one > 0.2 * of_both && of_one < 0.8 * of_both, "{yaw_deg}: {of_one} {of_both}");
    }
    for yaw_deg in [0.07, 0.1, 0.15, 0.2, 0.3] {
        let off_m = y_m(format!("yaw-deg = {yaw_deg}\nsensor = \"twin\"")) - usual_m;
        let all_m = 42.0 * f64::to_radians(yaw_deg);
        assert!(off_m.abs() < 0.8 * all_m, "{yaw_deg}: {off_m} of {all_m}");
    }
}

#[test]
fn a_track_follows_its_first_sensor_if_the_other_contradicts_it() {
    let slow_first = "rear-lidar.model = \"os1-64\"\n\
                      additional-rear-lidars = [{ name = \"twin\", left-m = 0.5, model = \"scala-2\" }]\n";
    let slow_second = "additional-rear-lidars = [{ name = \"twin\", left-m = 0.5, model = \"os1-64\" }]\n";
    let lossy = "lost-frames = 0.1\nsensor = \"rear-lidar\"".to_owned();
    let late = "clock-offset-s = 0.01\nsensor = \"twin\"".to_owned();
    for (sensors, more) in
        [(TWINS, None), (slow_first, None), (slow_second, None), (TWINS, Some(lossy)), (TWINS, Some(late))]
    {
        for (sensor, yaw_deg) in [("twin", 0.4), ("twin", 0.5), ("twin", 0.8), ("twin", -0.6), ("rear-lidar", 0.5)] {
            let askew = format!("yaw-deg = {yaw_deg}\nsensor = \"{sensor}\"");
            let tracks = followed(sensors, &[Some(askew), more.clone()].into_iter().flatten().collect::<Vec<_>>());
            // The first sensor may be the misaligned one.
            let expected_m = if sensor == "twin" { 0.0 } else { 40.0 * f64::to_radians(yaw_deg) };
            for (step, tracks) in tracks.iter().enumerate().skip(60) {
                let [track] = &tracks[..] else { panic!("{} tracks, step {step}, {sensors}", tracks.len()) };
                let text = format!(
                    "{} m, {} m/s, step {step}, {sensor} {yaw_deg}, {sensors} {more:?}",
                    track.y_m(),
                    track.vy_mps()
                );
                assert!((track.y_m() - expected_m).abs() < 0.08 && track.vy_mps().abs() < 0.2, "{text}");
            }
        }
    }
}

#[test]
fn one_sensor_that_is_blocked_is_made_up_for_by_the_other() {
    let others = [behind(1, 35.0, OWN_LANE_M, 30.0)];
    let twins = "rear-lidar.left-m = -0.6\nadditional-rear-lidars = [{ name = \"twin\", left-m = 0.6 }]\n";
    let blocked = "blocked-from-deg = -8.0\nblocked-to-deg = 8.0";
    assert!(drive("", blocked, &others).tracks[99].is_empty());
    assert_eq!(drive(twins, &format!("{blocked}\nsensor = \"twin\""), &others).tracks[99].len(), 1);
    assert!(drive(twins, blocked, &others).tracks[99].is_empty());
}
