//! The functions of FMI 3.0 for co-simulation.

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
type References = *const u32;
type Logger = unsafe extern "C" fn(*mut c_void, Status, *const c_char, *const c_char);
type Setter<T> = unsafe extern "C-unwind" fn(Component, References, usize, *const T, usize) -> Status;
type Getter<T> = unsafe extern "C-unwind" fn(Component, References, usize, *mut T, usize) -> Status;

/// The last message that an FMU has logged.
static LOGGED: Mutex<String> = Mutex::new(String::new());

unsafe extern "C" fn log(_: *mut c_void, status: Status, _: *const c_char, message: *const c_char) {
    // SAFETY: the FMU passes a text that ends with 0.
    if let (Some(message), Ok(mut logged)) = (unsafe { text(message) }, LOGGED.lock())
        && status > WARNING
    {
        *logged = message;
    }
}

/// The largest status that is no failure: `fmi3Warning`.
const WARNING: Status = 1;
/// `fmi3Fatal`: the instance must not be used any more.
const FATAL: Status = 4;

/// The functions that are used.
#[derive(Clone, Copy, Debug)]
pub(super) struct Functions {
    instantiate: unsafe extern "C-unwind" fn(
        *const c_char,
        *const c_char,
        *const c_char,
        bool,
        bool,
        bool,
        bool,
        References,
        usize,
        *mut c_void,
        Option<Logger>,
        *const c_void,
    ) -> Component,
    free_instance: unsafe extern "C-unwind" fn(Component),
    enter: unsafe extern "C-unwind" fn(Component, bool, f64, f64, bool, f64) -> Status,
    exit: unsafe extern "C-unwind" fn(Component) -> Status,
    terminate: unsafe extern "C-unwind" fn(Component) -> Status,
    reset: unsafe extern "C-unwind" fn(Component) -> Status,
    do_step: unsafe extern "C-unwind" fn(Component, f64, f64, bool, *mut u8, *mut u8, *mut u8, *mut f64) -> Status,
    set_f64: Setter<f64>,
    get_f64: Getter<f64>,
    set_f32: Option<Setter<f32>>,
    get_f32: Option<Getter<f32>>,
    set_i32: Option<Setter<i32>>,
    get_i32: Option<Getter<i32>>,
    set_u32: Option<Setter<u32>>,
    get_u32: Option<Getter<u32>>,
    set_i64: Option<Setter<i64>>,
    get_i64: Option<Getter<i64>>,
    set_u64: Option<Setter<u64>>,
    get_u64: Option<Getter<u64>>,
    set_bool: Option<Setter<bool>>,
}

/// The names of the functions that every FMU must have.
pub(super) const NEEDED: [&str; 9] = [
    "fmi3InstantiateCoSimulation",
    "fmi3FreeInstance",
    "fmi3EnterInitializationMode",
    "fmi3ExitInitializationMode",
    "fmi3Terminate",
    "fmi3Reset",
    "fmi3DoStep",
    "fmi3SetFloat64",
    "fmi3GetFloat64",
];

impl Functions {
    /// Returns the functions of a library; `None` if it lacks one that every FMU must have.
    pub(super) fn of(module: &Module) -> Option<Self> {
        // SAFETY: the standard declares the functions with these types.
        unsafe {
            Some(Self {
                instantiate: function(module, NEEDED[0])?,
                free_instance: function(module, NEEDED[1])?,
                enter: function(module, NEEDED[2])?,
                exit: function(module, NEEDED[3])?,
                terminate: function(module, NEEDED[4])?,
                reset: function(module, NEEDED[5])?,
                do_step: function(module, NEEDED[6])?,
                set_f64: function(module, NEEDED[7])?,
                get_f64: function(module, NEEDED[8])?,
                set_f32: function(module, "fmi3SetFloat32"),
                get_f32: function(module, "fmi3GetFloat32"),
                set_i32: function(module, "fmi3SetInt32"),
                get_i32: function(module, "fmi3GetInt32"),
                set_u32: function(module, "fmi3SetUInt32"),
                get_u32: function(module, "fmi3GetUInt32"),
                set_i64: function(module, "fmi3SetInt64"),
                get_i64: function(module, "fmi3GetInt64"),
                set_u64: function(module, "fmi3SetUInt64"),
                get_u64: function(module, "fmi3GetUInt64"),
                set_bool: function(module, "fmi3SetBoolean"),
            })
        }
    }
}

