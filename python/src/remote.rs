//! Campaigns whose samples run on a cluster that a Python library leads: both ends of the way.
//!
//! The engine is a Python object, `closecall.ray.Engine`. The thread that runs the campaign calls it.

use std::sync::Arc;
use std::time::Duration;

use closecall_campaign::manifest;
use closecall_campaign::remote::{self, Cluster, EngineError, RemoteError, Shipment, ShippedFile};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyList};

use crate::error::remote_exception;

/// Exit code of input that cannot be used.
const INPUT: u8 = 3;

/// Returns the version of the program with the identifier of its build.
#[pyfunction]
pub(crate) fn version() -> String {
    manifest::version()
}

/// Sets the engine of the program: an object with a method `connect(address, shipment)`.
#[pyfunction]
pub(crate) fn set_engine(engine: Py<PyAny>) {
    remote::set_engine(Arc::new(PythonEngine(engine)));
}

/// An engine that is a Python object.
struct PythonEngine(Py<PyAny>);

impl remote::Engine for PythonEngine {
    fn connect(&self, address: &str, shipment: &Shipment) -> Result<Box<dyn Cluster>, EngineError> {
        Python::attach(|py| {
            let shipped = PyShipment(shipment.clone()).into_parts(py)?;
            let connected = self.0.bind(py).call_method1("connect", (address, shipped))?;
            Ok::<Box<dyn Cluster>, PyErr>(Box::new(PythonCluster(connected.unbind())))
        })
        .map_err(failed)
    }
}

/// A cluster that is a Python object.
struct PythonCluster(Py<PyAny>);

impl Cluster for PythonCluster {
    fn capacity(&self) -> Result<usize, EngineError> {
        Python::attach(|py| self.0.bind(py).call_method0("capacity")?.extract()).map_err(failed)
    }

    fn submit(&self, block: u64, work: usize, samples: &[u64]) -> Result<(), EngineError> {
        Python::attach(|py| self.0.bind(py).call_method1("submit", (block, work, samples)).map(drop)).map_err(failed)
    }

    fn wait(&self, timeout: Duration) -> Result<Vec<(u64, Vec<u8>)>, EngineError> {
        Python::attach(|py| {
            let done = self.0.bind(py).call_method1("wait", (timeout.as_secs_f64(),))?;
            let done = done.extract::<Vec<(u64, Bound<'_, PyBytes>)>>()?;
            Ok(done.into_iter().map(|(block, bytes)| (block, bytes.as_bytes().to_vec())).collect())
        })
        .map_err(failed)
    }

    fn cancel(&self) {
        Python::attach(|py| unraisable(py, self.0.bind(py).call_method0("cancel")));
    }

    fn close(&self) {
        Python::attach(|py| unraisable(py, self.0.bind(py).call_method0("close")));
    }
}

/// Reports an exception that has no caller.
fn unraisable(py: Python<'_>, result: PyResult<Bound<'_, PyAny>>) {
    if let Err(error) = result {
        error.write_unraisable(py, None);
    }
}

/// Returns the error of an engine. An exception of Closecall says whether the cluster cannot be used as it is.
fn failed(error: PyErr) -> EngineError {
    Python::attach(|py| {
        let value = error.value(py);
        let code = value.getattr("exit_code").and_then(|code| code.extract::<u8>()).ok();
        let message = match code {
            Some(_) => value.to_string(),
            None => error.to_string(),
        };
        EngineError { message, is_input: code == Some(INPUT) }
    })
}

/// A shipment as Python holds it: the version, the manifest, the names of the controllers, and the files.
struct PyShipment(Shipment);

type Parts<'py> = (String, String, Vec<String>, Bound<'py, PyList>);

impl PyShipment {
    fn into_parts(self, py: Python<'_>) -> PyResult<Parts<'_>> {
        let Shipment { version, manifest, controllers, files } = self.0;
        let file = |file: &ShippedFile| (file.name.clone(), PyBytes::new(py, &file.content), file.is_executable);
        Ok((version, manifest, controllers, PyList::new(py, files.iter().map(file))?))
    }
}

/// A campaign, ready to run blocks of its samples.
#[pyclass(frozen, module = "closecall._native")]
pub(crate) struct BlockRunner(remote::BlockRunner);

#[pymethods]
impl BlockRunner {
    /// Prepares the campaign of a shipment. The files are tuples of a name, a content, and whether it is a program.
    #[new]
    fn new(py: Python<'_>, version: String, manifest: String, files: Vec<(String, Vec<u8>, bool)>) -> PyResult<Self> {
        let file = |(name, content, is_executable)| ShippedFile { name, content, is_executable };
        let files = files.into_iter().map(file).collect();
        let shipment = Shipment { version, manifest, controllers: Vec::new(), files };
        let prepared = py.detach(|| remote::BlockRunner::prepare(&shipment));
        Ok(Self(prepared.map_err(|error| raised(py, &error))?))
    }

    /// Runs samples of the scenario with index `work` in one thread, and returns their records.
    fn run<'py>(&self, py: Python<'py>, work: usize, samples: Vec<u64>) -> PyResult<Bound<'py, PyBytes>> {
        let done = py.detach(|| self.0.run(work, &samples));
        Ok(PyBytes::new(py, &done.map_err(|error| raised(py, &error))?))
    }
}

fn raised(py: Python<'_>, error: &RemoteError) -> PyErr {
    remote_exception(py, error.is_input(), &error.to_string())
}
