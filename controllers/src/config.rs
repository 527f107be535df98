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
#[expect(clippy::large_enum_variant, reason = "a scenario has a handful of them, read once")]
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

impl CheckedDriver {
    /// The same driver in the mirrored world, in which left is right. Most only know the side on which one overtakes, and
    /// have that from the road.
    #[must_use]
    pub fn mirrored(&self) -> Self {
        match self {
            Self::Human(HumanDriver::Prescribed(profile)) => Self::Human(HumanDriver::Prescribed(profile.mirrored())),
            other => other.clone(),
        }
    }
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
    /// A fresh driver for one run. What it needs is allocated here and at its first step, and nothing afterwards.
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

#[cfg(test)]
mod tests {
    use super::*;

    /// What a scenario file may say, as the tables of the file arrive here.
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
    fn what_is_unknown_or_out_of_range_is_refused_by_name() {
        assert!(parse("{ ego-stack = { acc = { time-gap-s = 0.7 }, mis = { bound = 1.0 } } }").is_err());
        assert!(parse("{ overtaker = { reaction-s = { log-normal = { median = nan, sigma = 0.3 } } } }").is_err());
        let config = parse("{ wiedemann99 = { cc1-s = -0.3 } }").unwrap();
        let error = config.check(&Parameters::default()).unwrap_err();
        assert_eq!(error.path.to_string(), "wiedemann99.cc1-s");
    }
}
