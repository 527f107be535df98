//! The exceptions, which are defined in `closecall._errors`.

use closecall::cli::CliError;
use closecall::exit_code::ExitCode;
use closecall_scenarios::ScenarioError;
use closecall_simulation::SampleError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Where an error is, if it is in a file.
#[derive(Default)]
struct Location {
    file: Option<String>,
    line: Option<u64>,
    key: Option<String>,
}

/// What the parser of the command line adds, which says nothing to a caller in Python.
const HELP: &str = "For more information, try '--help'.";

/// Returns the exception of a command that has no result.
pub(crate) fn exception(py: Python<'_>, error: &CliError) -> PyErr {
    let location = match error {
        CliError::Scenario(error) => of_scenario(error),
        CliError::TrajectoryData(error) => Location {
            file: Some(error.path.display().to_string()),
            line: error.line,
            key: error.column.map(str::to_owned),
        },
        _ => Location::default(),
    };
    let message = error.to_string();
    let message = message.trim_end().strip_suffix(HELP).unwrap_or(&message).trim_end();
    raise(py, ExitCode::from(error), message, &location)
}

/// Returns the exception of a scenario that cannot be used.
pub(crate) fn scenario_exception(py: Python<'_>, error: &ScenarioError) -> PyErr {
    raise(py, ExitCode::from(error), &error.to_string(), &of_scenario(error))
}

/// Returns the exception of wrong arguments.
pub(crate) fn usage_exception(py: Python<'_>, message: &str) -> PyErr {
    raise(py, ExitCode::Usage, message, &Location::default())
}

/// Returns the exception of samples that cannot run elsewhere.
pub(crate) fn remote_exception(py: Python<'_>, is_input: bool, message: &str) -> PyErr {
    let code = if is_input { ExitCode::InvalidInput } else { ExitCode::Io };
    raise(py, code, message, &Location::default())
}

/// Returns the exception of a sample that has no outcome.
pub(crate) fn sample_exception(py: Python<'_>, sample: u64, error: &SampleError) -> PyErr {
    let message = format!("failed to run sample {sample}: {error}");
    raise(py, ExitCode::SampleError, &message, &Location::default())
}

fn of_scenario(error: &ScenarioError) -> Location {
    let key = match error {
        ScenarioError::Value { source, .. } => Some(source.path.to_string()),
        ScenarioError::UnusedParameter { name, .. } => Some(format!("parameters.{name}")),
        _ => None,
    };
    let file = match error {
        ScenarioError::Read { path, .. }
        | ScenarioError::NotText { path, .. }
        | ScenarioError::TooLarge { path, .. }
        | ScenarioError::Empty { path }
        | ScenarioError::Syntax { path, .. }
        | ScenarioError::Value { path, .. }
        | ScenarioError::UnusedParameter { path, .. }
        | ScenarioError::Set { path, .. } => Some(path.display().to_string()),
        ScenarioError::Unknown { .. } => None,
    };
    Location { file, line: error.line().map(|line| line as u64), key }
}

fn raise(py: Python<'_>, code: ExitCode, message: &str, location: &Location) -> PyErr {
    let exception = || -> PyResult<PyErr> {
        let named = PyDict::new(py);
        named.set_item("exit_code", code as u8)?;
        named.set_item("file", &location.file)?;
        named.set_item("line", location.line)?;
        named.set_item("key", &location.key)?;
        let make = py.import("closecall._errors")?.getattr("make")?;
        Ok(PyErr::from_value(make.call((message,), Some(&named))?))
    };
    exception().unwrap_or_else(|error| error)
}
