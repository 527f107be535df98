use proptest::prelude::*;

use super::*;
use crate::Road;
use crate::VehicleState;
use crate::ego_frame::EgoFrame;

fn alignment(points: &[[f64; 2]]) -> Alignment {
    let points: Vec<_> = points.iter().map(|&[s_m, curvature_per_m]| AlignmentPoint { s_m, curvature_per_m }).collect();
    Alignment::new(&points).unwrap()
}

/// A line, a clothoid to the left, an arc, a clothoid through the inflection to an arc to the right,
/// and a jump back to a line.
fn s_curve() -> Alignment {
    alignment(&[[50.0, 0.0], [200.0, 0.0025], [320.0, 0.0025], [560.0, -0.002], [640.0, -0.002], [640.0, 0.0]])
}

/// Returns the end of a line from s = `from_m` on, in many short steps of the midpoint rule.
fn marched(line: &Alignment, from_m: f64, to_m: f64) -> [f64; 3] {
    // All points of the line lie between two steps.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some thousand steps")]
    let steps = ((to_m - from_m).abs() * 400.0) as u32;
    let step_m = (to_m - from_m) / f64::from(steps);
    let (mut x_m, mut y_m, mut turn_rad) = (0.0, 0.0, 0.0);
    for step in 0..steps {
        let middle_m = from_m + (f64::from(step) + 0.5) * step_m;
        let turn = line.curvature_at_per_m(middle_m) * step_m;
        let (sin, cos) = maths::sin_cos(turn_rad + 0.5 * turn);
        x_m += cos * step_m;
        y_m += sin * step_m;
        turn_rad += turn;
    }
    [x_m, y_m, turn_rad]
}

/// Returns the Fresnel integrals C(t) and S(t) of cos and sin of π·u²/2, by their power series
/// (Abramowitz and Stegun 1964, 7.3.11 and 7.3.13).
fn fresnel(t: f64) -> [f64; 2] {
    let argument = 0.5 * std::f64::consts::PI * t * t;
    let (mut cosine, mut sine, mut term) = (0.0, 0.0, t);
    for order in 0..60_u32 {
        let share = term / f64::from(2 * order + 1);
        match order % 4 {
            0 => cosine += share,
            1 => sine += share,
            2 => cosine -= share,
            _ => sine -= share,
        }
        term *= argument / f64::from(order + 1);
    }
    [cosine, sine]
}

#[test]
fn a_clothoid_ends_where_the_fresnel_integrals_say() {
    for (length_m, curvature_per_m) in [(133.0, 0.0025), (600.0, 0.001), (2_000.0, 0.0025), (300.0, -0.002)] {
        let line = alignment(&[[0.0, 0.0], [length_m, curvature_per_m]]);
        let rate: f64 = curvature_per_m / length_m;
        // x(s) = √(π/c)·C(s·√(c/π)) for the curvature c·s.
        let scale_m = (std::f64::consts::PI / rate.abs()).sqrt();
        for share in [0.1, 0.5, 1.0] {
            let [cosine, sine] = fresnel(share * length_m / scale_m);
            let pose = line.pose(share * length_m);
            assert!((pose.x_m - scale_m * cosine).abs() < 1e-9, "{length_m} {share}: {}", pose.x_m);
            assert!((pose.y_m - scale_m * sine * rate.signum()).abs() < 1e-9, "{length_m} {share}: {}", pose.y_m);
            assert!((pose.yaw_rad - 0.5 * rate * share * share * length_m * length_m).abs() < 1e-12);
        }
    }
}

#[test]
fn an_alignment_of_one_curvature_is_the_road_of_that_curvature() {
    for curvature in [0.0, 0.0025, -0.001] {
        let line = alignment(&[[-100.0, curvature], [300.0, curvature]]);
        let [bent, arc] = [Road::straight(3).with_alignment(line), Road::straight(3).with_curvature(curvature)];
        for (s_m, d_m) in [(-400.0, 0.0), (-20.0, -5.6), (0.0, -11.0), (500.0, 1.0)] {
            let [got, expected] = [&bent, &arc].map(|road| road.plane_pose(s_m, d_m, 0.1));
            assert!(
                (got.x_m - expected.x_m).abs() < 1e-9 && (got.y_m - expected.y_m).abs() < 1e-9,
                "{got:?} {expected:?}"
            );
            assert!((got.yaw_rad - expected.yaw_rad).abs() < 1e-12);
            assert_eq!(bent.path_scale(s_m, d_m), arc.path_scale(s_m, d_m));
            assert!((bent.path_length_m([s_m, 77.0], d_m) - arc.path_length_m([s_m, 77.0], d_m)).abs() < 1e-10);
        }
        assert!(!bent.is_straight() && bent.constant_curvature_per_m().is_none());
        assert_eq!(bent.mirrored(), None);
    }
}

