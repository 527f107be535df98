//! Checks that the controllers of a campaign stay the same while it runs. Their files are hashed at
//! the start and at the end, and looked at in between.
//!
//! ```text
//!  the command ─▶ files that it names ─▶ files beside them whose names stand in their text (imports),
//!                                         and programs whose paths stand there (launchers)
//!  its process ─▶ files that it has mapped or opened after its greeting
//! ```
//!
//! Between the hashes, a file counts as unchanged if its time of change, its length and its place
//! on the disk are the same.
//!
//! A line that a process of a controller leaves over after its last sample makes the campaign
//! INVALID, too: another process may have answered for it.
//!
//! The folder of the campaign keeps what has changed. The samples of the changed controller stay in
//! its journal: a campaign that is resumed, or whose parts are merged, is no better for it.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

use closecall_sensors::external::ProgramKind;
use closecall_simulation::controller::ControllerChoice;
use closecall_simulation::controller::exec::{ExecSettings, take_left_over};
use closecall_traffic::atomic::{WriteError, write_file};
use closecall_traffic::input::read_text;

use crate::fingerprint::{Fingerprint, command_settings, named_files};
use crate::folder::{CONTROLLER_CHANGES, Folder, FolderError};
use crate::manifest::{Manifest, file_hash};

/// Shortest time between two looks at the files.
const LOOK_EVERY: Duration = Duration::from_secs(1);
/// Largest number of files that are followed as imports. An assumption: more are no controller but
/// a data set.
const MOST_IMPORTS: usize = 500;
/// Longest text in which names of imports are looked for (bytes). An assumption: 100 times a long
/// script.
const MOST_TEXT_BYTES: u64 = 4 << 20;
/// Largest file that is hashed because a process has it open or mapped (bytes), so that hashing
/// takes less than a second.
const MOST_OPEN_BYTES: u64 = 512 << 20;

/// Extensions of files that a launcher starts. What is executable is one, too. A file of another
/// kind, such as a log, may be written by the controller.
const PROGRAMS: [&str; 14] =
    ["py", "sh", "bash", "js", "mjs", "lua", "rb", "pl", "jl", "m", "jar", "so", "dylib", "dll"];

/// The state of a file that the system tells without a read.
type Look = Option<(SystemTime, u64, u64)>;

/// A file of a controller.
#[derive(Debug)]
struct Watched {
    /// BLAKE3 hash at the start, or why it cannot be read.
    hash: String,
    look: Look,
}

/// The files of the controllers of a running campaign.
#[derive(Debug)]
pub struct ControllerWatch {
    files: BTreeMap<PathBuf, Watched>,
    looked: Instant,
    /// What has changed, in words, also in an earlier part of the campaign.
    changes: BTreeSet<String>,
    /// The folder of the campaign, if it has one.
    folder: Option<Folder>,
}

impl ControllerWatch {
    /// Hashes the files of the controllers of a campaign that begins or is resumed, and reads what
    /// has changed before from its folder. Without a manifest no files are watched.
    ///
    /// # Errors
    /// [`FolderError`] if the changes before cannot be read.
    pub fn start(manifest: Option<&Manifest>, folder: Option<&Folder>) -> Result<Self, FolderError> {
        let files = manifest.map(watched_files).unwrap_or_default();
        let changes = folder.map(kept_changes).transpose()?.unwrap_or_default();
        Ok(Self { files, looked: Instant::now(), changes: changes.into_iter().collect(), folder: folder.cloned() })
    }

    /// Looks at the files, at most once in a second.
    pub fn look(&mut self) {
        if self.looked.elapsed() >= LOOK_EVERY {
            self.looked = Instant::now();
            let before = self.changes.len();
            for (path, watched) in &mut self.files {
                let now = look(path);
                if now != watched.look {
                    watched.look = now;
                    if hash(path) != watched.hash {
                        self.changes.insert(change_of(path));
                    }
                }
            }
            if self.changes.len() > before {
                // What cannot be written now is written, or said, at the end.
                let _ = self.keep();
            }
        }
    }

    /// Adds what else shows that a controller changed, in words.
    pub fn add(&mut self, changes: Vec<String>) {
        self.changes.extend(changes);
    }

    fn keep(&self) -> Result<Vec<String>, WriteError> {
        let changes: Vec<String> = self.changes.iter().cloned().collect();
        self.folder.as_ref().map_or(Ok(()), |folder| keep_changes(folder, &changes))?;
        Ok(changes)
    }

    /// Hashes the files again, and keeps what has changed in the folder. Returns a message for each
    /// file that differs from the start, or differed in between, and for each line that a process
    /// left over.
    ///
    /// # Errors
    /// [`WriteError`] if the folder cannot keep it.
    pub fn finish(mut self) -> Result<Vec<String>, WriteError> {
        let differs = |(path, file): &(&PathBuf, &Watched)| hash(path) != file.hash;
        self.changes.extend(self.files.iter().filter(differs).map(|(path, _)| change_of(path)));
        self.changes.extend(take_left_over());
        self.keep()
    }
}

