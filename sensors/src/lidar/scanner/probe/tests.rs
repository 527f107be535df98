use closecall_traffic::{ActorId, CONTROL_STEP, Road, Stream, Time, VehicleClass, stream};

use super::super::super::{LaneGeometry, Lidar, LidarModel};
use super::*;
use crate::faults::LidarFault;
use crate::monitors::Alarm;
use crate::testing::{OWN_LANE_M, scene_vehicle, with_speed};
use crate::{Scene, SceneVehicle};

const EGO_S_M: f64 = 1_000.0;

fn random() -> Stream {
    stream(4, 0, &ActorId::new("ego").unwrap(), "lidar")
}

/// Returns the beams of one column after the other over so many scans, of a LiDAR with this fault.
fn beams(lidar: Lidar, fault: &LidarFault, others: &[SceneVehicle], scans: i64) -> Vec<RoadBeam> {
    let (mut scanner, mut rng) = (Scanner::new(lidar), random());
    let (road, environment) = (Road::straight(3), Environment::CLEAR_DAY);
    let ego = with_speed(scene_vehicle(0, VehicleClass::Car, EGO_S_M, OWN_LANE_M), 30.0);
    let columns = scanner.pattern.columns.len();
    let (mut all, mut some) = (Vec::new(), Vec::new());
    for scan in 0..scans {
        // The ego pitches slowly to and fro.
        let ego = SceneVehicle { pitch_rad: 0.01 * maths::sin(0.1 * scan as f64), ..ego };
        let scene = Scene { time: CONTROL_STEP * scan, road: &road, environment: &environment, ego, others };
        let lane = LaneGeometry::from_scene(&scene);
        scanner.scan_with((&scene, &lane), &mut rng, Some(fault));
        let at = usize::try_from(scan).unwrap();
        scanner.probe(&[(37 * at) % columns, (37 * at + columns / 2) % columns], &environment, &mut some);
        assert_eq!(some.len() % 2, 0);
        all.append(&mut some);
    }
    all
}

/// Returns the mean of the heights in standard deviations, and their mean square.
fn moments(beams: &[RoadBeam]) -> [f64; 2] {
    let heights: Vec<f64> =
        beams.iter().filter_map(|beam| beam.height).map(|height| height.offset_m / height.sd_m).collect();
    assert!(heights.len() > 300, "{} heights", heights.len());
    let count = heights.len() as f64;
    [heights.iter().sum::<f64>() / count, heights.iter().map(|height| height * height).sum::<f64>() / count]
}

fn kinds() -> [Lidar; 4] {
    let usual = Lidar::default();
    let of = |model: LidarModel| Lidar { kind: model.kind(), ..usual };
    let turned = Lidar { azimuth_rad: 0.7, roll_rad: 0.02, tilt_rad: -0.01, ..usual };
    [usual, turned, Lidar { mount_height_m: 0.4, ..usual }, of(LidarModel::Os1With64)]
}

#[test]
fn a_faultless_lidar_sees_the_road_where_it_is_expected_as_often_as_expected() {
    for lidar in kinds() {
        let all = beams(lidar, &LidarFault::default(), &[], 1_000);
        let [mean, square] = moments(&all);
        // The stated deviation holds within 7 %. It is too great far away, where the road is brighter than assumed.
        assert!(mean.abs() < 0.2 && square < 1.15, "{}: {mean} {square}", lidar.kind.name);
        let expected: f64 = all.iter().map(|beam| beam.probability).sum();
        let returned = all.iter().filter(|beam| beam.has_returned).count() as f64;
        assert!(expected > 0.6 * all.len() as f64, "{}: {expected} of {}", lidar.kind.name, all.len());
        assert!(returned > expected - 4.0 * expected.sqrt().min(10.0), "{}: {returned} {expected}", lidar.kind.name);
    }
}

#[test]
fn each_fault_shows_in_the_beams() {
    let (usual, none) = (Lidar::default(), LidarFault::default());
    let with = |fault: LidarFault| beams(usual, &fault, &[], 500);
    let mean_m = |beams: &[RoadBeam]| {
        let heights: Vec<f64> = beams.iter().filter_map(|beam| beam.height).map(|height| height.offset_m).collect();
        heights.iter().sum::<f64>() / heights.len() as f64
    };
    // A sensor that is 5 cm too low sees the road 5 cm too high.
    let low_m = mean_m(&with(LidarFault { height_m: -0.05, ..none }));
    assert!((low_m - 0.05).abs() < 0.01, "{low_m}");
    // One that looks down too far sees the road 7 m away too high by the angle.
    let down_m = mean_m(&with(LidarFault { pitch_rad: (-0.5_f64).to_radians(), ..none }));
    assert!(down_m > 0.04 && down_m < 0.08, "{down_m}");
    let up_m = mean_m(&with(LidarFault { pitch_rad: 0.5_f64.to_radians(), ..none }));
    assert!(up_m < -0.03, "{up_m}");
    let [_, square] = moments(&with(LidarFault { range_noise_m: 0.3, ..none }));
    assert!(square > 15.0, "{square}");
    let share = |fault: LidarFault| {
        let all = with(fault);
        all.iter().filter(|beam| beam.has_returned).count() as f64 / all.len() as f64
    };
    assert!(share(none) > 0.85 && share(LidarFault { dropout: 0.6, ..none }) < 0.7);
    assert!(share(LidarFault { window_transmission: 0.5, ..none }) < 0.8, "the farther layers are lost");
    // A yaw leaves a level road as it is.
    assert!(mean_m(&with(LidarFault { yaw_rad: 0.5_f64.to_radians(), ..none })).abs() < 0.002);
}

