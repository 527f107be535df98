//! A controller that is a shared library with the functions of
//! `controllers/include/closecall_controller.h`.

#![expect(unsafe_code, reason = "functions of a loaded library are called")]

use std::ffi::{CStr, c_char, c_void};
use std::path::Path;
use std::sync::Arc;

use libloading::Library as Module;

use crate::external::abi::{
    ABI, AbiFunction, Command, CreateFunction, DestroyFunction, ErrorFunction, StepFunction, TextFunction,
};
use crate::external::arithmetic::Arithmetic;
use crate::external::error::LoadError;
use crate::external::exchange::{Answer, Input, Setup};
use crate::external::foreign::foreign_call;
use crate::external::identity::{Identity, Run};
use crate::external::platform;

/// The functions that a library must export.
const NEEDED: [&str; 4] = [
    "closecall_controller_abi",
    "closecall_controller_create",
    "closecall_controller_step",
    "closecall_controller_destroy",
];

/// The function that says why the last call failed.
const ERROR: &str = "closecall_controller_error";

/// The beginning of the names of the interface.
const PREFIX: &str = "closecall_controller";

/// A library that this process has loaded.
#[derive(Debug)]
pub(crate) struct Library {
    create: CreateFunction,
    step: StepFunction,
    destroy: DestroyFunction,
    error: Option<ErrorFunction>,
    identity: Identity,
    /// Kept loaded for as long as its functions can be called.
    _module: Module,
}

/// Loads a library, with all functions that it needs itself.
pub(crate) fn open(path: &Path) -> Result<Module, LoadError> {
    // The loader of the system searches its own folders for a name without a separator, and not the
    // working folder.
    let absolute =
        std::path::absolute(path).map_err(|source| LoadError::Read { path: path.display().to_string(), source })?;
    #[cfg(unix)]
    let module = {
        use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};
        // SAFETY: this runs code of the library. Worker processes alone do so.
        unsafe { Library::open(Some(&absolute), RTLD_NOW | RTLD_LOCAL) }.map(Module::from)
    };
    #[cfg(not(unix))]
    // SAFETY: this runs code of the library. Worker processes alone do so.
    let module = unsafe { Module::new(&absolute) };
    let reason = |error: libloading::Error| {
        let text = match std::error::Error::source(&error) {
            Some(source) => format!("{error}: {source}"),
            None => error.to_string(),
        };
        let needs_python = ["undefined symbol: Py", "undefined symbol: _Py"].iter().any(|part| text.contains(part));
        let advice = "; it needs a Python interpreter in its process: use the command `closecall` of the Python package, or name \
                      the library of an interpreter in LD_PRELOAD, such as libpython3.11.so.1.0";
        format!("{text}{}", if needs_python { advice } else { "" })
    };
    module.map_err(|error| LoadError::Loader { path: path.display().to_string(), reason: reason(error) })
}

/// Returns a function of a library, or `None` if the library does not export it.
///
/// # Safety
/// The function has the type `F`.
pub(crate) unsafe fn function<F: Copy>(module: &Module, name: &str) -> Option<F> {
    // SAFETY: the caller vouches for the type.
    unsafe { module.get::<F>(name.as_bytes()) }.ok().map(|symbol| *symbol)
}

/// Returns a text of a library.
///
/// # Safety
/// The pointer is null or points to a text that ends with 0.
pub(crate) unsafe fn text(pointer: *const c_char) -> Option<String> {
    // SAFETY: the caller vouches for the pointer.
    (!pointer.is_null()).then(|| unsafe { CStr::from_ptr(pointer) }.to_string_lossy().into_owned())
}

impl Library {
    /// Loads a library.
    pub(crate) fn load(path: &Path) -> Result<Self, LoadError> {
        platform::check(path, &NEEDED, PREFIX)?;
        let _kept = Arithmetic::keep();
        let module = open(path)?;
        let missing = |name: &str| LoadError::Symbol {
            path: path.display().to_string(),
            missing: vec![name.to_owned()],
            actual: Vec::new(),
        };
        // SAFETY: the header declares the functions with these types. The version is asked for
        // first.
        unsafe {
            let abi = function::<AbiFunction>(&module, NEEDED[0]).ok_or_else(|| missing(NEEDED[0]))?;
            let actual = foreign_call(NEEDED[0], || abi());
            if actual != ABI {
                return Err(LoadError::Abi { path: path.display().to_string(), actual, expected: ABI });
            }
            let stated =
                |name| function::<TextFunction>(&module, name).and_then(|stated| text(foreign_call(name, || stated())));
            Ok(Self {
                create: function(&module, NEEDED[1]).ok_or_else(|| missing(NEEDED[1]))?,
                step: function(&module, NEEDED[2]).ok_or_else(|| missing(NEEDED[2]))?,
                destroy: function(&module, NEEDED[3]).ok_or_else(|| missing(NEEDED[3]))?,
                error: function(&module, ERROR),
                identity: Identity {
                    name: stated("closecall_controller_name"),
                    version: stated("closecall_controller_version"),
                },
                _module: module,
            })
        }
    }

    pub(crate) const fn identity(&self) -> &Identity {
        &self.identity
    }

    /// Creates a controller for one run.
    pub(crate) fn start(self: &Arc<Self>, setup: &Setup) -> Result<LibraryRun, String> {
        let _kept = Arithmetic::keep();
        // SAFETY: the view is valid during the call.
        let controller = setup.with_view(|view| foreign_call(NEEDED[1], || unsafe { (self.create)(view) }));
        if controller.is_null() {
            return Err(format!(
                "{} answered null: the library created no controller{}",
                NEEDED[1],
                self.reason(controller)
            ));
        }
        Ok(LibraryRun { library: self.clone(), controller })
    }

    /// Returns the library's text about its last failure, as the end of a message.
    fn reason(&self, controller: *mut c_void) -> String {
        // SAFETY: the controller is null, or lives.
        let stated = self.error.and_then(|error| unsafe { text(foreign_call(ERROR, || error(controller))) });
        stated.map_or_else(|| format!("; a text of `{ERROR}` would say why"), |stated| format!(": {stated}"))
    }
}

/// A controller of a library that drives one run.
pub(crate) struct LibraryRun {
    library: Arc<Library>,
    controller: *mut c_void,
}

// SAFETY: the interface states that one thread at a time calls the functions, and asks for no more.
unsafe impl Send for LibraryRun {}

impl Run for LibraryRun {
    fn step(&mut self, input: &Input) -> Result<Answer, String> {
        let mut command = Command { acceleration_mps2: f64::NAN, state: 0, reserved: 0 };
        let view = input.view();
        let _kept = Arithmetic::keep();
        // SAFETY: the controller lives until it is dropped, and both views are valid during the
        // call.
        let result = foreign_call(NEEDED[2], || unsafe { (self.library.step)(self.controller, &view, &mut command) });
        if result != 0 {
            return Err(format!(
                "the library answered with the error {result}{}",
                self.library.reason(self.controller)
            ));
        }
        Answer::new(command.acceleration_mps2, command.state.into())
            .map_err(|expected| format!("the library answered the state {}: {expected}", command.state))
    }
}

impl Drop for LibraryRun {
    fn drop(&mut self) {
        let _kept = Arithmetic::keep();
        // SAFETY: the library has created the controller, and nothing uses it any more.
        foreign_call(NEEDED[3], || unsafe { (self.library.destroy)(self.controller) });
    }
}
