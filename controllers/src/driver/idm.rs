//! The Intelligent Driver Model, as a second and simpler model of following.
//!
//! Treiber, Hennecke and Helbing, *Congested traffic states in empirical observations and microscopic simulations*,
//! Physical Review E 62 (2000) 1805–1824, equations 1 and 2:
//! a = A·[1 − (v/v₀)⁴ − (s*/g)²] with s* = s₀ + max(0, v·T + v·(v − v_l)/(2·√(A·B))). Beyond v₀ the free term brakes with B at
//! most, where the published one grows with the fourth power.

use closecall_traffic::{Check, ConfigError, Num, Parameters, Range, Stream};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::attention::{Lapse, LapseConfig, check_lapse};
use super::perception::Perception;
use super::reaction::{Reaction, ReactionConfig};
use super::wiedemann99::{Emergency, brake_for_light, nearest, usually_desired_mps};
use super::{Driver, DriverAction, DriverError, DriverInput, HARDEST_BRAKING_MPS2, Lead, check_finite, finite};

/// Gap below which the interaction no longer grows [m]: it would diverge.
const LEAST_GAP_M: f64 = 0.1;

/// The Intelligent Driver Model as a scenario file describes it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct IdmConfig {
    /// Speed that the driver wants [m/s]; where absent the road's limit, or its speed at the start if that is higher.
    pub desired_speed_mps: Option<Num>,
    /// Time gap T [s]; 1.5.
    pub time_gap_s: Option<Num>,
    /// Gap at standstill s₀ [m]; 2.
    pub standstill_gap_m: Option<Num>,
    /// Largest acceleration A [m/s²]; 1.4.
    pub acceleration_mps2: Option<Num>,
    /// Comfortable braking B [m/s²]; 2.
    pub comfortable_braking_mps2: Option<Num>,
    /// Reaction time [s]; none where absent.
    pub reaction_s: Option<ReactionConfig>,
    /// Lapses of attention; none where absent. They need a reaction time.
    pub lapse: Option<LapseConfig>,
}

/// A checked Intelligent Driver Model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Idm {
    desired_mps: Option<f64>,
    time_gap_s: f64,
    standstill_gap_m: f64,
    acceleration_mps2: f64,
    comfortable_braking_mps2: f64,
    reaction: Option<Reaction>,
    lapse: Option<Lapse>,
}

impl Check for IdmConfig {
    type Checked = Idm;

    fn check(&self, parameters: &Parameters) -> Result<Idm, ConfigError> {
        let or = |num: &Option<Num>, key, range, default| match num {
            Some(num) => parameters.number(num, key, range),
            None => Ok(default),
        };
        let desired = self.desired_speed_mps.as_ref();
        let reaction = self.reaction_s.as_ref();
        let braking = Range::above(0.0, HARDEST_BRAKING_MPS2);
        Ok(Idm {
            desired_mps: desired
                .map(|num| parameters.number(num, "desired-speed-mps", Range::above(0.0, 100.0)))
                .transpose()?,
            time_gap_s: or(&self.time_gap_s, "time-gap-s", Range::closed(0.0, 10.0), 1.5)?,
            standstill_gap_m: or(&self.standstill_gap_m, "standstill-gap-m", Range::above(0.0, 20.0), 2.0)?,
            acceleration_mps2: or(&self.acceleration_mps2, "acceleration-mps2", Range::above(0.0, 8.0), 1.4)?,
            comfortable_braking_mps2: or(&self.comfortable_braking_mps2, "comfortable-braking-mps2", braking, 2.0)?,
            reaction: reaction.map(|config| config.check(parameters)).transpose()?,
            lapse: check_lapse(self.lapse.as_ref(), reaction.is_some(), parameters)?,
        })
    }
}

impl Idm {
    /// A driver for one run.
    pub(crate) fn driver(&self) -> IdmDriver {
        IdmDriver { model: *self, perception: None, emergency: Emergency::default(), desired_mps: self.desired_mps }
    }

    /// The acceleration at `speed_mps` behind `lead` [m/s²], at most 8 m/s² of braking.
    fn acceleration_mps2(&self, speed_mps: f64, desired_mps: f64, lead: Option<&Lead>) -> f64 {
        let ratio = if desired_mps > 0.0 { speed_mps / desired_mps } else { f64::from(u8::from(speed_mps > 0.0)) };
        let interaction = lead.map_or(0.0, |lead| {
            let closing = speed_mps * (speed_mps - lead.speed_mps);
            let softness = 2.0 * (self.acceleration_mps2 * self.comfortable_braking_mps2).sqrt();
            let wanted_m = self.standstill_gap_m + (speed_mps * self.time_gap_s + closing / softness).max(0.0);
            (wanted_m / lead.gap_m.max(LEAST_GAP_M)).powi(2)
        });
        // For its wish alone nobody brakes harder than is comfortable.
        let free = (1.0 - ratio.powi(4)).max(-self.comfortable_braking_mps2 / self.acceleration_mps2);
        (self.acceleration_mps2 * (free - interaction)).max(-HARDEST_BRAKING_MPS2)
    }
}

/// A human who follows by the Intelligent Driver Model.
#[derive(Clone, Debug)]
pub(crate) struct IdmDriver {
    model: Idm,
    desired_mps: Option<f64>,
    perception: Option<Perception>,
    emergency: Emergency,
}

impl Driver for IdmDriver {
    fn step(&mut self, input: &DriverInput<'_>, rng: &mut Stream) -> Result<DriverAction, DriverError> {
        check_finite(input)?;
        let speed_mps = input.own.speed_mps;
        let usual_mps = *self.desired_mps.get_or_insert_with(|| usually_desired_mps(input));
        let desired_mps = input.desired_now_mps(usual_mps);
        let wanted = if let Some(reaction) = self.model.reaction {
            let new = || Perception::new(reaction.draw(rng), None).with_lapses(self.model.lapse);
            let ahead = self.perception.get_or_insert_with(new).look(input, rng).ahead;
            let wanted = self.model.acceleration_mps2(speed_mps, desired_mps, ahead.as_ref().map(|seen| &seen.lead));
            brake_for_light(wanted, speed_mps, ahead.as_ref())
        } else {
            self.model.acceleration_mps2(speed_mps, desired_mps, nearest(input).as_ref())
        };
        let acceleration_mps2 = finite(wanted, "acceleration of a follower", input.time)?;
        Ok(DriverAction { acceleration_mps2, note: self.emergency.note(acceleration_mps2), ..DriverAction::default() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn in_equilibrium_the_gap_is_the_published_one() {
        let idm = IdmConfig::default().check(&Parameters::default()).unwrap();
        // Equilibrium gap (Treiber 2000, equation 5): (s0 + v·T)/√(1 − (v/v0)⁴).
        let gap_m = (2.0 + 20.0 * 1.5) / (1.0 - (20.0_f64 / 33.3).powi(4)).sqrt();
        let lead = Lead { gap_m, speed_mps: 20.0, acceleration_mps2: 0.0 };
        assert!(idm.acceleration_mps2(20.0, 33.3, Some(&lead)).abs() < 1e-12);
        assert_eq!(idm.acceleration_mps2(30.0, 10.0, None), -2.0);
        let nearer = Lead { gap_m: gap_m - 5.0, ..lead };
        assert!(idm.acceleration_mps2(20.0, 33.3, Some(&nearer)) < 0.0);
    }
}
