//! The choice of a controller on a command line or in a manifest.

use std::ffi::OsStr;
use std::fmt;
use std::path::Path;
use std::str::FromStr;
use std::sync::Arc;

use closecall_controllers::external::Kind;
use closecall_scenarios::Function;
use closecall_traffic::suggest::hint;
use serde::{Deserialize, Serialize};

use super::exec::{Child, DEFAULT_MEMORY_MIB, DEFAULT_TIMEOUT_MS, ExecFactory, ExecSettings, NAME as EXEC};
use super::hosted::{self, HostedController, PREFIX as HOSTED};
use super::native::{NativeError, NativeFactory, NativeSettings};
use super::{BuiltIn, Functions, TimeGap, Tuned, TunedError};
use crate::run::ControllerFactory;

/// A controller, as a campaign's manifest stores it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(into = "Stored", try_from = "Stored")]
pub enum ControllerChoice {
    /// A controller of this program.
    BuiltIn(BuiltIn),
    /// A built-in controller with its own settings.
    Tuned(Tuned),
    /// A separate process for each sample.
    Exec(ExecSettings),
    /// A shared library or an FMU, in a separate process.
    Native(NativeSettings),
    /// A controller of the program that has Closecall as a library.
    Hosted(HostedController),
}

/// The names and forms of the controllers, as messages list them.
const KNOWN: &str = "`acc`, `mis`, `mis-ttce`, `mis-extended`, `acc-aeb`, `acc+aeb`, `cruise+aeb`, `human-aeb`, `human+aeb`, `blind`, `crawl`, `gap-SECONDS`, `r157-gap`, `r157-driver`, `r157-fsm`, `lib:PATH`, `fmu:PATH` or `exec:COMMAND`";
/// The words that are suggested for a misspelt one.
const WORDS: &str = "`acc`, `mis`, `mis-ttce`, `mis-extended`, `acc-aeb`, `acc+aeb`, `cruise`, `cruise+aeb`, `human`, `human-aeb`, `human+aeb`, `blind`, `crawl`, `gap-1.2`, `gap-1.6`, `gap-2.0`, `r157-gap`, `r157-driver`, `r157-fsm`, `exec`, `lib`, `fmu`";
/// The beginning of the name of a controller with another constant time gap.
const GAP: &str = "gap-";

impl ControllerChoice {
    /// The scenario's ego stack without its margin increase system.
    pub const ACC: Self = Self::BuiltIn(BuiltIn::Acc);
    /// The scenario's complete ego stack.
    pub const MIS: Self = Self::BuiltIn(BuiltIn::Mis);

    /// Returns the name in reports, if the campaign has no other controller of this name: see
    /// [`Self::names`].
    pub fn name(&self) -> String {
        match self {
            Self::BuiltIn(built_in) => built_in.to_string(),
            Self::Tuned(tuned) => tuned.to_string(),
            Self::Exec(_) => EXEC.to_owned(),
            Self::Native(native) => native.name(),
            Self::Hosted(hosted) => hosted.name(),
        }
    }

    /// Returns the names of the arms of a campaign. Arms that would have the same name, such as
    /// several processes, are numbered.
    pub fn names(arms: &[Self]) -> Vec<String> {
        let names: Vec<String> = arms.iter().map(Self::name).collect();
        let count = |names: &[String], name: &str| names.iter().filter(|other| *other == name).count();
        let numbered = |(index, name): (usize, &String)| match count(&names, name) {
            1 => name.clone(),
            _ => format!("{name}-{}", count(&names[..=index], name)),
        };
        names.iter().enumerate().map(numbered).collect()
    }

