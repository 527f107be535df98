//! The model itself: regimes in the plane of closing speed and gap, and the acceleration in each.
//!
//! ```text
//!   gap ▲                    free
//!       │   ╲ approach
//!       │     ╲  distance          ─ ─ ─ ─ ─ ─   safe + cc2
//!       │ approaching ╲  following │  free
//!       │─ ─ ─ ─ ─ ─ ─ ─│─ ─ ─ ─ ─ │─ ─ ─ ─ ─   safe = cc0 + cc1·v
//!       │  emergency    │ falling  │  coasting
//!       │               │ back     │
//!       └───────────────┴────┬─────┴──────▶ Δv = v_lead − v
//!                      cc4 − c·g²  0   cc5 + c·g²          c = cc6 · 10⁻⁴
//! ```
//!
//! With gap g, speed v, lead speed v_l, Δv = v_l − v (negative while closing):
//!
//! | threshold | value | meaning |
//! |---|---|---|
//! | safe | cc0 + cc1·min(v, v_l) | the gap that is never undercut on purpose |
//! | follow | safe + cc2 | the gap up to which the driver just follows |
//! | approach | follow + cc3·(Δv − cc4) | where a driver who closes in begins to slow down |
//! | closing | cc4 − c·g²; cc4 once noticed | closing is noticed below this Δv |
//! | opening | cc5 + c·g² | opening is noticed above this Δv |
//!
//! | regime | where | acceleration |
//! |---|---|---|
//! | emergency | g ≤ safe and Δv < closing, or g < cc0 and Δv < 0 | a_l − Δv²/(2·(g − cc0)), at least cc7, at most 8 m/s² of braking |
//! | approaching | g < approach and Δv < closing | a_l − Δv²/(2·(g − safe)): Δv vanishes at the safe gap |
//! | following | g ≤ follow and Δv ≤ opening | ±cc7; the sign turns at the edges of the regime |
//! | free | else | cc8 at standstill falling linearly to cc9 at 80 km/h, towards the desired speed; none while g ≤ safe |
//!
//! a_l is the lead's braking (its acceleration where negative, else 0).
//!
//! # Where published variants differ
//! - The slower of the two speeds enters the safe gap, as in Vissim; in the steady state both are the same.
//! - Vissim's manual defines cc9 as the acceleration *at 80 km/h*; some open implementations add cc9·v to cc8 and cap the
//!   sum, which leaves cc9 without effect. The manual is followed; above 80 km/h the value at 80 km/h holds.
//! - The terms Δv²/(cc0 − g) and Δv²/(g − follow) of open implementations diverge where the gap meets the threshold. Here
//!   each is the constant deceleration that removes Δv over the room left, with the room kept above 0.5 m.
//! - Vissim's term for approaching leaves out the lead's braking. The deceleration that removes Δv over a given room is
//!   relative to the lead, so that its braking adds to it: without it a hard-braking lead is noticed as emergency only.
//! - A driver who has noticed that it closes in goes on until Δv is back at cc4. Where the threshold for noticing is used
//!   for that too, up to 1.5 m/s are left at 30 m of gap, and cc7 takes 4 m to remove them: below the safe gap.
//! - No random terms: what varies between drivers is sampled as a parameter.

use super::Parameters99;
use crate::driver::{HARDEST_BRAKING_MPS2, LIFT_OFF_MPS2, Lead};

/// 80 km/h, where cc9 holds [m/s].
const CC9_SPEED_MPS: f64 = 80.0 / 3.6;

/// cc6 is given in units of this [rad/s].
const CC6_UNIT: f64 = 1e-4;

/// Room below which no required deceleration is worked out [m]: it would diverge.
const LEAST_ROOM_M: f64 = 0.5;

/// Time constant with which the desired speed is approached [s].
const SPEED_TIME_S: f64 = 1.0;

/// What a follower is doing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Regime {
    /// Drives as if nobody were ahead.
    #[default]
    Free,
    /// Slows down towards the safe gap.
    Approaching,
    /// Follows, with the small oscillation of one who does not look at the speedometer.
    Following,
    /// Is too close and still closing.
    Emergency,
}

