//! Occlusion, pitch, spray, fog and guard rails.

use closecall_traffic::{Alignment, AlignmentPoint, ClassScores, VehicleClass};

use super::*;
use crate::faults::LidarFault;

#[test]
fn no_class_counts_as_background_at_any_height_of_the_field_of_view() {
    for model in LidarModel::ALL {
        let kind = model.kind();
        let mut lidar = RearLidar::new(Lidar { kind, nominal_range_m: kind.nominal_range_m, ..Lidar::default() });
        for class in VehicleClass::ALL {
            for gap_m in [4.0, 6.0, 10.0] {
                let mut setup = TestScene::new().with(class, gap_m, 0.0);
                let detections = setup.detect(&mut lidar, 0);
                let (detection, ..) = first_vehicle_error(&setup, &detections).unwrap();
                let background = detection.class.0[ClassScores::BACKGROUND];
                assert!(background < 0.5, "{model:?}, {class:?} at {gap_m} m: {background}");
            }
        }
    }
}

#[test]
fn bursts_of_another_lidar_fit_into_narrow_and_into_high_patterns() {
    let mut narrow = LidarKindConfig::parse(LidarModel::Os1With64.file()).unwrap();
    (narrow.half_field_deg, narrow.azimuth_step_deg) = (6.0, 2.0);
    let fault = LidarFault { crosstalk: 5.0, ..LidarFault::default() };
    let setup = TestScene::new();
    for kind in [narrow.kind().unwrap(), LidarModel::Os1With64.kind()] {
        let mut lidar = RearLidar::new(Lidar { kind, nominal_range_m: kind.nominal_range_m, ..Lidar::default() });
        for sample in 0..20 {
            lidar.scan_with([&setup.scene(), &setup.scene()], &mut random(sample), Some(&fault));
            // Five bursts of 3 to 10 columns and four layers.
            let points = count(lidar.truth(), PointSource::False);
            assert!((60..=200).contains(&points), "{}: {points}", kind.name);
        }
    }
}

#[test]
fn vehicles_occlude_each_other() {
    let mut setup = TestScene::new().with(VehicleClass::Motorcycle, 40.0, 0.0).with(VehicleClass::Truck, 10.0, 0.0);
    let mut lidar = RearLidar::new(Lidar::default());
    setup.detect(&mut lidar, 0);
    assert_eq!(count(lidar.truth(), PointSource::Actor(1)), 0);
    setup.others.pop();
    setup.detect(&mut lidar, 0);
    assert!(count(lidar.truth(), PointSource::Actor(1)) > 10);
}

#[test]
fn pitch_under_braking_moves_the_beams_and_levelling_compensates_it() {
    let mut setup = TestScene::new().with(VehicleClass::Truck, 30.0, 0.0);
    let mut lidar = RearLidar::new(Lidar { levelling_sd_rad: 0.0, ..Lidar::default() });
    let mut means = |pitch_rad: f64| {
        setup.ego.pitch_rad = pitch_rad;
        setup.detect(&mut lidar, 0);
        let scan = lidar.latest();
        let lowest = (0..scan.len()).filter(|&at| lidar.truth().points[at].material == Material::Plate);
        let (mut layers, mut heights, mut n) = (0.0, 0.0, 0.0);
        for at in lowest {
            layers += f64::from(scan.beam[at] % 16);
            heights += f64::from(scan.z_m[at]);
            n += 1.0;
        }
        assert!(n > 0.0);
        (layers / n, heights / n)
    };
    // Half a group of layers: 1.205°.
    let (level, braking) = (means(0.0), means(1.205_f64.to_radians()));
    let moved = level.0 - braking.0;
    assert!((1.0..=3.0).contains(&moved), "{moved} layers");
    assert!((level.1 - braking.1).abs() < 0.2, "{level:?} {braking:?}");
}

