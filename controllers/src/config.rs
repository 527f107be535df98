//! The `driver` table of an actor: who drives it.

use closecall_traffic::{Check, ConfigError, Parameters};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::driver::{
    Driver, Idm, IdmConfig, Overtaker, OvertakerConfig, Prescribed, PrescribedConfig, Wiedemann99Config,
    Wiedemann99Driver,
};
use crate::ego::{EgoSettings, EgoStackConfig};

/// Who drives an actor, as a scenario file describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DriverConfig {
    /// The controller under test, with its adaptive cruise control, emergency braking and margin increase system.
    EgoStack(EgoStackConfig),
    /// A list of times and speeds, followed whatever the others do.
    Prescribed(PrescribedConfig),
    /// A human who follows by Wiedemann's model of 1999 and stays in its lane.
    Wiedemann99(Wiedemann99Config),
    /// A human who follows by the Intelligent Driver Model and stays in its lane.
    Idm(IdmConfig),
    /// A human who comes up fast, closes to a low headway and overtakes.
    Overtaker(OvertakerConfig),
}

/// A driver that cannot be invalid.
#[derive(Clone, Debug, PartialEq)]
pub enum CheckedDriver {
    /// The controller under test.
    Ego(EgoSettings),
    /// A human driver.
    Human(HumanDriver),
}

/// A human driver that cannot be invalid.
#[derive(Clone, Debug, PartialEq)]
pub enum HumanDriver {
    /// A list of times and speeds.
    Prescribed(Prescribed),
    /// Follows by Wiedemann 99.
    Wiedemann99(crate::driver::Wiedemann99),
    /// Follows by the Intelligent Driver Model.
    Idm(Idm),
    /// Comes up fast and overtakes.
    Overtaker(Overtaker),
}

impl HumanDriver {
    /// A fresh driver for one run. All that it needs is allocated here.
    pub fn build(&self) -> Box<dyn Driver> {
        match self {
            Self::Prescribed(profile) => Box::new(profile.driver()),
            Self::Wiedemann99(settings) => Box::new(Wiedemann99Driver::new(*settings)),
            Self::Idm(settings) => Box::new(settings.driver()),
            Self::Overtaker(settings) => Box::new(settings.driver()),
        }
    }
}

impl Check for DriverConfig {
    type Checked = CheckedDriver;

    fn check(&self, parameters: &Parameters) -> Result<CheckedDriver, ConfigError> {
        match self {
            Self::EgoStack(config) => {
                config.check(parameters).map(CheckedDriver::Ego).map_err(|error| error.within("ego-stack"))
            }
            Self::Prescribed(config) => human(config, parameters, HumanDriver::Prescribed, "prescribed"),
            Self::Wiedemann99(config) => human(config, parameters, HumanDriver::Wiedemann99, "wiedemann99"),
            Self::Idm(config) => human(config, parameters, HumanDriver::Idm, "idm"),
            Self::Overtaker(config) => human(config, parameters, HumanDriver::Overtaker, "overtaker"),
        }
    }
}

fn human<C: Check>(
    config: &C,
    parameters: &Parameters,
    kind: fn(C::Checked) -> HumanDriver,
    key: &str,
) -> Result<CheckedDriver, ConfigError> {
    config.check(parameters).map(kind).map(CheckedDriver::Human).map_err(|error| error.within(key))
}
