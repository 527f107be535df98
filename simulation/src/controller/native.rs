//! Controllers that are shared libraries (`lib:PATH`) or FMUs (`fmu:PATH`). A separate process
//! loads them, and a crash costs one sample.
//!
//! ```text
//!  campaign ──▶ worker process: whole samples with the controller inside      (see `closecall_campaign::host`)
//!  any other run ──▶ process that answers each control step, as `exec:COMMAND` does
//! ```
//!
//! Both processes are this program itself, with a hidden command: see [`set_program`].

use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::Duration;

use closecall_controllers::external::watch::Call;
use closecall_controllers::external::{
    Identity, Kind, Loaded, NativeController, VariableTable, Variables, unpack_for_children,
};
use closecall_controllers::{CheckedDriver, ControllerError, EgoCommand, EgoController, EgoInput, EgoSettings};
use serde::{Deserialize, Serialize};

use super::exec::{Child, DEFAULT_MEMORY_MIB, DEFAULT_TIMEOUT_MS, ExecError, ExecFactory, ExecSettings};
use super::hosted_process::COMMAND;
use super::isolated::Isolated;
use crate::run::ControllerFactory;
use closecall_scenarios::Scenario;
use closecall_traffic::Time;

/// The word of the hidden command before the folder of an unpacked FMU.
pub const UNPACKED: &str = "unpacked";

/// Time limit for loading a library or an FMU, at least. It may first have to read its files or to
/// start an interpreter.
pub(crate) const LOAD_TIMEOUT: Duration = Duration::from_secs(10);

/// The words that start this program.
static PROGRAM: OnceLock<Vec<String>> = OnceLock::new();

/// Sets the words that start this program, to which the hidden command is added. The first call
/// counts.
pub fn set_program(words: Vec<String>) {
    PROGRAM.get_or_init(|| words);
}

/// Returns the words that start this program with a hidden command.
pub fn command(arguments: &[&str]) -> Vec<String> {
    let words = PROGRAM.get_or_init(|| {
        // The running program, even if its file has been replaced.
        let executable = Path::new("/proc/self/exe");
        let path =
            if executable.exists() { executable.to_owned() } else { std::env::current_exe().unwrap_or_default() };
        vec![path.display().to_string()]
    });
    words.iter().cloned().chain([COMMAND.to_owned()]).chain(arguments.iter().map(ToString::to_string)).collect()
}

/// A library or an FMU, and its limits.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NativeSettings {
    /// The kind of the file.
    pub kind: Kind,
    /// The file.
    pub path: String,
    /// Time limit of each answer (ms).
    pub timeout_ms: u64,
    /// Largest resident memory of the process (MiB).
    pub memory_mib: u64,
}

impl NativeSettings {
    /// Returns the settings of a file with the default limits.
    pub fn new(kind: Kind, path: &str) -> Self {
        Self { kind, path: path.to_owned(), timeout_ms: DEFAULT_TIMEOUT_MS, memory_mib: DEFAULT_MEMORY_MIB }
    }

    /// Returns the controller as it is given on the command line.
    pub fn text(&self) -> String {
        format!("{}:{}", self.kind, self.path)
    }

    /// Returns the name in reports: `lib:` or `fmu:`, and the name of the file without its ending.
    pub fn name(&self) -> String {
        let stem = Path::new(&self.path).file_stem().map(|stem| stem.to_string_lossy().into_owned());
        format!("{}:{}", self.kind, stem.unwrap_or_default())
    }

    /// Returns the settings of a process of this program with these arguments, under the limits of
    /// the controller. A relative path of the controller is in `folder`, or in the folder of this
    /// program. An FMU is unpacked before the process starts: the unpacking does not count against
    /// the time of the process.
    pub fn process(&self, folder: Option<&Path>, arguments: &[&str]) -> ExecSettings {
        // A process that cannot unpack it says why.
        let unpacked = unpack_for_children(self.kind, &path_in(folder, self)).ok().flatten();
        let unpacked = unpacked.map(|folder| folder.display().to_string());
        let unpacked = unpacked.iter().flat_map(|folder| [UNPACKED, folder.as_str()]);
        let words = command(&unpacked.chain(arguments.iter().copied()).collect::<Vec<_>>());
        // A word with a NUL character, which cannot be quoted, names no file.
        let command = shlex::try_join(words.iter().map(String::as_str)).unwrap_or_default();
        ExecSettings { command, timeout_ms: self.timeout_ms, memory_mib: self.memory_mib }
    }

