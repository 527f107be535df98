//! Reads scenario files. Errors name the file, the line, the key, and what is allowed.

use std::io::{self, Read};
use std::path::{Path, PathBuf};

use crate::coverage::CoveragePlan;
use crate::parameters::ParameterSpace;
use crate::sampling::Design;
use closecall_sensors::camera::{CameraConfig, Pipeline};
use closecall_sensors::external::ProgramSettings;
use closecall_sensors::{SensorMode, Sensors};
use closecall_traffic::input;
use closecall_traffic::suggest::hint;
use closecall_traffic::{ActorId, Check, ConfigError, KeyPath, ParameterName, Parameters, Problem, Segment, Value};
use toml_edit::DocumentMut;

use super::edit::{Setting, SettingError};
use super::recorded::RecordedError;
use super::{Scenario, ScenarioConfig, base, lidar_file, locate, overridden, recorded};

/// Number of random samples that `check` checks in addition to the nominal values and the bounds.
const CHECKED_SAMPLES: u64 = 64;

/// Largest size of a scenario file (bytes). A scenario with minutes of recorded speeds has about 1
/// MiB.
const MAX_FILE_BYTES: u64 = 64 << 20;

/// Largest number of parameters. Each is checked at its bounds with the values of all others, and
/// the time grows with the square of their number. An assumption: 30 times as many as any scenario
/// of the library has.
const MOST_PARAMETERS: u64 = 1_000;

/// A scenario file that cannot be used. No run has been started.
#[derive(Debug, thiserror::Error)]
pub enum ScenarioError {
    /// The file cannot be read.
    #[error("failed to read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// No file and no scenario of the library has this name.
    #[error("there is no scenario `{name}`: no file and no scenario of the library has this name{suggestion}")]
    Unknown {
        /// The name.
        name: String,
        /// The end of the message, which names a similar scenario of the library; empty if there is
        /// none.
        suggestion: String,
    },
    /// The file is not UTF-8 text.
    #[error("failed to read {}: line {line} is not UTF-8 text; a scenario is a TOML file", path.display())]
    NotText {
        /// The file.
        path: PathBuf,
        /// The first line that is not text, counted from 1.
        line: usize,
    },
    /// The file is larger than any scenario.
    #[error("failed to read {}: the file is larger than {limit_mib} MiB; a scenario is a TOML file of a few KiB", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// The largest size (MiB).
        limit_mib: u64,
    },
    /// The file is empty.
    #[error("failed to read {}: the file is empty; a scenario needs at least `schema-version`, `name`, `duration-s`, `road` and actors", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// The file is not valid TOML, or has an unknown key or a value of the wrong type.
    #[error("failed to read {}{}: {message}", path.display(), line.map(|line| format!(":{line}")).unwrap_or_default())]
    Syntax {
        /// The file.
        path: PathBuf,
        /// The line, counted from 1, or `None` if the file does not contain the key.
        line: Option<usize>,
        /// What is wrong and what is allowed.
        message: String,
    },
    /// A value is out of range, or contradicts another value.
    #[error("failed to check {}{}: {source}{at}", path.display(), line.map(|line| format!(":{line}")).unwrap_or_default())]
    Value {
        /// The file.
        path: PathBuf,
        /// The line of the key, counted from 1, or `None` if the file does not contain the key.
        line: Option<usize>,
        /// The key and what is wrong with it.
        source: Box<ConfigError>,
        /// The parameter values for which the check failed; empty if there are no parameters.
        at: String,
    },
    /// A parameter is sampled, and no value of the scenario uses it: its samples would differ in
    /// nothing that a run could show.
    #[error("failed to check {}{}: unused parameter: `{name}` is sampled, but no value uses it: write \"${name}\" where its value belongs, or remove it", path.display(), line.map(|line| format!(":{line}")).unwrap_or_default())]
    UnusedParameter {
        /// The file.
        path: PathBuf,
        /// The line of the parameter, counted from 1.
        line: Option<usize>,
        /// The parameter.
        name: ParameterName,
    },
    /// A setting (`--set`) cannot be applied.
    #[error("failed to apply a setting to {}: {source}", path.display())]
    Set {
        /// The file.
        path: PathBuf,
        /// The error of the setting.
        source: SettingError,
    },
}

