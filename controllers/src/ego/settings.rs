//! The ego stack as a scenario file describes it.

use closecall_traffic::{Check, ConfigError, Parameters};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::acc::GapPolicy;
use super::{Acc, AccConfig, Aeb, AebConfig, EgoController, EgoStack, Horizon, MisConfig, MisSettings};

/// The ego stack as a scenario file describes it. An absent function is not part of the stack.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct EgoStackConfig {
    /// Adaptive cruise control.
    pub acc: AccConfig,
    /// Emergency braking.
    pub aeb: Option<AebConfig>,
    /// The margin increase system.
    pub mis: Option<MisConfig>,
    /// Whether the ego is in automated mode. If not, the margin increase system never engages; the
    /// same control laws then represent an attentive driver.
    #[serde(default = "default_automated")]
    pub automated: bool,
}

fn default_automated() -> bool {
    true
}

/// A checked ego stack.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct EgoSettings {
    pub(crate) acc: Acc,
    pub(crate) aeb: Option<Aeb>,
    pub(crate) mis: Option<MisSettings>,
    pub(crate) automated: bool,
}

impl EgoSettings {
    /// Returns the same stack without the margin increase system: the controller `acc`.
    #[must_use]
    pub fn without_mis(self) -> Self {
        Self { mis: None, ..self }
    }

    /// Returns the same stack without the margin increase system, and with another constant time
    /// gap (s): the controllers `gap-<seconds>`.
    #[must_use]
    pub fn with_time_gap(self, time_gap_s: f64) -> Self {
        Self { acc: Acc { time_gap_s, policy: GapPolicy::Constant, ..self.acc }, ..self.without_mis() }
    }

    /// Returns the same stack without the margin increase system, and with the minimum following
    /// distance of UN Regulation 157: the controller `r157-gap`.
    #[must_use]
    pub fn with_r157_gap(self) -> Self {
        Self { acc: Acc { policy: GapPolicy::R157, ..self.acc }, ..self.without_mis() }
    }

    /// Returns the stack of the fuzzy safety model of UN Regulation 157: the same cruise control
    /// with the gap of the model, and nothing else. The model brakes instead of the emergency
    /// braking system: the controller `r157-fsm`.
    #[must_use]
    pub fn with_fuzzy_safety(self) -> Self {
        Self { acc: Acc { policy: GapPolicy::FuzzySafety, ..self.acc }, aeb: None, ..self.without_mis() }
    }

    /// Returns the same stack with the extended margin increase system, if it has one at all: the
    /// controller `mis-extended`.
    #[must_use]
    pub fn with_extended_mis(self) -> Self {
        Self { mis: self.mis.map(MisSettings::extended), ..self }
    }

    /// Returns the same stack with a margin increase system that plans for the time to closest
    /// encounter, if it has one at all: the controller `mis-ttce`.
    #[must_use]
    pub fn with_ttce_mis(self) -> Self {
        Self { mis: self.mis.map(|mis| MisSettings { horizon: Horizon::Ttce, ..mis }), ..self }
    }

    /// Returns the gap that the adaptive cruise control keeps at `speed_mps` (m).
    pub fn desired_gap_m(&self, speed_mps: f64) -> f64 {
        self.acc.desired_gap_m(speed_mps)
    }

    /// Returns the settings of the margin increase system, or `None` if the stack has none.
    pub fn mis(&self) -> Option<&MisSettings> {
        self.mis.as_ref()
    }

    /// Returns the time gap of the adaptive cruise control (s).
    pub fn time_gap_s(&self) -> f64 {
        self.acc.time_gap_s
    }

    /// Builds a new controller for one run.
    pub fn build(&self) -> Box<dyn EgoController> {
        Box::new(EgoStack::new(*self))
    }
}

impl Check for EgoStackConfig {
    type Checked = EgoSettings;

    fn check(&self, parameters: &Parameters) -> Result<EgoSettings, ConfigError> {
        let aeb = self.aeb.as_ref().map(|config| config.check(parameters).map_err(|error| error.within("aeb")));
        let mis = self.mis.as_ref().map(|config| config.check(parameters).map_err(|error| error.within("mis")));
        Ok(EgoSettings {
            acc: self.acc.check(parameters).map_err(|error| error.within("acc"))?,
            aeb: aeb.transpose()?,
            mis: mis.transpose()?,
            automated: self.automated,
        })
    }
}
