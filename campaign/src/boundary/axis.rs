//! One of the two parameters, with its range.

use std::fmt;
use std::str::FromStr;

use closecall_scenarios::parameters::{ParameterSpace, SpaceEntry};
use closecall_traffic::ParameterName;

use crate::sensitivity::{FactorRange, RangeError};

/// A parameter of the scenario or a key of its file, with the range that is given for it:
/// `NAME` or `KEY=LOW..HIGH`.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// The key, as for `--set`.
    pub key: String,
    range: Option<FactorRange>,
}

/// A parameter that cannot be read, or has no range.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AxisError {
    /// The range cannot be read.
    #[error(transparent)]
    Range(#[from] RangeError),
    /// The text has no key.
    #[error("`{text}` names no parameter: `NAME` or `KEY=LOW..HIGH` is needed")]
    NoKey {
        /// The given text.
        text: String,
    },
    /// The key has no range, and is no parameter that has one.
    #[error(
        "`{key}` needs a range, `{key}=LOW..HIGH`: it is not a number that the scenario samples{}",
        listed(sampled)
    )]
    NoRange {
        /// The key.
        key: String,
        /// The numbers that the scenario samples.
        sampled: Vec<String>,
    },
}

/// Returns the end of a sentence that lists the parameters of a scenario.
fn listed(sampled: &[String]) -> String {
    match sampled {
        [] => ", which samples none".to_owned(),
        names => format!("; it samples {}", names.join(", ")),
    }
}

impl FromStr for Axis {
    type Err = AxisError;

    fn from_str(text: &str) -> Result<Self, AxisError> {
        if text.contains('=') {
            let range: FactorRange = text.parse()?;
            return Ok(Self { key: range.key.clone(), range: Some(range) });
        }
        match text.trim() {
            "" => Err(AxisError::NoKey { text: text.to_owned() }),
            key => Ok(Self { key: key.to_owned(), range: None }),
        }
    }
}

impl fmt::Display for Axis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.range {
            Some(range) => range.fmt(f),
            None => f.write_str(&self.key),
        }
    }
}

impl Axis {
    /// Returns the range: as given, else from the smallest to the largest value that the scenario
    /// samples.
    ///
    /// # Errors
    /// [`AxisError::NoRange`] if there is neither.
    pub(super) fn range(&self, space: &ParameterSpace) -> Result<FactorRange, AxisError> {
        if let Some(range) = &self.range {
            return Ok(range.clone());
        }
        let number = |(name, entry): (&ParameterName, &SpaceEntry)| {
            Some((name.as_str().to_owned(), entry.distribution.bounds()?))
        };
        let numbers: Vec<(String, [f64; 2])> = space.varying().filter_map(number).collect();
        match numbers.iter().find(|(name, _)| *name == self.key) {
            // The text of a range is the only way to make one.
            Some((name, [low, high])) => Ok(format!("{name}={low:?}..{high:?}").parse()?),
            None => {
                let sampled = numbers.into_iter().map(|(name, _)| name).collect();
                Err(AxisError::NoRange { key: self.key.clone(), sampled })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use closecall_scenarios::{ScenarioFile, library};

    use super::*;

    #[test]
    fn a_sampled_number_has_a_range_of_its_own() {
        let name = "low-thw-overtake";
        let file = ScenarioFile::parse(&library::path(name), library::text(name).unwrap(), &[]).unwrap();
        let range = |text: &str| text.parse::<Axis>().unwrap().range(file.space());
        let closing = range("closing-mps").unwrap();
        assert_eq!((closing.low, closing.high), (2.8, 13.9));
        assert_eq!(range("closing-mps=3..5").unwrap().high, 5.0);
        for wrong in ["rear-class", "duration-s", "closing"] {
            let message = range(wrong).unwrap_err().to_string();
            assert!(
                message.contains(&format!("`{wrong}` needs a range")) && message.contains("closing-mps"),
                "{message}"
            );
        }
    }

    #[test]
    fn what_is_no_axis_is_refused() {
        for wrong in ["", " ", "a=1", "a=2..1", "=1..2", "a=0..inf"] {
            assert!(wrong.parse::<Axis>().is_err(), "{wrong}");
        }
        for text in ["closing-mps", "brake-mps2=4..9"] {
            assert_eq!(text.parse::<Axis>().unwrap().to_string(), text);
        }
    }
}
