//! Atomic file writes: a file appears complete, or not at all.

use std::ffi::OsStr;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::{Builder, NamedTempFile};

/// Name prefix of temporary files. A killed program leaves such a file behind.
const TEMPORARY_PREFIX: &str = ".closecall-";

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

/// Writes texts, such as charts, into a folder, which is created if it does not exist. Each path
/// belongs to the text of the same index. `written` receives the path afterwards.
///
/// # Errors
/// [`WriteError`] if the folder or a file cannot be written.
pub fn write_texts(
    folder: &Path,
    paths: &[PathBuf],
    texts: &[String],
    written: impl Fn(&Path),
) -> Result<(), WriteError> {
    create_folder(folder)?;
    for (path, text) in paths.iter().zip(texts) {
        write_file(path, |file| file.write_all(text.as_bytes()))?;
        written(path);
    }
    Ok(())
}

/// Creates a folder and the folders that it lies in, unless they exist.
///
/// # Errors
/// [`WriteError`] if the folder cannot be created, or a file has its name.
pub fn create_folder(path: &Path) -> Result<(), WriteError> {
    std::fs::create_dir_all(path).map_err(|source| match source.kind() {
        io::ErrorKind::AlreadyExists => not_a_folder(path),
        _ => WriteError::new(path, source),
    })
}

/// Checks that files can be created in the folder `path`, which need not exist yet, so that a long
/// computation does not fail only when it saves its result. Nothing is left behind.
///
/// # Errors
/// [`WriteError`] if the folder cannot be created or written, or a file has its name.
pub fn check_folder(path: &Path) -> Result<(), WriteError> {
    let mut folders = path.ancestors();
    let nearest = folders.find(|folder| folder.symlink_metadata().is_ok()).unwrap_or(Path::new("."));
    if !nearest.is_dir() {
        return Err(not_a_folder(nearest));
    }
    temporary_in(nearest).map(drop).map_err(|source| WriteError::new(path, source))
}

/// Returns the failure to use a file as a folder.
fn not_a_folder(path: &Path) -> WriteError {
    WriteError::new(path, io::Error::new(io::ErrorKind::NotADirectory, "it is a file, and a folder is needed"))
}

/// Writes a file as [`write_atomically`] does, and names it if that fails.
///
/// # Errors
/// [`WriteError`] if the folder or the file cannot be written; a file of that name is then
/// unchanged.
pub fn write_file(
    path: &Path,
    content: impl FnOnce(&mut (dyn Write + Send)) -> io::Result<()>,
) -> Result<(), WriteError> {
    write_atomically(path, content).map_err(|source| WriteError::new(path, source))
}

/// Writes the file `path` through `content`: first under a temporary name in the same folder, then
/// by a rename.
///
/// On return, both the content and the name have been synchronized to the disk.
///
/// # Errors
/// Returns the error of `content`, or an I/O error. A file that existed at `path` before then stays
/// untouched.
pub fn write_atomically<E: From<io::Error>>(
    path: &Path,
    content: impl FnOnce(&mut (dyn Write + Send)) -> Result<(), E>,
) -> Result<(), E> {
    let folder = parent_folder(path);
    let file = temporary_in(folder)?;
    // An error of the file itself does not name the temporary path.
    let mut writer = BufWriter::new(file.as_file());
    content(&mut writer)?;
    writer.into_inner().map_err(io::IntoInnerError::into_error)?;
    file.as_file().sync_all()?;
    file.persist(path).map_err(|error| error.error)?;
    Ok(sync_folder(folder)?)
}

/// Checks that a file can be created at `path`, so that a long computation does not fail only when
/// it saves its result.
///
/// # Errors
/// [`WriteError`] if no file can be created in the folder of `path`, or a folder has its name.
pub fn check_writable(path: &Path) -> Result<(), WriteError> {
    if path.is_dir() {
        let reason = io::Error::new(io::ErrorKind::IsADirectory, "it is a folder, and a file is needed");
        return Err(WriteError::new(path, reason));
    }
    temporary_in(parent_folder(path)).map(drop).map_err(|source| WriteError::new(path, source))
}

/// Returns true if `name` is the name of a temporary file that a killed program left behind.
pub fn is_temporary(name: &OsStr) -> bool {
    name.to_string_lossy().starts_with(TEMPORARY_PREFIX)
}

/// Returns the folder that a file is in: the working folder if the path has a name only.
pub fn parent_folder(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Creates a temporary file whose permissions follow the umask, like the permissions of any other
/// new file.
///
/// The default of `tempfile` is read and write access for the owner alone, which the renamed file
/// would keep.
fn temporary_in(folder: &Path) -> io::Result<NamedTempFile> {
    let mut builder = Builder::new();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        const READ_AND_WRITE: u32 = 0o666;
        builder.permissions(std::fs::Permissions::from_mode(READ_AND_WRITE));
    }
    builder.prefix(TEMPORARY_PREFIX).tempfile_in(folder).map_err(without_path)
}

/// Removes the temporary name from an error of `tempfile`: the caller names the file that it
/// writes.
fn without_path(error: io::Error) -> io::Error {
    match error.to_string().split_once(" at path ") {
        Some((reason, _)) => io::Error::new(error.kind(), reason),
        None => error,
    }
}

/// Synchronizes a folder to the disk, so that a new file name survives a power failure.
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
    fn an_error_names_the_file_and_no_temporary_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("missing").join("a.txt");
        let written = write_file(&path, |writer| writer.write_all(b"a")).unwrap_err();
        for error in [written, check_writable(&path).unwrap_err()] {
            let message = error.to_string();
            assert!(message.starts_with(&format!("failed to write {}: ", path.display())), "{message}");
            assert!(!message.contains(TEMPORARY_PREFIX) && !message.contains("at path"), "{message}");
            assert_eq!(error.source.kind(), io::ErrorKind::NotFound);
        }
    }

    #[test]
    fn a_file_in_the_place_of_a_folder_is_named_as_such() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("results");
        std::fs::write(&path, "text").unwrap();
        let error = create_folder(&path).unwrap_err().to_string();
        assert!(error.ends_with("results: it is a file, and a folder is needed"), "{error}");
        assert!(create_folder(&folder.path().join("a").join("b")).is_ok() && create_folder(folder.path()).is_ok());
    }

    #[test]
    fn a_folder_is_checked_before_it_exists() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.csv");
        std::fs::write(&file, "text").unwrap();
        for wrong in [file.clone(), file.join("below").join("it")] {
            let error = check_folder(&wrong).unwrap_err().to_string();
            assert!(error.ends_with("a.csv: it is a file, and a folder is needed"), "{error}");
        }
        let new = folder.path().join("new").join("below");
        assert!(check_folder(&new).is_ok() && check_folder(folder.path()).is_ok());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
        let error = check_writable(folder.path()).unwrap_err().to_string();
        assert!(error.ends_with(": it is a folder, and a file is needed"), "{error}");
        assert!(check_writable(&file).is_ok());
    }

    #[test]
    fn a_failed_write_keeps_the_old_file_and_leaves_no_temporary_file() {
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
