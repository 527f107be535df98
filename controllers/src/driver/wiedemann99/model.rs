//! The Wiedemann 99 model: the acceleration in each regime.
//!
//! Here g is the gap, v the own speed, v_l the speed of the lead vehicle, Δv = v_l − v (negative
//! while closing), b_l the deceleration of the lead vehicle, and safe and follow are thresholds.
//! [`super::thresholds`] defines the thresholds and the regimes.
//!
//! | regime | acceleration |
//! |---|---|
//! | emergency | −slowing; braking is at least cc7 and at most the hardest of the driver |
//! | approaching | −slowing; braking is at most the hardest of the driver |
//! | following | ±cc7; the sign changes at the edges of the regime |
//! | free | from cc8 at standstill linearly to cc9 at 80 km/h, towards the desired speed; not above 0 while g ≤ safe |
//!
//! *Slowing* is the larger of two decelerations:
//!
//! - *To keep apart:* the deceleration that keeps the gap above cc0, increased by a fifth, if the
//!   lead vehicle continues as it does and, if it brakes, stops. Behind a lead vehicle that keeps
//!   its speed it is Δv²/(2·(g − cc0)); behind a lead vehicle that stops first it is v²/(2·(g − cc0
//!   + v_l²/(2·b_l))).
//! - *To keep the safe gap:* Δv²/(2·(g − safe)), limited to comfortable braking. A driver who
//!   notices late that the gap closes does not brake hard, but accepts a gap below the safe gap for
//!   some time. Behind a braking lead vehicle, the safe gap itself shrinks at the rate cc1·b_l;
//!   that part of the closing speed needs no braking.
//!
//! # Differences between published variants, and the choice made here
//! - The smaller of the two speeds enters the safe gap, as in the formulas published by Aghabayk et
//!   al. (2013). In the steady state both speeds are equal. SUMO adds random noise to the smaller
//!   speed.
//! - Vissim's manual defines cc8 as the acceleration *from standstill* and cc9 as that *at 80
//!   km/h*. Some open implementations (SUMO among them) add cc9·v to cc8 and limit the sum to cc8,
//!   so that cc9 has no effect. This model follows the manual; above 80 km/h, the value at 80 km/h
//!   holds.
//! - Open implementations use the terms Δv²/(cc0 − g) if the gap is too small, ½·Δv²/(safe − g)
//!   while closing and Δv²/(follow − g) while closing up. These diverge as the gap approaches the
//!   threshold. Here, each is replaced by the constant deceleration that removes Δv over the
//!   remaining distance; it is continuous across the safe gap and bounded everywhere. Closing up
//!   uses the free acceleration.
//! - SUMO has its own defaults (cc1 is 1.3 s, cc2 is 8 m). This model uses the defaults published
//!   for Vissim (0.9 s, 4 m).
//! - The published term for approaching omits the deceleration of the lead vehicle: a driver reacts
//!   to a hard-braking lead vehicle only in the emergency regime. The published term for emergency
//!   adds that deceleration as if it lasted for ever: the driver stops far behind a lead vehicle
//!   that has stopped first. This model uses the two decelerations above in both regimes.
//! - A driver who has noticed closing continues to slow down until Δv is back at cc4. If the
//!   threshold of noticing applied there, too, up to 1.5 m/s would remain at a gap of 30 m, and cc7
//!   would need 4 m to remove them: the gap would fall below the safe gap. For the same reason, the
//!   driver aims beyond the safe gap by the distance in which cc7 removes cc4.
//! - The sign of the oscillation changes at half of the noticeable Δv, and early enough to keep the
//!   gap between safe and follow. In the published text it changes at the thresholds of Δv alone,
//!   and the gap drifts out of that band.
//! - The manual gives cc0 no variation. Behind a standing vehicle, the driver therefore rolls up to
//!   cc0, instead of standing still anywhere between cc0 and cc0 + cc2.
//! - The model has no random terms. Variation between drivers is sampled as parameters.

use super::thresholds::{Regime, Thresholds};
use super::{Parameters99, Wiedemann99};
use crate::braking::Behind;
use crate::driver::{BRAKING_MARGIN, COASTING_DECELERATION_MPS2, Lead, STANDING_MPS};

/// Speed at which cc9 holds (m/s): 80 km/h.
const CC9_SPEED_MPS: f64 = 80.0 / 3.6;

/// Smallest distance that enters the deceleration to keep the safe gap (m): numerical; at zero it
/// diverges.
const MIN_ROOM_M: f64 = 0.5;

/// Hardest braking to keep the safe gap (m/s²): an assumption, what ISO 15622 allows an adaptive
/// cruise control from 20 m/s on. Published thresholds of comfort are 2 to 3.4.
const COMFORTABLE_MPS2: f64 = 3.5;

/// Time constant with which the driver approaches the desired speed (s): an assumption; 0.5 to 3
/// are plausible.
const SPEED_TIME_S: f64 = 1.0;

/// Time that the vehicle needs to reverse the oscillation of following (s): twice the actuator lag
/// of 0.15 s, because the acceleration changes from −cc7 to +cc7.
const REVERSAL_TIME_S: f64 = 0.3;

/// State of the Wiedemann 99 model for one driver.
#[derive(Clone, Copy, Debug)]
pub struct Wiedemann99Model {
    parameters: Parameters99,
    hardest_braking_mps2: f64,
    regime: Regime,
    /// True while the oscillation of following accelerates.
    accelerates: bool,
}

impl Wiedemann99Model {
    /// Creates a model with these settings, in the free regime.
    pub fn new(settings: &Wiedemann99) -> Self {
        Self {
            parameters: settings.parameters,
            hardest_braking_mps2: settings.hardest_braking_mps2,
            regime: Regime::Free,
            accelerates: false,
        }
    }

