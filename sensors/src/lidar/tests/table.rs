//! LiDARs that scan no raster: a table of the directions and times of their beams.

use closecall_traffic::VehicleClass;

use super::*;

/// Duration of the scan (µs).
const DURATION_US: u32 = 99_500;

/// Returns a LiDAR without noise whose 200 beams look straight back, within ±1.9° and 0.1° to 0.7°
/// upward, at mixed times.
fn lidar() -> Lidar {
    let beam = |beam: u32| {
        let azimuth_deg = 0.019 * f64::from(beam) - 1.9;
        [azimuth_deg, 0.1 + 0.3 * f64::from(beam % 3), f64::from(beam * 37 % 200 * 500)]
    };
    let mut config = LidarKindConfig::parse(LidarModel::Os1With64.file()).unwrap();
    config.layers_deg.clear();
    config.beams = Some((0..200).map(beam).collect());
    (config.half_field_deg, config.azimuth_step_deg, config.layer_spacing_deg) = (30.0, 0.057, 0.3);
    Lidar { kind: config.kind().unwrap(), ..Lidar::default() }.exact()
}

#[test]
fn beams_have_the_directions_and_times_of_the_table() {
    let pattern = Pattern::new(lidar().kind);
    assert_eq!((pattern.kind().beams(), pattern.kind().layers()), (200, 1));
    let (azimuth_rad, elevation_rad) = pattern.direction_rad(MirrorSide::Minus, 7);
    assert!((azimuth_rad.to_degrees() - (7.0 * 0.019 - 1.9)).abs() < 1e-9);
    assert!((elevation_rad.to_degrees() - 0.4).abs() < 1e-9);
    assert_eq!(pattern.columns[7].offset_ns, 7 * 37 % 200 * 500_000);
    assert_eq!(pattern.kind().sweep_ns, f64::from(DURATION_US) * 1e3);
}

#[test]
fn each_beam_meets_a_moving_vehicle_where_the_vehicle_is_at_the_time_of_the_beam() {
    for speed_mps in [0.0, 20.0, 30.0, 42.0] {
        let mut setup = TestScene::new().with(VehicleClass::Truck, 30.0, 0.0);
        setup.others[0].state.speed_mps = speed_mps;
        let mut lidar = RearLidar::new(lidar());
        lidar.scan(&setup.scene(), &mut random(1));
        let scan = lidar.latest();
        assert_eq!(scan.end - scan.start, Time::from_ns(i64::from(DURATION_US) * 1_000));
        let mut on_truck = 0;
        for (at, point) in lidar.truth().points.iter().enumerate() {
            if point.source != PointSource::Actor(1) {
                continue;
            }
            on_truck += 1;
            let before_end_s = 1e-6 * f64::from(DURATION_US) - 1e-9 * f64::from(scan.offset_ns[at]);
            // The frame of the ego at the end of the scan, in which the motion of the ego is
            // compensated.
            let expected_m = -REAR_BUMPER_M - 30.0 - speed_mps * before_end_s;
            let x_m = f64::from(scan.x_m[at]);
            assert!((x_m - expected_m).abs() < 0.1, "{x_m} for {expected_m}, {before_end_s} s before the end");
        }
        assert!(on_truck > 150, "{on_truck} points at {speed_mps} m/s");
    }
}

#[test]
fn the_fast_ray_cast_agrees_with_brute_force_without_a_raster() {
    let mut setup = TestScene::new().with(VehicleClass::Car, 12.0, 0.2).with(VehicleClass::Truck, 40.0, -1.0);
    setup.road = road_with_guard_rails(0.001);
    Scanner::new(lidar()).assert_cast_agrees_with_brute_force(&setup.scene());
}
