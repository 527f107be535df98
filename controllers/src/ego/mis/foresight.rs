//! The smallest braking that reaches the goal, with the time that braking takes to build up.
//!
//! [`Encounter`] has the solution in closed form for braking that is there at once. With a [`Response`] the arrival solves
//! D = Δv·t + W(t), a convex function that Newton's method follows from the immediate arrival in a few steps; and the
//! braking is bracketed between one that misses the goal and one that reaches it.
//!
//! Where R is at least as fast as F, which is the case the system exists for, the headway at arrival grows with the
//! braking, beyond all bounds until E stands, so that the bound itself tells whether any braking does. Where F is faster still, it need not: then the range
//! is gone through from its lower end, and the first braking that reaches the goal is bracketed.

use super::response::Response;
use super::{Encounter, Solution};

/// Where the headway at arrival may fall with the braking, the range is gone through in this many parts.
const PARTS: u32 = 64;

/// Halvings of the bracket: to 10⁻⁹ of the bound.
const HALVINGS: u32 = 30;

/// Steps of Newton's method; four are needed to the last digit from anywhere.
const STEPS: u32 = 12;

/// Change of the arrival below which it counts as found [s].
const FOUND_WITHIN_S: f64 = 1e-10;

/// An encounter, and how E's braking builds up in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Foresight {
    /// E between F and R, now.
    pub encounter: Encounter,
    /// How E's braking builds up from now.
    pub response: Response,
}

impl Foresight {
    /// The time until R reaches the critical distance, with E braking up to `deceleration_mps2` [s].
    ///
    /// Nothing where R never comes.
    pub fn arrival_s(&self, deceleration_mps2: f64) -> Option<f64> {
        let Encounter { closing_mps, .. } = self.encounter;
        let way_m = self.encounter.way_m();
        let mut time_s = self.encounter.arrival_s(deceleration_mps2)?;
        for _ in 0..STEPS {
            let lost = self.response.lost(deceleration_mps2, time_s);
            let rate_mps = closing_mps + lost.speed_mps;
            if !(rate_mps > 0.0) {
                return None;
            }
            let next_s = (time_s - (closing_mps * time_s + lost.way_m - way_m) / rate_mps).max(0.0);
            let step_s = (next_s - time_s).abs();
            time_s = next_s;
            if step_s < FOUND_WITHIN_S {
                return Some(time_s);
            }
        }
        // Written so that what does not settle, NaN above all, is no arrival.
        None
    }

    /// The front time headway when R arrives, with E braking up to `deceleration_mps2` [s].
    ///
    /// Nothing where R never comes, or E stands before.
    pub fn headway_at_arrival_s(&self, deceleration_mps2: f64) -> Option<f64> {
        let (gap_m, speed_mps) = self.at_arrival(deceleration_mps2)?;
        (speed_mps > 0.0).then(|| gap_m / speed_mps)
    }

    /// Gap to F, and E's speed, when R arrives; a speed below 0 says that E stands before.
    fn at_arrival(&self, deceleration_mps2: f64) -> Option<(f64, f64)> {
        let Encounter { ego_mps, front_gap_m, front_mps, .. } = self.encounter;
        let time_s = self.arrival_s(deceleration_mps2)?;
        let lost = self.response.lost(deceleration_mps2, time_s);
        Some((front_gap_m + (front_mps - ego_mps) * time_s + lost.way_m, ego_mps - lost.speed_mps))
    }

    /// The smallest braking up to `bound_mps2` with which the front headway is `goal_s` or more when R arrives.
    ///
    /// Nothing where R does not approach: then there is no encounter to prepare for.
    pub fn solve(&self, goal_s: f64, bound_mps2: f64) -> Option<Solution> {
        if !(self.encounter.closing_mps > 0.0) {
            return None;
        }
        if self.reaches(goal_s, 0.0) {
            return Some(Solution { deceleration_mps2: 0.0, in_reach: true });
        }
        let Encounter { ego_mps, closing_mps, front_mps, .. } = self.encounter;
        let parts = if ego_mps + closing_mps >= front_mps { 1 } else { PARTS };
        let at = |part: u32| bound_mps2 * f64::from(part) / f64::from(parts);
        let part = (1..=parts).find(|part| self.reaches(goal_s, at(*part)));
        Some(match part {
            Some(part) => Solution { deceleration_mps2: self.bracket(goal_s, at(part - 1), at(part)), in_reach: true },
            None => Solution { deceleration_mps2: bound_mps2, in_reach: false },
        })
    }

