//! Libraries and FMUs that this process has loaded.

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::external::error::LoadError;
use crate::external::exchange::Setup;
use crate::external::fmu::{self, Fmu, VariableTable};
use crate::external::identity::{Identity, Run};
use crate::external::library::Library;

/// The kind of a controller that is a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// A shared library: `lib:PATH`.
    Lib,
    /// A functional mock-up unit: `fmu:PATH`.
    Fmu,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 2] = [Self::Lib, Self::Fmu];

    /// Returns the prefix of the names on the command line.
    pub const fn prefix(self) -> &'static str {
        match self {
            Self::Lib => "lib",
            Self::Fmu => "fmu",
        }
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.prefix())
    }
}

/// The table of a scenario about the variables of an FMU.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Variables {
    /// The names of its table.
    pub table: VariableTable,
    /// The settings of the ego stack.
    pub settings: Value,
}

/// A library or an FMU that this process has loaded.
#[derive(Clone, Debug)]
pub struct Loaded(Inner);

#[derive(Clone, Debug)]
enum Inner {
    Library(Arc<Library>),
    Fmu(Arc<Fmu>),
}

/// What this process has loaded. A library stays loaded until the end of the process.
static LOADED: Mutex<BTreeMap<(Kind, PathBuf), Loaded>> = Mutex::new(BTreeMap::new());

/// Forgets what this process has loaded, at its end: the folders of FMUs are removed.
pub fn unload_all() {
    let loaded = std::mem::take(&mut *LOADED.lock().unwrap_or_else(PoisonError::into_inner));
    drop(loaded);
}

/// If the controller is an FMU, unpacks it once for all processes that this process starts, and
/// returns the folder. Returns `None` if there is nothing to unpack. No code of the file runs.
///
/// # Errors
/// [`LoadError`] if the FMU cannot be unpacked.
pub fn unpack_for_children(kind: Kind, path: &Path) -> Result<Option<PathBuf>, LoadError> {
    if kind == Kind::Fmu { fmu::unpacked_for_children(path).map(Some) } else { Ok(None) }
}

/// Uses the folder into which the parent process has unpacked its FMU. The first call counts.
pub fn use_unpacked(folder: PathBuf) {
    fmu::use_unpacked(folder);
}

/// Removes what this process has unpacked for others, at its end.
pub fn remove_unpacked() {
    fmu::remove_unpacked();
}

impl Loaded {
    /// Loads a library or an FMU, once for each process. This runs code of the file: only a process
    /// that may crash does so.
    ///
    /// # Errors
    /// [`LoadError`] if the file cannot be used.
    pub fn open(kind: Kind, path: &Path) -> Result<Self, LoadError> {
        let mut loaded = LOADED.lock().unwrap_or_else(PoisonError::into_inner);
        let key = (kind, path.to_owned());
        if let Some(library) = loaded.get(&key) {
            return Ok(library.clone());
        }
        let library = match kind {
            Kind::Lib => Self(Inner::Library(Arc::new(Library::load(path)?))),
            Kind::Fmu => Self(Inner::Fmu(Arc::new(Fmu::load(path)?))),
        };
        loaded.insert(key, library.clone());
        Ok(library)
    }

    /// Returns the identity that the controller states.
    pub fn identity(&self) -> Identity {
        match &self.0 {
            Inner::Library(library) => library.identity().clone(),
            Inner::Fmu(fmu) => fmu.identity(),
        }
    }

    /// Checks that every variable of an FMU has its counterpart.
    ///
    /// # Errors
    /// The variable that has none, and those that exist.
    pub fn check(&self, variables: &Variables) -> Result<(), String> {
        match &self.0 {
            Inner::Library(_) => Ok(()),
            Inner::Fmu(fmu) => fmu.check(&variables.table, &Setup::of_settings(&variables.settings)),
        }
    }

    /// Creates a controller for one run, or returns why there is none. `table` names the variables
    /// of an FMU.
    pub(crate) fn start(&self, setup: &Setup, table: &VariableTable) -> Result<Box<dyn Run>, String> {
        match &self.0 {
            Inner::Library(library) => Ok(Box::new(library.start(setup)?)),
            Inner::Fmu(fmu) => Ok(Box::new(fmu.start(setup, table)?)),
        }
    }
}
