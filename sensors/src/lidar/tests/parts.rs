//! Tests of boxes around parts: a plate, headlamps, and other parts.

use super::*;
use crate::Extent;
use closecall_traffic::Plate;

/// Returns the detections of a car with this paint and plate at a gap, over both sides of the
/// mirror.
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
        for detections in detections(70.0, left_m, 0.05, Plate::Clean) {
            assert!(detections.len() <= 1, "{detections:?}");
            for detection in detections.iter().filter(|detection| detection.is_centred) {
                assert!((detection.face_y_m - left_m).abs() < 3.0 * detection.lateral_sd_m, "{detection:?}");
                pairs += usize::from(detection.width_m > 1.4 && detection.width == Extent::Seen);
            }
        }
    }
    assert!(pairs >= 8, "{pairs}");
}

#[test]
fn a_plate_is_in_the_middle_and_no_motorcycle() {
    let scans = detections(80.0, 0.2, 0.05, Plate::Clean);
    let mut plates = 0;
    for detection in scans.iter().flatten().filter(|detection| detection.is_centred && detection.points <= 5) {
        plates += 1;
        assert!((detection.face_y_m - 0.2).abs() < 0.1, "{detection:?}");
        assert_ne!(detection.class.best_vehicle_class(), VehicleClass::Motorcycle, "{detection:?}");
    }
    assert!(plates >= 8, "{plates}");
}

#[test]
fn no_plate_no_middle() {
    // A motorcycle far behind is as narrow as a plate, and a single lamp may be either.
    let mut setup = TestScene::new().with(VehicleClass::Motorcycle, 60.0, 0.4);
    let mut lidar = RearLidar::new(Lidar::default());
    let detections: Vec<_> = (0..20).flat_map(|scan_index| setup.detect(&mut lidar, scan_index)).collect();
    assert!(detections.len() >= 10, "{}", detections.len());
    assert!(detections.iter().all(|detection| !detection.is_centred), "{detections:?}");
}

#[test]
fn two_motorcycles_abreast_are_no_pair_of_lamps() {
    for gap_m in [20.0, 40.0, 60.0] {
        let mut setup =
            TestScene::new().with(VehicleClass::Motorcycle, gap_m, 0.8).with(VehicleClass::Motorcycle, gap_m, -0.8);
        let mut lidar = RearLidar::new(Lidar::default());
        for scan_index in 0..10 {
            let detections = setup.detect(&mut lidar, scan_index);
            assert!(
                detections.iter().all(|detection| !detection.is_centred && detection.width_m < 1.3),
                "{detections:?} at {gap_m} m"
            );
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
        for detection in setup.detect(&mut lidar, scan_index).iter().filter(|detection| detection.is_centred) {
            let nearest_m = detection.face_y_m.abs().min((detection.face_y_m - 3.4).abs());
            assert!(nearest_m < 0.15, "{detection:?}");
            pairs += 1;
        }
    }
    assert!(pairs >= 20, "{pairs}");
}
