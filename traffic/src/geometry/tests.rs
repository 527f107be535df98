//! Tests of parry's answers against closed forms, and property tests against an independent
//! brute-force implementation.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, SQRT_2};

use nalgebra::{Rotation2, Vector2};
use proptest::prelude::*;
use serde::Deserialize;
use serde::de::{IntoDeserializer, value};

use super::*;
use crate::maths;

const CAR: OrientedBox = OrientedBox { x_m: 0.0, y_m: 0.0, yaw_rad: 0.0, length_m: 4.0, width_m: 2.0 };

fn car(x_m: f64, y_m: f64, yaw_rad: f64) -> OrientedBox {
    OrientedBox { x_m, y_m, yaw_rad, ..CAR }
}

/// Rotates the box about the origin of the plane and shifts it.
fn transformed(shape: &OrientedBox, turn_rad: f64, shift: Vector2<f64>) -> OrientedBox {
    let centre = Rotation2::new(turn_rad) * shape.centre_m() + shift;
    OrientedBox { x_m: centre.x, y_m: centre.y, yaw_rad: shape.yaw_rad + turn_rad, ..*shape }
}

/// Mirrors the box at the plane's x axis.
fn mirrored(shape: &OrientedBox) -> OrientedBox {
    OrientedBox { y_m: -shape.y_m, yaw_rad: -shape.yaw_rad, ..*shape }
}

/// Interpolates the pose at a fraction of the step.
fn between(from: &OrientedBox, to: &OrientedBox, fraction: f64) -> OrientedBox {
    let at = |from: f64, to: f64| from + fraction * (to - from);
    let (x_m, y_m) = (at(from.x_m, to.x_m), at(from.y_m, to.y_m));
    OrientedBox { x_m, y_m, yaw_rad: at(from.yaw_rad, to.yaw_rad), ..*from }
}

/// Computes the distance from all pairs of edges and a test for corners inside; it shares no code
/// with the implementation.
fn brute_force_distance_m(a: &OrientedBox, b: &OrientedBox) -> f64 {
    let edges = |shape: &OrientedBox| {
        let corners = shape.corners_m();
        [0, 1, 2, 3].map(|i| (corners[i], corners[(i + 1) % 4]))
    };
    let cross = |u: Vector2<f64>, v: Vector2<f64>| u.x * v.y - u.y * v.x;
    let inside = |point: Vector2<f64>, shape: &OrientedBox| {
        edges(shape).iter().all(|(from, to)| cross(to - from, point - from) >= 0.0)
    };
    if a.corners_m().iter().any(|corner| inside(*corner, b)) || b.corners_m().iter().any(|corner| inside(*corner, a)) {
        return 0.0;
    }
    let to_segment = |point: Vector2<f64>, (from, to): (Vector2<f64>, Vector2<f64>)| {
        let along = ((point - from).dot(&(to - from)) / (to - from).norm_squared()).clamp(0.0, 1.0);
        (from + (to - from) * along - point).norm()
    };
    let mut nearest = f64::INFINITY;
    for e in edges(a) {
        for f in edges(b) {
            let crosses = cross(e.1 - e.0, f.0 - e.0) * cross(e.1 - e.0, f.1 - e.0) <= 0.0
                && cross(f.1 - f.0, e.0 - f.0) * cross(f.1 - f.0, e.1 - f.0) <= 0.0;
            let apart = to_segment(e.0, f).min(to_segment(e.1, f)).min(to_segment(f.0, e)).min(to_segment(f.1, e));
            nearest = nearest.min(if crosses { 0.0 } else { apart });
        }
    }
    nearest
}

prop_compose! {
    fn any_box()(
        x_m in -12.0..12.0, y_m in -12.0..12.0, yaw_rad in -PI..PI, length_m in 0.5..17.0, width_m in 0.4..3.0,
    ) -> OrientedBox {
        OrientedBox { x_m, y_m, yaw_rad, length_m, width_m }
    }
}

prop_compose! {
    /// A box and its pose one step later; some of the boxes turn, some do not.
    fn any_step()(from in any_box(), dx in -15.0..15.0, dy in -15.0..15.0, turn in prop_oneof![Just(0.0), -1.5..1.5])
        -> (OrientedBox, OrientedBox) {
        (from, OrientedBox { x_m: from.x_m + dx, y_m: from.y_m + dy, yaw_rad: from.yaw_rad + turn, ..from })
    }
}

