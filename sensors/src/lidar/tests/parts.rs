//! Tests of boxes around parts: a plate, headlamps, and what is none of both.

use super::*;
use crate::Extent;
use closecall_traffic::Plate;

/// Returns the detections of a car with this paint and plate at a gap, over both sides of the mirror.
fn detections(gap_m: f64, left_m: f64, paint_reflectivity: f64, plate: Plate) -> Vec<Vec<Detection>> {
    let mut setup = TestScene::new().with(VehicleClass::Car, gap_m, left_m);
    setup.others[0].vehicle.appearance.paint_reflectivity = paint_reflectivity;
    setup.others[0].vehicle.appearance.plate = plate;
    let mut lidar = RearLidar::new(Lidar::default());
    (0..20).map(|scan_index| setup.detect(&mut lidar, scan_index)).collect()
}

#[test]
fn two_headlamps_of_a_dark_car_are_one_box() {
    // At this gap, one side of the mirror hits the lamps, the other the plate.
    let mut pairs = 0;
    for left_m in [-0.1, 0.0, 0.1] {
        for found in detections(70.0, left_m, 0.05, Plate::Clean) {
            assert!(found.len() <= 1, "{found:?}");
            for one in found.iter().filter(|one| one.is_centred) {
                assert!((one.face_y_m - left_m).abs() < 3.0 * one.lateral_sd_m, "{one:?}");
                pairs += usize::from(one.width_m > 1.4 && one.width == Extent::Seen);
            }
        }
    }
    assert!(pairs >= 8, "{pairs}");
}

#[test]
fn a_plate_is_in_the_middle_and_no_motorcycle() {
    let scans = detections(80.0, 0.2, 0.05, Plate::Clean);
    let mut plates = 0;
    for one in scans.iter().flatten().filter(|one| one.is_centred && one.points <= 5) {
        plates += 1;
        assert!((one.face_y_m - 0.2).abs() < 0.1, "{one:?}");
        assert_ne!(one.class.best_vehicle_class(), VehicleClass::Motorcycle, "{one:?}");
    }
    assert!(plates >= 8, "{plates}");
}

#[test]
fn no_plate_no_middle() {
    // A motorcycle far behind is as narrow as a plate, and a single lamp may be either.
    let mut setup = TestScene::new().with(VehicleClass::Motorcycle, 60.0, 0.4);
    let mut lidar = RearLidar::new(Lidar::default());
    let found: Vec<_> = (0..20).flat_map(|scan_index| setup.detect(&mut lidar, scan_index)).collect();
    assert!(found.len() >= 10, "{}", found.len());
    assert!(found.iter().all(|one| !one.is_centred), "{found:?}");
}

#[test]
fn two_motorcycles_abreast_are_no_pair_of_lamps() {
    for gap_m in [20.0, 40.0, 60.0] {
        let mut setup =
            TestScene::new().with(VehicleClass::Motorcycle, gap_m, 0.8).with(VehicleClass::Motorcycle, gap_m, -0.8);
        let mut lidar = RearLidar::new(Lidar::default());
        for scan_index in 0..10 {
            let found = setup.detect(&mut lidar, scan_index);
            assert!(found.iter().all(|one| !one.is_centred && one.width_m < 1.3), "{found:?} at {gap_m} m");
        }
    }
}

#[test]
fn lamps_of_neighbouring_cars_are_not_joined_across_the_marking() {
    let mut setup = TestScene::new().with(VehicleClass::Car, 70.0, 0.0).with(VehicleClass::Car, 70.0, 3.4);
    for other in &mut setup.others {
        other.vehicle.appearance.paint_reflectivity = 0.05;
    }
    let mut lidar = RearLidar::new(Lidar::default());
    let mut pairs = 0;
    for scan_index in 0..20 {
        for one in setup.detect(&mut lidar, scan_index).iter().filter(|one| one.is_centred) {
            let nearest_m = one.face_y_m.abs().min((one.face_y_m - 3.4).abs());
            assert!(nearest_m < 0.15, "{one:?}");
            pairs += 1;
        }
    }
    assert!(pairs >= 20, "{pairs}");
}
