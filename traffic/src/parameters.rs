//! The sampled parameter values of one concrete scenario.

use std::collections::BTreeMap;
use std::fmt;

use serde::de::{DeserializeOwned, IntoDeserializer, value};
use serde::{Deserialize, Serialize};

use crate::statistics::format::significant;
use crate::{Choice, ConfigError, Num, ParameterName, Problem, Range};

/// The value of a parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Value {
    /// A finite number, in the unit that the name of the parameter ends with.
    Number(f64),
    /// One label out of a choice.
    Label(String),
}

/// Significant digits of a value for readers (-).
const READABLE_DIGITS: i32 = 4;

impl Value {
    /// Returns the value for readers: a number has four significant digits. All digits, with which
    /// the same run is made again, are what `Display` writes.
    pub fn readable(&self) -> String {
        match self {
            Self::Number(value) => readable(*value),
            Self::Label(label) => label.clone(),
        }
    }
}

/// Returns a number for readers, with four significant digits. A number is never shown as zero if
/// it is none.
pub fn readable(value: f64) -> String {
    match significant(value, READABLE_DIGITS) {
        zero if zero == "0" && value != 0.0 => value.to_string(),
        text => text,
    }
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(value) => write!(f, "{value}"),
            Self::Label(label) => f.write_str(label),
        }
    }
}

/// The values of all parameters of one concrete scenario, ordered by name.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Parameters(BTreeMap<ParameterName, Value>);

impl Parameters {
    /// Sets the value of a parameter.
    pub fn insert(&mut self, name: ParameterName, value: Value) {
        self.0.insert(name, value);
    }

    /// Returns the value of a parameter, or `None` if it does not exist.
    pub fn get(&self, name: &ParameterName) -> Option<&Value> {
        self.0.get(name)
    }

    /// Returns all values, ordered by name.
    pub fn iter(&self) -> impl Iterator<Item = (&ParameterName, &Value)> {
        self.0.iter()
    }

    /// Returns the number of `num`, given or sampled, checked against `range`.
    ///
    /// # Errors
    /// [`ConfigError`] at `key` if the parameter does not exist or gives a label, or if the number
    /// is out of range.
    pub fn number(&self, num: &Num, key: &str, range: Range) -> Result<f64, ConfigError> {
        let value = match num {
            Num::Fixed(value) => *value,
            Num::Parameter(name) => match self.find(name, key)? {
                Value::Number(value) => *value,
                Value::Label(label) => {
                    let actual = format!("the label `{label}`");
                    let problem = Problem::WrongKind { name: name.clone(), actual, needed: "a number" };
                    return Err(ConfigError::new(key, problem));
                }
            },
        };
        range.check(value, key)
    }

    /// Returns the number of `num`, given or sampled, checked against `range`, or `default` if
    /// there is none.
    ///
    /// # Errors
    /// As [`Self::number`].
    pub fn number_or(&self, num: Option<&Num>, key: &str, range: Range, default: f64) -> Result<f64, ConfigError> {
        num.map_or(Ok(default), |num| self.number(num, key, range))
    }

    /// Returns the label of `choice`, given or sampled.
    ///
    /// # Errors
    /// [`ConfigError`] at `key` if the parameter does not exist or gives a number, or if `T` does
    /// not know its label.
    pub fn word<T: DeserializeOwned + Clone>(&self, choice: &Choice<T>, key: &str) -> Result<T, ConfigError> {
        let name = match choice {
            Choice::Fixed(word) => return Ok(word.clone()),
            Choice::Parameter(name) => name,
        };
        match self.find(name, key)? {
            Value::Label(label) => {
                let word: Result<T, value::Error> = T::deserialize(label.as_str().into_deserializer());
                word.map_err(|error| {
                    let problem = Problem::UnknownWord { value: label.clone(), allowed: expected_words(&error) };
                    ConfigError::new(key, problem)
                })
            }
            Value::Number(value) => {
                let actual = format!("the number {value}");
                let problem = Problem::WrongKind { name: name.clone(), actual, needed: "a label" };
                Err(ConfigError::new(key, problem))
            }
        }
    }

    fn find(&self, name: &ParameterName, key: &str) -> Result<&Value, ConfigError> {
        self.get(name).ok_or_else(|| {
            let allowed = if self.0.is_empty() {
                "none".to_owned()
            } else {
                self.0.keys().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
            };
            ConfigError::new(key, Problem::UnknownParameter { name: name.clone(), allowed })
        })
    }
}

/// Extracts the list of labels from serde's message "unknown variant `x`, expected one of `a`,
/// `b`".
fn expected_words(error: &value::Error) -> String {
    let text = error.to_string();
    match text.split_once("expected ") {
        Some((_, words)) => words.trim_start_matches("one of ").to_owned(),
        None => text,
    }
}

impl FromIterator<(ParameterName, Value)> for Parameters {
    fn from_iter<I: IntoIterator<Item = (ParameterName, Value)>>(values: I) -> Self {
        Self(values.into_iter().collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_for_readers_has_four_digits_and_all_others_stay() {
        let value = Value::Number(5.400_846_702_439_72);
        assert_eq!((value.readable(), value.to_string()), ("5.401".to_owned(), "5.40084670243972".to_owned()));
        let texts = [6.0, -0.216_437_4, 0.005_012_614, 12_345.67, 1e-12, 0.0].map(readable);
        assert_eq!(texts, ["6", "-0.2164", "0.005013", "12346", "0.000000000001", "0"]);
        assert_eq!(Value::Label("car".to_owned()).readable(), "car");
    }
}
