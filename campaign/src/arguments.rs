//! Arguments of a command line: numbers, and paths with a known extension. A refusal says what is
//! allowed.

use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Duration;

use closecall_traffic::is_kebab_name;
use serde::de::{Deserialize, Deserializer, Error};
use serde_json::Value;

use crate::stop::duration;

/// Defines numbers that are parsed from the command line and deserialised from a request, both
/// within their limits.
macro_rules! checked_numbers {
    ($($(#[$doc:meta])* $name:ident($type:ty) by $parse:expr;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct $name(pub $type);

        impl FromStr for $name {
            type Err = String;

            fn from_str(text: &str) -> Result<Self, String> {
                $parse(text).map(Self)
            }
        }

        impl<'de> Deserialize<'de> for $name {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                // A text keeps its quotes, and is not a number.
                Value::deserialize(deserializer)?.to_string().parse().map_err(D::Error::custom)
            }
        }
    )*};
}

checked_numbers! {
    /// A number of samples, 1 or more.
    Count(u64) by count;
    /// A finite number above 0.
    Positive(f64) by positive;
    /// A probability, above 0 and below 1.
    Probability(f64) by probability;
    /// A confidence, above 0.5 and below 1.
    Confidence(f64) by confidence;
    /// A share, 0 to 1.
    Share(f64) by share;
    /// A share above 0, up to 1.
    PositiveShare(f64) by positive_share;
    /// A number of worker threads.
    Jobs(u16) by whole::<u16, 1, 1_024>;
    /// A number of further tries of a sample.
    Retries(u32) by whole::<u32, 0, 100>;
    /// The longest time of a controller's answer (ms).
    TimeoutMs(u64) by whole::<u64, 1, 600_000>;
    /// The memory of a controller's process (MiB).
    MemoryMib(u64) by whole::<u64, 1, 1_048_576>;
}

/// Parses a whole number within limits.
///
/// # Errors
/// What is wrong, and what is allowed.
pub fn whole<T: TryFrom<u64>, const LEAST: u64, const MOST: u64>(text: &str) -> Result<T, String> {
    let number = text.parse().ok().filter(|number| (LEAST..=MOST).contains(number));
    let number = number.and_then(|number| T::try_from(number).ok());
    number.ok_or_else(|| format!("`{text}` is not a whole number from {LEAST} to {MOST}"))
}

/// Deserialises a word, or a number, that is parsed like the same text of the command line.
///
/// # Errors
/// What is wrong, and what is allowed.
pub fn parsed<'de, D: Deserializer<'de>, T: FromStr<Err: std::fmt::Display>>(deserializer: D) -> Result<T, D::Error> {
    word(Value::deserialize(deserializer)?).parse().map_err(D::Error::custom)
}

/// Deserialises an option like [`parsed`].
///
/// # Errors
/// What is wrong, and what is allowed.
pub fn parsed_option<'de, D: Deserializer<'de>, T: FromStr<Err: std::fmt::Display>>(
    deserializer: D,
) -> Result<Option<T>, D::Error> {
    parsed(deserializer).map(Some)
}

/// Deserialises each item of a list like [`parsed`].
///
/// # Errors
/// What is wrong, and what is allowed.
pub fn parsed_list<'de, D: Deserializer<'de>, T: FromStr<Err: std::fmt::Display>>(
    deserializer: D,
) -> Result<Vec<T>, D::Error> {
    let values = Vec::<Value>::deserialize(deserializer)?.into_iter();
    values.map(|value| word(value).parse().map_err(D::Error::custom)).collect()
}

/// Returns the text of a value.
fn word(value: Value) -> String {
    match value {
        Value::String(text) => text,
        value => value.to_string(),
    }
}

/// The wall time of a campaign, above 0, such as `90s`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WallTime(pub Duration);

impl FromStr for WallTime {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        duration(text).map(Self)
    }
}

/// Parses a finite number above 0.
///
/// # Errors
/// What is wrong, and what is allowed.
pub fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err(format!("`{text}` is not a finite number above 0")),
    }
}

/// Parses a number of samples or scenes: a whole number above 0.
///
/// # Errors
/// What is wrong, and what is allowed.
pub fn count(text: &str) -> Result<u64, String> {
    let reason = match text.parse::<i128>() {
        Ok(number) if number > 0 => {
            return u64::try_from(number)
                .map_err(|_| format!("`{text}` is too large: at most {} is allowed", u64::MAX));
        }
        Ok(0) => "is too small",
        Ok(_) => "is negative",
        Err(_) => "is not a whole number",
    };
    Err(format!("`{text}` {reason}: a whole number of 1 or more is needed"))
}

/// Parses a seed: a whole number from 0 to 2^64 - 1.
///
/// # Errors
/// What is allowed.
pub fn seed(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| format!("`{text}` is not a whole number from 0 to {}", u64::MAX))
}

/// Parses a probability, above 0 and below 1: 0 and 1 cannot be shown by samples.
///
/// # Errors
/// What is wrong, and what is allowed.
pub fn probability(text: &str) -> Result<f64, String> {
    between(text, 0.0, "above 0 and below 1")
}

