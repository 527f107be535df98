//! The functions of FMI 2.0 for co-simulation.

#![expect(unsafe_code, reason = "functions of a loaded library are called")]

use std::ffi::{CString, c_char, c_int, c_void};
use std::path::Path;
use std::sync::Mutex;

use libloading::Library as Module;

use super::description::{Description, Type};
use super::run::Instance;
use crate::external::foreign::foreign_call;
use crate::external::library::{function, text};

type Component = *mut c_void;
type Status = c_int;

/// The functions of the environment: `fmi2CallbackFunctions`.
#[repr(C)]
struct Callbacks {
    /// The function of the standard has further arguments, to which the placeholders of the message
    /// refer. A function of Rust cannot read them.
    logger: unsafe extern "C" fn(*mut c_void, *const c_char, Status, *const c_char, *const c_char),
    allocate: unsafe extern "C" fn(usize, usize) -> *mut c_void,
    free: unsafe extern "C" fn(*mut c_void),
    step_finished: Option<unsafe extern "C" fn(*mut c_void, Status)>,
    environment: *mut c_void,
}

unsafe extern "C" {
    fn calloc(count: usize, size: usize) -> *mut c_void;
    fn free(block: *mut c_void);
}

/// The last message that an FMU has logged.
static LOGGED: Mutex<String> = Mutex::new(String::new());

unsafe extern "C" fn log(_: *mut c_void, _: *const c_char, status: Status, _: *const c_char, message: *const c_char) {
    // SAFETY: the FMU passes a text that ends with 0.
    if let (Some(message), Ok(mut logged)) = (unsafe { text(message) }, LOGGED.lock())
        && status > WARNING
    {
        *logged = with_note(message);
    }
}

/// The note about a message whose values are missing.
const NO_VALUES: &str = "(Closecall does not fill in the values of this message)";

/// Returns a message with the note that its values are missing, if it has placeholders of `printf`.
fn with_note(message: String) -> String {
    let literal = message.replace("%%", "");
    let flags_and_width = |c: char| c.is_ascii_digit() || "-+ #.*hlLqjzt".contains(c);
    let is_placeholder =
        |rest: &str| rest.trim_start_matches(flags_and_width).starts_with(|c: char| "diouxXeEfFgGaAcsp".contains(c));
    let has_placeholder = literal.split('%').skip(1).any(is_placeholder);
    let message = message.replace("%%", "%");
    if has_placeholder { format!("{message} {NO_VALUES}") } else { message }
}

/// The largest status that is no failure: `fmi2Warning`.
const WARNING: Status = 1;
/// `fmi2Fatal`: the instance must not be used any more.
const FATAL: Status = 4;
/// `fmi2CoSimulation`.
const CO_SIMULATION: c_int = 1;

pub(super) type References = *const u32;

/// The functions that are used.
#[derive(Clone, Copy, Debug)]
pub(super) struct Functions {
    instantiate: unsafe extern "C-unwind" fn(
        *const c_char,
        c_int,
        *const c_char,
        *const c_char,
        *const Callbacks,
        c_int,
        c_int,
    ) -> Component,
    free_instance: unsafe extern "C-unwind" fn(Component),
    setup: unsafe extern "C-unwind" fn(Component, c_int, f64, f64, c_int, f64) -> Status,
    enter: unsafe extern "C-unwind" fn(Component) -> Status,
    exit: unsafe extern "C-unwind" fn(Component) -> Status,
    terminate: unsafe extern "C-unwind" fn(Component) -> Status,
    reset: unsafe extern "C-unwind" fn(Component) -> Status,
    set_real: unsafe extern "C-unwind" fn(Component, References, usize, *const f64) -> Status,
    set_integer: unsafe extern "C-unwind" fn(Component, References, usize, *const c_int) -> Status,
    set_boolean: unsafe extern "C-unwind" fn(Component, References, usize, *const c_int) -> Status,
    get_real: unsafe extern "C-unwind" fn(Component, References, usize, *mut f64) -> Status,
    get_integer: unsafe extern "C-unwind" fn(Component, References, usize, *mut c_int) -> Status,
    do_step: unsafe extern "C-unwind" fn(Component, f64, f64, c_int) -> Status,
}

