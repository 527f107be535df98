//! Time to and distance at the closest encounter of two vehicles that stay on a road with lanes.
//!
//! A constant velocity carries a vehicle that changes lanes beyond its new lane, where it meets
//! vehicles that it will never come near. Here a vehicle keeps its speed along the road. Across the
//! road it keeps its speed only until it *settles*, and its lateral position from then on:
//!
//! ```text
//!   d ▲            settles                  one lane further: only a constant velocity leads there
//!     │              ●────────────────▶
//!     │          ╱
//!     │      ╱
//!     │  ●                                  x = s, along the road;  y = d, across the road
//!     └────────────────────────────────▶ s
//! ```
//!
//! The closest encounter is defined for any motion model: DCE(t) = min d(p₁(t + τ), p₂(t + τ)) over
//! τ ≥ 0 (J. Eggert, *Predictive risk estimation for intelligent ADAS functions*, ITSC 2014; L.
//! Westhofen et al., *Criticality Metrics for Automated Driving: A Review and Suitability
//! Analysis*, Archives of Computational Methods in Engineering, 2023, which call the model the
//! dynamic motion model). In the classes of S. Lefèvre et al. (*A survey on motion prediction and
//! risk assessment for intelligent vehicles*, ROBOMECH Journal, 2014), a constant velocity is a
//! physics-based motion model. The model of this module is a manoeuvre-based one: keep the lane, or
//! complete the lane change.
//!
//! Both movements are linear between the instants at which a vehicle settles. Each such phase has
//! the exact closest encounter of [`closest_encounter`]; the result is the nearest of them.

use super::plane::{Encounter, Moving, closest_encounter};
use crate::Absent;
use crate::geometry::OrientedBox;

/// A box that keeps its speed along the x axis, and its speed along the y axis until it settles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settling {
    /// The box and its velocity at the present time; x is the direction of the road.
    pub moving: Moving,
    /// Time after which the box keeps its lateral position and points along the road (s): 0 if it
    /// does already, infinite if it never does.
    pub settles_after_s: f64,
}

impl Settling {
    /// Returns the box at a time, and its velocity from then on.
    fn at(&self, time_s: f64) -> Moving {
        let is_settled = time_s >= self.settles_after_s;
        let Moving { shape, vx_mps, vy_mps } = self.moving;
        let y_m = shape.y_m + vy_mps * time_s.min(self.settles_after_s);
        let (yaw_rad, vy_mps) = if is_settled { (0.0, 0.0) } else { (shape.yaw_rad, vy_mps) };
        let shape = OrientedBox { x_m: shape.x_m + vx_mps * time_s, y_m, yaw_rad, ..shape };
        Moving { shape, vx_mps, vy_mps }
    }
}

/// Computes the time and distance of the closest encounter of two boxes that stay on a road.
///
/// It is the first time within `horizon_s` (s, above 0) at which the distance is smallest. On a
/// collision course it is the first contact, with a distance of 0. If both boxes never settle, the
/// result is the one of [`closest_encounter`].
///
/// # Errors
/// [`Absent::NotApproaching`] if the distance never falls below the present one;
/// [`Absent::BeyondHorizon`] if it is smallest at the horizon, where it still shrinks.
pub fn curvilinear_encounter(a: &Settling, b: &Settling, horizon_s: f64) -> Result<Encounter, Absent> {
    let (first_s, second_s) = (a.settles_after_s.min(b.settles_after_s), a.settles_after_s.max(b.settles_after_s));
    let mut nearest: Option<(Encounter, Result<(), Absent>)> = None;
    for [start_s, end_s] in [[0.0, first_s], [first_s, second_s], [second_s, f64::INFINITY]] {
        let end_s = end_s.min(horizon_s);
        if !(start_s < end_s) {
            continue;
        }
        let (a, b) = (a.at(start_s), b.at(start_s));
        let (after_s, distance_m, reason) = match closest_encounter(&a, &b, end_s - start_s) {
            Ok(Encounter { ttce_s, dce_m }) => (ttce_s, dce_m, Ok(())),
            Err(Absent::BeyondHorizon) => {
                let reason = if end_s < horizon_s { Ok(()) } else { Err(Absent::BeyondHorizon) };
                (end_s - start_s, after(&a, end_s - start_s).distance_m(&after(&b, end_s - start_s)), reason)
            }
            Err(reason) => (0.0, a.shape.distance_m(&b.shape), if start_s > 0.0 { Ok(()) } else { Err(reason) }),
        };
        if nearest.is_none_or(|(nearest, _)| distance_m < nearest.dce_m) {
            nearest = Some((Encounter { ttce_s: start_s + after_s, dce_m: distance_m }, reason));
        }
    }
    match nearest {
        Some((encounter, reason)) => reason.map(|()| encounter),
        None => Err(Absent::BeyondHorizon),
    }
}

