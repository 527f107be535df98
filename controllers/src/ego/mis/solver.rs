//! The braking with which the ego's front time headway has grown enough when the rear vehicle
//! arrives.
//!
//! Notation: E is the ego, F the lead vehicle, R the rear vehicle; v are speeds, g_F and g_R the
//! gaps to F and R, and THW is the front time headway. R covers the distance D = g_R − d_c to the
//! critical gap d_c at the closing speed Δv > 0, while E brakes at a. R arrives after
//!
//! t(a) = (−Δv + √(Δv² + 2·a·D))/a, which solves D = Δv·t + ½·a·t², with the limit D/Δv for a → 0.
//!
//! The front time headway is then THW(t) = (g_F + (v_F − v_E)·t + ½·a·t²)/(v_E − a·t). With ½·a·t²
//! = D − Δv·t it depends only on t:
//!
//! THW(t) = (G − w·t)/(v_E + 2·Δv − 2·D/t), with G = g_F + D and w = v_E + Δv − v_F, the speed by
//! which R exceeds F.
//!
//! THW(t) = H is a quadratic equation, w·t² + B·t − 2·H·D = 0 with B = H·(v_E + 2·Δv) − G. No
//! braking means t = D/Δv, and harder braking means an earlier arrival. Towards earlier times the
//! first solution is t* = 4·H·D/(B + √(B² + 8·w·H·D)), whatever the sign of w. The braking is a* =
//! 2·(D − Δv·t*)/t*².
//!
//! For w ≥ 0, which is the case that the system is built for, the headway at arrival grows with the
//! braking. Then t* is the only solution, and a* is the smallest braking that reaches H.

/// Braking below which the ego counts as keeping its speed (m/s²).
const NO_BRAKING_MPS2: f64 = 1e-9;

/// The ego between the lead vehicle and the rear vehicle, at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Encounter {
    /// Speed of the ego (m/s).
    pub ego_mps: f64,
    /// Gap from the ego to the lead vehicle (m).
    pub front_gap_m: f64,
    /// Speed of the lead vehicle (m/s).
    pub lead_mps: f64,
    /// Gap from the rear vehicle to the ego (m).
    pub rear_gap_m: f64,
    /// Closing speed of the rear vehicle (m/s).
    pub closing_mps: f64,
    /// Rear gap d_c at which the critical phase begins (m).
    pub critical_gap_m: f64,
}

/// The braking that an encounter requires.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solution {
    /// Braking to apply (m/s²): the smallest that reaches the goal, or the bound.
    pub deceleration_mps2: f64,
    /// Whether this braking reaches the goal.
    pub in_reach: bool,
}

impl Encounter {
    /// Returns D, the distance of the rear vehicle to the critical gap (m), 0 or more.
    pub(super) fn distance_to_critical_m(&self) -> f64 {
        (self.rear_gap_m - self.critical_gap_m).max(0.0)
    }

    /// Returns t_c(a), the time until the rear vehicle reaches the critical gap while the ego
    /// brakes at `deceleration_mps2` (s).
    ///
    /// Returns `None` if the rear vehicle never arrives: it does not approach, and the ego does not
    /// brake.
    pub fn arrival_s(&self, deceleration_mps2: f64) -> Option<f64> {
        let (distance_m, closing_mps) = (self.distance_to_critical_m(), self.closing_mps);
        if deceleration_mps2 > NO_BRAKING_MPS2 {
            let root = (closing_mps * closing_mps + 2.0 * deceleration_mps2 * distance_m).sqrt();
            // The two forms are equal; each avoids cancellation on its side.
            return Some(if closing_mps > 0.0 {
                2.0 * distance_m / (closing_mps + root)
            } else {
                (root - closing_mps) / deceleration_mps2
            });
        }
        (closing_mps > 0.0).then(|| distance_m / closing_mps)
    }