    /// True where this braking is enough, or more than enough: on the way to a standstill every headway is passed.
    fn reaches(&self, goal_s: f64, deceleration_mps2: f64) -> bool {
        let enough = |(gap_m, speed_mps)| speed_mps <= 0.0 || gap_m / speed_mps >= goal_s;
        self.at_arrival(deceleration_mps2).is_some_and(enough)
    }

    /// The least braking that reaches the goal, between one that does not and one that does.
    fn bracket(&self, goal_s: f64, mut too_little: f64, mut enough: f64) -> f64 {
        for _ in 0..HALVINGS {
            let middle = 0.5 * (too_little + enough);
            if self.reaches(goal_s, middle) { enough = middle } else { too_little = middle }
        }
        enough
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The comfort limit's build-up, and a car's actuators.
    const CAR: Response =
        Response { asked_mps2: 0.0, braking_mps2: 0.0, build_up_mps3: 2.0, let_go_mps3: 3.0, lag_s: 0.15 };

    prop_compose! {
        fn encounters()(
            ego_mps in 15.0..40.0, thw in 0.3..1.5, front in -3.0..3.0, rear_gap_m in 6.0..120.0, closing_mps in 0.5..20.0,
        ) -> Encounter {
            Encounter {
                ego_mps, front_gap_m: thw * ego_mps, front_mps: ego_mps + front, rear_gap_m, closing_mps,
                critical_gap_m: 5.0,
            }
        }
    }

    prop_compose! {
        fn responses()(asked in 0.0..1.5, now in -0.5..1.5) -> Response {
            Response { asked_mps2: asked, braking_mps2: now, ..CAR }
        }
    }

    /// The front headway when R arrives, by stepping E, F and R through time, a hundred times a second.
    fn stepped(foresight: &Foresight, aim: f64) -> Option<f64> {
        let Foresight { encounter, response } = foresight;
        let step_s = 0.01;
        let (mut asked, mut braking) = (response.asked_mps2, response.braking_mps2);
        let (mut ego_mps, mut front_m, mut rear_m) = (encounter.ego_mps, encounter.front_gap_m, encounter.rear_gap_m);
        let rear_mps = encounter.ego_mps + encounter.closing_mps;
        let fading = (-step_s / response.lag_s).exp();
        for _ in 0..100_000 {
            if ego_mps <= 0.0 || rear_mps <= ego_mps {
                return None;
            }
            let before = (ego_mps, front_m, rear_m);
            let next = if aim > asked {
                (asked + response.build_up_mps3 * step_s).min(aim)
            } else {
                (asked - response.let_go_mps3 * step_s).max(aim)
            };
            let (middle, was) = (0.5 * (asked + next), braking);
            asked = next;
            braking = middle + (braking - middle) * fading;
            ego_mps -= 0.5 * (was + braking) * step_s;
            let mean_mps = 0.5 * (before.0 + ego_mps);
            front_m += (encounter.front_mps - mean_mps) * step_s;
            rear_m -= (rear_mps - mean_mps) * step_s;
            if rear_m <= encounter.critical_gap_m {
                let share = (before.2 - encounter.critical_gap_m) / (before.2 - rear_m);
                let between = |from: f64, to: f64| from + share * (to - from);
                return Some(between(before.1, front_m) / between(before.0, ego_mps));
            }
        }
        None
    }

    /// What a scan of braking says of a goal. A scan cannot tell where a headway within its own error of the goal is.
    #[derive(Debug, PartialEq)]
    enum Scanned {
        Reached,
        Missed,
        Close,
    }

    fn scan(foresight: &Foresight, goal_s: f64, bound: f64) -> Scanned {
        let error_s = 5e-3;
        let best = (0..=40)
            .filter_map(|step| stepped(foresight, bound * f64::from(step) / 40.0))
            .fold(f64::NEG_INFINITY, f64::max);
        if best >= goal_s + error_s {
            Scanned::Reached
        } else if best < goal_s - error_s {
            Scanned::Missed
        } else {
            Scanned::Close
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(10_000))]

        /// Where R is as fast as F or faster, as in every state from which the system engages.
        #[test]
        fn the_reachable_set_is_that_of_a_scan(
            encounter in encounters(), response in responses(), gain in 0.1..3.0, bound in 0.5..3.0,
        ) {
            prop_assume!(encounter.ego_mps + encounter.closing_mps >= encounter.front_mps);
            let foresight = Foresight { encounter, response };
            let goal = encounter.front_gap_m / encounter.ego_mps + gain;
            let solution = foresight.solve(goal, bound).unwrap();
            prop_assert!((0.0..=bound).contains(&solution.deceleration_mps2));
            match scan(&foresight, goal, bound) {
                Scanned::Reached => prop_assert!(solution.in_reach, "{solution:?}"),
                Scanned::Missed => prop_assert!(!solution.in_reach, "{solution:?}"),
                Scanned::Close => {}
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2_000))]