impl ScenarioError {
    /// Returns whether the file cannot be read at all.
    pub fn is_io(&self) -> bool {
        matches!(self, Self::Read { source, .. } if !input::is_of_content(source))
    }

    /// Returns whether a setting names what does not exist, or contradicts another one.
    pub const fn is_setting(&self) -> bool {
        matches!(self, Self::Set { source, .. } if !matches!(source, SettingError::Value { .. }))
    }

    /// Returns the line of the error, counted from 1, or `None` if it has none.
    pub const fn line(&self) -> Option<usize> {
        match self {
            Self::NotText { line, .. } => Some(*line),
            Self::Syntax { line, .. } | Self::Value { line, .. } | Self::UnusedParameter { line, .. } => *line,
            Self::Read { .. }
            | Self::TooLarge { .. }
            | Self::Empty { .. }
            | Self::Set { .. }
            | Self::Unknown { .. } => None,
        }
    }
}

/// A scenario file whose keys have been checked.
#[derive(Clone, Debug)]
pub struct ScenarioFile {
    path: PathBuf,
    text: String,
    /// Where the lines of keys are found.
    origin: locate::Origin,
    config: ScenarioConfig,
    space: ParameterSpace,
    coverage: CoveragePlan,
    unused: Option<ParameterName>,
    trajectory_files: Vec<PathBuf>,
    settings: Vec<Setting>,
    /// The folder in which a perception program runs; `None` for the folder of this program.
    program_folder: Option<String>,
}

impl ScenarioFile {
    /// Reads a file, applies `settings` to it, and checks its keys.
    ///
    /// # Errors
    /// [`ScenarioError`] if the file cannot be read or parsed, if a setting cannot be applied, or
    /// if a distribution is invalid.
    pub fn load(path: &Path, settings: &[Setting]) -> Result<Self, ScenarioError> {
        let bytes = read_bounded(path).map_err(|source| ScenarioError::Read { path: path.to_owned(), source })?;
        if bytes.len() as u64 > MAX_FILE_BYTES {
            return Err(ScenarioError::TooLarge { path: path.to_owned(), limit_mib: MAX_FILE_BYTES >> 20 });
        }
        let text = String::from_utf8(bytes).map_err(|error| {
            let line = locate::line_at(&String::from_utf8_lossy(error.as_bytes()), error.utf8_error().valid_up_to());
            ScenarioError::NotText { path: path.to_owned(), line }
        })?;
        Self::parse(path, &text, settings)
    }

    /// Parses the text of a scenario file, applies `settings` to it, and checks its keys. `path`
    /// appears in error messages, and trajectory files are found relative to its folder.
    ///
    /// # Errors
    /// [`ScenarioError`], as for [`Self::load`].
    pub fn parse(path: &Path, text: &str, settings: &[Setting]) -> Result<Self, ScenarioError> {
        if text.trim().is_empty() {
            return Err(ScenarioError::Empty { path: path.to_owned() });
        }
        if text.trim_start().starts_with('<') {
            let message = format!(
                "it is XML, and a scenario is a TOML file: `closecall tool import {} -o scenario.toml` imports OpenSCENARIO",
                path.display()
            );
            return Err(ScenarioError::Syntax { path: path.to_owned(), line: Some(1), message });
        }
        match base::expand(text) {
            Ok(None) => Self::parse_whole(path, text, text, settings),
            Ok(Some(whole)) => Self::parse_whole(path, text, &whole, settings),
            Err((line, message)) => Err(ScenarioError::Syntax { path: path.to_owned(), line: Some(line), message }),
        }
    }

