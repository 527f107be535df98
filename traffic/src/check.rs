//! Checking of configuration text into values that cannot be invalid.

use std::fmt;

use crate::suggest::hint;
use crate::{ParameterName, Parameters};

/// A configuration as written in a file, which can be checked into a value that cannot be invalid.
pub trait Check {
    /// The type of the checked value.
    type Checked;

    /// Resolves parameters and checks every value against its range.
    ///
    /// # Errors
    /// [`ConfigError`] for the first wrong key, with its path below this configuration, its value,
    /// and what is allowed.
    fn check(&self, parameters: &Parameters) -> Result<Self::Checked, ConfigError>;
}

/// One step of a path from a table or array to one of its elements.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Segment {
    /// A key of a table.
    Key(String),
    /// An index of an array, counted from 0.
    Index(usize),
}

/// The path from the root of a file to a value, such as `actor[2].driver.overtaker.reaction-s`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct KeyPath(pub Vec<Segment>);

impl fmt::Display for KeyPath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (depth, segment) in self.0.iter().enumerate() {
            match segment {
                Segment::Key(key) if depth == 0 => write!(f, "{key}")?,
                Segment::Key(key) => write!(f, ".{key}")?,
                Segment::Index(index) => write!(f, "[{index}]")?,
            }
        }
        Ok(())
    }
}

/// Returns a number in at most some twenty digits: 1e300 has three hundred when it is written out.
fn short(value: f64) -> String {
    const WRITTEN_OUT: std::ops::Range<f64> = 1e-6..1e16;
    match value == 0.0 || !value.is_finite() || WRITTEN_OUT.contains(&value.abs()) {
        true => value.to_string(),
        false => format!("{value:e}"),
    }
}

/// The reason why a value is wrong.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Problem {
    /// A number is outside its range.
    #[error("is {}, but {allowed} is needed", short(*value))]
    OutOfRange {
        /// The number found.
        value: f64,
        /// What is allowed.
        allowed: Range,
    },
    /// A count is outside its range.
    #[error("is {value}, but {allowed} is needed")]
    WrongCount {
        /// The count found.
        value: u64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// A list has too few or too many entries.
    #[error("has {value} {}, but {allowed} are allowed", if *value == 1 { "entry" } else { "entries" })]
    WrongLength {
        /// The number of entries.
        value: u64,
        /// The numbers of entries that are allowed.
        allowed: &'static str,
    },
    /// The road has no such lane.
    #[error("is {value}, but a lane of this road, from 1 (leftmost) to {lanes}, is needed")]
    UnknownLane {
        /// The lane found.
        value: u8,
        /// The number of lanes, which is the number of the rightmost lane.
        lanes: u8,
    },
    /// `$name` refers to a parameter that does not exist.
    #[error("names the parameter `${name}`, which [parameters] does not have; it has {allowed}{}", hint(name.as_str(), allowed))]
    UnknownParameter {
        /// The name found.
        name: ParameterName,
        /// The names that exist.
        allowed: String,
    },
    /// A parameter gives a label where a number is needed, or a number where a label is needed.
    #[error("names the parameter `${name}`, which gives {actual}, where {needed} is needed")]
    WrongKind {
        /// The name found.
        name: ParameterName,
        /// The value of the parameter.
        actual: String,
        /// The kind of value that the key needs.
        needed: &'static str,
    },
    /// A label is not in the list of allowed labels.
    #[error("is `{value}`, but one of {allowed} is needed{}", hint(value, allowed))]
    UnknownWord {
        /// The label found.
        value: String,
        /// The labels that are allowed.
        allowed: String,
    },
    /// A name refers to an actor that does not exist.
    #[error("names the actor `{value}`, but the actors are {allowed}{}", hint(value, allowed))]
    UnknownActor {
        /// The name found.
        value: String,
        /// The names that exist.
        allowed: String,
    },
    /// A name occurs twice.
    #[error("is `{value}`, which stands there twice")]
    Duplicate {
        /// The name found.
        value: String,
    },
    /// A needed value is missing.
    #[error("is missing: {needed}")]
    Missing {
        /// What is needed.
        needed: &'static str,
    },
    /// Two values contradict each other.
    #[error("contradicts `{other}`: {rule}")]
    Contradiction {
        /// The other key.
        other: &'static str,
        /// The rule that must hold between the two values.
        rule: String,
    },
}