#[test]
fn corners_are_ordered_counter_clockwise_from_the_front_left() {
    let [front_left, rear_left, rear_right, front_right] = car(10.0, 5.0, FRAC_PI_2).corners_m();
    for (corner, x_m, y_m) in
        [(front_left, 9.0, 7.0), (rear_left, 9.0, 3.0), (rear_right, 11.0, 3.0), (front_right, 11.0, 7.0)]
    {
        assert!((corner - Vector2::new(x_m, y_m)).norm() < 1e-12, "{corner}");
    }
}

#[test]
fn distance_of_known_poses() {
    assert_eq!(CAR.distance_m(&car(10.0, 0.0, 0.0)), 6.0);
    assert_eq!(CAR.distance_m(&car(7.0, 6.0, 0.0)), 5.0, "corner to corner: 3, 4, 5");
    assert_eq!(CAR.distance_m(&car(4.0, 0.0, 0.0)), 0.0, "touching");
    assert!(CAR.overlaps(&car(4.0, 2.0, 0.0)), "corner on corner");
    assert!(CAR.overlaps(&car(0.0, 0.0, FRAC_PI_2)), "a cross: no corner inside the other");
    let turned = car(2.0 + 1.0 + 3.0 / SQRT_2, 0.0, FRAC_PI_4);
    assert!((CAR.distance_m(&turned) - 1.0).abs() < 1e-12, "a corner ahead of the front");
}

#[test]
fn nan_overlaps() {
    let unknown = car(f64::NAN, 0.0, 0.0);
    assert!(CAR.overlaps(&unknown) && unknown.overlaps(&CAR));
    assert_eq!(CAR.distance_m(&unknown), 0.0);
}

#[test]
fn a_rear_end_collision_in_closed_form() {
    let lead = car(10.0, 0.3, 0.0);
    let contact = first_contact(&CAR, &car(8.0, 0.0, 0.0), &lead, &lead).unwrap();
    assert!((contact.fraction - 6.0 / 8.0).abs() < 1e-15);
    assert_eq!(contact.sides, [BoxSide::Front, BoxSide::Rear]);
}

#[test]
fn a_side_swipe_strikes_right_and_left() {
    let left_of_it = car(1.0, 3.0, 0.0);
    let contact = first_contact(&left_of_it, &car(3.0, 1.0, 0.0), &CAR, &car(2.0, 0.0, 0.0)).unwrap();
    assert!((contact.fraction - 0.5).abs() < 1e-15);
    assert_eq!(contact.sides, [BoxSide::Right, BoxSide::Left]);
}

#[test]
fn a_cut_in_with_the_front_corner_strikes_a_side() {
    // It comes from the left and is turned to the right: its front right corner meets the left side
    // of the other box.
    let contact = first_contact(&car(-2.0, 3.5, -0.3), &car(-1.5, 2.0, -0.3), &CAR, &CAR).unwrap();
    assert_eq!(contact.sides[1], BoxSide::Left);
    let corner_beside = 2.0 * maths::sin(0.3) + maths::cos(0.3);
    assert!((contact.fraction - (3.5 - corner_beside - 1.0) / 1.5).abs() < 1e-12);
}

#[test]
fn a_turning_corner_in_closed_form() {
    // The corner at the angle atan(1/2) rises as √5·sin(angle) and meets the lower side of the wall
    // at 1.8 m.
    let wall = OrientedBox { x_m: 0.0, y_m: 2.3, yaw_rad: 0.0, length_m: 50.0, width_m: 1.0 };
    let contact = first_contact(&CAR, &car(0.0, 0.0, 0.8), &wall, &wall).unwrap();
    let angle = maths::asin(1.8 / 5.0_f64.sqrt()) - maths::atan(0.5);
    assert!((contact.fraction - angle / 0.8).abs() < 1e-9, "{} {}", contact.fraction, angle / 0.8);
    assert_eq!(contact.sides[1], BoxSide::Right);
    // The corner reaches at most √5 m = 2.236 m, so it never touches a wall at 2.3 m. A wall just
    // beyond √5 m stays untouched; one just below it is touched.
    let at = |y_m: f64| OrientedBox { y_m: y_m + 0.5, ..wall };
    let touches = |y_m: f64| first_contact(&CAR, &car(0.0, 0.0, 2.0), &at(y_m), &at(y_m)).is_some();
    assert!(!touches(5.0_f64.sqrt() + 1e-9) && touches(5.0_f64.sqrt() - 1e-9));
}