/// A gap behind the ego in its lane, one beside it, and the distance between lanes (m).
struct Jam {
    gap_m: f64,
    beside_m: f64,
    lane_m: f64,
}

impl Jam {
    fn vehicles(&self, class: VehicleClass) -> [SceneVehicle; 3] {
        let place = |actor: usize, gap_m: f64, left_m: f64| {
            let other = scene_vehicle(actor, class, 0.0, OWN_LANE_M + left_m);
            let s_m = EGO_S_M - gap_m - other.vehicle.dimensions.length_m;
            with_speed(SceneVehicle { state: closecall_traffic::VehicleState { s_m, ..other.state }, ..other }, 30.0)
        };
        [place(1, self.gap_m, 0.0), place(2, self.beside_m, self.lane_m), place(3, self.beside_m, -self.lane_m)]
    }

    fn all() -> Vec<Self> {
        let mut all = Vec::new();
        // The monitor judges heights from 10 m/s on, where drivers keep some metres.
        for gap_m in [3.0, 4.0, 6.0] {
            for beside_m in [-3.5, -2.0, 1.0, 6.0] {
                all.extend([3.25, 3.75].map(|lane_m| Self { gap_m, beside_m, lane_m }));
            }
        }
        all
    }
}

/// Returns whether the monitor of a LiDAR takes the road for too high or too low, or the ranges for
/// scattered, in any of the decisions on these beams.
fn raises_alarm(all: &[RoadBeam]) -> bool {
    let mut monitor = crate::monitors::RoadMonitor::new(1);
    all.chunks(8).any(|scan| {
        monitor.observe(0, scan);
        monitor.end_scan();
        let alarms = monitor.alarms();
        alarms.contains(Alarm::WrongHeight) || alarms.contains(Alarm::NoisyRanges)
    })
}

#[test]
fn vehicles_all_round_give_returns_and_are_not_taken_for_the_road() {
    let mut highest: f64 = 0.0;
    for lidar in kinds() {
        for class in VehicleClass::ALL {
            for jam in Jam::all() {
                let all = beams(lidar, &LidarFault::default(), &jam.vehicles(class), 300);
                let missing = all.iter().filter(|beam| beam.probability > 0.98 && !beam.has_returned).count();
                assert!(missing < all.len() / 50, "{missing} of {}", all.len());
                assert!(!raises_alarm(&all), "{} {class:?} {} {}", lidar.kind.name, jam.gap_m, jam.beside_m);
                let heights: Vec<RoadHeight> = all.iter().filter_map(|beam| beam.height).collect();
                let high = heights.iter().filter(|height| height.offset_m > 3.0 * height.sd_m).count();
                highest = highest.max(high as f64 / heights.len().max(1) as f64);
            }
        }
    }
    // In some of these places, most heights are returns of vehicles.
    assert!(highest > 0.7, "{highest}");
}

#[test]
fn a_sensor_that_is_too_low_is_noticed_on_a_bare_road_and_beside_a_truck() {
    let low = LidarFault { height_m: -0.08, ..LidarFault::default() };
    let [_, left, _] = Jam { gap_m: 30.0, beside_m: 6.0, lane_m: 3.75 }.vehicles(VehicleClass::Truck);
    for lidar in kinds() {
        for others in [&[][..], &[left]] {
            assert!(raises_alarm(&beams(lidar, &low, others, 300)), "{} {}", lidar.kind.name, others.len());
        }
    }
}

#[test]
fn a_silent_sensor_shows_no_beams_and_the_scan_stays_as_it_is() {
    let (mut scanner, mut rng) = (Scanner::new(Lidar::default()), random());
    let (road, environment) = (Road::straight(3), Environment::CLEAR_DAY);
    let mut beams = Vec::new();
    scanner.probe(&[0, 1], &environment, &mut beams);
    assert!(beams.is_empty(), "before the first scan");
    let ego = with_speed(scene_vehicle(0, VehicleClass::Car, EGO_S_M, OWN_LANE_M), 30.0);
    let car = scene_vehicle(1, VehicleClass::Car, EGO_S_M - 20.0, OWN_LANE_M);
    let others = [with_speed(car, 30.0)];
    let scene = Scene { time: Time::ZERO, road: &road, environment: &environment, ego, others: &others };
    let scan = scanner.scan(&scene, &mut rng).clone();
    assert!(!scan.is_empty());
    scanner.probe(&[300, 301], &environment, &mut beams);
    assert_eq!((beams.len(), scanner.latest() == &scan), (8, true));
    scanner.blank(Time::ZERO, &mut rng);
    scanner.probe(&[300, 301], &environment, &mut beams);
    assert!(beams.is_empty());
}
