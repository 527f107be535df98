//! Tests of encounters in the plane against closed forms, and property tests against a dense scan
//! in time.

use std::f64::consts::{FRAC_PI_4, PI, SQRT_2};

use nalgebra::{Rotation2, Vector2};
use proptest::prelude::*;

use super::*;
use crate::geometry::{OrientedBox, first_contact};
use crate::{Absent, maths};

const HORIZON_S: f64 = 10.0;

fn moving(x_m: f64, y_m: f64, yaw_rad: f64, vx_mps: f64, vy_mps: f64) -> Moving {
    Moving { shape: OrientedBox { x_m, y_m, yaw_rad, length_m: 4.0, width_m: 2.0 }, vx_mps, vy_mps }
}

fn after(body: &Moving, time_s: f64) -> OrientedBox {
    OrientedBox { x_m: body.shape.x_m + body.vx_mps * time_s, y_m: body.shape.y_m + body.vy_mps * time_s, ..body.shape }
}

fn distance_after_m(a: &Moving, b: &Moving, time_s: f64) -> f64 {
    after(a, time_s).distance_m(&after(b, time_s))
}

fn transformed(body: &Moving, turn_rad: f64, shift: Vector2<f64>) -> Moving {
    let rotation = Rotation2::new(turn_rad);
    let centre = rotation * body.shape.centre_m() + shift;
    let velocity = rotation * Vector2::new(body.vx_mps, body.vy_mps);
    let yaw_rad = body.shape.yaw_rad + turn_rad;
    let shape = OrientedBox { x_m: centre.x, y_m: centre.y, yaw_rad, ..body.shape };
    Moving { shape, vx_mps: velocity.x, vy_mps: velocity.y }
}

fn mirrored(body: &Moving) -> Moving {
    let shape = OrientedBox { y_m: -body.shape.y_m, yaw_rad: -body.shape.yaw_rad, ..body.shape };
    Moving { shape, vx_mps: body.vx_mps, vy_mps: -body.vy_mps }
}

fn same(first: Result<Encounter, Absent>, second: Result<Encounter, Absent>) -> bool {
    match (first, second) {
        (Ok(first), Ok(second)) => {
            (first.ttce_s - second.ttce_s).abs() < 1e-6 && (first.dce_m - second.dce_m).abs() < 1e-8
        }
        (first, second) => first == second,
    }
}

prop_compose! {
    fn any_moving()(
        x_m in -60.0..60.0, y_m in -15.0..15.0, yaw_rad in -PI..PI, length_m in 1.0..17.0, width_m in 0.5..3.0,
        vx_mps in -20.0..20.0, vy_mps in -6.0..6.0,
    ) -> Moving {
        Moving { shape: OrientedBox { x_m, y_m, yaw_rad, length_m, width_m }, vx_mps, vy_mps }
    }
}

#[test]
fn a_straight_approach_in_closed_form() {
    let (lead, follower) = (moving(54.0, 0.0, 0.0, 30.0, 0.0), moving(0.0, 0.5, 0.0, 35.0, 0.0));
    assert_eq!(closest_encounter(&lead, &follower, 20.0), Ok(Encounter { ttce_s: 10.0, dce_m: 0.0 }));
    assert_eq!(time_to_touch_s(&lead, &follower), Ok(10.0));
    assert_eq!(time_to_collision_s(50.0, 35.0, 30.0), Ok(10.0), "as along the road");
}

#[test]
fn passing_in_the_next_lane_is_closest_when_the_bumpers_are_level() {
    let (slow, fast) = (moving(54.0, 0.0, 0.0, 30.0, 0.0), moving(0.0, 3.75, 0.0, 35.0, 0.0));
    assert_eq!(closest_encounter(&slow, &fast, 20.0), Ok(Encounter { ttce_s: 10.0, dce_m: 1.75 }));
    assert_eq!(time_to_touch_s(&slow, &fast), Err(Absent::NoCollisionCourse));
    // Alongside, the distance stays the same, so the encounter is now. Once the vehicle is past,
    // the encounter is over.
    let alongside = moving(55.0, 3.75, 0.0, 35.0, 0.0);
    assert_eq!(closest_encounter(&slow, &alongside, 20.0), Ok(Encounter { ttce_s: 0.0, dce_m: 1.75 }));
    let past = moving(58.1, 3.75, 0.0, 35.0, 0.0);
    assert_eq!(closest_encounter(&slow, &past, 20.0), Err(Absent::NotApproaching));
}

