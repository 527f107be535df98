//! The identity of a controller that runs as a process: the files that its command names, and its
//! own statements. A campaign keeps the identity, and a changed controller is noticed when the
//! campaign is resumed or replayed.
//!
//! Files that the command does not name, such as the modules that a script imports, are not
//! covered. A controller that has such files states a `version` in its first answer, or names them
//! in its command.

use std::path::{Path, PathBuf};

use closecall_controllers::CheckedDriver;
use closecall_scenarios::Scenario;
use closecall_sensors::external::{ProgramKind, ProgramSettings};
use closecall_simulation::controller::ControllerChoice;
use closecall_simulation::controller::exec::{ExecSettings, Identity, identify};
use closecall_simulation::controller::native::NativeSettings;
use closecall_simulation::perception::identify_program;
use serde::{Deserialize, Serialize};

use super::manifest::file_hash;

/// Number of digits of a hash that a message quotes.
const QUOTED_DIGITS: usize = 12;

/// A file that a command names.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FileHash {
    /// The path, as the command names it.
    pub name: String,
    /// BLAKE3 hash of its content.
    pub blake3: String,
}

/// The beginning of the command of a perception program, which tells it from a controller with the
/// same command.
const PERCEPTION: &str = "sensors.perception=";

/// What identifies a controller or a perception program that runs as a process.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fingerprint {
    /// The command.
    pub command: String,
    /// The files that the command names, in its order. The program is among them if it is found.
    pub files: Vec<FileHash>,
    /// The statements of the process in its first answer.
    pub identity: Identity,
    /// The files that the process has mapped or opened after its greeting. They differ from machine
    /// to machine.
    #[serde(skip)]
    open_files: Vec<PathBuf>,
}

impl Fingerprint {
    /// Returns the fingerprint of a controller that runs in the given folder, or in the folder of
    /// this program. The process is started once and greeted with the values of `scenario`. A
    /// process that cannot be greeted has no identity.
    pub fn of(settings: &ExecSettings, folder: Option<&Path>, scenario: Option<&Scenario>) -> Self {
        let greeted = scenario.and_then(|scenario| match &scenario.actors[scenario.ego].driver {
            CheckedDriver::Ego(ego) => {
                let lane = scenario.road.lane_of(&scenario.actors[scenario.ego].start);
                identify(settings, folder, ego, (&scenario.road, lane)).ok()
            }
            CheckedDriver::Human(_) => None,
        });
        let (identity, open_files) = greeted.unwrap_or_default();
        Self { command: settings.command.clone(), files: hashes(named_files(settings, folder)), identity, open_files }
    }

    /// Returns the files that the process has mapped or opened after its greeting.
    pub(crate) fn open_files(&self) -> &[PathBuf] {
        &self.open_files
    }

    /// Returns the fingerprint of a controller that runs in a process; `None` for all others.
    pub fn of_choice(choice: &ControllerChoice, folder: Option<&Path>, scenario: Option<&Scenario>) -> Option<Self> {
        match choice {
            ControllerChoice::Exec(exec) => Some(Self::of(exec, folder, scenario)),
            ControllerChoice::Native(native) => Some(Self::of_native(native, folder)),
            ControllerChoice::BuiltIn(_) | ControllerChoice::Tuned(_) | ControllerChoice::Hosted(_) => None,
        }
    }

    /// Returns the fingerprint of a perception program. It is started once and greeted as in a run
    /// of `scenario`. One that cannot be greeted has no identity.
    pub fn of_program(program: &ProgramSettings, scenario: Option<&Scenario>) -> Self {
        let stated = scenario.and_then(|scenario| identify_program(program, scenario)).unwrap_or_default();
        let (identity, open_files) = stated;
        Self {
            command: format!("{PERCEPTION}{}", program.name()),
            files: hashes(program_files(program, program.folder.map(Path::new))),
            identity,
            open_files,
        }
    }

    /// Returns the fingerprint of a library or an FMU. One that cannot be loaded has no identity.
    fn of_native(settings: &NativeSettings, folder: Option<&Path>) -> Self {
        let path = folder.map_or_else(|| PathBuf::from(&settings.path), |folder| folder.join(&settings.path));
        let blake3 = file_hash(&path).map_or_else(|error| error.to_string(), |hash| hash.to_string());
        Self {
            command: settings.text(),
            files: vec![FileHash { name: settings.path.clone(), blake3 }],
            identity: settings.probe(folder).unwrap_or_default(),
            open_files: Vec::new(),
        }
    }

    /// Returns one message for each difference. `self` is the fingerprint of the earlier
    /// controller.
    pub fn differences(&self, now: &Self) -> Vec<String> {
        let hash_in = |files: &[FileHash], name: &str| {
            files.iter().find(|file| file.name == name).map(|file| file.blake3.clone())
        };
        let who = if self.command.starts_with(PERCEPTION) { "perception program" } else { "controller" };
        let names = self.files.iter().chain(now.files.iter().filter(|file| hash_in(&self.files, &file.name).is_none()));
        let mut differences = Vec::new();
        for FileHash { name, .. } in names {
            let (there, here) = (hash_in(&self.files, name), hash_in(&now.files, name));
            if there != here {
                let quoted = |hash: Option<String>| match hash {
                    Some(hash) => format!("BLAKE3 {}…", hash.chars().take(QUOTED_DIGITS).collect::<String>()),
                    None => "absent".to_owned(),
                };
                let (there, here) = (quoted(there), quoted(here));
                differences.push(format!("the {who}'s file {name} has changed: {there} there, {here} here"));
            }
        }
        let stated = [
            ("name", &self.identity.name, &now.identity.name),
            ("version", &self.identity.version, &now.identity.version),
        ];
        for (key, there, here) in stated.into_iter().filter(|(_, there, here)| there != here) {
            let quoted = |text: &Option<String>| text.as_ref().map_or("none".to_owned(), |text| format!("`{text}`"));
            differences.push(format!("the {who} states another {key}: {} there, {} here", quoted(there), quoted(here)));
        }
        differences
    }
}