/// Returns the type with whose functions a variable is set and read.
const fn stored_as(of_type: Type) -> Type {
    if matches!(of_type, Type::Enumeration) { Type::Int64 } else { of_type }
}

/// An instance of the FMU.
pub(super) struct Instance3 {
    functions: Functions,
    component: Component,
    is_initialized: bool,
    is_dead: bool,
}

// SAFETY: one thread at a time uses an instance, which the standard asks for.
unsafe impl Send for Instance3 {}

/// Returns the last message of the FMU, as the end of a message.
fn logged() -> String {
    match LOGGED.lock() {
        Ok(logged) if !logged.is_empty() => format!(": {logged}"),
        _ => "; a message to its logger would say why".to_owned(),
    }
}

impl Instance3 {
    /// Creates an instance.
    pub(super) fn new(functions: Functions, description: &Description, resources: &Path) -> Result<Self, String> {
        if let Ok(mut logged) = LOGGED.lock() {
            logged.clear();
        }
        let text = |text: &str| CString::new(text).map_err(|error| error.to_string());
        let (name, token) = (text("closecall")?, text(&description.token)?);
        // The path of the folder ends with a separator.
        let folder = text(&format!("{}/", resources.display()))?;
        let (none, nothing) = (std::ptr::null(), std::ptr::null_mut());
        // SAFETY: the texts live during the call.
        let component = foreign_call("fmi3InstantiateCoSimulation", || unsafe {
            (functions.instantiate)(
                name.as_ptr(),
                token.as_ptr(),
                folder.as_ptr(),
                false,
                false,
                false,
                false,
                none,
                0,
                nothing,
                Some(log),
                std::ptr::null(),
            )
        });
        if component.is_null() {
            return Err(format!("fmi3InstantiateCoSimulation answered null: the FMU created no instance{}", logged()));
        }
        Ok(Self { functions, component, is_initialized: false, is_dead: false })
    }

    fn check(&mut self, status: Status, call: &str) -> Result<(), String> {
        if status <= WARNING {
            return Ok(());
        }
        self.is_dead = status == FATAL;
        let names = ["OK", "Warning", "Discard", "Error", "Fatal"];
        let name = usize::try_from(status).ok().and_then(|index| names.get(index)).unwrap_or(&"of no name");
        Err(format!("{call} answered fmi3{name}{}", logged()))
    }

    /// Sets one variable with a function that the FMU may lack.
    fn set_with<T>(&self, setter: Option<Setter<T>>, reference: u32, value: T) -> Result<Status, String> {
        let setter = setter.ok_or("the FMU lacks the function that sets one of its variables")?;
        // SAFETY: the instance lives, and the value lives during the call.
        Ok(foreign_call("a function fmi3Set…", || unsafe {
            setter(self.component, &raw const reference, 1, &raw const value, 1)
        }))
    }

    /// Reads one variable with a function that the FMU may lack.
    fn get_with<T: Default>(&self, getter: Option<Getter<T>>, reference: u32) -> Result<(Status, T), String> {
        let getter = getter.ok_or("the FMU lacks the function that reads one of its variables")?;
        let mut value = T::default();
        // SAFETY: as above.
        let status = foreign_call("a function fmi3Get…", || unsafe {
            getter(self.component, &raw const reference, 1, &raw mut value, 1)
        });
        Ok((status, value))
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "the variables hold small whole numbers; a cast saturates"
)]
impl Instance for Instance3 {
    fn enter(&mut self, start_s: f64) -> Result<(), String> {
        // SAFETY: the instance lives, here and below.
        let status = foreign_call("fmi3EnterInitializationMode", || unsafe {
            (self.functions.enter)(self.component, false, 0.0, start_s, false, 0.0)
        });
        self.is_initialized = true;
        self.check(status, "fmi3EnterInitializationMode")
    }