/// The error for a key with a wrong value.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("`{path}` {problem}")]
pub struct ConfigError {
    /// The path to the key.
    pub path: KeyPath,
    /// The fault of its value.
    pub problem: Problem,
}

impl ConfigError {
    /// Creates an error at `key`.
    pub fn new(key: &str, problem: Problem) -> Self {
        Self { path: KeyPath(vec![Segment::Key(key.to_owned())]), problem }
    }

    /// Returns the same error with `key` prepended to its path.
    #[must_use]
    pub fn within(mut self, key: &str) -> Self {
        self.path.0.insert(0, Segment::Key(key.to_owned()));
        self
    }

    /// Returns the same error with the array index `index`, counted from 0, prepended to its path.
    #[must_use]
    pub fn within_index(mut self, index: usize) -> Self {
        self.path.0.insert(0, Segment::Index(index));
        self
    }
}

/// The range of numbers that a key allows. It never contains NaN.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    low: f64,
    high: f64,
    low_is_allowed: bool,
}

impl Range {
    /// Creates the range from `low` to `high`, including both.
    pub const fn closed(low: f64, high: f64) -> Self {
        Self { low, high, low_is_allowed: true }
    }

    /// Creates the range from `low`, excluded, to `high`, included.
    pub const fn above(low: f64, high: f64) -> Self {
        Self { low, high, low_is_allowed: false }
    }

    /// The range of shares and probabilities: 0 to 1.
    pub const UNIT: Self = Self::closed(0.0, 1.0);

    /// Returns the lower bound.
    pub const fn low(self) -> f64 {
        self.low
    }

    /// Returns the upper bound, which the range includes.
    pub const fn high(self) -> f64 {
        self.high
    }

    /// Returns true if the range includes its lower bound.
    pub const fn includes_low(self) -> bool {
        self.low_is_allowed
    }

    /// Returns true if `value` lies in the range; false for NaN.
    pub fn contains(self, value: f64) -> bool {
        (value > self.low || (self.low_is_allowed && value >= self.low)) && value <= self.high
    }

    /// Returns `value` if it lies in the range.
    ///
    /// # Errors
    /// [`Problem::OutOfRange`] at `key` otherwise.
    pub fn check(self, value: f64, key: &str) -> Result<f64, ConfigError> {
        if self.contains(value) {
            Ok(value)
        } else {
            Err(ConfigError::new(key, Problem::OutOfRange { value, allowed: self }))
        }
    }
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.low_is_allowed {
            write!(f, "a number from {} to {}", self.low, self.high)
        } else {
            write!(f, "a number above {} and up to {}", self.low, self.high)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nan_is_in_no_range() {
        assert!(!Range::closed(f64::NEG_INFINITY, f64::INFINITY).contains(f64::NAN));
        assert!(Range::closed(0.0, 1.0).contains(0.0));
        assert!(!Range::above(0.0, 1.0).contains(0.0));
    }

    #[test]
    fn an_error_names_the_place_and_the_fault() {
        let error = Range::UNIT.check(1.5, "existence").unwrap_err().within("driver").within_index(2).within("actor");
        assert_eq!(error.to_string(), "`actor[2].driver.existence` is 1.5, but a number from 0 to 1 is needed");
        for (value, text) in [(-1e300, "-1e300"), (1e9, "1000000000"), (f64::NAN, "NaN"), (-2.5e-9, "-2.5e-9")] {
            let error = Range::UNIT.check(value, "existence").unwrap_err().to_string();
            assert!(error.starts_with(&format!("`existence` is {text}, but")), "{error}");
        }
    }
}
