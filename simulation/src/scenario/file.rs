//! Reading a scenario file, and saying precisely what is wrong with it.

use std::path::{Path, PathBuf};

use closecall_scenarios::parameters::ParameterSpace;
use closecall_scenarios::sampling::Design;
use closecall_traffic::{ActorId, Check, ConfigError, ParameterName, Parameters};
use toml_edit::DocumentMut;

use super::edit::{Setting, SettingError};
use super::recorded::RecordedError;
use super::{Scenario, ScenarioConfig, locate, recorded};

/// How many random samples `check` tries beside the nominal values and the bounds.
const TRIED_SAMPLES: u64 = 64;

/// A scenario file that cannot be used. Nothing has been run.
#[derive(Debug, thiserror::Error)]
pub enum ScenarioError {
    /// It cannot be read.
    #[error("failed to read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// It is not text.
    #[error("failed to read {}: line {line} is not UTF-8 text; a scenario is a TOML file", path.display())]
    NotText {
        /// The file.
        path: PathBuf,
        /// The first line that is not text, counted from 1.
        line: usize,
    },
    /// It has no content.
    #[error("failed to read {}: the file is empty; a scenario needs at least `schema-version`, `name`, `duration-s`, `road` and actors", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// It is not TOML, or has a key or a value that does not belong there.
    #[error("failed to read {}:{line}: {message}", path.display())]
    Syntax {
        /// The file.
        path: PathBuf,
        /// The line, counted from 1.
        line: usize,
        /// What is wrong and what is allowed.
        message: String,
    },
    /// A value is out of range, or contradicts another.
    #[error("failed to check {}{}: {source}{at}", path.display(), line.map(|line| format!(":{line}")).unwrap_or_default())]
    Value {
        /// The file.
        path: PathBuf,
        /// The line, counted from 1, where the key stands in the file.
        line: Option<usize>,
        /// The key and what is wrong with it.
        source: Box<ConfigError>,
        /// The parameters with which it goes wrong, where it depends on them.
        at: String,
    },
    /// A `--set` that cannot be applied.
    #[error("failed to apply --set to {}: {source}", path.display())]
    Set {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: SettingError,
    },
}

/// A scenario file whose keys have been checked.
#[derive(Clone, Debug)]
pub struct ScenarioFile {
    path: PathBuf,
    text: String,
    config: ScenarioConfig,
    space: ParameterSpace,
    unused: Vec<ParameterName>,
}

impl ScenarioFile {
    /// Reads a file, changes it by `settings`, and checks its keys.
    ///
    /// # Errors
    /// [`ScenarioError`] names the file, the line, the key, and what is allowed.
    pub fn load(path: &Path, settings: &[Setting]) -> Result<Self, ScenarioError> {
        let bytes = std::fs::read(path).map_err(|source| ScenarioError::Read { path: path.to_owned(), source })?;
        let text = String::from_utf8(bytes).map_err(|error| {
            let line = locate::line_at(&String::from_utf8_lossy(error.as_bytes()), error.utf8_error().valid_up_to());
            ScenarioError::NotText { path: path.to_owned(), line }
        })?;
        Self::parse(path, &text, settings)
    }

    /// The same for a text that is at hand; `path` serves messages.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn parse(path: &Path, text: &str, settings: &[Setting]) -> Result<Self, ScenarioError> {
        if text.trim().is_empty() {
            return Err(ScenarioError::Empty { path: path.to_owned() });
        }
        // The text as it stands is read first, so that errors in the file have the file's own lines.
        let mut config = deserialize(path, text)?;
        // A setting may replace the only use of a parameter: only what the file itself leaves unused is a slip.
        let unused = unused(&config, text);
        let mut text = text.to_owned();
        if !settings.is_empty() {
            text = apply(path, &text, settings)?;
            config = deserialize(path, &text)?;
        }
        if let Some(inlined) =
            recorded::inline(path, &text, &config).map_err(|error| recorded_error(path, &text, &error))?
        {
            text = inlined;
            config = deserialize(path, &text)?;
        }
        let space = config.parameters.check().map_err(|error| {
            let source = error.within("parameters");
            let line = locate::line_of(&text, &source.path);
            ScenarioError::Value { path: path.to_owned(), line, source: Box::new(source), at: String::new() }
        })?;
        Ok(Self { path: path.to_owned(), text, config, space, unused })
    }

    /// The file's path, as given.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The scenario's text, all settings applied.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The scenario as it is written.
    pub fn config(&self) -> &ScenarioConfig {
        &self.config
    }

    /// The distributions of its parameters.
    pub fn space(&self) -> &ParameterSpace {
        &self.space
    }

    /// Parameters that are sampled although no value of the file names them: most likely a slip.
    pub fn unused_parameters(&self) -> &[ParameterName] {
        &self.unused
    }

    /// The name of E, or nothing where no actor has an ego stack.
    pub fn ego_id(&self) -> Option<&ActorId> {
        let is_ego = |driver: &_| matches!(driver, closecall_controllers::DriverConfig::EgoStack(_));
        self.config.actors.iter().find(|actor| is_ego(&actor.driver)).map(|actor| &actor.id)
    }

    /// The concrete scenario with these parameters.
    ///
    /// # Errors
    /// [`ScenarioError::Value`] where a value is out of range or contradicts another.
    pub fn concrete(&self, parameters: &Parameters) -> Result<Scenario, ScenarioError> {
        self.config.check(parameters).map_err(|source| {
            let line = locate::line_of(&self.text, &source.path);
            ScenarioError::Value { path: self.path.clone(), line, source: Box::new(source), at: describe(parameters) }
        })
    }

    /// Checks the scenario with the median of every parameter, with each parameter at both of its bounds, and with 64
    /// random samples.
    ///
    /// # Errors
    /// The first of these that is not a valid scenario.
    pub fn check(&self) -> Result<(), ScenarioError> {
        for parameters in self.space.extremes() {
            self.concrete(&parameters)?;
        }
        for index in 0..TRIED_SAMPLES {
            self.concrete(&self.space.sample(Design::Random, 0, index, TRIED_SAMPLES))?;
        }
        Ok(())
    }
}