    /// Parses the text of a scenario that has no base. `own` is the text of the file, in which
    /// lines are counted.
    fn parse_whole(path: &Path, own: &str, text: &str, settings: &[Setting]) -> Result<Self, ScenarioError> {
        // The text is read once. With settings the unchanged text comes first, so that an error of
        // the file is none of a setting.
        let mut origin = locate::Origin::new(own, text);
        let mut config = deserialize(path, text, &origin)?;
        let value_error = |source: ConfigError, origin: &locate::Origin| {
            let line = origin.line_of(&source.path);
            ScenarioError::Value { path: path.to_owned(), line, source: Box::new(source), at: String::new() }
        };
        let parameters = config.parameters.0.len() as u64;
        if parameters > MOST_PARAMETERS {
            let problem = Problem::WrongCount { value: parameters, allowed: "a number of parameters from 0 to 1000" };
            return Err(value_error(ConfigError::new("parameters", problem), &origin));
        }
        // A setting may replace the only use of a parameter. Only a parameter that the file itself
        // does not use is a mistake.
        let unused = unused_parameter(&config, text);
        let mut text = text.to_owned();
        if !settings.is_empty() {
            let before_settings = text;
            text = apply(path, &before_settings, settings)?;
            origin = locate::Origin::new(own, &text);
            let after: ScenarioConfig =
                toml::from_str(&text).map_err(|_| wrong_setting(path, &before_settings, settings))?;
            let before = std::mem::replace(&mut config, after);
            let weakened = overridden::weakened(&before, &config);
            if weakened != config.overridden {
                text = with_overridden(&text, &weakened);
                config.overridden = weakened;
            }
        }
        let trajectory_files = recorded::files(path, &config);
        if let Some(inlined) = recorded::inline(path, &text, &mut config)
            .map_err(|error| recorded_error(path, &config, &origin, &error))?
        {
            text = inlined;
        }
        if let Some(inlined) = lidar_file::inline(path, &text, &origin, &mut config)? {
            text = inlined;
        }
        let space = config.parameters.check().map_err(|error| value_error(error.within("parameters"), &origin))?;
        let coverage = config.coverage.check(&space).and_then(|plan| config.check_coverage_gates(&plan).map(|()| plan));
        let coverage = coverage.map_err(|error| value_error(error.within("coverage"), &origin))?;
        let strata = coverage.strata(&space);
        Ok(Self {
            path: path.to_owned(),
            text,
            origin,
            config,
            space: space.with_strata(strata),
            coverage,
            unused,
            trajectory_files,
            settings: settings.to_vec(),
            program_folder: None,
        })
    }

    /// Returns the same file with another text, whose keys are checked. Settings and trajectory
    /// files stay as they are.
    ///
    /// # Errors
    /// [`ScenarioError`] if the text is not a scenario, or if a distribution is invalid.
    pub(super) fn with_text(&self, text: &str) -> Result<Self, ScenarioError> {
        let Self { origin, trajectory_files, settings, unused, program_folder, .. } = self.clone();
        Ok(Self { origin, trajectory_files, settings, unused, program_folder, ..Self::parse(&self.path, text, &[])? })
    }

    /// Returns the same file, whose perception program runs in this folder. If the name of the
    /// folder is not UTF-8, the program runs in the folder of this process.
    #[must_use]
    pub fn with_program_in(self, folder: Option<&Path>) -> Self {
        Self { program_folder: folder.and_then(Path::to_str).map(str::to_owned), ..self }
    }

    /// Returns the folder in which the perception program runs; `None` for the folder of this
    /// program.
    pub fn program_folder(&self) -> Option<&str> {
        self.program_folder.as_deref()
    }

    /// Returns the program that perceives in place of the built-in chain, if the file names one.
    pub fn program(&self) -> Option<ProgramSettings> {
        let sensors = self.config.sensors.check(&self.space.nominal()).ok()?;
        self.with_folder(sensors).program()
    }

    /// Returns a scenario whose perception program runs in the folder of this file's programs.
    #[must_use]
    pub fn with_program_folder(&self, scenario: Scenario) -> Scenario {
        Scenario { sensors: self.with_folder(scenario.sensors), ..scenario }
    }

    /// Returns sensors whose program runs in the folder of this file's programs.
    fn with_folder(&self, sensors: Sensors) -> Sensors {
        self.program_folder.as_ref().map_or(sensors, |folder| sensors.with_program_in(folder))
    }

    /// Returns the path of the file, as given.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the trajectory files that the file names.
    pub fn trajectory_files(&self) -> &[PathBuf] {
        &self.trajectory_files
    }

    /// Returns the settings that were applied to the file.
    pub fn settings(&self) -> &[Setting] {
        &self.settings
    }

    /// Returns the setting that is undone if `key` is given values; `None` if there is none, or
    /// `key` is no path of keys.
    pub fn undone_by(&self, key: &str) -> Option<&Setting> {
        // Of two values, one differs from the value of a setting with the same key.
        let values = ["0", "1"].map(|value| format!("{key}={value}").parse::<Setting>().ok());
        self.settings.iter().find(|set| values.iter().flatten().any(|value| value.undoes(set)))
    }

