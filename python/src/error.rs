//! The exceptions, which are defined in `closecall._errors`.

use closecall::cli::CliError;
use closecall::exit_code::ExitCode;
use closecall_scenarios::ScenarioError;
use closecall_simulation::SampleError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Why a call has no result: an exception that is not raised yet.
#[derive(Debug)]
pub(crate) struct Failure {
    code: ExitCode,
    message: String,
    location: Location,
}

/// Where an error is, if it is in a file.
#[derive(Debug, Default)]
struct Location {
    file: Option<String>,
    line: Option<u64>,
    key: Option<String>,
}

impl Failure {
    /// Returns the failure of a command. The thread of the command knows how its caller names arguments.
    pub(crate) fn of(error: &CliError) -> Self {
        let location = match error {
            CliError::Scenario(error) => location_in_scenario(error),
            CliError::TrajectoryData(error) => Location {
                file: Some(error.path.display().to_string()),
                line: error.line,
                key: error.column.map(str::to_owned),
            },
            _ => Location::default(),
        };
        Self { code: ExitCode::from(error), message: error.to_string(), location }
    }

    fn new(code: ExitCode, message: impl Into<String>) -> Self {
        Self { code, message: message.into(), location: Location::default() }
    }
}

/// Returns the exception of a command that has no result.
pub(crate) fn exception(py: Python<'_>, error: &CliError) -> PyErr {
    raise(py, &Failure::of(error))
}

/// Returns the exception of a scenario that cannot be used.
pub(crate) fn scenario_exception(py: Python<'_>, error: &ScenarioError) -> PyErr {
    let (code, message, location) = (ExitCode::from(error), error.to_string(), location_in_scenario(error));
    raise(py, &Failure { code, message, location })
}

/// Returns the exception of wrong arguments.
pub(crate) fn usage_exception(py: Python<'_>, message: &str) -> PyErr {
    raise(py, &Failure::new(ExitCode::Usage, message))
}

/// Returns the exception of samples that cannot run elsewhere.
pub(crate) fn remote_exception(py: Python<'_>, is_input: bool, message: &str) -> PyErr {
    let code = if is_input { ExitCode::InvalidInput } else { ExitCode::Io };
    raise(py, &Failure::new(code, message))
}

/// Returns the exception of a sample that has no outcome.
pub(crate) fn sample_exception(py: Python<'_>, sample: u64, error: &SampleError) -> PyErr {
    raise(py, &Failure::new(ExitCode::SampleError, format!("failed to run sample {sample}: {error}")))
}

fn location_in_scenario(error: &ScenarioError) -> Location {
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

/// Returns the exception of a failure.
pub(crate) fn raise(py: Python<'_>, Failure { code, message, location }: &Failure) -> PyErr {
    let exception = || -> PyResult<PyErr> {
        let named = PyDict::new(py);
        named.set_item("exit_code", *code as u8)?;
        named.set_item("file", &location.file)?;
        named.set_item("line", location.line)?;
        named.set_item("key", &location.key)?;
        let make = py.import("closecall._errors")?.getattr("make")?;
        Ok(PyErr::from_value(make.call((message,), Some(&named))?))
    };
    exception().unwrap_or_else(|error| error)
}
