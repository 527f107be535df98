//! The build-up of the ego's braking, within a jerk limit and through the lag of the actuators.
//!
//! ```text
//!  commanded     ╱‾‾‾‾‾‾‾ a    c(t): command, from the present one c₀ to a with the jerk j, reached after r = |a − c₀|/j
//!           ╱   ______         x(t): braking of the ego: τ·ẋ = c − x, from the present braking x(0) = β
//!  c₀ ─────╱  ╱                V(t) = ∫x: loss of speed;  W(t) = ∫V: loss of distance
//!  β  ───────╱
//! ```
//!
//! Integrating τ·ẋ = c − x once and twice gives V = ∫c − τ·(x − β) and W = ∬c − τ·(V − β·t), where
//! τ is the lag. Everything is in closed form: c is a line and then a constant, and x approaches it
//! exponentially.
//!
//! Without this model, the plan would assume that braking takes effect at once. The half second of
//! ramp and lag costs 0.3 s of the 2 s of headway gain at the closing speed of the reference point,
//! and more at higher closing speeds.

use closecall_traffic::maths;

/// The build-up of the ego's braking from now on. Braking is positive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BrakingResponse {
    /// Present command to the actuators (m/s²).
    pub commanded_mps2: f64,
    /// Present braking (m/s²).
    pub braking_mps2: f64,
    /// Largest rate at which the command may increase (m/s³).
    pub build_up_mps3: f64,
    /// Largest rate at which the command may decrease (m/s³).
    pub release_mps3: f64,
    /// Time constant of the actuators (s).
    pub lag_s: f64,
}

/// The loss of speed and distance after some time, compared with driving on at the present speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Loss {
    /// Loss of speed (m/s).
    pub(super) speed_mps: f64,
    /// Loss of distance (m).
    pub(super) distance_m: f64,
}

/// The build-up of the braking up to one value.
pub(super) struct BuildUp<'a> {
    response: &'a BrakingResponse,
    braking_mps2: f64,
    /// Rate at which the command changes (m/s³).
    jerk_mps3: f64,
    /// Duration of the whole ramp (s).
    ramp_s: f64,
    /// The whole ramp, once a loss after its end was asked for: it does not depend on the time of
    /// the loss.
    whole_ramp: Option<Segment>,
}

impl BuildUp<'_> {
    /// Returns the loss after `time_s`.
    pub(super) fn loss(&mut self, time_s: f64) -> Loss {
        let Self { response, braking_mps2, jerk_mps3, .. } = *self;
        let ramp_s = self.ramp_s.min(time_s);
        let ramp = if ramp_s == self.ramp_s {
            *self.whole_ramp.get_or_insert_with(|| response.ramp(jerk_mps3, ramp_s))
        } else {
            response.ramp(jerk_mps3, ramp_s)
        };
        let rest_s = time_s - ramp_s;
        let level = response.segment(braking_mps2, 0.0, ramp.braking_mps2, rest_s);
        let commanded_speed = ramp.commanded[0] + level.commanded[0];
        let commanded_distance = ramp.commanded[1] + ramp.commanded[0] * rest_s + level.commanded[1];
        let speed_mps = commanded_speed - response.lag_s * (level.braking_mps2 - response.braking_mps2);
        let braked_m = commanded_distance - response.lag_s * (speed_mps - response.braking_mps2 * time_s);
        Loss { speed_mps, distance_m: braked_m }
    }
}

/// A time segment in which the command changes linearly: the integrals of the command, and the
/// braking at its end.
#[derive(Clone, Copy, Debug)]
struct Segment {
    /// ∫c and ∬c (m/s, m).
    commanded: [f64; 2],
    /// Braking x at the end (m/s²).
    braking_mps2: f64,
}

impl BrakingResponse {
    /// Braking that takes effect at once, starting from none.
    #[cfg(test)]
    pub(super) const IMMEDIATE: Self = Self {
        commanded_mps2: 0.0,
        braking_mps2: 0.0,
        build_up_mps3: f64::INFINITY,
        release_mps3: f64::INFINITY,
        lag_s: 0.0,
    };

    /// Returns the build-up if the command goes to `braking_mps2`.
    pub(super) fn towards(&self, braking_mps2: f64) -> BuildUp<'_> {
        let change = braking_mps2 - self.commanded_mps2;
        let jerk_mps3 = if change >= 0.0 { self.build_up_mps3 } else { -self.release_mps3 };
        BuildUp { response: self, braking_mps2, jerk_mps3, ramp_s: change / jerk_mps3, whole_ramp: None }
    }

    fn ramp(&self, jerk_mps3: f64, ramp_s: f64) -> Segment {
        // An immediate change takes no time, whatever the jerk.
        let slope_mps3 = if ramp_s > 0.0 { jerk_mps3 } else { 0.0 };
        self.segment(self.commanded_mps2, slope_mps3, self.braking_mps2, ramp_s)
    }

    fn segment(&self, commanded_mps2: f64, slope_mps3: f64, braking_mps2: f64, time_s: f64) -> Segment {
        let commanded = [
            (commanded_mps2 + 0.5 * slope_mps3 * time_s) * time_s,
            (0.5 * commanded_mps2 + slope_mps3 * time_s / 6.0) * time_s * time_s,
        ];
        // The response to a line c₀ + s·t lags behind it by τ; the initial deviation decays.
        let lagged = |at_s: f64| commanded_mps2 + slope_mps3 * (at_s - self.lag_s);
        let decay = if self.lag_s > 0.0 { maths::exp(-time_s / self.lag_s) } else { 0.0 };
        Segment { commanded, braking_mps2: lagged(time_s) + (braking_mps2 - lagged(0.0)) * decay }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Compares the closed form with time-stepping ramp and lag in 120,000 steps.
        #[test]
        fn the_closed_form_equals_time_stepping(
            commanded in 0.0..2.0_f64, now in -1.0..2.0_f64, aim in 0.0..3.0_f64, time_s in 0.0..4.0_f64,
            lag_s in 0.05..0.4_f64, jerk in 1.0..5.0_f64,
        ) {
            let response = BrakingResponse {
                commanded_mps2: commanded, braking_mps2: now, build_up_mps3: jerk, release_mps3: 3.0, lag_s,
            };
            let steps = 120_000;
            let step_s = time_s / f64::from(steps);
            let (mut c, mut x, mut loss): (f64, f64, Loss) = (commanded, now, Loss { speed_mps: 0.0, distance_m: 0.0 });
            for _ in 0..steps {
                loss.distance_m += step_s * loss.speed_mps;
                loss.speed_mps += step_s * x;
                x += step_s * (c - x) / lag_s;
                c = if aim > c { (c + jerk * step_s).min(aim) } else { (c - 3.0 * step_s).max(aim) };
            }
            let closed = response.towards(aim).loss(time_s);
            prop_assert!((closed.speed_mps - loss.speed_mps).abs() < 1e-3, "{closed:?} {loss:?}");
            prop_assert!((closed.distance_m - loss.distance_m).abs() < 2e-3, "{closed:?} {loss:?}");
        }
    }

    #[test]
    fn without_ramp_and_lag_the_loss_equals_constant_braking() {
        let loss = BrakingResponse::IMMEDIATE.towards(1.5).loss(4.0);
        assert_eq!(loss, Loss { speed_mps: 6.0, distance_m: 12.0 });
    }
}