    /// Returns the text of the scenario, with all settings applied.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Returns the contents of the file, with all settings applied.
    pub fn config(&self) -> &ScenarioConfig {
        &self.config
    }

    /// Returns what the samples should cover.
    pub fn coverage(&self) -> &CoveragePlan {
        &self.coverage
    }

    /// Returns the distributions of the parameters.
    pub fn space(&self) -> &ParameterSpace {
        &self.space
    }

    /// Returns the rear cameras that may have this pipeline in some sample: the file names it, or a
    /// parameter can.
    pub fn cameras_with(&self, pipeline: Pipeline) -> impl Iterator<Item = &CameraConfig> {
        let may_have = move |camera: &&CameraConfig| {
            self.space.extremes().any(|parameters| parameters.word(&camera.pipeline, "pipeline") == Ok(pipeline))
        };
        self.config.sensors.rear_cameras().filter(may_have)
    }

    /// Returns whether some sample may have this mode of the sensors, unless a command asks for the
    /// mode `asked`.
    pub fn may_have_mode(&self, mode: SensorMode, asked: Option<SensorMode>) -> bool {
        let choice = &self.config.sensors.mode;
        asked.map_or_else(
            || self.space.extremes().any(|parameters| parameters.word(choice, "mode") == Ok(mode)),
            |asked| asked == mode,
        )
    }

    /// Refuses a file with a parameter that no value uses. The text of a saved campaign may have
    /// one, if a setting has replaced its only use.
    ///
    /// # Errors
    /// [`ScenarioError::UnusedParameter`] for the first such parameter. [`ScenarioError::Value`]
    /// for a value that names no parameter: its name is misspelt, and the parameter is not to
    /// blame.
    pub fn refuse_unused(self) -> Result<Self, ScenarioError> {
        if self.unused.is_some() && self.names_a_missing_parameter() {
            self.concrete(&self.space.nominal())?;
        }
        let Some(name) = self.unused.clone() else { return Ok(self) };
        let key = KeyPath(["parameters", name.as_str()].map(|key| Segment::Key(key.to_owned())).into());
        let line = self.origin.line_of(&key);
        Err(ScenarioError::UnusedParameter { path: self.path, line, name })
    }

    /// Returns whether some value has the form of a parameter's name, and no parameter has this
    /// name.
    fn names_a_missing_parameter(&self) -> bool {
        let Ok(document) = toml::from_str::<toml::Table>(&self.text) else { return false };
        let names = &self.config.parameters.0;
        used_parameters(&document).into_iter().any(|used| !names.keys().any(|name| name.as_str() == used))
    }

    /// Returns the name of the ego, or `None` if no actor has an ego stack.
    pub fn ego_id(&self) -> Option<&ActorId> {
        let is_ego = |driver: &_| matches!(driver, closecall_controllers::DriverConfig::EgoStack(_));
        self.config.actors.iter().find(|actor| is_ego(&actor.driver)).map(|actor| &actor.id)
    }

    /// Returns the concrete scenario with these parameter values.
    ///
    /// # Errors
    /// [`ScenarioError::Value`] if a value is out of range or contradicts another value.
    pub fn concrete(&self, parameters: &Parameters) -> Result<Scenario, ScenarioError> {
        self.concrete_at(parameters, &[])
    }

    /// Works like [`Self::concrete`]. The message of an error has the values of `named`, too.
    fn concrete_at(&self, parameters: &Parameters, named: &[String]) -> Result<Scenario, ScenarioError> {
        let checked = self.config.check(parameters);
        checked.map(|scenario| self.with_program_folder(scenario)).map_err(|source| {
            let near = match parameters_near(&self.text, &source.path) {
                Some(near) => near,
                None if named.is_empty() => self.parameters_of(&source, parameters),
                None => Vec::new(),
            };
            self.located(source, describe(&[near.as_slice(), named].concat(), parameters))
        })
    }

