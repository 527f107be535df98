//! Numbers of points on a vehicle, compared with the scan pattern and with the link budget.

use closecall_traffic::{Environment, VehicleClass, maths};

use super::*;

/// Returns the number of beams whose centres hit an upright rectangle, from the formula of the scan
/// pattern alone.
fn hand_count(mirror_side: MirrorSide, distance_m: f64, half_width_m: f64, [low_m, high_m]: [f64; 2]) -> usize {
    let pattern = Pattern::new(LidarModel::Scala2.kind());
    let meets = |&beam: &u16| {
        let (azimuth, elevation) = pattern.direction_rad(mirror_side, beam);
        let height = 0.6 + distance_m / maths::cos(azimuth) * maths::tan(elevation);
        (distance_m * maths::tan(azimuth)).abs() < half_width_m && height > low_m && height < high_m
    };
    (0..u16::try_from(10_448).unwrap()).filter(meets).count()
}

#[test]
fn point_counts_on_a_truck_match_the_scan_pattern() {
    for gap_m in [3.0, 10.0, 30.0, 60.0] {
        let mut setup = TestScene::new().with(VehicleClass::Truck, gap_m, 0.0);
        // With a receiver that misses no return, not even of the windscreen, only the geometry
        // counts.
        let mut lidar = RearLidar::new(Lidar { dropout: 0.0, nominal_range_m: 500.0, ..Lidar::default() });
        for scan_index in 0..2 {
            setup.detect(&mut lidar, scan_index);
            let mirror_side = lidar.latest().mirror_side;
            let points = lidar.latest().beam.iter().zip(&lidar.truth().points);
            let on = points.filter(|(_, point)| point.source == PointSource::Actor(1));
            let mut beams: Vec<u16> = on.map(|(&beam, _)| beam).collect();
            beams.dedup();
            // The cab's front is 2.51 m wide and extends from 0.35 m to 3.6 m; the load behind it
            // is higher. The count is at least the number of beams whose centres hit the cab, and
            // at most the number whose footprints touch the vehicle, including its wheels and its
            // load.
            let footprint = [gap_m * 0.0625_f64.to_radians(), gap_m * 0.3_f64.to_radians()];
            let least = hand_count(mirror_side, gap_m, 1.255, [0.35, 3.6]);
            let most = hand_count(
                mirror_side,
                gap_m,
                1.275 + 1.2 * footprint[0],
                [-1.2 * footprint[1], 4.0 + 1.2 * footprint[1]],
            );
            assert!((least..=most).contains(&beams.len()), "{} not in {least}..={most} at {gap_m} m", beams.len());
            assert!(most as f64 / least as f64 - 1.0 < 0.6, "{least} {most}");
        }
    }
}

#[test]
fn the_upper_half_of_128_layers_meets_a_truck() {
    let kind = LidarModel::Os1With128.kind();
    let mut setup = TestScene::new().with(VehicleClass::Truck, 5.0, 0.0);
    let mut lidar = RearLidar::new(Lidar { kind, dropout: 0.0, nominal_range_m: 500.0, ..Lidar::default() });
    setup.detect(&mut lidar, 0);
    let mut is_hit = [false; 128];
    for (beam, point) in lidar.latest().beam.iter().zip(&lidar.truth().points) {
        is_hit[usize::from(*beam) % 128] |= point.source == PointSource::Actor(1);
    }
    // A beam at 22° meets the cab, 5 m away, 2.6 m above the ground.
    let upper = is_hit[64..].iter().filter(|is_hit| **is_hit).count();
    assert!(upper >= 60, "{upper} of the upper 64 layers");
}

#[test]
fn point_counts_on_a_car_follow_from_the_columns_and_layers_that_meet_it() {
    for gap_m in [3.0, 4.0, 5.0] {
        let points = TestScene::new().with(VehicleClass::Car, gap_m, 0.0).mean_points();
        // 1.85 m are 257 columns at 3 m, where they are 0.25° apart beyond 15°, and 168 at 5 m,
        // times 16 layers, each less the beams that meet glass; more of the bonnet and of the
        // wheels is behind the front.
        assert!((2_500.0..=4_100.0).contains(&points), "{points} at {gap_m} m");
    }
    let points = TestScene::new().with(VehicleClass::Car, 30.0, 0.0).mean_points();
    // 28 columns times the 4 or 5 layers between 0.18 m and 1.5 m.
    assert!((100.0..=160.0).contains(&points), "{points}");
    let points = TestScene::new().with(VehicleClass::Car, 100.0, 0.0).mean_points();
    // 8 columns times 1 or 2 layers; some returns are too weak.
    assert!((5.0..=20.0).contains(&points), "{points}");
}

