//! The smallest braking that reaches the goal, taking into account that braking builds up over
//! time.
//!
//! [`Encounter`] has the closed-form solution for braking that takes effect at once. With a
//! [`BrakingResponse`], the arrival time solves D = Δv·t + W(t), where D is the distance to the
//! critical gap, Δv the closing speed and W the ego's loss of distance. Newton's method finds the
//! root of this convex function within a few steps, starting from the closed-form arrival.
//! Bisection then narrows the braking between a value that misses the goal and a value that reaches
//! it.
//!
//! If the rear vehicle is at least as fast as the lead vehicle, which is the case that the system
//! is built for, the headway at arrival grows with the braking, without limit until the ego stops.
//! Evaluating the bound alone then tells whether any braking reaches the goal. If the lead vehicle
//! is faster still, the headway may fall with the braking. The range is then scanned from its lower
//! end, and the first braking that reaches the goal is bracketed.

use super::response::{BrakingResponse, BuildUp};
use super::{Encounter, Solution};

/// Number of parts in which the range is scanned if the headway at arrival may fall with the
/// braking.
const SCAN_PARTS: u32 = 64;

/// Bisection steps: to 10⁻⁹ of the bound.
const BISECTION_STEPS: u32 = 30;

/// Largest number of steps of the secant method.
const SECANT_STEPS: u32 = 14;

/// Change of the estimate at which the secant method ends, in cells of bisection.
const SECANT_TOLERANCE: f64 = 0.01;

/// Largest number of steps of Newton's method; four are enough for full precision from any start.
const NEWTON_STEPS: u32 = 12;

/// Change of the arrival time below which it counts as found (s).
const ARRIVAL_TOLERANCE_S: f64 = 1e-10;

/// Prediction of the rear vehicle's arrival: an encounter, and the build-up of the ego's braking in
/// it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArrivalPrediction {
    /// The present encounter.
    pub encounter: Encounter,
    /// The build-up of the ego's braking from now on.
    pub response: BrakingResponse,
}

impl ArrivalPrediction {
    /// Returns the time until the rear vehicle reaches the critical gap, with the ego braking up to
    /// `deceleration_mps2` (s).
    ///
    /// Returns `None` if the rear vehicle never arrives.
    pub fn arrival_s(&self, deceleration_mps2: f64) -> Option<f64> {
        self.arrival_in_s(deceleration_mps2, &mut self.response.towards(deceleration_mps2))
    }

    fn arrival_in_s(&self, deceleration_mps2: f64, build_up: &mut BuildUp<'_>) -> Option<f64> {
        let Encounter { closing_mps, .. } = self.encounter;
        let distance_m = self.encounter.distance_to_critical_m();
        let mut time_s = self.encounter.arrival_s(deceleration_mps2)?;
        for _ in 0..NEWTON_STEPS {
            let loss = build_up.loss(time_s);
            let rate_mps = closing_mps + loss.speed_mps;
            if !(rate_mps > 0.0) {
                return None;
            }
            let next_s = (time_s - (closing_mps * time_s + loss.distance_m - distance_m) / rate_mps).max(0.0);
            let step_s = (next_s - time_s).abs();
            time_s = next_s;
            if step_s < ARRIVAL_TOLERANCE_S {
                return Some(time_s);
            }
        }
        // An arrival time that does not converge, such as NaN, is no arrival.
        None
    }

    /// Returns the front time headway when the rear vehicle arrives, with the ego braking up to
    /// `deceleration_mps2` (s).
    ///
    /// Returns `None` if the rear vehicle never arrives, or if the ego stops before.
    pub fn headway_at_arrival_s(&self, deceleration_mps2: f64) -> Option<f64> {
        let (gap_m, speed_mps) = self.at_arrival(deceleration_mps2)?;
        (speed_mps > 0.0).then(|| gap_m / speed_mps)
    }

    /// Returns the front gap (m) and the speed of the ego (m/s) when the rear vehicle arrives; a
    /// speed of 0 or less means that the ego stops before.
    fn at_arrival(&self, deceleration_mps2: f64) -> Option<(f64, f64)> {
        let Encounter { ego_mps, front_gap_m, lead_mps, .. } = self.encounter;
        let mut build_up = self.response.towards(deceleration_mps2);
        let time_s = self.arrival_in_s(deceleration_mps2, &mut build_up)?;
        let loss = build_up.loss(time_s);
        Some((front_gap_m + (lead_mps - ego_mps) * time_s + loss.distance_m, ego_mps - loss.speed_mps))
    }

