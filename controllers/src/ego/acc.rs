//! Adaptive cruise control: keeps a constant time gap to the lead vehicle.
//!
//! The commanded acceleration drives the closing speed towards the value that the gap allows:
//!
//! a = (v_allowed(e) + v_F − v_E)/T, with the gap error e = g − max(T·v_E, g₀). Here v_E and v_F
//! are the speeds of the ego and of the lead vehicle, T is the time gap, g the gap and g₀ the
//! standstill gap.
//!
//! Near the desired gap v_allowed = λ·e. This is the constant time gap law, whose platoons are
//! string stable for T above twice the lag of the actuators (Swaroop and Rajagopal, *A review of
//! constant time headway policy for automatic vehicle following*, IEEE ITSC 2001). Far from the
//! desired gap v_allowed grows only with √e, as with constant comfortable braking, so that the ego
//! uses up a surplus gap before it brakes. The ego does not accelerate to close in faster than a
//! few metres per second.
//!
//! If the lead vehicle brakes so that the ego will need all of the braking that the cruise control
//! has ([`Front::required_braking_mps2`]), the ego begins with it at once instead of waiting until
//! the gap is used up.
//!
//! # Limits
//! ISO 15622 limits deceleration (average over 2 s) and the jerk with which braking builds up. Both
//! limits fall linearly between two speeds:
//!
//! | speed | deceleration | jerk |
//! |---|---|---|
//! | up to 5 m/s | 5 m/s² | 5 m/s³ |
//! | from 20 m/s on | 3.5 m/s² | 2.5 m/s³ |
//!
//! The text of the standard was not at hand. Open-source driver assistance that implements it
//! states the limits (comma.ai opendbc; sunnypilot). The standard averages the deceleration over 2
//! s; here the limit holds at every instant. The standard limits the build-up of braking only; it
//! is an assumption that the same jerk limits the release of braking and the build-up and release
//! of acceleration. Emergency braking is exempt.
//!
//! ISO 15622 also asks for a time gap of 0.8 s or more. The paper assumes shorter gaps; no
//! production system may keep them.

use closecall_traffic::{Check, ConfigError, Num, Parameters, Range};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::following_distance::r157_time_gap_s;
use super::surroundings::Front;
use crate::reference::following_gap_m;

/// Slowest speed at which a gap counts as a time gap (m/s): numerical.
const SLOWEST_MPS: f64 = 1.0;
/// λ: allowed closing speed per metre of gap error near the desired gap (1/s): an assumption; 0.1
/// to 0.5 are plausible.
const ALLOWED_CLOSING_PER_M: f64 = 0.3;

/// Braking with which the ego closes a long gap to the lead vehicle (m/s²): an assumption; 1 to 2
/// are plausible.
const APPROACH_BRAKING_MPS2: f64 = 1.5;

/// Closing speed above which the ego does not accelerate any more (m/s): an assumption; 2 to 6 are
/// plausible.
const MAX_CLOSING_UP_MPS: f64 = 4.0;

/// A limit of ISO 15622 that changes linearly between two speeds.
struct SpeedLimited {
    /// Value up to [`SLOW_MPS`].
    slow: f64,
    /// Value from [`FAST_MPS`] on.
    fast: f64,
}

/// Speed up to which the limits for low speeds hold (m/s) (ISO 15622).
const SLOW_MPS: f64 = 5.0;

/// Speed from which the limits for high speeds hold (m/s) (ISO 15622).
const FAST_MPS: f64 = 20.0;

/// Strongest braking (m/s²) (ISO 15622).
const MAX_BRAKING_MPS2: SpeedLimited = SpeedLimited { slow: 5.0, fast: 3.5 };

/// Largest jerk (m/s³) (ISO 15622).
const MAX_JERK_MPS3: SpeedLimited = SpeedLimited { slow: 5.0, fast: 2.5 };

impl SpeedLimited {
    /// Returns the limit at `speed_mps`.
    fn at(&self, speed_mps: f64) -> f64 {
        let share = ((speed_mps - SLOW_MPS) / (FAST_MPS - SLOW_MPS)).clamp(0.0, 1.0);
        self.slow + share * (self.fast - self.slow)
    }
}

/// Strongest acceleration (m/s²): an assumption. ISO 15622 allows 2 from 20 m/s on, and more below.
const MAX_ACCELERATION_MPS2: f64 = 1.5;

/// Shortest time constant of the control law (s): three times the lag of the actuators, for
/// stability.
const MIN_TIME_CONSTANT_S: f64 = 0.45;

/// Time constant with which the speed approaches the set speed (s): an assumption; 1 to 4 are
/// plausible.
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
    /// How the time gap depends on the speed. A scenario always asks for a constant one.
    #[serde(skip)]
    pub(crate) policy: GapPolicy,
}