/// The thresholds for one situation.
#[derive(Clone, Copy, Debug)]
struct Thresholds {
    safe_m: f64,
    follow_m: f64,
    approach_m: f64,
    closing_mps: f64,
    opening_mps: f64,
}

/// A follower by Wiedemann 99: its parameters and the regime it is in.
#[derive(Clone, Copy, Debug)]
pub struct Wiedemann99Model {
    parameters: Parameters99,
    regime: Regime,
    /// True while the oscillation of following goes upwards.
    rising: bool,
}

impl Wiedemann99Model {
    /// A follower with these settings, driving freely.
    pub fn new(settings: &super::Wiedemann99) -> Self {
        Self { parameters: settings.parameters, regime: Regime::Free, rising: false }
    }

    /// The regime that the latest acceleration came from.
    pub fn regime(&self) -> Regime {
        self.regime
    }

    /// The acceleration at `speed_mps` behind `lead`, where the driver wants `desired_mps` [m/s²].
    ///
    /// Bounded by 8 m/s² of braking and cc8 of acceleration for every finite input.
    pub fn acceleration_mps2(&mut self, speed_mps: f64, desired_mps: f64, lead: Option<&Lead>) -> f64 {
        let wish_mps2 = ((desired_mps - speed_mps) / SPEED_TIME_S).max(-LIFT_OFF_MPS2);
        let Some(lead) = lead else {
            self.regime = Regime::Free;
            return wish_mps2.min(self.free_mps2(speed_mps));
        };
        let thresholds = self.thresholds(speed_mps, lead);
        let opening_mps = lead.speed_mps - speed_mps;
        self.regime = self.regime_at(&thresholds, lead.gap_m, opening_mps);
        let lead_braking_mps2 = lead.acceleration_mps2.min(0.0);
        match self.regime {
            Regime::Free if lead.gap_m > thresholds.safe_m => wish_mps2.min(self.free_mps2(speed_mps)),
            Regime::Free => wish_mps2.min(0.0),
            Regime::Following => {
                self.turn(&thresholds, lead.gap_m, opening_mps);
                let swing_mps2 = if self.rising { self.parameters.cc7_mps2 } else { -self.parameters.cc7_mps2 };
                swing_mps2.min(wish_mps2)
            }
            Regime::Approaching => {
                self.rising = false;
                let needed = removing_mps2(opening_mps, lead.gap_m - thresholds.safe_m);
                (lead_braking_mps2 - needed).clamp(-HARDEST_BRAKING_MPS2, 0.0).min(wish_mps2)
            }
            Regime::Emergency => {
                self.rising = false;
                let needed = removing_mps2(opening_mps, lead.gap_m - self.parameters.cc0_m);
                (lead_braking_mps2 - needed).clamp(-HARDEST_BRAKING_MPS2, -self.parameters.cc7_mps2)
            }
        }
    }

    /// Free acceleration [m/s²]: cc8 at standstill, cc9 from 80 km/h on.
    fn free_mps2(&self, speed_mps: f64) -> f64 {
        let Parameters99 { cc8_mps2, cc9_mps2, .. } = self.parameters;
        cc8_mps2 + (cc9_mps2 - cc8_mps2) * (speed_mps / CC9_SPEED_MPS).clamp(0.0, 1.0)
    }

    fn thresholds(&self, speed_mps: f64, lead: &Lead) -> Thresholds {
        let p = &self.parameters;
        let safe_m = p.cc0_m + p.cc1_s * speed_mps.min(lead.speed_mps).max(0.0);
        let follow_m = safe_m + p.cc2_m;
        let widening_mps = p.cc6 * CC6_UNIT * lead.gap_m * lead.gap_m;
        Thresholds {
            safe_m,
            follow_m,
            approach_m: follow_m + p.cc3_s * (lead.speed_mps - speed_mps - p.cc4_mps),
            closing_mps: if self.is_closing() { p.cc4_mps } else { p.cc4_mps - widening_mps },
            opening_mps: p.cc5_mps + widening_mps,
        }
    }

