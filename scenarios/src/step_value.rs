//! The values that a varied parameter takes.

use super::sampled::LANE_CHANGER;
use super::{Setting, SettingError};

/// Number of rounding steps per unit of a varied value.
const STEPS_PER_UNIT: f64 = 1e6;
/// Largest number of steps.
const MAX_STEPS: usize = 100;

/// The parameters of the Wiedemann 99 driver that can be varied by a short name.
const PARAMETERS: [&str; 12] = [
    "cc0-m",
    "cc1-s",
    "cc2-m",
    "cc3-s",
    "cc4-mps",
    "cc5-mps",
    "cc6",
    "cc7-mps2",
    "cc8-mps2",
    "cc9-mps2",
    "desired-speed-mps",
    "hardest-braking-mps2",
];

/// A parameter, and the values that it takes.
#[derive(Clone, Debug, PartialEq)]
pub struct Variation {
    /// The key of the parameter in the scenario file.
    pub key: String,
    /// The values, in equal steps.
    pub values: Vec<f64>,
}

/// One value of a varied parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepValue<'a> {
    /// The key of the parameter in the scenario file.
    pub key: &'a str,
    /// The value.
    pub value: f64,
}

impl Variation {
    /// Creates a variation in equal steps. `parameter` is a parameter of the lane changer's driver
    /// (`cc1`), or a path of keys in the scenario file (`actor.opp1.start.absolute.speed-mps`).
    ///
    /// # Errors
    /// Says what is wrong, and what is allowed.
    pub fn new(parameter: &str, [from, to]: [f64; 2], steps: usize) -> Result<Self, String> {
        let key = Self::key_of(parameter)?;
        if !(2..=MAX_STEPS).contains(&steps) {
            return Err(format!("{steps} steps are not possible: 2 to {MAX_STEPS} are allowed"));
        }
        if !(from.is_finite() && to.is_finite() && from != to) {
            return Err(format!("from {from} to {to} is no variation: two different finite numbers are needed"));
        }
        let value = |step: usize| from + (to - from) * step as f64 / (steps - 1) as f64;
        let values = (0..steps).map(|step| (value(step) * STEPS_PER_UNIT).round() / STEPS_PER_UNIT).collect();
        Ok(Self { key, values })
    }

    /// Returns the key of a parameter in the scenario file: see [`Self::new`].
    ///
    /// # Errors
    /// Says what is wrong, and what is allowed.
    pub fn key_of(parameter: &str) -> Result<String, String> {
        let named = PARAMETERS
            .iter()
            .find(|key| **key == parameter || key.strip_prefix(parameter).is_some_and(|unit| unit.starts_with('-')));
        match named {
            Some(key) => Ok(format!("actor.{LANE_CHANGER}.driver.wiedemann99.{key}")),
            None if parameter.contains('.') => Ok(parameter.to_owned()),
            None => Err(format!(
                "`{parameter}` is not a parameter of the lane changer's driver: allowed are {}, or a path of keys such as \
                 `actor.{LANE_CHANGER}.driver.wiedemann99.cc1-s`",
                PARAMETERS.join(", "),
            )),
        }
    }

    /// Returns the steps, each with its value.
    pub fn steps(&self) -> impl Iterator<Item = StepValue<'_>> {
        self.values.iter().map(|&value| StepValue { key: &self.key, value })
    }
}

impl StepValue<'_> {
    /// Returns the setting that gives the parameter its value.
    pub(super) fn setting(&self) -> Result<Setting, SettingError> {
        format!("{}={}", self.key, self.value).parse()
    }

    /// Returns the name of the parameter without its path and its unit, with the value:
    /// `cc1 = 0.3`.
    pub fn label(&self) -> String {
        let last = self.key.rsplit('.').next().unwrap_or(self.key);
        let is_short = last.starts_with("cc");
        let name = if is_short { last.split('-').next().unwrap_or(last) } else { last };
        format!("{name} = {}", self.value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parameter_is_named_with_or_without_its_unit_or_by_its_path() {
        let key = |name: &str| Variation::new(name, [1.5, 0.3], 5).map(|variation| variation.key);
        let cc1 = "actor.lane-changer.driver.wiedemann99.cc1-s";
        for name in ["cc1", "cc1-s", cc1] {
            assert_eq!(key(name).as_deref(), Ok(cc1));
        }
        assert!(key("cc").unwrap_err().contains("allowed are cc0-m, cc1-s"));
        let variation = Variation::new("cc1", [1.5, 0.3], 5).unwrap();
        assert_eq!(variation.values, [1.5, 1.2, 0.9, 0.6, 0.3]);
        let labels: Vec<String> = variation.steps().map(|step| step.label()).collect();
        assert_eq!(labels, ["cc1 = 1.5", "cc1 = 1.2", "cc1 = 0.9", "cc1 = 0.6", "cc1 = 0.3"]);
    }

    #[test]
    fn a_variation_needs_two_values_and_two_steps() {
        for (values, steps, said) in [
            ([1.0, 1.0], 5, "two different finite numbers are needed"),
            ([f64::NAN, 1.0], 5, "two different finite numbers"),
            ([1.0, f64::INFINITY], 5, "two different finite numbers"),
            ([1.0, 2.0], 1, "2 to 100 are allowed"),
            ([1.0, 2.0], 101, "2 to 100 are allowed"),
        ] {
            let error = Variation::new("cc1", values, steps).unwrap_err();
            assert!(error.contains(said), "{values:?} {steps}: {error}");
        }
    }
}