/// How the time gap of the adaptive cruise control depends on the speed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum GapPolicy {
    /// The time gap of the settings, at every speed.
    #[default]
    Constant,
    /// The minimum time gap of UN Regulation 157.
    R157,
    /// The gap of the fuzzy safety model of UN Regulation 157.
    FuzzySafety,
    /// No gap: a cruise control that does not look ahead. Its time gap says only how far back the ego starts.
    Unwatched,
}

/// Settings of the adaptive cruise control that replace a scenario's settings.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub(crate) struct AccPatch {
    time_gap_s: Option<Num>,
    set_speed_mps: Option<Num>,
    standstill_gap_m: Option<Num>,
}

impl AccPatch {
    /// Returns the cruise control with these settings in place of its own.
    pub(crate) fn over(&self, base: Acc, parameters: &Parameters) -> Result<Acc, ConfigError> {
        let own = |value: f64| Num::Fixed(value);
        let whole = AccConfig {
            time_gap_s: self.time_gap_s.clone().unwrap_or_else(|| own(base.time_gap_s)),
            set_speed_mps: self.set_speed_mps.clone().or_else(|| base.set_speed_mps.map(own)),
            standstill_gap_m: Some(self.standstill_gap_m.clone().unwrap_or_else(|| own(base.standstill_gap_m))),
        };
        Ok(Acc { policy: base.policy, ..whole.check(parameters)? })
    }
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
            standstill_gap_m: parameters.number_or(
                self.standstill_gap_m.as_ref(),
                "standstill-gap-m",
                Range::closed(0.5, 20.0),
                3.0,
            )?,
            policy: GapPolicy::Constant,
        })
    }
}

impl Acc {
    /// Returns whether the lead vehicle matters.
    pub(crate) fn looks_ahead(&self) -> bool {
        self.policy != GapPolicy::Unwatched
    }

    /// Returns the desired gap at `speed_mps` (m).
    pub(crate) fn desired_gap_m(&self, speed_mps: f64) -> f64 {
        match self.policy {
            GapPolicy::FuzzySafety => following_gap_m(speed_mps),
            GapPolicy::Constant | GapPolicy::R157 | GapPolicy::Unwatched => {
                (self.time_gap_at_s(speed_mps) * speed_mps).max(self.standstill_gap_m)
            }
        }
    }

    /// Returns the strongest braking at `speed_mps` (m/s²).
    pub(crate) fn max_braking_mps2(&self, speed_mps: f64) -> f64 {
        MAX_BRAKING_MPS2.at(speed_mps)
    }

    /// Returns the time gap at `speed_mps` (s).
    fn time_gap_at_s(&self, speed_mps: f64) -> f64 {
        match self.policy {
            GapPolicy::Constant | GapPolicy::Unwatched => self.time_gap_s,
            GapPolicy::R157 => r157_time_gap_s(speed_mps),
            GapPolicy::FuzzySafety => following_gap_m(speed_mps) / speed_mps.max(SLOWEST_MPS),
        }
    }

    /// Returns the acceleration at `speed_mps` behind `lead`, on a road with the speed limit
    /// `limit_mps` (m/s²).
    pub(crate) fn acceleration_mps2(&self, speed_mps: f64, limit_mps: f64, lead: Option<&Front>) -> f64 {
        let set_mps = self.set_speed_mps.unwrap_or(limit_mps);
        let mut desired = (set_mps - speed_mps) / SPEED_TIME_CONSTANT_S;
        if let Some(lead) = lead.filter(|_| self.looks_ahead()) {
            let error_m = lead.gap_m - self.desired_gap_m(speed_mps);
            let opening_mps = lead.speed_mps - speed_mps;
            let allowed_mps = allowed_closing_mps(error_m);
            let time_s = self.time_gap_at_s(speed_mps).max(MIN_TIME_CONSTANT_S);
            let slower = (allowed_mps + opening_mps) / time_s;
            let faster = (allowed_mps.min(MAX_CLOSING_UP_MPS) + opening_mps) / time_s;
            desired = desired.min(if slower < 0.0 { slower } else { faster.max(0.0) });
            let required = lead.required_braking_mps2(speed_mps, self.standstill_gap_m);
            if required > MAX_BRAKING_MPS2.at(speed_mps) {
                desired = desired.min(-required);
            }
        }
        // NaN passes through `clamp`; `EgoStack` refuses it as a command.
        desired.clamp(-MAX_BRAKING_MPS2.at(speed_mps), MAX_ACCELERATION_MPS2)
    }

    /// Returns the acceleration nearest to `requested_mps2` that the jerk limit allows `step_s`
    /// after the acceleration `last_mps2` was commanded (m/s²).
    pub(crate) fn limit_jerk_mps2(requested_mps2: f64, last_mps2: f64, speed_mps: f64, step_s: f64) -> f64 {
        let change_mps2 = MAX_JERK_MPS3.at(speed_mps) * step_s;
        requested_mps2.clamp(last_mps2 - change_mps2, last_mps2 + change_mps2)
    }
}