/// Returns one message for each difference between controllers with the same command.
pub(crate) fn differences(there: &[Fingerprint], here: &[Fingerprint]) -> Vec<String> {
    let same = |earlier: &Fingerprint| here.iter().find(|other| other.command == earlier.command);
    there.iter().filter_map(|earlier| Some(earlier.differences(same(earlier)?))).flatten().collect()
}

/// Returns the hashes of files, each given as it is named and with its path.
fn hashes(files: Vec<(String, PathBuf)>) -> Vec<FileHash> {
    let hash = |(name, path): (String, PathBuf)| {
        // A file that cannot be read has no hash: it differs from one that can.
        let blake3 = file_hash(&path).map_or_else(|error| error.to_string(), |hash| hash.to_string());
        FileHash { name, blake3 }
    };
    files.into_iter().map(hash).collect()
}

/// Returns the files that a perception program names, each as it is named and with its path: the
/// files of its command, or its library.
pub fn program_files(program: &ProgramSettings, folder: Option<&Path>) -> Vec<(String, PathBuf)> {
    match program.kind {
        ProgramKind::Exec => named_files(&command_settings(program), folder),
        ProgramKind::Lib => {
            let path = folder.map_or_else(|| PathBuf::from(program.command), |folder| folder.join(program.command));
            vec![(program.command.to_owned(), path)]
        }
        // Its version stands in its name.
        ProgramKind::Hosted => Vec::new(),
    }
}

/// Returns the settings of the process of a perception program that is a command.
pub(crate) fn command_settings(program: &ProgramSettings) -> ExecSettings {
    let ProgramSettings { command, timeout_ms, memory_mib, .. } = *program;
    ExecSettings { command: command.to_owned(), timeout_ms, memory_mib }
}

/// Returns the existing files that the command names, each as it is named and with its path: whole
/// words, what follows `=` in a word, and what Python starts of a folder (`python3 DIR`) or a
/// module (`python3 -m NAME`). The program is looked for in `PATH` if it is named without a folder.
pub fn named_files(settings: &ExecSettings, folder: Option<&Path>) -> Vec<(String, PathBuf)> {
    let words = settings.words().unwrap_or_default();
    let mut files: Vec<(String, PathBuf)> = Vec::new();
    for (index, word) in words.iter().enumerate() {
        let value = word.split_once('=').map(|(_, value)| value.to_owned());
        let is_module = index > 0 && words[index - 1] == "-m";
        let started = if is_module { word.replace('.', "/") } else { word.clone() };
        let of_python = [is_module.then(|| format!("{started}.py")), Some(format!("{started}/{MAIN}"))];
        for name in [Some(word.clone()), value].into_iter().chain(of_python).flatten().filter(|name| !name.is_empty()) {
            let in_folder = || folder.map_or_else(|| PathBuf::from(&name), |folder| folder.join(&name));
            let path = if index == 0 && !name.contains('/') { in_search_path(&name) } else { Some(in_folder()) };
            if let Some(path) = path.filter(|path| path.is_file())
                && !files.iter().any(|(file, _)| *file == name)
            {
                files.push((name, path));
            }
        }
    }
    files
}

/// The file that Python starts of a folder or a package.
const MAIN: &str = "__main__.py";

/// Returns the program of that name in the folders of `PATH`.
fn in_search_path(name: &str) -> Option<PathBuf> {
    let folders = std::env::var_os("PATH")?;
    std::env::split_paths(&folders).map(|folder| folder.join(name)).find(|path| path.is_file())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(command: &str) -> ExecSettings {
        ExecSettings { command: command.to_owned(), timeout_ms: 1, memory_mib: 1 }
    }

    #[test]
    fn files_are_whole_words_and_values_of_options() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.py", "b.json"] {
            std::fs::write(folder.path().join(name), name).unwrap();
        }
        let names = |command: &str| {
            let files = named_files(&settings(command), Some(folder.path()));
            files.into_iter().map(|(name, _)| name).collect::<Vec<String>>()
        };
        assert_eq!(names("sh a.py --config=b.json c.txt a.py ."), ["sh", "a.py", "b.json"]);
        std::fs::create_dir_all(folder.path().join("package/within")).unwrap();
        for name in ["package/__main__.py", "package/within/c.py"] {
            std::fs::write(folder.path().join(name), name).unwrap();
        }
        // What Python starts: a folder, a module, a package, and a module of a package.
        assert_eq!(names("sh package"), ["sh", "package/__main__.py"]);
        assert_eq!(names("sh -u -m a"), ["sh", "a.py"]);
        assert_eq!(names("sh -m package"), ["sh", "package/__main__.py"]);
        assert_eq!(names("sh -m package.within.c"), ["sh", "package/within/c.py"]);
    }

    #[test]
    fn a_changed_file_and_a_changed_version_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let script = folder.path().join("a.py");
        std::fs::write(&script, "1").unwrap();
        let fingerprint = || Fingerprint::of(&settings("sh a.py"), Some(folder.path()), None);
        let before = fingerprint();
        assert_eq!(before.differences(&fingerprint()), Vec::<String>::new());
        std::fs::write(&script, "2").unwrap();
        let mut now = fingerprint();
        now.identity.version = Some("2".to_owned());
        let differences = before.differences(&now);
        assert!(differences[0].starts_with("the controller's file a.py has changed: BLAKE3 "), "{differences:?}");
        assert_eq!(differences[1], "the controller states another version: none there, `2` here");
        assert_eq!(differences.len(), 2);
    }
}
