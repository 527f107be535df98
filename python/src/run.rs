//! One run, with its trace and its figure.

use std::path::PathBuf;
use std::str::FromStr;
use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use closecall_campaign::runner::run_guarded;
use closecall_report::json;
use closecall_report::run::figure::encounter;
use closecall_report::run::film::{Film, FilmRecorder, Level};
use closecall_report::run::rerun::write_recording;
use closecall_report::tables::{ClusterRecorder, TrackRecorder, trace_batch};
use closecall_scenarios::Scenario as Concrete;
use closecall_scenarios::outcome::Outcome;
use closecall_sensors::SensorMode;
use closecall_simulation::controller::ControllerChoice;
use closecall_simulation::perception::try_program;
use closecall_simulation::trajectories::TraceRecorder;
use closecall_simulation::{Arm, ControllerFactory, Observer, RunEvent, RunKey, SampleError, SettlingView, StepView};
use closecall_traffic::{Time, VehicleState};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;

use crate::controller::PythonController;
use crate::error::{exception, sample_exception, scenario_exception, usage_exception};
use crate::scenario::Scenario;
use crate::table::Table;

/// Interval at which Python's signals are looked at.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// Returns the depth of the sensor simulation that a word stands for.
pub(crate) fn sensor_mode(py: Python<'_>, word: Option<&str>) -> PyResult<Option<SensorMode>> {
    match word {
        None => Ok(None),
        Some("full") => Ok(Some(SensorMode::Full)),
        Some("object") => Ok(Some(SensorMode::Object)),
        Some("ground-truth") => Ok(Some(SensorMode::GroundTruth)),
        Some(other) => {
            let message = format!("sensors: expected `full`, `object` or `ground-truth`, not `{other}`");
            Err(usage_exception(py, &message))
        }
    }
}

/// A run that has been completed.
#[pyclass(frozen, module = "closecall._native")]
pub(crate) struct Run {
    outcome: Outcome,
    film: Film,
    trace: TraceRecorder,
    tracks: TrackRecorder,
    clusters: ClusterRecorder,
}

#[pymethods]
impl Run {
    /// Returns the outcome as JSON, with the keys of `closecall run --format json`.
    fn json(&self) -> String {
        json::outcome(&self.outcome).to_string()
    }

    /// Returns the trace: a row for each control step and actor.
    fn trace(&self) -> PyResult<Table> {
        let batch = trace_batch(&self.trace.rows).map_err(|error| PyValueError::new_err(error.to_string()))?;
        Ok(batch.into())
    }

    /// Returns the tracks: a row for each control step and track.
    fn tracks(&self) -> PyResult<Table> {
        let batch = self.tracks.batch().map_err(|error| PyValueError::new_err(error.to_string()))?;
        Ok(batch.into())
    }

    /// Returns the clusters and boxes: a row for each of each scan.
    fn clusters(&self) -> PyResult<Table> {
        let batch = self.clusters.batch().map_err(|error| PyValueError::new_err(error.to_string()))?;
        Ok(batch.into())
    }

    /// Writes a recording (Rerun file).
    fn record(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let written = py.detach(|| write_recording(&path, std::slice::from_ref(&self.film)));
        written.map_err(|error| exception(py, &error.into()))
    }

    /// Returns the figure of the encounter as SVG.
    fn figure(&self) -> String {
        encounter(std::slice::from_ref(&self.film))
    }
}

/// Records the film and the tables of a run.
struct Recorders {
    film: FilmRecorder,
    trace: TraceRecorder,
    tracks: TrackRecorder,
    clusters: ClusterRecorder,
}

impl Observer for Recorders {
    fn step(&mut self, view: &StepView<'_>) {
        self.film.step(view);
        self.trace.step(view);
        self.tracks.step(view);
        self.clusters.step(view);
    }

    fn settling(&mut self, view: &SettlingView<'_>) {
        self.clusters.settling(view);
    }

    fn event(&mut self, time: Time, what: &RunEvent) {
        self.film.event(time, what);
    }

    fn moved(&mut self, time: Time, vehicles: &mut dyn Iterator<Item = VehicleState>) {
        self.film.moved(time, vehicles);
    }
}

/// Runs one sample of a scenario. `controller` is a name, or a controller that is a Python object.
#[pyfunction]
#[pyo3(signature = (scenario, controller, seed, sample, sensors=None))]
pub(crate) fn run(
    py: Python<'_>,
    scenario: &Bound<'_, Scenario>,
    controller: &Bound<'_, PyAny>,
    seed: u64,
    sample: u64,
    sensors: Option<&str>,
) -> PyResult<Run> {
    let own = controller.cast::<PythonController>().ok();
    let factory: Arc<dyn ControllerFactory> = match &own {
        Some(own) => own.get().factory(py),
        None => {
            let name: String = controller.extract()?;
            let choice = ControllerChoice::from_str(&name).map_err(|error| usage_exception(py, &error.to_string()))?;
            py.detach(|| choice.try_in(None)).map_err(|error| exception(py, &error.into()))?;
            choice.factory()
        }
    };
    let native = factory.isolated().and_then(|isolated| Some(isolated.native()?.settings().clone()));
    let arm = Arm { controller: factory, sensors: sensor_mode(py, sensors)? };
    let concrete = scenario.get().concrete(seed, sample).map_err(|error| sample_exception(py, sample, &error))?;
    if let Some(program) = concrete.sensors.program() {
        let checked = arm.sensors.map_or(Ok(()), |mode| scenario.get().check_in(mode));
        checked.map_err(|error| scenario_exception(py, &error))?;
        py.detach(|| try_program(&program)).map_err(|error| exception(py, &error.into()))?;
    }
    if let Some(native) = native {
        let checked = py.detach(|| native.check_variables(&concrete, None));
        checked.map_err(|error| exception(py, &error.into()))?;
    }
    let (sender, mut receiver) = channel();
    // The receiver is gone if Ctrl-C has ended the call.
    let body = move || {
        let mut done = None;
        arm.controller.in_thread(&mut || done = Some(record(&concrete, RunKey { seed, sample }, &arm)));
        done.is_some_and(|done| sender.send(done).is_ok())
    };
    thread::Builder::new().name("run".to_owned()).spawn(body)?;
    loop {
        let results = &mut receiver;
        match py.detach(move || results.recv_timeout(POLL_INTERVAL)) {
            Ok(Ok(run)) => return Ok(run),
            Ok(Err(error)) => {
                let exception = sample_exception(py, sample, &error);
                exception.set_cause(py, own.and_then(|own| own.get().take_failure()));
                return Err(exception);
            }
            Err(RecvTimeoutError::Disconnected) => {
                return Err(PyRuntimeError::new_err("the run has panicked: the message is on standard error"));
            }
            // The run goes on unseen, unless its controller is a Python object.
            Err(RecvTimeoutError::Timeout) => py.check_signals().inspect_err(|_| {
                if let Some(own) = &own {
                    own.get().cancel();
                }
            })?,
        }
    }
}

fn record(scenario: &Concrete, key: RunKey, arm: &Arm) -> Result<Run, SampleError> {
    let film = FilmRecorder::new(scenario, key, arm, Level::Objects);
    let mut recorders = Recorders {
        film,
        trace: TraceRecorder::default(),
        tracks: TrackRecorder::default(),
        clusters: ClusterRecorder::default(),
    };
    let outcome = run_guarded(scenario, key, arm, &mut recorders)?;
    let Recorders { film, trace, tracks, clusters } = recorders;
    Ok(Run { film: film.finish(&outcome), outcome, trace, tracks, clusters })
}
