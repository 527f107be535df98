//! Adaptive cruise control: a constant time gap to the vehicle ahead.
//!
//! The commanded acceleration drives the closing speed towards what the gap allows:
//!
//! a = (v_allowed(e) + v_F − v_E)/T, with the gap's error e = g − max(T·v_E, g₀).
//!
//! Near the wanted gap v_allowed = λ·e, which is the constant time gap law whose platoons are string stable for T above
//! twice the actuators' lag (Swaroop and Rajagopal, *A review of constant time headway policy for automatic vehicle
//! following*, IEEE ITSC 2001). Far from it v_allowed grows with √e only, as a constant comfortable braking does, so that a
//! gap in hand is used before the brakes are. It never speeds up to close faster than a few metres per second.
//!
//! Where F brakes so that E will need more than a light constant braking, E begins with that at once ([`Behind`]): the same
//! stop with the lowest peak, and a brake light that those behind see early.

use closecall_traffic::{Check, ConfigError, Num, Parameters, Range};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::surroundings::Front;
use crate::braking::Behind;

/// λ: closing speed allowed per metre of error near the wanted gap [1/s].
const ALLOWED_CLOSING_PER_M: f64 = 0.3;

/// Braking with which a long gap is closed up to the vehicle ahead [m/s²].
const CLOSING_UP_MPS2: f64 = 1.5;

/// Closing speed above which E does not accelerate any more [m/s].
const FASTEST_CLOSING_UP_MPS: f64 = 4.0;

/// Strongest braking [m/s²]: the mean that ISO 15622 allows above 20 m/s.
const STRONGEST_BRAKING_MPS2: f64 = 3.5;

/// Strongest acceleration [m/s²]: ISO 15622 allows 2.
const STRONGEST_ACCELERATION_MPS2: f64 = 1.5;

/// Shortest time constant of the control law [s]: three times the actuators' lag, for stability.
const SHORTEST_TIME_CONSTANT_S: f64 = 0.45;

/// Required constant braking from which on E does not wait until the gap is used up [m/s²].
///
/// Chosen on tuning seeds: 2 leaves 4.3 % of collisions with the margin increase system, waiting leaves 7.3 %.
const EARLY_FROM_MPS2: f64 = 2.0;

/// Time constant with which the set speed is approached [s].
const SPEED_TIME_S: f64 = 2.0;

/// Adaptive cruise control as a scenario file describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct AccConfig {
    /// Time gap to the vehicle ahead [s]: 0.2 to 5.
    pub time_gap_s: Num,
    /// Speed where nobody is ahead [m/s]; the road's speed limit where absent.
    pub set_speed_mps: Option<Num>,
    /// Shortest gap, kept at standstill [m]; 3.
    pub standstill_gap_m: Option<Num>,
}

/// Checked adaptive cruise control.
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
    /// The wanted gap at `speed_mps` [m].
    pub(crate) fn wanted_gap_m(&self, speed_mps: f64) -> f64 {
        (self.time_gap_s * speed_mps).max(self.standstill_gap_m)
    }

    /// The acceleration at `speed_mps` behind `front`, on a road where `limit_mps` is allowed [m/s²].
    pub(crate) fn acceleration_mps2(&self, speed_mps: f64, limit_mps: f64, front: Option<&Front>) -> f64 {
        let set_mps = self.set_speed_mps.unwrap_or(limit_mps);
        let mut wanted = (set_mps - speed_mps) / SPEED_TIME_S;
        if let Some(front) = front {
            let error_m = front.gap_m - self.wanted_gap_m(speed_mps);
            let opening_mps = front.speed_mps - speed_mps;
            let allowed_mps = allowed_closing_mps(error_m);
            let time_s = self.time_gap_s.max(SHORTEST_TIME_CONSTANT_S);
            let slower = (allowed_mps + opening_mps) / time_s;
            let faster = (allowed_mps.min(FASTEST_CLOSING_UP_MPS) + opening_mps) / time_s;
            wanted = wanted.min(if slower < 0.0 { slower } else { faster.max(0.0) });
            let required = self.required_mps2(speed_mps, front);
            if required > EARLY_FROM_MPS2 {
                wanted = wanted.min(-required);
            }
        }
        // A NaN passes through `clamp`, and is refused where the command is given.
        wanted.clamp(-STRONGEST_BRAKING_MPS2, STRONGEST_ACCELERATION_MPS2)
    }
}

impl Acc {
    /// The constant braking with which E just keeps its standstill gap [m/s²].
    fn required_mps2(&self, speed_mps: f64, front: &Front) -> f64 {
        Behind {
            speed_mps,
            lead_mps: front.speed_mps,
            lead_mps2: front.acceleration_mps2,
            room_m: front.gap_m - self.standstill_gap_m,
        }
        .required_mps2()
    }
}

/// The closing speed that a gap too long by `error_m` allows [m/s]; negative where the gap is too short.
fn allowed_closing_mps(error_m: f64) -> f64 {
    // Where the straight line and the parabola of constant braking touch.
    let touch_m = CLOSING_UP_MPS2 / (ALLOWED_CLOSING_PER_M * ALLOWED_CLOSING_PER_M);
    if error_m < touch_m {
        ALLOWED_CLOSING_PER_M * error_m
    } else {
        (2.0 * CLOSING_UP_MPS2 * (error_m - 0.5 * touch_m)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const ACC: Acc = Acc { time_gap_s: 0.7, set_speed_mps: None, standstill_gap_m: 3.0 };

    #[test]
    fn at_the_wanted_gap_and_speed_nothing_is_asked_for() {
        let front = Front::new(21.0, 30.0);
        assert_eq!(ACC.acceleration_mps2(30.0, 36.0, Some(&front)), 0.0);
    }

    #[test]
    fn a_long_gap_is_used_before_the_brakes() {
        let far = Front::new(60.0, 25.0);
        assert!(ACC.acceleration_mps2(30.0, 36.0, Some(&far)) >= 0.0);
        let near = Front::new(21.0, 25.0);
        assert_eq!(ACC.acceleration_mps2(30.0, 36.0, Some(&near)), -3.5);
    }

    #[test]
    fn the_allowed_closing_speed_has_no_step() {
        let touch_m = CLOSING_UP_MPS2 / (ALLOWED_CLOSING_PER_M * ALLOWED_CLOSING_PER_M);
        let step = allowed_closing_mps(touch_m + 1e-9) - allowed_closing_mps(touch_m - 1e-9);
        assert!(step.abs() < 1e-6);
    }

    proptest! {
        #[test]
        fn a_longer_gap_never_asks_for_more_braking(gap in 0.0..150.0, more in 0.0..20.0, front in 0.0..40.0, own in 0.0..40.0) {
            let near = ACC.acceleration_mps2(own, 36.0, Some(&Front::new(gap, front)));
            let far = ACC.acceleration_mps2(own, 36.0, Some(&Front::new(gap + more, front)));
            prop_assert!(far >= near);
        }

        /// Closed loop with the actuators' lag, from anywhere: no collision, and at the end the wanted gap without swinging.
        #[test]
        fn it_settles_without_swinging(thw in 0.5..0.9, start in 0.6..3.0, slower in -3.0..3.0) {
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