#[test]
fn there_is_spray_behind_the_ego_on_wet_roads_only() {
    let mut setup = TestScene::new().with(VehicleClass::Car, 20.0, 0.0);
    let mut lidar = RearLidar::new(Lidar::default());
    let mut spray = |film_mm: f64, speed_mps: f64| {
        setup.environment.water_film_mm = film_mm;
        setup.ego.state.speed_mps = speed_mps;
        let detections = setup.detect(&mut lidar, 0);
        let points: Vec<_> = lidar.truth().points.iter().filter(|at| at.source == PointSource::Spray).collect();
        assert!(points.iter().all(|point| point.range_m < 15.0));
        // Spray neither occludes the vehicle nor is detected as one.
        assert_eq!(detections.iter().filter(|detection| detection.class.vehicle() > 0.5).count(), 1, "{detections:?}");
        points.len()
    };
    assert_eq!(spray(0.0, 30.0), 0);
    assert_eq!(spray(1.0, 10.0), 0);
    let (some, more) = (spray(0.5, 30.0), spray(1.5, 30.0));
    assert!(some > 20 && more > some, "{some} {more}");
}

#[test]
fn no_return_from_droplets_is_missed_for_not_being_looked_at() {
    for model in LidarModel::ALL {
        let mut scanner = Scanner::new(Lidar { kind: model.kind(), ..Lidar::default() });
        let mut setup = TestScene::new().with(VehicleClass::Truck, 9.0, 2.0).with(VehicleClass::Car, 18.0, -0.4);
        for (film_mm, visibility_m) in [(0.4, 2_000.0), (1.0, 2_000.0), (5.0, 2_000.0), (0.0, 40.0), (1.0, 100.0)] {
            setup.environment.water_film_mm = film_mm;
            setup.environment.visibility_m = visibility_m;
            for sample in 0..4_u32 {
                setup.ego.pitch_rad = 0.01 * (f64::from(sample) - 1.5);
                let rng = &mut random(sample.into());
                setup.time = CONTROL_STEP * i64::from(sample);
                let [returns, looked_at] = scanner.droplet_returns(&setup.scene(), rng);
                let few = 2 * returns + model.kind().beams() / 5;
                assert!(returns > 10 && looked_at < few, "{model:?}, {film_mm} mm: {returns}, {looked_at}");
            }
        }
    }
}

#[test]
fn fog_gives_false_returns_that_are_not_classified_as_vehicles() {
    let mut setup = TestScene::new();
    setup.environment.visibility_m = 60.0;
    let mut lidar = RearLidar::new(Lidar::default());
    let detections = setup.detect(&mut lidar, 0);
    assert!(count(lidar.truth(), PointSource::Fog) > 20);
    assert!(detections.iter().all(|detection| detection.class.vehicle() < 0.5), "{detections:?}");
}

#[test]
fn guard_rails_give_returns_but_no_vehicle_detections() {
    let points = [[900.0, -0.0025], [980.0, 0.0025]];
    let points = points.map(|[s_m, curvature_per_m]| AlignmentPoint { s_m, curvature_per_m });
    let course = Road::straight(3).with_alignment(Alignment::new(&points).unwrap()).with_guard_rails();
    for road in [0.0, 0.0025, -0.0025].map(road_with_guard_rails).into_iter().chain([course]) {
        let mut setup = TestScene::new().with(VehicleClass::Car, 30.0, 0.0).with(VehicleClass::Car, 20.0, -3.75);
        setup.road = road.clone();
        let mut lidar = RearLidar::new(Lidar::default());
        for scan_index in 0..2 {
            let detections = setup.detect(&mut lidar, scan_index);
            let complete = lidar.completed().unwrap();
            assert!(count(complete.truth(), PointSource::GuardRail) > 50, "{road:?}");
            let vehicles: Vec<_> = detections.iter().filter(|detection| detection.class.vehicle() > 0.5).collect();
            assert_eq!(vehicles.len(), 2, "{road:?}: {vehicles:?}");
        }
    }
}
