//! The file of a member, and its checks.

use std::path::{Path, PathBuf};

use crate::parameters::ParameterConfig;
use closecall_traffic::{ConfigError, is_kebab_name};
use serde::Deserialize;

use super::keys::{KINDS, MODELS, unknown};
use crate::locate::line_at;
use crate::source::same_name;

/// The version of the member files that this program reads.
const SCHEMA_VERSION: u32 = 1;

/// A member file that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum MemberError {
    /// The file cannot be read.
    #[error("failed to read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The file is not a member file.
    #[error("failed to read {}:{line}: {message}", path.display())]
    Syntax {
        /// The file.
        path: PathBuf,
        /// The line, counted from 1.
        line: usize,
        /// What is wrong, and what is allowed.
        message: String,
    },
    /// A value is not allowed.
    #[error("failed to check {}: `{key}`: {message}", path.display())]
    Value {
        /// The file.
        path: PathBuf,
        /// The key.
        key: String,
        /// What is wrong, and what is allowed.
        message: String,
    },
    /// Two members have the same name.
    #[error("{}", same_name(first, second, name))]
    SameName {
        /// One file.
        first: PathBuf,
        /// The other file.
        second: PathBuf,
        /// The name of both.
        name: String,
    },
    /// No member, file or folder has this name, or the folder contains no member.
    #[error("{place}: expected a file or folder of members (*.toml), or one of {names}{suggestion}")]
    Unknown {
        /// The name or path.
        place: String,
        /// The members that are part of the program.
        names: String,
        /// A similar name.
        suggestion: String,
    },
}

/// The text of a member file.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
struct MemberConfig {
    schema_version: u32,
    name: String,
    description: String,
    follow: Option<FollowConfig>,
    #[serde(default)]
    set: Vec<SetConfig>,
    /// What a calibration writes beside the values: figures for the reader.
    #[serde(default)]
    calibration: Option<toml::Table>,
}

/// The car-following model that replaces the scenario's.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub(super) struct FollowConfig {
    pub(super) model: String,
    source: String,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
struct SetConfig {
    key: String,
    value: toml::Value,
    drivers: Option<Vec<String>>,
    source: String,
}

/// The value of a key.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum SetValue {
    /// The same number in every sample.
    Number(f64),
    /// A distribution, as the table of a parameter.
    Distribution(toml::Table),
}

/// A key that a member sets.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Set {
    pub(super) key: String,
    pub(super) value: SetValue,
    /// The kinds of drivers whose key is set.
    pub(super) drivers: Vec<String>,
    pub(super) source: String,
}

/// A checked member of an ensemble.
#[derive(Clone, Debug, PartialEq)]
pub struct Member {
    path: PathBuf,
    name: String,
    description: String,
    pub(super) follow: Option<FollowConfig>,
    pub(super) sets: Vec<Set>,
}