#[test]
fn the_displacement_along_an_s_curve_is_the_integral_of_the_direction() {
    let line = s_curve();
    for (from_m, to_m) in [(0.0, 700.0), (100.0, 101.0), (250.0, 600.0), (700.0, 0.0), (600.0, 180.0)] {
        let [x_m, y_m, turn_rad] = marched(&line, from_m, to_m);
        let way = line.displacement(from_m, to_m);
        assert!((way.along_m - x_m).abs() < 1e-6 && (way.across_m - y_m).abs() < 1e-6, "{way:?} {x_m} {y_m}");
        assert!((way.turn_rad - turn_rad).abs() < 1e-9, "{} {turn_rad}", way.turn_rad);
        assert!((way.turn_rad - line.turn_rad(from_m, to_m)).abs() < 1e-12);
    }
}

#[test]
fn a_line_far_from_the_start_is_as_exact_as_one_at_the_start() {
    let points = [[0.0, 0.0], [150.0, 0.0025], [150.0, 0.0]];
    let near = alignment(&points).displacement(-20.0, 130.0);
    let far = alignment(&points.map(|[s_m, curvature]| [s_m + 65_536.0, curvature])).displacement(65_516.0, 65_666.0);
    assert!((near.along_m - far.along_m).abs() < 1e-11 && (near.across_m - far.across_m).abs() < 1e-11);
}

#[test]
fn the_curvature_behind_a_jump_is_the_curvature_there() {
    let line = s_curve();
    assert_eq!(line.curvature_at_per_m(640.0), 0.0);
    assert_eq!(line.curvature_at_per_m(639.999), -0.002);
    assert_eq!(line.curvature_at_per_m(125.0), 0.00125);
    assert_eq!([-1e4, 1e4].map(|s_m| line.curvature_at_per_m(s_m)), [0.0; 2]);
    assert_eq!(line.curvature_range_per_m(), [-0.002, 0.0025]);
}

#[test]
fn the_length_of_a_path_is_the_integral_of_its_scale() {
    for road in [Road::straight(3).with_alignment(s_curve()), Road::straight(3).with_alignment(s_curve()).reversed()] {
        let sign = if road.is_reversed() { -1.0 } else { 1.0 };
        let (from_m, to_m, d_m) = (sign * 80.0, sign * 630.0, -9.0);
        let steps = 100_000_u32;
        let step_m = (to_m - from_m) / f64::from(steps);
        let scale = |step| road.path_scale(from_m + (f64::from(step) + 0.5) * step_m, d_m);
        let expected_m: f64 = (0..steps).map(|step| scale(step) * step_m).sum();
        let got_m = road.path_length_m([from_m, to_m], d_m);
        assert!((got_m - expected_m).abs() < 1e-4, "{got_m} {expected_m}");
        // Many short advances cover the same path.
        let mut s_m = from_m;
        for _ in 0..2_000 {
            s_m = road.advanced_m(s_m, d_m, got_m / 2_000.0);
        }
        assert!((s_m - to_m).abs() < 1e-4, "{s_m}");
    }
}

#[test]
fn a_reversed_road_has_the_same_places() {
    let road = Road::straight(3).with_alignment(s_curve());
    let reversed = road.reversed();
    for (one, other) in [([300.0, -5.6], [420.0, -1.9]), ([600.0, -9.4], [480.0, 2.0]), ([20.0, 0.0], [160.0, -11.0])] {
        let state = |[s_m, d_m]: [f64; 2]| VehicleState { s_m, d_m, ..VehicleState::default() };
        let before = EgoFrame::new(&road, &state(one)).point(other[0], other[1]);
        let [one, other] = [one, other].map(|[s_m, d_m]| road.reversed_position_m(s_m, d_m));
        let after = EgoFrame::new(&reversed, &state([one.0, one.1])).point(other.0, other.1);
        assert!((before.x_m + after.x_m).abs() < 1e-9 && (before.y_m + after.y_m).abs() < 1e-9, "{before:?} {after:?}");
        assert!((before.road_yaw_rad - after.road_yaw_rad).abs() < 1e-12);
    }
    let again = reversed.reversed();
    for s_m in [0.0, 100.0, 400.0] {
        assert_eq!(again.curvature_at_per_m(s_m), road.curvature_at_per_m(s_m));
        assert_eq!(again.path_scale(s_m, -4.0), road.path_scale(s_m, -4.0));
    }
}

