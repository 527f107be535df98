//! The folder in which a campaign keeps its results if its command line names none.
//!
//! ```text
//!  closecall-results            the last campaign of this working folder
//!  closecall-results.previous   the last finished one before it
//! ```
//!
//! A new campaign takes the place of the last one, whose folder becomes the previous one. If the
//! last campaign is unfinished and the previous one is finished, the previous one stays, and the
//! unfinished one is removed. A folder is moved or removed only if its manifest says that a
//! campaign has made it here on its own account, and if it holds only files of a campaign.
//! Everything else at one of the two paths is refused and stays: a file, a symbolic link, a folder
//! with other files, the folder of a campaign that the user has put there.
//!
//! Two campaigns that start in one working folder at the same time do not meet: the lock of the
//! folder at `closecall-results` also guards the previous one, and a folder is moved while its lock
//! is held. Files are removed one by one, the manifest last. A program that is killed meanwhile
//! leaves a folder that the next campaign still recognises.

use std::ffi::OsStr;
use std::fs;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::time::Duration;

use closecall_traffic::atomic::{WriteError, is_temporary};
use serde_json::Value;

use crate::folder::{FAST_SAMPLES, FILES, Folder, LockedFolder, MANIFEST, RECORDINGS, RECORDINGS_PAGE, REPORT};
use crate::folder_error::FolderError;
use crate::lock::Lock;
use crate::manifest::Manifest;

/// The folder of the last campaign, in the working folder.
pub const RESULTS: &str = "closecall-results";
/// The folder of the last finished campaign before it.
pub const PREVIOUS: &str = "closecall-results.previous";

/// Number of attempts to take a folder while other campaigns begin and end in it.
const ATTEMPTS: usize = 5;
/// The time from one attempt to the next.
const PAUSE: Duration = Duration::from_millis(20);
/// Largest number of files that a message names.
const NAMED_FILES: usize = 3;

/// The folder of a campaign that keeps its results in the default place, and the results that it
/// replaces.
#[derive(Debug)]
pub struct Taken {
    /// The folder, locked for the campaign.
    pub locked: LockedFolder,
    /// The results that are now the previous ones; `None` if there were none.
    pub moved: Option<Moved>,
}

/// Results that have become the previous ones.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Moved {
    /// The folder in which they are.
    pub to: PathBuf,
    /// The command line that started the campaign; `None` if it has come to its end.
    pub interrupted: Option<Vec<String>>,
    /// True if older results were removed.
    pub has_removed: bool,
}

/// Results of an unfinished campaign, in the way of a new one. They are removed.
#[derive(Clone, Copy, Debug)]
pub struct Unfinished<'a> {
    /// The folder in which they are.
    pub path: &'a Path,
    /// The folder of the finished results that they do not displace.
    pub previous: &'a Path,
}

/// The state of a path for results.
enum Place {
    /// Nothing.
    Free,
    /// An empty folder, or one whose campaign was killed before it had written its manifest.
    Unused,
    /// Results that a campaign has kept here on its own account.
    Results(Kept),
}

/// Results of an earlier campaign.
struct Kept {
    /// The command line of the campaign.
    command: Vec<String>,
    /// True if the campaign has come to its end: the report is the last file but one that it
    /// writes.
    is_finished: bool,
    /// The names of its scenarios, by which recordings are named.
    scenarios: Vec<String>,
}

