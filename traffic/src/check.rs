//! From configuration text to values that cannot be invalid.

use std::fmt;

use crate::{Absent, ParameterName, Parameters};

/// A configuration as written, which can be checked into something that cannot be invalid.
pub trait Check {
    /// The checked thing.
    type Checked;

    /// Resolves parameters and checks every range.
    ///
    /// # Errors
    /// The first key that is wrong, with its path below this configuration, its value, and what is allowed.
    fn check(&self, parameters: &Parameters) -> Result<Self::Checked, ConfigError>;
}

/// One step from a table to what lies in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Segment {
    /// A key of a table.
    Key(String),
    /// A place in an array, counted from 0.
    Index(usize),
}

/// The way from the root of a file to a value, such as `actor[2].driver.overtaker.reaction-s`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct KeyPath(pub Vec<Segment>);

impl fmt::Display for KeyPath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (place, segment) in self.0.iter().enumerate() {
            match segment {
                Segment::Key(key) if place == 0 => write!(f, "{key}")?,
                Segment::Key(key) => write!(f, ".{key}")?,
                Segment::Index(index) => write!(f, "[{index}]")?,
            }
        }
        Ok(())
    }
}

/// What is wrong with a value.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Problem {
    /// A number outside of what is allowed.
    #[error("is {value}, but {allowed} is needed")]
    OutOfRange {
        /// The number found.
        value: f64,
        /// What is allowed.
        allowed: Range,
    },
    /// A count outside of what is allowed.
    #[error("is {value}, but {allowed} is needed")]
    WrongCount {
        /// The count found.
        value: u64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// `$name` where no such parameter exists.
    #[error("names the parameter `${name}`, which [parameters] does not have; it has {known}")]
    UnknownParameter {
        /// The name found.
        name: ParameterName,
        /// The names that exist.
        known: String,
    },
    /// A parameter of the other kind.
    #[error("names the parameter `${name}`, which gives {found}, where {needed} is needed")]
    WrongKind {
        /// The name found.
        name: ParameterName,
        /// What the parameter gives.
        found: String,
        /// What the key needs.
        needed: &'static str,
    },
    /// A word outside of a fixed list.
    #[error("is `{value}`, but one of {allowed} is needed")]
    UnknownWord {
        /// The word found.
        value: String,
        /// The words that exist.
        allowed: String,
    },
    /// A reference to an actor that does not exist.
    #[error("names the actor `{value}`, but the actors are {known}")]
    UnknownActor {
        /// The name found.
        value: String,
        /// The names that exist.
        known: String,
    },
    /// The same name twice.
    #[error("is `{value}`, which stands there twice")]
    Duplicate {
        /// The name found.
        value: String,
    },
    /// Something that is needed is not there.
    #[error("is missing: {needed}")]
    Missing {
        /// What is needed.
        needed: &'static str,
    },
    /// Two values that cannot both hold.
    #[error("contradicts `{other}`: {rule}")]
    Contradiction {
        /// The other key.
        other: &'static str,
        /// What must hold between the two.
        rule: String,
    },
    /// A value that the situation does not define.
    #[error("cannot be worked out: {0}")]
    Undefined(Absent),
}

/// A key with a wrong value.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("`{path}` {problem}")]
pub struct ConfigError {
    /// Where.
    pub path: KeyPath,
    /// What.
    pub problem: Problem,
}

impl ConfigError {
    /// An error at `key`.
    pub fn new(key: &str, problem: Problem) -> Self {
        Self { path: KeyPath(vec![Segment::Key(key.to_owned())]), problem }
    }

    /// The same error seen from the table that holds `key`.
    #[must_use]
    pub fn within(mut self, key: &str) -> Self {
        self.path.0.insert(0, Segment::Key(key.to_owned()));
        self
    }

    /// The same error seen from the array that holds element `index`, counted from 0.
    #[must_use]
    pub fn within_index(mut self, index: usize) -> Self {
        self.path.0.insert(0, Segment::Index(index));
        self
    }
}

/// The numbers that a key allows. NaN is in no range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    low: f64,
    high: f64,
    low_is_allowed: bool,
}

impl Range {
    /// `low` to `high`, both allowed.
    pub const fn closed(low: f64, high: f64) -> Self {
        Self { low, high, low_is_allowed: true }
    }

    /// Above `low`, up to and including `high`.
    pub const fn above(low: f64, high: f64) -> Self {
        Self { low, high, low_is_allowed: false }
    }

    /// A share: 0 to 1.
    pub const UNIT: Self = Self::closed(0.0, 1.0);

    /// True where `value` lies in the range; never for NaN.
    pub fn contains(self, value: f64) -> bool {
        (value > self.low || (self.low_is_allowed && value >= self.low)) && value <= self.high
    }

    /// `value`, where it lies in the range.
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
    fn an_error_says_where_and_what() {
        let error = Range::UNIT.check(1.5, "existence").unwrap_err().within("driver").within_index(2).within("actor");
        assert_eq!(error.to_string(), "`actor[2].driver.existence` is 1.5, but a number from 0 to 1 is needed");
    }
}