fn describe(parameters: &Parameters) -> String {
    let values: Vec<String> = parameters.iter().map(|(name, value)| format!("{name} = {value}")).collect();
    if values.is_empty() { String::new() } else { format!(" (with {})", values.join(", ")) }
}

fn apply(path: &Path, text: &str, settings: &[Setting]) -> Result<String, ScenarioError> {
    let mut document: DocumentMut = text.parse().map_err(|error: toml_edit::TomlError| ScenarioError::Syntax {
        path: path.to_owned(),
        line: locate::line_at(text, error.span().map_or(0, |span| span.start)),
        message: error.message().to_owned(),
    })?;
    for setting in settings {
        setting.apply(&mut document).map_err(|source| ScenarioError::Set { path: path.to_owned(), source })?;
    }
    Ok(document.to_string())
}

/// An error at the first line that speaks of a recording.
fn recorded_error(path: &Path, text: &str, error: &RecordedError) -> ScenarioError {
    let line = text.lines().position(|line| line.contains("recorded")).map_or(1, |index| index + 1);
    ScenarioError::Syntax { path: path.to_owned(), line, message: format!("`recorded`: {error}") }
}

fn deserialize(path: &Path, text: &str) -> Result<ScenarioConfig, ScenarioError> {
    toml::from_str(text).map_err(|error: toml::de::Error| {
        let offset = error.span().map_or(0, |span| span.start);
        let line = locate::line_at(text, offset);
        let named = key_at(text, offset).map(|key| format!("`{key}`: ")).unwrap_or_default();
        let message = format!("{named}{}", in_plain_words(error.message()));
        ScenarioError::Syntax { path: path.to_owned(), line, message }
    })
}

/// The parameters that are sampled although no value names them.
fn unused(config: &ScenarioConfig, text: &str) -> Vec<ParameterName> {
    let Ok(document) = toml::from_str::<toml::Table>(text) else { return Vec::new() };
    let mut used = Vec::new();
    for (_, value) in document.iter().filter(|(key, _)| *key != "parameters") {
        append_names(value, &mut used);
    }
    config.parameters.0.keys().filter(|name| !used.contains(&name.as_str())).cloned().collect()
}

/// Appends the names of the parameters that stand for values somewhere in `value`.
fn append_names<'a>(value: &'a toml::Value, names: &mut Vec<&'a str>) {
    match value {
        toml::Value::String(text) => names.extend(text.strip_prefix('$')),
        toml::Value::Array(values) => values.iter().for_each(|value| append_names(value, names)),
        toml::Value::Table(table) => table.iter().for_each(|(_, value)| append_names(value, names)),
        _ => {}
    }
}

/// The deserialiser's message without the names of this program's types.
fn in_plain_words(message: &str) -> String {
    const WORDS: [(&str, &str); 5] = [
        ("u8", "a whole number from 0 to 255"),
        ("u32", "a whole number, 0 or more"),
        ("u64", "a whole number, 0 or more"),
        ("f64", "a number"),
        ("a sequence", "a list"),
    ];
    let Some((found, expected)) = message.split_once("expected ") else { return message.to_owned() };
    let plain = WORDS.iter().find(|(rust, _)| expected.trim_end() == *rust).map(|(_, plain)| *plain);
    match plain {
        Some(plain) => format!("{found}expected {plain}"),
        None if expected.starts_with("struct ") => format!("{found}expected a table of keys"),
        None => message.to_owned(),
    }
}

/// The key that a byte offset lies in or behind, on its line, for messages that have only a position.
fn key_at(text: &str, offset: usize) -> Option<String> {
    let offset = offset.min(text.len());
    let start = text[..offset].rfind(['\n', '{', ',']).map_or(0, |delimiter| delimiter + 1);
    let line = text[start..].lines().next()?;
    let key = line.split('=').next()?.trim();
    let is_key = !key.is_empty() && key.chars().all(|c| c.is_alphanumeric() || "-_.\"".contains(c));
    is_key.then(|| key.to_owned())
}