    /// Returns the front time headway when the rear vehicle arrives, with the ego braking at
    /// `deceleration_mps2` (s).
    ///
    /// Returns `None` if the rear vehicle never arrives, or if the ego stops before.
    pub fn headway_at_arrival_s(&self, deceleration_mps2: f64) -> Option<f64> {
        let time_s = self.arrival_s(deceleration_mps2)?;
        let speed_mps = self.ego_mps - deceleration_mps2 * time_s;
        if !(speed_mps > 0.0) {
            return None;
        }
        let opening_m = (self.lead_mps - self.ego_mps) * time_s + 0.5 * deceleration_mps2 * time_s * time_s;
        Some((self.front_gap_m + opening_m) / speed_mps)
    }

    /// Returns the smallest braking up to `bound_mps2` with which the front time headway is
    /// `goal_s` at the time to closest encounter, which both vehicles' present speeds determine:
    /// the time until the rear vehicle touches the ego if neither brakes.
    ///
    /// With the time t, THW = (g_F + (v_F − v_E)·t + ½·a·t²)/(v_E − a·t) = H gives a = (H·v_E − g_F
    /// − (v_F − v_E)·t)/(½·t² + H·t). Returns `None` if the rear vehicle does not approach.
    pub fn solve_by_ttce(&self, goal_s: f64, bound_mps2: f64) -> Option<Solution> {
        let time_s = Self { critical_gap_m: 0.0, ..*self }.arrival_s(0.0)?;
        let missing_m = goal_s * self.ego_mps - self.front_gap_m - (self.lead_mps - self.ego_mps) * time_s;
        let needed = missing_m / (0.5 * time_s * time_s + goal_s * time_s);
        // NaN and infinity occur if the rear vehicle touches the ego. NaN is written to be out of
        // reach.
        let in_reach = needed <= bound_mps2;
        Some(Solution { deceleration_mps2: if in_reach { needed.max(0.0) } else { bound_mps2 }, in_reach })
    }