    /// Loads the file in a separate process, and returns the statements of the controller. A
    /// relative path is in `folder`, or in the folder of this program.
    ///
    /// # Errors
    /// [`NativeError`] if the file cannot be used.
    pub fn probe(&self, folder: Option<&Path>) -> Result<Identity, NativeError> {
        self.try_with(folder, None)
    }

    /// Checks that every variable of an FMU has its counterpart in a scenario. A relative path is
    /// in `folder`, or in the folder of this program.
    ///
    /// # Errors
    /// [`NativeError`] if one has none.
    pub fn check_variables(&self, scenario: &Scenario, folder: Option<&Path>) -> Result<(), NativeError> {
        let CheckedDriver::Ego(ego) = &scenario.actors[scenario.ego].driver else { return Ok(()) };
        // Serialising structs of numbers and names cannot fail.
        let settings = serde_json::to_value(ego).unwrap_or_default();
        let variables = Variables { table: scenario.variables.clone(), settings };
        if self.kind == Kind::Fmu { self.try_with(folder, Some(&variables)).map(drop) } else { Ok(()) }
    }

    fn try_with(&self, folder: Option<&Path>, variables: Option<&Variables>) -> Result<Identity, NativeError> {
        let text = serde_json::to_string(&variables).unwrap_or_default();
        // Before the process has its time to load what was unpacked.
        unpack_for_children(self.kind, &path_in(folder, self)).map_err(|error| NativeError::Refused {
            controller: self.text(),
            reason: error.to_string(),
            is_io: error.is_io(),
        })?;
        let settings = self.process(folder, &["probe", &self.text(), &text]);
        let controller = self.text();
        let crash = |error: ExecError| {
            let reason = error.end_of_isolated("the controller").unwrap_or_else(|| error.to_string());
            NativeError::Crash { controller: controller.clone(), reason }
        };
        let mut child = Child::start(&settings, folder).map_err(crash)?;
        let limit = LOAD_TIMEOUT.max(Duration::from_millis(self.timeout_ms));
        let Some(line) = child.request_within(Vec::new(), limit).map_err(crash)? else {
            let reason = format!("it is not loaded within {} s: its constructor may wait or loop", limit.as_secs_f64());
            return Err(NativeError::Crash { controller, reason });
        };
        child.finish_unloading(&self.name()).map_err(crash)?;
        match serde_json::from_slice(&line) {
            Ok(Probe::Identity(identity)) => Ok(identity),
            Ok(Probe::Refused { reason, is_io }) => Err(NativeError::Refused { controller, reason, is_io }),
            Err(error) => Err(NativeError::Crash { controller, reason: error.to_string() }),
        }
    }
}

/// The answer of a process that has tried to load a library or an FMU.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Probe {
    /// The file can be used.
    Identity(Identity),
    /// The file cannot be used.
    Refused {
        /// The reason.
        reason: String,
        /// Whether the file cannot be read.
        is_io: bool,
    },
}

impl Probe {
    /// Loads a library or an FMU in this process, and checks the variables of an FMU, if they are
    /// given.
    pub fn of(kind: Kind, path: &Path, variables: Option<&Variables>) -> Self {
        match Loaded::open(kind, path) {
            Ok(loaded) => match variables.map_or(Ok(()), |variables| loaded.check(variables)) {
                Ok(()) => Self::Identity(loaded.identity()),
                Err(reason) => Self::Refused { reason: format!("{}: {reason}", path.display()), is_io: false },
            },
            Err(error) => Self::Refused { reason: error.to_string(), is_io: error.is_io() },
        }
    }
}

/// A library, an FMU or a process that cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NativeError {
    /// The file is not of the expected kind.
    #[error("failed to use the controller `{controller}`: {reason}")]
    Refused {
        /// The controller.
        controller: String,
        /// What is wrong, and what is expected.
        reason: String,
        /// Whether the file cannot be read.
        is_io: bool,
    },
    /// The process ended while it loaded the file.
    #[error("failed to load the controller `{controller}`: {reason}")]
    Crash {
        /// The controller.
        controller: String,
        /// How the process ended.
        reason: String,
    },
    /// The process cannot be started.
    #[error("failed to use the controller `{controller}`: {reason}")]
    Start {
        /// The controller.
        controller: String,
        /// The reason for which it cannot be started.
        reason: String,
    },
    /// The file of a perception is not of the expected kind.
    #[error("failed to use the perception `{program}`: {reason}")]
    RefusedProgram {
        /// The program, as the scenario names it.
        program: String,
        /// What is wrong, and what is expected.
        reason: String,
        /// Whether the file cannot be read.
        is_io: bool,
    },
    /// A perception program cannot be started.
    #[error("failed to start the perception program `{program}`: {reason}")]
    StartProgram {
        /// The program, as the scenario names it.
        program: String,
        /// Why it cannot be started.
        reason: String,
    },
}