/// Returns a box after it has kept its velocity for a time.
fn after(moving: &Moving, time_s: f64) -> OrientedBox {
    let Moving { shape, vx_mps, vy_mps } = moving;
    OrientedBox { x_m: shape.x_m + vx_mps * time_s, y_m: shape.y_m + vy_mps * time_s, ..*shape }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const HORIZON_S: f64 = 10.0;

    /// A car of 4 m by 2 m that points along the road.
    fn car(x_m: f64, y_m: f64, vx_mps: f64, vy_mps: f64) -> Moving {
        Moving { shape: OrientedBox { x_m, y_m, yaw_rad: 0.0, length_m: 4.0, width_m: 2.0 }, vx_mps, vy_mps }
    }

    fn settling(moving: Moving, settles_after_s: f64) -> Settling {
        Settling { moving, settles_after_s }
    }

    fn distance_after_m(a: &Settling, b: &Settling, time_s: f64) -> f64 {
        a.at(time_s).shape.distance_m(&b.at(time_s).shape)
    }

    #[test]
    fn a_vehicle_in_the_lane_beyond_the_next_one_is_no_collision_course() {
        // The ego moves by 3.5 m to the left within 3.5 s. Another car, 10 m/s slower, drives two
        // lanes further left, 45 m ahead.
        let ego = car(0.0, -8.75, 30.0, 1.0);
        let other = settling(car(45.0, -1.75, 20.0, 0.0), 0.0);
        let straight = closest_encounter(&ego, &other.moving, HORIZON_S).unwrap();
        let along = curvilinear_encounter(&settling(ego, 3.5), &other, HORIZON_S).unwrap();
        // With a constant velocity the ego is 2.25 m further left when it has overtaken the car by
        // its length, at 4.9 s: 7 - 4.9 - 2 = 0.1 m. Settled, both pass with a lane between them
        // from the moment at which the front of the ego reaches the rear of the other, at 4.1 s:
        // 3.5 - 2 = 1.5 m.
        assert!((straight.dce_m - 0.1).abs() < 0.02, "{straight:?}");
        assert!((along.dce_m - 1.5).abs() < 1e-12 && (along.ttce_s - 4.1).abs() < 1e-9, "{along:?}");
    }

    #[test]
    fn a_vehicle_in_the_new_lane_is_reached_in_closed_form() {
        // The ego reaches the rear of the car ahead in its new lane after (45 - 4) / 10 s.
        let ego = settling(car(0.0, -5.25, 30.0, 1.0), 3.5);
        let ahead = settling(car(45.0, -1.75, 20.0, 0.0), 0.0);
        assert_eq!(curvilinear_encounter(&ego, &ahead, HORIZON_S), Ok(Encounter { ttce_s: 4.1, dce_m: 0.0 }));
    }

    #[test]
    fn vehicles_of_the_same_speed_are_nearest_where_the_last_one_settles() {
        // Side by side at the same speed, two lanes apart, each moves a metre towards the other:
        // one in 1 s, the other in 4 s.
        let one = settling(car(0.0, 0.0, 30.0, 1.0), 1.0);
        let other = settling(car(1.0, 7.0, 30.0, -0.25), 4.0);
        let encounter = curvilinear_encounter(&one, &other, HORIZON_S).unwrap();
        assert!((encounter.ttce_s - 4.0).abs() < 1e-9 && (encounter.dce_m - 3.0).abs() < 1e-9, "{encounter:?}");
        // Nobody settles before the horizon, at which they still approach.
        let early = curvilinear_encounter(&one, &other, 3.0);
        assert_eq!(early, Err(Absent::BeyondHorizon));
    }

    #[test]
    fn vehicles_that_drive_apart_do_not_approach_and_touching_ones_touch() {
        let ahead = settling(car(20.0, 0.0, 35.0, 0.0), 0.0);
        let behind = settling(car(0.0, 0.0, 30.0, 0.0), 0.0);
        assert_eq!(curvilinear_encounter(&behind, &ahead, HORIZON_S), Err(Absent::NotApproaching));
        let alike = settling(car(20.0, 0.0, 30.0, 0.0), 0.0);
        assert_eq!(curvilinear_encounter(&behind, &alike, HORIZON_S), Err(Absent::NotApproaching));
        let touching = settling(car(3.0, 0.5, 30.0, 0.3), 2.0);
        let encounter = curvilinear_encounter(&behind, &touching, HORIZON_S);
        assert_eq!(encounter, Ok(Encounter { ttce_s: 0.0, dce_m: 0.0 }));
    }

    #[test]
    fn a_settled_vehicle_ignores_its_lateral_speed_and_points_along_the_road() {
        let swaying = Moving {
            shape: OrientedBox { yaw_rad: 0.2, ..car(0.0, 0.0, 30.0, 2.0).shape },
            ..car(0.0, 0.0, 30.0, 2.0)
        };
        let beside = settling(car(10.0, 5.0, 20.0, 0.0), 0.0);
        let encounter = curvilinear_encounter(&settling(swaying, 0.0), &beside, HORIZON_S).unwrap();
        assert!((encounter.ttce_s - 0.6).abs() < 1e-9 && (encounter.dce_m - 3.0).abs() < 1e-9, "{encounter:?}");
    }

    prop_compose! {
        fn any_settling()(
            x_m in -60.0..60.0, y_m in -15.0..15.0, yaw_rad in -0.3..0.3, length_m in 1.0..17.0,
            width_m in 0.5..3.0, vx_mps in 0.0..40.0, vy_mps in -3.0..3.0, settles_after_s in 0.0..12.0,
        ) -> Settling {
            let shape = OrientedBox { x_m, y_m, yaw_rad, length_m, width_m };
            Settling { moving: Moving { shape, vx_mps, vy_mps }, settles_after_s }
        }
    }

    proptest! {
        #[test]
        fn boxes_that_never_settle_have_the_encounter_of_a_constant_velocity(a in any_settling(), b in any_settling()) {
            let forever = |settling: Settling| Settling { settles_after_s: f64::INFINITY, ..settling };
            let along = curvilinear_encounter(&forever(a), &forever(b), HORIZON_S);
            prop_assert_eq!(along, closest_encounter(&a.moving, &b.moving, HORIZON_S));
        }

        #[test]
        fn no_instant_is_nearer_and_the_order_of_the_boxes_does_not_matter(a in any_settling(), b in any_settling()) {
            let steps = (0..=1_000).map(|step| distance_after_m(&a, &b, 0.01 * f64::from(step)));
            let nearest_m = steps.fold(f64::INFINITY, f64::min);
            match curvilinear_encounter(&a, &b, HORIZON_S) {
                Ok(Encounter { dce_m, ttce_s }) => {
                    prop_assert!(dce_m <= nearest_m + 1e-6, "{dce_m} at {ttce_s}, {nearest_m}");
                    // A box turns when it settles: its distance jumps there, by less than its
                    // length.
                    let slack_m = 0.01 * 50.0 + 0.3 * (a.moving.shape.length_m + b.moving.shape.length_m);
                    prop_assert!(nearest_m <= dce_m + slack_m, "{dce_m} at {ttce_s}, {nearest_m}");
                }
                Err(Absent::NotApproaching) => {
                    prop_assert!(distance_after_m(&a, &b, 0.0) <= nearest_m + 1e-6);
                }
                Err(_) => {
                    prop_assert!(distance_after_m(&a, &b, HORIZON_S) <= nearest_m + 1e-6);
                }
            }
            let swapped = curvilinear_encounter(&b, &a, HORIZON_S);
            match (curvilinear_encounter(&a, &b, HORIZON_S), swapped) {
                (Ok(one), Ok(other)) => prop_assert!((one.dce_m - other.dce_m).abs() < 1e-8),
                (one, other) => prop_assert_eq!(one, other),
            }
        }
    }
}