    /// Returns the names of the parameters that an error depends on: a slightly different number
    /// leads to another error, or to none. Returns all names if no number does.
    fn parameters_of(&self, error: &ConfigError, parameters: &Parameters) -> Vec<String> {
        const STEP: f64 = 1e-3;
        let matters = |(name, value): &(&ParameterName, &Value)| {
            let Value::Number(number) = value else { return false };
            let mut changed = parameters.clone();
            changed.insert((*name).clone(), Value::Number(number + STEP * number.abs().max(1.0)));
            self.config.check(&changed).err().as_ref() != Some(error)
        };
        let names = |(name, _): (&ParameterName, &Value)| name.as_str().to_owned();
        let concerned: Vec<String> = parameters.iter().filter(matters).map(names).collect();
        if concerned.is_empty() { parameters.iter().map(names).collect() } else { concerned }
    }

    /// Returns an error with its place in the file. `at` says when it holds.
    pub(super) fn located(&self, source: ConfigError, at: String) -> ScenarioError {
        let line = self.origin.line_of(&source.path);
        ScenarioError::Value { path: self.path.clone(), line, source: Box::new(source), at }
    }

    /// Checks the scenario with the median of every parameter, with each parameter at each of its
    /// bounds, and with 64 random samples.
    ///
    /// # Errors
    /// [`ScenarioError::Value`] for the first of these scenarios that is not valid.
    pub fn check(&self) -> Result<(), ScenarioError> {
        let mut extremes = self.space.extremes();
        let Some(medians) = extremes.next() else { return Ok(()) };
        self.concrete(&medians)?;
        for parameters in extremes {
            self.concrete_at(&parameters, &differing(&medians, &parameters))?;
        }
        for index in 0..CHECKED_SAMPLES {
            self.concrete(&self.space.sample(Design::Random, 0, index, CHECKED_SAMPLES))?;
        }
        Ok(())
    }
}