/// The names of the functions that are used.
pub(super) const NEEDED: [&str; 13] = [
    "fmi2Instantiate",
    "fmi2FreeInstance",
    "fmi2SetupExperiment",
    "fmi2EnterInitializationMode",
    "fmi2ExitInitializationMode",
    "fmi2Terminate",
    "fmi2Reset",
    "fmi2SetReal",
    "fmi2SetInteger",
    "fmi2SetBoolean",
    "fmi2GetReal",
    "fmi2GetInteger",
    "fmi2DoStep",
];

impl Functions {
    /// Returns the functions of a library; `None` if it lacks one.
    pub(super) fn of(module: &Module) -> Option<Self> {
        // SAFETY: the standard declares the functions with these types.
        unsafe {
            Some(Self {
                instantiate: function(module, NEEDED[0])?,
                free_instance: function(module, NEEDED[1])?,
                setup: function(module, NEEDED[2])?,
                enter: function(module, NEEDED[3])?,
                exit: function(module, NEEDED[4])?,
                terminate: function(module, NEEDED[5])?,
                reset: function(module, NEEDED[6])?,
                set_real: function(module, NEEDED[7])?,
                set_integer: function(module, NEEDED[8])?,
                set_boolean: function(module, NEEDED[9])?,
                get_real: function(module, NEEDED[10])?,
                get_integer: function(module, NEEDED[11])?,
                do_step: function(module, NEEDED[12])?,
            })
        }
    }
}

/// An instance of the FMU.
pub(super) struct Instance2 {
    functions: Functions,
    component: Component,
    /// The FMU keeps a pointer to them.
    _callbacks: Box<Callbacks>,
    is_initialized: bool,
    is_dead: bool,
}

// SAFETY: one thread at a time uses an instance, which the standard asks for.
unsafe impl Send for Instance2 {}

impl Instance2 {
    /// Creates an instance.
    pub(super) fn new(functions: Functions, description: &Description, resources: &Path) -> Result<Self, String> {
        if let Ok(mut logged) = LOGGED.lock() {
            logged.clear();
        }
        let callbacks = Box::new(Callbacks {
            logger: log,
            allocate: calloc,
            free,
            step_finished: None,
            environment: std::ptr::null_mut(),
        });
        let text = |text: &str| CString::new(text).map_err(|error| error.to_string());
        let (name, token) = (text("closecall")?, text(&description.token)?);
        let folder = text(&format!("file://{}", resources.display()))?;
        // SAFETY: the texts live during the call, the callbacks as long as the instance.
        let component = foreign_call("fmi2Instantiate", || unsafe {
            (functions.instantiate)(
                name.as_ptr(),
                CO_SIMULATION,
                token.as_ptr(),
                folder.as_ptr(),
                &raw const *callbacks,
                0,
                0,
            )
        });
        if component.is_null() {
            return Err(format!("fmi2Instantiate answered null: the FMU created no instance{}", logged()));
        }
        Ok(Self { functions, component, _callbacks: callbacks, is_initialized: false, is_dead: false })
    }

    fn check(&mut self, status: Status, call: &str) -> Result<(), String> {
        if status <= WARNING {
            return Ok(());
        }
        self.is_dead = status == FATAL;
        let names = ["OK", "Warning", "Discard", "Error", "Fatal", "Pending"];
        let name = usize::try_from(status).ok().and_then(|index| names.get(index)).unwrap_or(&"of no name");
        Err(format!("{call} answered fmi2{name}{}", logged()))
    }
}

/// Returns the last message of the FMU, as the end of a message.
fn logged() -> String {
    match LOGGED.lock() {
        Ok(logged) if !logged.is_empty() => format!(": {logged}"),
        _ => "; a message to its logger would say why".to_owned(),
    }
}

impl Instance for Instance2 {
    fn enter(&mut self, start_s: f64) -> Result<(), String> {
        // SAFETY: the instance lives, here and below.
        let status = foreign_call("fmi2SetupExperiment", || unsafe {
            (self.functions.setup)(self.component, 0, 0.0, start_s, 0, 0.0)
        });
        self.check(status, "fmi2SetupExperiment")?;
        // SAFETY: as above.
        let status = foreign_call("fmi2EnterInitializationMode", || unsafe { (self.functions.enter)(self.component) });
        self.is_initialized = true;
        self.check(status, "fmi2EnterInitializationMode")
    }

