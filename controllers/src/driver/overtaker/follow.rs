//! The car-following model of an overtaking driver: Wiedemann 99 or the Intelligent Driver Model.

use closecall_traffic::{Check, ConfigError, Parameters, Problem};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::driver::{Idm, IdmConfig, Lead, Wiedemann99, Wiedemann99Config, Wiedemann99Model};

/// Car-following model of a human driver: of an overtaking one, or of the ego.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FollowConfig {
    /// The Wiedemann 99 model.
    Wiedemann99(Wiedemann99Config),
    /// The Intelligent Driver Model.
    Idm(IdmConfig),
}

/// A checked car-following model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Follow {
    /// The Wiedemann 99 model.
    Wiedemann99(Wiedemann99),
    /// The Intelligent Driver Model.
    Idm(Idm),
}

impl Check for FollowConfig {
    type Checked = Follow;

    fn check(&self, parameters: &Parameters) -> Result<Follow, ConfigError> {
        let (name, follow) = match self {
            Self::Wiedemann99(config) => ("wiedemann99", config.check(parameters).map(Follow::Wiedemann99)),
            Self::Idm(config) => ("idm", config.check(parameters).map(Follow::Idm)),
        };
        let locate = |error: ConfigError| error.within(name).within("follow");
        let follow = follow.map_err(locate)?;
        if follow.has_reaction() {
            let rule = "the overtaking driver has one reaction time, which stands beside `follow`".to_owned();
            let problem = Problem::Contradiction { other: "overtaker.reaction-s", rule };
            return Err(locate(ConfigError::new("reaction-s", problem)));
        }
        Ok(follow)
    }
}

impl Follow {
    fn has_reaction(&self) -> bool {
        match self {
            Self::Wiedemann99(model) => model.reaction.is_some(),
            Self::Idm(model) => model.reaction.is_some(),
        }
    }

    /// Returns the gap that the driver keeps behind a vehicle at `speed_mps` (m).
    pub(crate) fn safe_gap_m(&self, speed_mps: f64) -> f64 {
        match self {
            Self::Wiedemann99(model) => model.safe_gap_m(speed_mps),
            Self::Idm(model) => model.safe_gap_m(speed_mps),
        }
    }

    /// Returns the gap at which the driver follows a vehicle at `speed_mps` in equilibrium (m).
    pub(crate) fn settled_gap_m(&self, speed_mps: f64) -> f64 {
        match self {
            Self::Wiedemann99(model) => model.settled_gap_m(speed_mps),
            Self::Idm(model) => model.safe_gap_m(speed_mps),
        }
    }

    /// Returns the time headway that the driver keeps: cc1, or T (s).
    pub(crate) fn headway_s(&self) -> f64 {
        match self {
            Self::Wiedemann99(model) => model.parameters.cc1_s,
            Self::Idm(model) => model.time_gap_s,
        }
    }

    /// Returns the hardest braking of the driver (m/s²).
    pub(crate) fn hardest_braking_mps2(&self) -> f64 {
        match self {
            Self::Wiedemann99(model) => model.hardest_braking_mps2,
            Self::Idm(model) => model.hardest_braking_mps2,
        }
    }

    /// Returns the desired speed, if the scenario gives one (m/s).
    pub(crate) fn desired_mps(&self) -> Option<f64> {
        match self {
            Self::Wiedemann99(model) => model.desired_speed_mps,
            Self::Idm(model) => model.desired_mps,
        }
    }

    /// Returns the model for one run.
    pub(super) fn model(&self) -> FollowModel {
        match self {
            Self::Wiedemann99(model) => FollowModel::Wiedemann99(Wiedemann99Model::new(model)),
            Self::Idm(model) => FollowModel::Idm(*model),
        }
    }
}

/// A car-following model during a run.
#[derive(Clone, Copy, Debug)]
pub(super) enum FollowModel {
    Wiedemann99(Wiedemann99Model),
    /// The Intelligent Driver Model.
    Idm(Idm),
}

impl FollowModel {
    /// Returns the acceleration at `speed_mps` behind `lead`, with the desired speed `desired_mps`
    /// (m/s²).
    pub(super) fn acceleration_mps2(&mut self, speed_mps: f64, desired_mps: f64, lead: Option<&Lead>) -> f64 {
        match self {
            Self::Wiedemann99(model) => model.acceleration_mps2(speed_mps, desired_mps, lead),
            Self::Idm(model) => model.acceleration_mps2(speed_mps, desired_mps, lead),
        }
    }
}