/// Reads a file, or the first bytes of it if it is larger than [`MAX_FILE_BYTES`].
fn read_bounded(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    input::open(path)?.take(MAX_FILE_BYTES + 1).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Returns the names of the parameters that a value uses, or else the parameters of the nearest
/// table around it that uses some. The whole file does not count: its parameters would hide the one
/// that matters. Returns `None` for a value that is not in the file but follows from others, which
/// may use any parameter.
fn parameters_near(text: &str, path: &KeyPath) -> Option<Vec<String>> {
    let root = toml::Value::Table(toml::from_str::<toml::Table>(text).ok()?);
    let mut around = vec![&root];
    for segment in &path.0 {
        let value = around.last()?;
        around.push(match segment {
            Segment::Key(_) if value.is_array() => break,
            Segment::Key(key) => value.get(key.as_str())?,
            Segment::Index(index) => value.get(*index)?,
        });
    }
    let names_of = |value: &toml::Value| {
        let mut names = Vec::new();
        append_names(value, &mut names);
        names.into_iter().map(str::to_owned).collect::<Vec<_>>()
    };
    Some(around.into_iter().skip(1).rev().map(names_of).find(|names| !names.is_empty()).unwrap_or_default())
}

/// Returns the names of the parameters whose values differ.
fn differing(typical: &Parameters, parameters: &Parameters) -> Vec<String> {
    let pairs = typical.iter().zip(parameters.iter());
    pairs.filter(|(one, other)| one.1 != other.1).map(|((name, _), _)| name.as_str().to_owned()).collect()
}

/// Returns the values of some parameters, as the end of a message.
fn describe(names: &[String], parameters: &Parameters) -> String {
    const DIGITS: f64 = 1e6;
    let shown = |value: &Value| match value {
        Value::Number(number) => ((number * DIGITS).round() / DIGITS).to_string(),
        Value::Label(label) => label.clone(),
    };
    let chosen = parameters.iter().filter(|(name, _)| names.iter().any(|used| used == name.as_str()));
    let values: Vec<String> = chosen.map(|(name, value)| format!("{name} = {}", shown(value))).collect();
    if values.is_empty() { String::new() } else { format!(" (with {})", values.join(", ")) }
}

fn apply(path: &Path, text: &str, settings: &[Setting]) -> Result<String, ScenarioError> {
    let mut document: DocumentMut = text.parse().map_err(|error: toml_edit::TomlError| ScenarioError::Syntax {
        path: path.to_owned(),
        line: Some(locate::line_at(text, error.span().map_or(0, |span| span.start))),
        message: error.message().to_owned(),
    })?;
    let in_set = |source| ScenarioError::Set { path: path.to_owned(), source };
    Setting::apply_all(settings, &mut document).map_err(in_set)?;
    Ok(document.to_string())
}

/// Returns the error of the setting that makes a file no scenario: with those before it the file
/// can be read. `text` is the text without settings.
fn wrong_setting(path: &Path, text: &str, settings: &[Setting]) -> ScenarioError {
    let message_with = |count: usize| {
        let changed = apply(path, text, &settings[..count]).ok()?;
        let error = toml::from_str::<ScenarioConfig>(&changed).err()?;
        Some(message_of(&changed, &error))
    };
    let wrong = (1..=settings.len()).rev().find(|count| message_with(count - 1).is_none()).unwrap_or(1);
    let setting = settings[wrong - 1].to_string();
    let message = message_with(wrong).unwrap_or_default();
    ScenarioError::Set { path: path.to_owned(), source: SettingError::Value { setting, message } }
}

/// Returns the text with the list of the demands that its settings weakened.
fn with_overridden(text: &str, weakened: &[String]) -> String {
    let Ok(mut document) = text.parse::<DocumentMut>() else { return text.to_owned() };
    document.insert(overridden::KEY, toml_edit::value(toml_edit::Array::from_iter(weakened)));
    document.to_string()
}

/// Converts an error of recorded traffic. Its line is the line of the key `recorded` of its actor.
fn recorded_error(
    path: &Path,
    config: &ScenarioConfig,
    origin: &locate::Origin,
    error: &RecordedError,
) -> ScenarioError {
    let index = config.actors.iter().position(|actor| actor.id.as_str() == error.actor());
    let keys = ["driver", "prescribed", "recorded"].map(|key| Segment::Key(key.to_owned()));
    let actor = [Segment::Key("actor".to_owned()), Segment::Index(index.unwrap_or_default())];
    let line = origin.line_of(&KeyPath(actor.into_iter().chain(keys).collect()));
    ScenarioError::Syntax { path: path.to_owned(), line, message: format!("`recorded`: {error}") }
}

fn deserialize(path: &Path, text: &str, origin: &locate::Origin) -> Result<ScenarioConfig, ScenarioError> {
    toml::from_str(text).map_err(|error: toml::de::Error| {
        let line = origin.line_at(text, error.span().map_or(0, |span| span.start));
        ScenarioError::Syntax { path: path.to_owned(), line, message: message_of(text, &error) }
    })
}

/// Returns what is wrong with a text that is no scenario: the key, and what is allowed.
fn message_of(text: &str, error: &toml::de::Error) -> String {
    let offset = error.span().map_or(0, |span| span.start);
    let named = key_at(text, offset).map(|key| format!("`{key}`: ")).unwrap_or_default();
    format!("{named}{}{}", without_rust_types(error.message()), suggestion(error.message()))
}

/// The keys at the top level that no run uses: a parameter that only they name changes nothing.
const NO_RUN_USES: [&str; 10] = [
    "parameters",
    "name",
    "description",
    "tags",
    "requirements",
    "checks",
    "gate",
    "expects",
    "expects-share",
    overridden::KEY,
];

/// Returns the names of the parameters that some value uses.
pub(super) fn used_parameters(document: &toml::Table) -> Vec<&str> {
    let mut used = Vec::new();
    for (_, value) in document.iter().filter(|(key, _)| !NO_RUN_USES.contains(&key.as_str())) {
        append_names(value, &mut used);
    }
    used
}

/// Returns a parameter that no value uses, if there is one.
fn unused_parameter(config: &ScenarioConfig, text: &str) -> Option<ParameterName> {
    let document = toml::from_str::<toml::Table>(text).ok()?;
    let used = used_parameters(&document);
    config.parameters.0.keys().find(|name| !used.contains(&name.as_str())).cloned()
}

/// Appends the names of all parameters that `value` uses.
fn append_names<'a>(value: &'a toml::Value, names: &mut Vec<&'a str>) {
    match value {
        toml::Value::String(text) => names.extend(text.strip_prefix('$')),
        toml::Value::Array(values) => values.iter().for_each(|value| append_names(value, names)),
        toml::Value::Table(table) => table.iter().for_each(|(_, value)| append_names(value, names)),
        _ => {}
    }
}

