//! The ten parameters cc0 to cc9, with the defaults published for Vissim.

use closecall_traffic::{Check, ConfigError, Num, Parameters, Range};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::driver::attention::{Lapse, LapseConfig, check_lapse};
use crate::driver::reaction::{Reaction, ReactionConfig};

/// Wiedemann 99 as a scenario file describes it; what is absent has Vissim's published default.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct Wiedemann99Config {
    /// Gap at standstill [m]; 1.5.
    pub cc0_m: Option<Num>,
    /// Time headway kept beyond cc0 [s]; 0.9.
    pub cc1_s: Option<Num>,
    /// How far the gap may grow beyond the safe one before the driver closes up [m]; 4.
    pub cc2_m: Option<Num>,
    /// Time before reaching the safe gap at which the driver begins to slow down, negative [s]; −8.
    pub cc3_s: Option<Num>,
    /// Closing speed that is tolerated while following, negative [m/s]; −0.35.
    pub cc4_mps: Option<Num>,
    /// Opening speed that is tolerated while following [m/s]; 0.35.
    pub cc5_mps: Option<Num>,
    /// Growth of the two thresholds with the square of the gap [10⁻⁴ rad/s]; 11.44.
    pub cc6: Option<Num>,
    /// Acceleration of the oscillation while following [m/s²]; 0.25.
    pub cc7_mps2: Option<Num>,
    /// Free acceleration from standstill [m/s²]; 3.5.
    pub cc8_mps2: Option<Num>,
    /// Free acceleration at 80 km/h [m/s²]; 1.5.
    pub cc9_mps2: Option<Num>,
    /// Speed that the driver wants [m/s]; where absent the road's limit, or its speed at the start if that is higher. An
    /// overtaking driver wants the speed at which it comes up.
    pub desired_speed_mps: Option<Num>,
    /// Reaction time [s]. Where absent the model drives alone, with the perception thresholds that it has itself; where
    /// given, the driver perceives late, notices speed differences above the looming threshold only, and sees brake
    /// lights.
    pub reaction_s: Option<ReactionConfig>,
    /// Lapses of attention; none where absent. They need a reaction time.
    pub lapse: Option<LapseConfig>,
}

/// The ten parameters.
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

/// Checked Wiedemann 99.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wiedemann99 {
    pub(crate) parameters: Parameters99,
    pub(crate) desired_speed_mps: Option<f64>,
    pub(crate) reaction: Option<Reaction>,
    pub(crate) lapse: Option<Lapse>,
}

impl Wiedemann99 {
    /// The safe gap behind a vehicle at `speed_mps`: cc0 + cc1·v [m].
    pub fn safe_gap_m(&self, speed_mps: f64) -> f64 {
        self.parameters.cc0_m + self.parameters.cc1_s * speed_mps
    }
}

impl Check for Wiedemann99Config {
    type Checked = Wiedemann99;

    fn check(&self, parameters: &Parameters) -> Result<Wiedemann99, ConfigError> {
        let default = Parameters99::VISSIM;
        let or = |num: &Option<Num>, key, range, default| match num {
            Some(num) => parameters.number(num, key, range),
            None => Ok(default),
        };
        let desired_speed_mps = self.desired_speed_mps.as_ref();
        let reaction = self.reaction_s.as_ref();
        Ok(Wiedemann99 {
            parameters: Parameters99 {
                cc0_m: or(&self.cc0_m, "cc0-m", Range::closed(0.1, 20.0), default.cc0_m)?,
                cc1_s: or(&self.cc1_s, "cc1-s", Range::closed(0.0, 10.0), default.cc1_s)?,
                cc2_m: or(&self.cc2_m, "cc2-m", Range::closed(0.0, 50.0), default.cc2_m)?,
                cc3_s: or(&self.cc3_s, "cc3-s", Range::closed(-60.0, 0.0), default.cc3_s)?,
                cc4_mps: or(&self.cc4_mps, "cc4-mps", Range::closed(-10.0, 0.0), default.cc4_mps)?,
                cc5_mps: or(&self.cc5_mps, "cc5-mps", Range::closed(0.0, 10.0), default.cc5_mps)?,
                cc6: or(&self.cc6, "cc6", Range::closed(0.0, 100.0), default.cc6)?,
                cc7_mps2: or(&self.cc7_mps2, "cc7-mps2", Range::closed(0.0, 3.0), default.cc7_mps2)?,
                cc8_mps2: or(&self.cc8_mps2, "cc8-mps2", Range::above(0.0, 8.0), default.cc8_mps2)?,
                cc9_mps2: or(&self.cc9_mps2, "cc9-mps2", Range::above(0.0, 8.0), default.cc9_mps2)?,
            },
            desired_speed_mps: desired_speed_mps
                .map(|num| parameters.number(num, "desired-speed-mps", Range::closed(0.0, 100.0)))
                .transpose()?,
            reaction: reaction.map(|config| config.check(parameters)).transpose()?,
            lapse: check_lapse(self.lapse.as_ref(), reaction.is_some(), parameters)?,
        })
    }
}
