//! The native module `closecall._native` of the Python package `closecall`.
//!
//! The Python modules of the package are what a user calls. They check and document their arguments, and call this module.
//!
//! | module | holds |
//! |---|---|
//! | `command` | the commands of the program, called from Python |
//! | `scenario` | scenario files and their samples |
//! | `remote` | campaigns whose samples run on a cluster |
//! | `run` | one run, with its trace and its figure |
//! | `controller` | controllers that are Python objects |
//! | `perception` | perceptions that are Python objects |
//! | `episode` | runs that Python steps |
//! | `table` | tables that other libraries read without copying (Arrow) |
//! | `error` | the exceptions |

mod command;
mod controller;
mod episode;
mod error;
mod observation;
mod perception;
mod remote;
mod run;
mod scenario;
mod table;

use pyo3::pymodule;

#[pymodule]
mod _native {
    #[pymodule_export]
    use super::command::{call, main, read_table, set_program, shown};
    #[pymodule_export]
    use super::controller::{ControllerInput, LeadVehicle, Odometry, PythonController, Sensors, Setup, Track, refuse};
    #[pymodule_export]
    use super::episode::{Episode, Episodes};
    #[pymodule_export]
    const ODOMETRY_KEYS: [&str; 18] = super::observation::ODOMETRY_KEYS;
    #[pymodule_export]
    const TRACK_KEYS: [&str; 19] = super::observation::TRACK_KEYS;
    #[pymodule_export]
    use super::perception::{register_perception, unregister_perception};
    #[pymodule_export]
    use super::remote::{BlockRunner, set_engine, version};
    #[pymodule_export]
    use super::run::{Run, run};
    #[pymodule_export]
    use super::scenario::Scenario;
    #[pymodule_export]
    use super::table::{Table, rows_table};
    #[pymodule_export]
    const PYTHON_PREFIX: &str = closecall_simulation::controller::hosted::PREFIX;
    #[pymodule_export]
    const SAMPLE_TIMEOUT_S: f64 = closecall::cli::SAMPLE_TIMEOUT_S;
    #[pymodule_export]
    const CONTROLLER_TIMEOUT_MS: u64 = closecall_simulation::controller::exec::DEFAULT_TIMEOUT_MS;
    #[pymodule_export]
    const CONTROLLER_MEMORY_MIB: u64 = closecall_simulation::controller::exec::DEFAULT_MEMORY_MIB;
    #[pymodule_export]
    const VERSION: &str = env!("CARGO_PKG_VERSION");
}