    /// Returns the smallest braking up to `bound_mps2` with which the front time headway is at
    /// least `goal_s` when the rear vehicle arrives.
    ///
    /// Returns `None` if the rear vehicle does not approach: there is then no encounter to prepare
    /// for.
    pub fn solve(&self, goal_s: f64, bound_mps2: f64) -> Option<Solution> {
        if !(self.encounter.closing_mps > 0.0) {
            return None;
        }
        if self.reaches_goal(goal_s, 0.0) {
            return Some(Solution { deceleration_mps2: 0.0, in_reach: true });
        }
        let Encounter { ego_mps, closing_mps, lead_mps, .. } = self.encounter;
        let parts = if ego_mps + closing_mps >= lead_mps { 1 } else { SCAN_PARTS };
        let at = |part: u32| bound_mps2 * f64::from(part) / f64::from(parts);
        let part = (1..=parts).find(|part| self.reaches_goal(goal_s, at(*part)));
        Some(match part {
            Some(part) => {
                let (too_little, enough) = (at(part - 1), at(part));
                let by_secant = if parts == 1 { self.by_secant(goal_s, enough) } else { None };
                let deceleration_mps2 = by_secant.unwrap_or_else(|| self.bisect(goal_s, too_little, enough));
                Solution { deceleration_mps2, in_reach: true }
            }
            None => Solution { deceleration_mps2: bound_mps2, in_reach: false },
        })
    }

    /// Returns true if this braking reaches or exceeds the goal. If the ego stops before the
    /// arrival, it does: the headway passes every value on the way to a standstill.
    fn reaches_goal(&self, goal_s: f64, deceleration_mps2: f64) -> bool {
        let enough = |(gap_m, speed_mps)| speed_mps <= 0.0 || gap_m / speed_mps >= goal_s;
        self.at_arrival(deceleration_mps2).is_some_and(enough)
    }

    /// Returns what [`Self::bisect`] returns for the range from 0 to `enough`, in a third of its
    /// steps.
    ///
    /// The secant method (the Illinois algorithm) estimates the braking. The cell of bisection that
    /// contains the estimate is the result if its lower end misses the goal and its upper end
    /// reaches it, since the headway grows with the braking. Returns `None` if that is not so, or
    /// if the ego stops before the arrival at the bound.
    fn by_secant(&self, goal_s: f64, enough: f64) -> Option<f64> {
        let surplus_s = |braking: f64| self.headway_at_arrival_s(braking).map(|headway_s| headway_s - goal_s);
        let (mut low, mut high) = ((0.0, surplus_s(0.0)?), (enough, surplus_s(enough)?));
        let cells = f64::from(1_u32 << BISECTION_STEPS);
        let (mut estimate, mut last_missed) = (0.0, None);
        for _ in 0..SECANT_STEPS {
            let last = estimate;
            estimate = high.0 - high.1 * (high.0 - low.0) / (high.1 - low.1);
            if !((estimate - last).abs() > SECANT_TOLERANCE * enough / cells) {
                break;
            }
            let surplus_s = surplus_s(estimate)?;
            let misses = surplus_s < 0.0;
            // An end that stays twice is given half of its weight, so that both ends approach the
            // root.
            let stays = last_missed == Some(misses);
            let (moved, kept) = if misses { (&mut low, &mut high) } else { (&mut high, &mut low) };
            *moved = (estimate, surplus_s);
            if stays {
                kept.1 *= 0.5;
            }
            last_missed = Some(misses);
        }
        let share = (estimate / enough * cells).floor();
        if !(0.0..cells).contains(&share) {
            return None;
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within the range of the bits")]
        let cell = share as u32;
        // The ends of the cell, rounded as bisection rounds them.
        let (mut too_little, mut reaching) = (0.0, enough);
        for bit in (0..BISECTION_STEPS).rev() {
            let middle = 0.5 * (too_little + reaching);
            if (cell >> bit) & 1 == 1 { too_little = middle } else { reaching = middle }
        }
        (!self.reaches_goal(goal_s, too_little) && self.reaches_goal(goal_s, reaching)).then_some(reaching)
    }

    /// Returns the smallest braking that reaches the goal. It lies between a braking that does not
    /// reach the goal and a braking that does.
    fn bisect(&self, goal_s: f64, mut too_little: f64, mut enough: f64) -> f64 {
        for _ in 0..BISECTION_STEPS {
            let middle = 0.5 * (too_little + enough);
            if self.reaches_goal(goal_s, middle) { enough = middle } else { too_little = middle }
        }
        enough
    }
}

#[cfg(test)]
mod tests {
    use closecall_traffic::maths;
    use proptest::prelude::*;

