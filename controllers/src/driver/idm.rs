//! The Intelligent Driver Model (IDM), the second and simpler car-following model.
//!
//! Treiber, Hennecke and Helbing, *Congested traffic states in empirical observations and
//! microscopic simulations*, Physical Review E 62 (2000) 1805–1824, equations 1 and 2:
//!
//! a = A·(1 − (v/v₀)⁴ − (s*/g)²) with s* = s₀ + max(0, v·T + v·(v − v_l)/(2·√(A·B)))
//!
//! Here v is the own speed, v₀ the desired speed, v_l the speed of the lead vehicle and g the gap;
//! [`IdmConfig`] defines the parameters, whose defaults come from that paper. Above v₀, the free
//! term brakes with B at most; the published term grows with the fourth power of the speed.

use closecall_traffic::{Check, ConfigError, Num, Parameters, Range, Stream};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::attention::{Lapse, LapseConfig, check_lapse};
use super::pedals::{Pedals, check_brake_build_up};
use super::perception::{PerceivedVehicle, Perception, PerceptionConfig, PerceptionSettings, check_perception};
use super::reaction::{Reaction, ReactionChange, ReactionConfig};
use super::wiedemann99::{EmergencyBrakingDetector, brake_for_brake_light, default_desired_mps, nearest_lead};
use super::{Driver, DriverAction, DriverError, DriverInput, Lead, Looks, check_finite, check_hardest_braking, finite};

/// Largest comfortable deceleration that a scenario may give (m/s²): a limit of the configuration.
const MAX_COMFORTABLE_BRAKING_MPS2: f64 = 8.0;

/// Smallest gap that enters the interaction term (m): numerical; at a gap of zero the term
/// diverges.
const MIN_GAP_M: f64 = 0.1;

/// The Intelligent Driver Model as a scenario file describes it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct IdmConfig {
    /// Desired speed (m/s). Default: the larger of the road's speed limit and the vehicle's initial
    /// speed.
    pub desired_speed_mps: Option<Num>,
    /// Time gap T (s). Default: 1.5.
    pub time_gap_s: Option<Num>,
    /// Gap at standstill s₀ (m). Default: 2.
    pub standstill_gap_m: Option<Num>,
    /// Maximum acceleration A (m/s²). Default: 0.73.
    pub acceleration_mps2: Option<Num>,
    /// Comfortable deceleration B (m/s²). Default: 1.67.
    pub comfortable_braking_mps2: Option<Num>,
    /// Rate at which the driver builds up braking (m/s³): 1 to 100. Default: 12.65. It needs a
    /// reaction time.
    pub brake_build_up_mps3: Option<Num>,
    /// Hardest braking (m/s²): 4 to 9. Default: 6.7.
    pub hardest_braking_mps2: Option<Num>,
    /// Reaction time (s). Without it, the driver uses the true state of traffic at each step.
    pub reaction_s: Option<ReactionConfig>,
    /// How the driver perceives the vehicles ahead. It needs a reaction time.
    pub perception: Option<PerceptionConfig>,
    /// Lapses of attention. Default: none. They need a reaction time.
    pub lapse: Option<LapseConfig>,
}

/// The checked Intelligent Driver Model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Idm {
    pub(crate) desired_mps: Option<f64>,
    pub(crate) time_gap_s: f64,
    standstill_gap_m: f64,
    acceleration_mps2: f64,
    comfortable_braking_mps2: f64,
    brake_build_up_mps3: f64,
    pub(crate) hardest_braking_mps2: f64,
    pub(crate) reaction: Option<Reaction>,
    perception: PerceptionSettings,
    lapse: Option<Lapse>,
}

impl Check for IdmConfig {
    type Checked = Idm;

    fn check(&self, parameters: &Parameters) -> Result<Idm, ConfigError> {
        let number_or =
            |num: &Option<Num>, key, range, default| parameters.number_or(num.as_ref(), key, range, default);
        let desired = self.desired_speed_mps.as_ref();
        let reaction = self.reaction_s.as_ref().map(|config| config.check(parameters)).transpose()?;
        let reacts = reaction.is_some();
        let braking = Range::above(0.0, MAX_COMFORTABLE_BRAKING_MPS2);
        Ok(Idm {
            desired_mps: desired
                .map(|num| parameters.number(num, "desired-speed-mps", Range::above(0.0, 100.0)))
                .transpose()?,
            time_gap_s: number_or(&self.time_gap_s, "time-gap-s", Range::closed(0.0, 10.0), 1.5)?,
            standstill_gap_m: number_or(&self.standstill_gap_m, "standstill-gap-m", Range::above(0.0, 20.0), 2.0)?,
            acceleration_mps2: number_or(&self.acceleration_mps2, "acceleration-mps2", Range::above(0.0, 8.0), 0.73)?,
            comfortable_braking_mps2: number_or(
                &self.comfortable_braking_mps2,
                "comfortable-braking-mps2",
                braking,
                1.67,
            )?,
            hardest_braking_mps2: check_hardest_braking(self.hardest_braking_mps2.as_ref(), parameters)?,
            reaction,
            perception: check_perception(self.perception.as_ref(), reacts, parameters)?,
            lapse: check_lapse(self.lapse.as_ref(), reacts, parameters)?,
            brake_build_up_mps3: check_brake_build_up(self.brake_build_up_mps3.as_ref(), reacts, parameters)?,
        })
    }
}

