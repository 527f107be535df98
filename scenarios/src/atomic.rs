//! Files that appear as a whole, or not at all.

use std::ffi::OsStr;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::{Builder, NamedTempFile};

/// How temporary files are called: a program that is killed leaves one behind.
const TEMPORARY: &str = ".closecall-";

/// A file that cannot be written. What was there before is untouched.
#[derive(Debug, thiserror::Error)]
#[error("failed to write {}: {source}", path.display())]
pub struct WriteError {
    /// The file.
    pub path: PathBuf,
    /// The system's reason.
    pub source: io::Error,
}

impl WriteError {
    /// Returns a failure to write `path`.
    pub fn new(path: &Path, source: io::Error) -> Self {
        Self { path: path.to_owned(), source }
    }
}

/// Writes a file as [`write_atomically`] does, and names it if that fails.
///
/// # Errors
/// [`WriteError`] if the folder or the file cannot be written; a file of that name is then unchanged.
pub fn write_file(
    path: &Path,
    content: impl FnOnce(&mut (dyn Write + Send)) -> io::Result<()>,
) -> Result<(), WriteError> {
    write_atomically(path, content).map_err(|source| WriteError::new(path, source))
}

/// Writes a file by `content` under a temporary name beside `path`, then renames it. When this returns, the disk has been
/// asked to keep both the content and the name.
///
/// # Errors
/// Those of `content`, and I/O errors; a file that was at `path` before is then untouched.
pub fn write_atomically<E: From<io::Error>>(
    path: &Path,
    content: impl FnOnce(&mut (dyn Write + Send)) -> Result<(), E>,
) -> Result<(), E> {
    let folder = folder(path);
    let mut file = BufWriter::new(temporary_in(folder)?);
    content(&mut file)?;
    let file = file.into_inner().map_err(io::IntoInnerError::into_error)?;
    file.as_file().sync_all()?;
    file.persist(path).map_err(|error| error.error)?;
    Ok(sync_folder(folder)?)
}

/// Checks, before any work is done, that a file can be created at `path` later.
///
/// # Errors
/// [`WriteError`] if the folder does not take new files.
pub fn check_writable(path: &Path) -> Result<(), WriteError> {
    temporary_in(folder(path)).map(drop).map_err(|source| WriteError::new(path, source))
}

/// True for the name of a file that was being written when the program was killed.
pub fn is_temporary(name: &OsStr) -> bool {
    name.to_string_lossy().starts_with(TEMPORARY)
}

fn folder(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// A temporary file that, once renamed, can be read by whom the umask lets read.
fn temporary_in(folder: &Path) -> io::Result<NamedTempFile> {
    let mut builder = Builder::new();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        const READ_AND_WRITE: u32 = 0o666;
        builder.permissions(std::fs::Permissions::from_mode(READ_AND_WRITE));
    }
    builder.prefix(TEMPORARY).tempfile_in(folder)
}

/// Has the disk keep a new name.
#[cfg(unix)]
fn sync_folder(folder: &Path) -> io::Result<()> {
    std::fs::File::open(folder)?.sync_all()
}

#[cfg(not(unix))]
fn sync_folder(_: &Path) -> io::Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failure_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        std::fs::write(&path, "old").unwrap();
        let failed: io::Result<()> = write_atomically(&path, |writer| {
            writer.write_all(b"half")?;
            Err(io::Error::other("stopped"))
        });
        assert!(failed.is_err());
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
        write_atomically(&path, |writer| writer.write_all(b"new")).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "new");
    }
}
