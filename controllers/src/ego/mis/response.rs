//! How E's braking builds up: within a jerk limit, and through the actuators' lag.
//!
//! ```text
//!  asked     ╱‾‾‾‾‾‾‾ a        c(t): from what is asked now to a, at the jerk j, done after r = |a − c₀|/j
//!           ╱   ______         x(t): what E does: τ·ẋ = c − x, from what it does now, x(0) = β
//!  c₀ ─────╱  ╱                V(t) = ∫x: the speed lost;  W(t) = ∫V: the way lost
//!  β  ───────╱
//! ```
//!
//! Integrating τ·ẋ = c − x once and twice gives V = ∫c − τ·(x − β) and W = ∬c − τ·(V − β·t), so that everything is in
//! closed form: c is a line and then a constant, and x relaxes towards it exponentially.
//!
//! Without this the plan would take braking for something that is there at once. Half a second of ramp and lag costs
//! 0.3 s of the 2 s at the reference point's approach, and more of faster ones.

/// How E's braking builds up from now. All braking is positive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Response {
    /// Braking asked of the actuators now [m/s²].
    pub asked_mps2: f64,
    /// Braking now [m/s²].
    pub braking_mps2: f64,
    /// How fast more may be asked [m/s³].
    pub build_up_mps3: f64,
    /// How fast less may be asked [m/s³].
    pub let_go_mps3: f64,
    /// Time constant of the actuators [s].
    pub lag_s: f64,
}

/// What E has lost after some time, against driving on at its present speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lost {
    /// Speed [m/s].
    pub(super) speed_mps: f64,
    /// Way [m].
    pub(super) way_m: f64,
}

/// One stretch in which what is asked changes evenly: its integrals, and what E does at its end.
struct Stretch {
    /// ∫c, ∬c [m/s, m].
    asked: [f64; 2],
    /// x at the end [m/s²].
    braking_mps2: f64,
}

impl Response {
    /// Braking that is there at once, from none.
    pub const IMMEDIATE: Self = Self {
        asked_mps2: 0.0,
        braking_mps2: 0.0,
        build_up_mps3: f64::INFINITY,
        let_go_mps3: f64::INFINITY,
        lag_s: 0.0,
    };

    /// What is lost after `time_s`, where `braking_mps2` is what E aims at.
    pub(super) fn lost(&self, braking_mps2: f64, time_s: f64) -> Lost {
        let change = braking_mps2 - self.asked_mps2;
        let jerk_mps3 = if change >= 0.0 { self.build_up_mps3 } else { -self.let_go_mps3 };
        let ramp_s = (change / jerk_mps3).min(time_s);
        // An immediate change takes no time at whatever jerk.
        let slope_mps3 = if ramp_s > 0.0 { jerk_mps3 } else { 0.0 };
        let ramp = self.stretch(self.asked_mps2, slope_mps3, self.braking_mps2, ramp_s);
        let rest_s = time_s - ramp_s;
        let level = self.stretch(braking_mps2, 0.0, ramp.braking_mps2, rest_s);
        let asked_speed = ramp.asked[0] + level.asked[0];
        let asked_way = ramp.asked[1] + ramp.asked[0] * rest_s + level.asked[1];
        let speed_mps = asked_speed - self.lag_s * (level.braking_mps2 - self.braking_mps2);
        Lost { speed_mps, way_m: asked_way - self.lag_s * (speed_mps - self.braking_mps2 * time_s) }
    }

    fn stretch(&self, asked_mps2: f64, slope_mps3: f64, braking_mps2: f64, time_s: f64) -> Stretch {
        let asked = [
            (asked_mps2 + 0.5 * slope_mps3 * time_s) * time_s,
            (0.5 * asked_mps2 + slope_mps3 * time_s / 6.0) * time_s * time_s,
        ];
        // A line c₀ + s·t is followed a lag behind; what was off at the beginning fades.
        let behind = |at_s: f64| asked_mps2 + slope_mps3 * (at_s - self.lag_s);
        let fading = if self.lag_s > 0.0 { (-time_s / self.lag_s).exp() } else { 0.0 };
        Stretch { asked, braking_mps2: behind(time_s) + (braking_mps2 - behind(0.0)) * fading }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Against stepping ramp and lag, thirty thousand times a second.
        #[test]
        fn it_is_what_stepping_gives(
            asked in 0.0..2.0_f64, now in -1.0..2.0_f64, aim in 0.0..3.0_f64, time_s in 0.0..4.0_f64, lag_s in 0.05..0.4_f64,
            jerk in 1.0..5.0_f64,
        ) {
            let response = Response { asked_mps2: asked, braking_mps2: now, build_up_mps3: jerk, let_go_mps3: 3.0, lag_s };
            let steps = 120_000;
            let step_s = time_s / f64::from(steps);
            let (mut c, mut x, mut lost): (f64, f64, Lost) = (asked, now, Lost { speed_mps: 0.0, way_m: 0.0 });
            for _ in 0..steps {
                lost.way_m += step_s * lost.speed_mps;
                lost.speed_mps += step_s * x;
                x += step_s * (c - x) / lag_s;
                c = if aim > c { (c + jerk * step_s).min(aim) } else { (c - 3.0 * step_s).max(aim) };
            }
            let closed = response.lost(aim, time_s);
            prop_assert!((closed.speed_mps - lost.speed_mps).abs() < 1e-3, "{closed:?} {lost:?}");
            prop_assert!((closed.way_m - lost.way_m).abs() < 2e-3, "{closed:?} {lost:?}");
        }
    }

    #[test]
    fn without_ramp_and_lag_it_is_the_textbook() {
        let lost = Response::IMMEDIATE.lost(1.5, 4.0);
        assert_eq!(lost, Lost { speed_mps: 6.0, way_m: 12.0 });
    }
}
