//! Boxes and clusters, compared with the ground truth.

use closecall_traffic::{BodyShape, VehicleClass};

use super::*;
use crate::Extent;

#[test]
fn reported_standard_deviations_match_the_errors_of_the_front_face() {
    for class in VehicleClass::ALL {
        let (mut along, mut across, mut n) = (0.0, 0.0, 0.0);
        for step in 0..120_i32 {
            let gap = 4.0 + 0.75 * f64::from(step);
            let left = [0.0, 3.75, -3.75, 0.7][step as usize % 4];
            let mut setup = TestScene::new().with(class, gap, left);
            let mut lidar = RearLidar::new(Lidar::default());
            let detections = setup.detect(&mut lidar, step.into());
            let Some((detection, dx, dy)) = first_vehicle_error(&setup, &detections) else { continue };
            along += (dx / detection.range_sd_m).powi(2);
            across += (dy / detection.lateral_sd_m).powi(2);
            n += 1.0;
        }
        let (along, across) = (f64::sqrt(along / n), f64::sqrt(across / n));
        assert!(n > 90.0, "{class:?}: {n} found");
        assert!((0.4..=1.6).contains(&along), "{class:?}: along {along}");
        assert!((0.3..=1.6).contains(&across), "{class:?}: across {across}");
    }
}

#[test]
fn class_and_width_follow_from_the_shape() {
    for class in VehicleClass::ALL {
        for &body_shape in BodyShape::of_class(class) {
            for gap in [4.0, 10.0, 25.0, 50.0] {
                let mut setup = TestScene::new().with(class, gap, 0.0);
                setup.others[0].vehicle.appearance.body_shape = body_shape;
                let detections = setup.detect(&mut RearLidar::new(Lidar::default()), 1);
                let (detection, ..) = first_vehicle_error(&setup, &detections).unwrap();
                assert_eq!(detection.class.best_vehicle_class(), class, "{body_shape} at {gap} m: {detection:?}");
                assert!(detection.class.vehicle() > 0.6, "{body_shape} at {gap} m: {detection:?}");
                assert_eq!(detection.width, Extent::Seen);
                let width = class.typical_dimensions().width_m;
                assert!((detection.width_m - width).abs() < 0.35, "{} for {width} at {gap} m", detection.width_m);
            }
        }
    }
}

#[test]
fn each_vehicle_forms_one_cluster() {
    let mut report = SegmentationReport::default();
    let mut lidar = RearLidar::new(Lidar::default());
    for step in 0..60_i32 {
        let along = f64::from(step);
        let mut setup = TestScene::new()
            .with(VehicleClass::Car, 2.0 + 1.5 * along, 0.0)
            .with(VehicleClass::Truck, 5.0 + along, -3.75)
            .with(VehicleClass::Motorcycle, 60.0 - along, 3.75)
            .with(VehicleClass::Car, 25.0 + 1.2 * along, 3.75);
        setup.detect(&mut lidar, step.into());
        let clusters = (0..lidar.detections().len()).map(|detection| lidar.point_indices_of(detection));
        report.observe(lidar.truth(), clusters);
    }
    assert!(report.vehicles > 180, "{report:?}");
    let share = |count: usize| count as f64 / report.vehicles as f64;
    assert!(share(report.over_segmented) < 0.03, "{report:?}");
    assert!(share(report.under_segmented) < 0.03, "{report:?}");
    assert!(share(report.missed) < 0.03, "{report:?}");
}
