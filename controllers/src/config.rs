//! The `driver` table of an actor: who drives the vehicle. [`DriverConfig`] is the text, and
//! [`CheckedDriver`] the checked driver, which builds a driver for each run.

use closecall_traffic::{Check, ConfigError, Parameters};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::driver::{
    Driver, Follow, Idm, IdmConfig, MergingDriver, Overtaker, OvertakerConfig, Prescribed, PrescribedConfig, Reaction,
    ReactionChange, Wiedemann99, Wiedemann99Config, Wiedemann99Driver,
};
use crate::ego::{EgoSettings, EgoStackConfig};

/// The driver of an actor as a scenario file describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DriverConfig {
    /// The controller under test: adaptive cruise control, emergency braking and margin increase
    /// system.
    EgoStack(EgoStackConfig),
    /// A list of times and speeds, followed regardless of the other vehicles.
    Prescribed(PrescribedConfig),
    /// A human driver that follows by Wiedemann's model of 1999 and stays in its lane.
    Wiedemann99(Wiedemann99Config),
    /// A human driver that follows by the Intelligent Driver Model and stays in its lane.
    Idm(IdmConfig),
    /// A human driver that approaches fast, closes to a short time headway and overtakes.
    Overtaker(OvertakerConfig),
}

/// A checked driver, which cannot be invalid.
#[derive(Clone, Debug, PartialEq)]
pub enum CheckedDriver {
    /// The controller under test.
    Ego(EgoSettings),
    /// A human driver.
    Human(HumanDriver),
}

impl CheckedDriver {
    /// Returns the same driver for the mirrored world, in which left and right are exchanged. Only
    /// a prescribed driver changes: the others read the overtaking side from the road.
    #[must_use]
    pub fn mirrored(&self) -> Self {
        match self {
            Self::Human(HumanDriver::Prescribed(profile)) => Self::Human(HumanDriver::Prescribed(profile.mirrored())),
            other => other.clone(),
        }
    }
}

/// A checked human driver, which cannot be invalid.
#[derive(Clone, Debug, PartialEq)]
pub enum HumanDriver {
    /// A list of times and speeds.
    Prescribed(Prescribed),
    /// A driver that follows by Wiedemann 99.
    Wiedemann99(Wiedemann99),
    /// A driver that follows by the Intelligent Driver Model.
    Idm(Idm),
    /// A driver that approaches fast and overtakes.
    Overtaker(Overtaker),
}

impl HumanDriver {
    /// Returns the same driver with another reaction. Drivers without a reaction time stay as they
    /// are.
    #[must_use]
    pub fn reacting(&self, change: ReactionChange) -> Self {
        match self {
            Self::Prescribed(_) => self.clone(),
            Self::Wiedemann99(settings) => Self::Wiedemann99(settings.reacting(change)),
            Self::Idm(settings) => Self::Idm(settings.reacting(change)),
            Self::Overtaker(settings) => Self::Overtaker(settings.reacting(change)),
        }
    }

    /// Returns the typical reaction time (s): the value, or the median if it is drawn in each run.
    /// Returns `None` for a driver without a reaction time.
    pub fn reaction_s(&self) -> Option<f64> {
        match self {
            Self::Prescribed(_) => None,
            Self::Wiedemann99(settings) => settings.reaction.map(Reaction::typical_s),
            Self::Idm(settings) => settings.reaction.map(Reaction::typical_s),
            Self::Overtaker(settings) => Some(settings.reaction.typical_s()),
        }
    }

    /// Returns the gap at which the driver follows a vehicle at `speed_mps` in equilibrium (m), or
    /// `None` for a driver that does not follow.
    pub fn settled_gap_m(&self, speed_mps: f64) -> Option<f64> {
        match self {
            Self::Prescribed(_) => None,
            Self::Wiedemann99(settings) => Some(settings.settled_gap_m(speed_mps)),
            Self::Idm(settings) => Some(settings.safe_gap_m(speed_mps)),
            Self::Overtaker(settings) => Some(settings.follow.settled_gap_m(speed_mps)),
        }
    }

    /// Builds a new driver for one run. It allocates memory here and in its first step, and none
    /// afterwards.
    pub fn build(&self) -> Box<dyn Driver> {
        match self {
            Self::Prescribed(profile) => Box::new(profile.driver()),
            Self::Wiedemann99(settings) => Box::new(Wiedemann99Driver::new(*settings)),
            Self::Idm(settings) => Box::new(settings.driver()),
            Self::Overtaker(settings) => Box::new(settings.driver()),
        }
    }