    /// True where the driver has noticed that it closes in, and reacts to it.
    fn is_closing(&self) -> bool {
        matches!(self.regime, Regime::Approaching | Regime::Emergency)
    }

    fn regime_at(&self, thresholds: &Thresholds, gap_m: f64, opening_mps: f64) -> Regime {
        let closing = opening_mps < thresholds.closing_mps;
        if (gap_m <= thresholds.safe_m && closing) || (gap_m < self.parameters.cc0_m && opening_mps < 0.0) {
            Regime::Emergency
        } else if closing && gap_m < thresholds.approach_m {
            Regime::Approaching
        } else if gap_m <= thresholds.follow_m && opening_mps <= thresholds.opening_mps {
            Regime::Following
        } else {
            Regime::Free
        }
    }

    /// Turns the oscillation of following: where the speed difference is half of what would be noticed, and early enough
    /// to keep the gap between its edges.
    fn turn(&mut self, thresholds: &Thresholds, gap_m: f64, opening_mps: f64) {
        let turning_way_m = opening_mps * opening_mps / (2.0 * self.parameters.cc7_mps2);
        let too_near = gap_m <= thresholds.safe_m || gap_m - turning_way_m <= thresholds.safe_m;
        let too_far = gap_m + turning_way_m >= thresholds.follow_m;
        if opening_mps < 0.0 && too_near {
            self.rising = false;
        } else if (opening_mps > 0.0 && too_far) || opening_mps > 0.5 * thresholds.opening_mps {
            self.rising = true;
        } else if opening_mps < 0.5 * thresholds.closing_mps {
            self.rising = false;
        }
    }
}