#[test]
fn the_yaw_turns_in_the_direction_of_the_smaller_angle() {
    let wall = OrientedBox { x_m: 0.0, y_m: 2.3, yaw_rad: 0.0, length_m: 50.0, width_m: 1.0 };
    assert!(first_contact(&car(0.0, 0.0, PI - 0.01), &car(0.0, 0.0, 0.01 - PI), &wall, &wall).is_none());
}

#[test]
fn a_thin_box_cannot_tunnel() {
    let wall = OrientedBox { length_m: 1e-3, width_m: 10.0, x_m: 50.0, ..CAR };
    let contact = first_contact(&CAR, &car(100.0, 0.0, 0.0), &wall, &wall).unwrap();
    assert!((contact.fraction - (48.0 - 0.5e-3) / 100.0).abs() < 1e-15);
}

#[test]
fn vehicles_that_meet_head_on_cannot_tunnel() {
    // At 70 m/s each, they pass through each other within a tenth of a second.
    let (oncoming, from, to) = (car(13.0, 0.5, PI), car(0.0, 0.0, 0.0), car(7.0, 0.0, 0.0));
    let contact = first_contact(&from, &to, &oncoming, &car(6.0, 0.5, PI)).unwrap();
    assert!((contact.fraction - 9.0 / 14.0).abs() < 1e-12);
    assert_eq!(contact.sides, [BoxSide::Front; 2]);
    // They are apart at both ends of the step.
    let contact = first_contact(&from, &car(20.0, 0.0, 0.0), &oncoming, &car(-7.0, 0.5, PI)).unwrap();
    assert!((contact.fraction - 9.0 / 40.0).abs() < 1e-12);
}

#[test]
fn a_tail_that_swings_out_and_back_within_a_step_touches() {
    // The corner of a truck rises by 0.01 m above the lower side of a wall half-way through the
    // step.
    let truck = |yaw_rad: f64| OrientedBox { yaw_rad, length_m: 16.0, width_m: 2.5, ..CAR };
    let upright = FRAC_PI_2 - maths::atan(1.25 / 8.0_f64);
    let reach_m = truck(0.0).radius_m();
    let wall = |clearance_m: f64| OrientedBox { y_m: reach_m + clearance_m + 0.5, length_m: 50.0, width_m: 1.0, ..CAR };
    let swings = |clearance_m: f64| {
        let wall = wall(clearance_m);
        let [from, to] = [truck(upright - 0.1), truck(upright + 0.1)];
        assert!(from.distance_m(&wall) > 0.02 && to.distance_m(&wall) > 0.02, "apart at both ends");
        first_contact(&from, &to, &wall, &wall)
    };
    assert_eq!(swings(1e-6), None);
    assert_eq!(swings(-0.01).unwrap().sides[1], BoxSide::Right);
    assert!(swings(-1e-6).is_some());
}

#[test]
fn parallel_vehicles_that_pass_a_millimetre_apart_do_not_touch() {
    for gap_m in [1e-3, 1e-6] {
        for yaw_rad in [0.0, 0.3, FRAC_PI_2, 2.0] {
            let pass = |gap_m: f64| {
                let [from, to] = [car(-8.0, 2.0 + gap_m, 0.0), car(9.0, 2.0 + gap_m, 0.0)];
                let [from, to, standing] =
                    [from, to, CAR].map(|at| transformed(&at, yaw_rad, Vector2::new(900.0, -5.0)));
                first_contact(&from, &to, &standing, &standing)
            };
            assert_eq!(pass(gap_m), None);
            assert!(pass(-gap_m).is_some());
        }
    }
}

#[test]
fn edges_that_touch_are_in_contact() {
    assert!(CAR.overlaps(&car(0.0, 2.0, 0.0)));
    assert!(!CAR.overlaps(&car(0.0, 2.0 + 1e-15, 0.0)), "the next numbers do not touch");
    let contact = first_contact(&CAR, &car(0.5, 0.0, 0.0), &car(0.0, 2.0, 0.0), &car(0.0, 2.0, 0.0)).unwrap();
    assert_eq!((contact.fraction, contact.sides), (0.0, [BoxSide::Left, BoxSide::Right]));
}