    fn exit(&mut self) -> Result<(), String> {
        // SAFETY: as above.
        let status = foreign_call("fmi2ExitInitializationMode", || unsafe { (self.functions.exit)(self.component) });
        self.check(status, "fmi2ExitInitializationMode")
    }

    fn set(&mut self, reference: u32, of_type: Type, value: f64) -> Result<(), String> {
        #[expect(clippy::cast_possible_truncation, reason = "whole numbers; a cast saturates")]
        let whole = value as c_int;
        let function = match of_type {
            Type::Float64 | Type::Float32 => "fmi2SetReal",
            Type::Boolean => "fmi2SetBoolean",
            _ => "fmi2SetInteger",
        };
        // SAFETY: as above; the values live during the call.
        let status = foreign_call(function, || unsafe {
            match of_type {
                Type::Float64 | Type::Float32 => {
                    (self.functions.set_real)(self.component, &raw const reference, 1, &raw const value)
                }
                Type::Boolean => {
                    let truth = c_int::from(value != 0.0);
                    (self.functions.set_boolean)(self.component, &raw const reference, 1, &raw const truth)
                }
                _ => (self.functions.set_integer)(self.component, &raw const reference, 1, &raw const whole),
            }
        });
        self.check(status, function)
    }

    fn get(&mut self, reference: u32, of_type: Type) -> Result<f64, String> {
        let (mut value, mut whole) = (f64::NAN, 0);
        let is_real = of_type.is_real();
        let function = if is_real { "fmi2GetReal" } else { "fmi2GetInteger" };
        // SAFETY: as above.
        let status = foreign_call(function, || unsafe {
            match is_real {
                true => (self.functions.get_real)(self.component, &raw const reference, 1, &raw mut value),
                false => (self.functions.get_integer)(self.component, &raw const reference, 1, &raw mut whole),
            }
        });
        self.check(status, function)?;
        Ok(if is_real { value } else { f64::from(whole) })
    }

    fn do_step(&mut self, time_s: f64, step_s: f64) -> Result<(), String> {
        // SAFETY: as above.
        let status =
            foreign_call("fmi2DoStep", || unsafe { (self.functions.do_step)(self.component, time_s, step_s, 1) });
        self.check(status, "fmi2DoStep")
    }

    fn terminate(&mut self) -> Result<(), String> {
        self.is_initialized = false;
        // SAFETY: as above.
        let status = foreign_call("fmi2Terminate", || unsafe { (self.functions.terminate)(self.component) });
        self.check(status, "fmi2Terminate")
    }

    fn reset(&mut self) -> Result<(), String> {
        // SAFETY: as above.
        let status = foreign_call("fmi2Reset", || unsafe { (self.functions.reset)(self.component) });
        self.is_initialized = false;
        self.check(status, "fmi2Reset")
    }
}

impl Drop for Instance2 {
    fn drop(&mut self) {
        // After a fatal error, no function may be called.
        if !self.is_dead {
            // SAFETY: as above. Nothing uses the instance any more.
            unsafe {
                if self.is_initialized {
                    foreign_call("fmi2Terminate", || (self.functions.terminate)(self.component));
                }
                foreign_call("fmi2FreeInstance", || (self.functions.free_instance)(self.component));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_with_placeholders_says_that_its_values_are_missing() {
        for message in ["solver did not converge at %g s", "no licence for %s", "%-8.3lf m left", "%d of 100 %%"] {
            let shown = with_note(message.to_owned());
            let expected = format!("{} {NO_VALUES}", message.replace("%%", "%"));
            assert_eq!(shown, expected);
        }
        for (message, shown) in [
            ("the solver does not converge", "the solver does not converge"),
            ("100 %% done", "100 % done"),
            ("50 %", "50 %"),
        ] {
            assert_eq!(with_note(message.to_owned()), shown);
        }
    }
}
