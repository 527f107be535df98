//! The reasons for which a library or an FMU cannot be used.

use std::io;

/// The reason for which a library or an FMU cannot be used as a controller.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The file cannot be read.
    #[error("failed to read {path}: {source}")]
    Read {
        /// The file.
        path: String,
        /// The reason of the system.
        source: io::Error,
    },
    /// The file is no shared library.
    #[error("{path} is not a shared library: {reason}; expected one for {expected}")]
    NotALibrary {
        /// The file.
        path: String,
        /// The kind of the file, or its fault.
        reason: String,
        /// The platform of this program.
        expected: String,
    },
    /// The library is for another platform.
    #[error("{path} is a library for {actual}; expected one for {expected}")]
    Platform {
        /// The file.
        path: String,
        /// The platform of the library.
        actual: String,
        /// The platform of this program.
        expected: String,
    },
    /// The library lacks a function.
    #[error("{path} does not export {}; {}", listed(missing), exported(actual))]
    Symbol {
        /// The file.
        path: String,
        /// The missing functions.
        missing: Vec<String>,
        /// The functions of the interface, or others, that it exports.
        actual: Vec<String>,
    },
    /// The library has another version of the interface.
    #[error(
        "{path} has version {actual} of the interface, this is version {expected}: build it again with the header of this program"
    )]
    Abi {
        /// The file.
        path: String,
        /// The version of the library.
        actual: u32,
        /// The version of this program.
        expected: u32,
    },
    /// A function of the library states a value that the interface does not have.
    #[error("{path}: `{function}` returned {actual}; expected {allowed}")]
    Value {
        /// The file.
        path: String,
        /// The function.
        function: &'static str,
        /// The returned value.
        actual: i64,
        /// The allowed values.
        allowed: &'static str,
    },
    /// The system's loader refuses the library.
    #[error("failed to load {path}: {reason}")]
    Loader {
        /// The file.
        path: String,
        /// The reason of the loader.
        reason: String,
    },
    /// The FMU cannot be used.
    #[error("{path}: {reason}")]
    Fmu {
        /// The file.
        path: String,
        /// The fault, and the expected content.
        reason: String,
    },
}

impl LoadError {
    /// Returns true if the file cannot be read.
    pub const fn is_io(&self) -> bool {
        matches!(self, Self::Read { .. })
    }
}

fn listed(names: &[String]) -> String {
    names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

fn exported(symbols: &[String]) -> String {
    if symbols.is_empty() {
        return "it exports nothing".to_owned();
    }
    // The names that C++ gives to functions with their types.
    let is_cpp = symbols.iter().any(|name| name.starts_with("_Z"));
    let advice = if is_cpp { ", which are names of C++: declare the functions `extern \"C\"`" } else { "" };
    format!("it exports {}{advice}", listed(symbols))
}
