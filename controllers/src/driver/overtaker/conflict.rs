//! Does the present course lead into the vehicle ahead before it is cleared sideways, and what braking prevents that?
//!
//! The way still to drive until the two are clear of each other sideways is D: a lane change is a path along the road, so
//! that braking does not shorten it. In the time in which the driver covers D, the vehicle ahead, at speed v_l and
//! braking a_l, has to cover X = D − gap + least gap. It needs t = (v_l − √(v_l² − 2·a_l·X))/a_l for that, and the
//! driver, at speed v, has to brake by b = 2·(v·t − D)/t² in order not to be there sooner. Where the vehicle ahead stops
//! short of X, or the gap would be smallest before the driver is clear, only staying behind it helps.

use crate::braking::Behind;
use crate::driver::Lead;

/// Speed below which a driver counts as standing [m/s].
const STANDING_MPS: f64 = 0.1;

/// The vehicle ahead, the driver's own speed, and the gap it wants to keep.
#[derive(Clone, Copy, Debug)]
pub(super) struct Course {
    /// Own speed [m/s].
    pub(super) speed_mps: f64,
    /// The vehicle ahead.
    pub(super) lead: Lead,
    /// Way still to drive until clear of it sideways [m].
    pub(super) way_to_clear_m: f64,
    /// The gap to keep until then [m].
    pub(super) least_gap_m: f64,
}

impl Course {
    fn lead_braking_mps2(&self) -> f64 {
        (-self.lead.acceleration_mps2).max(0.0)
    }

    /// The way that the vehicle ahead drives in `time_s` [m].
    fn lead_way_m(&self, time_s: f64) -> f64 {
        let Lead { speed_mps, .. } = self.lead;
        let braking = self.lead_braking_mps2();
        if braking * time_s > speed_mps {
            speed_mps * speed_mps / (2.0 * braking)
        } else {
            time_s * (speed_mps - 0.5 * braking * time_s)
        }
    }

    /// The time headway after driving on for `way_m` while slowing down by `slowing_mps2`, which is 0 or more [s].
    pub(super) fn thw_after_s(&self, way_m: f64, slowing_mps2: f64) -> f64 {
        let square = self.speed_mps * self.speed_mps - 2.0 * slowing_mps2 * way_m;
        let then_mps = square.max(STANDING_MPS * STANDING_MPS).sqrt();
        let time_s = 2.0 * way_m / (self.speed_mps + then_mps).max(STANDING_MPS);
        (self.lead.gap_m + self.lead_way_m(time_s) - way_m) / then_mps
    }

    /// The gap after driving on for `way_m` at the present speed [m].
    pub(super) fn gap_after_m(&self, way_m: f64) -> f64 {
        let time_s = way_m / self.speed_mps.max(STANDING_MPS);
        self.lead.gap_m + self.lead_way_m(time_s) - way_m
    }

    /// The deceleration that keeps the least gap until clear [m/s²]; 0 where none is needed.
    pub(super) fn needed_braking_mps2(&self) -> f64 {
        let lead_way_m = self.way_to_clear_m - self.lead.gap_m + self.least_gap_m;
        if !(self.way_to_clear_m > 0.0) || lead_way_m <= 0.0 {
            return 0.0;
        }
        let braking = self.lead_braking_mps2();
        let square = self.lead.speed_mps * self.lead.speed_mps - 2.0 * braking * lead_way_m;
        if square < 0.0 || self.lead.speed_mps <= 0.0 {
            return self.staying_behind_mps2();
        }
        // The same as (v_l − √…)/a_l, without the cancellation for a small a_l.
        let time_s = 2.0 * lead_way_m / (self.lead.speed_mps + square.sqrt());
        let needed = 2.0 * (self.speed_mps * time_s - self.way_to_clear_m) / (time_s * time_s);
        // Where the driver would be the slower one by then, the gap was smallest before.
        let opens_before = needed * time_s > self.speed_mps - self.lead.speed_mps + braking * time_s;
        if opens_before { self.staying_behind_mps2() } else { needed.max(0.0) }
    }

    /// The deceleration that keeps the least gap if the driver stays behind for good [m/s²].
    fn staying_behind_mps2(&self) -> f64 {
        Behind {
            speed_mps: self.speed_mps,
            lead_mps: self.lead.speed_mps,
            lead_mps2: self.lead.acceleration_mps2,
            room_m: self.lead.gap_m - self.least_gap_m,
        }
        .required_mps2()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn course(gap_m: f64, speed_mps: f64, lead_mps: f64, lead_mps2: f64, way_m: f64) -> Course {
        let lead = Lead { gap_m, speed_mps: lead_mps, acceleration_mps2: lead_mps2 };
        Course { speed_mps, lead, way_to_clear_m: way_m, least_gap_m: 1.5 }
    }

    #[test]
    fn clear_needs_no_braking() {
        assert_eq!(course(1.0, 40.0, 20.0, -8.0, 0.0).needed_braking_mps2(), 0.0);
    }

    #[test]
    fn a_slower_lead_far_enough_away_needs_none() {
        // 40 m of way take 1 s, in which 10 m of the gap are lost.
        let course = course(20.0, 40.0, 30.0, 0.0, 40.0);
        assert_eq!(course.needed_braking_mps2(), 0.0);
        assert!((course.gap_after_m(40.0) - 10.0).abs() < 1e-12);
    }

    #[test]
    fn one_who_slows_down_comes_later_and_finds_more_headway() {
        let course = course(20.0, 40.0, 30.0, 0.0, 40.0);
        assert!((course.thw_after_s(40.0, 0.0) - 10.0 / 40.0).abs() < 1e-12);
        // 40 m from 40 m/s at 3.75 m/s² end at √1300 = 36.056 m/s after 1.0518 s, in which the lead drives 31.55 m.
        let expected_s = (20.0 + 30.0 * 80.0 / (40.0 + 1300.0_f64.sqrt()) - 40.0) / 1300.0_f64.sqrt();
        assert!((course.thw_after_s(40.0, 3.75) - expected_s).abs() < 1e-12);
    }

    proptest! {
        /// Braking as asked for keeps the least gap at the moment of clearing; checked by stepping both vehicles.
        #[test]
        fn the_braking_asked_for_is_enough(
            gap in 3.0..60.0, speed in 20.0..45.0, slower in 0.0..15.0_f64, braking in 0.0..8.0_f64, way in 1.0..150.0,
        ) {
            let course = course(gap, speed, speed - slower, -braking, way);
            let needed = course.needed_braking_mps2();
            prop_assume!(needed <= 30.0);
            let (step, mut own, mut lead) = (1e-3, (0.0, speed), (gap, speed - slower));
            let mut least = gap;
            while own.0 < way && own.1 > 0.0 {
                own = (own.0 + own.1 * step, (own.1 - needed * step).max(0.0));
                lead = (lead.0 + lead.1 * step, f64::max(lead.1 - braking * step, 0.0));
                least = f64::min(least, lead.0 - own.0);
            }
            prop_assert!(least > 1.5 - 0.2, "{least} with {needed}");
        }

        #[test]
        fn a_smaller_gap_never_needs_less(gap in 3.0..60.0, less in 0.0..3.0, braking in 0.0..8.0_f64, way in 1.0..150.0) {
            let far = course(gap, 38.0, 30.0, -braking, way).needed_braking_mps2();
            let near = course(gap - less, 38.0, 30.0, -braking, way).needed_braking_mps2();
            prop_assert!(near >= far - 1e-9, "{near} {far}");
        }
    }
}