#[test]
fn a_line_of_a_thousand_points_is_as_exact_as_a_short_one() {
    let points: Vec<[f64; 2]> =
        (0..1_000).map(|index| [f64::from(index) * 10.0, 0.003 * maths::sin(0.05 * f64::from(index))]).collect();
    let line = alignment(&points);
    assert_eq!(line.points().len(), 1_000);
    // A part of it is the line of that part.
    let part = alignment(&points[500..540]);
    for (from_m, to_m) in [(5_010.0, 5_300.0), (5_333.0, 5_120.0)] {
        assert_eq!(line.displacement(from_m, to_m), part.displacement(from_m, to_m));
    }
    let [x_m, y_m, turn_rad] = marched(&line, 0.0, 9_000.0);
    let pose = line.pose(9_000.0);
    assert!((pose.x_m - x_m).abs() < 1e-3 && (pose.y_m - y_m).abs() < 1e-3, "{pose:?} {x_m} {y_m}");
    assert!((pose.yaw_rad - turn_rad).abs() < 1e-6);
    let road = Road::straight(2).with_alignment(line);
    let back = road.reversed().reversed();
    assert_eq!(back.alignment(), road.alignment());
}

#[test]
fn points_that_are_no_alignment_are_refused_by_their_key() {
    let refused = |points: &[[f64; 2]]| {
        let points: Vec<_> =
            points.iter().map(|&[s_m, curvature_per_m]| AlignmentPoint { s_m, curvature_per_m }).collect();
        Alignment::new(&points).map(|_| ()).unwrap_err().to_string()
    };
    for (points, words) in [
        (vec![], "`alignment` has 0 entries, but 2 to 4096 are allowed"),
        (vec![[0.0, 0.0]], "`alignment` has 1 entry, but 2 to 4096 are allowed"),
        (vec![[0.0, 0.0]; 4_097], "`alignment` has 4097 entries,"),
        (
            vec![[0.0, 0.0], [100.0, 0.0041]],
            "`alignment[1].curvature-per-m` is 0.0041, but a number from -0.004 to 0.004",
        ),
        (vec![[0.0, 0.0], [100.0, f64::NAN]], "`alignment[1].curvature-per-m`"),
        (vec![[f64::NAN, 0.0], [100.0, 0.0]], "`alignment[0].s-m`"),
        (vec![[0.0, 0.0], [200_000.0, 0.0]], "`alignment[1].s-m`"),
        (vec![[100.0, 0.0], [0.0, 0.0]], "`alignment[1].s-m`"),
        (vec![[0.0, 0.0], [0.5, 0.0]], "`alignment[1].s-m`"),
        (vec![[0.0, 0.0], [0.0, 0.001], [0.0, 0.002]], "`alignment[2].s-m`"),
    ] {
        assert!(refused(&points).contains(words), "{points:?}: {}", refused(&points));
    }
}

proptest! {
    #[test]
    fn the_position_on_an_s_curve_is_the_inverse_of_the_pose(
        s in -50.0..750.0, d in -12.0..2.0, ego_s in -50.0..750.0, ego_d in -12.0..0.0, heading in -0.2..0.2,
        is_reversed in any::<bool>(),
    ) {
        let mut road = Road::straight(3).with_alignment(s_curve());
        let sign = if is_reversed { -1.0 } else { 1.0 };
        if is_reversed {
            road = road.reversed();
        }
        let (s, ego_s) = (sign * s, sign * ego_s);
        let pose = road.plane_pose(s, d, 0.0);
        let (back_s, back_d) = road.road_position_m(pose.x_m, pose.y_m, ego_s);
        prop_assert!((back_s - s).abs() < 1e-9 && (back_d - d).abs() < 1e-9, "{back_s} {s}, {back_d} {d}");
        let state = VehicleState { s_m: ego_s, d_m: ego_d, heading_rad: heading, ..VehicleState::default() };
        let frame = EgoFrame::new(&road, &state);
        let point = frame.point(s, d);
        let (back_s, back_d) = frame.road_position_m(point.x_m, point.y_m);
        prop_assert!((back_s - s).abs() < 1e-9 && (back_d - d).abs() < 1e-9, "{back_s} {s}, {back_d} {d}");
        prop_assert!((frame.lateral_position_m(point.x_m, point.y_m) - d).abs() < 1e-9);
        let ego = road.plane_pose(ego_s, ego_d, heading);
        let (sin, cos) = maths::sin_cos(ego.yaw_rad);
        let (dx, dy) = (pose.x_m - ego.x_m, pose.y_m - ego.y_m);
        prop_assert!((point.x_m - (dx * cos + dy * sin)).abs() < 1e-9);
        prop_assert!((point.y_m - (dy * cos - dx * sin)).abs() < 1e-9);
        prop_assert!((point.road_yaw_rad - (pose.yaw_rad - ego.yaw_rad)).abs() < 1e-12);
    }
}
