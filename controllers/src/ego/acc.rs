//! Adaptive cruise control: keeps a constant time gap to the lead vehicle.
//!
//! The commanded acceleration drives the closing speed towards the value that the gap allows:
//!
//! a = (v_allowed(e) + v_F − v_E)/T, with the gap error e = g − max(T·v_E, g₀). Here v_E and v_F are the speeds of the
//! ego and of the lead vehicle, T is the time gap, g the gap and g₀ the standstill gap.
//!
//! Near the desired gap v_allowed = λ·e. This is the constant time gap law, whose platoons are string stable for T
//! above twice the lag of the actuators (Swaroop and Rajagopal, *A review of constant time headway policy for automatic
//! vehicle following*, IEEE ITSC 2001). Far from the desired gap v_allowed grows only with √e, as with constant
//! comfortable braking, so that the ego uses up a surplus gap before it brakes. The ego does not accelerate to close in
//! faster than a few metres per second.
//!
//! If the lead vehicle brakes so that the ego will need more than light constant braking, the ego begins with that
//! braking at once ([`Front::required_braking_mps2`]). The stop then has the lowest peak deceleration, and the vehicles behind see the brake
//! light early.

use closecall_traffic::{Check, ConfigError, Num, Parameters, Range};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::surroundings::Front;

/// λ: allowed closing speed per metre of gap error near the desired gap (1/s).
const ALLOWED_CLOSING_PER_M: f64 = 0.3;

/// Braking with which the ego closes a long gap to the lead vehicle (m/s²).
const APPROACH_BRAKING_MPS2: f64 = 1.5;

/// Closing speed above which the ego does not accelerate any more (m/s).
const MAX_CLOSING_UP_MPS: f64 = 4.0;

/// Strongest braking (m/s²): the mean deceleration that ISO 15622 allows above 20 m/s.
const MAX_BRAKING_MPS2: f64 = 3.5;

/// Strongest acceleration (m/s²): ISO 15622 allows 2.
const MAX_ACCELERATION_MPS2: f64 = 1.5;

/// Shortest time constant of the control law (s): three times the lag of the actuators, for stability.
const MIN_TIME_CONSTANT_S: f64 = 0.45;

/// Required constant braking above which the ego brakes at once instead of waiting until the gap is used up (m/s²).
///
/// A choice: well above the braking of normal following, and below [`MAX_BRAKING_MPS2`], so that the ego begins to brake
/// while constant comfortable braking still suffices.
const EARLY_BRAKING_THRESHOLD_MPS2: f64 = 2.0;

/// Time constant with which the speed approaches the set speed (s).
const SPEED_TIME_CONSTANT_S: f64 = 2.0;

/// Adaptive cruise control as a scenario file describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct AccConfig {
    /// Time gap to the lead vehicle (s): 0.2 to 5.
    pub time_gap_s: Num,
    /// Speed if no vehicle is ahead (m/s); the speed limit of the road if absent.
    pub set_speed_mps: Option<Num>,
    /// Shortest gap, kept at standstill (m); 3 if absent.
    pub standstill_gap_m: Option<Num>,
}

/// The checked adaptive cruise control.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Acc {
    pub(crate) time_gap_s: f64,
    pub(crate) set_speed_mps: Option<f64>,
    pub(crate) standstill_gap_m: f64,
}

impl Check for AccConfig {
    type Checked = Acc;

    fn check(&self, parameters: &Parameters) -> Result<Acc, ConfigError> {
        let set_speed = self.set_speed_mps.as_ref();
        Ok(Acc {
            time_gap_s: parameters.number(&self.time_gap_s, "time-gap-s", Range::closed(0.2, 5.0))?,
            set_speed_mps: set_speed
                .map(|num| parameters.number(num, "set-speed-mps", Range::above(0.0, 100.0)))
                .transpose()?,
            standstill_gap_m: match &self.standstill_gap_m {
                Some(num) => parameters.number(num, "standstill-gap-m", Range::closed(0.5, 20.0))?,
                None => 3.0,
            },
        })
    }
}

impl Acc {
    /// Returns the desired gap at `speed_mps` (m).
    pub(crate) fn desired_gap_m(&self, speed_mps: f64) -> f64 {
        (self.time_gap_s * speed_mps).max(self.standstill_gap_m)
    }