    fn exit(&mut self) -> Result<(), String> {
        // SAFETY: as above.
        let status = foreign_call("fmi3ExitInitializationMode", || unsafe { (self.functions.exit)(self.component) });
        self.check(status, "fmi3ExitInitializationMode")
    }

    fn set(&mut self, reference: u32, of_type: Type, value: f64) -> Result<(), String> {
        let functions = self.functions;
        let status = match of_type {
            Type::Float64 => self.set_with(Some(functions.set_f64), reference, value),
            Type::Float32 => self.set_with(functions.set_f32, reference, value as f32),
            Type::Int32 => self.set_with(functions.set_i32, reference, value as i32),
            Type::UInt32 => self.set_with(functions.set_u32, reference, value as u32),
            Type::Int64 | Type::Enumeration => self.set_with(functions.set_i64, reference, value as i64),
            Type::UInt64 => self.set_with(functions.set_u64, reference, value as u64),
            Type::Boolean => self.set_with(functions.set_bool, reference, value != 0.0),
            Type::Other => Err("a variable has a type that cannot be set".to_owned()),
        }?;
        self.check(status, &format!("fmi3Set{}", stored_as(of_type)))
    }

    fn get(&mut self, reference: u32, of_type: Type) -> Result<f64, String> {
        let functions = self.functions;
        let (status, value) = match of_type {
            Type::Float64 => self.get_with(Some(functions.get_f64), reference)?,
            Type::Float32 => {
                self.get_with(functions.get_f32, reference).map(|(status, value)| (status, value.into()))?
            }
            Type::Int32 => self.get_with(functions.get_i32, reference).map(|(status, value)| (status, value.into()))?,
            Type::UInt32 => {
                self.get_with(functions.get_u32, reference).map(|(status, value)| (status, value.into()))?
            }
            Type::Int64 | Type::Enumeration => {
                self.get_with(functions.get_i64, reference).map(|(status, value)| (status, value as f64))?
            }
            Type::UInt64 => {
                self.get_with(functions.get_u64, reference).map(|(status, value)| (status, value as f64))?
            }
            Type::Boolean | Type::Other => return Err("a variable has a type that cannot be read".to_owned()),
        };
        self.check(status, &format!("fmi3Get{}", stored_as(of_type)))?;
        Ok(value)
    }

    fn do_step(&mut self, time_s: f64, step_s: f64) -> Result<(), String> {
        // The FMU may write any byte, and a `bool` of Rust must be 0 or 1.
        let (mut event, mut ends, mut is_early, mut reached_s) = (0_u8, 0_u8, 0_u8, time_s);
        // SAFETY: as above; the values live during the call.
        let status = foreign_call("fmi3DoStep", || unsafe {
            (self.functions.do_step)(
                self.component,
                time_s,
                step_s,
                true,
                &raw mut event,
                &raw mut ends,
                &raw mut is_early,
                &raw mut reached_s,
            )
        });
        self.check(status, "fmi3DoStep")?;
        if ends != 0 {
            return Err(format!("the FMU asked to end the simulation{}", logged()));
        }
        if is_early != 0 {
            return Err(format!("fmi3DoStep returned early, at {reached_s} s: that was not allowed"));
        }
        Ok(())
    }

    fn terminate(&mut self) -> Result<(), String> {
        self.is_initialized = false;
        // SAFETY: as above.
        let status = foreign_call("fmi3Terminate", || unsafe { (self.functions.terminate)(self.component) });
        self.check(status, "fmi3Terminate")
    }

    fn reset(&mut self) -> Result<(), String> {
        // SAFETY: as above.
        let status = foreign_call("fmi3Reset", || unsafe { (self.functions.reset)(self.component) });
        self.is_initialized = false;
        self.check(status, "fmi3Reset")
    }
}

impl Drop for Instance3 {
    fn drop(&mut self) {
        // After a fatal error, no function may be called.
        if !self.is_dead {
            // SAFETY: as above. Nothing uses the instance any more.
            unsafe {
                if self.is_initialized {
                    foreign_call("fmi3Terminate", || (self.functions.terminate)(self.component));
                }
                foreign_call("fmi3FreeInstance", || (self.functions.free_instance)(self.component));
            }
        }
    }
}