#[test]
fn a_crossing_course_passes_a_corner_in_closed_form() {
    // A square turned by 45° crosses ahead of a standing one; its lowest corner passes the side of
    // the other.
    let square = |x_m, y_m, yaw_rad, vx_mps| Moving {
        shape: OrientedBox { x_m, y_m, yaw_rad, length_m: 2.0, width_m: 2.0 },
        vx_mps,
        vy_mps: 0.0,
    };
    let (standing, crossing) = (square(0.0, 0.0, 0.0, 0.0), square(-20.0, 4.0, FRAC_PI_4, 10.0));
    let Encounter { ttce_s, dce_m } = closest_encounter(&standing, &crossing, HORIZON_S).unwrap();
    assert!((dce_m - (4.0 - 1.0 - SQRT_2)).abs() < 1e-12, "{dce_m}");
    assert!((ttce_s - 1.9).abs() < 1e-12, "the corner reaches the side's end at x = −1 m: {ttce_s}");
}

#[test]
fn vehicles_that_do_not_approach_have_no_encounter() {
    let (ahead, behind) = (moving(20.0, 0.0, 0.0, 30.0, 0.0), moving(0.0, 0.0, 0.0, 25.0, 0.0));
    for metric in [
        closest_encounter(&ahead, &behind, HORIZON_S).map(|encounter| encounter.ttce_s),
        time_to_touch_s(&ahead, &behind),
    ] {
        assert_eq!(metric, Err(Absent::NotApproaching));
    }
    let as_fast = moving(0.0, 0.0, 0.0, 30.0, 0.0);
    assert_eq!(closest_encounter(&ahead, &as_fast, HORIZON_S), Err(Absent::NotApproaching));
    assert_eq!(time_to_touch_s(&ahead, &as_fast), Err(Absent::NotApproaching));
}

#[test]
fn boxes_that_touch_already_have_time_and_distance_zero() {
    let (first, second) = (moving(0.0, 0.0, 0.0, 30.0, 0.0), moving(3.0, 1.0, 0.3, 35.0, 0.0));
    assert_eq!(closest_encounter(&first, &second, HORIZON_S), Ok(Encounter { ttce_s: 0.0, dce_m: 0.0 }));
    assert_eq!(time_to_touch_s(&first, &second), Ok(0.0));
    let at_rest = moving(3.0, 1.0, 0.3, 30.0, 0.0);
    assert_eq!(time_to_touch_s(&first, &at_rest), Ok(0.0));
}

#[test]
fn a_far_encounter_lies_beyond_the_horizon() {
    let (lead, follower) = (moving(54.0, 0.0, 0.0, 30.0, 0.0), moving(0.0, 0.0, 0.0, 35.0, 0.0));
    assert_eq!(closest_encounter(&lead, &follower, 9.9), Err(Absent::BeyondHorizon));
}

/// Headings that differ only by rounding must not move the encounter from the front bumper to the
/// rear one.
#[test]
fn nearly_parallel_sides_count_as_parallel() {
    for noise in [1e-13, -1e-13] {
        let (slow, fast) = (moving(54.0, 0.0, noise, 30.0, 0.0), moving(0.0, 3.75, -noise, 35.0, 1e-13));
        let encounter = closest_encounter(&slow, &fast, 20.0).unwrap();
        assert!((encounter.ttce_s - 10.0).abs() < 1e-9 && (encounter.dce_m - 1.75).abs() < 1e-9, "{encounter:?}");
    }
}

#[cfg(not(debug_assertions))]
#[test]
fn nan_never_looks_safe() {
    let vehicle = moving(0.0, 0.0, 0.0, 30.0, 0.0);
    const ARGUMENTS: usize = 5;
    for unknown in 0..ARGUMENTS {
        let at = |i: usize, value: f64| if i == unknown { f64::NAN } else { value };
        let other = moving(at(0, 50.0), at(1, 20.0), at(2, 0.3), at(3, 60.0), at(4, 1.0));
        assert_eq!(time_to_touch_s(&vehicle, &other), Ok(0.0), "{other:?}");
        assert_eq!(closest_encounter(&vehicle, &other, HORIZON_S), Ok(Encounter { ttce_s: 0.0, dce_m: 0.0 }));
    }
}

