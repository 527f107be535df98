//! Curved roads, motion during the sweep, and bit-for-bit repeatability.

use closecall_traffic::ego_frame::EgoFrame;
use closecall_traffic::{Alignment, AlignmentPoint, Road, VehicleClass};

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

/// Returns a road of three lanes whose curvature has these values at these positions.
fn course(points: &[[f64; 2]]) -> Road {
    let points: Vec<_> = points.iter().map(|&[s_m, curvature_per_m]| AlignmentPoint { s_m, curvature_per_m }).collect();
    Road::straight(3).with_alignment(Alignment::new(&points).unwrap())
}

#[test]
fn boxes_on_a_clothoid_lie_where_the_vehicle_is() {
    // The vehicle has just left an arc to the right, and the ego is on an arc to the left.
    let road = course(&[[920.0, -0.002], [990.0, 0.002]]);
    for gap_m in [25.0, 60.0] {
        let mut setup = TestScene::new().with(VehicleClass::Car, gap_m, 0.0);
        setup.road = road.clone();
        let mut lidar = RearLidar::new(Lidar::default());
        let detections = setup.detect(&mut lidar, 0);
        assert_eq!(detections.len(), 1, "{gap_m}");
        let since_s = (setup.time - detections[0].time).s();
        let state = &setup.others[0].state;
        let half_m = 0.5 * setup.others[0].vehicle.dimensions.length_m;
        let frame = EgoFrame::new(&road, &setup.ego.state);
        let face = frame.point(state.s_m + half_m - SPEED_MPS * since_s, state.d_m);
        let found = &detections[0];
        assert!((found.face_x_m - face.x_m).abs() < 0.3, "{gap_m}: {} for {}", found.face_x_m, face.x_m);
        assert!((found.face_y_m - face.y_m).abs() < 0.2, "{gap_m}: {} for {}", found.face_y_m, face.y_m);
        assert!((found.heading_rad - face.road_yaw_rad).abs() < 0.03, "{gap_m}: {}", found.heading_rad);
    }
}

#[test]
fn points_of_guard_rails_lie_on_the_rails_of_an_s_curve() {
    let road = course(&[[960.0, -0.0025], [990.0, 0.0025]]).with_guard_rails();
    let mut setup = TestScene::new();
    setup.road = road.clone();
    let mut lidar = RearLidar::new(Lidar::default());
    setup.detect(&mut lidar, 0);
    let complete = lidar.completed().unwrap();
    let (scan, truth) = (complete.latest(), complete.truth());
    let [left_m, right_m] = road.guard_rail_offsets_m();
    let rails_m = [left_m, road.right_edge_m() - right_m];
    // The share of the points behind the clothoid that lie on a rail of a road, and their number.
    let share_on = |road: &Road| {
        let frame = EgoFrame::new(road, &setup.ego.state);
        let of_rails = truth.points.iter().enumerate().filter(|(_, point)| point.source == PointSource::GuardRail);
        let on_rails: Vec<bool> = of_rails
            .filter(|(index, _)| scan.x_m[*index] < -40.0)
            .map(|(index, _)| {
                let d_m = frame.lateral_position_m(scan.x_m[index].into(), scan.y_m[index].into());
                rails_m.iter().any(|rail_m| (d_m - rail_m).abs() < 0.25)
            })
            .collect();
        (on_rails.iter().filter(|is_on| **is_on).count() as f64 / on_rails.len() as f64, on_rails.len())
    };
    let (share, count) = share_on(&road);
    assert!(count > 10 && share > 0.9, "{share} of {count}");
    // The arc at the ego is another road.
    let (on_arc, _) = share_on(&Road::straight(3).with_curvature(0.0025));
    assert!(on_arc < 0.2, "{on_arc}");
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
