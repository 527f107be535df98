//! A lock that keeps a second program out of a campaign's folder.
//!
//! The operating system releases the lock when the program ends, even if the program is killed. A stale lock cannot
//! exist.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read, Seek, Write};
use std::path::Path;

use closecall_scenarios::atomic::WriteError;

use super::folder_error::FolderError;

const LOCK: &str = "lock";

/// A lock on a folder, released when the value is dropped.
#[derive(Debug)]
pub struct Lock {
    _file: File,
}

impl Lock {
    /// Locks a folder.
    ///
    /// # Errors
    /// [`FolderError::Busy`] if another program holds the lock, [`FolderError::Write`] if the lock file cannot be
    /// written.
    pub fn acquire(folder: &Path) -> Result<Self, FolderError> {
        let path = folder.join(LOCK);
        let fail = |source| WriteError::new(&path, source);
        let options = OpenOptions::new().create(true).read(true).write(true).truncate(false).open(&path);
        let mut file = options.map_err(fail)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                let mut holder = String::new();
                // The holder's process id is a courtesy: the folder is locked even if the id cannot be read.
                drop(file.read_to_string(&mut holder));
                return Err(FolderError::Busy { path: folder.to_owned(), holder: holder.trim().to_owned() });
            }
            Err(TryLockError::Error(source)) => return Err(fail(source).into()),
        }
        let cleared = file.set_len(0).and_then(|()| file.rewind());
        cleared.and_then(|()| writeln!(file, "process {}", std::process::id())).map_err(fail)?;
        Ok(Self { _file: file })
    }

    /// Returns true if `name` is the name of the lock file, which stays in the folder after the lock is released.
    pub(crate) fn is_file_name(name: &std::ffi::OsStr) -> bool {
        name == LOCK
    }
}
