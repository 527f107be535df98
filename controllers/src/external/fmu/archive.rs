//! The archive of an FMU: a zip file with a model description and a binary for each platform.

use std::env::consts::{ARCH, DLL_SUFFIX, OS};
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;
use zip::ZipArchive;
use zip::result::ZipError;

use super::description::{Description, Version};
use crate::external::error::LoadError;

/// The name of the description in the archive.
const DESCRIPTION: &str = "modelDescription.xml";

/// An FMU that is unpacked into a folder, which is removed with this value.
#[derive(Debug)]
pub(super) struct Unpacked {
    pub(super) description: Description,
    pub(super) binary: PathBuf,
    folder: Folder,
}

impl Unpacked {
    /// Returns the folder of the FMU's resources.
    pub(super) fn resources(&self) -> PathBuf {
        self.folder.path.join("resources")
    }
}

/// The beginning of the names of the folders, and the ends of the names of a folder and of its lock.
const PREFIX: &str = "closecall-fmu-";
const FOLDER_END: &str = "unpacked";
const LOCK_END: &str = "lock";

/// A temporary folder. A process that crashes leaves its folder behind, without the lock beside it: the next process removes it.
#[derive(Debug)]
struct Folder {
    path: PathBuf,
    /// Locked for as long as the process lives.
    _lock: NamedTempFile,
}

impl Folder {
    fn new(place: &Path) -> io::Result<Self> {
        remove_abandoned(place);
        let lock = Self::lock(place)?;
        let path = lock.path().with_extension(FOLDER_END);
        std::fs::create_dir(&path)?;
        Ok(Self { path, _lock: lock })
    }

    /// Creates a file and locks it.
    fn lock(folder: &Path) -> io::Result<NamedTempFile> {
        loop {
            let lock = tempfile::Builder::new().prefix(PREFIX).suffix(&format!(".{LOCK_END}")).tempfile_in(folder)?;
            lock.as_file().lock()?;
            // Before it was locked, another process may have taken it for an abandoned one, and removed it.
            if lock.path().exists() {
                return Ok(lock);
            }
        }
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // What cannot be removed stays.
        std::fs::remove_dir_all(&self.path).ok();
    }
}

/// Removes the folders of processes that have crashed.
fn remove_abandoned(folder: &Path) {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let is_lock = |path: &PathBuf| {
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        name.starts_with(PREFIX) && path.extension().is_some_and(|end| end == LOCK_END)
    };
    for path in entries.filter(is_lock) {
        // A lock of another user cannot be opened.
        let Ok(lock) = File::open(&path) else { continue };
        // The lock is held until both are removed.
        if lock.try_lock().is_ok() {
            std::fs::remove_dir_all(path.with_extension(FOLDER_END)).ok();
            std::fs::remove_file(&path).ok();
        }
        drop(lock);
    }
}

/// Unpacks an FMU. Its description and its binary for this platform are looked for first.
pub(super) fn unpack(path: &Path) -> Result<Unpacked, LoadError> {
    let shown = path.display().to_string();
    let read = |source| LoadError::Read { path: shown.clone(), source };
    let refuse = |reason: String| LoadError::Fmu { path: shown.clone(), reason };
    let file = File::open(path).map_err(read)?;
    let broken = |error: ZipError| match error {
        ZipError::Io(source) if source.kind() != io::ErrorKind::UnexpectedEof => read(source),
        error => refuse(format!("it is not an FMU, which is a zip archive ({error})")),
    };
    let mut archive = ZipArchive::new(file).map_err(broken)?;
    let text = {
        let mut entry = archive
            .by_name(DESCRIPTION)
            .map_err(|error| refuse(format!("it is not an FMU: its archive has no {DESCRIPTION} ({error})")))?;
        io::read_to_string(&mut entry).map_err(|error| refuse(format!("its {DESCRIPTION} cannot be read: {error}")))?
    };
    let description = Description::parse(&text).map_err(&refuse)?;
    let binary = binary(&archive, &description).map_err(&refuse)?;
    let folder = Folder::new(&std::env::temp_dir()).map_err(read)?;
    archive.extract(&folder.path).map_err(broken)?;
    std::fs::create_dir_all(folder.path.join("resources")).map_err(read)?;
    Ok(Unpacked { description, binary: folder.path.join(binary), folder })
}

/// Returns the name of the binary for this platform in the archive, or why there is none.
fn binary(archive: &ZipArchive<File>, description: &Description) -> Result<String, String> {
    let own = own_platforms(description.version);
    let name = |platform: &str| format!("binaries/{platform}/{}{DLL_SUFFIX}", description.identifier);
    // A name that is no text names no binary.
    let names: Vec<String> = archive.file_names().flatten().map(|name| name.into_owned()).collect();
    if let Some(found) = own.iter().map(|platform| name(platform)).find(|name| names.contains(name)) {
        return Ok(found);
    }
    let mut platforms: Vec<&str> =
        names.iter().filter_map(|name| Some(name.strip_prefix("binaries/")?.split_once('/')?.0)).collect();
    platforms.sort_unstable();
    platforms.dedup();
    let found = match platforms.iter().any(|platform| own.contains(&(*platform).to_owned())) {
        true => format!("its binaries lack {}", name(&own[0])),
        false if platforms.is_empty() => "it has no binaries".to_owned(),
        false => format!("it has binaries for {}", platforms.join(", ")),
    };
    Err(format!("{found}; expected one for {}", own.join(" or ")))
}

/// Returns the names of this platform in the folder `binaries`.
fn own_platforms(version: Version) -> Vec<String> {
    let system = if OS == "macos" { "darwin" } else { OS };
    let tuple = format!("{ARCH}-{system}");
    let short = match (version, ARCH, OS) {
        (Version::Fmi2, "x86_64", "linux") => "linux64",
        (Version::Fmi2, "x86_64", "macos") => "darwin64",
        (Version::Fmi2, "x86_64", "windows") => "win64",
        _ => return vec![tuple],
    };
    vec![short.to_owned(), tuple]
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicBool, Ordering};

    use super::*;

    #[test]
    fn a_live_folder_is_not_taken_for_an_abandoned_one() {
        let place = tempfile::tempdir().unwrap();
        let is_over = AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                while !is_over.load(Ordering::Relaxed) {
                    remove_abandoned(place.path());
                }
            });
            for _ in 0..2_000 {
                let folder = Folder::new(place.path()).unwrap();
                std::fs::write(folder.path.join("resource"), "text").unwrap();
                assert!(folder.path.join("resource").exists());
            }
            is_over.store(true, Ordering::Relaxed);
        });
    }

    #[test]
    fn an_abandoned_folder_is_removed() {
        let place = tempfile::tempdir().unwrap();
        let names = ["closecall-fmu-x.unpacked", "closecall-fmu-x.lock"].map(|name| place.path().join(name));
        std::fs::create_dir(&names[0]).unwrap();
        std::fs::write(&names[1], "").unwrap();
        remove_abandoned(place.path());
        assert!(names.iter().all(|path| !path.exists()));
    }
}