proptest! {
    #[test]
    fn encounters_agree_with_a_dense_scan(a in any_moving(), b in any_moving()) {
        const STEPS: u32 = 1_000;
        let step_s = HORIZON_S / f64::from(STEPS);
        let scan = (0..=STEPS).map(|step| distance_after_m(&a, &b, f64::from(step) * step_s));
        let nearest_m = scan.fold(f64::INFINITY, f64::min);
        let speed_mps = maths::hypot(b.vx_mps - a.vx_mps, b.vy_mps - a.vy_mps);
        match closest_encounter(&a, &b, HORIZON_S) {
            Ok(Encounter { ttce_s, dce_m }) => {
                prop_assert!((distance_after_m(&a, &b, ttce_s) - dce_m).abs() < 1e-9, "the distance at that time");
                prop_assert!(dce_m <= nearest_m + 1e-9 && nearest_m <= dce_m + speed_mps * step_s, "the smallest");
                if ttce_s > 1e-6 {
                    let before_m = distance_after_m(&a, &b, ttce_s - (1e-3_f64).min(0.5 * ttce_s));
                    prop_assert!(before_m > dce_m, "nearer before");
                }
            }
            Err(Absent::NotApproaching) => prop_assert!((nearest_m - distance_after_m(&a, &b, 0.0)).abs() < 1e-9),
            Err(Absent::BeyondHorizon) => {
                prop_assert!((nearest_m - distance_after_m(&a, &b, HORIZON_S)).abs() < 1e-9 && nearest_m > 0.0);
            }
            Err(other) => prop_assert!(false, "{other}"),
        }
    }

    #[test]
    fn the_time_to_touch_equals_the_first_contact(a in any_moving(), b in any_moving()) {
        let [a_then, b_then] = [&a, &b].map(|vehicle| after(vehicle, HORIZON_S));
        let contact = first_contact(&a.shape, &a_then, &b.shape, &b_then);
        match (time_to_touch_s(&a, &b), contact) {
            (Ok(touch_s), Some(contact)) => {
                let contact_s = contact.fraction * HORIZON_S;
                prop_assert!((touch_s - contact_s).abs() < 1e-7, "{contact_s} {touch_s}");
            }
            (Ok(touch_s), None) => prop_assert!(touch_s > HORIZON_S - 1e-9),
            (Err(_), None) => {}
            (Err(absent), Some(_)) => prop_assert!(false, "{absent}"),
        }
    }

    #[test]
    fn the_time_to_touch_equals_an_encounter_at_distance_zero(a in any_moving(), b in any_moving()) {
        match (time_to_touch_s(&a, &b), closest_encounter(&a, &b, f64::MAX)) {
            (Ok(touch_s), Ok(Encounter { ttce_s, dce_m })) => {
                prop_assert_eq!((touch_s, 0.0), (ttce_s, dce_m));
            }
            (Err(Absent::NoCollisionCourse), Ok(encounter)) => prop_assert!(encounter.dce_m > 0.0),
            (touch, encounter) => prop_assert_eq!(touch, encounter.map(|encounter| encounter.ttce_s)),
        }
    }

    #[test]
    fn encounters_do_not_depend_on_order_frame_or_handedness(
        a in any_moving(), b in any_moving(), turn in -PI..PI, x in -500.0..500.0, y in -500.0..500.0,
    ) {
        let encounter = closest_encounter(&a, &b, HORIZON_S);
        prop_assert!(same(encounter, closest_encounter(&b, &a, HORIZON_S)));
        prop_assert!(same(encounter, closest_encounter(&mirrored(&a), &mirrored(&b), HORIZON_S)));
        let shift = Vector2::new(x, y);
        let moved = closest_encounter(&transformed(&a, turn, shift), &transformed(&b, turn, shift), HORIZON_S);
        prop_assert!(same(encounter, moved), "{encounter:?} {moved:?}");
    }

    #[test]
    fn a_common_velocity_changes_nothing(a in any_moving(), b in any_moving(), vx in -40.0..40.0, vy in -40.0..40.0) {
        let faster = |body: &Moving| Moving { vx_mps: body.vx_mps + vx, vy_mps: body.vy_mps + vy, ..*body };
        prop_assert!(same(closest_encounter(&a, &b, HORIZON_S), closest_encounter(&faster(&a), &faster(&b), HORIZON_S)));
    }

    #[test]
    fn a_larger_gap_is_never_more_critical(
        gap in 1.0..60.0, more in 0.1..60.0_f64, lateral in -5.0..5.0, closing in 0.5..20.0_f64, yaw in -0.5..0.5,
    ) {
        let ego = moving(0.0, 0.0, 0.0, 30.0, 0.0);
        let behind = |gap: f64| moving(-6.0 - gap, lateral, yaw, 30.0 + closing, 0.0);
        let near = closest_encounter(&ego, &behind(gap), f64::MAX).unwrap();
        let far = closest_encounter(&ego, &behind(gap + more), f64::MAX).unwrap();
        prop_assert!((far.ttce_s - near.ttce_s - more / closing).abs() < 1e-6 * far.ttce_s);
        prop_assert!((far.dce_m - near.dce_m).abs() < 1e-9);
    }
}
