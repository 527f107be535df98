//! The ego stack as a scenario file describes it.

use closecall_traffic::{Check, ConfigError, Parameters};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Acc, AccConfig, Aeb, AebConfig, EgoController, EgoStack, MisConfig, MisSettings};

/// The ego stack as a scenario file describes it. A function that is absent does not exist.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct EgoStackConfig {
    /// Adaptive cruise control.
    pub acc: AccConfig,
    /// Emergency braking.
    pub aeb: Option<AebConfig>,
    /// The margin increase system.
    pub mis: Option<MisConfig>,
    /// Whether E is in automated mode. Where it is not, the margin increase system never engages; the same control laws
    /// then stand for an attentive driver.
    #[serde(default = "automated")]
    pub automated: bool,
}

fn automated() -> bool {
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
    /// The same stack without the margin increase system: the controller `acc`.
    #[must_use]
    pub fn without_mis(self) -> Self {
        Self { mis: None, ..self }
    }

    /// The settings of the margin increase system, where there is one.
    pub fn mis(&self) -> Option<&MisSettings> {
        self.mis.as_ref()
    }

    /// The time gap that the adaptive cruise control keeps [s].
    pub fn time_gap_s(&self) -> f64 {
        self.acc.time_gap_s
    }

    /// A fresh controller for one run.
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
