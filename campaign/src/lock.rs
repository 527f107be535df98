//! A lock that keeps a second program out of a campaign's folder.
//!
//! The operating system releases the lock when the program ends, even if the program is killed. A
//! stale lock cannot exist.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read, Seek, Write};
use std::path::Path;

use closecall_traffic::atomic::WriteError;
use closecall_traffic::input;

use super::folder_error::FolderError;

/// The name of the lock file.
pub(crate) const LOCK: &str = "lock";
/// Number of attempts to lock a folder that is moved meanwhile.
const ATTEMPTS: usize = 5;

/// A lock on a folder, released when the value is dropped.
#[derive(Debug)]
pub struct Lock {
    file: File,
}

impl Lock {
    /// Locks a folder.
    ///
    /// # Errors
    /// [`FolderError::Busy`] if another program holds the lock, [`FolderError::Write`] if the lock
    /// file cannot be written.
    pub fn acquire(folder: &Path) -> Result<Self, FolderError> {
        for _ in 0..ATTEMPTS {
            let lock = Self::acquire_file(folder)?;
            if lock.is_in(folder) {
                return Ok(lock);
            }
        }
        Err(FolderError::Busy { path: folder.to_owned(), holder: "it is being moved".to_owned() })
    }

    fn acquire_file(folder: &Path) -> Result<Self, FolderError> {
        let path = folder.join(LOCK);
        let fail = |source| WriteError::new(&path, source);
        let mut options = OpenOptions::new();
        options.create(true).read(true).write(true).truncate(false);
        let mut file = input::open_in_folder(&path, &mut options).map_err(fail)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                let mut holder = String::new();
                // The holder's process id is a courtesy: the folder is locked even if the id cannot
                // be read.
                drop(file.read_to_string(&mut holder));
                return Err(FolderError::Busy { path: folder.to_owned(), holder: holder.trim().to_owned() });
            }
            Err(TryLockError::Error(source)) => return Err(fail(source).into()),
        }
        let cleared = file.set_len(0).and_then(|()| file.rewind());
        cleared.and_then(|()| writeln!(file, "process {}", std::process::id())).map_err(fail)?;
        Ok(Self { file })
    }

    /// Returns true if the lock file is still the one in the folder. Between its opening and its
    /// lock, another program may have moved the folder, and have put another one in its place.
    #[cfg(unix)]
    fn is_in(&self, folder: &Path) -> bool {
        use std::os::unix::fs::MetadataExt as _;
        match (self.file.metadata(), folder.join(LOCK).metadata()) {
            (Ok(locked), Ok(there)) => (locked.dev(), locked.ino()) == (there.dev(), there.ino()),
            _ => false,
        }
    }

    /// Returns true if the folder has a lock file: a folder with an open file cannot be moved.
    #[cfg(not(unix))]
    fn is_in(&self, folder: &Path) -> bool {
        self.file.metadata().is_ok() && folder.join(LOCK).exists()
    }

    /// Returns true if `name` is the name of the lock file, which stays in the folder after the
    /// lock is released.
    pub(crate) fn is_file_name(name: &std::ffi::OsStr) -> bool {
        name == LOCK
    }
}
impl Drop for Lock {
    /// Unlocks the file. Closing it alone would not: a process that another thread is starting
    /// holds the open file, too, until its own program begins.
    fn drop(&mut self) {
        drop(self.file.unlock());
    }
}
