use closecall_traffic::{Alignment, AlignmentPoint};

use super::*;

fn alignment(points: &[[f64; 2]]) -> Road {
    let points: Vec<_> = points.iter().map(|&[s_m, curvature_per_m]| AlignmentPoint { s_m, curvature_per_m }).collect();
    Road::straight(3).with_alignment(Alignment::new(&points).unwrap())
}

/// Returns the greatest distance across between the path of the geometry and the ego's line on the
/// road, 200 m behind the ego to 20 m ahead of it (m), and the greatest error of the direction (rad).
fn errors(road: &Road, state: &VehicleState) -> [f64; 2] {
    let (lane, frame) = (LaneGeometry::new(road, state), EgoFrame::new(road, state));
    let mut errors = [0.0_f64; 2];
    for step in 0..440 {
        let point = frame.point(state.s_m - 200.0 + 0.5 * f64::from(step), state.d_m);
        errors[0] = errors[0].max((lane.path_y_m(point.x_m) - point.y_m).abs());
        errors[1] = errors[1].max((lane.direction_rad(point.x_m) - point.road_yaw_rad).abs());
    }
    errors
}

#[test]
fn the_path_along_clothoids_is_the_line_of_the_ego_on_the_road() {
    // The shortest clothoid of a motorway, and an inflection.
    let s_curve = alignment(&[[0.0, 0.0], [20.0, 0.0025], [100.0, 0.0025], [145.0, -0.002], [300.0, -0.002]]);
    for road in [s_curve.clone(), s_curve.reversed()] {
        for place in [30.0, 90.0, 130.0, 200.0, 290.0] {
            let s_m = if road.is_reversed() { -place } else { place };
            for heading_rad in [0.0, 0.05] {
                let state = VehicleState { s_m, d_m: -5.6, heading_rad, ..VehicleState::default() };
                let [across_m, turn_rad] = errors(&road, &state);
                assert!(across_m < 5e-4 && turn_rad < 2e-4, "{place} {heading_rad}: {across_m} {turn_rad}");
            }
        }
    }
}

#[test]
fn the_path_at_a_jump_of_the_curvature_is_within_some_millimetres() {
    let state = VehicleState { s_m: 150.0, d_m: -5.6, ..VehicleState::default() };
    let [across_m, _] = errors(&alignment(&[[0.0, 0.0], [101.0, 0.0], [101.0, 0.0025], [200.0, 0.0025]]), &state);
    assert!(across_m < 3e-3, "{across_m}");
    // At the smallest radius of an alignment, 250 m.
    let [across_m, _] = errors(&alignment(&[[0.0, 0.0], [101.0, 0.0], [101.0, 0.004], [200.0, 0.004]]), &state);
    assert!(across_m < 5e-3, "{across_m}");
}

#[test]
fn the_curvature_at_the_ego_alone_is_not_the_course_of_an_s_curve() {
    let road = alignment(&[[0.0, 0.0], [150.0, 0.0025]]);
    let state = VehicleState { s_m: 150.0, d_m: -5.6, ..VehicleState::default() };
    let lane = LaneGeometry::new(&road, &state);
    let arc = LaneGeometry { course: None, ..lane };
    let (behind_m, on_arc_m) = (lane.path_y_m(-150.0), arc.path_y_m(-150.0));
    assert!((behind_m - on_arc_m).abs() > 5.0, "{behind_m} {on_arc_m}");
    assert!(!lane.is_straight());
}