#[test]
fn a_motorcycle_at_100_m_fills_three_columns() {
    let mut setup = TestScene::new().with(VehicleClass::Motorcycle, 100.0, 0.0);
    // With a receiver that misses no return, only the geometry counts.
    let mut lidar = RearLidar::new(Lidar { dropout: 0.0, nominal_range_m: 500.0, ..Lidar::default() });
    for scan_index in 0..2 {
        setup.detect(&mut lidar, scan_index);
        let points = lidar.latest().beam.iter().zip(&lidar.truth().points);
        let on = points.filter(|(_, point)| point.source == PointSource::Actor(1));
        let mut columns: Vec<usize> = on.map(|(&beam, _)| usize::from(beam) / 16).collect();
        columns.sort_unstable();
        columns.dedup();
        assert!((3..=4).contains(&columns.len()), "{columns:?}");
    }
}

#[test]
fn dark_paint_rain_and_fog_reduce_the_point_count() {
    let seen = |reflectivity: f64, environment: Environment, gap_m: f64| {
        let mut setup = TestScene::new().with(VehicleClass::Car, gap_m, 0.0);
        setup.environment = environment;
        setup.others[0].vehicle.appearance.paint_reflectivity = reflectivity;
        setup.mean_points()
    };
    let clear = Environment::CLEAR_DAY;
    let rain = Environment { rain_mm_per_h: 50.0, ..clear };
    let fog = |visibility_m| Environment { visibility_m, ..clear };
    // At 90 m each step has an effect. The two-way transmission is 0.54 in rain, and 0.03 in fog of
    // 200 m visibility.
    let counts = [
        seen(0.8, clear, 90.0),
        seen(0.5, clear, 90.0),
        seen(0.5, rain, 90.0),
        seen(0.1, clear, 90.0),
        seen(0.5, fog(200.0), 90.0),
    ];
    assert!(counts.windows(2).all(|pair| pair[0] > pair[1]), "{counts:?}");
    let fogs = [seen(0.5, fog(1_000.0), 50.0), seen(0.5, fog(200.0), 50.0), seen(0.5, fog(100.0), 50.0)];
    assert!(fogs.windows(2).all(|pair| pair[0] > pair[1]), "{fogs:?}");
}

/// Returns the share of 60 scans in which the first of the other vehicles is detected as a vehicle,
/// at gaps from `from_m` to about 10 m more.
fn found_share(class: VehicleClass, reflectivity: f64, environment: Environment, from_m: f64) -> f64 {
    let mut lidar = RearLidar::new(Lidar::default());
    let mut detected = 0;
    for scan_index in 0..60_i32 {
        let mut setup =
            TestScene::new().with(class, from_m + 0.17 * f64::from(scan_index), 0.3 * f64::from(scan_index % 5 - 2));
        setup.environment = environment;
        setup.others[0].vehicle.appearance.paint_reflectivity = reflectivity;
        let boxes = setup.detect(&mut lidar, scan_index.into());
        let vehicle = |(detection, ..): (Detection, f64, f64)| detection.class.vehicle() > 0.5;
        detected += u32::from(first_vehicle_error(&setup, &boxes).is_some_and(vehicle));
    }
    f64::from(detected) / 60.0
}

#[test]
fn detection_ranges_follow_from_reflectivity_and_visibility() {
    let clear = Environment::CLEAR_DAY;
    let fog = Environment { visibility_m: 100.0, ..clear };
    let car = |reflectivity, environment, from_m| found_share(VehicleClass::Car, reflectivity, environment, from_m);
    assert!(car(0.5, clear, 90.0) > 0.95);
    assert!(car(0.5, clear, 100.0) > 0.75);
    // Half of the scans, the scans of one mirror side, are enough to confirm a track.
    assert!(car(0.5, clear, 120.0) > 0.2);
    assert!(car(0.1, clear, 60.0) > 0.9 && car(0.1, clear, 100.0) < 0.2);
    assert!(car(0.5, fog, 30.0) > 0.8 && car(0.5, fog, 70.0) < 0.2);
    assert!(found_share(VehicleClass::Motorcycle, 0.5, clear, 60.0) > 0.9);
    assert!(found_share(VehicleClass::Truck, 0.5, clear, 130.0) > 0.9);
}