    /// Returns the baseline of a scenario that judges this function, and the controller under test.
    pub const fn of_function(function: Function) -> [Self; 2] {
        match function {
            Function::Mis => [Self::ACC, Self::MIS],
            Function::Aeb => {
                let [without, with] = [Functions::ACC_ALONE, Functions::ACC_AND_AEB];
                [Self::BuiltIn(BuiltIn::Stack(without)), Self::BuiltIn(BuiltIn::Stack(with))]
            }
            Function::AebWithHuman => {
                let [without, with] = [Functions::HUMAN_ALONE, Functions::HUMAN_AND_AEB];
                [Self::BuiltIn(BuiltIn::Stack(without)), Self::BuiltIn(BuiltIn::Stack(with))]
            }
            Function::Acc => {
                let [without, with] = [Functions::CRUISE_AND_AEB, Functions::ACC_AND_AEB];
                [Self::BuiltIn(BuiltIn::Stack(without)), Self::BuiltIn(BuiltIn::Stack(with))]
            }
        }
    }

    /// Returns the built-in controller, with settings of its own or without; `None` if this is a
    /// process.
    pub const fn built_in(&self) -> Option<BuiltIn> {
        match self {
            Self::BuiltIn(built_in) => Some(*built_in),
            Self::Tuned(tuned) => Some(tuned.base),
            _ => None,
        }
    }

    /// Returns the same controller with a setting of its own.
    ///
    /// # Errors
    /// [`TunedError`] if it is not built in, or has no such setting.
    pub fn with_setting(&self, setting: &str) -> Result<Self, TunedError> {
        match self {
            Self::BuiltIn(built_in) => Ok(Self::Tuned(Tuned::new(*built_in).with(setting)?)),
            Self::Tuned(tuned) => Ok(Self::Tuned(tuned.clone().with(setting)?)),
            other => Err(TunedError {
                setting: setting.to_owned(),
                problem: format!("`{other}` is not built in, and reads its settings itself"),
            }),
        }
    }

    /// Returns the settings of the process, or `None` if this is a built-in controller.
    pub const fn exec(&self) -> Option<&ExecSettings> {
        if let Self::Exec(settings) = self { Some(settings) } else { None }
    }

    /// Returns the library or FMU, or `None` if this is none.
    pub const fn native(&self) -> Option<&NativeSettings> {
        if let Self::Native(settings) = self { Some(settings) } else { None }
    }

    /// Returns the same controller with other limits, if it has any: the time limit of each answer
    /// (ms), and the memory of the process (MiB). `None` leaves a limit as it is.
    #[must_use]
    pub fn limited(&self, timeout_ms: Option<u64>, memory_mib: Option<u64>) -> Self {
        let mut limited = self.clone();
        let limits = match &mut limited {
            Self::Exec(exec) => (&mut exec.timeout_ms, &mut exec.memory_mib),
            Self::Native(native) => (&mut native.timeout_ms, &mut native.memory_mib),
            Self::BuiltIn(_) | Self::Tuned(_) | Self::Hosted(_) => return limited,
        };
        *limits.0 = timeout_ms.unwrap_or(*limits.0);
        *limits.1 = memory_mib.unwrap_or(*limits.1);
        limited
    }

    /// Returns true if the controller runs in a process that has limits.
    pub fn has_limits(&self) -> bool {
        match self {
            Self::BuiltIn(_) | Self::Tuned(_) => false,
            Self::Exec(_) | Self::Native(_) => true,
            Self::Hosted(hosted) => hosted.has_processes(),
        }
    }

    /// Tries whether the program of a process can be started, and whether a library or an FMU can
    /// be loaded. A relative path is in `folder`, or in the folder of this program.
    ///
    /// # Errors
    /// [`NativeError`] if not.
    pub fn try_in(&self, folder: Option<&Path>) -> Result<(), NativeError> {
        match self {
            Self::Exec(exec) => Child::try_start(exec, folder)
                .map_err(|error| NativeError::Start { controller: self.to_string(), reason: error.to_string() }),
            Self::Native(native) => native.probe(folder).map(drop),
            Self::BuiltIn(_) | Self::Tuned(_) | Self::Hosted(_) => Ok(()),
        }
    }

    /// Returns a factory of this controller.
    pub fn factory(&self) -> Arc<dyn ControllerFactory> {
        self.factory_in(None, self.name())
    }