/// Returns the closing speed that the gap error `error_m` allows (m/s); negative if the gap is too
/// short.
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

    const ACC: Acc = Acc { time_gap_s: 0.7, set_speed_mps: None, standstill_gap_m: 3.0, policy: GapPolicy::Constant };

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
    fn the_limits_follow_iso_15622() {
        for (speed_mps, braking_mps2, jerk_mps3) in
            [(0.0, 5.0, 5.0), (5.0, 5.0, 5.0), (20.0, 3.5, 2.5), (40.0, 3.5, 2.5)]
        {
            assert_eq!(MAX_BRAKING_MPS2.at(speed_mps), braking_mps2);
            assert_eq!(MAX_JERK_MPS3.at(speed_mps), jerk_mps3);
        }
        // Open-source implementations state the jerk between the two speeds as 5.83 − v/6.
        assert!((MAX_JERK_MPS3.at(12.0) - (5.83 - 12.0 / 6.0)).abs() < 0.01);
        assert_eq!(Acc::limit_jerk_mps2(-3.5, 0.0, 30.0, 0.04), -0.1);
        assert_eq!(Acc::limit_jerk_mps2(1.5, -3.5, 30.0, 0.04), -3.4);
    }

    #[test]
    fn the_allowed_closing_speed_is_continuous() {
        let touch_m = APPROACH_BRAKING_MPS2 / (ALLOWED_CLOSING_PER_M * ALLOWED_CLOSING_PER_M);
        let step = allowed_closing_mps(touch_m + 1e-9) - allowed_closing_mps(touch_m - 1e-9);
        assert!(step.abs() < 1e-6);
    }

    /// The ego behind a vehicle at 30 m/s after 90 s.
    struct Followed {
        least_gap_m: f64,
        gap_m: f64,
        acceleration_mps2: f64,
    }

    /// Simulates an ego from a gap (m) and speed (m/s) behind a vehicle at 30 m/s, with the limit
    /// of the jerk and the lag of the actuators. `request` returns the requested acceleration
    /// (m/s²) for a gap and a speed.
    fn behind_30_mps((mut gap, mut speed): (f64, f64), request: impl Fn(f64, f64) -> f64) -> Followed {
        let (mut least, mut command, mut actual) = (f64::INFINITY, 0.0, 0.0);
        for step in 0..9000 {
            if step % 4 == 0 {
                command = Acc::limit_jerk_mps2(request(gap, speed), command, speed, 0.04);
            }
            actual += 0.01 / 0.15 * (command - actual);
            speed += 0.01 * actual;
            gap += 0.01 * (30.0 - speed);
            least = f64::min(least, gap);
        }
        Followed { least_gap_m: least, gap_m: gap, acceleration_mps2: actual }
    }

    /// Simulates the closed loop with the lag of the actuators from `start` times the gap of a time
    /// headway (s), with an ego that is slower than its leader by a speed (m/s). There is no
    /// collision, the least gap is at least 0.4 of the desired one if any braking within the limits
    /// achieves that, and the gap settles at the desired one without oscillation.
    fn settles(thw: f64, start: f64, slower: f64) -> Result<(), TestCaseError> {
        let acc = Acc { time_gap_s: thw, ..ACC };
        let initial = (thw * start * 30.0, 30.0 - slower);
        let request = |gap, speed| acc.acceleration_mps2(speed, 36.0, Some(&Front::new(gap, 30.0)));
        let controlled = behind_30_mps(initial, request);
        let (end_m, end_mps2) = (controlled.gap_m, controlled.acceleration_mps2);
        let attainable =
            behind_30_mps(initial, |_, speed| if speed > 30.0 { -MAX_BRAKING_MPS2.at(speed) } else { 0.0 });
        let bound = f64::min(0.4 * thw * 30.0, attainable.least_gap_m - 0.05);
        prop_assert!(controlled.least_gap_m > bound, "{} {bound}", controlled.least_gap_m);
        prop_assert!((end_m - thw * 30.0).abs() < 0.1 && end_mps2.abs() < 0.02, "{end_m} {end_mps2}");
        Ok(())
    }

    #[test]
    fn the_gap_settles_if_the_ego_begins_close_and_fast() {
        settles(0.5, 0.6, -2.989_396_518_911_008_5).unwrap();
    }

    proptest! {
        #[test]
        fn a_longer_gap_never_requests_more_braking(
            gap in 0.0..150.0, more in 0.0..20.0, lead in 0.0..40.0, ego_mps in 0.0..40.0,
        ) {
            let near = ACC.acceleration_mps2(ego_mps, 36.0, Some(&Front::new(gap, lead)));
            let far = ACC.acceleration_mps2(ego_mps, 36.0, Some(&Front::new(gap + more, lead)));
            prop_assert!(far >= near);
        }

        #[test]
        fn the_gap_settles_without_oscillation(thw in 0.5..0.9, start in 0.6..3.0, slower in -3.0..3.0) {
            settles(thw, start, slower)?;
        }
    }
}