    /// Returns the acceleration at `speed_mps` behind `lead`, on a road with the speed limit `limit_mps` (m/s²).
    pub(crate) fn acceleration_mps2(&self, speed_mps: f64, limit_mps: f64, lead: Option<&Front>) -> f64 {
        let set_mps = self.set_speed_mps.unwrap_or(limit_mps);
        let mut desired = (set_mps - speed_mps) / SPEED_TIME_CONSTANT_S;
        if let Some(lead) = lead {
            let error_m = lead.gap_m - self.desired_gap_m(speed_mps);
            let opening_mps = lead.speed_mps - speed_mps;
            let allowed_mps = allowed_closing_mps(error_m);
            let time_s = self.time_gap_s.max(MIN_TIME_CONSTANT_S);
            let slower = (allowed_mps + opening_mps) / time_s;
            let faster = (allowed_mps.min(MAX_CLOSING_UP_MPS) + opening_mps) / time_s;
            desired = desired.min(if slower < 0.0 { slower } else { faster.max(0.0) });
            let required = lead.required_braking_mps2(speed_mps, self.standstill_gap_m);
            if required > EARLY_BRAKING_THRESHOLD_MPS2 {
                desired = desired.min(-required);
            }
        }
        // NaN passes through `clamp`; `EgoStack` refuses it as a command.
        desired.clamp(-MAX_BRAKING_MPS2, MAX_ACCELERATION_MPS2)
    }
}

/// Returns the closing speed that the gap error `error_m` allows (m/s); negative if the gap is too short.
fn allowed_closing_mps(error_m: f64) -> f64 {
    // Gap error at which the straight line and the parabola of constant braking touch.
    let touch_m = APPROACH_BRAKING_MPS2 / (ALLOWED_CLOSING_PER_M * ALLOWED_CLOSING_PER_M);
    if error_m < touch_m {
        ALLOWED_CLOSING_PER_M * error_m
    } else {
        (2.0 * APPROACH_BRAKING_MPS2 * (error_m - 0.5 * touch_m)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const ACC: Acc = Acc { time_gap_s: 0.7, set_speed_mps: None, standstill_gap_m: 3.0 };

    #[test]
    fn the_acceleration_is_zero_at_the_desired_gap_and_speed() {
        let lead = Front::new(21.0, 30.0);
        assert_eq!(ACC.acceleration_mps2(30.0, 36.0, Some(&lead)), 0.0);
    }

    #[test]
    fn a_long_gap_is_used_up_before_braking() {
        let far = Front::new(60.0, 25.0);
        assert!(ACC.acceleration_mps2(30.0, 36.0, Some(&far)) >= 0.0);
        let near = Front::new(21.0, 25.0);
        assert_eq!(ACC.acceleration_mps2(30.0, 36.0, Some(&near)), -3.5);
    }

    #[test]
    fn the_allowed_closing_speed_is_continuous() {
        let touch_m = APPROACH_BRAKING_MPS2 / (ALLOWED_CLOSING_PER_M * ALLOWED_CLOSING_PER_M);
        let step = allowed_closing_mps(touch_m + 1e-9) - allowed_closing_mps(touch_m - 1e-9);
        assert!(step.abs() < 1e-6);
    }

    proptest! {
        #[test]
        fn a_longer_gap_never_requests_more_braking(
            gap in 0.0..150.0, more in 0.0..20.0, lead in 0.0..40.0, own in 0.0..40.0,
        ) {
            let near = ACC.acceleration_mps2(own, 36.0, Some(&Front::new(gap, lead)));
            let far = ACC.acceleration_mps2(own, 36.0, Some(&Front::new(gap + more, lead)));
            prop_assert!(far >= near);
        }

        /// Simulates the closed loop with the lag of the actuators from many initial states. There is no collision, and
        /// the gap settles at the desired one without oscillation.
        #[test]
        fn the_gap_settles_without_oscillation(thw in 0.5..0.9, start in 0.6..3.0, slower in -3.0..3.0) {
            let acc = Acc { time_gap_s: thw, ..ACC };
            let (mut gap, mut speed, mut actual) = (thw * start * 30.0, 30.0 - slower, 0.0);
            let mut least = f64::INFINITY;
            let mut command = 0.0;
            for step in 0..9000 {
                if step % 4 == 0 {
                    command = acc.acceleration_mps2(speed, 36.0, Some(&Front::new(gap, 30.0)));
                }
                actual += 0.01 / 0.15 * (command - actual);
                speed += 0.01 * actual;
                gap += 0.01 * (30.0 - speed);
                least = f64::min(least, gap);
            }
            prop_assert!(least > 0.4 * thw * 30.0, "{least}");
            prop_assert!((gap - thw * 30.0).abs() < 0.1 && actual.abs() < 0.02, "{gap} {actual}");
        }
    }
}