    /// Returns a factory of this controller. A process runs in the given folder, or in the folder
    /// of this program. All but a built-in controller have the given name in reports.
    pub fn factory_in(&self, folder: Option<&Path>, name: String) -> Arc<dyn ControllerFactory> {
        match self {
            Self::BuiltIn(built_in) => built_in.factory(),
            Self::Tuned(tuned) => tuned.factory(),
            Self::Exec(settings) => Arc::new(ExecFactory::new(settings.clone(), folder).named(name)),
            Self::Native(native) => Arc::new(NativeFactory::new(native, folder, name)),
            Self::Hosted(hosted) => hosted.factory(name),
        }
    }

    /// Returns a factory for each arm, under the names of [`Self::names`].
    pub fn factories(arms: &[Self], folder: Option<&Path>) -> Vec<Arc<dyn ControllerFactory>> {
        arms.iter().zip(Self::names(arms)).map(|(arm, name)| arm.factory_in(folder, name)).collect()
    }
}

impl From<BuiltIn> for ControllerChoice {
    fn from(built_in: BuiltIn) -> Self {
        Self::BuiltIn(built_in)
    }
}

/// Writes the controller as it is given to `--controller`.
impl fmt::Display for ControllerChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::BuiltIn(built_in) => built_in.fmt(f),
            Self::Tuned(tuned) => tuned.fmt(f),
            Self::Exec(settings) => write!(f, "{EXEC}:{}", settings.command),
            Self::Native(native) => f.write_str(&native.text()),
            Self::Hosted(hosted) => hosted.fmt(f),
        }
    }
}

/// A text that names no controller.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum UnknownController {
    /// There is no controller of this name.
    #[error("`{text}` is not a controller: expected {KNOWN}{hint}")]
    Name {
        /// The text.
        text: String,
        /// A suggestion, if some name is similar.
        hint: String,
    },
    /// The time gap of a `gap-SECONDS` is none.
    #[error(
        "`{text}` is not a controller: its time gap must be {}, as in `gap-1.2`, `gap-1.6` or `gap-2.0`",
        TimeGap::ALLOWED
    )]
    Gap {
        /// The text.
        text: String,
    },
    /// A list of functions is none.
    #[error("`{text}` is not a controller: a list of functions has {}", Functions::ALLOWED)]
    Functions {
        /// The text.
        text: String,
    },
    /// A controller has a setting that it cannot have.
    #[error("`{text}` is not a controller: {source}")]
    Setting {
        /// The text.
        text: String,
        /// The reason.
        source: TunedError,
    },
    /// There is no controller of this name in the program that has Closecall as a library.
    #[error(
        "`{text}` is a controller of a Python program, and can be run from there only: {}",
        hosted::registered_names()
    )]
    Hosted {
        /// The text.
        text: String,
    },
    /// A `lib:PATH` or `fmu:PATH` names no file.
    #[error(
        "`{text}` names no file: a path follows the colon, as in `lib:./my_controller.so` or `fmu:./my_controller.fmu`"
    )]
    Path {
        /// The text.
        text: String,
    },
    /// The command of an `exec:COMMAND` cannot be split into words.
    #[error("`{command}` is not a command: it is empty, or its quotes do not match")]
    Command {
        /// The command.
        command: String,
    },
}

/// Reads a controller as it is given to `--controller`. A process has the default limits.
impl FromStr for ControllerChoice {
    type Err = UnknownController;