    use super::super::tests::{REFERENCE, encounters};
    use super::*;

    /// Build-up at the comfort limit, with the actuators of a car.
    const CAR: BrakingResponse =
        BrakingResponse { commanded_mps2: 0.0, braking_mps2: 0.0, build_up_mps3: 2.0, release_mps3: 3.0, lag_s: 0.15 };

    prop_compose! {
        fn responses()(commanded in 0.0..1.5, now in -0.5..1.5) -> BrakingResponse {
            BrakingResponse { commanded_mps2: commanded, braking_mps2: now, ..CAR }
        }
    }

    /// Computes the front time headway when the rear vehicle arrives by time-stepping all three
    /// vehicles, a hundred times a second.
    fn stepped(prediction: &ArrivalPrediction, aim: f64) -> Option<f64> {
        let ArrivalPrediction { encounter, response } = prediction;
        let step_s = 0.01;
        let (mut commanded, mut braking) = (response.commanded_mps2, response.braking_mps2);
        let (mut ego_mps, mut front_m, mut rear_m) = (encounter.ego_mps, encounter.front_gap_m, encounter.rear_gap_m);
        let rear_mps = encounter.ego_mps + encounter.closing_mps;
        let decay = maths::exp(-step_s / response.lag_s);
        for _ in 0..100_000 {
            if ego_mps <= 0.0 || rear_mps <= ego_mps {
                return None;
            }
            let before = (ego_mps, front_m, rear_m);
            let next = if aim > commanded {
                (commanded + response.build_up_mps3 * step_s).min(aim)
            } else {
                (commanded - response.release_mps3 * step_s).max(aim)
            };
            let (middle, was) = (0.5 * (commanded + next), braking);
            commanded = next;
            braking = middle + (braking - middle) * decay;
            ego_mps -= 0.5 * (was + braking) * step_s;
            let mean_mps = 0.5 * (before.0 + ego_mps);
            front_m += (encounter.lead_mps - mean_mps) * step_s;
            rear_m -= (rear_mps - mean_mps) * step_s;
            if rear_m <= encounter.critical_gap_m {
                let share = (before.2 - encounter.critical_gap_m) / (before.2 - rear_m);
                let between = |from: f64, to: f64| from + share * (to - from);
                return Some(between(before.1, front_m) / between(before.0, ego_mps));
            }
        }
        None
    }

    /// The result of a scan over the braking. A scan is inconclusive if the headway is within its
    /// own error of the goal.
    #[derive(Debug, PartialEq)]
    enum Scanned {
        Reached,
        Missed,
        Close,
    }

    fn scan(prediction: &ArrivalPrediction, goal_s: f64, bound: f64) -> Scanned {
        let error_s = 5e-3;
        let best = (0..=40)
            .filter_map(|step| stepped(prediction, bound * f64::from(step) / 40.0))
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

        #[test]
        fn the_secant_method_ends_in_the_cell_of_bisection(
            encounter in encounters(), response in responses(), gain in 0.1..3.0, bound in 0.5..3.0,
        ) {
            let prediction = ArrivalPrediction { encounter, response };
            let goal_s = encounter.front_gap_m / encounter.ego_mps + gain;
            let is_built_for = encounter.ego_mps + encounter.closing_mps >= encounter.lead_mps;
            let is_bracketed = !prediction.reaches_goal(goal_s, 0.0) && prediction.reaches_goal(goal_s, bound);
            if is_built_for && is_bracketed && let Some(braking) = prediction.by_secant(goal_s, bound) {
                prop_assert_eq!(braking.to_bits(), prediction.bisect(goal_s, 0.0, bound).to_bits());
            }
        }

        /// Holds if the rear vehicle is at least as fast as the lead vehicle, as in every state in
        /// which the system engages.
        #[test]
        fn the_goal_is_in_reach_exactly_if_a_scan_reaches_it(
            encounter in encounters(), response in responses(), gain in 0.1..3.0, bound in 0.5..3.0,
        ) {
            prop_assume!(encounter.ego_mps + encounter.closing_mps >= encounter.lead_mps);
            let prediction = ArrivalPrediction { encounter, response };
            let goal = encounter.front_gap_m / encounter.ego_mps + gain;
            let solution = prediction.solve(goal, bound).unwrap();
            prop_assert!((0.0..=bound).contains(&solution.deceleration_mps2));
            match scan(&prediction, goal, bound) {
                Scanned::Reached => prop_assert!(solution.in_reach, "{solution:?}"),
                Scanned::Missed => prop_assert!(!solution.in_reach, "{solution:?}"),
                Scanned::Close => {}
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2_000))]