/// Returns the path of the file of a controller.
fn path_in(folder: Option<&Path>, settings: &NativeSettings) -> PathBuf {
    folder.map_or_else(|| PathBuf::from(&settings.path), |folder| folder.join(&settings.path))
}

/// Returns the BLAKE3 hash of a file, or why it cannot be read.
fn file_hash(path: &Path) -> String {
    let hash = || -> std::io::Result<blake3::Hash> {
        let mut hasher = blake3::Hasher::new();
        hasher.update_reader(closecall_traffic::input::open(path)?)?;
        Ok(hasher.finalize())
    };
    hash().map_or_else(|error| error.to_string(), |hash| hash.to_string())
}

/// Creates controllers that are libraries or FMUs.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct NativeFactory {
    settings: NativeSettings,
    folder: Option<PathBuf>,
    name: String,
    /// BLAKE3 hash of the file when the factory was created, or why it could not be read.
    blake3: String,
    /// True in a worker process, which loads the file itself.
    #[serde(skip)]
    is_worker: bool,
}

impl NativeFactory {
    /// Creates a factory. A relative path is in the given folder, or in the folder of this program.
    /// `name` is the name in reports.
    pub fn new(settings: &NativeSettings, folder: Option<&Path>, name: String) -> Self {
        let (settings, folder) = (settings.clone(), folder.map(Path::to_owned));
        let blake3 = file_hash(&path_in(folder.as_deref(), &settings));
        Self { settings, folder, name, blake3, is_worker: false }
    }

    /// Checks that the file is the one from which the factory was created.
    ///
    /// # Errors
    /// The message that names the file.
    pub fn check_unchanged(&self) -> Result<(), String> {
        let path = path_in(self.folder.as_deref(), &self.settings);
        if file_hash(&path) == self.blake3 {
            return Ok(());
        }
        Err(format!(
            "the controller's file {} has changed since the start: run a new campaign, or put the earlier file back and resume \
             this one",
            self.settings.path
        ))
    }

    /// Returns the same factory for a worker process: its controllers are loaded into this process.
    #[must_use]
    pub fn in_this_process(self) -> Self {
        Self { is_worker: true, ..self }
    }

    /// Returns the settings of a process of this program with these arguments, under the limits of
    /// the controller.
    pub fn process(&self, arguments: &[&str]) -> ExecSettings {
        self.settings.process(self.folder.as_deref(), arguments)
    }

    /// Returns the settings.
    pub const fn settings(&self) -> &NativeSettings {
        &self.settings
    }
}

impl ControllerFactory for NativeFactory {
    fn name(&self) -> &str {
        &self.name
    }

    /// The outcome summarises the states that the controller answers if the scenario has a margin
    /// increase system.
    fn has_mis(&self, settings: &EgoSettings) -> bool {
        settings.mis().is_some()
    }

    fn build(&self, settings: &EgoSettings) -> Box<dyn EgoController> {
        self.build_with(settings, &VariableTable::default())
    }

    fn build_with(&self, settings: &EgoSettings, table: &VariableTable) -> Box<dyn EgoController> {
        if !self.is_worker {
            let table = serde_json::to_string(table).unwrap_or_default();
            let process = self.settings.process(self.folder.as_deref(), &["step", &self.settings.text(), &table]);
            let steps = ExecFactory::new(process, self.folder.as_deref()).named(self.name.clone());
            return steps.repeating_time().build(settings);
        }
        let path = path_in(self.folder.as_deref(), &self.settings);
        // Its constructor may loop.
        let call = Call::begin_start(Time::ZERO);
        let loaded = Loaded::open(self.settings.kind, &path);
        drop(call);
        match loaded {
            Ok(loaded) => Box::new(NativeController::new(loaded, settings, table)),
            Err(error) => Box::new(Refused { reason: error.to_string() }),
        }
    }

    fn isolated(&self) -> Option<Isolated> {
        (!self.is_worker).then(|| Isolated::Native(self.clone()))
    }
}

/// A controller that could not be loaded.
struct Refused {
    reason: String,
}

impl EgoController for Refused {
    fn step(&mut self, input: &EgoInput<'_>) -> Result<EgoCommand, ControllerError> {
        Err(ControllerError::Own { reason: self.reason.clone(), time: input.time })
    }
}