    fn from_str(text: &str) -> Result<Self, UnknownController> {
        if let Some((EXEC, command)) = text.split_once(':') {
            let (timeout_ms, memory_mib) = (DEFAULT_TIMEOUT_MS, DEFAULT_MEMORY_MIB);
            let exec = ExecSettings { command: command.to_owned(), timeout_ms, memory_mib };
            let is_command = exec.words().is_some();
            return is_command
                .then_some(Self::Exec(exec))
                .ok_or_else(|| UnknownController::Command { command: command.to_owned() });
        }
        if let Some((word, path)) = text.split_once(':')
            && let Some(kind) = Kind::ALL.into_iter().find(|kind| kind.prefix() == word)
        {
            let native = (!path.is_empty()).then(|| Self::Native(NativeSettings::new(kind, path)));
            return native.ok_or_else(|| UnknownController::Path { text: text.to_owned() });
        }
        if let Some((HOSTED, _)) = text.split_once(':') {
            let hosted = HostedController::new(text);
            let choice = hosted.is_registered().then_some(Self::Hosted(hosted));
            return choice.ok_or_else(|| UnknownController::Hosted { text: text.to_owned() });
        }
        if let Some((controller, settings)) = text.split_once(':')
            && let Ok(Self::BuiltIn(base)) = controller.parse()
        {
            let fail = |source| UnknownController::Setting { text: text.to_owned(), source };
            return Ok(Self::Tuned(Tuned::parse(base, settings).map_err(fail)?));
        }
        if Functions::is_meant(text) {
            let choice = Functions::parse(text).map(|functions| BuiltIn::Stack(functions).into());
            return choice.ok_or_else(|| UnknownController::Functions { text: text.to_owned() });
        }
        if let Some(choice) = BuiltIn::FIXED.into_iter().find(|built_in| built_in.to_string() == text) {
            return Ok(choice.into());
        }
        match text.strip_prefix(GAP) {
            Some(seconds) => seconds
                .parse()
                .map(|gap| BuiltIn::Gap(gap).into())
                .map_err(|()| UnknownController::Gap { text: text.to_owned() }),
            None => {
                let word = text.split(':').next().unwrap_or_default();
                let hint = without_prefix(text).unwrap_or_else(|| hint(word, WORDS));
                Err(UnknownController::Name { text: text.to_owned(), hint })
            }
        }
    }
}

/// Returns the suggestion for a file or a command without the prefix that says what it is.
fn without_prefix(text: &str) -> Option<String> {
    if text.contains(':') {
        return None;
    }
    let is_command = text.split_whitespace().nth(1).is_some();
    let prefix = match Path::new(text).extension().and_then(OsStr::to_str) {
        _ if is_command => "exec:",
        Some("so" | "dylib" | "dll") => "lib:",
        Some("fmu") => "fmu:",
        Some("py") => "exec:python3 ",
        _ if text.contains('/') => "exec:",
        _ => return None,
    };
    Some(format!("; did you mean `{prefix}{text}`?"))
}

/// The form in a manifest: the name of a built-in or hosted controller, or the settings of a
/// process, a library or an FMU.
#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum Stored {
    BuiltIn(String),
    Process(StoredProcess),
}

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum StoredProcess {
    Exec(ExecSettings),
    Native(NativeSettings),
}

impl From<ControllerChoice> for Stored {
    fn from(choice: ControllerChoice) -> Self {
        match choice {
            ControllerChoice::Exec(exec) => Self::Process(StoredProcess::Exec(exec)),
            ControllerChoice::Native(native) => Self::Process(StoredProcess::Native(native)),
            ControllerChoice::BuiltIn(built_in) => Self::BuiltIn(built_in.to_string()),
            ControllerChoice::Tuned(tuned) => Self::BuiltIn(tuned.to_string()),
            ControllerChoice::Hosted(hosted) => Self::BuiltIn(hosted.to_string()),
        }
    }
}

impl TryFrom<Stored> for ControllerChoice {
    type Error = UnknownController;