/// Creates the folder of the results in `folder`, the working folder, for the campaign of
/// `manifest`. Earlier results become the previous ones. Unfinished results that would displace
/// finished ones are removed instead. `announce` is told of them before.
///
/// # Errors
/// [`FolderError::Foreign`] if something is at one of the two paths that no campaign has put there,
/// [`FolderError::Busy`] if another campaign runs there, other [`FolderError`]s if a folder cannot
/// be read or written.
pub fn take(folder: &Path, manifest: &Manifest, announce: impl Fn(Unfinished<'_>)) -> Result<Taken, FolderError> {
    let mut moved = None;
    for _ in 1..ATTEMPTS {
        match attempt(folder, manifest, &announce, &mut moved) {
            Err(error) if may_pass(&error) => std::thread::sleep(PAUSE),
            locked => return Ok(Taken { locked: locked?, moved }),
        }
    }
    let locked = attempt(folder, manifest, &announce, &mut moved)?;
    Ok(Taken { locked, moved })
}

/// Tries once to do what [`take`] does. Sets `moved` if results have become the previous ones, also
/// if the attempt fails after that.
fn attempt(
    folder: &Path,
    manifest: &Manifest,
    announce: impl Fn(Unfinished<'_>),
    moved: &mut Option<Moved>,
) -> Result<LockedFolder, FolderError> {
    let [path, previous] = [RESULTS, PREVIOUS].map(|name| folder.join(name));
    if let Place::Results(_) = inspect(&path, true)? {
        // An obstacle, even a lock, is found before anything is written.
        inspect(&previous, true)?;
        *moved = set_aside(&path, &previous, announce)?.or(moved.take());
    }
    Folder::lock(&path, manifest, false)
}

/// Returns true for an error that may come from another campaign alone: it has begun, ended, or
/// moved or removed results, while this one looked at them without a lock. No lock is possible
/// there, because nothing may be written into a folder before it is known to be a campaign's.
fn may_pass(error: &FolderError) -> bool {
    match error {
        FolderError::Write(WriteError { source, .. }) => source.kind() == ErrorKind::NotFound,
        FolderError::Busy { .. } => false,
        _ => true,
    }
}

/// Locks the folder of the results in `folder`, the working folder, to resume the campaign of
/// `manifest`. The folder is created if there is none.
///
/// # Errors
/// [`FolderError`] as of [`take`], and if the folder holds another campaign.
pub fn resume(folder: &Path, manifest: &Manifest) -> Result<LockedFolder, FolderError> {
    let path = folder.join(RESULTS);
    inspect(&path, false)?;
    Folder::lock(&path, manifest, true)
}

/// Checks that none of the inputs of a campaign is in one of the two folders.
///
/// # Errors
/// [`FolderError::Foreign`] if one is.
pub fn check_inputs(folder: &Path, inputs: &[PathBuf]) -> Result<(), FolderError> {
    for path in [RESULTS, PREVIOUS].map(|name| folder.join(name)) {
        let Ok(whole) = path.canonicalize() else { continue };
        let is_within = |input: &&PathBuf| input.canonicalize().is_ok_and(|input| input.starts_with(&whole));
        if let Some(input) = inputs.iter().find(is_within) {
            return Err(foreign(&path, format!("it holds an input of the campaign, {}", input.display())));
        }
    }
    Ok(())
}

/// Makes the results at `path` the previous ones, or removes them if they are unfinished and would
/// displace finished ones. Returns `None` if nothing is moved.
fn set_aside(path: &Path, previous: &Path, announce: impl Fn(Unfinished<'_>)) -> Result<Option<Moved>, FolderError> {
    let lock = Lock::acquire(path)?;
    let Place::Results(kept) = inspect(path, true)? else { return Ok(None) };
    if !kept.is_finished && matches!(inspect(previous, true)?, Place::Results(Kept { is_finished: true, .. })) {
        announce(Unfinished { path, previous });
        remove_results(path)?;
        return Ok(None);
    }
    let has_removed = remove(previous)?;
    fs::rename(path, previous).map_err(|source| WriteError::new(previous, source))?;
    drop(lock);
    let interrupted = (!kept.is_finished).then_some(kept.command);
    Ok(Some(Moved { to: previous.to_owned(), interrupted, has_removed }))
}

/// Removes earlier results. Returns false if there are none.
fn remove(path: &Path) -> Result<bool, FolderError> {
    let fail = |path: &Path| {
        let path = path.to_owned();
        move |source| WriteError::new(&path, source)
    };
    match inspect(path, true)? {
        Place::Free => return Ok(false),
        Place::Unused => {
            let _lock = Lock::acquire(path)?;
            inspect(path, true)?;
            for name in names(path)? {
                let file = path.join(name);
                fs::remove_file(&file).map_err(fail(&file))?;
            }
        }
        Place::Results(_) => {
            let _lock = Lock::acquire(path)?;
            inspect(path, true)?;
            remove_results(path)?;
            return Ok(true);
        }
    }
    fs::remove_dir(path).map_err(fail(path))?;
    Ok(true)
}

/// Removes a folder of results, whose lock is held.
fn remove_results(path: &Path) -> Result<(), FolderError> {
    for within in [RECORDINGS, FAST_SAMPLES].map(|name| path.join(name)) {
        if within.try_exists().map_err(|source| WriteError::new(&within, source))? {
            remove_files(&within, |_| true)?;
            fs::remove_dir(&within).map_err(|source| WriteError::new(&within, source))?;
        }
    }
    remove_files(path, |name| name != MANIFEST)?;
    remove_files(path, |_| true)?;
    Ok(fs::remove_dir(path).map_err(|source| WriteError::new(path, source))?)
}

/// Removes the files of a folder whose names are chosen. A folder within it is not removed.
fn remove_files(folder: &Path, is_chosen: impl Fn(&OsStr) -> bool) -> Result<(), FolderError> {
    for name in names(folder)?.iter().filter(|name| is_chosen(name)) {
        let file = folder.join(name);
        fs::remove_file(&file).map_err(|source| WriteError::new(&file, source))?;
    }
    Ok(())
}

/// Determines the state of a path for results, without changing it. Results that are to be replaced
/// must belong to a campaign whose command line named no folder.
fn inspect(path: &Path, is_replaced: bool) -> Result<Place, FolderError> {
    let read = |source| FolderError::Read { path: path.to_owned(), source };
    let kind = match fs::symlink_metadata(path) {
        Ok(metadata) => metadata.file_type(),
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Place::Free),
        Err(error) => return Err(read(error)),
    };
    if kind.is_symlink() {
        return Err(foreign(path, "it is a symbolic link"));
    }
    if !kind.is_dir() {
        return Err(foreign(path, "it is not a folder"));
    }
    let is_unused = |name: &OsStr| Lock::is_file_name(name) || is_temporary(name);
    if names(path)?.iter().all(|name| is_unused(name) && is_file(&path.join(name))) {
        return Ok(Place::Unused);
    }
    let manifest = path.join(MANIFEST);
    if !is_file(&manifest) {
        return Err(foreign(path, "it holds other files, and no results of a campaign"));
    }
    let text = fs::read(&manifest).map_err(|source| FolderError::Read { path: manifest.clone(), source })?;
    let Some(kept) = kept(&text, path) else { return Err(foreign(path, "its manifest does not belong to a campaign")) };
    if is_replaced && !is_replaceable(&text) {
        return Err(foreign(path, "it holds a campaign whose command line named its folder"));
    }
    let others = other_files(path, &kept)?;
    if !others.is_empty() {
        let more = others.len().saturating_sub(NAMED_FILES);
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        let named = others.into_iter().take(NAMED_FILES).collect::<Vec<_>>().join(", ");
        return Err(foreign(path, format!("beside the results of a campaign it holds {named}{more}")));
    }
    Ok(Place::Results(kept))
}

/// Returns the statements of a campaign's manifest, written by any version of this program; `None`
/// if it is no manifest.
fn kept(text: &[u8], path: &Path) -> Option<Kept> {
    let manifest: Value = serde_json::from_slice(text).ok()?;
    manifest.get("manifest_version")?.as_u64()?;
    manifest.get("closecall_version")?.as_str()?;
    let words = manifest.get("command")?.as_array()?.iter();
    let command = words.map(|word| word.as_str().map(str::to_owned)).collect::<Option<_>>()?;
    let names = manifest.get("scenarios")?.as_array()?.iter();
    let scenarios = names.map(|scenario| scenario.get("name")?.as_str().map(str::to_owned)).collect::<Option<_>>()?;
    Some(Kept { command, is_finished: is_file(&path.join(REPORT)), scenarios })
}

/// Returns true if the manifest says that a later campaign may take the folder.
fn is_replaceable(text: &[u8]) -> bool {
    let manifest: Option<Value> = serde_json::from_slice(text).ok();
    manifest.is_some_and(|manifest| manifest.get("replaceable") == Some(&Value::Bool(true)))
}

/// Returns the content of a folder beside the files of a campaign, by the paths below it.
fn other_files(path: &Path, kept: &Kept) -> Result<Vec<String>, FolderError> {
    let is_recording = |name: &OsStr| {
        name == RECORDINGS_PAGE || is_temporary(name) || name.to_str().is_some_and(|name| kept.has_recording(name))
    };
    let is_of_campaign = |name: &OsStr| is_temporary(name) || FILES.iter().any(|file| name == *file);
    let mut others = Vec::new();
    for name in names(path)? {
        let entry = path.join(&name);
        let is_folder = fs::symlink_metadata(&entry).is_ok_and(|entry| entry.is_dir());
        let folder = [RECORDINGS, FAST_SAMPLES].into_iter().find(|folder| name == *folder).filter(|_| is_folder);
        if let Some(folder) = folder {
            let is_expected =
                |name: &OsStr| if folder == RECORDINGS { is_recording(name) } else { is_of_campaign(name) };
            let within = names(&entry)?.into_iter().filter(|name| !(is_expected(name) && is_file(&entry.join(name))));
            others.extend(within.map(|name| format!("{folder}/{}", name.display())));
        } else if !(is_file(&entry) && is_of_campaign(&name)) {
            others.push(name.display().to_string());
        }
    }
    others.sort();
    Ok(others)
}

impl Kept {
    /// Returns true if a recording of this campaign, or its incident card, has this name.
    fn has_recording(&self, name: &str) -> bool {
        let sample = |scenario: &String| {
            let rest = name.strip_prefix(scenario.as_str())?.strip_prefix('-')?;
            rest.strip_suffix(".rrd").or_else(|| rest.strip_suffix(".html"))
        };
        self.scenarios.iter().filter_map(sample).any(|sample| sample.parse::<u64>().is_ok())
    }
}

/// Returns the names in a folder.
fn names(folder: &Path) -> Result<Vec<std::ffi::OsString>, FolderError> {
    let entries = fs::read_dir(folder).and_then(|entries| entries.map(|entry| Ok(entry?.file_name())).collect());
    entries.map_err(|source: io::Error| FolderError::Read { path: folder.to_owned(), source })
}

/// Returns true if a path leads to a file by itself: a symbolic link does not.
fn is_file(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok_and(|metadata| metadata.is_file())
}

fn foreign(path: &Path, reason: impl Into<String>) -> FolderError {
    FolderError::Foreign { path: path.to_owned(), reason: reason.into() }
}
