//! A controller that is a functional mock-up unit (FMU) for co-simulation.
//!
//! ```text
//!  PATH.fmu ─▶ archive: unpacked, with a binary for this platform ─▶ description: version, variables, step size
//!           ─▶ mapping: which variable gets which quantity        ─▶ instance: FMI 2.0 or 3.0, one for each run
//! ```
//!
//! In each control step at time t, the inputs are set to the values at t, `doStep` goes from t to
//! the next control step, and the outputs after it are the command. An FMU with a fixed step makes
//! several steps in a control step, with the same inputs.
//!
//! The functions and structures follow the C headers that the standard publishes:
//! `fmi2FunctionTypes.h` of FMI 2.0.4 and `fmi3FunctionTypes.h` of FMI 3.0.2
//! (<https://github.com/modelica/fmi-standard>).

mod archive;
mod description;
mod fmi2;
mod fmi3;
mod mapping;
mod quantity;
mod run;

pub(crate) use archive::{remove_unpacked, unpacked_for_children, use_unpacked};
pub use mapping::{Given, VariableTable};
pub(crate) use run::Fmu;
