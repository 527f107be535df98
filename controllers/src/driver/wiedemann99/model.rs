//! The model itself: the acceleration in each regime.
//!
//! With gap g, speed v, lead speed v_l, Δv = v_l − v (negative while closing), and b_l the lead's braking;
//! [`super::thresholds`] says where each regime lies:
//!
//! | regime | acceleration |
//! |---|---|
//! | emergency | −slowing, at least cc7 of braking, at most 8 m/s² |
//! | approaching | −slowing, at most 8 m/s² of braking |
//! | following | ±cc7; the sign turns at the edges of the regime |
//! | free | cc8 at standstill falling linearly to cc9 at 80 km/h, towards the desired speed; none while g ≤ safe |
//!
//! *Slowing* is the larger of two decelerations:
//!
//! - *to keep apart*: what keeps the gap above cc0 if the lead goes on as it does, until it stands where it brakes, and a
//!   fifth more: Δv²/(2·(g − cc0)) behind a lead that keeps its speed, v²/(2·(g − cc0 + v_l²/(2·b_l))) behind one that
//!   will stand first;
//! - *to keep the safe gap*: Δv²/(2·(g − safe)), as long as that is comfortable. A driver who notices late that it closes
//!   in rather undercuts its safe gap for a while than brake hard for it. Behind a lead that brakes, the safe gap itself
//!   shrinks by cc1·b_l, and that much of the closing is none.
//!
//! # Where published variants differ, and which is followed
//! - The slower of the two speeds enters the safe gap, as in the formulas published by Aghabayk et al. (2013); in the
//!   steady state both are the same. SUMO takes the slower one with random noise on top.
//! - Vissim's manual defines cc8 as the acceleration *from standstill* and cc9 as that *at 80 km/h*; some open
//!   implementations (SUMO among them) add cc9·v to cc8 and cap the sum at cc8, which leaves cc9 without effect. The manual
//!   is followed; above 80 km/h the value at 80 km/h holds.
//! - The terms Δv²/(cc0 − g) for too near, ½·Δv²/(safe − g) for closing in and Δv²/(follow − g) for closing up, which open
//!   implementations have, diverge where the gap meets the threshold. Here each is the constant deceleration that removes
//!   Δv over the room left, continuous across the safe gap and bounded everywhere; closing up is free acceleration.
//! - SUMO's defaults are its own (its cc1 is 1.3 s, its cc2 8 m). Those published for Vissim are followed (0.9 s, 4 m).
//! - The published term for approaching leaves out the lead's braking, so that a hard-braking lead is noticed as emergency
//!   only; the one for emergency adds it as if it lasted for ever, so that one stops far behind a lead that stood first.
//! - A driver who has noticed that it closes in goes on until Δv is back at cc4. Where the threshold for noticing is used
//!   for that too, up to 1.5 m/s are left at 30 m of gap, and cc7 takes 4 m to remove them: below the safe gap. For the
//!   same reason it aims beyond the safe gap by the way that cc7 takes to remove cc4.
//! - The sign of the oscillation turns where Δv is half of what would be noticed, and early enough to keep the gap between
//!   its edges. In the published text it turns at the thresholds of Δv alone, so that the gap drifts out of [safe, follow].
//! - The manual gives cc0 no variation: behind a standing vehicle the driver rolls up to it, instead of standing still
//!   wherever in [cc0, cc0 + cc2] it happens to come to rest.
//! - No random terms: what varies between drivers is sampled as a parameter.

use super::thresholds::{Regime, Thresholds};
use super::{Parameters99, Wiedemann99};
use crate::braking::Behind;
use crate::driver::{HARDEST_BRAKING_MPS2, LIFT_OFF_MPS2, Lead};

/// 80 km/h, where cc9 holds [m/s].
const CC9_SPEED_MPS: f64 = 80.0 / 3.6;

/// Room below which no deceleration to keep the safe gap is worked out [m]: it would diverge.
const LEAST_ROOM_M: f64 = 0.5;

/// Hardest braking for the sake of the safe gap alone [m/s²]: the upper end of comfortable braking (ISO 15622:2018 lets
/// adaptive cruise control brake by up to 3.5 m/s² at speeds above 20 m/s).
const COMFORTABLE_MPS2: f64 = 3.5;

/// By how much a driver brakes harder than it thinks necessary in order to keep apart [1].
const BRAKING_MARGIN: f64 = 1.2;

/// Speed below which a lead stands [m/s].
const STANDING_MPS: f64 = 0.1;

/// Time constant with which the desired speed is approached [s].
const SPEED_TIME_S: f64 = 1.0;

