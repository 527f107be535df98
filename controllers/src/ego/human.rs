//! The human driver of the ego: who drives in the arms `human-aeb` and `human+aeb`.
//!
//! ```text
//!  eyes ────▶ driver ──── acceleration ────┐
//!                                          ├─▶ the smaller of the two ─▶ ego
//!  sensors ─▶ emergency braking ─ braking ─┘
//! ```
//!
//! It is one of the human drivers that follow other vehicles. Like them it sees the true traffic, late and imprecisely, and not the
//! tracks of the sensors. Emergency braking is the only function beside it: no cruise control, and no margin increase system.

use closecall_traffic::{Check, ConfigError, Parameters};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::driver::{Driver, Idm, IdmConfig, Wiedemann99, Wiedemann99Config, Wiedemann99Driver};

/// The human driver of the ego as a scenario file describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum EgoDriverConfig {
    /// A human driver that follows by Wiedemann's model of 1999.
    Wiedemann99(Wiedemann99Config),
    /// A human driver that follows by the Intelligent Driver Model.
    Idm(IdmConfig),
}

/// The checked human driver of the ego.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EgoDriver {
    /// A driver that follows by Wiedemann 99.
    Wiedemann99(Wiedemann99),
    /// A driver that follows by the Intelligent Driver Model.
    Idm(Idm),
}

impl EgoDriver {
    /// Returns the gap at which the driver follows a vehicle at `speed_mps` in equilibrium (m).
    pub fn settled_gap_m(&self, speed_mps: f64) -> f64 {
        match self {
            Self::Wiedemann99(settings) => settings.settled_gap_m(speed_mps),
            Self::Idm(settings) => settings.safe_gap_m(speed_mps),
        }
    }

    /// Builds a new driver for one run.
    pub fn build(&self) -> Box<dyn Driver> {
        match self {
            Self::Wiedemann99(settings) => Box::new(Wiedemann99Driver::new(*settings)),
            Self::Idm(settings) => Box::new(settings.driver()),
        }
    }
}

impl Check for EgoDriverConfig {
    type Checked = EgoDriver;

    fn check(&self, parameters: &Parameters) -> Result<EgoDriver, ConfigError> {
        match self {
            Self::Wiedemann99(config) => {
                config.check(parameters).map(EgoDriver::Wiedemann99).map_err(|error| error.within("wiedemann99"))
            }
            Self::Idm(config) => config.check(parameters).map(EgoDriver::Idm).map_err(|error| error.within("idm")),
        }
    }
}