        #[test]
        fn immediate_braking_is_the_closed_form(encounter in encounters(), gain in 0.1..3.0, bound in 0.5..3.0) {
            prop_assume!(encounter.ego_mps + encounter.closing_mps >= encounter.front_mps);
            let goal = encounter.front_gap_m / encounter.ego_mps + gain;
            let closed = encounter.solve(goal, bound).unwrap();
            let bracketed = Foresight { encounter, response: Response::IMMEDIATE }.solve(goal, bound).unwrap();
            prop_assert!((closed.deceleration_mps2 - bracketed.deceleration_mps2).abs() < 1e-6, "{closed:?} {bracketed:?}");
        }

        #[test]
        fn what_builds_up_slowly_never_needs_less(encounter in encounters(), gain in 0.1..3.0) {
            prop_assume!(encounter.ego_mps + encounter.closing_mps >= encounter.front_mps);
            let goal = encounter.front_gap_m / encounter.ego_mps + gain;
            let at_once = encounter.solve(goal, 3.0).unwrap();
            let slowly = Foresight { encounter, response: CAR }.solve(goal, 3.0).unwrap();
            prop_assert!(slowly.deceleration_mps2 >= at_once.deceleration_mps2 - 1e-6, "{slowly:?} {at_once:?}");
        }

        #[test]
        fn it_meets_the_goal_exactly_with_the_smallest_braking(
            encounter in encounters(), response in responses(), gain in 0.1..3.0,
        ) {
            let foresight = Foresight { encounter, response };
            let goal = encounter.front_gap_m / encounter.ego_mps + gain;
            let Solution { deceleration_mps2, in_reach } = foresight.solve(goal, 9.0).unwrap();
            if in_reach && deceleration_mps2 > 1e-6 {
                let headway = foresight.headway_at_arrival_s(deceleration_mps2).unwrap();
                prop_assert!((headway - goal).abs() < 1e-5, "{headway} {goal}");
            }
        }

        #[test]
        fn a_higher_goal_never_needs_less_and_one_already_met_needs_nothing(
            encounter in encounters(), response in responses(), gain in 0.0..3.0, more in 0.0..1.0,
        ) {
            prop_assume!(encounter.ego_mps + encounter.closing_mps >= encounter.front_mps);
            let foresight = Foresight { encounter, response };
            let goal = encounter.front_gap_m / encounter.ego_mps + gain;
            let low = foresight.solve(goal, 3.0).unwrap();
            let high = foresight.solve(goal + more, 3.0).unwrap();
            prop_assert!(high.deceleration_mps2 >= low.deceleration_mps2 - 1e-9);
            if let Some(met) = foresight.headway_at_arrival_s(0.0) {
                let solution = foresight.solve(met, 1.0).unwrap();
                prop_assert_eq!(solution, Solution { deceleration_mps2: 0.0, in_reach: true });
            }
        }
    }

    #[test]
    fn what_is_not_a_number_is_out_of_reach() {
        let encounter = Encounter {
            ego_mps: 30.0,
            front_gap_m: 21.0,
            front_mps: 30.0,
            rear_gap_m: 100.0,
            closing_mps: 24.0 / 3.6,
            critical_gap_m: 5.0,
        };
        for broken in
            [Encounter { front_gap_m: f64::NAN, ..encounter }, Encounter { rear_gap_m: f64::NAN, ..encounter }]
        {
            let solution = Foresight { encounter: broken, response: CAR }.solve(2.7, 1.0).unwrap();
            assert_eq!(solution, Solution { deceleration_mps2: 1.0, in_reach: false });
        }
        let broken = Response { braking_mps2: f64::NAN, ..CAR };
        assert!(!Foresight { encounter, response: broken }.solve(2.7, 1.0).unwrap().in_reach);
        assert_eq!(
            Foresight { encounter: Encounter { closing_mps: f64::NAN, ..encounter }, response: CAR }.solve(2.7, 1.0),
            None
        );
    }
}