/// Returns the files of the controllers of a campaign.
fn watched_files(manifest: &Manifest) -> BTreeMap<PathBuf, Watched> {
    let folder = manifest.controller_folder();
    let mut paths: BTreeSet<PathBuf> = BTreeSet::new();
    for arm in &manifest.arms {
        let named: Vec<PathBuf> = match arm {
            ControllerChoice::Exec(exec) => command_files(exec, folder),
            ControllerChoice::Native(native) => vec![in_folder(folder, Path::new(&native.path))],
            ControllerChoice::BuiltIn(_) | ControllerChoice::Tuned(_) | ControllerChoice::Hosted(_) => continue,
        };
        paths.extend(imports(&named, folder));
        paths.extend(named);
    }
    for program in manifest.programs() {
        let named = match program.kind {
            ProgramKind::Exec => command_files(&command_settings(&program), folder),
            ProgramKind::Lib => vec![in_folder(folder, Path::new(program.command))],
            ProgramKind::Hosted => continue,
        };
        paths.extend(imports(&named, folder));
        paths.extend(named);
    }
    let is_small = |path: &&PathBuf| path.metadata().is_ok_and(|file| file.is_file() && file.len() <= MOST_OPEN_BYTES);
    let open = manifest.controllers.iter().flat_map(Fingerprint::open_files);
    paths.extend(open.filter(is_small).cloned());
    let watched = |path: PathBuf| {
        let (hash, look) = (hash(&path), look(&path));
        (path, Watched { hash, look })
    };
    paths.into_iter().map(watched).collect()
}

fn change_of(path: &Path) -> String {
    format!("the controller changed during the campaign: {} is not what it was at the start", path.display())
}

/// Returns what changed of the controllers while the campaign of a folder ran, in words.
///
/// # Errors
/// [`FolderError`] if the file cannot be read.
pub fn kept_changes(folder: &Folder) -> Result<Vec<String>, FolderError> {
    let path = folder.file(CONTROLLER_CHANGES);
    match read_text(&path) {
        Ok(text) => serde_json::from_str(&text).map_err(|error| FolderError::Content {
            line: error.line(),
            message: error.to_string(),
            path,
        }),
        Err(source) if source.kind() == ErrorKind::NotFound => Ok(Vec::new()),
        Err(source) => Err(FolderError::Read { path, source }),
    }
}

/// Writes what changed of the controllers into the folder of a campaign, if anything did.
///
/// # Errors
/// [`WriteError`] if the file cannot be written.
pub fn keep_changes(folder: &Folder, changes: &[String]) -> Result<(), WriteError> {
    if changes.is_empty() {
        return Ok(());
    }
    write_file(&folder.file(CONTROLLER_CHANGES), |out| {
        serde_json::to_writer_pretty(&mut *out, changes)?;
        out.write_all(b"\n")
    })
}

fn in_folder(folder: Option<&Path>, path: &Path) -> PathBuf {
    folder.map_or_else(|| path.to_owned(), |folder| folder.join(path))
}

fn hash(path: &Path) -> String {
    file_hash(path).map_or_else(|error| error.to_string(), |hash| hash.to_string())
}

fn look(path: &Path) -> Look {
    #[cfg(unix)]
    fn place(metadata: &fs::Metadata) -> u64 {
        std::os::unix::fs::MetadataExt::ino(metadata)
    }
    #[cfg(not(unix))]
    fn place(_: &fs::Metadata) -> u64 {
        0
    }
    let metadata = path.metadata().ok()?;
    Some((metadata.modified().ok()?, metadata.len(), place(&metadata)))
}

/// Returns the files that a command names, also within a word, as in `sh -c "python3 a.py"`.
fn command_files(exec: &ExecSettings, folder: Option<&Path>) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = named_files(exec, folder).into_iter().map(|(_, path)| path).collect();
    let words = exec.words().unwrap_or_default();
    let beside = in_folder(folder, Path::new("."));
    for file in
        words.iter().filter(|word| word.contains(char::is_whitespace)).flat_map(|word| programs(word, &[&beside]))
    {
        if !files.contains(&file) {
            files.push(file);
        }
    }
    files
}

