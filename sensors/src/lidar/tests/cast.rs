//! The fast ray cast, compared with brute force.

use closecall_traffic::{BodyShape, CONTROL_STEP, Time, VehicleClass};
use proptest::prelude::*;

use super::*;

fn placed_vehicle() -> impl Strategy<Value = SceneVehicle> {
    let shape = prop::sample::select(VehicleClass::ALL.map(BodyShape::of_class).concat());
    (shape, -130.0..8.0_f64, -9.0..9.0_f64, -0.4..0.4_f64, -0.03..0.03_f64).prop_map(
        |(body_shape, along, left, heading_rad, pitch_rad)| {
            let mut vehicle = scene_vehicle(1, body_shape.class(), 1_000.0 + along, LANE_D_M + left);
            vehicle.state.heading_rad = heading_rad;
            vehicle.pitch_rad = pitch_rad;
            vehicle.vehicle.appearance.body_shape = body_shape;
            vehicle
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn the_fast_ray_cast_agrees_with_brute_force(
        others in prop::collection::vec(placed_vehicle(), 0..5),
        (curvature, pitch_rad, plus) in (-0.0025..0.0025_f64, -0.04..0.04_f64, any::<bool>()),
    ) {
        let mut setup = TestScene::new();
        setup.others = others;
        setup.road = road_with_guard_rails(curvature);
        setup.ego.pitch_rad = pitch_rad;
        setup.time = if plus { Time::ZERO } else { CONTROL_STEP };
        let mut scanner = Scanner::new(Lidar::default());
        scanner.assert_cast_agrees_with_brute_force(&setup.scene());
    }

    #[test]
    fn a_scan_has_the_same_bits_in_all_vector_registers(
        others in prop::collection::vec(placed_vehicle(), 0..5),
        (water_film_mm, visibility_m) in prop::sample::select(vec![(0.0, 1e4), (1.0, 1e4), (0.0, 150.0)]),
        (has_rails, sample) in (any::<bool>(), 0..100_u64),
    ) {
        let mut setup = TestScene::new();
        setup.others = others.into_iter().map(|other| with_speed(other, SPEED_MPS)).collect();
        (setup.environment.water_film_mm, setup.environment.visibility_m) = (water_film_mm, visibility_m);
        if has_rails {
            setup.road = road_with_guard_rails(0.0);
        }
        let rng = stream(3, sample, &ActorId::new("ego").unwrap(), "lidar");
        let scans = Scanner::new(Lidar::default()).scans_in_all_registers(&setup.scene(), &rng);
        let bits = |scan: &LidarScan| {
            [&scan.x_m, &scan.y_m, &scan.z_m, &scan.intensity].map(|values| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>())
        };
        for (scan, truth) in &scans[1..] {
            prop_assert_eq!(bits(scan), bits(&scans[0].0));
            prop_assert_eq!((scan, truth), (&scans[0].0, &scans[0].1));
        }
    }
}