/// Returns the known word that the message's first word resembles, as the end of the message. The
/// message is serde's: "unknown field `x`, expected one of `a`, `b`".
fn suggestion(message: &str) -> String {
    let is_unknown_word = message.starts_with("unknown field ") || message.starts_with("unknown variant ");
    match (message.split('`').nth(1), message.split_once("expected ")) {
        (Some(word), Some((_, names))) if is_unknown_word => hint(word, names),
        _ => String::new(),
    }
}

/// Returns the deserialiser's message without the names of Rust types.
fn without_rust_types(message: &str) -> String {
    const WORDS: [(&str, &str); 6] = [
        ("u8", "a whole number from 0 to 255"),
        ("usize", "a whole number, 0 or more"),
        ("u32", "a whole number, 0 or more"),
        ("u64", "a whole number, 0 or more"),
        ("f64", "a number"),
        ("a sequence", "a list"),
    ];
    let Some((beginning, expected)) = message.split_once("expected ") else { return message.to_owned() };
    let plain = WORDS.iter().find(|(rust, _)| expected.trim_end() == *rust).map(|(_, plain)| *plain);
    match plain {
        Some(plain) => format!("{beginning}expected {plain}"),
        None if expected.starts_with("struct ") => format!("{beginning}expected a table of keys"),
        None => message.to_owned(),
    }
}

