//! Curved roads, motion during the sweep, and bit-for-bit repeatability.

use closecall_traffic::{Road, VehicleClass};

use super::*;

#[test]
fn boxes_follow_the_curvature_of_the_road() {
    let mut setup = TestScene::new().with(VehicleClass::Car, 60.0, 0.0);
    setup.road = Road::straight(3).with_curvature(0.0025);
    let mut lidar = RearLidar::new(Lidar::default());
    let detections = setup.detect(&mut lidar, 0);
    assert_eq!(detections.len(), 1);
    // The ego's path is a circle of curvature κ = 0.0025/(1 + 0.0025·5.625) per metre: y = κ·x²/2.
    let kappa = 0.0025 / (1.0 + 0.0025 * 5.625);
    let expected = 0.5 * kappa * detections[0].face_x_m.powi(2);
    assert!((detections[0].face_y_m - expected).abs() < 0.2, "{} for {expected}", detections[0].face_y_m);
    assert!((detections[0].heading_rad - kappa * detections[0].face_x_m).abs() < 0.02, "{}", detections[0].heading_rad);
}

#[test]
fn a_static_target_is_measured_at_its_position_at_the_end_of_the_scan() {
    let mut setup = TestScene::new().with(VehicleClass::Truck, 30.0, 0.0);
    setup.others[0].state.speed_mps = 0.0;
    let mut lidar = RearLidar::new(Lidar::default());
    let detections = setup.detect(&mut lidar, 5);
    assert!((detections[0].face_x_m + REAR_BUMPER_M + 30.0).abs() < 0.1, "{}", detections[0].face_x_m);
    // A moving target is detected at its position at the time of measurement.
    setup.others[0].state.speed_mps = SPEED_MPS;
    let detections = setup.detect(&mut lidar, 5);
    let since_s = (setup.time - detections[0].time).s();
    assert!((0.006..0.009).contains(&since_s), "{since_s}");
    let expected = -REAR_BUMPER_M - 30.0 - SPEED_MPS * since_s;
    assert!((detections[0].face_x_m - expected).abs() < 0.1, "{} for {expected}", detections[0].face_x_m);
}

#[test]
fn scans_do_not_depend_on_earlier_scans() {
    let mut setup = TestScene::new().with(VehicleClass::Car, 12.0, 0.3).with(VehicleClass::Truck, 40.0, -3.75);
    setup.road = road_with_guard_rails(0.001);
    setup.environment.water_film_mm = 0.5;
    let mut fresh = RearLidar::new(Lidar::default());
    let first = setup.detect(&mut fresh, 3);
    let mut used = RearLidar::new(Lidar::default());
    TestScene::new().with(VehicleClass::Motorcycle, 3.0, 0.0).detect(&mut used, 8);
    let second = setup.detect(&mut used, 3);
    let bits = |lidar: &RearLidar| -> Vec<u32> {
        let scan = lidar.latest();
        let columns = [&scan.x_m, &scan.y_m, &scan.z_m, &scan.intensity];
        columns.into_iter().flatten().map(|value| value.to_bits()).collect()
    };
    assert_eq!(bits(&fresh), bits(&used));
    assert_eq!(fresh.truth(), used.truth());
    assert_eq!(first, second);
}

#[test]
fn another_vehicle_does_not_change_the_noise_of_other_beams() {
    let mut alone = TestScene::new().with(VehicleClass::Car, 20.0, 0.0);
    let mut beside = TestScene::new().with(VehicleClass::Car, 20.0, 0.0).with(VehicleClass::Car, 20.0, 7.0);
    let (mut a, mut b) = (RearLidar::new(Lidar::default()), RearLidar::new(Lidar::default()));
    alone.detect(&mut a, 0);
    beside.detect(&mut b, 0);
    let points = |lidar: &RearLidar| -> Vec<(u16, u32)> {
        let scan = lidar.latest();
        let on = |&at: &usize| lidar.truth().points[at].source == PointSource::Actor(1);
        (0..scan.len()).filter(on).map(|at| (scan.beam[at], scan.x_m[at].to_bits())).collect()
    };
    assert_eq!(points(&a), points(&b));
}