/// Parses a confidence, above 0.5 and below 1.
///
/// # Errors
/// What is wrong, and what is allowed.
pub fn confidence(text: &str) -> Result<f64, String> {
    between(text, 0.5, "above 0.5 and below 1")
}

fn between(text: &str, low: f64, allowed: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > low && value < 1.0 => Ok(value),
        _ => Err(format!("`{text}` is not a number {allowed}")),
    }
}

/// Parses a share, 0 to 1.
///
/// # Errors
/// What is wrong, and what is allowed.
pub fn share(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (0.0..=1.0).contains(&value) => Ok(value),
        _ => Err(format!("`{text}` is not a number from 0 to 1")),
    }
}

/// Parses a share above 0, up to 1.
fn positive_share(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value <= 1.0 => Ok(value),
        _ => Err(format!("`{text}` is not a number above 0 and up to 1")),
    }
}

/// Parses the path of a table, whose extension must be .csv or .parquet.
///
/// # Errors
/// What is wrong, and what is allowed.
pub fn table(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("csv" | "parquet") => Ok(path),
        _ => Err(format!("`{text}` must end with .csv or .parquet")),
    }
}

/// Parses the path of a Parquet table, whose extension must be .parquet.
///
/// # Errors
/// What is wrong, and what is allowed.
pub fn parquet(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match path.extension() {
        Some(extension) if extension == "parquet" => Ok(path),
        _ => Err(format!("`{text}` must end with .parquet")),
    }
}

/// Parses the path of recorded scans, whose extension must be .parquet for a table or .pcd for a
/// folder.
///
/// # Errors
/// What is wrong, and what is allowed.
pub fn scans(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("parquet" | "pcd") => Ok(path),
        _ => Err(format!("`{text}` must end with .parquet, for a table, or with .pcd, for a folder")),
    }
}

/// Parses the path of a recording, whose extension must be .rrd.
///
/// # Errors
/// What is wrong, and what is allowed.
pub fn recording(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match path.extension() {
        Some(extension) if extension == "rrd" => Ok(path),
        _ => Err(format!("`{text}` must end with .rrd")),
    }
}

/// Largest number of samples in one trajectory file.
const MAX_SAMPLES: u64 = 100_000;

/// Parses a number of samples that fit into one trajectory file.
///
/// # Errors
/// What is wrong, and what is allowed.
pub fn sample_count(text: &str) -> Result<u64, String> {
    match count(text)? {
        number if number <= MAX_SAMPLES => Ok(number),
        number => Err(format!("`{number}` is too large: a trajectory file holds up to {MAX_SAMPLES} samples")),
    }
}

/// Parses a number of scenes.
///
/// # Errors
/// What is wrong, and what is allowed.
pub fn scene_count(text: &str) -> Result<u32, String> {
    let number = count(text)?;
    u32::try_from(number).map_err(|_| format!("`{number}` is too large: at most {} is allowed", u32::MAX))
}

/// Parses the name of a scenario.
///
/// # Errors
/// What is wrong, and what is allowed.
pub fn scenario_name(text: &str) -> Result<String, String> {
    match is_kebab_name(text) {
        true => Ok(text.to_owned()),
        false => Err(format!(
            "`{text}` is not a scenario's name: lower-case letters, digits and hyphens, starting with a letter"
        )),
    }
}

/// Returns the files of a campaign's folder. Its recordings, which can be made again, are not among
/// them.
pub fn files_of_campaign(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    entries.filter_map(|entry| Some(entry.ok()?.path())).filter(|path| path.is_file()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_count_is_a_whole_number_above_zero() {
        assert_eq!(count("200"), Ok(200));
        for (text, reason) in
            [("-5", "is negative"), ("0", "`0` is too small"), ("1.5", "not a whole number"), ("", "whole")]
        {
            assert!(count(text).unwrap_err().contains(reason), "{text}");
        }
        assert!(count("99999999999999999999999").unwrap_err().contains("too large"));
    }

    #[test]
    fn a_request_has_the_limits_of_the_command_line() {
        let jobs = serde_json::from_str::<Jobs>;
        assert_eq!(jobs("1024").unwrap(), Jobs(1024));
        for wrong in ["0", "1025", "-1", "1.5", "true", "\"3\"", "null", "70000"] {
            let error = jobs(wrong).unwrap_err().to_string();
            assert_eq!(error, format!("`{wrong}` is not a whole number from 1 to 1024"));
            assert!(wrong.parse::<Jobs>().is_err());
        }
        assert_eq!(serde_json::from_str::<Share>("0.1").unwrap(), Share(0.1));
        assert!(serde_json::from_str::<Share>("1.01").is_err() && "1.01".parse::<Share>().is_err());
        assert_eq!("1".parse::<PositiveShare>(), Ok(PositiveShare(1.0)));
        for wrong in ["0", "-0.1", "1.01", "nan"] {
            assert_eq!(wrong.parse::<PositiveShare>(), Err(format!("`{wrong}` is not a number above 0 and up to 1")));
        }
    }
}
