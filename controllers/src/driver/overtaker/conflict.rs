//! Conflict with the vehicle ahead: whether the present course hits it before the two are laterally
//! clear, and which deceleration prevents that.
//!
//! A lane change is a path along the road. Braking therefore does not shorten the distance D that
//! the driver covers until the two vehicles are laterally clear. In the same time, the vehicle
//! ahead, at speed v_l and deceleration a_l, must cover X = D − gap + minimum gap. It needs the
//! time t = (v_l − √(v_l² − 2·a_l·X))/a_l. In order not to arrive earlier, the driver at speed v
//! must brake with b = 2·(v·t − D)/t². If the vehicle ahead stops short of X, or the gap has its
//! minimum before the driver is clear, the driver must brake so as to stay behind.

use crate::braking::Behind;
use crate::driver::{Lead, STANDING_MPS};

/// The present course: own speed, vehicle ahead, and the gap to keep.
#[derive(Clone, Copy, Debug)]
pub(super) struct Course {
    /// Own speed (m/s).
    pub(super) speed_mps: f64,
    /// The vehicle ahead.
    pub(super) lead: Lead,
    /// Distance to drive until laterally clear of the vehicle ahead (m).
    pub(super) distance_to_clear_m: f64,
    /// Gap to keep until then (m).
    pub(super) min_gap_m: f64,
}

impl Course {
    /// Returns the deceleration of the vehicle ahead (m/s²), 0 if it accelerates.
    fn lead_braking_mps2(&self) -> f64 {
        (-self.lead.acceleration_mps2).max(0.0)
    }

    /// Returns the distance that the vehicle ahead drives in `time_s` (m).
    fn lead_distance_m(&self, time_s: f64) -> f64 {
        let Lead { speed_mps, .. } = self.lead;
        let braking = self.lead_braking_mps2();
        if braking * time_s > speed_mps {
            speed_mps * speed_mps / (2.0 * braking)
        } else {
            time_s * (speed_mps - 0.5 * braking * time_s)
        }
    }

    /// Returns the time headway after the distance `distance_m` at the constant deceleration
    /// `slowing_mps2` ≥ 0 (s).
    pub(super) fn thw_after_s(&self, distance_m: f64, slowing_mps2: f64) -> f64 {
        let square = self.speed_mps * self.speed_mps - 2.0 * slowing_mps2 * distance_m;
        let then_mps = square.max(STANDING_MPS * STANDING_MPS).sqrt();
        let time_s = 2.0 * distance_m / (self.speed_mps + then_mps).max(STANDING_MPS);
        (self.lead.gap_m + self.lead_distance_m(time_s) - distance_m) / then_mps
    }

    /// Returns the gap after the distance `distance_m` at the present speed (m).
    pub(super) fn gap_after_m(&self, distance_m: f64) -> f64 {
        let time_s = distance_m / self.speed_mps.max(STANDING_MPS);
        self.lead.gap_m + self.lead_distance_m(time_s) - distance_m
    }

    /// Returns true if the driver may accelerate at `acceleration_mps2` until it is clear, without
    /// having to brake then.
    pub(super) fn allows(&self, acceleration_mps2: f64) -> bool {
        let time_s = self.distance_to_clear_m.max(0.0) / self.speed_mps.max(STANDING_MPS);
        let faster = Self { speed_mps: self.speed_mps + acceleration_mps2.max(0.0) * time_s, ..*self };
        faster.required_braking_mps2() <= 0.0
    }

    /// Returns the deceleration that keeps the minimum gap until the driver is clear (m/s²), 0 if
    /// none is required.
    pub(super) fn required_braking_mps2(&self) -> f64 {
        let lead_distance_m = self.distance_to_clear_m - self.lead.gap_m + self.min_gap_m;
        if !(self.distance_to_clear_m > 0.0) || lead_distance_m <= 0.0 {
            return 0.0;
        }
        let braking = self.lead_braking_mps2();
        let square = self.lead.speed_mps * self.lead.speed_mps - 2.0 * braking * lead_distance_m;
        if square < 0.0 || self.lead.speed_mps <= 0.0 {
            return self.stay_behind_mps2();
        }
        // Equals (v_l − √…)/a_l, without the cancellation for a small a_l.
        let time_s = 2.0 * lead_distance_m / (self.lead.speed_mps + square.sqrt());
        let required_mps2 = 2.0 * (self.speed_mps * time_s - self.distance_to_clear_m) / (time_s * time_s);
        // If the driver is the slower one by then, the gap has its minimum earlier.
        let opens_before = required_mps2 * time_s > self.speed_mps - self.lead.speed_mps + braking * time_s;
        if opens_before { self.stay_behind_mps2() } else { required_mps2.max(0.0) }
    }