/// The constant deceleration that removes the closing speed over `room_m` [m/s²].
fn removing_mps2(opening_mps: f64, room_m: f64) -> f64 {
    if opening_mps < 0.0 { opening_mps * opening_mps / (2.0 * room_m.max(LEAST_ROOM_M)) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::driver::wiedemann99::Wiedemann99;

    fn settings(cc1_s: f64) -> Wiedemann99 {
        let parameters = Parameters99 { cc1_s, ..Parameters99::VISSIM };
        Wiedemann99 { parameters, desired_speed_mps: None, reaction: None }
    }

    /// A follower behind a leader: gap, own speed, own acceleration after the actuators' lag of 0.15 s.
    #[derive(Clone, Copy)]
    struct Pair {
        gap_m: f64,
        speed_mps: f64,
        actual_mps2: f64,
    }

    /// Drives behind a leader with the given acceleration over time; returns the gaps at each step.
    fn drive(cc1_s: f64, mut pair: Pair, mut lead_mps: f64, step_s: f64, lead_mps2: impl Fn(f64) -> f64) -> Vec<f64> {
        let mut model = Wiedemann99Model::new(&settings(cc1_s));
        let steps = (120.0 / step_s).round() as usize;
        let mut gaps = Vec::with_capacity(steps);
        for step in 0..steps {
            let lead_mps2 = if lead_mps > 0.0 { lead_mps2(step as f64 * step_s) } else { 0.0 };
            let lead = Lead { gap_m: pair.gap_m, speed_mps: lead_mps, acceleration_mps2: lead_mps2 };
            let wanted = model.acceleration_mps2(pair.speed_mps, 36.0, Some(&lead));
            pair.actual_mps2 += (step_s / 0.15).min(1.0) * (wanted - pair.actual_mps2);
            let own_mps = (pair.speed_mps + step_s * pair.actual_mps2).max(0.0);
            let lead_next_mps = f64::max(lead_mps + step_s * lead_mps2, 0.0);
            pair.gap_m += 0.5 * step_s * (lead_mps + lead_next_mps - own_mps - pair.speed_mps);
            (pair.speed_mps, lead_mps) = (own_mps, lead_next_mps);
            gaps.push(pair.gap_m);
        }
        gaps
    }

    const APPROACH: Pair = Pair { gap_m: 120.0, speed_mps: 36.0, actual_mps2: 0.0 };

    #[test]
    fn behind_a_constant_leader_the_gap_settles_into_its_band() {
        for speed_mps in [20.0, 30.0] {
            for cc1_s in [0.2, 0.4, 0.6, 0.9, 1.5] {
                let safe_m = 1.5 + cc1_s * speed_mps;
                for step_s in [0.01, 0.04, 0.1] {
                    let gaps = drive(cc1_s, APPROACH, speed_mps, step_s, |_| 0.0);
                    let settled = &gaps[gaps.len() / 2..];
                    let least = settled.iter().copied().fold(f64::INFINITY, f64::min);
                    let most = settled.iter().copied().fold(0.0, f64::max);
                    // Half a metre of overshoot: the speed difference of 0.35 m/s and more that goes unnoticed, turned by cc7.
                    assert!(
                        least > safe_m - 0.5 && most < safe_m + 4.0 + 0.5,
                        "{speed_mps} m/s, cc1 {cc1_s} s, step {step_s} s: {least} to {most} around {safe_m}"
                    );
                    let overall = gaps.iter().copied().fold(f64::INFINITY, f64::min);
                    assert!(overall > safe_m - 1.0, "{speed_mps} {cc1_s} {step_s}: {overall} below {safe_m}");
                }
            }
        }
    }

    #[test]
    fn it_does_not_run_into_a_braking_leader() {
        for cc1_s in [0.4, 0.9, 1.5] {
            let start = Pair { gap_m: 2.5 + cc1_s * 30.0, speed_mps: 30.0, actual_mps2: 0.0 };
            for braking in [2.0, 4.0, 6.0] {
                let gaps = drive(cc1_s, start, 30.0, 0.01, |t| if t > 5.0 { -braking } else { 0.0 });
                let least = gaps.iter().copied().fold(f64::INFINITY, f64::min);
                assert!(least > 0.5, "cc1 {cc1_s} s, braking {braking} m/s²: {least} m");
            }
        }
    }

    #[test]
    fn free_acceleration_is_cc8_at_standstill_and_cc9_at_80_kmh() {
        let mut model = Wiedemann99Model::new(&settings(0.9));
        assert_eq!(model.acceleration_mps2(0.0, 36.0, None), 3.5);
        assert!((model.acceleration_mps2(CC9_SPEED_MPS, 36.0, None) - 1.5).abs() < 1e-12);
        assert_eq!(model.acceleration_mps2(36.0, 36.0, None), 0.0);
    }

    #[test]
    fn each_regime_is_where_the_table_says() {
        let mut model = Wiedemann99Model::new(&settings(0.9));
        let mut regime = |gap_m, opening_mps| {
            let lead = Lead { gap_m, speed_mps: 30.0 + opening_mps, acceleration_mps2: 0.0 };
            model.acceleration_mps2(30.0, 36.0, Some(&lead));
            model.regime()
        };
        assert_eq!(regime(150.0, 0.0), Regime::Free);
        assert_eq!(regime(60.0, -10.0), Regime::Approaching);
        assert_eq!(regime(30.0, 0.0), Regime::Following);
        assert_eq!(regime(30.0, 5.0), Regime::Free);
        assert_eq!(regime(15.0, -5.0), Regime::Emergency);
    }

    proptest! {
        #[test]
        fn accelerations_are_bounded_everywhere(
            gap in -5.0..200.0, speed in 0.0..50.0, lead_mps in 0.0..50.0, lead_mps2 in -10.0..5.0, cc1 in 0.0..2.0,
        ) {
            let lead = Lead { gap_m: gap, speed_mps: lead_mps, acceleration_mps2: lead_mps2 };
            let wanted = Wiedemann99Model::new(&settings(cc1)).acceleration_mps2(speed, 36.0, Some(&lead));
            prop_assert!((-HARDEST_BRAKING_MPS2..=3.5).contains(&wanted), "{wanted}");
        }
    }
}