impl Idm {
    /// Returns the same driver with another reaction.
    #[must_use]
    pub(crate) fn reacting(self, change: ReactionChange) -> Self {
        let lapse = self.lapse.filter(|_| change != ReactionChange::AtOnce);
        let reaction = self.reaction.map(|reaction| reaction.changed(change));
        Self { reaction, perception: self.perception.changed(change), lapse, ..self }
    }

    /// Returns the gap that the driver keeps behind a vehicle at `speed_mps`, s₀ + T·v (m).
    pub(crate) fn safe_gap_m(&self, speed_mps: f64) -> f64 {
        self.standstill_gap_m + self.time_gap_s * speed_mps
    }

    /// Creates a driver for one run.
    pub(crate) fn driver(&self) -> IdmDriver {
        IdmDriver {
            model: *self,
            perception: None,
            emergency: EmergencyBrakingDetector::new(self.hardest_braking_mps2),
            pedals: Pedals::new(self.brake_build_up_mps3),
            desired_mps: self.desired_mps,
        }
    }

    /// Returns the acceleration at `speed_mps` behind `lead` (m/s²). Braking is limited to the
    /// hardest of the driver.
    pub fn acceleration_mps2(&self, speed_mps: f64, desired_mps: f64, lead: Option<&Lead>) -> f64 {
        let ratio = if desired_mps > 0.0 { speed_mps / desired_mps } else { f64::from(u8::from(speed_mps > 0.0)) };
        let interaction = lead.map_or(0.0, |lead| {
            let closing = speed_mps * (speed_mps - lead.speed_mps);
            let two_sqrt_ab_mps2 = 2.0 * (self.acceleration_mps2 * self.comfortable_braking_mps2).sqrt();
            let desired_gap_m =
                self.standstill_gap_m + (speed_mps * self.time_gap_s + closing / two_sqrt_ab_mps2).max(0.0);
            (desired_gap_m / lead.gap_m.max(MIN_GAP_M)).powi(2)
        });
        // A driver above the desired speed brakes no harder than is comfortable.
        let free = (1.0 - ratio.powi(4)).max(-self.comfortable_braking_mps2 / self.acceleration_mps2);
        (self.acceleration_mps2 * (free - interaction)).max(-self.hardest_braking_mps2)
    }
}

/// A human driver who follows the lead vehicle by the Intelligent Driver Model.
#[derive(Clone, Debug)]
pub(crate) struct IdmDriver {
    model: Idm,
    desired_mps: Option<f64>,
    perception: Option<Perception>,
    emergency: EmergencyBrakingDetector,
    pedals: Pedals,
}

impl Driver for IdmDriver {
    fn step(&mut self, input: &DriverInput<'_>, rng: &mut Stream) -> Result<DriverAction, DriverError> {
        check_finite(input)?;
        let speed_mps = input.own.speed_mps;
        let long_term_mps = *self.desired_mps.get_or_insert_with(|| default_desired_mps(input));
        let desired_mps = input.desired_now_mps(long_term_mps);
        let requested_mps2 = if let Some(reaction) = self.model.reaction {
            let new = || {
                Perception::new(reaction.draw_s(rng), None)
                    .with_lapses(self.model.lapse)
                    .with_settings(self.model.perception)
            };
            let scene = self.perception.get_or_insert_with(new).observe(input, rng);
            let [ahead, beyond] = [scene.ahead.as_ref(), scene.beyond.as_ref()];
            let follow =
                |leader: &PerceivedVehicle| self.model.acceleration_mps2(speed_mps, desired_mps, Some(&leader.lead));
            let free = || self.model.acceleration_mps2(speed_mps, desired_mps, None);
            let requested_mps2 = brake_for_brake_light(ahead.map_or_else(free, follow), speed_mps, ahead);
            let requested_mps2 = self.model.perception.respond_mps2(requested_mps2, beyond.map(follow));
            self.pedals.apply_mps2(requested_mps2, input.time)
        } else {
            self.model.acceleration_mps2(speed_mps, desired_mps, nearest_lead(input).as_ref())
        };
        let acceleration_mps2 = finite(requested_mps2, "acceleration of a follower", input.time)?;
        Ok(DriverAction {
            acceleration_mps2,
            note: self.emergency.detect(acceleration_mps2),
            ..DriverAction::default()
        })
    }

    fn looks(&self) -> Looks {
        Looks { beyond: self.model.perception.looks_beyond(), ..Looks::AHEAD }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_equilibrium_gap_is_the_published_gap() {
        let idm = IdmConfig::default().check(&Parameters::default()).unwrap();
        // Equilibrium gap (Treiber 2000, equation 5): (s0 + v·T)/√(1 − (v/v0)⁴).
        let gap_m = (2.0 + 20.0 * 1.5) / (1.0 - (20.0_f64 / 33.3).powi(4)).sqrt();
        let lead = Lead { gap_m, speed_mps: 20.0, acceleration_mps2: 0.0 };
        assert!(idm.acceleration_mps2(20.0, 33.3, Some(&lead)).abs() < 1e-12);
        assert_eq!(idm.acceleration_mps2(30.0, 10.0, None), -1.67);
        let nearer = Lead { gap_m: gap_m - 5.0, ..lead };
        assert!(idm.acceleration_mps2(20.0, 33.3, Some(&nearer)) < 0.0);
    }
}