#[test]
fn corners_that_pass_a_millimetre_apart_do_not_touch() {
    // The front right corner of a car that moves away to the left passes the rear left corner of
    // the car ahead. parry's cast (`cast_shapes_nonlinear`) reports a contact half-way through the
    // step.
    let ahead = car(5.0, 0.0, 0.0);
    let passes = |beside_m: f64| {
        let y_m = 1.0 + beside_m;
        first_contact(&car(0.0, y_m, 0.0), &car(2.0, y_m + 2.0, 0.0), &ahead, &ahead)
    };
    assert_eq!(passes(1e-3), None);
    assert_eq!(passes(-1e-3).unwrap().sides, [BoxSide::Front, BoxSide::Rear]);
    // A square on its corner passes the corner of the car.
    let square = |x_m: f64, y_m: f64| OrientedBox { x_m, y_m, yaw_rad: FRAC_PI_4, length_m: 2.0, width_m: 2.0 };
    let passes = |gap_m: f64| {
        let (x_m, y_m) = (2.0 + 1.0 / SQRT_2 + gap_m / SQRT_2, 1.0 + 1.0 / SQRT_2 + gap_m / SQRT_2);
        first_contact(&square(x_m - 3.0, y_m + 3.0), &square(x_m + 3.0, y_m - 3.0), &CAR, &CAR)
    };
    assert_eq!(passes(1e-3), None);
    assert!(passes(-1e-3).is_some());
}

#[test]
fn boxes_that_overlap_at_the_start_touch_at_once_on_the_sides_that_overlap_least() {
    let behind = car(-3.9, 0.5, 0.0);
    let contact = first_contact(&behind, &car(-10.0, 0.5, 0.0), &CAR, &CAR).unwrap();
    assert_eq!((contact.fraction, contact.sides), (0.0, [BoxSide::Front, BoxSide::Rear]));
    let beside = car(1.0, -1.9, 0.0);
    let contact = first_contact(&beside, &beside, &CAR, &CAR).unwrap();
    assert_eq!((contact.fraction, contact.sides), (0.0, [BoxSide::Left, BoxSide::Right]));
    assert_eq!(first_contact(&CAR, &CAR, &CAR, &CAR).map(|contact| contact.fraction), Some(0.0), "the same place");
}

#[test]
fn contact_at_the_ends_of_the_step_counts() {
    let ahead = car(4.0, 0.0, 0.0);
    assert_eq!(first_contact(&CAR, &CAR, &ahead, &ahead).map(|contact| contact.fraction), Some(0.0));
    let later = car(6.0, 0.0, 0.0);
    assert_eq!(first_contact(&CAR, &car(2.0, 0.0, 0.0), &later, &later).map(|contact| contact.fraction), Some(1.0));
    assert_eq!(first_contact(&CAR, &car(1.999, 0.0, 0.0), &later, &later), None);
}

#[test]
fn nan_is_a_contact() {
    let far = car(100.0, 50.0, 0.1);
    let ends = [car(f64::NAN, 0.0, 0.0), car(0.0, f64::NAN, 0.0), car(0.0, 0.0, f64::NAN)];
    for unknown in ends {
        // The circumscribed circles either overlap or are not known to be apart.
        assert!(first_contact(&CAR, &unknown, &car(3.0, 3.0, 0.0), &car(3.0, 3.0, 0.0)).is_some(), "{unknown:?}");
        assert!(first_contact(&unknown, &CAR, &car(3.0, 3.0, 0.0), &car(3.0, 3.0, 0.0)).is_some(), "{unknown:?}");
    }
    assert!(first_contact(&CAR, &car(f64::NAN, f64::NAN, 0.0), &far, &far).is_some());
}

#[test]
fn sides_are_written_in_kebab_case() {
    let read = |word: &str| BoxSide::deserialize(IntoDeserializer::<value::Error>::into_deserializer(word));
    assert_eq!(["front", "rear", "left", "right"].map(read), BoxSide::ALL.map(Ok));
}

