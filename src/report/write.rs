//! Files that are either whole or not there.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use closecall_scenarios::atomic;

/// A file that could not be written. What was there before is untouched.
#[derive(Debug, thiserror::Error)]
#[error("failed to write {}: {source}", path.display())]
pub struct WriteError {
    /// The file.
    pub path: PathBuf,
    /// The system's reason.
    pub source: io::Error,
}

impl WriteError {
    /// A failure to write `path`.
    pub fn new(path: &Path, source: io::Error) -> Self {
        Self { path: path.to_owned(), source }
    }
}

/// Writes a file under a temporary name in the same folder and renames it when it is whole.
///
/// # Errors
/// [`WriteError`] where the folder or the file cannot be written; a file of that name is then as it was.
pub fn write_atomically(
    path: &Path,
    write: impl FnOnce(&mut (dyn Write + Send)) -> io::Result<()>,
) -> Result<(), WriteError> {
    atomic::write_atomically(path, write).map_err(|source| WriteError::new(path, source))
}

/// Finds out before any work is done that a file could not be made after it.
///
/// # Errors
/// [`WriteError`] where the folder does not take new files.
pub(super) fn check_writable(path: &Path) -> Result<(), WriteError> {
    atomic::check_writable(path).map_err(|source| WriteError::new(path, source))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        write_atomically(&path, |file| file.write_all(b"old")).unwrap();
        let failed = write_atomically(&path, |file| {
            file.write_all(b"half")?;
            Err(io::Error::other("full"))
        });
        assert!(failed.is_err());
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