        #[test]
        fn immediate_braking_equals_the_closed_form(encounter in encounters(), gain in 0.1..3.0, bound in 0.5..3.0) {
            prop_assume!(encounter.ego_mps + encounter.closing_mps >= encounter.lead_mps);
            let goal = encounter.front_gap_m / encounter.ego_mps + gain;
            let closed = encounter.solve(goal, bound).unwrap();
            let immediate = ArrivalPrediction { encounter, response: BrakingResponse::IMMEDIATE };
            let bracketed = immediate.solve(goal, bound).unwrap();
            prop_assert!((closed.deceleration_mps2 - bracketed.deceleration_mps2).abs() < 1e-6, "{closed:?} {bracketed:?}");
        }

        #[test]
        fn slow_build_up_never_needs_less_braking(encounter in encounters(), gain in 0.1..3.0) {
            prop_assume!(encounter.ego_mps + encounter.closing_mps >= encounter.lead_mps);
            let goal = encounter.front_gap_m / encounter.ego_mps + gain;
            let at_once = encounter.solve(goal, 3.0).unwrap();
            let slowly = ArrivalPrediction { encounter, response: CAR }.solve(goal, 3.0).unwrap();
            prop_assert!(slowly.deceleration_mps2 >= at_once.deceleration_mps2 - 1e-6, "{slowly:?} {at_once:?}");
        }

        #[test]
        fn the_smallest_braking_meets_the_goal_exactly(
            encounter in encounters(), response in responses(), gain in 0.1..3.0,
        ) {
            let prediction = ArrivalPrediction { encounter, response };
            let goal = encounter.front_gap_m / encounter.ego_mps + gain;
            let Solution { deceleration_mps2, in_reach } = prediction.solve(goal, 9.0).unwrap();
            if in_reach && deceleration_mps2 > 1e-6 {
                let headway = prediction.headway_at_arrival_s(deceleration_mps2).unwrap();
                prop_assert!((headway - goal).abs() < 1e-5, "{headway} {goal}");
            }
        }

        #[test]
        fn a_higher_goal_never_needs_less_braking_and_a_goal_already_met_needs_none(
            encounter in encounters(), response in responses(), gain in 0.0..3.0, more in 0.0..1.0,
        ) {
            prop_assume!(encounter.ego_mps + encounter.closing_mps >= encounter.lead_mps);
            let prediction = ArrivalPrediction { encounter, response };
            let goal = encounter.front_gap_m / encounter.ego_mps + gain;
            let low = prediction.solve(goal, 3.0).unwrap();
            let high = prediction.solve(goal + more, 3.0).unwrap();
            prop_assert!(high.deceleration_mps2 >= low.deceleration_mps2 - 1e-9);
            if let Some(met) = prediction.headway_at_arrival_s(0.0) {
                let solution = prediction.solve(met, 1.0).unwrap();
                prop_assert_eq!(solution, Solution { deceleration_mps2: 0.0, in_reach: true });
            }
        }
    }

    #[test]
    fn with_nan_the_goal_is_out_of_reach() {
        for broken in
            [Encounter { front_gap_m: f64::NAN, ..REFERENCE }, Encounter { rear_gap_m: f64::NAN, ..REFERENCE }]
        {
            let solution = ArrivalPrediction { encounter: broken, response: CAR }.solve(2.7, 1.0).unwrap();
            assert_eq!(solution, Solution { deceleration_mps2: 1.0, in_reach: false });
        }
        let broken = BrakingResponse { braking_mps2: f64::NAN, ..CAR };
        assert!(!ArrivalPrediction { encounter: REFERENCE, response: broken }.solve(2.7, 1.0).unwrap().in_reach);
        assert_eq!(
            ArrivalPrediction { encounter: Encounter { closing_mps: f64::NAN, ..REFERENCE }, response: CAR }
                .solve(2.7, 1.0),
            None
        );
    }
}