proptest! {
    #[test]
    fn distance_agrees_with_brute_force(a in any_box(), b in any_box()) {
        let distance = a.distance_m(&b);
        prop_assert!((distance - brute_force_distance_m(&a, &b)).abs() < 1e-9);
        prop_assert_eq!(a.overlaps(&b), distance == 0.0);
    }

    #[test]
    fn distance_does_not_depend_on_order_frame_or_handedness(
        a in any_box(), b in any_box(), turn in -PI..PI, x in -500.0..500.0, y in -500.0..500.0,
    ) {
        let distance = a.distance_m(&b);
        let shift = Vector2::new(x, y);
        prop_assert!((distance - b.distance_m(&a)).abs() < 1e-9);
        prop_assert!((distance - mirrored(&a).distance_m(&mirrored(&b))).abs() < 1e-9);
        let moved = transformed(&a, turn, shift).distance_m(&transformed(&b, turn, shift));
        prop_assert!((distance - moved).abs() < 1e-9);
    }

    #[test]
    fn first_contact_agrees_with_a_dense_scan((a0, a1) in any_step(), (b0, b1) in any_step()) {
        const STEPS: u32 = 400;
        let distance_at = |fraction| brute_force_distance_m(&between(&a0, &a1, fraction), &between(&b0, &b1, fraction));
        let contact = first_contact(&a0, &a1, &b0, &b1);
        let free_until = contact.map_or(1.0, |contact| contact.fraction);
        for step in 0..=STEPS {
            let fraction = f64::from(step) / f64::from(STEPS);
            if fraction < free_until - 1e-9 {
                prop_assert!(distance_at(fraction) > 0.0, "missed a contact at {fraction}, found {contact:?}");
            }
        }
        if let Some(contact) = contact {
            prop_assert!(distance_at(contact.fraction) < 1e-9, "apart at the contact");
        }
    }

    #[test]
    fn a_slight_graze_is_a_contact_and_a_near_miss_is_not(
        yaw in -PI..PI, turn in -0.2..0.2_f64, half_way in 1.0..20.0_f64, x_m in -1.5..1.5, depth in 1e-8..1e-3_f64,
    ) {
        // A car turns while it moves in a straight line along a long wall. Its outermost corner
        // either dips `depth` into the wall at one instant or stays as far away from it.
        let long = OrientedBox { x_m, y_m: 0.0, yaw_rad: 0.0, length_m: 200.0, width_m: 0.2 };
        let outermost = |fraction: f64| {
            let shape = car(0.0, 0.0, yaw + fraction * turn);
            shape.corners_m().iter().fold(0.0_f64, |reach, corner| reach.max(corner.y))
        };
        let peak = (0..=20_000).map(|i| outermost(f64::from(i) / 20_000.0)).fold(0.0, f64::max);
        let passes_at = |distance: f64| {
            let y_m = -(0.1 + peak + distance);
            first_contact(&car(-half_way, y_m, yaw), &car(half_way, y_m, yaw + turn), &long, &long).is_some()
        };
        prop_assert!(passes_at(-depth));
        prop_assert!(!passes_at(depth + 1e-8));
    }

    #[test]
    fn first_contact_does_not_depend_on_order_frame_or_handedness(
        (a0, a1) in any_step(), (b0, b1) in any_step(), turn in -PI..PI, x in -500.0..500.0,
    ) {
        let fraction = |contact: Option<Contact>| contact.map(|contact| contact.fraction);
        let near = |first: Option<f64>, second: Option<f64>| match (first, second) {
            (Some(first), Some(second)) => (first - second).abs() < 1e-7,
            (first, second) => first == second,
        };
        let contact = first_contact(&a0, &a1, &b0, &b1);
        let swapped = first_contact(&b0, &b1, &a0, &a1);
        let image = first_contact(&mirrored(&a0), &mirrored(&a1), &mirrored(&b0), &mirrored(&b1));
        let moved = [a0, a1, b0, b1].map(|shape| transformed(&shape, turn, Vector2::new(x, 3.0)));
        let moved = first_contact(&moved[0], &moved[1], &moved[2], &moved[3]);
        for other in [swapped, image, moved] {
            prop_assert!(near(fraction(contact), fraction(other)), "{contact:?} {other:?}");
        }
        if let (Some(contact), Some(image), Some(swapped)) = (contact, image, swapped) {
            prop_assert_eq!(contact.sides.map(BoxSide::mirrored), image.sides);
            prop_assert_eq!([contact.sides[1], contact.sides[0]], swapped.sides);
        }
    }
}