/// Returns the key at a byte offset, or the last key before it on its line, for messages that have
/// only a position.
fn key_at(text: &str, offset: usize) -> Option<String> {
    let offset = offset.min(text.len());
    let start = text[..offset].rfind(['\n', '{', ',']).map_or(0, |delimiter| delimiter + 1);
    let line = text[start..].lines().next()?;
    let key = line.split('=').next()?.trim();
    let is_key = !key.is_empty() && key.chars().all(|c| c.is_alphanumeric() || "-_.\"".contains(c));
    is_key.then(|| key.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_names_no_type_of_rust() {
        let pattern = "layers-deg = [0.0, 1.0]\nlayers-per-group = 1.5";
        let text = format!("base = \"low-thw-overtake\"\n[sensors.rear-lidar.pattern]\n{pattern}\n");
        let error = ScenarioFile::parse(Path::new("a.toml"), &text, &[]).unwrap_err().to_string();
        assert!(error.contains("expected a whole number, 0 or more") && !error.contains("usize"), "{error}");
    }

    #[test]
    fn a_wrong_element_of_a_list_is_named_by_its_number() {
        let text =
            "base = \"low-thw-overtake\"\nname = \"a\"\ndescription = \"a\"\nrequirements = [\"MIS-1\", \"MIS 2\"]\n";
        let file = ScenarioFile::parse(Path::new("a.toml"), text, &[]).unwrap();
        let error = file.check().unwrap_err().to_string();
        assert!(error.contains("a.toml:4: `requirements[1]` is `MIS 2`"), "{error}");
    }

    #[test]
    fn an_error_names_the_parameters_that_the_value_uses_and_no_others() {
        let setting = "actor.rear.start.behind.gap-m=-5".parse().unwrap();
        let text = super::super::library::text("low-thw-overtake").unwrap();
        let file = ScenarioFile::parse(Path::new("a.toml"), text, &[setting]).unwrap();
        let message = file.check().unwrap_err().to_string();
        assert!(message.contains("(with closing-mps = 8.35)") && !message.contains("cut-out-thw-s"), "{message}");
    }

    #[test]
    fn an_error_in_a_list_or_of_a_value_that_follows_names_only_what_it_depends_on() {
        let text = super::super::library::text("low-thw-overtake").unwrap();
        let message = |setting: &str| {
            let file = ScenarioFile::parse(Path::new("a.toml"), text, &[setting.parse().unwrap()]).unwrap();
            file.check().unwrap_err().to_string()
        };
        for speed in ["400", "-1"] {
            let told = message(&format!("cruise-mps={speed}"));
            assert!(told.ends_with(&format!("(with cruise-mps = {speed})")), "{told}");
        }
        let file = ScenarioFile::parse(Path::new("a.toml"), text, &[]).unwrap();
        let nominal = file.space().nominal();
        let names_with = |name: &str, value: Value| {
            let mut wrong = nominal.clone();
            wrong.insert(ParameterName::new(name).unwrap(), value);
            file.parameters_of(&file.config.check(&wrong).err().unwrap(), &wrong)
        };
        assert_eq!(names_with("cruise-mps", Value::Number(400.0)), ["cruise-mps"]);
        let of_label = names_with("rear-class", Value::Label("tram".to_owned()));
        assert_eq!(of_label.len(), nominal.iter().count(), "no number is to blame");
    }

    #[test]
    fn a_misspelt_parameter_is_named_where_it_is_used_and_not_where_it_is_defined() {
        let parse = |from: &str, to: &str| {
            let text = super::super::library::text("low-thw-overtake").unwrap().replace(from, to);
            (ScenarioFile::parse(Path::new("a.toml"), &text, &[]).unwrap().refuse_unused().unwrap_err(), text)
        };
        let (error, text) = parse("\"$closing-mps\"", "\"$clsing-mps\"");
        let line = text.lines().position(|line| line.contains("$clsing-mps")).unwrap() + 1;
        assert_eq!(error.line(), Some(line), "{error}");
        let message = error.to_string();
        assert!(message.contains("$clsing-mps") && message.contains("did you mean `closing-mps`?"), "{message}");
        assert!(!message.contains("unused"), "{message}");
        // A parameter that nothing resembles is unused.
        let (error, _) = parse("\"$closing-mps\"", "8.0");
        assert!(matches!(error, ScenarioError::UnusedParameter { .. }), "{error}");
    }

    #[test]
    fn a_setting_that_the_scenario_cannot_have_is_named_and_no_line() {
        let parse = |settings: &[&str]| {
            let settings: Vec<Setting> = settings.iter().map(|text| text.parse().unwrap()).collect();
            let text = super::super::library::text("low-thw-overtake").unwrap();
            ScenarioFile::parse(Path::new("a.toml"), text, &settings).and_then(|file| file.check().map(|()| file))
        };
        let named = parse(&["duration-s=30", "sensors.additional-rear-cameras=[{name='wide',x-m=-2}]", "brake-mps2=6"]);
        let error = named.unwrap_err();
        assert!(!error.is_setting() && error.line().is_none(), "{error}");
        let message = error.to_string();
        let begin = "failed to apply a setting to a.toml: `sensors.additional-rear-cameras=[{name='wide',x-m=-2}]`: `x-m`: unknown field `x-m`";
        assert!(message.starts_with(begin), "{message}");
        assert!(parse(&["actor=3"]).unwrap_err().to_string().contains("`actor=3`: "));
        let error = parse(&["sensors.additional-rear-cameras=[{name='wide',yaw-deg=60}]"]).unwrap_err();
        assert!(
            error.to_string().starts_with("failed to check a.toml: `sensors.additional-rear-cameras[0].yaw-deg` is 60"),
            "{error}"
        );
        // A list that is replaced moves the lines below it, and not the lines of the file.
        let error = parse(&["fault.rear-lidar=[{dead=true}]", "actor.2.start.behind.gap-m=-5"]).unwrap_err();
        let text = super::super::library::text("low-thw-overtake").unwrap();
        let line = text.lines().position(|line| line.contains("behind") && line.contains("gap-m")).unwrap() + 1;
        assert_eq!(error.line(), Some(line), "{error}");
        let file = parse(&[
            "sensors.additional-rear-cameras=[{name='a'},{name='b'}]",
            "sensors.additional-rear-cameras[1].yaw-deg=20",
        ]);
        assert_eq!(file.unwrap().config().sensors.additional_rear_cameras.len(), 2);
    }

    #[test]
    fn a_misspelt_key_or_word_is_answered_with_a_suggestion() {
        let parse = |text: &str| ScenarioFile::parse(Path::new("a.toml"), text, &[]).unwrap_err().to_string();
        let message = parse("schema-version = 1\nname = 'a'\nduration = 3\n");
        assert!(message.starts_with("failed to read a.toml:3: "), "{message}");
        assert!(message.ends_with("; did you mean `duration-s`?"), "{message}");
        let message = parse("schema-version = 1\nroad = { lanes = 3, overtaking-side = 'lefft' }\n");
        assert!(message.ends_with("; did you mean `left`?"), "{message}");
        assert!(!parse("schema-version = 1\nzzz = 3\n").contains("did you mean"));
    }
}
