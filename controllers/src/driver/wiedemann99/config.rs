//! The ten parameters cc0 to cc9, with the defaults published for Vissim.

use closecall_traffic::{Check, ConfigError, Num, Parameters, Range};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::driver::attention::{Lapse, LapseConfig, check_lapse};
use crate::driver::check_hardest_braking;
use crate::driver::pedals::check_brake_build_up;
use crate::driver::perception::{PerceptionConfig, PerceptionSettings, check_perception};
use crate::driver::reaction::{Reaction, ReactionChange, ReactionConfig};

/// The Wiedemann 99 model as a scenario file describes it. The defaults of cc0 to cc9 are those
/// published for Vissim.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct Wiedemann99Config {
    /// Gap at standstill (m). Default: 1.5.
    pub cc0_m: Option<Num>,
    /// Time headway kept in addition to cc0 (s). Default: 0.9.
    pub cc1_s: Option<Num>,
    /// Distance by which the gap may exceed the safe gap before the driver closes up (m). Default:
    /// 4.
    pub cc2_m: Option<Num>,
    /// Time before reaching the safe gap at which the driver begins to slow down, negative (s).
    /// Default: −8.
    pub cc3_s: Option<Num>,
    /// Closing speed tolerated while following, negative (m/s). Default: −0.35.
    pub cc4_mps: Option<Num>,
    /// Opening speed tolerated while following (m/s). Default: 0.35.
    pub cc5_mps: Option<Num>,
    /// Growth of these two thresholds with the square of the gap (10⁻⁴/(m·s)). Default: 11.44.
    pub cc6: Option<Num>,
    /// Acceleration of the oscillation while following (m/s²). Default: 0.25.
    pub cc7_mps2: Option<Num>,
    /// Free acceleration from standstill (m/s²). Default: 3.5.
    pub cc8_mps2: Option<Num>,
    /// Free acceleration at 80 km/h (m/s²). Default: 1.5.
    pub cc9_mps2: Option<Num>,
    /// Hardest braking (m/s²): 4 to 9. Default: 6.7.
    pub hardest_braking_mps2: Option<Num>,
    /// Desired speed (m/s). Default: the larger of the road's speed limit and the vehicle's initial
    /// speed; for an overtaking driver, its initial speed.
    pub desired_speed_mps: Option<Num>,
    /// Reaction time (s). With it, the driver perceives with a delay, notices speed differences
    /// only above the looming threshold, and reacts to brake lights. Without it, the driver uses
    /// the true state of traffic, and only the model's own perception thresholds apply.
    pub reaction_s: Option<ReactionConfig>,
    /// Lapses of attention. Default: none. They need a reaction time.
    pub lapse: Option<LapseConfig>,
    /// How the driver perceives the vehicles ahead. It needs a reaction time.
    pub perception: Option<PerceptionConfig>,
    /// Rate at which the driver builds up braking (m/s³): 1 to 100. Default: 12.65. It needs a
    /// reaction time.
    pub brake_build_up_mps3: Option<Num>,
}

/// The checked parameters cc0 to cc9.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Parameters99 {
    pub(crate) cc0_m: f64,
    pub(crate) cc1_s: f64,
    pub(crate) cc2_m: f64,
    pub(crate) cc3_s: f64,
    pub(crate) cc4_mps: f64,
    pub(crate) cc5_mps: f64,
    pub(crate) cc6: f64,
    pub(crate) cc7_mps2: f64,
    pub(crate) cc8_mps2: f64,
    pub(crate) cc9_mps2: f64,
}

impl Parameters99 {
    /// The defaults published for Vissim.
    pub(crate) const VISSIM: Self = Self {
        cc0_m: 1.5,
        cc1_s: 0.9,
        cc2_m: 4.0,
        cc3_s: -8.0,
        cc4_mps: -0.35,
        cc5_mps: 0.35,
        cc6: 11.44,
        cc7_mps2: 0.25,
        cc8_mps2: 3.5,
        cc9_mps2: 1.5,
    };
}