/// Time that turning the oscillation of following takes the vehicle [s]: its actuators answer with a lag of 0.15 s to a
/// change from −cc7 to +cc7, twice of which is lost.
const TURNING_TIME_S: f64 = 0.3;

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
    pub fn new(settings: &Wiedemann99) -> Self {
        Self { parameters: settings.parameters, regime: Regime::Free, rising: false }
    }

    /// The regime that the latest acceleration came from.
    pub fn regime(&self) -> Regime {
        self.regime
    }

    /// The thresholds that hold at `speed_mps` behind `lead`; those of closing depend on what the driver has noticed.
    pub fn thresholds(&self, speed_mps: f64, lead: &Lead) -> Thresholds {
        Thresholds::new(&self.parameters, speed_mps, lead, self.regime)
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
        self.regime = thresholds.regime(lead.gap_m, opening_mps, self.parameters.cc0_m);
        match self.regime {
            Regime::Free if lead.gap_m > thresholds.safe_m => wish_mps2.min(self.free_mps2(speed_mps)),
            Regime::Free => wish_mps2.min(0.0),
            Regime::Following => {
                self.turn(&thresholds, lead, opening_mps);
                let swing_mps2 = if self.rising { self.parameters.cc7_mps2 } else { -self.parameters.cc7_mps2 };
                swing_mps2.min(wish_mps2)
            }
            Regime::Approaching => {
                self.rising = false;
                self.slowing_mps2(&thresholds, speed_mps, lead).min(wish_mps2)
            }
            Regime::Emergency => {
                self.rising = false;
                self.slowing_mps2(&thresholds, speed_mps, lead).min(-self.parameters.cc7_mps2)
            }
        }
    }

    /// Free acceleration [m/s²]: cc8 at standstill, cc9 from 80 km/h on.
    fn free_mps2(&self, speed_mps: f64) -> f64 {
        let Parameters99 { cc8_mps2, cc9_mps2, .. } = self.parameters;
        cc8_mps2 + (cc9_mps2 - cc8_mps2) * (speed_mps / CC9_SPEED_MPS).clamp(0.0, 1.0)
    }

    /// The acceleration of one who closes in: zero at most, and not below the hardest braking [m/s²].
    fn slowing_mps2(&self, thresholds: &Thresholds, speed_mps: f64, lead: &Lead) -> f64 {
        let p = &self.parameters;
        let margin_m = self.turning_way_m(p.cc4_mps);
        let to_keep_apart = Behind {
            speed_mps,
            lead_mps: lead.speed_mps,
            lead_mps2: lead.acceleration_mps2,
            room_m: lead.gap_m - p.cc0_m - margin_m,
        }
        .required_mps2();
        let shrinking_mps = p.cc1_s * (-lead.acceleration_mps2).max(0.0);
        let closing_mps = (speed_mps - lead.speed_mps - shrinking_mps).max(0.0);
        let room_m = (lead.gap_m - thresholds.safe_m - margin_m).max(LEAST_ROOM_M);
        let to_keep_safe = closing_mps * closing_mps / (2.0 * room_m);
        -to_keep_safe.min(COMFORTABLE_MPS2).max(BRAKING_MARGIN * to_keep_apart).min(HARDEST_BRAKING_MPS2)
    }

    /// The way that the oscillation takes to remove a difference of speeds, at most half of the band it swings in [m].
    fn turning_way_m(&self, opening_mps: f64) -> f64 {
        let p = &self.parameters;
        let way_m = opening_mps * opening_mps / (2.0 * p.cc7_mps2) + TURNING_TIME_S * opening_mps.abs();
        // Written so that cc7 = 0, with which the way is infinite or no number at all, gives the half band.
        if way_m < 0.5 * p.cc2_m { way_m } else { 0.5 * p.cc2_m }
    }

    /// Turns the oscillation of following: where the speed difference is half of what would be noticed, and early enough
    /// to keep the gap between its edges.
    fn turn(&mut self, thresholds: &Thresholds, lead: &Lead, opening_mps: f64) {
        // While the driver is the slower one its own speed sets the safe gap; what it will settle at is the lead's.
        let settling_m = self.parameters.cc0_m + self.parameters.cc1_s * lead.speed_mps.max(0.0);
        let turning_way_m = self.turning_way_m(opening_mps);
        let too_near = lead.gap_m - turning_way_m <= settling_m;
        let too_far = lead.gap_m + turning_way_m >= thresholds.follow_m;
        // A difference of zero is what a human perceives of any that is too small: then the gap alone decides.
        let rolls_up = lead.speed_mps < STANDING_MPS && !too_near && opening_mps > 0.5 * thresholds.closing_mps;
        if opening_mps <= 0.0 && too_near {
            self.rising = false;
        } else if rolls_up || (opening_mps >= 0.0 && too_far) || opening_mps > 0.5 * thresholds.opening_mps {
            self.rising = true;
        } else if opening_mps < 0.5 * thresholds.closing_mps {
            self.rising = false;
        }
    }
}

#[cfg(test)]
mod tests;
