//! The data that is sent to a remote machine before it runs blocks of a campaign: the manifest,
//! which holds the scenarios with their recorded traffic, and the files that controllers and
//! perception programs name.

use std::fs;
use std::path::{Component, Path, PathBuf};

use closecall_simulation::controller::ControllerChoice;
use tempfile::TempDir;

use super::error::RemoteError;
use crate::fingerprint::{named_files, program_files};
use crate::manifest::Manifest;

/// The data that a remote machine needs to run blocks of a campaign.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Shipment {
    /// The version of the program that started the campaign.
    pub version: String,
    /// The manifest (JSON).
    pub manifest: String,
    /// The names of the controllers of a user's own program that calls Closecall as a library. The
    /// engine that distributes the work must bring their code to the machine.
    pub controllers: Vec<String>,
    /// The files that controllers and perception programs name by a relative path: files of
    /// commands, libraries and FMUs.
    pub files: Vec<ShippedFile>,
}

/// A file that is shipped.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShippedFile {
    /// The path, relative to the folder in which the controllers run.
    pub name: String,
    /// The content.
    pub content: Vec<u8>,
    /// Whether the file is a program.
    pub is_executable: bool,
}

impl Shipment {
    /// Returns the shipment of this campaign.
    ///
    /// # Errors
    /// [`RemoteError::File`] if a file of a controller cannot be read.
    pub fn of(manifest: &Manifest) -> Result<Self, RemoteError> {
        let is_hosted = |arm: &&ControllerChoice| matches!(arm, ControllerChoice::Hosted(_));
        let mut files: Vec<ShippedFile> = Vec::new();
        let programs = manifest.programs();
        let perception_files = programs.iter().flat_map(|program| program_files(program, None));
        for (name, path) in manifest.arms.iter().flat_map(controller_files).chain(perception_files) {
            // A program that was found by the search path, or has an absolute path, is a matter of
            // each machine.
            if is_within(&name) && Path::new(&name) == path && files.iter().all(|file| file.name != name) {
                let fail = |source| RemoteError::File { path: path.clone(), source };
                let is_executable = is_executable(&fs::metadata(&path).map_err(fail)?);
                files.push(ShippedFile { name, content: fs::read(&path).map_err(fail)?, is_executable });
            }
        }
        Ok(Self {
            version: manifest.closecall_version.clone(),
            manifest: serde_json::to_string(manifest)?,
            controllers: manifest.arms.iter().filter(is_hosted).map(ToString::to_string).collect(),
            files,
        })
    }

    /// Writes the files into a new folder, which is removed when the value is dropped; `None` if
    /// there are none.
    pub(super) fn unpack(&self) -> Result<Option<TempDir>, RemoteError> {
        if self.files.is_empty() {
            return Ok(None);
        }
        let fail = |path: PathBuf| move |source| RemoteError::File { path, source };
        let folder = tempfile::tempdir().map_err(fail(std::env::temp_dir()))?;
        for file in &self.files {
            let path = folder.path().join(&file.name);
            if !is_within(&file.name) {
                return Err(fail(path)(std::io::ErrorKind::InvalidFilename.into()));
            }
            if let Some(parent) = path.parent() {
                fs::create_dir_all(parent).map_err(fail(path.clone()))?;
            }
            fs::write(&path, &file.content).map_err(fail(path.clone()))?;
            if file.is_executable {
                make_executable(&path).map_err(fail(path))?;
            }
        }
        Ok(Some(folder))
    }
}

/// Returns the files that a controller names: each by the name it gives, and by the path at which
/// this program finds the file.
fn controller_files(controller: &ControllerChoice) -> Vec<(String, PathBuf)> {
    match (controller.exec(), controller.native()) {
        (Some(exec), _) => named_files(exec, None),
        (_, Some(native)) => vec![(native.path.clone(), PathBuf::from(&native.path))],
        _ => Vec::new(),
    }
}

/// Returns true if a path leads to a file within the folder to which it is relative.
fn is_within(name: &str) -> bool {
    Path::new(name).components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir))
}

#[cfg(unix)]
fn is_executable(metadata: &fs::Metadata) -> bool {
    use std::os::unix::fs::PermissionsExt;
    metadata.permissions().mode() & 0o100 != 0
}

#[cfg(not(unix))]
fn is_executable(_: &fs::Metadata) -> bool {
    false
}

#[cfg(unix)]
fn make_executable(path: &Path) -> std::io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    fs::set_permissions(path, fs::Permissions::from_mode(0o700))
}

#[cfg(not(unix))]
fn make_executable(_: &Path) -> std::io::Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_unpacked_within_their_folder_only() {
        let file = |name: &str| ShippedFile { name: name.to_owned(), content: b"text".to_vec(), is_executable: true };
        let shipment = |name| Shipment { files: vec![file(name)], ..Shipment::default() };
        let folder = shipment("./own/controller.py").unpack().unwrap().unwrap();
        let path = folder.path().join("own/controller.py");
        assert_eq!(fs::read(&path).unwrap(), b"text");
        assert!(is_executable(&path.metadata().unwrap()));
        for name in ["../controller.py", "/tmp/controller.py", "a/../../b"] {
            let error = shipment(name).unpack().unwrap_err().to_string();
            assert!(error.starts_with("failed to ship ") && error.contains(name.trim_start_matches('/')), "{error}");
        }
        assert!(Shipment::default().unpack().unwrap().is_none());
    }
}
