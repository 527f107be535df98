//! The human driver of the ego: who drives in the arms `human-aeb` and `human+aeb`.
//!
//! ```text
//!  eyes ────▶ driver ──── acceleration ────┐
//!                                          ├─▶ the smaller of the two ─▶ ego
//!  sensors ─▶ emergency braking ─ braking ─┘
//! ```
//!
//! It is one of the human drivers that follow other vehicles. Like them it sees the true traffic,
//! late and imprecisely, and not the tracks of the sensors. Emergency braking is the only function
//! beside it: no cruise control, and no margin increase system.

use closecall_traffic::{Check, ConfigError, Parameters};

use crate::driver::{Driver, FollowConfig, Idm, Wiedemann99, Wiedemann99Driver};

/// The checked human driver of the ego.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EgoDriver {
    /// A driver that follows by Wiedemann 99.
    Wiedemann99(Wiedemann99),
    /// A driver that follows by the Intelligent Driver Model.
    Idm(Idm),
}

impl EgoDriver {
    /// Checks the table `human` of an ego stack. Reaction, lapses and perception belong to the
    /// car-following model here.
    ///
    /// # Errors
    /// [`ConfigError`] if a value is out of range.
    pub(super) fn check(config: &FollowConfig, parameters: &Parameters) -> Result<Self, ConfigError> {
        match config {
            FollowConfig::Wiedemann99(config) => {
                config.check(parameters).map(Self::Wiedemann99).map_err(|error| error.within("wiedemann99"))
            }
            FollowConfig::Idm(config) => config.check(parameters).map(Self::Idm).map_err(|error| error.within("idm")),
        }
    }

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
