//! The factors of a study: the varied quantities and their ranges.

use std::fmt;
use std::str::FromStr;

use closecall_scenarios::{Setting, SettingError};

/// The name of the factor that stands for all that the parameters of a sample leave open.
pub const CHANCE: &str = "chance";

/// The owner of a factor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum FactorKind {
    /// A sampled parameter of the scenario.
    Scenario,
    /// A human driver.
    Driver,
    /// A sensor of the ego.
    Sensor,
    /// The ego stack, baseline or margin increase system.
    Controller,
    /// The road surface and the weather.
    Environment,
    /// A key that the user has named.
    Named,
    /// The random numbers of a run.
    Chance,
}

impl FactorKind {
    /// All kinds.
    pub const ALL: [Self; 7] =
        [Self::Scenario, Self::Driver, Self::Sensor, Self::Controller, Self::Environment, Self::Named, Self::Chance];

    /// Returns the name, as in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Scenario => "scenario",
            Self::Driver => "driver",
            Self::Sensor => "sensor",
            Self::Controller => "controller",
            Self::Environment => "environment",
            Self::Named => "named",
            Self::Chance => "chance",
        }
    }
}

/// One factor.
#[derive(Clone, Debug, PartialEq)]
pub struct Factor {
    /// The name of a parameter, the path of a key, or [`CHANCE`].
    pub name: String,
    /// The owner of the factor.
    pub kind: FactorKind,
    /// The smallest and the largest value; `None` for labels and chance.
    pub range: Option<[f64; 2]>,
    /// The origin of the range or of the distribution.
    pub source: String,
}

impl Factor {
    /// Returns a name short enough for a chart: the last two parts of a path, with the actor.
    pub fn label(&self) -> String {
        let parts: Vec<&str> = self.name.split('.').collect();
        match &parts[..] {
            ["actor", actor, .., last] => format!("{actor}: {last}"),
            [.., table, last] => format!("{table}: {last}"),
            _ => self.name.clone(),
        }
    }
}

/// A key of the scenario file with a range, uniformly distributed: `KEY=LOW..HIGH`.
#[derive(Clone, Debug, PartialEq)]
pub struct FactorRange {
    /// The key, as for `--set`.
    pub key: String,
    /// The smallest value.
    pub low: f64,
    /// The largest value.
    pub high: f64,
    /// The owner of the factor.
    pub kind: FactorKind,
    /// The origin of the range.
    pub source: String,
}

/// A range that cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RangeError {
    /// The text is not of the form KEY=LOW..HIGH.
    #[error("`{text}` is not of the form KEY=LOW..HIGH, such as `actor.ego.driver.ego-stack.aeb.trigger-mps2=3..6`")]
    Form {
        /// The given text.
        text: String,
    },
    /// The bounds are not finite, or the upper one is not larger.
    #[error("`{text}`: two finite numbers are needed, the second larger than the first")]
    Bounds {
        /// The given text.
        text: String,
    },
}

impl fmt::Display for FactorRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}..{}", self.key, self.low, self.high)
    }
}

impl FromStr for FactorRange {
    type Err = RangeError;

    fn from_str(text: &str) -> Result<Self, RangeError> {
        let form = || RangeError::Form { text: text.to_owned() };
        let (key, range) = text.split_once('=').ok_or_else(form)?;
        let (low, high) = range.split_once("..").ok_or_else(form)?;
        let number = |text: &str| text.trim().parse::<f64>().map_err(|_| form());
        let (key, low, high) = (key.trim().to_owned(), number(low)?, number(high)?);
        if key.is_empty() {
            return Err(form());
        }
        if !(low < high && low.is_finite() && high.is_finite()) {
            return Err(RangeError::Bounds { text: text.to_owned() });
        }
        Ok(Self { key, low, high, kind: FactorKind::Named, source: "named by the user".to_owned() })
    }
}

impl FactorRange {
    /// Returns the setting at a coordinate in [0, 1].
    ///
    /// # Errors
    /// [`SettingError`] if the key is not a path of keys.
    pub fn at(&self, u: f64) -> Result<Setting, SettingError> {
        // A decimal point keeps the number a float, whatever its value.
        format!("{}={:?}", self.key, self.low + u * (self.high - self.low)).parse()
    }

    /// Returns the factor.
    pub fn factor(&self) -> Factor {
        Factor {
            name: self.key.clone(),
            kind: self.kind,
            range: Some([self.low, self.high]),
            source: self.source.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_is_parsed_and_printed() {
        let range: FactorRange = "actor.ego.driver.ego-stack.aeb.trigger-mps2=3..6.5".parse().unwrap();
        assert_eq!((range.low, range.high), (3.0, 6.5));
        assert_eq!(range.to_string(), "actor.ego.driver.ego-stack.aeb.trigger-mps2=3..6.5");
        assert_eq!(range.at(0.0).unwrap().to_string(), "actor.ego.driver.ego-stack.aeb.trigger-mps2=3.0");
        assert_eq!(range.factor().label(), "ego: trigger-mps2");
        assert_eq!("a=-1..-0.5".parse::<FactorRange>().unwrap().high, -0.5);
        for wrong in ["", "a", "a=1", "a=1..", "=1..2", "a=b..c", "a=1..1", "a=2..1", "a=nan..1", "a=0..inf"] {
            assert!(wrong.parse::<FactorRange>().is_err(), "{wrong}");
        }
    }
}
