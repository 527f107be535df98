//! Arguments of a command line: numbers, and paths with a known extension. A refusal says what is
//! allowed.

use std::path::{Path, PathBuf};

use closecall_traffic::ActorId;

/// Parses a finite number above 0.
///
/// # Errors
/// What is wrong, and what is allowed.
pub fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err(format!("`{text}` is not a number above 0")),
    }
}

/// Parses a number of samples or scenes: a whole number above 0.
///
/// # Errors
/// What is wrong, and what is allowed.
pub fn count(text: &str) -> Result<u64, String> {
    let reason = match text.parse::<i128>() {
        Ok(number) if number > 0 => return u64::try_from(number).map_err(|_| format!("`{text}` is too large")),
        Ok(0) => "is no sample at all",
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
    u32::try_from(count(text)?).map_err(|_| format!("`{text}` is too large"))
}

/// Parses the name of a scenario.
///
/// # Errors
/// What is wrong, and what is allowed.
pub fn scenario_name(text: &str) -> Result<String, String> {
    match ActorId::new(text) {
        Ok(_) => Ok(text.to_owned()),
        Err(_) => Err(format!(
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
        for (text, reason) in [("-5", "is negative"), ("0", "no sample"), ("1.5", "not a whole number"), ("", "whole")]
        {
            assert!(count(text).unwrap_err().contains(reason), "{text}");
        }
        assert!(count("99999999999999999999999").unwrap_err().contains("too large"));
    }
}
