//! Scenario files and their samples.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use closecall_campaign::runner::{Sampling, concrete};
use closecall_scenarios::sampling::Design;
use closecall_scenarios::{Scenario as Concrete, ScenarioError, ScenarioFile, Setting, library, source};
use closecall_sensors::SensorMode;
use closecall_simulation::SampleError;
use closecall_traffic::Value;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error::{scenario_exception, usage_exception};

/// A scenario that has been read and checked.
#[pyclass(frozen, module = "closecall._native")]
#[derive(Clone, Debug)]
pub(crate) struct Scenario {
    /// The file, or the name of a scenario of the library, as it was given.
    #[pyo3(get)]
    source: String,
    /// The changes of single values, each as `KEY=VALUE`.
    #[pyo3(get)]
    settings: Vec<String>,
    file: ScenarioFile,
}

impl Scenario {
    /// Checks that the scenario can run with other sensors than its own.
    pub(crate) fn check_in(&self, mode: SensorMode) -> Result<(), ScenarioError> {
        self.file.check_faults_in(mode)
    }

    /// Returns the concrete scenario of one sample, as `closecall run` makes it.
    pub(crate) fn concrete(&self, seed: u64, sample: u64) -> Result<Concrete, SampleError> {
        let sampling = Sampling { seed, design: Design::Random, samples: sample.saturating_add(1) };
        concrete(&self.file, sampling, sample)
    }
}

#[pymethods]
impl Scenario {
    /// Reads a scenario file, or a scenario of the library, applies the settings, and checks it.
    #[staticmethod]
    fn load(py: Python<'_>, source: PathBuf, settings: Vec<String>) -> PyResult<Self> {
        let parse = |text: &String| Setting::from_str(text).map_err(|error| usage_exception(py, &error.to_string()));
        let checked = settings.iter().map(parse).collect::<PyResult<Vec<_>>>()?;
        let file = source::load(&source, &checked).map_err(|error| scenario_exception(py, &error))?;
        file.check().map_err(|error| scenario_exception(py, &error))?;
        Ok(Self { source: source.display().to_string(), settings, file })
    }

    /// Returns the names of the scenarios of the library.
    #[staticmethod]
    fn library() -> Vec<&'static str> {
        library::names().collect()
    }

    #[getter]
    fn name(&self) -> &str {
        &self.file.config().name
    }

    #[getter]
    fn path(&self) -> &Path {
        self.file.path()
    }

    #[getter]
    fn text(&self) -> &str {
        self.file.text()
    }

    /// The names of the sampled parameters.
    #[getter]
    fn parameters(&self) -> Vec<String> {
        self.file.space().iter().map(|(name, _)| name.to_string()).collect()
    }

    /// Returns the parameters of samples 0 to `n` − 1, each as a dictionary.
    fn sample<'py>(&self, py: Python<'py>, seed: u64, n: u64, design: &str) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let design = Design::from_str(design).map_err(|error| usage_exception(py, &error.to_string()))?;
        let space = self.file.space();
        let samples = (0..space.samples(design, n)).map(|sample| {
            let values = PyDict::new(py);
            for (name, value) in space.sample(design, seed, sample, n).iter() {
                match value {
                    Value::Number(number) => values.set_item(name.to_string(), number)?,
                    Value::Label(label) => values.set_item(name.to_string(), label)?,
                }
            }
            Ok(values)
        });
        samples.collect()
    }
}