    /// Returns the smallest braking up to `bound_mps2` with which the front time headway is
    /// `goal_s` when the rear vehicle arrives.
    ///
    /// Returns `None` if the rear vehicle does not approach: there is then no encounter to prepare
    /// for.
    pub fn solve(&self, goal_s: f64, bound_mps2: f64) -> Option<Solution> {
        if self.headway_at_arrival_s(0.0)? >= goal_s {
            return Some(Solution { deceleration_mps2: 0.0, in_reach: true });
        }
        let distance_m = self.distance_to_critical_m();
        let w = self.ego_mps + self.closing_mps - self.lead_mps;
        let b = goal_s * (self.ego_mps + 2.0 * self.closing_mps) - (self.front_gap_m + distance_m);
        let product = 8.0 * w * goal_s * distance_m;
        let root = (b * b + product).sqrt();
        // For b < 0 the sum b + √… suffers from cancellation; the conjugate form does not.
        let time_s = if b >= 0.0 { 4.0 * goal_s * distance_m / (b + root) } else { (root - b) / (2.0 * w) };
        let needed = 2.0 * (distance_m - self.closing_mps * time_s) / (time_s * time_s);
        // NaN occurs if the rear vehicle is at the critical gap or no solution exists. The
        // comparison is written so that NaN is out of reach.
        if needed <= bound_mps2 {
            Some(Solution { deceleration_mps2: needed.max(0.0), in_reach: true })
        } else {
            Some(Solution { deceleration_mps2: bound_mps2, in_reach: false })
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::tests::{REFERENCE, encounters};
    use super::*;

    #[test]
    fn the_reference_point_needs_one_metre_per_second_squared() {
        let solution = REFERENCE.solve(2.7, 9.0).unwrap();
        assert!((0.9..=1.1).contains(&solution.deceleration_mps2), "{solution:?}");
        let gained = REFERENCE.headway_at_arrival_s(1.0).unwrap() - 0.7;
        assert!((1.9..=2.1).contains(&gained), "{gained}");
    }

    #[test]
    fn the_ttce_plan_starts_gently_and_misses_the_reference_point() {
        let solution = REFERENCE.solve_by_ttce(2.7, 9.0).unwrap();
        // TTCE = 100/6.67 = 15 s: (2.7·30 − 21)/(112.5 + 40.5).
        assert!((solution.deceleration_mps2 - 60.0 / 153.0).abs() < 1e-9, "{solution:?}");
        let gained = REFERENCE.headway_at_arrival_s(solution.deceleration_mps2).unwrap() - 0.7;
        assert!(gained < 1.5, "the ego's own braking brings the rear vehicle earlier: {gained}");
    }

    #[test]
    fn without_braking_and_critical_distance_the_arrival_is_the_time_to_closest_encounter() {
        let encounter = Encounter { critical_gap_m: 0.0, ..REFERENCE };
        assert_eq!(encounter.arrival_s(0.0), Some(100.0 / (24.0 / 3.6)));
        let almost = encounter.arrival_s(1e-7).unwrap();
        assert!((almost - 15.0).abs() < 1e-4, "{almost}");
    }

    #[test]
    fn a_receding_vehicle_is_no_encounter() {
        assert_eq!(Encounter { closing_mps: -1.0, ..REFERENCE }.solve(2.7, 1.0), None);
        assert_eq!(Encounter { closing_mps: f64::NAN, ..REFERENCE }.solve(2.7, 1.0), None);
    }

    #[test]
    fn at_the_critical_distance_the_goal_is_out_of_reach() {
        let solution = Encounter { rear_gap_m: 4.0, ..REFERENCE }.solve(2.7, 1.0).unwrap();
        assert_eq!(solution, Solution { deceleration_mps2: 1.0, in_reach: false });
    }

    /// Returns the smallest braking on a fine grid that reaches the goal.
    fn brute_force(encounter: &Encounter, goal_s: f64, bound: f64) -> Option<f64> {
        let steps = 2000;
        (0..=steps)
            .map(|step| bound * f64::from(step) / f64::from(steps))
            .find(|braking| encounter.headway_at_arrival_s(*braking).is_some_and(|headway| headway >= goal_s))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(10_000))]

        #[test]
        fn the_solution_equals_a_brute_force_scan(encounter in encounters(), gain in 0.1..3.0, bound in 0.5..3.0) {
            let goal = encounter.front_gap_m / encounter.ego_mps + gain;
            let solution = encounter.solve(goal, bound).unwrap();
            prop_assert!((0.0..=bound).contains(&solution.deceleration_mps2));
            match brute_force(&encounter, goal, bound) {
                Some(braking) => {
                    prop_assert!(solution.in_reach);
                    prop_assert!((solution.deceleration_mps2 - braking).abs() <= bound / 1999.0, "{solution:?} {braking}");
                }
                None => prop_assert!(!solution.in_reach || solution.deceleration_mps2 > bound * (1.0 - 1e-9)),
            }
        }

        #[test]
        fn the_solution_meets_the_goal_exactly(encounter in encounters(), gain in 0.1..3.0) {
            let goal = encounter.front_gap_m / encounter.ego_mps + gain;
            let solution = encounter.solve(goal, 9.0).unwrap();
            if solution.in_reach && solution.deceleration_mps2 > 1e-6 {
                let headway = encounter.headway_at_arrival_s(solution.deceleration_mps2).unwrap();
                prop_assert!((headway - goal).abs() < 1e-6, "{headway} {goal}");
            }
        }

        #[test]
        fn a_higher_goal_never_needs_less_braking(encounter in encounters(), gain in 0.0..3.0, more in 0.0..1.0) {
            let goal = encounter.front_gap_m / encounter.ego_mps + gain;
            let low = encounter.solve(goal, 3.0).unwrap().deceleration_mps2;
            let high = encounter.solve(goal + more, 3.0).unwrap().deceleration_mps2;
            prop_assert!(high >= low - 1e-9);
        }

        #[test]
        fn a_goal_already_met_needs_no_braking(encounter in encounters()) {
            let met = encounter.headway_at_arrival_s(0.0).unwrap();
            let solution = encounter.solve(met, 1.0).unwrap();
            prop_assert_eq!(solution, Solution { deceleration_mps2: 0.0, in_reach: true });
        }
    }
}