    /// Returns the regime of the latest acceleration.
    pub fn regime(&self) -> Regime {
        self.regime
    }

    /// Returns the thresholds at `speed_mps` behind `lead`. The closing threshold depends on
    /// whether the driver has noticed the closing.
    pub fn thresholds(&self, speed_mps: f64, lead: &Lead) -> Thresholds {
        Thresholds::new(&self.parameters, speed_mps, lead, self.regime)
    }

    /// Returns the acceleration at `speed_mps` behind `lead`, with the desired speed `desired_mps`
    /// (m/s²).
    ///
    /// For every finite input, braking is at most the hardest of the driver and the acceleration at
    /// most cc8.
    pub fn acceleration_mps2(&mut self, speed_mps: f64, desired_mps: f64, lead: Option<&Lead>) -> f64 {
        let speed_control_mps2 = ((desired_mps - speed_mps) / SPEED_TIME_S).max(-COASTING_DECELERATION_MPS2);
        let Some(lead) = lead else {
            self.regime = Regime::Free;
            return speed_control_mps2.min(self.free_mps2(speed_mps));
        };
        let thresholds = self.thresholds(speed_mps, lead);
        let opening_mps = lead.speed_mps - speed_mps;
        self.regime = thresholds.regime(lead.gap_m, opening_mps, self.parameters.cc0_m);
        match self.regime {
            Regime::Free if lead.gap_m > thresholds.safe_m => speed_control_mps2.min(self.free_mps2(speed_mps)),
            Regime::Free => speed_control_mps2.min(0.0),
            Regime::Following => {
                self.update_oscillation(&thresholds, lead, opening_mps);
                let oscillation_mps2 =
                    if self.accelerates { self.parameters.cc7_mps2 } else { -self.parameters.cc7_mps2 };
                oscillation_mps2.min(speed_control_mps2)
            }
            Regime::Approaching => {
                self.accelerates = false;
                self.slowing_mps2(&thresholds, speed_mps, lead).min(speed_control_mps2)
            }
            Regime::Emergency => {
                self.accelerates = false;
                self.slowing_mps2(&thresholds, speed_mps, lead).min(-self.parameters.cc7_mps2)
            }
        }
    }

    /// Returns the free acceleration (m/s²): cc8 at standstill, cc9 from 80 km/h on.
    fn free_mps2(&self, speed_mps: f64) -> f64 {
        let Parameters99 { cc8_mps2, cc9_mps2, .. } = self.parameters;
        cc8_mps2 + (cc9_mps2 - cc8_mps2) * (speed_mps / CC9_SPEED_MPS).clamp(0.0, 1.0)
    }

    /// Returns the acceleration of an approaching driver (m/s²): at most zero, limited to the
    /// hardest braking.
    fn slowing_mps2(&self, thresholds: &Thresholds, speed_mps: f64, lead: &Lead) -> f64 {
        let p = &self.parameters;
        let margin_m = self.reversal_distance_m(p.cc4_mps);
        let to_keep_apart = Behind {
            speed_mps,
            lead_mps: lead.speed_mps,
            lead_mps2: lead.acceleration_mps2,
            room_m: lead.gap_m - p.cc0_m - margin_m,
        }
        .required_mps2();
        let safe_gap_shrinking_mps = p.cc1_s * (-lead.acceleration_mps2).max(0.0);
        let closing_mps = (speed_mps - lead.speed_mps - safe_gap_shrinking_mps).max(0.0);
        let room_m = (lead.gap_m - thresholds.safe_m - margin_m).max(MIN_ROOM_M);
        let to_keep_safe_gap = closing_mps * closing_mps / (2.0 * room_m);
        -to_keep_safe_gap.min(COMFORTABLE_MPS2).max(BRAKING_MARGIN * to_keep_apart).min(self.hardest_braking_mps2)
    }

    /// Returns the distance in which the oscillation removes a speed difference (m), at most half
    /// of the width of the following band.
    fn reversal_distance_m(&self, opening_mps: f64) -> f64 {
        let p = &self.parameters;
        let distance_m = opening_mps * opening_mps / (2.0 * p.cc7_mps2) + REVERSAL_TIME_S * opening_mps.abs();
        // Written so that cc7 = 0, for which the distance is infinite or NaN, gives half of the
        // band.
        if distance_m < 0.5 * p.cc2_m { distance_m } else { 0.5 * p.cc2_m }
    }

    /// Updates the sign of the oscillation of following. It changes if the speed difference exceeds
    /// half of the noticeable one, and early enough to keep the gap between the edges of its band.
    fn update_oscillation(&mut self, thresholds: &Thresholds, lead: &Lead, opening_mps: f64) {
        // While the driver is slower, its own speed determines the safe gap. The gap settles at the
        // lead vehicle's speed.
        let settled_gap_m = self.parameters.cc0_m + self.parameters.cc1_s * lead.speed_mps.max(0.0);
        let reversal_distance_m = self.reversal_distance_m(opening_mps);
        let gap_too_small = lead.gap_m - reversal_distance_m <= settled_gap_m;
        let gap_too_large = lead.gap_m + reversal_distance_m >= thresholds.follow_m;
        // A human perceives any small difference as zero. In that case the gap alone decides.
        let rolls_up = lead.speed_mps < STANDING_MPS && !gap_too_small && opening_mps > 0.5 * thresholds.closing_mps;
        if opening_mps <= 0.0 && gap_too_small {
            self.accelerates = false;
        } else if rolls_up || (opening_mps >= 0.0 && gap_too_large) || opening_mps > 0.5 * thresholds.opening_mps {
            self.accelerates = true;
        } else if opening_mps < 0.5 * thresholds.closing_mps {
            self.accelerates = false;
        }
    }
}

#[cfg(test)]
mod tests;
