//! A shared library with functions of any interface.

#![expect(unsafe_code, reason = "functions of a loaded library are found by their names")]

use std::ffi::c_char;
use std::path::Path;

use libloading::Library as Module;

use crate::external::arithmetic::Arithmetic;
use crate::external::error::LoadError;
use crate::external::{library, platform};

/// A shared library that this process has loaded. It is unloaded when this value is dropped.
#[derive(Debug)]
pub struct SharedLibrary {
    module: Module,
    path: String,
}

impl SharedLibrary {
    /// Loads a library that exports the functions `needed`. `prefix` is the beginning of the names
    /// that a message lists if one is missing. This runs code of the file: only a process that may
    /// crash does so.
    ///
    /// # Errors
    /// [`LoadError`] if the file is no library for this platform, or lacks a function.
    pub fn open(path: &Path, needed: &[&str], prefix: &str) -> Result<Self, LoadError> {
        platform::check(path, needed, prefix)?;
        let _kept = Arithmetic::keep();
        Ok(Self { module: library::open(path)?, path: path.display().to_string() })
    }

    /// Returns the path of the file, as it was given.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// Returns a function that the library need not export.
    ///
    /// # Safety
    /// The function has the type `F`, and is not called after this value is dropped.
    pub unsafe fn optional<F: Copy>(&self, name: &str) -> Option<F> {
        // SAFETY: the caller vouches for the type.
        unsafe { library::function(&self.module, name) }
    }

    /// Returns a function that the library must export.
    ///
    /// # Errors
    /// [`LoadError::Symbol`] if it does not.
    ///
    /// # Safety
    /// The function has the type `F`, and is not called after this value is dropped.
    pub unsafe fn function<F: Copy>(&self, name: &str) -> Result<F, LoadError> {
        // SAFETY: the caller vouches for the type.
        unsafe { self.optional(name) }.ok_or_else(|| LoadError::Symbol {
            path: self.path.clone(),
            missing: vec![name.to_owned()],
            actual: Vec::new(),
        })
    }
}

/// Returns a text of a library; `None` if there is none.
///
/// # Safety
/// The pointer is null or points to a text that ends with 0.
pub unsafe fn text(pointer: *const c_char) -> Option<String> {
    // SAFETY: the caller vouches for the pointer.
    unsafe { library::text(pointer) }
}