    /// Returns the deceleration that keeps the minimum gap if the driver stays behind (m/s²).
    pub(super) fn stay_behind_mps2(&self) -> f64 {
        Behind {
            speed_mps: self.speed_mps,
            lead_mps: self.lead.speed_mps,
            lead_mps2: self.lead.acceleration_mps2,
            room_m: self.lead.gap_m - self.min_gap_m,
        }
        .required_mps2()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn course(gap_m: f64, speed_mps: f64, lead_mps: f64, lead_mps2: f64, distance_m: f64) -> Course {
        let lead = Lead { gap_m, speed_mps: lead_mps, acceleration_mps2: lead_mps2 };
        Course { speed_mps, lead, distance_to_clear_m: distance_m, min_gap_m: 1.5 }
    }

    #[test]
    fn a_clear_course_requires_no_braking() {
        assert_eq!(course(1.0, 40.0, 20.0, -8.0, 0.0).required_braking_mps2(), 0.0);
    }

    #[test]
    fn a_slower_lead_vehicle_far_enough_ahead_requires_no_braking() {
        // 40 m take 1 s, in which the gap shrinks by 10 m.
        let course = course(20.0, 40.0, 30.0, 0.0, 40.0);
        assert_eq!(course.required_braking_mps2(), 0.0);
        assert!((course.gap_after_m(40.0) - 10.0).abs() < 1e-12);
    }

    #[test]
    fn a_driver_does_not_accelerate_into_the_vehicle_that_it_overtakes() {
        // 40 m take 1 s at 40 m/s and leave 4 m; at 44 m/s the gap shrinks by 12.7 m.
        let course = course(14.0, 40.0, 30.0, 0.0, 40.0);
        assert!(course.allows(0.0) && course.allows(-1.0));
        assert!(!course.allows(4.0));
    }

    #[test]
    fn slowing_down_increases_the_time_headway_after_a_distance() {
        let course = course(20.0, 40.0, 30.0, 0.0, 40.0);
        assert!((course.thw_after_s(40.0, 0.0) - 10.0 / 40.0).abs() < 1e-12);
        // 40 m from 40 m/s at 3.75 m/s² end at √1300 = 36.056 m/s after 1.0518 s, in which the lead
        // vehicle drives 31.55 m.
        let expected_s = (20.0 + 30.0 * 80.0 / (40.0 + 1300.0_f64.sqrt()) - 40.0) / 1300.0_f64.sqrt();
        assert!((course.thw_after_s(40.0, 3.75) - expected_s).abs() < 1e-12);
    }

    proptest! {
        /// The required braking keeps the minimum gap until the driver is clear; checked by
        /// stepping both vehicles.
        #[test]
        fn the_required_braking_suffices(
            gap in 3.0..60.0, speed in 20.0..45.0, slower in 0.0..15.0_f64, braking in 0.0..8.0_f64, distance in 1.0..150.0,
        ) {
            let course = course(gap, speed, speed - slower, -braking, distance);
            let required_mps2 = course.required_braking_mps2();
            prop_assume!(required_mps2 <= 30.0);
            let (step, mut follower, mut lead) = (1e-3, (0.0, speed), (gap, speed - slower));
            let mut least = gap;
            while follower.0 < distance && follower.1 > 0.0 {
                follower = (follower.0 + follower.1 * step, (follower.1 - required_mps2 * step).max(0.0));
                lead = (lead.0 + lead.1 * step, f64::max(lead.1 - braking * step, 0.0));
                least = f64::min(least, lead.0 - follower.0);
            }
            prop_assert!(least > 1.5 - 0.2, "{least} with {required_mps2}");
        }

        #[test]
        fn a_smaller_gap_never_requires_less_braking(
            gap in 3.0..60.0, less in 0.0..3.0, braking in 0.0..8.0_f64, distance in 1.0..150.0,
        ) {
            let far = course(gap, 38.0, 30.0, -braking, distance).required_braking_mps2();
            let near = course(gap - less, 38.0, 30.0, -braking, distance).required_braking_mps2();
            prop_assert!(near >= far - 1e-9, "{near} {far}");
        }
    }
}