/// A checked Wiedemann 99 model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wiedemann99 {
    pub(crate) parameters: Parameters99,
    pub(crate) hardest_braking_mps2: f64,
    pub(crate) desired_speed_mps: Option<f64>,
    pub(crate) reaction: Option<Reaction>,
    pub(crate) lapse: Option<Lapse>,
    pub(crate) perception: PerceptionSettings,
    pub(crate) brake_build_up_mps3: f64,
}

impl Wiedemann99 {
    /// Returns the same driver with another reaction.
    #[must_use]
    pub(crate) fn reacting(self, change: ReactionChange) -> Self {
        let lapse = self.lapse.filter(|_| change != ReactionChange::AtOnce);
        let reaction = self.reaction.map(|reaction| reaction.changed(change));
        Self { reaction, perception: self.perception.changed(change), lapse, ..self }
    }

    /// Returns the safe gap behind a vehicle at `speed_mps`, cc0 + cc1·v (m).
    pub fn safe_gap_m(&self, speed_mps: f64) -> f64 {
        self.parameters.cc0_m + self.parameters.cc1_s * speed_mps
    }

    /// Returns the middle of the gaps that the driver keeps behind a vehicle at `speed_mps`, cc0 +
    /// cc1·v + cc2/2 (m).
    pub(crate) fn settled_gap_m(&self, speed_mps: f64) -> f64 {
        self.safe_gap_m(speed_mps) + 0.5 * self.parameters.cc2_m
    }
}

impl Check for Wiedemann99Config {
    type Checked = Wiedemann99;

    fn check(&self, parameters: &Parameters) -> Result<Wiedemann99, ConfigError> {
        let default = Parameters99::VISSIM;
        let number_or =
            |num: &Option<Num>, key, range, default| parameters.number_or(num.as_ref(), key, range, default);
        let desired_speed_mps = self.desired_speed_mps.as_ref();
        let reaction = self.reaction_s.as_ref();
        Ok(Wiedemann99 {
            parameters: Parameters99 {
                cc0_m: number_or(&self.cc0_m, "cc0-m", Range::closed(0.1, 20.0), default.cc0_m)?,
                cc1_s: number_or(&self.cc1_s, "cc1-s", Range::closed(0.0, 10.0), default.cc1_s)?,
                cc2_m: number_or(&self.cc2_m, "cc2-m", Range::closed(0.0, 50.0), default.cc2_m)?,
                cc3_s: number_or(&self.cc3_s, "cc3-s", Range::closed(-60.0, 0.0), default.cc3_s)?,
                cc4_mps: number_or(&self.cc4_mps, "cc4-mps", Range::closed(-10.0, 0.0), default.cc4_mps)?,
                cc5_mps: number_or(&self.cc5_mps, "cc5-mps", Range::closed(0.0, 10.0), default.cc5_mps)?,
                cc6: number_or(&self.cc6, "cc6", Range::closed(0.0, 100.0), default.cc6)?,
                cc7_mps2: number_or(&self.cc7_mps2, "cc7-mps2", Range::closed(0.0, 3.0), default.cc7_mps2)?,
                cc8_mps2: number_or(&self.cc8_mps2, "cc8-mps2", Range::above(0.0, 8.0), default.cc8_mps2)?,
                cc9_mps2: number_or(&self.cc9_mps2, "cc9-mps2", Range::above(0.0, 8.0), default.cc9_mps2)?,
            },
            hardest_braking_mps2: check_hardest_braking(self.hardest_braking_mps2.as_ref(), parameters)?,
            desired_speed_mps: desired_speed_mps
                .map(|num| parameters.number(num, "desired-speed-mps", Range::closed(0.0, 100.0)))
                .transpose()?,
            reaction: reaction.map(|config| config.check(parameters)).transpose()?,
            lapse: check_lapse(self.lapse.as_ref(), reaction.is_some(), parameters)?,
            perception: check_perception(self.perception.as_ref(), reaction.is_some(), parameters)?,
            brake_build_up_mps3: check_brake_build_up(
                self.brake_build_up_mps3.as_ref(),
                reaction.is_some(),
                parameters,
            )?,
        })
    }
}