impl Member {
    /// Reads the text of a member file. `path` appears in messages.
    ///
    /// # Errors
    /// [`MemberError`] if the text is no member, or if a key or a distribution is not valid.
    pub fn parse(path: &Path, text: &str) -> Result<Self, MemberError> {
        let config: MemberConfig = toml::from_str(text).map_err(|error| MemberError::Syntax {
            path: path.to_owned(),
            line: line_at(text, error.span().map_or(0, |span| span.start)),
            message: error.message().to_owned(),
        })?;
        let wrong = |key: &str, message: String| MemberError::Value { path: path.to_owned(), key: key.into(), message };
        if config.schema_version != SCHEMA_VERSION {
            let message =
                format!("{} is not {SCHEMA_VERSION}, the version that this program reads", config.schema_version);
            return Err(wrong("schema-version", message));
        }
        if !is_kebab_name(&config.name) {
            let message =
                format!("`{}`: expected lower-case letters, digits and hyphens, starting with a letter", config.name);
            return Err(wrong("name", message));
        }
        if config.set.is_empty() && config.follow.is_none() {
            return Err(wrong(
                "set",
                "the member changes nothing: expected `follow` or at least one `[[set]]`".to_owned(),
            ));
        }
        drop(config.calibration);
        if let Some(follow) = &config.follow {
            if !MODELS.contains(&follow.model.as_str()) {
                return Err(wrong("follow.model", format!("`{}`: expected `wiedemann99` or `idm`", follow.model)));
            }
            if follow.source.trim().is_empty() {
                return Err(wrong("follow.source", "the source is empty".to_owned()));
            }
        }
        let mut sets: Vec<Set> = Vec::with_capacity(config.set.len());
        for (index, set) in config.set.into_iter().enumerate() {
            let set = check_set(set).map_err(|(key, message)| wrong(&format!("set[{index}].{key}"), message))?;
            let is_same = |earlier: &Set| {
                earlier.key == set.key && earlier.drivers.iter().any(|driver| set.drivers.contains(driver))
            };
            if sets.iter().any(is_same) {
                return Err(wrong(&format!("set[{index}].key"), format!("`{}` is set twice", set.key)));
            }
            sets.push(set);
        }
        let MemberConfig { name, description, follow, .. } = config;
        Ok(Self { path: path.to_owned(), name, description, follow, sets })
    }

    /// Returns the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the description.
    pub fn description(&self) -> &str {
        &self.description
    }

    /// Returns the settings of the member, each as `key = value` with its source.
    pub fn values(&self) -> Vec<(String, String)> {
        let follow = self.follow.iter().map(|follow| (format!("follow = {}", follow.model), follow.source.clone()));
        let sets = self.sets.iter().map(|set| (format!("{} = {}", set.key, set.value), set.source.clone()));
        follow.chain(sets).collect()
    }
}

impl std::fmt::Display for SetValue {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let table = match self {
            Self::Number(number) => return write!(f, "{number}"),
            Self::Distribution(table) => table,
        };
        for (kind, value) in table {
            match value.as_table() {
                Some(numbers) => {
                    let numbers: Vec<String> = numbers.iter().map(|(key, value)| format!("{key} {value}")).collect();
                    write!(f, "{kind} ({})", numbers.join(", "))?;
                }
                None => write!(f, "{kind} {value}")?,
            }
        }
        Ok(())
    }
}

/// Checks one `[[set]]`. The error holds the key in the table, and the reason.
fn check_set(set: SetConfig) -> Result<Set, (String, String)> {
    let wrong = |key: &str, message: String| Err((key.to_owned(), message));
    if let Some(allowed) = unknown(&set.key) {
        return wrong("key", format!("`{}` is not a key of a human driver: {allowed}", set.key));
    }
    if set.source.trim().is_empty() {
        return wrong("source", "the source is empty: expected where the value comes from".to_owned());
    }
    let drivers = set.drivers.unwrap_or_else(|| KINDS.map(str::to_owned).to_vec());
    if let Some(unknown) = drivers.iter().find(|kind| !KINDS.contains(&kind.as_str())) {
        return wrong("drivers", format!("`{unknown}`: expected `overtaker`, `wiedemann99` or `idm`"));
    }
    let value = match set.value {
        toml::Value::Float(number) if number.is_finite() => SetValue::Number(number),
        toml::Value::Integer(number) => SetValue::Number(number as f64),
        toml::Value::Table(table) => {
            let parsed: Result<ParameterConfig, _> = toml::Value::Table(table.clone()).try_into();
            let config = parsed.map_err(|error| ("value".to_owned(), error.message().to_owned()))?;
            let located = |error: ConfigError| (format!("value.{}", error.path), error.problem.to_string());
            config.check().map_err(located)?;
            SetValue::Distribution(table)
        }
        other => return wrong("value", format!("`{other}`: expected a finite number or a distribution")),
    };
    Ok(Set { key: set.key, value, drivers, source: set.source })
}