/// Returns the programs whose paths stand in a text. A path is relative to one of the folders. What
/// stands before a path, such as the value of a variable, is taken for one of them.
fn programs(text: &str, folders: &[&Path]) -> BTreeSet<PathBuf> {
    let is_separator = |c: char| c.is_whitespace() || "\"'`=;,:()[]{}<>|&$".contains(c);
    let is_program = |path: &PathBuf| {
        let is_script = path
            .extension()
            .and_then(|extension| extension.to_str())
            .is_some_and(|extension| PROGRAMS.contains(&extension));
        path.metadata().is_ok_and(|file| file.is_file() && (is_script || is_executable(&file)))
    };
    let words = text.split(is_separator).filter(|word| word.contains(['.', '/']));
    let absolute = words.clone().filter(|word| word.starts_with('/')).map(PathBuf::from);
    let relative = words.flat_map(|word| folders.iter().map(|folder| folder.join(word.trim_start_matches('/'))));
    absolute.chain(relative).filter(is_program).take(MOST_IMPORTS).collect()
}

#[cfg(unix)]
fn is_executable(file: &fs::Metadata) -> bool {
    std::os::unix::fs::PermissionsExt::mode(&file.permissions()) & 0o111 != 0
}

#[cfg(not(unix))]
const fn is_executable(_: &fs::Metadata) -> bool {
    false
}

/// Returns the files that a text among the named files seems to load. They lie beside it, or in
/// folders beside it. The text holds their names as words, and they have its extension. What is
/// started by its path, relative to the text or to the working folder, is one of them.
fn imports(named: &[PathBuf], working_folder: Option<&Path>) -> BTreeSet<PathBuf> {
    let mut import_files = BTreeSet::new();
    let mut left: Vec<PathBuf> = named.to_vec();
    while let Some(path) = left.pop() {
        let Some(folder) = path.parent() else { continue };
        let Some(text) = text_of(&path) else { continue };
        let words: BTreeSet<&str> = text.split(|c: char| !(c.is_alphanumeric() || c == '_' || c == '-')).collect();
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        for file in programs(&text, &[folder, &in_folder(working_folder, Path::new("."))]) {
            if !named.contains(&file) && import_files.len() < MOST_IMPORTS && import_files.insert(file.clone()) {
                left.push(file);
            }
        }
        let Some(extension) = path.extension() else { continue };
        let Ok(entries) = fs::read_dir(folder) else { continue };
        for entry in entries.flatten().map(|entry| entry.path()) {
            let is_meant = entry.file_stem().and_then(|stem| stem.to_str()).is_some_and(|stem| words.contains(stem));
            let loaded = match is_meant {
                true if entry.is_dir() => {
                    fs::read_dir(&entry).into_iter().flatten().flatten().map(|file| file.path()).collect()
                }
                true => vec![entry],
                false => continue,
            };
            for file in loaded {
                if file.extension() == Some(extension)
                    && file.is_file()
                    && !named.contains(&file)
                    && import_files.len() < MOST_IMPORTS
                    && import_files.insert(file.clone())
                {
                    left.push(file);
                }
            }
        }
    }
    import_files
}

/// Returns the content of a file if it is a text.
fn text_of(path: &Path) -> Option<String> {
    let metadata = path.metadata().ok()?;
    if !metadata.is_file() || metadata.len() > MOST_TEXT_BYTES {
        return None;
    }
    fs::read_to_string(path).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn imports_of_imports_are_followed_and_other_files_are_not() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir_all(at("package/below")).unwrap();
        for (name, text) in [
            ("a.py", "import b\nfrom package.c import d\n"),
            ("b.py", "import e"),
            ("e.py", ""),
            ("package/c.py", ""),
            ("package/c.txt", ""),
            ("unused.py", ""),
            ("b.json", ""),
        ] {
            fs::write(at(name), text).unwrap();
        }
        let expected: BTreeSet<PathBuf> = ["b.py", "e.py", "package/c.py"].map(at).into();
        assert_eq!(imports(&[at("a.py")], None), expected);
        assert!(imports(&[at("b.json"), at("none.py")], None).is_empty());
    }

    #[test]
    fn what_a_launcher_starts_is_followed_and_what_it_writes_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir_all(at("lib")).unwrap();
        for (name, text) in [
            ("run", "#!/bin/sh\ncd \"$(dirname \"$0\")\"; exec python3 \"${HERE}/lib/main.py\" >run.log\n"),
            ("lib/main.py", "import helper"),
            ("lib/helper.py", ""),
            ("run.log", ""),
            ("other.py", ""),
        ] {
            fs::write(at(name), text).unwrap();
        }
        let expected: BTreeSet<PathBuf> = ["lib/main.py", "lib/helper.py"].map(at).into();
        assert_eq!(imports(&[at("run")], None), expected);
        let command = "sh -c 'cd /; exec python3 lib/main.py'".to_owned();
        let settings = ExecSettings { command, timeout_ms: 1, memory_mib: 1 };
        assert!(command_files(&settings, Some(folder.path())).contains(&folder.path().join("./lib/main.py")));
    }
}
