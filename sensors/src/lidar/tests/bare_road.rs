//! Compares a scan without the bare road with the complete scan.

use closecall_traffic::{BodyShape, VehicleClass};
use proptest::prelude::*;

use super::*;

fn setup() -> impl Strategy<Value = (TestScene, Lidar)> {
    let shape = prop::sample::select(VehicleClass::ALL.map(BodyShape::of_class).concat());
    let vehicle = (shape, -130.0..4.0_f64, -9.0..9.0_f64).prop_map(|(body_shape, along, left)| {
        let mut vehicle = scene_vehicle(1, body_shape.class(), 1_000.0 + along, LANE_D_M + left);
        vehicle.vehicle.appearance.body_shape = body_shape;
        with_speed(vehicle, SPEED_MPS)
    });
    let ego = (-0.04..0.04_f64, 0.0..45.0_f64, -0.3..0.3_f64, -0.03..0.03_f64);
    let air = prop::sample::select(vec![(1e4, 0.0), (1e4, 1.0), (150.0, 0.0)]);
    // A strong sensor and a large error of the pitch, so that some of the road's points pass for
    // something else.
    let lidar = (
        0.2..2.5_f64,
        -0.1..0.1_f64,
        prop::sample::select(vec![0.0005, 0.02]),
        prop::sample::select(vec![200.0, 500.0]),
        // Half of the sensors look straight back from the middle of the bumper.
        prop_oneof![Just([0.0; 4]), [0.0..3.0_f64, -1.0..1.0_f64, -1.3..1.3_f64, -0.17..0.17_f64]],
    );
    (prop::collection::vec(vehicle, 0..3), ego, air, lidar, any::<bool>()).prop_map(
        |(others, (pitch_rad, speed_mps, yaw_rate_radps, heading_rad), air, lidar, rails)| {
            let (mount_height_m, tilt_rad, levelling_sd_rad, nominal_range_m, mounting) = lidar;
            let [inset_m, left_m, azimuth_rad, roll_rad] = mounting;
            let mut setup = TestScene::new();
            setup.others = others;
            setup.ego.pitch_rad = pitch_rad;
            setup.ego.state.speed_mps = speed_mps;
            setup.ego.state.yaw_rate_radps = yaw_rate_radps;
            setup.ego.state.heading_rad = heading_rad;
            (setup.environment.visibility_m, setup.environment.water_film_mm) = air;
            if rails {
                setup.road = road_with_guard_rails(0.0);
            }
            let turned = Lidar { inset_m, left_m, azimuth_rad, roll_rad, ..Lidar::default() };
            (setup, Lidar { mount_height_m, tilt_rad, levelling_sd_rad, nominal_range_m, ..turned })
        },
    )
}

/// Returns the bits of each point that satisfies a condition, with its beam.
fn points(lidar: &RearLidar, keep: impl Fn(usize) -> bool) -> Vec<(u16, [u32; 4])> {
    let scan = lidar.latest();
    let bits = |at: usize| [scan.x_m[at], scan.y_m[at], scan.z_m[at], scan.intensity[at]].map(f32::to_bits);
    (0..scan.len()).filter(|&at| keep(at)).map(|at| (scan.beam[at], bits(at))).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn a_scan_leaves_out_only_points_that_the_detector_discards((mut setup, model) in setup(), index in 0..1_000_i64) {
        let mut lidar = RearLidar::new(model);
        let detections = setup.detect(&mut lidar, index);
        let complete = lidar.completed().unwrap();
        prop_assert_eq!(complete.detections(), &detections[..]);
        let members = |lidar: &RearLidar| -> Vec<_> {
            (0..detections.len()).map(|at| points(lidar, |point| lidar.point_indices_of(at).contains(&(point as u32)))).collect()
        };
        prop_assert_eq!(members(&lidar), members(&complete));
        let solid = |lidar: &RearLidar| points(lidar, |at| matches!(lidar.truth().points[at].source, PointSource::Actor(_)));
        prop_assert_eq!(solid(&lidar), solid(&complete));
        prop_assert!(complete.latest().len() >= lidar.latest().len());
    }
}

proptest! {
    #[test]
    fn a_block_of_columns_counts_as_ground_only_if_each_of_its_columns_does((mut setup, model) in setup(), index in 0..1_000_i64) {
        setup.time = CONTROL_STEP * index;
        Scanner::new(model).columns_of_bare_road(&setup.scene(), &mut random(index.unsigned_abs()));
    }
}

#[test]
fn nearly_all_columns_of_an_empty_road_count_as_ground_in_blocks() {
    for pitch_rad in [-0.005, 0.0, 0.005] {
        let mut setup = TestScene::new();
        setup.ego.pitch_rad = pitch_rad;
        let [in_blocks, all] = Scanner::new(Lidar::default()).columns_of_bare_road(&setup.scene(), &mut random(0));
        assert!(all > 600 && in_blocks > all - 50, "{pitch_rad}: {in_blocks} of {all}");
    }
}

#[test]
fn nearly_all_points_of_an_empty_road_are_left_out() {
    let mut lidar = RearLidar::new(Lidar::default());
    TestScene::new().detect(&mut lidar, 0);
    let complete = lidar.completed().unwrap().latest().len();
    assert!(complete > 3_000, "{complete}");
    assert!(lidar.latest().len() < complete / 20, "{} of {complete}", lidar.latest().len());
}

#[test]
fn nearly_all_points_of_guard_rails_are_left_out() {
    let mut lidar = RearLidar::new(Lidar::default());
    let mut setup = TestScene::new();
    setup.road = road_with_guard_rails(0.0);
    setup.detect(&mut lidar, 0);
    let complete = lidar.completed().unwrap();
    let rails =
        |lidar: &RearLidar| lidar.truth().points.iter().filter(|point| point.source == PointSource::GuardRail).count();
    assert!(rails(&complete) > 300, "{}", rails(&complete));
    assert!(rails(&lidar) < rails(&complete) / 10, "{} of {}", rails(&lidar), rails(&complete));
    assert_eq!(lidar.detections(), []);
}

#[test]
fn a_scan_of_the_bare_road_is_not_dark_and_one_behind_a_dirty_window_is() {
    for (window_transmission, is_dark) in [(1.0, false), (0.0, true)] {
        let mut lidar = RearLidar::new(Lidar { window_transmission, false_alarm_rate: 0.0, ..Lidar::default() });
        TestScene::new().detect(&mut lidar, 0);
        assert_eq!(lidar.is_dark(), is_dark, "{window_transmission}");
        assert_eq!(lidar.completed().unwrap().latest().is_empty(), is_dark, "{window_transmission}");
    }
}

#[test]
fn a_strong_and_high_sensor_takes_no_far_return_of_the_road_for_an_object() {
    let lidar = Lidar { mount_height_m: 2.0, nominal_range_m: 500.0, ..Lidar::default() };
    let mut lidar = RearLidar::new(lidar);
    let mut beyond = 0;
    for index in 0..20 {
        assert_eq!(TestScene::new().detect(&mut lidar, index), []);
        let complete = lidar.completed().unwrap();
        assert_eq!(complete.detections(), []);
        let scan = complete.latest();
        beyond += (0..scan.len()).filter(|&at| scan.x_m[at] < scan.sensor_x_m - 41.0).count();
    }
    // One point alone would be an object.
    assert!(beyond >= 5, "the road returns light from beyond 40 m: {beyond} points");
}