    fn try_from(stored: Stored) -> Result<Self, UnknownController> {
        match stored {
            // A folder can be read without the program that its controller belongs to.
            Stored::BuiltIn(name) if name.split(':').next() == Some(HOSTED) => {
                Ok(Self::Hosted(HostedController::new(&name)))
            }
            Stored::BuiltIn(name) => name.parse(),
            Stored::Process(StoredProcess::Exec(exec)) => Ok(Self::Exec(exec)),
            Stored::Process(StoredProcess::Native(native)) => Ok(Self::Native(native)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn exec(command: &str) -> ControllerChoice {
        ControllerChoice::Exec(ExecSettings { command: command.to_owned(), timeout_ms: 250, memory_mib: 64 })
    }

    #[test]
    fn a_choice_survives_the_round_trip_through_a_manifest_and_a_command_line() {
        for name in [
            "acc",
            "mis",
            "mis-extended",
            "blind",
            "crawl",
            "gap-0.8",
            "gap-1.6",
            "gap-2.5",
            "r157-gap",
            "r157-driver",
            "r157-fsm",
            "acc-aeb",
            "acc+aeb",
            "acc+aeb+mis",
            "cruise+aeb",
            "human",
            "human-aeb",
            "human+aeb",
        ] {
            let choice: ControllerChoice = name.parse().unwrap();
            assert_eq!((choice.to_string(), choice.name()), (name.to_owned(), name.to_owned()));
            assert_eq!(choice.built_in().map(ControllerChoice::from), Some(choice.clone()));
            let text = serde_json::to_string(&choice).unwrap();
            assert_eq!(text, format!("\"{name}\""));
            assert_eq!(serde_json::from_str::<ControllerChoice>(&text).unwrap(), choice);
        }
        for text in ["acc:aeb.trigger-mps2=5", "acc+aeb:aeb.trigger-mps2=5:acc.time-gap-s=1.5"] {
            let choice: ControllerChoice = text.parse().unwrap();
            assert_eq!((choice.to_string(), choice.name()), (text.to_owned(), text.to_owned()));
            let stored = serde_json::to_string(&choice).unwrap();
            assert_eq!(serde_json::from_str::<ControllerChoice>(&stored).unwrap(), choice, "{stored}");
        }
        for text in ["lib:./a.so", "fmu:/b/c.fmu"] {
            let choice = text.parse::<ControllerChoice>().unwrap().limited(Some(250), None);
            assert_eq!(choice.to_string(), text);
            let stored = serde_json::to_string(&choice).unwrap();
            assert_eq!(serde_json::from_str::<ControllerChoice>(&stored).unwrap(), choice, "{stored}");
        }
        assert_eq!("lib:./a.so".parse::<ControllerChoice>().unwrap().name(), "lib:a");
        let process = exec("python3 'a b.py'");
        let text = serde_json::to_string(&process).unwrap();
        assert!(text.starts_with("{\"exec\":{\"command\":"), "{text}");
        assert_eq!(serde_json::from_str::<ControllerChoice>(&text).unwrap(), process);
        assert!(serde_json::from_str::<ControllerChoice>("\"gap-9\"").is_err());
    }

    #[test]
    fn what_is_no_controller_is_refused_with_what_is_allowed() {
        let refusal = |text: &str| text.parse::<ControllerChoice>().unwrap_err().to_string();
        assert!(refusal("miss").ends_with("; did you mean `mis`?"), "{}", refusal("miss"));
        assert!(refusal("exce:python3 a.py").ends_with("; did you mean `exec`?"));
        for (text, meant) in [
            ("./a.so", "lib:./a.so"),
            ("a.fmu", "fmu:a.fmu"),
            ("a.py", "exec:python3 a.py"),
            ("python3 a.py", "exec:python3 a.py"),
            ("./a", "exec:./a"),
        ] {
            assert!(refusal(text).ends_with(&format!("; did you mean `{meant}`?")), "{}", refusal(text));
            meant.parse::<ControllerChoice>().unwrap();
        }
        assert!(!refusal("a").contains("did you mean `exec"), "{}", refusal("a"));
        assert!(refusal("r157-drivr").ends_with("; did you mean `r157-driver`?"));
        assert!(refusal("gap-3.0").contains("0.8 to 2.5 s in steps of 0.1 s"));
        assert!(refusal("acc+abs").contains("`acc+aeb`"), "{}", refusal("acc+abs"));
        assert!(refusal("acc:aeb.trigger-mps2=50").contains("cannot be set in an arm"));
        assert!(refusal("exec:").contains("it is empty"));
        assert!(refusal("lib:").contains("names no file"));
    }

    #[test]
    fn several_processes_are_numbered() {
        let arms = [ControllerChoice::ACC, exec("a"), ControllerChoice::MIS, exec("b")];
        assert_eq!(ControllerChoice::names(&arms), ["acc", "exec-1", "mis", "exec-2"]);
        assert_eq!(ControllerChoice::names(&arms[..3]), ["acc", "exec", "mis"]);
    }
}
