//! One campaign at a time in a folder.
//!
//! The operating system gives the lock back when the program ends, however it ends: a lock is never left behind.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read, Seek, Write};
use std::path::Path;

use super::folder_error::FolderError;
use closecall_scenarios::atomic::WriteError;

const LOCK: &str = "lock";

/// A folder that is held against other programs, for as long as this lives.
#[derive(Debug)]
pub struct Lock {
    _file: File,
}

impl Lock {
    /// Takes a folder.
    ///
    /// # Errors
    /// [`FolderError::Busy`] where another program holds it, [`FolderError::Write`] where it cannot be written.
    pub fn take(folder: &Path) -> Result<Self, FolderError> {
        let path = folder.join(LOCK);
        let fail = |source| WriteError::new(&path, source);
        let options = OpenOptions::new().create(true).read(true).write(true).truncate(false).open(&path);
        let mut file = options.map_err(fail)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                let mut holder = String::new();
                // Who holds it is told where it can be read; that someone does is certain.
                drop(file.read_to_string(&mut holder));
                return Err(FolderError::Busy { path: folder.to_owned(), holder: holder.trim().to_owned() });
            }
            Err(TryLockError::Error(source)) => return Err(fail(source).into()),
        }
        let told = file.set_len(0).and_then(|()| file.rewind());
        told.and_then(|()| writeln!(file, "process {}", std::process::id())).map_err(fail)?;
        Ok(Self { _file: file })
    }

    /// True for the name of the file that a lock leaves in its folder.
    pub(crate) fn is_file_name(name: &std::ffi::OsStr) -> bool {
        name == LOCK
    }
}