    /// Returns whether the driver can start on an acceleration lane and merge: only drivers that
    /// follow and otherwise stay in their lane can.
    pub fn can_merge(&self) -> bool {
        match self {
            Self::Wiedemann99(_) | Self::Idm(_) => true,
            Self::Prescribed(_) | Self::Overtaker(_) => false,
        }
    }

    /// Builds a new driver for one run that starts on an acceleration lane. A driver that [can
    /// merge](Self::can_merge) leaves the lane before its end; [`build`](Self::build) builds any
    /// other driver.
    pub fn build_merging(&self) -> Box<dyn Driver> {
        let reaction_s = self.reaction_s().unwrap_or(0.0);
        match self {
            Self::Wiedemann99(settings) => {
                let driver = Wiedemann99Driver::new(*settings);
                Box::new(MergingDriver::new(driver, Follow::Wiedemann99(*settings), reaction_s))
            }
            Self::Idm(settings) => Box::new(MergingDriver::new(settings.driver(), Follow::Idm(*settings), reaction_s)),
            Self::Prescribed(_) | Self::Overtaker(_) => self.build(),
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
            Self::Prescribed(config) => check_human(config, parameters, HumanDriver::Prescribed, "prescribed"),
            Self::Wiedemann99(config) => check_human(config, parameters, HumanDriver::Wiedemann99, "wiedemann99"),
            Self::Idm(config) => check_human(config, parameters, HumanDriver::Idm, "idm"),
            Self::Overtaker(config) => check_human(config, parameters, HumanDriver::Overtaker, "overtaker"),
        }
    }
}

fn check_human<C: Check>(
    config: &C,
    parameters: &Parameters,
    kind: fn(C::Checked) -> HumanDriver,
    key: &str,
) -> Result<CheckedDriver, ConfigError> {
    config.check(parameters).map(kind).map(CheckedDriver::Human).map_err(|error| error.within(key))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Parses a `driver` table in the form in which the tables of a scenario file arrive here.
    fn parse(text: &str) -> Result<DriverConfig, toml::de::Error> {
        #[derive(Deserialize)]
        struct Actor {
            driver: DriverConfig,
        }
        toml::from_str::<Actor>(&format!("driver = {text}")).map(|actor| actor.driver)
    }

    #[test]
    fn every_driver_of_the_headline_scenario_is_read() {
        let parameters: Parameters = [("front-thw-s", 0.7), ("cut-out-thw-s", 0.2), ("rear-cc1-s", 0.02)]
            .map(|(name, value)| {
                (closecall_traffic::ParameterName::new(name).unwrap(), closecall_traffic::Value::Number(value))
            })
            .into_iter()
            .collect();
        for text in [
            "{ ego-stack = { acc = { time-gap-s = \"$front-thw-s\" }, aeb = {}, mis = { critical-gap-m = 5.0 } } }",
            "{ prescribed = { profile = [[0.0, 30.0], [4.0, 20]] } }",
            "{ prescribed = { acceleration-profile = [[2, -4.5], [5.0, \"$rear-cc1-s\"]] } }",
            "{ prescribed = { profile = [[0.0, 30]], lane-changes = [{ at-s = 2, to = \"left\", duration-s = 6.8 }] } }",
            "{ wiedemann99 = { cc1-s = 0.3, desired-speed-mps = 36, reaction-s = 0.9 } }",
            "{ idm = {} }",
            "{ overtaker = { cut-out-thw-s = \"$cut-out-thw-s\", follow = { wiedemann99 = { cc1-s = \"$rear-cc1-s\" } }, \
               reaction-s = { log-normal = { median = 0.9, sigma = 0.3 } } } }",
        ] {
            let config = parse(text).unwrap();
            config.check(&parameters).unwrap();
            let written = toml::Value::try_from(&config).unwrap();
            assert_eq!(written.try_into::<DriverConfig>().unwrap(), config, "{text}");
        }
    }

    #[test]
    fn an_unknown_key_or_a_value_out_of_range_is_refused_by_name() {
        assert!(parse("{ ego-stack = { acc = { time-gap-s = 0.7 }, mis = { bound = 1.0 } } }").is_err());
        assert!(parse("{ overtaker = { reaction-s = { log-normal = { median = nan, sigma = 0.3 } } } }").is_err());
        let config = parse("{ wiedemann99 = { cc1-s = -0.3 } }").unwrap();
        let error = config.check(&Parameters::default()).unwrap_err();
        assert_eq!(error.path.to_string(), "wiedemann99.cc1-s");
    }
}
